#!/usr/bin/env python3
"""tests/peers/curves_scipy.py - curves beside SciPy's, random cases by the hundred.

    curves_scipy.py build/tests/vectors DIRECTORY [CASES] [SEED]

Writes files of reference values in the layout that the vectors program reads,
computed by SciPy (splines, rotations), by exact fractions (one polynomial
through all keys) and by adaptive quadrature split where a curve is slow (arc
length), and runs the program on each.  Status 1 when one is outside its
tolerance; a case that fails is written alone to DIRECTORY/failed-*.json."""
import json
import math
import subprocess
import sys
import warnings
from fractions import Fraction

import numpy as np
from scipy import integrate, interpolate, optimize
from scipy.spatial.transform import Rotation, RotationSpline, Slerp

TICK = 4096e9  # of a second: slew's clock
LOOKS = 8  # per span

# --- keys ---------------------------------------------------------------------


def spans(rng, n, kind):
    """n - 1 lengths of time."""
    if kind == "even":
        return np.full(n - 1, rng.choice([0.04, 0.5, 1, 7]))
    if kind == "jitter":
        return rng.uniform(0.3, 1.7, n - 1)
    if kind == "wild":
        return 10 ** rng.uniform(-1.5, 1, n - 1)
    return np.where(rng.random(n - 1) < 0.3, 0.02, 1) * rng.uniform(0.9, 1.1, n - 1)


def values(rng, n, kind):
    if kind == "random":
        return rng.uniform(-1, 1, n)
    if kind == "rising":
        return np.cumsum(rng.uniform(0, 1, n))
    if kind == "walk":
        return np.cumsum(rng.normal(0, 1, n))
    if kind == "steps":
        return rng.integers(-3, 4, n).astype(float)
    if kind == "plateaus":
        return np.repeat(rng.uniform(-1, 1, n), rng.integers(1, 4, n))[:n]
    if kind == "zigzag":
        return np.where(np.arange(n) % 2, 1.0, -1.0) * rng.uniform(0.5, 1, n)
    return 5 + np.full(n, 0.1) * np.arange(n)


SPANS = ["even", "jitter", "wild", "bunches"]
VALUES = ["random", "rising", "walk", "steps", "plateaus", "zigzag", "line"]


def keys(rng, least, most):
    """Times that slew's clock has, values that a double has."""
    n = int(rng.integers(least, most + 1))
    t = np.concatenate([[rng.choice([0.0, 1.0, 123.0])],
                        spans(rng, n, rng.choice(SPANS))]).cumsum()
    t = np.round(t * 1e6) / 1e6
    p = values(rng, n, rng.choice(VALUES)) * 10.0 ** rng.integers(-6, 7)
    return t, p + rng.choice([0, 0, 3]) * np.abs(p).max()


def looks(rng, t):
    """Inside every span, and the keys."""
    u = np.concatenate([[0], np.sort(rng.uniform(0.001, 0.999, LOOKS))])
    x = np.concatenate([a + u * (b - a) for a, b in zip(t, t[1:])] + [t[-1:]])
    on_tick = np.round(x * TICK) / TICK
    return np.where(np.isin(x, t), x, on_tick)


def sampled(f, x):
    return {"y": f(x).tolist(), "dy": f.derivative(1)(x).tolist(),
            "ddy": f.derivative(2)(x).tolist()}


def fits(one):
    """Polynomials that swing leave the formats: 2^31 of what the keys, scaled
    to 2^20, reach, and 2^47 per second squared.  A quarter of that is asked."""
    most = np.abs(one["params"].get("f_p", one["p"])).max()
    return (np.abs(one["y"]).max() < 2 ** 9 * most
            and np.abs(one["dy"]).max() < 2 ** 9 * most
            and np.abs(one["ddy"]).max() < 2 ** 23 * most)


def case(method, t, p, x, f, bc=None, params=None):
    one = described(method, t, p, x, f, bc, params)
    return one if fits(one) else None


def described(method, t, p, x, f, bc, params):
    return {"method": method, "bc": bc, "params": params or {},
            "t": t.tolist(), "p": p.tolist(), "x": x.tolist(), **sampled(f, x)}


# --- curves in time -------------------------------------------------------------


def linear(rng):
    t, p = keys(rng, 2, 50)
    slope = np.diff(p) / np.diff(t)
    f = interpolate.PPoly(np.array([slope, p[:-1]]), t)
    return case("linear", t, p, looks(rng, t), f)


