"""tests/firmware/linux/random_camera.py - random paths with a camera, and where it has to look.

The path is what the compiled axes x, y, z do (random_moves.py); densely sampled
and measured along its chords, it says by itself which way the camera looks:
towards a point, along its tangent, to the point so much farther on it, or to the
place of another curve at the same part of its length.  The compiled pan and tilt
have to point there, roll has to keep the horizon where the look is level.  A
camera that the planner refuses must be one that cannot be: whose direction, or
whose binormal, is another one on both sides of the time that is named.
"""
import bisect
import math
import re

CURVES = ["linear", "rounded", "smoothed", "catmull-rom", "akima", "c2",
          "quintic", "b-spline"]
LOOKS = ["at", "ahead", "level", "rotation-minimising", "frenet", "path",
         "dwell"]
SAMPLES = 1500


def points_of(r, count, y, spread):
    return [[round(700 * i + r.uniform(-spread, spread)),
             round(y + r.uniform(-2 * spread, 2 * spread)),
             round(500 + r.uniform(-spread, spread))] for i in range(count)]


def curve_of(r, curve, points):
    text = "curve: %s, points: %s" % (curve, points)
    if curve in ("rounded", "smoothed"):
        text += ", corner: %d mm" % r.randint(50, 200)
    return text


def speed_of(r, curve, points):
    """From rest to rest; a line turns where it rests."""
    time = r.uniform(6, 14)
    if curve == "linear" and len(points) > 2:
        spans = [math.dist(a, b) for a, b in zip(points, points[1:])]
        return "[%s, {law: quintic, time: %.2f s, length: rest}]" % (
            ", ".join("{law: quintic, time: %.2f s, length: %.12f mm}"
                      % (time / len(spans), length) for length in spans[:-1]),
            time / len(spans))
    if r.random() < 0.5:
        return "[{law: quintic, time: %.2f s}]" % time
    return ("[{law: ramp, time: %.2f s, to: %d mm/s}, {law: constant}, "
            "{law: ramp, time: %.2f s, to: 0 mm/s}]"
            % (r.uniform(1, 2), r.randint(100, 350), r.uniform(1, 2)))


def subject(r):
    return [r.randint(0, 3000), r.randint(900, 2500), r.randint(300, 1200)]


class Camera:
    """A path and a look, drawn; `text` is the move's."""

    def __init__(self, r):
        self.curve, self.look = r.choice(CURVES), r.choice(LOOKS)
        count = r.randint(4 if self.curve != "linear" else 2, 6)
        points = points_of(r, count, -900, 150)
        self.path = "{axes: [x, y, z], %s, speed: %s}" % (
            curve_of(r, self.curve, points), speed_of(r, self.curve, points))
        self.detail = self.other = None
        if self.look == "at":
            self.detail = subject(r)
            look = "{at: %s}" % self.detail
        elif self.look == "ahead":
            self.detail = (r.randint(150, 600), r.choice(["straight", "hold"]))
            look = "{ahead: %d mm, end: %s}" % self.detail
        elif self.look == "path":
            curve = r.choice(["c2", "quintic", "b-spline", "smoothed"])
            seen = curve_of(r, curve, points_of(r, r.randint(4, 6), 1500, 150))
            look = "{path: {%s}}" % seen
            self.other = "{axes: [x, y, z], %s, speed: {law: quintic, " \
                "time: 10 s}}" % seen
        elif self.look == "dwell":
            self.detail = [(subject(r), 0, 40), (subject(r), 75, 100)]
            look = "{dwell: [%s], ease: %s}" % (
                ", ".join("{at: %s, from: %d %%, to: %d %%}" % d
                          for d in self.detail),
                r.choice(["cubic", "quintic"]))
        else:
            look = "{along: %s}" % self.look
        self.text = "path: %s\ncamera: {axes: {pan: pan, tilt: tilt, roll: " \
            "roll}, look: %s}\n" % (self.path, look)

    def alone(self):
        return "path: %s\n" % self.path

    def seen(self):
        return "path: %s\n" % self.other if self.other else None


# --- space -------------------------------------------------------------------

def sub(a, b):
    return [p - q for p, q in zip(a, b)]


def add(a, b, k):
    return [p + k * q for p, q in zip(a, b)]


def unit(a):
    size = math.hypot(*a)
    return [p / size for p in a] if size > 0 else None


def angle(a, b):
    """Degrees between two unit vectors, also where it is tiny."""
    return 2 * math.degrees(math.asin(min(1, math.dist(a, b) / 2)))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0]]


class Track:
    def __init__(self, track):
        self.segments = [(float(start) / 4096e9, float(dur),
                          [float(c) for c in p]) for start, dur, p, _ in
                         track[0]]
        self.start = [s[0] for s in self.segments]
        self.end = self.segments[-1][0] + self.segments[-1][1]

    def at(self, t):
        start, dur, p = self.segments[
            max(0, bisect.bisect_right(self.start, t) - 1)]
        u = min(1, max(0, (t - start) / dur))
        total = 0
        for c in reversed(p):
            total = total * u + c
        return total


