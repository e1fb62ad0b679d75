#!/usr/bin/env python3
"""Flash and RAM of images, from their maps: size.py BOARD.map...

What is portable and on every board, motion/core, firmware/control and a kind of
drive, is bounded: status 1 when it takes more than 48 KB of flash, or what an
axis has beside its tracks more than 1 KB of RAM, or an image may need more stack
(stack.py) than it has.  What a run has used of it (BOARD.painted, left by `make
test-firmware`) stands beside that.
"""
import collections
import os
import re
import subprocess
import sys
import tempfile

import stack

CROSS = os.environ.get("CROSS", "arm-none-eabi-")
NM = CROSS + "nm"
PORTABLE = re.compile(r"motion/core/|firmware/control/|hal/drive/virtual/")
# What servo drives on a board's own line take besides.
SERVOS = re.compile(r"hal/drive/modbus/|hal/support/(?!crc32)|"
                    r"firmware/mcu/servos|hal/mcu/map|"
                    r"hal/modbus/(bus|map|master|modbus)\.")
FLASH_MAX, AXIS_MAX, AXES = 48 * 1024, 1024, 6
# What one more axis adds to struct mcu_unit and struct mcu_upload.
AXIS = """
#include "firmware/mcu/upload.h"
#define ELEMENT(type, array) sizeof ((struct type *)0)->array[0]
char axis_bytes[ELEMENT(mcu_unit, axis) + ELEMENT(mcu_unit, axis_config) +
                ELEMENT(mcu_unit, drive) + ELEMENT(mcu_unit, window) +
                ELEMENT(mcu_upload, setup) + ELEMENT(mcu_upload, setup_crc) +
                ELEMENT(mcu_upload, head_crc)];
"""
SECTION = re.compile(r" (\.(?:text|rodata|vectors|irqs|data|bss)\S*|COMMON)"
                     r"(?:\s+0x\S+\s+(0x\S+)\s+(\S+))?\s*$")
REST = re.compile(r"\s+0x\S+\s+(0x\S+)\s+(\S+)\s*$")


def contributions(path):
    """(object, is RAM, bytes) of every section that was kept."""
    name, kept = None, False
    for line in open(path):
        kept = kept or line.startswith("Linker script and memory map")
        section = SECTION.match(line) if kept else None
        rest = REST.match(line) if name else None
        if section and section[2] is None:
            name = section[1]
            continue
        if section:
            name, rest = section[1], section
            size, file = section[2], section[3]
        elif rest:
            size, file = rest[1], rest[2]
        else:
            name = None
            continue
        yield (file, name.startswith((".bss", ".data", "COMMON")),
               int(size, 16))
        name = None


def room_of(file):
    if "libgcc" in file:
        return "libgcc"
    return os.path.dirname(re.sub(r"^build/mcu/", "", file))


def symbols(elf):
    """Sizes of what is in RAM by name."""
    lines = subprocess.run([NM, "-S", elf], check=True, capture_output=True,
                           text=True).stdout.splitlines()
    found = (line.split() for line in lines)
    return {part[3]: int(part[1], 16) for part in found if len(part) == 4}


def address(elf, name):
    for line in subprocess.run([NM, elf], check=True, capture_output=True,
                               text=True).stdout.splitlines():
        if line.endswith(" " + name):
            return int(line.split()[0], 16)
    raise SystemExit(f"{elf}: no symbol {name}")


def axis_bytes():
    with tempfile.TemporaryDirectory() as folder:
        compiled = os.path.join(folder, "axis.o")
        subprocess.run([CROSS + "gcc", "-mcpu=cortex-m4", "-mthumb", "-I.",
                        "-ffreestanding", "-xc", "-c", "-", "-o", compiled],
                       input=AXIS, check=True, text=True)
        return symbols(compiled)["axis_bytes"]


def painted(elf):
    """Bytes of stack that the last run of an image has used, or "-"."""
    path = elf.replace(".elf", ".painted")
    return int(open(path).read()) if os.path.exists(path) else "-"


def main():
    flash = {}
    most = servos = 0
    enough = True
    print(f"{'bytes':16}{'flash':>8}{'RAM':>9}{'of it tracks':>14}{'log':>9}"
          f"{'stack':>7}{'computed':>10}{'painted':>9}")
    for path in sys.argv[1:]:
        rooms = collections.Counter()
        ram = portable = drives = 0
        for file, is_ram, size in contributions(path):
            ram += size if is_ram else 0
            rooms[room_of(file)] += 0 if is_ram else size
            portable += size if not is_ram and PORTABLE.search(file) else 0
            drives += size if not is_ram and SERVOS.search(file) else 0
        elf = path.replace(".map", ".elf")
        size = symbols(elf)
        tracks = sum(n for name, n in size.items() if name.endswith("_ring"))
        log = sum(n for name, n in size.items() if name.endswith("_log"))
        room = (address(elf, "image_stack_top") -
                address(elf, "image_stack_end"))
        need, used = stack.computed(elf)[0], painted(elf)
        enough = enough and need <= room and (used == "-" or used <= need)
        name = os.path.basename(path)[:-4]
        print(f"{name:16}{sum(rooms.values()):8}{ram:9}{tracks:14}{log:9}"
              f"{room:7}{need:10}{used:>9}")
        flash[name] = rooms
        most, servos = max(most, portable), max(servos, drives)
        line = sum(n for name, n in size.items() if name.endswith("_servos"))
    print(f"\nflash of {name} by room")
    for room, size in flash[name].most_common():
        print(f"{room:24}{size:8}")
    axis = axis_bytes()
    print(f"\nmotion/core, firmware/control and a drive: {most} of {FLASH_MAX} "
          f"bytes of flash\nan axis beside its tracks: {axis} of {AXIS_MAX} "
          f"bytes of RAM\nservo drives on its own line besides: {servos} bytes "
          f"of flash, {line} of RAM for {AXES} axes")
    return 1 if most > FLASH_MAX or axis > AXIS_MAX or not enough else 0


sys.exit(main())