def hermite(rng):
    t, p = keys(rng, 2, 50)
    v = rng.normal(0, 2, len(t)) * np.ptp(p) / np.ptp(t)
    f = interpolate.CubicHermiteSpline(t, p, v)
    return case("hermite", t, p, looks(rng, t), f, params={"tangent": v.tolist()})


def parabola(t, p):
    """Slopes of the parabolas through three keys."""
    h, c = np.diff(t), np.diff(p) / np.diff(t)
    if len(t) == 2:
        return np.array([c[0], c[0]])
    v = np.empty(len(t))
    v[1:-1] = (h[1:] * c[:-1] + h[:-1] * c[1:]) / (h[:-1] + h[1:])
    v[0] = 2 * c[0] - v[1]
    v[-1] = 2 * c[-1] - v[-2]
    return v


def catmull_rom(rng):
    t, p = keys(rng, 2, 50)
    f = interpolate.CubicHermiteSpline(t, p, parabola(t, p))
    return case("catmull_rom_nonuniform", t, p, looks(rng, t), f)


def cardinal(rng):
    t, p = keys(rng, 2, 50)
    mu = float(rng.choice([0, 0.25, 0.5, 1, 1.5, 2]))
    v = np.empty(len(t))
    v[1:-1] = mu * (p[2:] - p[:-2]) / (t[2:] - t[:-2])
    v[0] = mu * (p[1] - p[0]) / (t[1] - t[0])
    v[-1] = mu * (p[-1] - p[-2]) / (t[-1] - t[-2])
    f = interpolate.CubicHermiteSpline(t, p, v)
    return case("cardinal", t, p, looks(rng, t), f, params={"mu": mu})


def c2(rng):
    t, p = keys(rng, 3, 60)
    rule = rng.choice(["natural", "clamped", "not-a-knot", "periodic", "given"])
    bc = ours = str(rule)
    if rule == "periodic":
        p[-1] = p[0]
    if rule == "given":
        given = rng.normal(0, 1, 2) * np.ptp(p) / np.ptp(t)
        order = rng.integers(1, 3, 2)
        bc = [(int(o), float(g)) for o, g in zip(order, given)]
        name = {1: "velocity", 2: "acceleration"}
        ours = {"start": [name[bc[0][0]], bc[0][1]],
                "end": [name[bc[1][0]], bc[1][1]]}
    f = interpolate.CubicSpline(t, p, bc_type=bc)
    return case("cubic_c2", t, p, looks(rng, t), f, bc=ours)


def pchip(rng):
    t, p = keys(rng, 2, 60)
    return case("pchip", t, p, looks(rng, t), interpolate.PchipInterpolator(t, p))


def akima(rng):
    """SciPy takes weights below 1e-9 of the largest for zero; slew only those
    that are.  Such keys are another curve, so weights are kept apart."""
    while True:
        t, p = keys(rng, 3, 60)
        c = np.diff(p) / np.diff(t)
        m = np.concatenate([[0, 0], c, [0, 0]])
        m[1], m[-2] = 2 * m[2] - m[3], 2 * m[-3] - m[-4]
        m[0], m[-1] = 2 * m[1] - m[2], 2 * m[-2] - m[-3]
        w = np.abs(np.diff(m))
        both = w[2:] + w[:-2]
        if w.max() > 0 and both.min() > 1e-6 * both.max():
            break
    return case("akima", t, p, looks(rng, t), interpolate.Akima1DInterpolator(t, p))


def c4(rng):
    t, p = keys(rng, 6, 40)
    rest = bool(rng.integers(0, 2))
    bc = ([(1, 0.0), (2, 0.0)],) * 2 if rest else None
    f = interpolate.make_interp_spline(t, p, k=5, bc_type=bc)
    return case("spline_k5", t, p, looks(rng, t), f,
                bc="rest" if rest else "not-a-knot")


def constraints(rng):
    t, p = keys(rng, 2, 30)
    n = len(t)
    order = rng.integers(1, 4, n)
    size = np.ptp(p) if np.ptp(p) > 0 else np.abs(p).max()
    v = rng.normal(0, 1, n) * size / np.ptp(t)
    a = rng.normal(0, 1, n) * size / np.ptp(t) ** 2
    given = [[p[i], v[i], a[i]][:order[i]] for i in range(n)]
    f = interpolate.PPoly.from_bernstein_basis(
        interpolate.BPoly.from_derivatives(t, given))
    params = {"key_order": order.tolist(),
              "v": [v[i] if order[i] > 1 else None for i in range(n)],
              "a": [a[i] if order[i] > 2 else None for i in range(n)]}
    return case("key_constraints", t, p, looks(rng, t), f, params=params)


