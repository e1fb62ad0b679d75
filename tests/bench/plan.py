#!/usr/bin/env python3
"""What a plan costs on a microcontroller, against what it may cost.

    plan.py DIRECTORY SOURCE...

`make bench-plan` compiles the sources for each processor into DIRECTORY, runs
plan_image.c there in QEMU, and calls this.  The moves are those of
otg_random.h: 2,400 for one axis, of the categories of the reference vectors in
their shares, 240 for three and 48 for seven.
"""
import os
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "proofs"))
import rt  # noqa: E402

# The figure, and the most it may be on a Cortex-M4.
LIMITS = (
    ("one axis, instructions, mean", "one_mean", 14000),
    ("one axis, instructions, worst", "one_worst", 40000),
    ("three axes together, mean", "three_mean", 70000),
    ("code of the planner, bytes", "code",
     int(os.environ["CODE"])),
    ("state per axis, bytes", "state", 1024),
    ("stack, one axis, bytes", "stack_one", 3 * 1024),
    ("stack, several axes, bytes", "stack_several", 3 * 1024),
)

PROCESSORS = ("m4", "m0", "rv32")
SIZE = {"m4": os.environ.get("CROSS", "arm-none-eabi-") + "size",
        "m0": os.environ.get("CROSS", "arm-none-eabi-") + "size",
        "rv32": os.environ.get("RV", "riscv64-unknown-elf-") + "size"}
STACK = {"stack_one": "motion_otg_make", "stack_several": "motion_sync_make"}


def image_figures(path):
    figures = {}
    for line in open(path):
        name, value = line.split()
        figures[name] = int(value)
    figures["state"] = figures["plan_bytes"] + figures["move_bytes"]
    return figures


def code_of(directory, processor, sources):
    """Code and constants of the planner's own objects."""
    objects = [f"{directory}/{processor}/{source[:-2]}.o"
               for source in sources if is_planner(source)]
    lines = subprocess.run([SIZE[processor]] + objects, check=True, text=True,
                           stdout=subprocess.PIPE).stdout.splitlines()[1:]
    return sum(int(field) for line in lines for field in line.split()[:2])


def is_planner(source):
    return (source.startswith("motion/otg/") or
            source in ("motion/number/num.c",   # which nobody else
                       "motion/number/wide.c"))  # uses


def stacks_of(directory, processor, sources):
    rt.RT = directory
    walk = rt.Walk(processor, sources)
    stacks = {}
    for name, root in STACK.items():
        stacks[name] = max(walk.visit(title, (), True)
                           for title in walk.by_name[root])
    if walk.problems:
        sys.exit("\n".join(walk.problems))
    return stacks


def main(directory, sources):
    all_figures = {}
    for processor in PROCESSORS:
        figures = image_figures(f"{directory}/plan-{processor}.txt")
        figures["code"] = code_of(directory, processor, sources)
        figures.update(stacks_of(directory, processor, sources))
        all_figures[processor] = figures
    print("  one axis: rest, moving_start, asymmetric 15 each of 120, full_state"
          " 28,\n  start_violates, boundary, round 10, ratio 7, tiny, long 5")
    print(f"  {'':<32}{'limit':>8}" +
          "".join(f"{processor:>9}" for processor in PROCESSORS))
    over = 0
    for text, name, limit in LIMITS:
        is_over = all_figures["m4"][name] > limit
        over += is_over
        print(f"  {text:<32}{limit:>8}" +
              "".join(f"{all_figures[p][name]:>9}" for p in PROCESSORS) +
              ("  m4: over" if is_over else ""))
    limited = {name for _, name, _ in LIMITS}
    for name in all_figures["m4"]:
        if name not in limited and not name.endswith("_row"):
            print(f"  {name:<40}" +
                  "".join(f"{all_figures[p][name]:>9}" for p in PROCESSORS))
    print(f"bench-plan: {len(LIMITS)} figures, {over} over their limit")
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
