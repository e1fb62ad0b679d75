#!/usr/bin/env python3
"""Is the subject in the middle of the picture, at every tick?

    python3 tests/peers/space.py build/slew [DIRECTORY...]

Takes the positions of a move from slew at every tick of its rig, places the
camera by forward kinematics of its own (matrices in double, from the text of the
rig file), and measures the angle between the view and the subject; with a lens,
focus against the distance and the size of the subject in the picture.  A tool that turns
through keys is compared with these: with `slerp` at every tick, else when it comes
to a key.  Status 0 when every angle is below 0.05 degrees.
"""
import csv
import glob
import io
import math
import os
import shutil
import subprocess
import sys
import tempfile

import yaml

LIMIT_DEG = 0.05
LIMIT_FOCUS_MM = 1.0
LIMIT_SIZE = 1e-4
MM = {"mm": 1.0, "m": 1000.0, "cm": 10.0}


def number(text, units):
    """"1.2 m" in mm, "30 deg" in deg, "2 s" in s."""
    value, unit = str(text).split()
    return float(value) * units[unit]


def point(value):
    return [number(item, MM) for item in value]


def add(a, b):
    return [x + y for x, y in zip(a, b)]


def scale(a, k):
    return [k * x for x in a]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0]]


def unit(a):
    return scale(a, 1 / math.sqrt(dot(a, a)))


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)]
            for i in range(3)]


def turned(m, v):
    return [dot(row, v) for row in m]


def about(axis, deg):
    """The matrix of a rotation about a unit axis."""
    x, y, z = axis
    c, s = math.cos(math.radians(deg)), math.sin(math.radians(deg))
    k = 1 - c
    return [[c + x * x * k, x * y * k - z * s, x * z * k + y * s],
            [y * x * k + z * s, c + y * y * k, y * z * k - x * s],
            [z * x * k - y * s, z * y * k + x * s, c + z * z * k]]


Y, Z = [0, 1, 0], [0, 0, 1]


def coordinate(joint, row, units):
    at = row[joint["axis"]]
    offset = number(joint["offset"], units) if "offset" in joint else 0
    return offset - at if joint.get("reversed", False) else offset + at


DEG = {"deg": 1.0}


def carried(kin, row):
    """Pivot, and the rotation that the carrier gives the head."""
    one = about(Z, 0)
    if "linear" in kin:
        at = point(kin["linear"].get("origin", ["0 mm"] * 3))
        for joint in kin["linear"]["axes"]:
            at = add(at, scale(unit(joint["direction"]),
                               coordinate(joint, row, MM)))
        return at, one
    if "arc" in kin:
        arc = kin["arc"]
        radius = number(arc["radius"], MM)
        normal = unit(arc.get("normal", Z))
        start = arc.get("start", [1, 0, 0])
        start = unit(add(start, scale(normal, -dot(start, normal))))
        turn = about(normal, math.degrees(
            coordinate(arc["axis"], row, MM) / radius))
        at = add(point(arc["centre"]), scale(turned(turn, start), radius))
        return at, turn if arc.get("turning", True) else one
    if "gantry" in kin:
        gantry = kin["gantry"]
        y1, y2 = point(gantry["rails"])
        x1, x2, y, z = (coordinate(gantry[name], row, MM)
                        for name in ("x1", "x2", "y", "z"))
        bridge = unit([(x2 - x1) / (y2 - y1), 1, 0])
        at = add([x1, y1, z], scale(bridge, y - y1))
        return at, about(
            Z, -math.degrees(math.atan((x2 - x1) / (y2 - y1))))
    if "jib" in kin:
        jib = kin["jib"]
        pan = about(Z, coordinate(jib["pan"], row, DEG))
        boom = product(pan, about(Y, -coordinate(jib["tilt"], row, DEG)))
        length = number(jib["length"], MM)
        if "extend" in jib:
            length += coordinate(jib["extend"], row, MM)
        frame = {"boom": boom, "level": pan,
                 "counter-rotating": one}[jib.get("mount", "level")]
        drop = point(jib.get("drop", ["0 mm"] * 3))
        at = add(point(jib["foot"]), turned(boom, [length, 0, 0]))
        return add(at, turned(frame, drop)), frame
    return [0, 0, 0], one


def columns(a, b, c):
    return [[a[i], b[i], c[i]] for i in range(3)]


def framed(forward, up):
    """Right, up and backwards as columns."""
    forward = unit(forward)
    right = unit(cross(forward, up))
    return columns(right, cross(right, forward), scale(forward, -1))


