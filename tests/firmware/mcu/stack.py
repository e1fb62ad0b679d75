"""The most stack an image can use, from its own code: what every function
pushes, and who calls whom.

A call through a pointer is looked up in POINTERS; one that is not there, a
recursion, or a frame of unknown size ends with an error instead of a number.
"""
import os
import re
import subprocess

CROSS = os.environ.get("CROSS", "arm-none-eabi-")
# Of an exception: eight registers, and a word to align them.
# Source: Arm, ARMv7-M Architecture Reference Manual, B1.5.6.
EXCEPTION = 36
# The main loop, interrupted by the tick, interrupted by a port.
LEVELS = [r"board_reset", r"board_systick_isr",
          r"\w+_(?:receive|sent|usart[12])_isr"]
# Whoever calls through a pointer, and whom: drives, the stations of the lines
# and the registers, the drives' line in the tick, pieces by kind, states,
# commands.
DRIVE = r"mcu_virtual_drive_\w+|drive_modbus_(?:request|set_target|" \
        r"feedback|modes|set_mode|go|home|halt)"
POINTERS = {
    r"main(?:_serve\w*)?(?:\.\w+)*":
        r"modbus_(?:rtu_slave|master)_(?:recv|due_ns|poll|sent)|rtu_slave_\w+",
    r"modbus_slave_serve|slave_\w+": r"mcu_registers_(?:get|set)",
    r"mcu_upload_put|upload_take": r"upload_put_\w+",
    r"mcu_unit_(?:hold|release)|upload_\w+": r"board_(?:hold|release)",
    r"mcu_unit_set_up|unit_start_line": r"board_master_open",
    r"mcu_unit_tick": r"modbus_bus_(?:begin|end)",
    r"modbus_bus_\w+": r"modbus_master_(?:submit|collect|is_up)|"
                       r"drive_modbus_(?:step|next_request|reply|down)",
    r"(?:mcu_)?registers_\w+": r"board_(?:hold|release|stack_free|now_ns)",
    r"controller_step": r"controller_step_\w+|" + DRIVE,
    r"homing_step": r"homing_\w+|" + DRIVE,
    r"controller_\w+|goal_\w+|homing_\w+|watch_\w+|trigger_\w+": DRIVE,
}
FUNCTION = re.compile(r"^[0-9a-f]+ <(\S+)>:$")
LINE = re.compile(r"^\s+[0-9a-f]+:\t[0-9a-f ]+\t(\S+)\s*(.*)$")
TARGET = re.compile(r"<([^>+]+)(\+0x[0-9a-f]+)?>")
REGISTERS = ["r%d" % i for i in range(10)] + ["sl", "fp", "ip", "sp", "lr", "pc"]
REGISTERS_ALSO = {"r10": "sl", "r11": "fp", "r12": "ip"}


def pushed(text):
    """Bytes of a list of registers, {r4, r5-r7, lr}."""
    count = 0
    for part in text.strip("{}").split(","):
        ends = [REGISTERS_ALSO.get(e.strip(), e.strip()) for e in part.split("-")]
        count += REGISTERS.index(ends[-1]) - REGISTERS.index(ends[0]) + 1
    return 4 * count


def frame_of(name, op, rest):
    """Bytes by which an instruction moves the stack down."""
    op = op.split(".")[0]
    if op == "push":
        return pushed(rest[:rest.index("}") + 1])
    if op == "stmdb" and rest.startswith("sp!"):
        return pushed(rest[rest.index("{"):rest.index("}") + 1])
    store = re.search(r"\[sp, #-(\d+)\]!", rest)
    if store:
        return int(store[1])
    if op in ("sub", "subw", "subs") and re.match(r"sp\b", rest):
        size = re.search(r"#(\d+)", rest)
        if not size:
            raise SystemExit(f"{name}: a stack frame of unknown size")
        return int(size[1])
    return 0


class Image:
    def __init__(self, elf):
        self.frame, self.calls, self.jumps, self.pointer = {}, {}, {}, set()
        name = None
        for line in subprocess.run([CROSS + "objdump", "-d", elf], check=True,
                                   capture_output=True, text=True).stdout.splitlines():
            start = FUNCTION.match(line)
            if start:
                name = start[1]
                # Statics of one name: the worst of all counts for each.
                self.calls.setdefault(name, set())
                self.jumps.setdefault(name, set())
                size = 0
                continue
            code = LINE.match(line)
            if code and name:
                size += frame_of(name, code[1], code[2])
                self.frame[name] = max(self.frame.get(name, 0), size)
                self.follow(name, code[1], code[2])

    def follow(self, name, op, rest):
        op = op.split(".")[0]
        target = TARGET.search(rest)
        if op == "blx" or (op == "bx" and not rest.startswith("lr")):
            self.pointer.add(name)
        elif op == "bl" and target:
            self.calls[name].add(target[1])
        elif op.startswith(("b", "cb")) and target and target[1] != name:
            (self.calls if target[1].endswith(".cold") or target[2]
             else self.jumps)[name].add(target[1])

    def pointees(self, name):
        if name not in self.pointer:
            return set()
        found = set()
        for caller, callee in POINTERS.items():
            if re.fullmatch(caller, name):
                found |= {f for f in self.frame if re.fullmatch(callee, f)}
        if not found:
            raise SystemExit(f"{name}: calls through a pointer, and stack.py "
                             f"does not say whom")
        return found - {name}

    def depth(self, name, above=(), known=None):
        """(bytes, path) of the deepest chain of calls from a function."""
        known = {} if known is None else known
        if name in above:
            raise SystemExit("recursion: " + " -> ".join(above + (name,)))
        if name not in known:
            own = self.frame.get(name, 0)
            below = [(0, ())]
            for callee in self.calls.get(name, set()) | self.pointees(name):
                below.append(self.depth(callee, above + (name,), known))
            size, path = max(below)
            most = (own + size, path)
            for callee in self.jumps.get(name, ()):  # its frame is gone then
                most = max(most, self.depth(callee, above + (name,), known))
            known[name] = (most[0], (name,) + most[1])
        return known[name]


def computed(elf):
    """Bytes, and the path of each level."""
    image = Image(elf)
    total, paths = 0, []
    for i, level in enumerate(LEVELS):
        roots = [f for f in image.frame if re.fullmatch(level, f)]
        if not roots:
            raise SystemExit(f"{elf}: no function {level}")
        size, path = max(image.depth(f) for f in roots)
        total += size + (EXCEPTION if i > 0 else 0)
        paths.append((size, path))
    return total, paths