class Path:
    """Densely sampled: times, places, and lengths along the chords."""

    def __init__(self, tracks):
        self.track = [Track(tracks[name]) for name in "xyz"]
        self.end = max(t.end for t in self.track)
        self.t = [self.end * i / SAMPLES for i in range(SAMPLES + 1)]
        self.place = [self.at(t) for t in self.t]
        self.length = [0.0]
        for a, b in zip(self.place, self.place[1:]):
            self.length.append(self.length[-1] + math.dist(a, b))

    def at(self, t):
        return [track.at(t) for track in self.track]

    def on(self, s):
        i = min(max(bisect.bisect_left(self.length, s), 1), SAMPLES)
        low, high = self.length[i - 1], self.length[i]
        k = (s - low) / (high - low) if high > low else 0
        return add(self.place[i - 1], sub(self.place[i], self.place[i - 1]), k)

    def tangent(self, t, h):
        return unit(sub(self.at(min(self.end, t + h)), self.at(max(0, t - h))))

    def last(self):
        for i in range(SAMPLES, 0, -1):
            if self.length[-1] - self.length[i] > 0.05:
                return unit(sub(self.place[-1], self.place[i]))
        return unit(sub(self.place[-1], self.place[0]))


def wanted(camera, path, seen, i):
    """The direction at sample i and how well it is known, degrees; None: where
    there is no saying."""
    here, s, whole = path.place[i], path.length[i], path.length[-1]
    if camera.look == "at":
        return unit(sub(camera.detail, here)), 3e-5
    if camera.look == "dwell":
        for at, low, high in camera.detail:
            if (low == 0 or s > whole * (low + 0.1) / 100) and \
                    (high == 100 or s < whole * (high - 0.1) / 100):
                return unit(sub(at, here)), 3e-5
        return None
    if camera.look == "ahead":
        far, end = camera.detail
        if s + far <= whole:
            there = path.on(s + far)
        elif end == "hold":
            there = path.place[-1]
        else:
            there = add(path.place[-1], path.last(), s + far - whole)
        if math.dist(there, here) < 50:
            return None
        return unit(sub(there, here)), 0.02
    if camera.look == "path":
        return unit(sub(seen.on(seen.length[-1] * s / whole), here)), 0.002
    h = 2e-4
    speed = math.dist(path.at(path.t[i] - h), path.at(path.t[i] + h)) / 2 / h
    if not 0 < i < SAMPLES or speed < 20:
        return None
    a, b = path.tangent(path.t[i] - 2 * h, h), path.tangent(path.t[i] + 2 * h, h)
    return path.tangent(path.t[i], h), 0.01 + angle(a, b)


def looked(pan, tilt):
    pan, tilt = math.radians(pan), math.radians(tilt)
    return [math.cos(tilt) * math.cos(pan), math.cos(tilt) * math.sin(pan),
            math.sin(tilt)]


def judge(camera, tracks, seen):
    """None, or what the camera does that it should not."""
    path = Path(tracks)
    other = Path(seen) if seen else None
    pan, tilt, roll = (Track(tracks[n]) if tracks[n][0] else None
                       for n in ("pan", "tilt", "roll"))
    checked = 0
    for i in range(0, SAMPLES + 1, 3):
        want = wanted(camera, path, other, i)
        if want is None or want[0] is None:
            continue
        t = path.t[i]
        got = looked(pan.at(t), tilt.at(t))
        checked += 1
        if angle(got, want[0]) > want[1]:
            return "%s, %s: at %.4f s it looks %.6g deg beside" % (
                camera.curve, camera.look, t, angle(got, want[0]))
        if roll and camera.look not in ("rotation-minimising", "frenet") and \
                abs(roll.at(t)) > 5e-5:
            return "%s, %s: at %.4f s it rolls by %.6g deg" % (
                camera.curve, camera.look, t, roll.at(t))
    if checked < SAMPLES // 20:
        return "%s, %s: only %d directions are known" % (camera.curve,
                                                         camera.look, checked)
    return None


# --- refusals ------------------------------------------------------------------

def binormal(path, t, h):
    """Of the three places around t; None where they are on a line."""
    a, b, c = path.at(t - h), path.at(t), path.at(t + h)
    bend = cross(sub(b, a), sub(c, b))
    size = math.hypot(*bend)
    flat = math.dist(a, b) * math.dist(b, c)
    return [k / size for k in bend] if size > 1e-7 * flat > 0 else None


def turns_binormal(path):
    """Where the path is straight, or bends to another side at once."""
    before = None
    for t in path.t[4:-4:2]:
        now = binormal(path, t, path.end / SAMPLES)
        if now is None or (before and angle(before, now) > 20):
            return True
        before = now
    return False


def turns_at(path, said):
    """The angle that is named is about that of the binormal there."""
    found = re.search(r"at ([0-9.]+) s the camera would have to \w+ by "
                      r"(\S+) deg at once", said)
    if not found:
        return False
    t, size = float(found[1]), abs(float(found[2]))
    a, b = binormal(path, t - 6e-3, 2e-3), binormal(path, t + 6e-3, 2e-3)
    return a is None or b is None or angle(a, b) > size / 2


def is_refused_rightly(camera, tracks, said):
    """Whether the path is one on which the camera cannot be as it was asked."""
    path = Path(tracks)
    if camera.look == "frenet":
        return turns_binormal(path) or turns_at(path, said)
    found = re.search(r"at ([0-9.]+) s the camera would have to \w+ by "
                      r"\S+ deg at once", said)
    if found and camera.curve == "linear" and \
            camera.look in ("level", "rotation-minimising"):
        t = float(found[1])
        a, b = path.tangent(t - 0.05, 1e-2), path.tangent(t + 0.05, 1e-2)
        return a is None or b is None or angle(a, b) > 0.01
    if "comes to the point that it looks at" in said and camera.look == "at":
        return min(math.dist(p, camera.detail) for p in path.place) < 1
    return False