def on_arm(arm, row):
    """Pupil and camera of the tool, by the Denavit-Hartenberg table."""
    base = arm.get("base", {})
    at, z = point(base.get("position", ["0 mm"] * 3)), unit(base.get("z", Z))
    x = base.get("x", [1, 0, 0])
    x = unit(add(x, scale(z, -dot(x, z))))
    frame = columns(x, cross(z, x), z)
    for joint in arm["joints"]:
        theta, d = (number(joint.get("theta", "0 deg"), DEG),
                    number(joint.get("d", "0 mm"), MM))
        if joint["axis"] in arm["slides"]:
            d += coordinate(joint, row, MM)
        else:
            theta += coordinate(joint, row, DEG)
        turn = product(frame, about(Z, theta))
        at = add(at, scale(turned(frame, Z), d))
        at = add(at, scale(turned(turn, [1, 0, 0]),
                           number(joint.get("a", "0 mm"), MM)))
        frame = product(turn, about([1, 0, 0],
                                    number(joint.get("alpha", "0 deg"), DEG)))
    tool = arm["tool"]
    return (add(at, turned(frame, point(tool["position"]))),
            product(frame, framed(tool["view"], tool["up"])))


def camera(kin, row):
    """Pupil, and right, up and backwards as columns."""
    if "arm" in kin:
        return on_arm(kin["arm"], row)
    head = kin["head"]
    pivot, frame = carried(kin, row)
    forward = unit(head.get("forward", [1, 0, 0]))
    left = unit(cross(head.get("up", Z), forward))
    up = cross(forward, left)
    mount = [[forward[i], left[i], up[i]] for i in range(3)]
    turn = product(product(frame, mount),
                   about(Z, coordinate(head["pan"], row, DEG)))
    turn = product(turn, about(Y, -coordinate(head["tilt"], row, DEG)))
    if "roll" in head:
        turn = product(turn, about([1, 0, 0],
                                   coordinate(head["roll"], row, DEG)))
    nodal = point(head.get("nodal", ["0 mm"] * 3))
    pupil = add(pivot, turned(turn, [nodal[0], -nodal[1], nodal[2]]))
    return pupil, framed(turned(turn, [1, 0, 0]), turned(turn, [0, 0, 1]))


def quintic(keys, t):
    """Through points at times, at rest at both ends; velocity and acceleration
    at keys between those of the parabola through three keys."""
    times = [number(k[0], {"s": 1.0}) for k in keys]
    points = [point(k[1]) for k in keys]

    def jet(i, axis):
        if i in (0, len(keys) - 1):
            return points[i][axis], 0.0, 0.0
        h, k = times[i] - times[i - 1], times[i + 1] - times[i]
        a = (points[i][axis] - points[i - 1][axis]) / h
        b = (points[i + 1][axis] - points[i][axis]) / k
        return points[i][axis], (a * k + b * h) / (h + k), 2 * (b - a) / (h + k)

    if t <= times[0] or t >= times[-1]:
        return points[0 if t <= times[0] else -1]
    i = max(n for n, at in enumerate(times) if at <= t)
    dur = times[i + 1] - times[i]
    u = (t - times[i]) / dur
    out = []
    for axis in range(3):
        (p0, v0, a0), (p1, v1, a1) = jet(i, axis), jet(i + 1, axis)
        v0, v1, a0, a1 = v0 * dur, v1 * dur, a0 * dur**2, a1 * dur**2
        d = p1 - p0
        c = [p0, v0, a0 / 2,
             10 * d - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1,
             -15 * d + 8 * v0 + 7 * v1 + 1.5 * a0 - a1,
             6 * d - 3 * v0 - 3 * v1 - 0.5 * a0 + 0.5 * a1]
        out.append(sum(c[k] * u**k for k in range(6)))
    return out


def subject(kin, look, row, t):
    if "at" in look:
        return point(look["at"])
    if "table" in look:
        table = kin["table"]
        return add(point(table["centre"]),
                   turned(about(Z, coordinate(table["axis"], row, DEG)),
                          point(look["table"])))
    assert look["subject"].get("curve", "quintic") == "quintic"
    return quintic(look["subject"]["keys"], t)


def matrix(q):
    """The rotation w, x, y, z, of any length."""
    w, x, y, z = scale(q, 1 / math.sqrt(sum(v * v for v in q)))
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]


def turn_of(a, b):
    """Axis and degrees of the rotation from a to b, seen from a."""
    m = [[sum(a[k][i] * b[k][j] for k in range(3)) for j in range(3)]
         for i in range(3)]
    axis = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]]
    sine = math.sqrt(dot(axis, axis))
    deg = math.degrees(math.atan2(sine, m[0][0] + m[1][1] + m[2][2] - 1))
    return (scale(axis, 1 / sine) if sine > 0 else Z), deg


def orientation(key):
    if "quaternion" in key:
        return matrix(key["quaternion"])
    return framed(key["forward"], key.get("up", Z))


