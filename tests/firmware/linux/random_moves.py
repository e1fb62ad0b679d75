#!/usr/bin/env python3
"""tests/firmware/linux/random_moves.py SLEW COUNT [FIRST] - slew check and the exchange of
moves against a judge of its own, on random moves.

Every move has keyed axes of random curves, or a path with a camera; layers, a
fade, cycles and a warp come and go.  The compiled move (docs/FORMATS.md) says in
integers what each axis does: its extremes are computed here from the roots of
the derivatives, steps at the borders with fractions.  Limits are then put just
above, just below or well beside those extremes, and slew check has to say the
same, of every axis and every limit: nothing missed, nobody accused.

Then the move goes through a format at a rate, all 72 pairs in turn, and is read again:
the positions of the frames have to be those of the move, for the axis of their
name, and what slew import says of the limits has to be what slew check says.
"""
import json
import multiprocessing
import os
import random
import re
import struct
import subprocess
import sys
import tempfile
from fractions import Fraction
from pathlib import Path

import random_camera

TICKS = 4096 * 10**9  # of 2^-12 ns, per second
PERIOD = 1e-3
SAMPLING = 0.01  # docs/FILES.md, What counts as a step
AXES = {"pan": "deg", "tilt": "deg", "roll": "deg",
        "x": "mm", "y": "mm", "z": "mm"}
SMOOTH = ["quintic", "c4", "s-curve", "smoothed"]
CURVES = SMOOTH + ["c2", "catmull-rom", "akima", "monotone", "linear", "bezier"]
RATES = ["23.976", "24", "24000/1001", "25", "29.97", "30000/1001", "30", "48",
         "59.94", "60000/1001", "60", "120"]
FORMATS = ["kuper", "flair", "raw", "csv", "maya", "blender"]
# Of keys: what no machine can follow, or a handle that jumps.
REFUSED_RIGHTLY = ["where its cycles end it would jump back"]
WIDE = {"vel": 1e6, "acc": 1e8, "jerk": 2e9, "low": -1e6, "high": 1e6}


# --- the judge ---------------------------------------------------------------

