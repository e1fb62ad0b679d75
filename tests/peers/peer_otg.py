"""slew otg against Ruckig: rows of the families of otg_position, otg_velocity,
otg_sync3, otg_boundary and otg_round.csv, drawn anew.

OTG_ROWS=N rows per category (1000), OTG_SEED=N (1), OTG_ONLY=velocity or
round.rest for some.  A row counts where Ruckig says the same at two scales
within 1e-9.  Durations within 1e-6 and 2 ns on 999 of 1000 rows of a category,
none 1.001 times as long, none without an answer, and the same with other units
of length and time.  Every 20th profile is integrated in fractions: it starts
and ends to the bit, is continuous and inside its limits.  Reads no clock.
Takes long."""
import math
import os
import subprocess
import sys
from fractions import Fraction
from random import Random

from ruckig import (ControlInterface, InputParameter, Ruckig, RuckigError,
                    Trajectory)

ROWS = int(os.environ.get("OTG_ROWS", "1000"))
SEED = int(os.environ.get("OTG_SEED", "1"))
ONLY = os.environ.get("OTG_ONLY", "")
NAMES = "p0 v0 a0 pf vf af vmax vmin amax amin jmax".split()
OF_VELOCITY = [1, 2, 4, 5, 8, 9, 10]
TIME = [0, -1, -2, 0, -1, -2, -1, -1, -2, -2, -3]  # power of it in each
SCALES = [(1, 1), (1e3, 1), (1e6, 1), (1e-3, 1), (1, 1e3), (1, 1e-3)]
failed = []

# --- rows ---------------------------------------------------------------------


def log(rng, least, most):
    return math.exp(rng.uniform(math.log(least), math.log(most)))


def limits(rng, kind):
    """vmax, vmin, amax, amin, jmax."""
    spread = (1e-2, 1e2) if kind == "ratio" else (0.2, 20)
    vel = log(rng, 0.1, 10)
    acc = vel * log(rng, *spread)
    other = (lambda: log(rng, 0.1, 10)) if kind == "asymmetric" else lambda: 1
    return [vel, -vel * other(), acc, -acc * other(), acc * log(rng, *spread)]


def state(rng, limit, sign=1):
    """A start from which the limits can be kept; sign -1: a goal."""
    vmax, vmin, amax, amin, jmax = limit
    acc = rng.choice([0, amax, amin]) if rng.random() < 0.05 else \
        rng.choice([0, rng.uniform(amin, amax)])
    run = sign * acc * abs(acc) / (2 * jmax)  # what v gains till a is gone
    least, most = vmin - min(run, 0), vmax - max(run, 0)
    if least >= most:
        acc, least, most = 0, vmin, vmax
    return [rng.uniform(least, most), acc]


def outside(rng, limit):
    vmax, vmin, amax, amin, jmax = limit
    vel, acc = rng.uniform(vmin, vmax), rng.uniform(amin, amax)
    kind = rng.randrange(3)
    if kind == 0:
        return [vel, acc * rng.uniform(1, 3) or amax]
    if kind == 1:
        return [rng.choice([vmin, vmax]) * rng.uniform(1, 2), acc]
    return [vmax - rng.random() * amax * amax / (2 * jmax), amax]


def position(rng, kind):
    limit = limits(rng, kind)
    travels = {"tiny": (1e-6, 1e-3), "long": (1e2, 1e4)}
    travel = rng.choice([-1, 1]) * log(rng, *travels.get(kind, (1e-3, 1e2)))
    start, goal = [0, 0], [0, 0]
    if kind in ("moving_start", "full_state", "asymmetric", "ratio"):
        start = state(rng, limit)
    if kind == "full_state" or kind in ("asymmetric", "ratio") and \
            rng.random() < 0.5:
        goal = state(rng, limit, -1)
    if kind == "start_violates":
        start = outside(rng, limit)
    place = rng.choice([0, rng.uniform(-10, 10)])
    return [place, *start, place + travel, *goal, *limit]