class Through:
    """One polynomial through all keys, in fractions."""

    def __init__(self, t, p, order=0):
        self.t, self.order = [Fraction(float(a)) for a in t], order
        self.c = [Fraction(float(a)) for a in p]
        for k in range(1, len(t)):
            for i in range(len(t) - 1, k - 1, -1):
                self.c[i] = ((self.c[i] - self.c[i - 1])
                             / (self.t[i] - self.t[i - k]))

    def derivative(self, order):
        other = object.__new__(Through)
        other.t, other.c, other.order = self.t, self.c, order
        return other

    def at(self, x):
        d = [Fraction(0)] * 3
        for t, c in zip(reversed(self.t), reversed(self.c)):
            h = Fraction(float(x)) - t
            d = [d[0] * h + c, d[1] * h + d[0], d[2] * h + 2 * d[1]]
        return float(d[self.order])

    def __call__(self, x):
        return np.array([self.at(a) for a in x])


def lagrange(rng):
    t, p = keys(rng, 2, 12)
    f, x = Through(t, p), looks(rng, t)
    if np.abs(f(x)).max() < 2 * np.abs(p).max():  # SciPy's own is good there
        peer = interpolate.BarycentricInterpolator(t, p)(x)
        assert np.abs(peer - f(x)).max() < 1e-6 * np.abs(peer).max()
    return case("lagrange", t, p, x, f)


class Warped:
    """f(w(x)), by the chain rule."""

    def __init__(self, f, w, order=0):
        self.f, self.w, self.order = f, w, order

    def derivative(self, order):
        return Warped(self.f, self.w, order)

    def __call__(self, x):
        w, v, a = self.w(x), self.w(x, 1), self.w(x, 2)
        if self.order == 0:
            return self.f(w)
        if self.order == 1:
            return self.f(w, 1) * v
        return self.f(w, 2) * v * v + self.f(w, 1) * a


def time_warp(rng):
    f_t, f_p = keys(rng, 3, 8)
    n = int(rng.integers(2, 8))
    t = np.round(np.cumsum(rng.uniform(0.3, 2, n)), 6)
    share = np.sort(rng.random(n)) if rng.integers(0, 2) else rng.random(n)
    p = np.round((f_t[0] + share * np.ptp(f_t)) * 1e6) / 1e6
    p = np.clip(p, f_t[0], f_t[-1])
    f = interpolate.CubicSpline(f_t, f_p, bc_type="natural")
    warped = Warped(f, interpolate.PchipInterpolator(t, p))
    params = {"f_t": f_t.tolist(), "f_p": f_p.tolist(),
              "f": "cubic_c2 natural", "w": "pchip through t, p"}
    # where a border of f is passed a third derivative steps: not near one
    x = looks(rng, t)
    return case("time_warp", t, p, x, warped, params=params)


# --- curves in space --------------------------------------------------------------


def points(rng, least, most):
    n = int(rng.integers(least, most + 1))
    p = np.stack([values(rng, n, rng.choice(["random", "walk"]))
                  for _ in range(3)], axis=1)
    return p * 10.0 ** rng.integers(-6, 7)


def bezier(rng):
    ctrl = points(rng, 4, 4)
    f = interpolate.BPoly(ctrl[:, None, :], [0, 1])
    x = np.round(np.sort(rng.random(12)) * 1e6) / 1e6
    return {"method": "bezier_3d", "bc": None, "params": {},
            "ctrl": ctrl.tolist(), "x": x.tolist(), **sampled(f, x)}


def bspline(rng):
    ctrl = points(rng, 5, 30)
    knots = np.arange(len(ctrl) + 4.0)
    f = interpolate.BSpline(knots, ctrl, 3)
    x = np.round(np.sort(rng.uniform(3, len(ctrl), 40)) * 1e6) / 1e6
    return {"method": "bspline_uniform_3d", "bc": None,
            "params": {"knots": knots.tolist()}, "ctrl": ctrl.tolist(),
            "x": x.tolist(), **sampled(f, x)}


