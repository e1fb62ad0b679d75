#!/usr/bin/env python3
# tests/firmware/mcu/clock.py IMAGE MACHINE HZ - an image in QEMU is told how fast
# its clock is to be (command 10 of docs/MCU.md); what SysTick counts from, tick by
# tick, is read through QEMU's monitor.
#
# It must be one of the two whole numbers of cycles beside what was told, and that in
# the mean.  Nothing here depends on how fast this machine is.
import math
import os
import re
import select
import socket
import struct
import subprocess
import sys
import tempfile
import time
import tty

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "../../support"))
from crc16 import crc16  # noqa: E402

SYST_RVR = 0xE000E014
COMMAND, CLOCK = 0x0200, 10
LOOKS = 300


def until(deadline_s, what, step):
    end = time.monotonic() + deadline_s
    while time.monotonic() < end:
        found = step()
        if found:
            return found
    sys.exit(f"clock.py: {what}")


class Board:
    def __init__(self, image, machine, directory):
        path = os.path.join(directory, "monitor")
        self.process = subprocess.Popen(
            ["qemu-system-arm", "-M", machine, "-display", "none",
             "-monitor", f"unix:{path},server=on,wait=off",
             "-icount", "shift=3,sleep=on", "-serial", "pty", "-serial", "null",
             "-kernel", image],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        device = until(30, "QEMU names no terminal", lambda: re.search(
            r"redirected to (/dev/pts/\d+)", self.process.stdout.readline()))
        self.line = os.open(device.group(1), os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.line)
        self.monitor = socket.socket(socket.AF_UNIX)
        self.monitor.connect(path)
        self.prompt()
        self.number = 0

    def prompt(self):
        said = b""
        while not said.endswith(b"(qemu) "):
            said += self.monitor.recv(4096)
        return said.decode()

    def counts_from(self):
        self.monitor.send(f"x /1wx {SYST_RVR:#x}\n".encode())
        return int(re.search(r": 0x([0-9a-f]+)", self.prompt()).group(1), 16) + 1

    def answer(self):
        said = b""
        while len(said) < 8 and select.select([self.line], [], [], 5)[0]:
            said += os.read(self.line, 256)
        return said

    def steer(self, ppb):
        self.number += 1
        value = ppb & 0xFFFFFFFF
        frame = struct.pack(">BBHHBHHHH", 1, 16, COMMAND, 4, 8, self.number,
                            CLOCK, value & 0xFFFF, value >> 16)

        def ask():
            os.write(self.line, frame + crc16(frame))
            return self.answer()[1:2] == b"\x10"

        until(60, "the board does not take its clock", ask)


def judge(board, cycles, ppb):
    board.steer(ppb)
    exact = cycles * (1 - ppb * 1e-9)
    time.sleep(0.5)
    seen = []
    for _ in range(LOOKS):
        seen.append(board.counts_from())
        time.sleep(0.0037)
    # 1e-9 of a tick is rounded down to 2^-32 of a cycle
    whole = {math.floor(exact - 0.01), math.ceil(exact - 0.01),
             math.floor(exact + 0.01), math.ceil(exact + 0.01)}
    mean = sum(seen) / len(seen)
    if not set(seen) <= whole or abs(mean - exact) > 0.25:
        sys.exit(f"clock.py: {ppb} ppb are {exact:.3f} cycles, counted from "
                 f"{sorted(set(seen))}, {mean:.3f} in the mean")
    return (cycles - mean) / cycles * 1e6


def main(image, machine, hertz):
    with tempfile.TemporaryDirectory() as directory:
        board = Board(image, machine, directory)
        try:
            told = [0, 500000, -500000, 50000, 10000, 0]
            seen = [judge(board, int(hertz) // 1000, ppb) for ppb in told]
        finally:
            board.process.kill()
            board.process.wait()
    print(f"{machine}: steered by " +
          ", ".join(f"{ppb / 1000:g}" for ppb in told) + " ppm, ticks by " +
          ", ".join(f"{ppm:.1f}" for ppm in seen))


main(*sys.argv[1:])
