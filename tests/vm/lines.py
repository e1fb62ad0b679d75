#!/usr/bin/env python3
"""Were the outputs set as the report of a run says?

    lines.py LEVELS REPORT TRIGGER=LINE:high|low... LAMP=LINE

LEVELS has a line for every level that a line was set to, as the kernel saw it:
seconds, line, level.  REPORT is what slew run --json printed.  Pulses are
counted, and none may be shorter than its width; the times between them must be
those of the report, which says how late each one was.  The lamp goes on once
before the first and goes off once after the last.
"""
import json
import sys

WIDTH_S = {"shutter": 0.100, "flash": 0.060}
REST_S = {"shutter": 0.100, "flash": 0.020}
CLOCK_S = 0.002  # from the line's change to the program's look at the clock


def fail(sentence):
    sys.exit(f"lines.py: {sentence}")


def changes(levels, line, rest):
    """[time, level] of every change, from its level at rest on."""
    level, out = rest, []
    for when, which, now in levels:
        if which == line and now != level:
            level = now
            out.append((when, now))
    return out


def pulses(levels, line, active):
    """[begin, end] of every pulse."""
    found = changes(levels, line, 1 - active)
    if len(found) % 2 != 0:
        fail(f"line {line} is left active")
    return [(found[i][0], found[i + 1][0]) for i in range(0, len(found), 2)]


def judge_trigger(name, seen, report):
    shots = report["shots"]
    if report["planned"] < 2 or report["fired"] != report["planned"] \
            or len(seen) != report["planned"] or report["failures"] != 0:
        fail(f"{name}: {len(seen)} pulses, {report['fired']} of "
             f"{report['planned']} reported")
    for begin, end in seen:
        if end - begin < WIDTH_S[name] - CLOCK_S:
            fail(f"{name}: a pulse of {end - begin} s")
    for (_, end), (begin, _) in zip(seen, seen[1:]):
        if begin - end < REST_S[name] - CLOCK_S:
            fail(f"{name}: a rest of {begin - end} s")
    for (begin, _), shot in zip(seen, shots):
        line_s = begin - seen[0][0]
        report_s = shot["t_s"] - shots[0]["t_s"]
        if abs(line_s - report_s) > CLOCK_S:
            fail(f"{name}: {line_s} s after the first, {report_s} reported")
        if shot["late_ms"] < 0 \
                or abs(shot["t_s"] - shot["path_s"] - shot["late_ms"] / 1e3) \
                > 1e-6:
            fail(f"{name}: {shot}")
    late = max(shot["late_ms"] for shot in shots)
    print(f"{name}: {len(seen)} pulses, at most {late:.3f} ms late")


def main():
    levels, report = [], json.load(open(sys.argv[2]))
    for text in open(sys.argv[1]):
        when, line, level = text.split()
        levels.append((float(when), int(line), int(level)))
    reports = {one["line"]: one for one in report["triggers"]}
    first, last = float("inf"), 0.0
    for word in sys.argv[3:-1]:
        name, where = word.split("=")
        line, active = where.split(":")
        seen = pulses(levels, int(line), int(active == "high"))
        judge_trigger(name, seen, reports[name])
        first, last = min(first, seen[0][0]), max(last, seen[-1][1])
    lamp = pulses(levels, int(sys.argv[-1].split("=")[1]), 1)
    if len(lamp) != 1 or lamp[0][0] > first or lamp[0][1] < last:
        fail(f"the lamp: {lamp}, pulses from {first} to {last}")


main()