def keyed(look, t, tick):
    """The orientation that keys give, or None between those of a spline."""
    keys = [(number(key["t"], {"s": 1.0}), orientation(key))
            for key in look["keys"]]
    if t <= keys[0][0] or t >= keys[-1][0]:
        return keys[0 if t <= keys[0][0] else -1][1]
    for (t0, a), (t1, b) in zip(keys, keys[1:]):
        if abs(t - t1) < tick / 1000:
            return b
        if look.get("curve") == "slerp" and t0 <= t < t1:
            x = (t - t0) / (t1 - t0)
            axis, deg = turn_of(a, b)
            return product(a, about(axis, deg * x**3 * (10 - 15 * x + 6 * x * x)))
    return None


def missed(kin, look, row, t, tick):
    """Degrees between where the camera looks and where it should; the distance of
    its subject."""
    pupil, frame = camera(kin, row)
    if "keys" in look:
        want = keyed(look, t, tick)
        return turn_of(frame, want)[1] if want else None, 0.0
    to = add(subject(kin, look, row, t), scale(pupil, -1))
    view = [-r[2] for r in frame]
    across = cross(view, to)
    return (math.degrees(math.atan2(math.sqrt(dot(across, across)),
                                    dot(view, to))), math.sqrt(dot(to, to)))


def rows(slew, folder, rate):
    text = subprocess.run(
        [slew, "sample", "--quaternion", "--rate", str(rate), folder],
        check=True, capture_output=True, text=True).stdout
    table = csv.reader(io.StringIO(text))
    names = next(table)
    place = {name.removesuffix("_mm").removesuffix("_deg"): i
             for i, name in enumerate(names)
             if name.endswith(("_mm", "_deg")) or name.startswith("camera_")}
    for line in table:
        yield int(line[0]) * 1e-9, {name: float(line[i])
                                    for name, i in place.items()}


def judge(slew, folder, name=None):
    with open(f"{folder}/rig.yaml", encoding="utf-8") as file:
        rig = yaml.safe_load(file)
    with open(f"{folder}/move.yaml", encoding="utf-8") as file:
        move = yaml.safe_load(file)
    kin, shot = rig["kinematics"], move.get("camera", {})
    look = shot["look"] if shot else move["path"]["tool"]["look"]
    if isinstance(look, list):
        look = {"at": look}
    if "arm" in kin:
        kin["arm"]["slides"] = {name for name, axis in rig["axes"].items()
                                if axis["unit"] == "mm"}
    tick = number(rig.get("tick", "1 ms"), {"ms": 1e-3, "us": 1e-6})
    worst = off_focus = off_view = 0.0
    sizes, ticks, judged = [], 0, 0
    for t, row in rows(slew, folder, round(1 / tick)):
        off, distance = missed(kin, look, row, t, tick)
        ticks += 1
        if off is not None:
            worst, judged = max(worst, off), judged + 1
        frame = camera(kin, row)[1]
        q = matrix([row["camera_" + part] for part in "wxyz"])
        off_view = max(off_view, max(abs(a - b) for r, s in zip(frame, q)
                                     for a, b in zip(r, s)))
        if shot.get("focus", False):
            off_focus = max(off_focus,
                            abs(row[kin["lens"]["focus"]] - distance))
        if "zoom" in shot:
            sizes.append(row[kin["lens"]["zoom"]] / distance)
    spread = max(sizes) / min(sizes) - 1 if sizes else 0.0
    good = (judged > 1 and worst < LIMIT_DEG and off_view < 1e-9 and off_focus < LIMIT_FOCUS_MM
            and spread < LIMIT_SIZE)
    lens = ""
    if shot.get("focus", False):
        lens += f", focus within {off_focus:.2g} mm"
    if sizes:
        lens += f", size within {100 * spread:.2g} %"
    what = ("subject within {} deg of the middle" if "keys" not in look
            else f"turned within {{}} deg of its keys at {judged} of these")
    print(f"{name or folder}: {ticks} ticks, {what.format(f'{worst:.2g}')}{lens}: "
          f"{'PASS' if good else 'FAIL'}")
    return good


def at_every_tick(slew, folder):
    """The keyed tool by slerp, of which this script has a formula."""
    with tempfile.TemporaryDirectory() as copy:
        shutil.copy(f"{folder}/rig.yaml", copy)
        with open(f"{folder}/move.yaml", encoding="utf-8") as file:
            text = file.read().replace("curve: c2", "curve: slerp")
        with open(os.path.join(copy, "move.yaml"), "w",
                  encoding="utf-8") as file:
            file.write(text)
        return judge(slew, copy, f"{folder} by slerp")


def main():
    slew, folders = sys.argv[1], sys.argv[2:]
    if not folders:
        folders = []
        for path in sorted(glob.glob("examples/*/rig.yaml")):
            with open(path, encoding="utf-8") as file:
                if "kinematics:" in file.read():
                    folders.append(path.rsplit("/", 1)[0])
    results = [judge(slew, folder) for folder in folders]
    if not sys.argv[2:]:
        results.append(at_every_tick(slew, "examples/armkeys"))
    return 0 if results and all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
