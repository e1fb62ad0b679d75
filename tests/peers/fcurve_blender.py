#!/usr/bin/env python3
"""Actions made in Blender itself, exported, imported and compared.

    PYTHON_WITH_BPY tests/peers/fcurve_blender.py build/slew [ACTIONS] [SEED]

make peers-blender installs Blender as a Python module and runs this.  Random
actions with every handle, interpolation, easing, extrapolation and cycle go
through examples/blender/slew_export.py and slew import; what slew samples, a
quarter of a frame apart, is compared with FCurve.evaluate.  Then the way back:
slew export, examples/blender/slew_import.py, and evaluated again.

Blender computes in single precision: a curve may be off by 4e-6 of the larger
of its range and its values, and by what its slope makes of a frame rounded to 24
bits; ELASTIC also by the 1/1024 of the swing that slew spreads over a span.
Curves that jump, as where a number of cycles ends, slew refuses.
"""
import os
import random
import runpy
import subprocess
import sys
import tempfile

import bpy

KINDS = ("LINEAR", "BEZIER", "SINE", "QUAD", "CUBIC", "QUART", "QUINT", "EXPO",
         "BACK", "BOUNCE", "ELASTIC", "CONSTANT")
HANDLES = ("FREE", "ALIGNED", "VECTOR", "AUTO", "AUTO_CLAMPED")
EASINGS = ("AUTO", "EASE_IN", "EASE_OUT", "EASE_IN_OUT")
# Property, index, axis of the rig; Blender's unit in the axis's own.
CURVES = (("location", 0, "x", 1000), ("location", 2, "z", 1000),
          ("rotation_euler", 1, "rotation_y", 180 / 3.141592653589793),
          ('["pan"]', 0, "pan", 1), ('["zoom"]', 0, "zoom", 1))
RIG = """buses:
  can0: {kind: canopen, bit_rate: 1 Mbit/s}
axes:
""" + "".join("""  %s:
    unit: %s
    limits: {position: [-100000, 100000], velocity: 1e6, acceleration: 1e9}
    following_error: {floor: 2}
    drive: {kind: cia402, bus: can0, node: %d, counts: 100}
""" % (axis, "mm" if axis in "xz" else "deg", i + 1)
              for i, (_, _, axis, _) in enumerate(CURVES))
QUARTERS = 4


def set_handles(point, rng, before, after):
    """Handles of random kinds, free ones somewhere in their spans."""
    point.handle_left_type = point.handle_right_type = "FREE"
    t, v = point.co
    point.handle_left = (t - before * rng.uniform(0.05, 0.9),
                         v + rng.uniform(-1, 1))
    point.handle_right = (t + after * rng.uniform(0.05, 0.9),
                          v + rng.uniform(-1, 1))
    point.handle_left_type = rng.choice(HANDLES)
    point.handle_right_type = rng.choice(HANDLES)


def set_easing(point, rng):
    point.interpolation = rng.choice(KINDS[1:2] * 8 + KINDS)
    point.easing = rng.choice(EASINGS)
    point.back = rng.uniform(0, 3)
    point.amplitude = rng.uniform(0, 1.5)
    point.period = rng.choice((0, rng.uniform(2, 20)))


def add_cycles(curve, rng):
    """Cycles that do not jump."""
    modes = ["NONE", "REPEAT_OFFSET", "MIRROR"]
    ends = curve.keyframe_points[0].co[1], curve.keyframe_points[-1].co[1]
    if ends[0] == ends[1]:
        modes.append("REPEAT")
    modifier = curve.modifiers.new("CYCLES")
    modifier.mode_before = rng.choice(modes)
    modifier.mode_after = rng.choice(modes)
    modifier.cycles_before = rng.choice((0, 1, 2))
    modifier.cycles_after = rng.choice((0, 1, 3))


def fill(curve, rng):
    """Random keys."""
    count = rng.randint(2, 7)
    frames = sorted(rng.sample(range(-20, 140), count))
    values = [round(rng.uniform(-2, 2), 3) for _ in frames]
    if rng.random() < 0.3:
        values[-1] = values[0]
    curve.keyframe_points.add(count)
    points = curve.keyframe_points
    for point, frame, value in zip(points, frames, values):
        point.co = frame, value
    curve.extrapolation = rng.choice(("CONSTANT", "LINEAR"))
    curve.auto_smoothing = rng.choice(("NONE", "NONE", "CONT_ACCEL"))
    for i, point in enumerate(points):
        set_handles(point, rng, frames[i] - frames[max(i - 1, 0)] or 9,
                    frames[min(i + 1, count - 1)] - frames[i] or 9)
        set_easing(point, rng)
        if point.interpolation == "CONSTANT" and i + 1 < count:
            points[i + 1].co = frames[i + 1], point.co[1]
    if rng.random() < 0.4:
        add_cycles(curve, rng)
    curve.update()


def new_action(rng):
    owner = bpy.data.objects["slew"]
    owner["pan"] = owner["zoom"] = 0.0
    owner.animation_data_create()
    owner.animation_data.action = bpy.data.actions.new("slew")
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = rng.choice((24, 25, 30)), 1
    scene.frame_start = rng.randint(-30, 30)
    scene.frame_end = scene.frame_start + rng.randint(40, 160)
    for path, index, _, _ in CURVES:
        fill(SCRIPTS["slew_import"]["new_curve"](owner, path, index), rng)
    return owner