def catmull_rom_3d(rng):
    p, alpha = points(rng, 4, 20), float(rng.choice([0, 0.5, 1]))
    span = np.linalg.norm(np.diff(p, axis=0), axis=1) ** alpha
    t = np.concatenate([[0], span.cumsum()])
    v = np.stack([parabola(t, p[:, i]) for i in range(3)], axis=1)
    f = interpolate.CubicHermiteSpline(t, p, v)
    rows, u = [], np.linspace(0, 1, 9)
    for i in range(1, len(p) - 2):
        x = t[i] + u * span[i]
        row = {"from_key": i, "knot_span": span[i], "u": u.tolist()}
        piece = interpolate.PPoly(f.c[:, i:i + 1], f.x[i:i + 2])
        rows.append({**row, **sampled(piece, x)})
    return {"method": "catmull_rom_3d", "bc": None, "params": {"alpha": alpha},
            "p": p.tolist(), "segments": rows}


SPLINES = [linear, hermite, catmull_rom, cardinal, c2, pchip, akima, c4,
           constraints, lagrange, time_warp, bezier, bspline, catmull_rom_3d]

# --- rotations --------------------------------------------------------------------


def wxyz(rotation):
    return np.roll(rotation.as_quat(), 1, axis=-1).tolist()


def slerp(rng):
    start = Rotation.random(random_state=int(rng.integers(1 << 31)))
    axis = rng.normal(0, 1, 3)
    angle = rng.choice([1e-9, 1e-3, 1, 3.1]) * rng.uniform(0.5, 1)
    end = start * Rotation.from_rotvec(axis / np.linalg.norm(axis) * angle)
    ends = Rotation.concatenate([start, end])
    x = np.linspace(0, 1, 17)
    sign = rng.choice([-1, 1])
    return {"kind": "slerp", "q0": wxyz(start),
            "q1": (sign * np.array(wxyz(end))).tolist(), "x": x.tolist(),
            "q": wxyz(Slerp([0, 1], ends)(x))}


def rotation_spline(rng):
    n = int(rng.integers(3, 12))
    t = np.round(np.cumsum(rng.uniform(0.4, 1.6, n)), 6)
    turns = [Rotation.random(random_state=int(rng.integers(1 << 31)))]
    for _ in range(n - 1):
        turns.append(turns[-1] * Rotation.from_rotvec(rng.normal(0, 0.5, 3)))
    f = RotationSpline(t, Rotation.concatenate(turns))
    x = np.round(np.sort(rng.uniform(t[0], t[-1], 40)), 6)
    return {"kind": "rotation_spline_c2", "t": t.tolist(),
            "keys": wxyz(Rotation.concatenate(turns)), "x": x.tolist(),
            "q": wxyz(f(x)), "omega_body": f(x, 1).tolist(),
            "alpha_body": f(x, 2).tolist()}


ROTATIONS = [slerp, rotation_spline]

# --- arc length -------------------------------------------------------------------


def turning(low, high, speed):
    """Where the speed is least, to 1e-12: quadrature is split there."""
    u = np.linspace(low, high, 400)
    s = speed(u)
    found = []
    for i in range(1, len(u) - 1):
        if s[i] <= s[i - 1] and s[i] <= s[i + 1] and s[i] < 0.3 * s.max():
            found.append(optimize.minimize_scalar(
                lambda a: float(speed(a)), bounds=(u[i - 1], u[i + 1]),
                method="bounded", options={"xatol": 1e-13}).x)
    return found


class Length:
    """Cumulative length over panels between borders and slow places."""

    def __init__(self, borders, speed):
        cuts = list(borders)
        for a, b in zip(borders, borders[1:]):
            cuts += turning(a, b, speed)
            cuts += [a + (b - a) * k / 8 for k in range(1, 8)]
        self.cuts, self.speed = np.unique(cuts), speed
        parts, self.error = [], 0
        for a, b in zip(self.cuts, self.cuts[1:]):
            part, off = self.quad(a, b)
            parts.append(part)
            self.error += off
        self.at = np.concatenate([[0], np.cumsum(parts)])
        self.total = math.fsum(parts)

    def quad(self, a, b):
        """Its own opinion of the error is judged, so no warnings."""
        return integrate.quad(lambda u: float(self.speed(u)), a, b,
                              epsabs=0, epsrel=2e-14, limit=400)

    def __call__(self, u):
        i = min(np.searchsorted(self.cuts, u, "right") - 1, len(self.at) - 2)
        return self.at[i] + self.quad(self.cuts[i], u)[0]

    def inverse(self, s):
        i = min(np.searchsorted(self.at, s, "right") - 1, len(self.at) - 2)
        if s <= self.at[i]:
            return self.cuts[i]
        low, high = self.cuts[i], self.cuts[i + 1]
        for _ in range(80):
            middle = (low + high) / 2
            if self.at[i] + self.quad(self.cuts[i], middle)[0] < s:
                low = middle
            else:
                high = middle
        return (low + high) / 2


