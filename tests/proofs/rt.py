#!/usr/bin/env python3
"""Prove what the tick may not do: divide, use floating point, allocate, print,
recurse.  `make rt` compiles the portable sources and calls this.

gcc -fcallgraph-info writes, per object, who calls whom and how much stack each
function takes; on Cortex-M every 64-bit division and every float operation is
such a call, on Cortex-M0 every 32-bit division too.  The walk starts at the
roots below and at every function that stands in an ops table.  A call through
an ops table goes to every function that stands in that slot.
"""
import collections
import glob
import os
import re
import subprocess
import sys

# What is called on the tick, and the room that must have it.
ROOTS = {
    "motion_track_sample": "motion/core",
    "motion_clock_warp_at": "motion/core",
    "motion_shaper_sample": "motion/core",
    "controller_step": "firmware/control",
    "controller_ahead": "firmware/control",
    "trigger_step": "firmware/control",
    "mcu_unit_tick": "firmware/mcu",
}

# These may divide although the tick reaches them.  Everything else that is
# forbidden stays forbidden below them.
MAY_DIVIDE = {
    "controller_step_seek": "looks for a change of rate after a request to hold,"
                            " resume or stop; bounded by config.effort per tick",
    "controller_step_request": "begins that, of which the tick that follows takes"
                               " the less",
    "controller_step_bound_ns": "says by when a stop is at rest, once per request",
    "controller_goal_distance_ns_q12": "says how long a drive takes to its"
    " goal, once per motion of it",
}

# Library functions that a compiler calls by itself or that do nothing but move
# bytes, shift and multiply.
HARMLESS = re.compile(
    r"mem(cpy|move|set|cmp)$|__builtin_|"
    r"__aeabi_(mem(cpy|move|set|clr)[48]?|l(mul|lsl|lsr|asr|cmp)|ulcmp)$|"
    r"__(clz|ctz|popcount|ffs|parity|bswap)[sd]i2$|__gnu_thumb1_case_|"
    r"__(mul|ashl|ashr|lshr)[sd]i3$")
DIVISION = re.compile(r"__aeabi_u?[il]div(mod)?$|__u?(div|mod|divmod)[sd]i[34]$")
FLOAT = re.compile(r"__aeabi_[cdf]|__aeabi_u?[il]2[df]|__.*[sdtx]f[0-9sdtx]")

TARGETS = ("m0", "m4")
RT = "build/rt"

Function = collections.namedtuple("Function", "name stack bounded calls")


def read_graph(path):
    """Functions of one object: {title: Function}; titles of statics carry
    their file.  An indirect call is the place where it is written."""
    functions, calls = {}, collections.defaultdict(list)
    for line in open(path):
        if line.startswith("node:"):
            title, label = re.match(r'node: { title: "(.*?)" label: "(.*?)"',
                                    line).groups()
            part = label.split("\\n")
            stack = re.match(r"(\d+) bytes \((.*)\)", part[-1])
            if stack:
                functions[title] = Function(part[0], int(stack[1]),
                                            "dynamic" != stack[2],
                                            calls[title])
        elif line.startswith("edge:"):
            source, target, place = re.match(
                r'edge: { sourcename: "(.*?)" targetname: "(.*?)"'
                r'(?: label: "(.*?)")?', line).groups()
            calls[source].append((target, place))
    return functions


def slots_of(sources):
    """Which functions stand in which slot: {slot: [function]}, from the
    designated initialisers of `struct ..._ops` tables, {"tracks->slot":
    [function]} from those of what a drive does with tracks, most of which is
    between ticks, and {"table[]": [function]} from arrays of function pointers."""
    slots = collections.defaultdict(list)
    for path in sources:
        text = open(path).read()
        for kind, rows in re.findall(
                r"struct\s+(\w+_ops|hal_drive_tracks)\s+\w+\s*=\s*{(.*?)}\s*;",
                text, re.S):
            prefix = "tracks->" if kind == "hal_drive_tracks" else ""
            for slot, function in re.findall(r"\.(\w+)\s*=\s*&?(\w+)", rows):
                slots[prefix + slot].append(function)
        for table, rows in re.findall(
                r"\(\*\s*const\s+(\w+)\[\w*\]\)\([^)]*\)\s*=\s*{(.*?)}\s*;",
                text, re.S):
            slots[table + "[]"] += re.findall(r"(\w+)\s*(?:,|$)", rows)
    return slots


def interface_slots():
    """Slots of the ops structs in the headers; one that nobody here fills is
    where the walk leaves for a bus driver or a simulated device."""
    slots = set()
    for path in glob.glob("hal/**/*.h", recursive=True) + \
            glob.glob("firmware/control/*.h"):
        for body in re.findall(r"struct\s+\w+_ops\s*{(.*?)\n};",
                               open(path).read(), re.S):
            slots.update(re.findall(r"\(\*(\w+)\)", body))
    return slots


