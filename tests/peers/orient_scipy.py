#!/usr/bin/env python3
"""Heads that turn through keyed orientations, beside SciPy.

    PYTHONPATH=build/peers/site python3 tests/peers/orient_scipy.py build/slew N

N random moves: keys at uneven times, written as angles, quaternions or
directions, on mounts of any direction.  `slew sample` gives pan, tilt and roll;
forward kinematics with scipy.spatial.transform.Rotation says where the camera
looks, and Slerp, RotationSpline, or squad by its formula where it should.  Every sample must be within the bound that `slew plan` states for each
angle.  Moves that slew refuses, because they pass too near to straight up or
down, must be few, and say so.
"""
import csv
import os
import random
import re
import subprocess
import sys
import tempfile

import numpy as np
from scipy.spatial.transform import Rotation, RotationSpline, Slerp

RATE = 40

RIG = """buses:
  can0: {kind: canopen, bit_rate: 1 Mbit/s}
axes:
""" + "".join(f"""  {name}:
    unit: deg
    limits:
      position: [-100000 deg, 100000 deg]
      velocity: 100000 deg/s
      acceleration: 1000000 deg/s2
      jerk: 100000000 deg/s3
    following_error: {{floor: 1 deg, time: 20 ms}}
    drive: {{kind: cia402, bus: can0, node: {node}, counts: 100 per deg}}
""" for node, name in enumerate(("pan", "tilt", "roll"), 1))


def frame(forward, up):
    """Right, up, backwards as columns."""
    forward = np.array(forward) / np.linalg.norm(forward)
    up = np.array(up) - forward * np.dot(up, forward)
    up /= np.linalg.norm(up)
    return Rotation.from_matrix(
        np.column_stack((np.cross(forward, up), up, -forward)))


def head(pan, tilt, roll):
    """Pan about up (y), tilt about right (x), roll about the view (-z)."""
    return (Rotation.from_rotvec(np.outer(np.radians(pan), [0, 1, 0]))
            * Rotation.from_rotvec(np.outer(np.radians(tilt), [1, 0, 0]))
            * Rotation.from_rotvec(np.outer(np.radians(roll), [0, 0, -1])))


def signed(q, like):
    """q or -q: squad goes the way that the signs say, not always the shorter."""
    return q if np.dot(q, like) >= 0 else -q


def arc(a, b, x):
    """Shoemake's slerp."""
    angle = np.arccos(np.clip(np.dot(a, b), -1, 1))
    if angle < 1e-9:
        return a
    return (np.sin((1 - x) * angle) * a + np.sin(x * angle) * b) / np.sin(angle)


def numbers(values):
    return "[" + ", ".join(f"{v:.9f}" for v in values) + "]"