def measured(head, borders, at, speed):
    length = Length(borders, speed)
    if length.error > 1e-12 * length.total:
        return None
    u = np.linspace(borders[0], borders[-1], 33)
    share = np.linspace(0, 1, 21)
    where = [length.inverse(f * length.total) for f in share]
    where[0], where[-1] = borders[0], borders[-1]
    return {**head, "u0": borders[0], "u1": borders[-1],
            "length": length.total, "u": u.tolist(),
            "s": [length(a) for a in u[:-1]] + [length.total],
            "speed": [float(speed(a)) for a in u],
            "inv_fraction": share.tolist(), "inv_u": where,
            "inv_p": [at(a).tolist() for a in where]}


def polynomial(borders, coef):
    """coef[piece][axis][power]"""
    f = interpolate.PPoly(np.array(coef).transpose(2, 0, 1)[::-1], borders)
    d = f.derivative()

    def speed(u):
        return np.sqrt((d(u) ** 2).sum(-1))
    head = {"kind": "ppoly", "breaks": list(borders),
            "coef": np.array(coef).tolist()}
    return measured(head, list(borders), f, speed)


def from_bezier(ctrl):
    a, b, c, d = ctrl
    return np.stack([a, 3 * (b - a), 3 * (a - 2 * b + c),
                     d - 3 * c + 3 * b - a], axis=-1)


def scale(rng):
    return 10.0 ** rng.integers(-6, 7)


def loop(rng):
    return polynomial([0.0, 1.0],
                      [from_bezier(rng.normal(0, 1, (4, 3)) * scale(rng))])


def cusp(rng):
    """P' = (u - c) w(u): the speed is zero inside, the direction turns back."""
    c, w = rng.uniform(0.2, 0.8), rng.normal(0, 1, (3, 2))
    coef = [[0, -c * w0, (w0 - c * w1) / 2, w1 / 3] for w0, w1 in w]
    k = scale(rng)
    return polynomial([0.0, 1.0], [(np.array(coef) * k)])


def near_cusp(rng):
    ctrl = np.array([[0, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, 0]], float)
    ctrl = ctrl + rng.normal(0, 1, (4, 3)) * 10.0 ** rng.uniform(-4, -1)
    return polynomial([0.0, 1.0], [from_bezier(ctrl * scale(rng))])


def near_straight(rng):
    along = np.cumsum(rng.uniform(0.2, 1, 4))[:, None] * rng.normal(0, 1, 3)
    off = rng.normal(0, 1, (4, 3)) * 10.0 ** rng.uniform(-9, -2)
    return polynomial([0.0, 1.0], [from_bezier((along + off) * scale(rng))])


def rest_at_ends(rng):
    a, d = rng.normal(0, 1, (2, 3))
    b, c = rng.normal(0, 1, (2, 3))
    ctrl = np.array([a, a, c if rng.integers(0, 2) else d, d])
    if rng.integers(0, 2):
        ctrl[1] = b
        ctrl[2] = d
    return polynomial([0.0, 1.0], [from_bezier(ctrl * scale(rng))])


def through_keys(rng):
    n = int(rng.integers(3, 12))
    t = np.concatenate([[0.0], np.cumsum(rng.uniform(0.3, 1.7, n - 1))])
    p = rng.normal(0, 1, (n, 3)) * scale(rng)
    if rng.integers(0, 2):
        f = interpolate.CubicSpline(t, p)
    else:
        v = np.stack([parabola(t, p[:, i]) for i in range(3)], axis=1)
        f = interpolate.CubicHermiteSpline(t, p, v)
    return polynomial(t.tolist(), f.c[::-1].transpose(1, 2, 0))


def quintic(rng):
    return polynomial([-1.0, 0.5, 2.0],
                      rng.normal(0, 1, (2, 3, 6)) * scale(rng))


def lemniscate_like(rng):
    """Two loops of Beziers that cross in a point, slow there."""
    r, s = rng.uniform(0.5, 2, 2)
    k = scale(rng)
    right = np.array([[0, 0, 0], [r, s, 0], [r, -s, 0], [0, 0, 0]], float)
    left = np.array([[0, 0, 0], [-r, s, 0], [-r, -s, 0], [0, 0, 0]], float)
    return polynomial([0.0, 1.0, 2.0],
                      [from_bezier(right * k), from_bezier(left * k)])