def velocity(rng, kind):
    limit = limits(rng, kind)
    start, goal = [0, 0], [rng.uniform(-10, 10), 0]
    if kind in ("stop", "tiny", "start_violates"):
        start, goal = [rng.uniform(-10, 10), 0], [0, 0]
    if kind in ("full_state", "asymmetric", "ratio"):
        start = [rng.uniform(-10, 10), state(rng, limit)[1]]
        goal[1] = state(rng, limit)[1]
    if kind == "stop":
        start[1] = state(rng, limit)[1]
    if kind == "tiny":
        goal[0] = start[0] + rng.choice([-1, 1]) * log(rng, 1e-6, 1e-3)
    if kind == "start_violates":
        start[1] = rng.choice(limit[2:4]) * rng.uniform(1, 3)
    return [*start, *goal, *limit[2:]]


def boundary(rng, kind):
    """From the times of its phases."""
    jerk = rng.choice([rng.randint(1, 60), 2.0 ** rng.randint(-6, 10)])
    ramp = rng.choice([rng.randint(1, 40) / 16, rng.randint(1, 999) / 1000])
    hold = ramp * rng.choice([rng.randint(1, 9), 2.0 ** rng.randint(-4, 4)])
    if kind in ("amax_touch", "vmax_touch", "both_touch"):
        hold = 0
    acc, vel = jerk * ramp, jerk * ramp * (ramp + hold)
    travel = vel * (2 * ramp + hold)
    if kind == "short_cruise":
        travel *= 1 + log(rng, 1e-4, 2e-3)
    more = rng.choice([1.5, 2, 8])
    vel *= more if kind == "amax_touch" else 1
    acc *= more if kind == "vmax_touch" else 1
    return [0, 0, 0, rng.choice([-1, 1]) * travel, 0, 0, vel, -vel, acc, -acc,
            jerk]


def whole(rng, kind):
    unit = rng.choice([1, 0.1, 0.001])
    limit = [rng.randint(1, 9) for _ in range(5)]
    if kind != "asymmetric":
        limit[1], limit[3] = limit[0], limit[2]
    limit = [n * unit * s for n, s in zip(limit, (1, -1, 1, -1, 1))]
    start, goal = [0, 0], [0, 0]

    def fits(vel, acc, sign):
        run = vel + sign * acc * abs(acc) / (2 * limit[4])
        return all(limit[1] <= x <= limit[0] for x in (vel, run)) and \
            limit[3] <= acc <= limit[2]
    if kind != "rest":
        start = [rng.randint(-9, 9) * unit, rng.randint(-9, 9) * unit]
    if kind in ("full_state", "asymmetric"):
        goal = [rng.randint(-9, 9) * unit, rng.randint(-9, 9) * unit]
    if not fits(*start, 1) or not fits(*goal, -1):
        return whole(rng, kind)
    return [0, *start, rng.randint(-20, 20) * unit, *goal, *limit]


def delayed(rng):
    """An axis that cannot take a little longer, another that has to."""
    while True:
        row = position(rng, "full_state")
        row[3] = row[0] + (row[3] - row[0]) * log(rng, 1e-3, 1)
        least = plan(row, False)
        if math.isnan(least) or least <= 0:
            continue
        wish = least * rng.uniform(1.05, 1.5)
        if not plan(row, False, wish) > wish * 1.001:
            continue
        jerk = log(rng, 1, 100)
        vel, acc = jerk * wish * wish, jerk * wish
        other = [0, 0, 0, jerk * wish ** 3 / 32, 0, 0, vel, -vel, acc, -acc,
                 jerk]
        axes = [row, other, other[:3] + [other[3] / 2] + other[4:]]
        rng.shuffle(axes)
        return sum(axes, [])


def several(rng, kind):
    if kind == "delayed":
        return delayed(rng)
    kinds = ["rest", "moving_start", "full_state", "asymmetric"]
    return sum((position(rng, rng.choice(kinds) if kind == "mixed" else kind)
                for _ in range(3)), [])


