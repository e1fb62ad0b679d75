#!/usr/bin/env python3
"""What it costs to plan a path with a camera, and a span with handles.

    bake.py SLEW DIRECTORY

Instructions are those of plan_compose, counted by valgrind: reading the files
and loading the program are not planning.  They may be the share that is asked
of what the same two moves took in 46e4b31b, the last state before paths as fast
as limits allow, built with gcc -O2 as well.  There flyby had 175 ms and a span
0.75 ms on the machine of that day.  The times here are those of the processor
for all of `slew plan` less those for a move of two keys, the best of many; they
are shown and not judged."""

import os
import random
import re
import resource
import subprocess
import sys

FLYBY = "examples/flyby"
SPANS = 200
RUNS = 20
# what, instructions in 46e4b31b, the share that is asked of it
BEFORE_FLYBY = (319_009_948, 10)
BEFORE_SPAN = (5_029_282, 5)


def write_keys(path, keys):
    """Half a second apart, anywhere on flyby's x; handles are automatic."""
    draw = random.Random(1)
    with open(path, "w", encoding="ascii") as out:
        out.write("axes:\n  x:\n    curve: bezier\n    keys:\n")
        for key in range(keys):
            out.write(f"      - [{key * 0.5} s, {draw.uniform(500, 3500):.3f} mm]\n")


def milliseconds(slew, move):
    best = None
    for _ in range(RUNS):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([slew, "plan", f"{FLYBY}/rig.yaml", move], check=True,
                       stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        took = (after.ru_utime + after.ru_stime -
                before.ru_utime - before.ru_stime)
        best = took if best is None else min(best, took)
    return 1e3 * best


def instructions(slew, move, out):
    said = subprocess.run(
        ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}",
         "--toggle-collect=plan_compose_again", slew, "plan",
         f"{FLYBY}/rig.yaml", move], check=True, stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE, text=True).stderr
    count = int(re.search(r"Collected : (\d+)", said).group(1))
    if count == 0:
        sys.exit("bench-bake: plan_compose_again was not counted")
    return count


def main(slew, directory):
    os.makedirs(directory, exist_ok=True)
    out = os.path.join(directory, "callgrind.out")
    few = os.path.join(directory, "few.yaml")
    many = os.path.join(directory, "bezier.yaml")
    write_keys(few, 2)
    write_keys(many, SPANS + 1)
    nothing = milliseconds(slew, few)
    print(f"  {'':<38}{'ms':>8}{'instructions':>14}{'at most':>12}{'before':>13}")
    over = 0
    for what, move, spans, (before, share) in (
            ("examples/flyby: a path with a camera", f"{FLYBY}/move.yaml", 1,
             BEFORE_FLYBY),
            ("a bezier span", many, SPANS, BEFORE_SPAN)):
        took = (milliseconds(slew, move) - nothing) / spans
        count = instructions(slew, move, out) // spans
        is_over = count > before // share
        over += is_over
        print(f"  {what:<38}{took:>8.3f}{count:>14,}{before // share:>12,}"
              f"{before:>13,}{'  OVER' if is_over else ''}")
    print(f"bench-bake: 2 figures, {over} over their limit")
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