def run(*arguments):
    done = subprocess.run(arguments, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip())
    return done.stdout


def samples(slew, rig, move, rate):
    """{axis: [position at every sample]}"""
    rows = [line.split(",") for line in
            run(slew, "sample", "--rate", str(rate), rig, move).splitlines()]
    head = {name.rsplit("_", 1)[0]: i for i, name in enumerate(rows[0])
            if name.endswith(("_mm", "_deg"))}
    return {axis: [float(row[i]) for row in rows[1:]]
            for axis, i in head.items()}


def allowed(curve, values):
    """Largest difference that single precision explains."""
    points = curve.keyframe_points
    size = max(max(values) - min(values), max(map(abs, values)))
    # a frame is good to 2^-24 of itself, and so the slope of a handle
    frame = max(abs(point.co[0]) for point in points) * 2.0 ** -23
    slope = max(abs(b - a) for a, b in zip(values, values[1:])) * QUARTERS
    allow = size * TOLERANCE + slope * frame
    if curve.extrapolation == "LINEAR":
        allow += size * frame / min(
            [abs(point.co[0] - handle[0])
             for point, handle in ((points[0], points[0].handle_left),
                                   (points[-1], points[-1].handle_right))
             if point.co[0] != handle[0]] + [1])
    swing = max((max(abs(b.co[1] - a.co[1]), a.amplitude)
                 for a, b in zip(points, points[1:])
                 if a.interpolation == "ELASTIC"), default=0)
    return allow + swing / 1000


def compare(owner, got, start, kinds):
    """Points compared; what is wrong, as text."""
    count, wrong = 0, []
    for curve in SCRIPTS["slew_export"]["fcurves_of"](owner):
        axis, scale = next((a, s) for p, i, a, s in CURVES
                           if (p, i) == (curve.data_path, curve.array_index))
        want = [curve.evaluate(start + k / QUARTERS)
                for k in range(len(got[axis]))]
        off = [abs(g / scale - w) for g, w in zip(got[axis], want)]
        worst = max(off)
        limit = allowed(curve, want)
        count += len(off)
        kinds.update(p.interpolation for p in curve.keyframe_points)
        if worst > limit:
            wrong.append("%s: off by %.3g of %.3g at frame %g" % (
                axis, worst, limit, start + off.index(worst) / QUARTERS))
    return count, wrong


def one(slew, folder, rng, kinds):
    names = [os.path.join(folder, name) for name in
             ("rig.yaml", "a.json", "a.yaml", "b.json", "b.yaml")]
    rig, action, move, back, again = names
    owner = new_action(rng)
    scene = bpy.context.scene
    start, fps = scene.frame_start, scene.render.fps
    SCRIPTS["slew_export"]["slew_export"](action, owner)
    run(slew, "import", "blender", action, "--rig", rig, "--out", move)
    got = samples(slew, rig, move, QUARTERS * fps)
    count, wrong = compare(owner, got, start, kinds)
    # slew to slew: the same integers; slew to Blender: the same curves
    run(slew, "export", "blender", rig, move, "--fps", str(fps), "--out", back)
    run(slew, "import", "blender", back, "--rig", rig, "--out", again)
    with open(move, encoding="utf-8") as a, open(again, encoding="utf-8") as b:
        if a.read() != b.read():
            wrong.append("slew export and import: another move")
    SCRIPTS["slew_import"]["slew_import"](
        back, {axis: "%s[%d]" % (path, index)
               for path, index, axis, _ in CURVES}, owner)
    more, returned = compare(owner, got, 0, kinds)
    return count + more, wrong + ["back in Blender: " + w for w in returned]


def main():
    if not 2 <= len(sys.argv) <= 4:
        sys.exit(__doc__)
    slew = sys.argv[1]
    actions = int(sys.argv[2]) if len(sys.argv) > 2 else 60
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else 1
    rng = random.Random(seed)
    bpy.data.objects.new("slew", None)
    points, bad, refused, kinds = 0, 0, 0, set()
    with tempfile.TemporaryDirectory() as folder:
        with open(os.path.join(folder, "rig.yaml"), "w",
                  encoding="utf-8") as file:
            file.write(RIG)
        for i in range(actions):
            try:
                count, wrong = one(slew, folder, rng, kinds)
            except RuntimeError as error:
                refused += 1
                print("action %d: refused: %s" % (i, error))
                continue
            points += count
            bad += bool(wrong)
            for what in wrong:
                print("action %d: %s" % (i, what))
    print("Blender %s, seed %d: %d actions, %d refused, %d points, "
          "%d interpolations, %d wrong" % (bpy.app.version_string, seed,
                                           actions, refused, points,
                                           len(kinds), bad))
    sys.exit(1 if bad or refused > actions // 4 else 0)


TOLERANCE = 4e-6
SCRIPTS = {name: runpy.run_path("examples/blender/%s.py" % name)
           for name in ("slew_export", "slew_import")}

if __name__ == "__main__":
    main()