FAMILIES = {
    "position": (position, "rest moving_start full_state asymmetric "
                           "start_violates tiny long ratio"),
    "velocity": (velocity, "speed_up stop full_state asymmetric "
                           "start_violates ratio tiny"),
    "sync3": (several, "rest moving_start full_state asymmetric mixed "
                       "delayed"),
    "boundary": (boundary, "amax_touch vmax_touch both_touch "
                           "plateau_vmax_touch short_cruise"),
    "round": (whole, "rest moving_start full_state asymmetric"),
}

# --- Ruckig -------------------------------------------------------------------

peers = {n: (Ruckig(n), InputParameter(n), Trajectory(n)) for n in (1, 3)}


def plan(row, is_velocity, least=None):
    """Seconds, or NAN."""
    if is_velocity:
        row = [0, *row[:2], 0, *row[2:4], 1, -1, *row[4:]]
    axes = [row[i:i + 11] for i in range(0, len(row), 11)]
    peer, put, trajectory = peers[len(axes)]
    put.control_interface = ControlInterface.Velocity if is_velocity else \
        ControlInterface.Position
    put.minimum_duration = least
    (put.current_position, put.current_velocity, put.current_acceleration,
     put.target_position, put.target_velocity, put.target_acceleration,
     put.max_velocity, put.min_velocity, put.max_acceleration,
     put.min_acceleration, put.max_jerk) = map(list, zip(*axes))
    try:
        good = int(peer.calculate(put, trajectory)) >= 0
    except RuckigError:
        good = False
    return trajectory.duration if good else math.nan


def scaled(row, is_velocity, length, time):
    power = [TIME[i] for i in OF_VELOCITY] if is_velocity else TIME
    return [x * length * time ** power[i % len(power)]
            for i, x in enumerate(row)]


def reference(row, is_velocity):
    """Where Ruckig keeps its digits, about 1 long and 1 s; None where its two
    answers differ."""
    first = plan(row, is_velocity)
    if not first > 0:
        return None
    size = len(NAMES) if not is_velocity else len(OF_VELOCITY)
    near, time = [], 2.0 ** math.frexp(first)[1]
    for axis in (row[i:i + size] for i in range(0, len(row), size)):
        if is_velocity:
            travel = abs(axis[2] - axis[0]) * first
        else:
            axis = [0, *axis[1:3], axis[3] - axis[0], *axis[4:]]
            travel = max(abs(axis[3]), min(abs(axis[1]), abs(axis[4])) * first)
        near += scaled(axis, is_velocity, 2.0 ** -math.frexp(travel or 1)[1],
                       1 / time)
    both = [plan(near, is_velocity) * time,
            plan(scaled(near, is_velocity, 1.37, 0.77), is_velocity)
            * time / 0.77]
    return both[0] if abs(both[0] - both[1]) <= 1e-9 * both[0] else None

# --- ours ---------------------------------------------------------------------


def slew(family, rows, *words):
    names = NAMES
    if family == "velocity":
        names = [NAMES[i] for i in OF_VELOCITY]
    if family == "sync3":
        names = [f"{name}_{i}" for i in (1, 2, 3) for name in NAMES]
    text = [",".join(names)] + [",".join(f"{x:.17g}" for x in row)
                                for row in rows]
    done = subprocess.run([os.environ["SLEW"], "otg", *words, "-"], text=True,
                          input="\n".join(text) + "\n", capture_output=True)
    return [line.split(",") for line in done.stdout.splitlines()[1:]]


class Score:
    def __init__(self, name):
        self.name = name
        self.lines = {}

    def add(self, time, row, want, got):
        line = self.lines.setdefault(time, [0, 0, 0, 0, 1.0])
        line[0] += 1
        if not got:
            line[3] += 1
            print(f"  {self.name}: no answer for {row}")
            return
        got = float(got) / time[1]
        more = 1e-6 * want + 2e-9 * min(1, 1 / time[1])
        late, early = got > want + more, got < want - more
        line[1] += late or early and "violates" not in self.name
        line[2] += got > 1.001 * want + more
        line[4] = max(line[4], got / want)
        if late and time == (1, 1):
            print(f"  {self.name}: {got!r} for {want!r}: "
                  + ",".join(f"{x:.17g}" for x in row))

    def judge(self):
        rows = self.lines[1, 1][0]
        misses = [line[1] for line in self.lines.values()]
        longest = max(line[4] for line in self.lines.values())
        good = all(line[1] <= rows / 1000 and line[2] == line[3] == 0
                   for line in self.lines.values())
        print(f"  {self.name:28} rows {rows:6}  outside 1e-6 "
              f"{'/'.join(map(str, misses)):14} longest {longest:.9f}"
              f"{'' if good else '  FAILED'}", flush=True)
        if not good:
            failed.append(self.name)