def slot_called_at(place):
    """The slot of `x->ops->slot(...)`, `tracks->slot(...)` or `table[i](...)`
    at file:line:column."""
    path, line, column = place.rsplit(":", 2)
    text = "".join(open(path).readlines()[int(line) - 1:int(line) + 2])
    text = text[int(column) - 1:]
    if match := re.match(r"[^;(]*?ops->(\w+)\s*\(", text):
        return match[1]
    if match := re.match(r"tracks->\w+(?=\s*\()", text):
        return match[0]
    if match := re.match(r"(\w+)\[[^;(]*\]\s*\(", text):
        return match[1] + "[]"
    return None


class Walk:
    """The call graph of one target."""

    def __init__(self, target, sources):
        self.problems, self.leaves, self.depth = [], set(), {}
        self.functions, self.by_name = {}, collections.defaultdict(list)
        for source in sources:
            path = f"{RT}/{target}/{source[:-2]}.ci"
            for title, function in read_graph(path).items():
                self.functions[title] = function
                self.by_name[function.name.split(".")[0]].append(title)
        self.slots = slots_of(sources)
        self.outside = interface_slots()

    def problem(self, path, what):
        names = [self.functions[t].name if t in self.functions else t
                 for t in path]
        text = " > ".join(names) + ": " + what
        if text not in self.problems:
            self.problems.append(text)

    def indirect(self, path, place):
        slot = slot_called_at(place) if place else None
        if slot in self.slots:
            return [t for f in self.slots[slot] for t in self.by_name[f]]
        if slot in self.outside:
            self.leaves.add(slot)
        else:
            self.problem(path, f"calls a pointer that is in no table ({place})")
        return []

    def library(self, path, name, may_divide):
        if DIVISION.match(name):
            if not may_divide:
                self.problem(path, f"divides ({name})")
        elif FLOAT.match(name):
            self.problem(path, f"floating point ({name})")
        elif not HARMLESS.match(name):
            self.problem(path, f"calls {name}")

    def visit(self, title, path=(), may_divide=False):
        """Deepest stack from here on, in bytes."""
        function = self.functions[title]
        if title in path:
            self.problem(path + (title,), "recursion")
            return 0
        path += (title,)
        may_divide = may_divide or function.name in MAY_DIVIDE
        if (title, may_divide) in self.depth:
            return self.depth[title, may_divide]
        if not function.bounded:
            self.problem(path, "stack without a bound")
        deepest = 0
        for target, place in function.calls:
            if target == "__indirect_call":
                callees = self.indirect(path, place)
            elif target in self.functions:
                callees = [target]
            else:
                callees = []
                self.library(path, target, may_divide)
            for callee in callees:
                deepest = max(deepest, self.visit(callee, path, may_divide))
        self.depth[title, may_divide] = function.stack + deepest
        return self.depth[title, may_divide]

    def roots(self, rooms):
        for name, room in ROOTS.items():
            if name not in self.by_name and room in rooms:
                self.problem((name,), "not found, but it must be checked")
        names = list(ROOTS) + sorted({f for slot, fs in self.slots.items()
                                      for f in fs if slot.isidentifier()})
        return [t for name in names for t in self.by_name[name]]


def symbols_of(target, sources):
    """Nothing in any object, on the tick or not, may use floating point, the
    heap or a library that we do not have: every symbol is ours or harmless."""
    objects = [f"{RT}/{target}/{source[:-2]}.o" for source in sources]
    tool = "nm" if target == "pc" else os.environ.get(
        "CROSS", "arm-none-eabi-") + "nm"
    needed, ours = {}, set()
    for path in objects:
        for line in subprocess.run([tool, path], check=True, text=True,
                                   stdout=subprocess.PIPE).stdout.splitlines():
            kind, name = line.split()[-2:]
            if kind in "Uw":
                needed.setdefault(name, path)
            else:
                ours.add(name)
    return [f"{path}: needs {name}" for name, path in sorted(needed.items())
            if name not in ours and not HARMLESS.match(name)
            and not DIVISION.match(name)]


def main(sources):
    if not sources:
        print("rt: nothing to check")
        return 0
    rooms = {os.path.dirname(source) for source in sources}
    problems = []
    for target in ("pc",) + TARGETS:
        problems += symbols_of(target, sources)
    stacks = collections.defaultdict(dict)
    for target in TARGETS:
        walk = Walk(target, sources)
        for title in walk.roots(rooms):
            stacks[walk.functions[title].name][target] = walk.visit(title)
        problems += [f"{target}: {p}" for p in walk.problems]
    print(f"  {'stack in bytes, from':<40}{'M0':>6}{'M4':>6}")
    for name, stack in stacks.items():
        print(f"  {name:<40}" + "".join(f"{stack.get(t, 0):6}" for t in TARGETS))
    print(f"  {len({t for t, _ in walk.depth})} functions reached; leaves through "
          f"{', '.join(sorted(walk.leaves)) or 'nothing'}")
    for name, why in MAY_DIVIDE.items():
        print(f"  may divide: {name} {why}")
    for problem in problems:
        print(problem)
    print(f"rt: {len(sources)} sources, {len(problems)} problems")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