def tracks_of(path):
    """Name: [(start, duration in s, coefficients of u, unit)] per axis."""
    data = path.read_bytes()
    tracks = {}
    for i in range(struct.unpack_from("<I", data, 12)[0]):
        at = 144 + 104 * i
        name = data[at:at + 32].rstrip(b"\0").decode()
        count, = struct.unpack_from("<I", data, at + 44)
        first, = struct.unpack_from("<q", data, at + 48)
        stands, = struct.unpack_from("<q", data, at + 64)
        segments = []
        for k in range(count):
            row = first + 2576 * (k // 32) + 12 + 80 * (k % 32)
            start, dur, pos, *c, rest, e = struct.unpack_from("<qqq6qii",
                                                              data, row)
            scale = Fraction(2) ** -(32 + e)
            p = [c[n] * scale / 2**n for n in range(6)]
            p[0] += Fraction(pos, 2**32)
            if e < 0:
                p[1] += Fraction(rest, 2**32)
            segments.append((start, Fraction(dur, TICKS), p, e))
        tracks[name] = segments, Fraction(stands, 2**32)
    return tracks


def value(p, u):
    total = 0
    for c in reversed(p):
        total = total * u + c
    return total


def derived(p):
    return [n * c for n, c in enumerate(p)][1:]


def roots(p):
    """Of a polynomial between 0 and 1, by halving between those of p'."""
    if len(p) < 2 or not any(p[1:]):
        return []
    found = []
    borders = [0.0] + roots(derived(p)) + [1.0]
    for a, b in zip(borders, borders[1:]):
        sign = value(p, a)
        if sign * value(p, b) > 0:
            continue
        for _ in range(40):
            m = (a + b) / 2
            if sign * value(p, m) > 0:
                a = m
            else:
                b = m
        found.append((a + b) / 2)
    return found


def extremes(p):
    p = [float(c) for c in p]
    while len(p) > 1 and abs(p[-1]) < 1e-13 * max(map(abs, p)):
        p.pop()
    values = [value(p, u) for u in [0.0, 1.0] + roots(derived(p))]
    return min(values), max(values)


# What rounding of five coefficients, and of a border, makes of v, a and j: units
# of the last digit of a segment (docs/FILES.md, What counts as a step).
ROUNDED = [0, 0, 80, 248]


def judged(track):
    """Extremes and steps of an axis, with what rounding may make of a step."""
    segments, stands = track
    low = high = float(stands)
    peak, step, digits = [0, 0, 0, 0], [0, 0, 0], [0, 0, 0]
    sure = [0, 0, 0, 0]
    before, slack = [Fraction(0)] * 3, [0, 0, 0]
    for _, dur, p, e in segments:
        a, b = extremes(p)
        low, high = min(low, a), max(high, b)
        now, d = [None], p
        for n in (1, 2, 3):
            d = derived(d)
            most = max(abs(x) for x in extremes(d)) / float(dur)**n
            peak[n] = max(peak[n], most)
            sure[n] = max(sure[n], most - ROUNDED[n] * 2**-(32 + e) /
                          float(dur)**n - 2**-31)
            if n < 3:
                now.append((d[0] / dur**n, sum(d) / dur**n))
        seen = max(float(dur), PERIOD)
        own = [0, 2**-32 * (1 + 3 / seen) + 22 * 2**-(32 + e) / float(dur),
               2**-16 + 2**-32 * 12 / seen**2 +
               80 * 2**-(32 + e) / float(dur)**2]
        for n in (1, 2):
            step[n] = max(step[n], float(abs(now[n][0] - before[n])))
            digits[n] = max(digits[n], slack[n] + own[n])
            before[n] = now[n][1]
        slack = own
    for n in (1, 2):
        step[n] = max(step[n], float(abs(before[n])))
        digits[n] = max(digits[n], slack[n])
    return {"low": low, "high": high, "vel": peak[1], "acc": peak[2],
            "jerk": peak[3], "sure": dict(zip(["vel", "acc", "jerk"], sure[1:])),
            "step": step, "digits": digits}


# --- random moves ------------------------------------------------------------

def keys_of(r, curve, first, last, middle, swing):
    count = r.randint(2, 6)
    times = sorted({round(r.uniform(first + 0.3, last - 0.3), 2)
                    for _ in range(count - 2)})
    times = [first] + times + [last]
    values = [round(middle + r.uniform(-swing, swing), 3) for _ in times]
    return "[" + ", ".join("[%.3f s, %.3f]" % k
                           for k in zip(times, values)) + "]"


def cycles_of(r, curve, keys):
    """Some of them end where they start; other curves than bezier go on then."""
    mode = r.choice(["mirror", "repeat-offset", "repeat"])
    if mode == "repeat":
        first = re.match(r"\[\[[^,]+, ([^\]]+)\]", keys)[1]
        keys = re.sub(r"[^ ]+\]\]$", first + "]]", keys)
    return "cycles: {after: %s, after_count: %d}, " % (
        mode, r.randint(1, 2)), keys


def axis_of(r, name, curve, end, swing=60.0, middle=0.0):
    keys = keys_of(r, curve, 0 if r.random() < 0.7 else 0.5, end, middle, swing)
    more = ""
    if r.random() < (0.6 if curve == "bezier" else 0.25):
        more, keys = cycles_of(r, curve, keys)
    if curve == "bezier" and r.random() < 0.5:
        more += "smoothing: acceleration, "
    return "    %s: {curve: %s, %skeys: %s}\n" % (name, curve, more, keys)


def move_of(r):
    """move.yaml, the axes in an order of its own; the camera in it, and whether
    there is nothing on top of the axes."""
    end = round(r.uniform(4, 15), 2)
    order = r.sample(sorted(AXES), r.randint(1, 4))
    curves = SMOOTH if r.random() < 0.5 else CURVES
    text, camera = [], None
    if r.random() < 0.15:
        camera = random_camera.Camera(r)
        text.append(camera.text)
        order = ["pan", "tilt"]
    else:
        text.append("axes:\n")
        text += [axis_of(r, name, r.choice(curves), end) for name in order]
    name = r.choice(order)
    plain = len(text)
    if r.random() < 0.3:
        text.append("layers:\n  - axes:\n  " +
                    axis_of(r, name, r.choice(SMOOTH), end, 3))
    if r.random() < 0.25:
        text.append("fade:\n  axes:\n" + axis_of(r, name, r.choice(SMOOTH), end) +
                    "  weight: {curve: %s, keys: [[%.2f s, 0 %%], [%.2f s, "
                    "100 %%]]}\n" % (r.choice(["s-curve", "quintic"]),
                                     end * 0.3, end * 0.8))
    if r.random() < 0.4:
        text.append("warp: {keys: [[0 s, 0 s], [%.2f s, %.2f s]]}\n"
                    % (end * r.uniform(1, 2.5), end * r.choice([1, 1, 0.8])))
    return "".join(text), camera, len(text) == plain


def rig_of(limits):
    text = ["tick: 1 ms\nbuses:\n"]
    text += ["  can%d: {kind: canopen, bit_rate: 1 Mbit/s}\n" % i
             for i in range(2)]
    text.append("axes:\n")
    for i, (name, unit) in enumerate(AXES.items()):
        limit = limits.get(name, WIDE)
        jerk = limit["jerk"] and ", jerk: %.9f" % limit["jerk"] or ""
        text.append(
            "  %s:\n    unit: %s\n    limits: {position: [%.9f, %.9f], "
            "velocity: %.9f, acceleration: %.9f%s}\n"
            "    following_error: {floor: 1000, time: 20 ms}\n"
            "    drive: {kind: cia402, bus: can%d, node: %d, counts: 100 per "
            "%s}\n    sim: {bandwidth: 25 Hz, damping: 0.9}\n"
            % (name, unit, limit["low"], limit["high"], limit["vel"],
               limit["acc"], jerk, i % 2, 1 + i // 2, unit))
    return "".join(text)


# --- limits and what is said of them -------------------------------------------

FACTORS = [0.5, 0.99, 1 - 1e-6, 1 + 1e-6, 1.01, 3]


def limits_of(r, judge):
    limit = {}
    for name in ("vel", "acc", "jerk"):
        limit[name] = min(max(judge[name], 1e-3) * r.choice(FACTORS), 2e9)
    if r.random() < 0.3:
        limit["jerk"] = 0
    room = max(judge["high"] - judge["low"], 1) * r.choice([0.1, 1e-6])
    limit["low"] = judge["low"] - room * r.choice([1, 1, 1, -1])
    limit["high"] = max(judge["high"] + room * r.choice([1, 1, 1, -1]),
                        limit["low"] + 1e-3)
    return limit


def expected(judge, limit):
    """What check must say, and what it may say, besides."""
    must, may = set(), set()

    def judge_one(what, size, most, unsure):
        if size > most + unsure:
            must.add(what)
        elif size > most - unsure:
            may.add(what)

    near = 1e-9
    judge_one("low", -judge["low"], -limit["low"], 1e-9)
    judge_one("high", judge["high"], limit["high"], 1e-9)
    for name in ("vel", "acc", "jerk"):
        if limit[name]:
            unsure = near * limit[name] + 2e-5
            judge_one(name, judge["sure"][name], limit[name], unsure)
            if judge[name] > limit[name] - unsure:
                may.add(name)
    by_acc, by_jerk = limit["acc"] * PERIOD, limit["jerk"] * PERIOD**2
    most = SAMPLING * (min(by_acc, by_jerk) if by_jerk else by_acc)
    judge_one("vel step", judge["step"][1], most + judge["digits"][1] / 2,
              judge["digits"][1] / 2 + 1e-4 * most)
    if limit["jerk"]:
        most = SAMPLING * limit["jerk"] * PERIOD
        judge_one("acc step", judge["step"][2], most + judge["digits"][2] / 2,
                  judge["digits"][2] / 2 + 1e-4 * most)
    return must, may


SAID = {"position below the lowest": "low", "position above the highest": "high",
        "velocity": "vel", "acceleration": "acc", "jerk": "jerk",
        "velocity steps (infinite acceleration)": "vel step",
        "acceleration steps (infinite jerk)": "acc step",
        "not at rest at the first key": "vel step",
        "not at rest at the last key": "vel step"}


class Failed(Exception):
    pass


class Bench:
    def __init__(self, slew, directory):
        self.slew, self.directory = slew, Path(directory)

    def path(self, name, text=None):
        path = self.directory / name
        if text is not None:
            path.write_text(text)
        return path

    def run(self, *words, fine=(0,)):
        done = subprocess.run([self.slew, *map(str, words)],
                              capture_output=True, text=True, timeout=60)
        if done.returncode not in fine:
            raise Failed("slew %s: %d %s" % (" ".join(map(str, words)),
                                             done.returncode, done.stderr))
        return done

    def said(self, rig, move):
        report = json.loads(self.run("check", "--json", rig, move,
                                     fine=(0, 1)).stdout)
        said = {}
        for entry in report["violations"]:
            said.setdefault(entry["axis"], set()).add(SAID[entry["what"]])
        return said


def check_limits(bench, r, move, judges):
    """A rig whose limits are beside what the move does: both say the same."""
    limits = {name: limits_of(r, judge) for name, judge in judges.items()}
    said = bench.said(bench.path("tight.yaml", rig_of(limits)), move)
    over = 0
    for name, judge in judges.items():
        must, may = expected(judge, limits[name])
        got = said.get(name, set())
        if must - got:
            raise Failed("%s: missed %s: %s, limits %s"
                         % (name, must - got, judge, limits[name]))
        if got - must - may:
            raise Failed("%s: accused of %s: %s, limits %s"
                         % (name, got - must - may, judge, limits[name]))
        over += len(must)
    return over


# --- there and back -----------------------------------------------------------

def keys_read(path):
    """Axis: [(time as text, position)] of a move that import wrote."""
    axes, name = {}, None
    for line in path.read_text().splitlines():
        found = re.match(r"^  (\w+):$", line)
        if found:
            name = found[1]
            axes[name] = []
        found = re.match(r"^      - \[([^,]+), ([^],]+)", line) or \
            re.match(r"^      - \{t: ([^,]+), p: ([^,}]+)", line)
        if found:
            axes[name].append((found[1], Fraction(found[2])))
    return axes


def seconds(text, rate):
    if text.startswith("frame "):
        return Fraction(text[6:]) / rate
    return Fraction(text.removesuffix(" s"))


def position(track, t):
    segments, stands = track
    ticks = t * TICKS
    for start, dur, p, _ in segments:
        if ticks <= start + dur * TICKS:
            return value(p, max(Fraction(0), (ticks - start) / (dur * TICKS)))
    return value(segments[-1][2], 1) if segments else stands


def check_exchange(bench, seed, move, tracks, judges):
    form = FORMATS[seed % len(FORMATS)]
    rate = RATES[seed // len(FORMATS) % len(RATES)]
    rig = bench.path("wide.yaml")
    there, back = bench.path("there"), bench.path("back.yaml")
    done = bench.run("export", form, rig, move, "--fps", rate, "--out", there,
                     fine=(0, 2))
    if done.returncode == 2:
        if form == "maya" and "/1001 frames a second" in done.stderr:
            return 0
        if form == "blender" and "(until)" in done.stderr:
            return 0
        raise Failed("%s at %s: %s" % (form, rate, done.stderr))
    options = re.findall(r"to read it back: (.*)", done.stdout)
    bench.run("import", form, there, "--rig", rig, "--out", back,
              *(options[0].split() if options else []))
    keys = keys_read(back)
    if set(keys) != set(tracks):
        raise Failed("%s: axes %s, not %s" % (form, set(keys), set(tracks)))
    fps = Fraction(rate)
    first = min(seconds(k[0][0], fps) for k in keys.values())
    near = 3 * 2**-32 if form in FORMATS[:4] else 2e-8
    for name, rows in keys.items():
        for text, p in rows[::max(1, len(rows) // 20)]:
            t = seconds(text, fps)
            speed = judges[name]["vel"]
            off = abs(position(tracks[name], t) - p)
            if t >= 0 and off > near + speed * 3e-13:
                raise Failed("%s at %s, %s: off by %g at %s (first %s)"
                             % (form, rate, name, off, text, first))
    return 1


def check_import_says(bench, r, move, judges):
    """What import says of limits with some distance is what check says."""
    limits = {n: {"low": j["low"] - 10, "high": j["high"] + 10,
                  "vel": 1.2 * max(j["vel"], 1), "acc": 1.2 * max(j["acc"], 1),
                  "jerk": 1.2 * max(j["jerk"], 1)} for n, j in judges.items()}
    rig = bench.path("near.yaml", rig_of(limits))
    form, there, back = r.choice(FORMATS), bench.path("there"), \
        bench.path("back.yaml")
    done = bench.run("export", form, rig, move, "--fps", 25, "--out", there,
                     fine=(0, 2))
    if done.returncode == 2:
        return
    options = re.findall(r"to read it back: (.*)", done.stdout)
    report = json.loads(bench.run(
        "import", form, there, "--rig", rig, "--out", back, "--json",
        *(options[0].split() if options else [])).stdout)
    said = bench.said(rig, back)
    for row in report["curves"]:
        if row["within_limits"] == (row["axis"] in said):
            raise Failed("%s: import says %s, check %s" % (form, row, said))


def compiled_of(bench, text):
    """The tracks of a move under wide limits, or why it was refused."""
    wide, move = bench.path("wide.yaml", rig_of({})), bench.path("alone.yaml",
                                                                 text)
    compiled = bench.path("alone.slt")
    done = bench.run("compile", "--out", compiled, wide, move, fine=(0, 2))
    return tracks_of(compiled) if done.returncode == 0 else None, done.stderr


def check_camera(bench, camera, tracks):
    seen = camera.seen() and compiled_of(bench, camera.seen())[0]
    wrong = random_camera.judge(camera, tracks, seen)
    if wrong:
        raise Failed("camera: " + wrong)


def check_refused(bench, text, camera, said):
    """A path is planned, keys are, and a camera that can be is."""
    if camera:
        alone, why = compiled_of(bench, camera.alone())
        if alone is None:
            raise Failed("the path was refused: %s%s" % (why, text))
        if random_camera.is_refused_rightly(camera, alone, said):
            return
    elif any(words in said for words in REFUSED_RIGHTLY):
        return
    raise Failed("refused: %s%s" % (said, text))


def one(bench, seed):
    r = random.Random(seed)
    text, camera, plain = move_of(r)
    move = bench.path("move.yaml", text)
    wide, compiled = bench.path("wide.yaml", rig_of({})), bench.path("move.slt")
    done = bench.run("compile", "--out", compiled, wide, move, fine=(0, 2))
    if done.returncode == 2:
        check_refused(bench, text, camera, done.stderr)
        return None, 0
    tracks = tracks_of(compiled)
    if camera and plain:
        check_camera(bench, camera, tracks)
    judges = {name: judged(track) for name, track in tracks.items()}
    over = check_limits(bench, r, move, judges)
    there = check_exchange(bench, seed, move, tracks, judges)
    check_import_says(bench, r, move, judges)
    return over, there


def several(slew, seeds):
    """Refused, violations, there and back, and what failed, of these seeds."""
    refused = over = there = 0
    failures = []
    with tempfile.TemporaryDirectory() as directory:
        bench = Bench(slew, directory)
        for seed in seeds:
            try:
                violations, came_back = one(bench, seed)
            except Failed as failure:
                failures.append("seed %d: %s" % (seed, failure))
                continue
            refused += violations is None
            over += violations or 0
            there += came_back
    return refused, over, there, failures


def main():
    slew, count = sys.argv[1], int(sys.argv[2])
    first = int(sys.argv[3]) if len(sys.argv) > 3 else 1
    parts = os.cpu_count() or 1
    with multiprocessing.Pool(parts) as pool:
        done = pool.starmap(several, [
            (slew, range(first + part, first + count, parts))
            for part in range(parts)])
    refused, over, there = (sum(d[i] for d in done) for i in range(3))
    failures = [failure for d in done for failure in d[3]]
    for failure in failures:
        print(failure)
    print("%d moves, %d refused by the planner, %d violations; %d "
          "there and back; %d failed"
          % (count, refused, over, there, len(failures)))
    return bool(failures) or refused > count // 5 or over < count // 4


if __name__ == "__main__":
    sys.exit(main())
