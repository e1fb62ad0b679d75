#!/usr/bin/env python3
"""tests/firmware/linux/progress.py SLEW - what a terminal shows during long work.

A path of many points with a camera takes seconds to plan, and a move of many
keys to judge, draw, write and read.
Standard error is a pseudo-terminal, a pipe, or both streams are one terminal.
"""
import math
import os
import pty
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

RIG = "tick: 2 ms\nbuses:\n  can0: {kind: canopen, bit_rate: 1 Mbit/s}\naxes:\n"
AXIS = """  %s:
    unit: %s
    limits: {position: [-1e6, 1e6], velocity: 1e5, acceleration: 1e6}
    following_error: {floor: 1000, time: 20 ms}
    drive: {kind: cia402, bus: can0, node: %d, counts: 100 per %s}
    sim: {bandwidth: 25 Hz, damping: 0.9}
"""
AXES = {"x": "mm", "y": "mm", "z": "mm", "pan": "deg", "tilt": "deg"}


def files(directory, count):
    rig = directory / "rig.yaml"
    rig.write_text(RIG + "".join(AXIS % (name, unit, i + 1, unit)
                                 for i, (name, unit) in enumerate(AXES.items())))
    points = ["[%.3f, %.3f, %.3f]" % (100 * i, 300 * math.sin(i * 0.9),
                                      200 * math.cos(i * 0.5))
              for i in range(count)]
    camera = directory / "camera.yaml"
    camera.write_text(
        "path:\n  axes: [x, y, z]\n  points: [%s]\n"
        "  speed: {law: quintic, time: %d s}\n"
        "camera:\n  axes: {pan: pan, tilt: tilt}\n"
        "  look: {ahead: 400 mm}\n"
        % (", ".join(points), count))
    wrong = directory / "wrong.yaml"
    wrong.write_text(camera.read_text() + "  tolerance: 1e-9 deg\n")
    short = directory / "short.yaml"
    short.write_text("axes: {pan: {keys: [[0 s, 0], [2 s, 10]]}}\n")
    return rig, camera, short, wrong


def on_terminal(words, both=False):
    """What comes on a terminal that is stderr (`both`: stdout too), seconds."""
    ours, theirs = pty.openpty()
    start = time.monotonic()
    done = subprocess.Popen(words, stderr=theirs, stdin=subprocess.DEVNULL,
                            stdout=theirs if both else subprocess.DEVNULL)
    os.close(theirs)
    said, first = b"", None
    while True:
        try:
            read = os.read(ours, 65536)
        except OSError:  # the other end is closed
            break
        if not read:
            break
        if first is None:
            first = time.monotonic() - start
        said += read
    os.close(ours)
    return done.wait(), said.decode(), first, time.monotonic() - start


def shown(said):
    """What is left to see: a line is rewritten after \\r, erased by ESC [K."""
    lines = []
    for line in said.replace("\r\n", "\n").split("\n"):
        seen = ""
        for part in line.split("\r"):
            seen = part.removesuffix("\033[K") if "\033[K" in part \
                else part + seen[len(part):]
        lines.append(seen)
    return "\n".join(lines)


def fail(what, said):
    sys.exit("progress.py: %s: %r" % (what, said[-2000:]))


def percents(said, what):
    return [int(n) for n in re.findall(re.escape(what) + r" +(\d+) %", said)]


def check_slow(slew, words, status, what="planning: camera", then="", before=0):
    """`then`: what may follow, and is due when it takes a second itself.  `before`:
    how many works there are before this one."""
    ended, said, first, took = on_terminal([slew, *words])
    if ended != status:
        fail("%s: status %d" % (words, ended), said)
    # the line is due after a second of the work alone
    if took < 1.3 + before and what not in said:
        return shown(said)
    if what not in said or first < 0.99:
        fail("%s: first after %.2f s" % (words, first or 0), said)
    percent = percents(said, what)
    if percent != sorted(percent) or (status == 0 and percent[-1] < 30):
        fail("%s: %s" % (words, percent), said)
    percent = percents(said, then) if then else []
    if percent != sorted(percent):
        fail("%s: %s" % (words, percent), said)
    return shown(said)


def keyed(directory, count, curve="quintic"):
    """One axis of many keys; the others go with it, so that rows are long."""
    move = directory / "keyed.yaml"
    end = (count - 1) * 0.25
    move.write_text("axes:\n" + "".join(
        "  %s: {keys: [[0 s, 0], [%.2f s, 1]]}\n" % (name, end)
        for name in AXES if name != "pan") + "  pan:\n    curve: %s\n    keys:\n"
        % curve + "".join(
            "    - [%.2f s, %d]\n" % (i * 0.25, i % 2)
            for i in range(count)))
    return move


def slow_enough(slew, directory, before, after, what):
    """The command with twice the keys from which on it says how far it is; a
    file of 640,000 is nearly as large as one may be."""
    count, said = 40000, ""
    while what not in said and count < 500000:
        count *= 2
        said = on_terminal([slew, *before, keyed(directory, count), *after])[1]
    return [*before, keyed(directory, min(2 * count, 640000)), *after]


def check_keyed(slew, directory, rig):
    """Judging, writing, drawing and reading of many keys."""
    out = directory / "out.csv"
    drawn = slow_enough(slew, directory, ["plot", rig], [
        "--compare", "linear,quintic", "--axis", "pan", "--out",
        directory / "out.png"], "drawing: panels")
    if check_slow(slew, drawn, 0, "drawing: panels"):
        fail("left on the terminal", "drawing")
    # a span of bezier is some twenty segments, and there may be 8 million
    judged = ["check", rig, keyed(directory, 320000, "bezier")]
    if check_slow(slew, judged, 0, "planning: pan", then="judging: pan"):
        fail("left on the terminal", "judging")
    # 960,000 rows; a million is the most
    write = ["export", "csv", rig, keyed(directory, 160000), "--out", out,
             "--fps", "24"]
    if check_slow(slew, write, 0, "writing: rows", before=1):
        fail("left on the terminal", "writing")
    names = list(AXES)
    out.write_text("frame," + ",".join(names) + "\n" + "".join(
        "%d%s\n" % (i, ",%.8f" % math.sin(i) * len(names))
        for i in range(990000)) + "990000,mm\n")
    left = check_slow(slew, ["import", "csv", out, "--rig", rig, "--fps", "24",
                             "--out", directory / "back.yaml"],
                      2, "reading: %s" % out)
    if not re.fullmatch(r"\S+out\.csv:990002:10: [^\n]+\n", left):
        fail("the error", left)


def main():
    slew = os.path.abspath(sys.argv[1])
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        count, took = 400, 0
        while took < 2:
            count *= 2
            rig, camera, short, wrong = files(directory, count)
            took = on_terminal([slew, "check", rig, camera])[3]
        left = check_slow(slew, ["check", rig, camera], 0)
        if left:
            fail("left on the terminal", left)
        # an error stands alone
        left = check_slow(slew, ["plan", rig, wrong], 2)
        if not re.fullmatch(r"\S+wrong\.yaml:\d+:\d+: [^\n]+\n", left):
            fail("the error", left)
        for words in (["check", rig, short], ["plan", rig, short]):
            ended, said, _, _ = on_terminal([slew, *words])
            if ended != 0 or said:
                fail("a short move", said)
        done = subprocess.run([slew, "check", rig, camera],
                              capture_output=True, text=True)
        if done.returncode != 0 or done.stderr or "planning" in done.stdout:
            fail("into a pipe", done.stderr + done.stdout)
        check_keyed(slew, directory, rig)


if __name__ == "__main__":
    main()