# --- profiles -----------------------------------------------------------------


def inside(value, least, most):
    room = abs(most) * 1e-12
    return least - room <= value <= most + room


def broken(row, is_velocity, points, keeps):
    """What is wrong with a profile, or None; points are t, p, v, a, j."""
    if is_velocity:
        row = [0, *row[:2], None, *row[2:4], math.inf, -math.inf, *row[4:]]
    p0, v0, a0, pf, vf, af, vmax, vmin, amax, amin, jmax = row
    _, *first, _ = points[0]
    _, *last, _ = points[-1]
    if first != [p0, v0, a0] or last[1:] != [vf, af] or \
            pf is not None and last[0] != pf:
        return "an end is not the row's"
    far = max(abs(p[1]) + abs(p[2]) * points[-1][0] for p in points)
    fast = max(max(abs(p[2]) for p in points), amax ** 2 / jmax)
    for here, there in zip(points, points[1:]):
        t, p, v, a, j = (Fraction(there[0]) - Fraction(here[0]),
                         *map(Fraction, here[1:]))
        ends = (p + v * t + a * t * t / 2 + j * t ** 3 / 6,
                v + a * t + j * t * t / 2, a + j * t)
        gaps = [abs(float(x) - y) for x, y in zip(ends, there[1:4])]
        if gaps[0] > 1e-9 * far or gaps[1] > 1e-9 * fast or \
                gaps[2] > 1e-8 * max(amax, -amin):
            return f"a gap of {gaps} at {there[0]}"
        if abs(here[4]) > jmax:
            return f"jerk {here[4]} at {here[0]}"
        speeds = [here[2], there[2]]
        if j != 0 and 0 < -a / j < t:
            speeds.append(float(v - a * a / (2 * j)))
        if keeps and not (all(inside(x, vmin, vmax) for x in speeds) and
                          all(amin <= x[3] <= amax for x in (here, there))):
            return f"outside a limit at {here[0]}"
    return None


def profiles(name, family, rows):
    lines = slew(family, rows, "--segments")
    points = {}
    for row, axis, *point in lines:
        points.setdefault((int(row), int(axis)), []).append(
            [float(x) for x in point])
    for (number, axis), each in points.items():
        row = rows[number][11 * axis:11 * axis + 11]
        what = broken(row, family == "velocity", each, "violates" not in name)
        if what:
            print(f"  {name}: {what}: {row}  FAILED")
            failed.append(name)

# --- all ----------------------------------------------------------------------


def category(family, kind, draw):
    is_velocity = family == "velocity"
    rng = Random(f"{SEED} {family} {kind}")
    rows = [draw(rng, kind) for _ in range(ROWS)]
    wants = [reference(row, is_velocity) for row in rows]
    kept = [(row, want) for row, want in zip(rows, wants) if want]
    score = Score(f"{family}.{kind}")
    for scale in SCALES:
        there = [scaled(row, is_velocity, *scale) for row, _ in kept]
        for (row, want), answer in zip(kept, slew(family, there)):
            score.add(scale, row, want, answer[-1])
    score.judge()
    profiles(score.name, family, rows[::20])


for family, (draw, kinds) in FAMILIES.items():
    for kind in kinds.split():
        if f"{family}.{kind}".startswith(ONLY):
            category(family, kind, draw)
print(f"  {'all as they should be' if not failed else failed}")
sys.exit(bool(failed))