def formula(kind, rng, constants, at, slope, turns):
    u0 = float(rng.uniform(-1, 1))
    u1 = u0 + float(rng.uniform(0.3, 1)) * turns

    def speed(u):
        return np.sqrt(sum(np.asarray(part(u)) ** 2 for part in slope))

    def point(u):
        return np.array([part(u) for part in at])
    return measured({"kind": kind, **constants}, [u0, u1], point, speed)


def ellipse(rng):
    a, b = (10.0 ** rng.uniform(-3, 3, 2)).tolist()
    return formula("ellipse", rng, {"a": a, "b": b},
                   [lambda u: a * np.cos(u), lambda u: b * np.sin(u),
                    lambda u: 0 * u],
                   [lambda u: -a * np.sin(u), lambda u: b * np.cos(u)], 6.28)


def helix(rng):
    a, b = (10.0 ** rng.uniform(-3, 3, 2)).tolist()
    return formula("helix", rng, {"a": a, "b": b},
                   [lambda u: a * np.cos(u), lambda u: a * np.sin(u),
                    lambda u: b * u],
                   [lambda u: -a * np.sin(u), lambda u: a * np.cos(u),
                    lambda u: b + 0 * u], 30)


def lissajous(rng):
    a, b, c = (float(k) for k in rng.integers(1, 6, 3))
    return formula("lissajous", rng, {"a": a, "b": b, "c": c},
                   [lambda u: np.sin(a * u), lambda u: np.sin(b * u),
                    lambda u: np.cos(c * u)],
                   [lambda u: a * np.cos(a * u), lambda u: b * np.cos(b * u),
                    lambda u: -c * np.sin(c * u)], 6.28)


def torus_knot(rng):
    p, q = (float(k) for k in rng.integers(1, 7, 2))
    return formula(
        "torus_knot", rng, {"p": p, "q": q},
        [lambda u: (2 + np.cos(q * u)) * np.cos(p * u),
         lambda u: (2 + np.cos(q * u)) * np.sin(p * u),
         lambda u: np.sin(q * u)],
        [lambda u: (-q * np.sin(q * u) * np.cos(p * u)
                    - p * (2 + np.cos(q * u)) * np.sin(p * u)),
         lambda u: (-q * np.sin(q * u) * np.sin(p * u)
                    + p * (2 + np.cos(q * u)) * np.cos(p * u)),
         lambda u: q * np.cos(q * u)], 6.28)


LENGTHS = [loop, cusp, near_cusp, near_straight, rest_at_ends, through_keys,
           quintic, lemniscate_like, ellipse, helix, lissajous, torus_knot]

# --- running ----------------------------------------------------------------------


def judge(program, path):
    done = subprocess.run([program, path], capture_output=True, text=True,
                          timeout=600)
    return done.returncode == 0, done.stdout + done.stderr


def alone(program, directory, cases):
    """The first cases that fail by themselves."""
    shown = 0
    for one in cases:
        path = f"{directory}/failed-{one['name']}.json"
        with open(path, "w", encoding="ascii") as out:
            json.dump({"cases": [one]}, out)
        good, said = judge(program, path)
        if not good and shown < 5:
            print(f"  {path}\n    {said.strip()}")
            shown += 1


def family(program, directory, make, cases, seed):
    made, skipped = [], 0
    for i in range(cases):
        rng = np.random.default_rng([seed, i, sum(make.__name__.encode())])
        one = make(rng)
        if one is None:
            skipped += 1
        else:
            made.append({"name": f"{make.__name__}-{i}", **one})
    path = f"{directory}/{make.__name__}.json"
    with open(path, "w", encoding="ascii") as out:
        json.dump({"cases": made}, out)
    good, said = judge(program, path)
    print(f"{make.__name__:16} {len(made):4} cases"
          + (f", {skipped} without a reference" if skipped else ""))
    print("  " + said.strip().replace("\n", "\n  "), flush=True)
    if not good:
        alone(program, directory, made)
    return good and len(made) > 0


def main():
    warnings.simplefilter("ignore", integrate.IntegrationWarning)
    program, directory = sys.argv[1:3]
    cases = int(sys.argv[3]) if len(sys.argv) > 3 else 100
    seed = int(sys.argv[4]) if len(sys.argv) > 4 else 1
    good = True
    for make in SPLINES + ROTATIONS + LENGTHS:
        good &= family(program, directory, make, cases, seed)
    print("all inside" if good else "NOT ALL INSIDE")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