class Move:
    def __init__(self, rng, curve):
        self.curve = curve
        self.text = "camera:\n  axes: {pan: pan, tilt: tilt, roll: roll}\n"
        forward, up = rng.choice((([1, 0, 0], [0, 0, 1]), ([0, 1, 0], [0, 0, 1]),
                                  ([0.5, -0.5, 0.2], [0.2, 0.6, 1])))
        # the mount's up is kept, and its forward made perpendicular to it
        up = np.array(up) / np.linalg.norm(up)
        ahead = np.array(forward) - up * np.dot(forward, up)
        self.mount = frame(ahead, up)
        self.text += f"  forward: {numbers(forward)}\n  up: {numbers(up)}\n"
        self.text += "  look:\n"
        if curve != "c2" or rng.random() < 0.5:
            self.text += f"    curve: {curve}\n"
        self.text += "    keys:\n"
        self.t, self.keys = [], []
        t, angles = rng.choice((0.0, 0.5)), [rng.uniform(-170, 170), 0, 0]
        for _ in range(rng.randint(2, 7)):
            self.add(rng, t, angles)
            t = round(t + rng.uniform(0.4, 3), 3)
            angles = [angles[0] + rng.uniform(-60, 60), rng.uniform(-35, 35),
                      rng.uniform(-40, 40)]
        self.keys = Rotation.concatenate(self.keys)

    def add(self, rng, t, angles):
        kind = rng.choice(("angles", "quaternion", "forward"))
        if kind == "angles":
            angles = [round(a, 6) for a in angles]
            turn = self.mount * head(*[[a] for a in angles])[0]
            said = "angles: [" + ", ".join(f"{a:.6f} deg" for a in angles) + "]"
        else:
            turn = self.mount * head(*[[a] for a in angles])[0]
            if kind == "quaternion":
                x, y, z, w = turn.as_quat() * rng.choice((-3, 1))
                said = "quaternion: " + numbers((w, x, y, z))
            else:
                m = turn.as_matrix()
                said = (f"forward: {numbers(-m[:, 2])}, up: {numbers(m[:, 1])}")
        self.text += f"      - {{t: {t:.3f} s, {said}}}\n"
        self.t.append(t)
        self.keys.append(turn)

    def slopes(self, i):
        """Of the parameter at both ends of span i."""
        h, n = np.diff(self.t), len(self.t) - 1
        if self.curve == "slerp":
            return 0, 0
        if self.curve == "c2":
            return float(i > 0), float(i + 1 < n)
        return (2 * h[i] / (h[i - 1] + h[i]) if i > 0 else 0,
                2 * h[i] / (h[i] + h[i + 1]) if i + 1 < n else 0)

    def parameter(self, t):
        """Span and u."""
        i = min(max(int(np.searchsorted(self.t, t, "right")) - 1, 0),
                len(self.t) - 2)
        x = min(max((t - self.t[i]) / (self.t[i + 1] - self.t[i]), 0), 1)
        a, b = self.slopes(i)
        # the quintic with these values, slopes and no second derivative
        rows = [[1, 0, 0, 0, 0, 0], [1] * 6, [0, 1, 0, 0, 0, 0],
                [0, 1, 2, 3, 4, 5], [0, 0, 2, 0, 0, 0], [0, 0, 2, 6, 12, 20]]
        c = np.linalg.solve(np.array(rows, float), [0, 1, a, b, 0, 0])
        return i, float(np.polyval(c[::-1], x))

    def squad(self, i, u):
        q, n = self.chain, len(self.chain) - 1

        def inner(k):
            if k in (0, n):
                return q[k]
            away = [(self.keys[k].inv() * self.keys[m]).as_rotvec()
                    for m in (k - 1, k + 1)]
            turn = Rotation.from_rotvec(-sum(away) / 4)
            return signed((self.keys[k] * turn).as_quat(), q[k])
        return arc(arc(q[i], q[i + 1], u), arc(inner(i), inner(i + 1), u),
                   2 * u * (1 - u))

    def want(self, times):
        places = [self.parameter(t) for t in times]
        if self.curve == "squad":
            self.chain = [self.keys[0].as_quat()]
            for key in self.keys[1:]:
                self.chain.append(signed(key.as_quat(), self.chain[-1]))
            return Rotation.from_quat([self.squad(i, u) for i, u in places])
        through = Slerp if self.curve == "slerp" else RotationSpline
        at = [self.t[i] + u * (self.t[i + 1] - self.t[i]) for i, u in places]
        return through(self.t, self.keys)(np.clip(at, self.t[0], self.t[-1]))


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True)
    return done.returncode, done.stdout, done.stderr


def compare(slew, folder, move):
    """The worst error over the bound, or None where it was refused."""
    with open(os.path.join(folder, "move.yaml"), "w") as file:
        file.write(move.text)
    code, out, err = run(slew, "sample", "--rate", str(RATE), folder)
    if code != 0:
        if "straight up or down" not in err:
            sys.exit(f"refused: {err}\n{move.text}")
        return None
    _, plan, _ = run(slew, "plan", folder)
    bound = float(re.search(r"baked within (\S+) deg", plan).group(1))
    rows = list(csv.DictReader(out.splitlines()))
    names = {n: next(k for k in rows[0] if k.startswith(n)
                     and "vel" not in k and "acc" not in k)
             for n in ("pan", "tilt", "roll")}
    time = next(iter(rows[0]))
    got = move.mount * head(*[[float(r[names[n]]) for r in rows]
                              for n in ("pan", "tilt", "roll")])
    want = move.want([float(r[time]) * 1e-9 for r in rows])
    off = np.degrees((got.inv() * want).magnitude())
    # three angles, each within its bound; 2e-7 deg: the digits of the file
    return float(off.max()), 3 * bound + 2e-7


def main():
    slew, cases = sys.argv[1], int(sys.argv[2])
    rng = random.Random(20260704)
    refused, worst, failed = 0, {}, 0
    with tempfile.TemporaryDirectory() as folder:
        with open(os.path.join(folder, "rig.yaml"), "w") as file:
            file.write(RIG)
        for case in range(cases):
            move = Move(rng, ("slerp", "squad", "c2")[case % 3])
            result = compare(slew, folder, move)
            if result is None:
                refused += 1
                continue
            off, most = result
            worst[move.curve] = max(worst.get(move.curve, 0), off)
            if not off <= most:
                failed += 1
                print(f"case {case}, {move.curve}: {off:.1e} deg, bound "
                      f"{most:.1e}\n{move.text}")
    for curve, off in sorted(worst.items()):
        print(f"{curve:6} within {off:.1e} deg of SciPy")
    print(f"{cases} moves, {refused} refused, {failed} failed")
    sys.exit(failed > 0 or refused * 5 > cases)


main()
