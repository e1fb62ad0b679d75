"""Spheres against boxes, and cloths whose nodes are spheres, by formulae of their
own; as a file of reference values on the standard output.

    /usr/bin/python3 tests/peers/physics_vectors.py >vectors.json
    build/tests/vectors vectors.json

A bounce is set up backwards: the place on a box, the normal and the speed at the
impact are chosen, and the parabola is followed back.  What moves about an edge is
the pendulum equation; a cloth is integrated by Runge and Kutta's fourth order at a
twentieth of a millisecond.
"""

import json
import math
import random

G = 9.80665
rng = random.Random(16)


def add(a, b, times=1.0):
    return [x + times * y for x, y in zip(a, b)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0]]


def unit(a):
    return [x / math.sqrt(dot(a, a)) for x in a]


def rotation():
    """Rows of a random rotation, from a quaternion."""
    w, x, y, z = unit([rng.gauss(0, 1) for _ in range(4)])
    return [[1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
            [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
            [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]]


def outside(box, p):
    """How far a point is from a box: the least over a search of its points would
    be slow, so by the largest of its projections outside each pair of faces."""
    rel = add(p, box["center"], -1)
    over = [max(abs(dot(rel, a)) - s / 2, 0.0)
            for a, s in zip(box["axes"], box["size"])]
    return math.sqrt(dot(over, over))


def never_rises(start, tol, duration):
    return [{"q": "energy", "rule": "not_rising", "start": start, "tol": tol,
             "duration": duration}]


def of_sphere(m, r, pos, vel, spin):
    """Its energy."""
    return m * (dot(vel, vel) / 2 + 0.2 * r * r * dot(spin, spin) +
                G * pos[2])


def entry(q, unit_, want, tol, t=None, **more):
    made = {"q": q, "unit": unit_, "want": want, "tol_abs": tol, **more}
    if t is not None:
        made["t"] = t
    return made


def bounce(name, feature, friction):
    """One impact; None: the path touches the box elsewhere, too."""
    e, m = rng.uniform(0.1, 1), rng.uniform(0.1, 1)
    r = rng.uniform(0.01, 0.08)
    box = {"center": [rng.uniform(-0.1, 0.1) for _ in range(3)],
           "size": [rng.uniform(0.1, 0.5) for _ in range(3)], "axes": rotation()}
    order = rng.sample(range(3), 3)
    out, at = [0.0] * 3, list(box["center"])
    for i, k in enumerate(order):
        sign = rng.choice((-1, 1))
        beyond = i <= feature
        out = add(out, box["axes"][k],
                  sign * rng.uniform(0.2, 1) if beyond else 0.0)
        at = add(at, box["axes"][k],
                 box["size"][k] / 2 *
                 (sign if beyond else rng.uniform(-0.8, 0.8)))
    n = unit(out)
    centre = add(at, n, r)
    speed = rng.choice((3.0, 60.0))
    vel = [speed * x for x in unit(add([rng.uniform(-1, 1) for _ in range(3)],
                                       n, -1.5))]
    spin = [rng.uniform(-40, 40) if friction else 0.0 for _ in range(3)]
    gravity = [0.0, 0.0, -G]
    t = rng.randrange(40, 90) * 1e-3 + 0.37e-3
    start_vel = add(vel, gravity, -t)
    start = add(add(centre, start_vel, -t), gravity, -t * t / 2)
    # the impact, by impulses
    arm = [-r * x for x in n]
    touch = add(vel, cross(spin, arm))
    slip = add(touch, n, -dot(touch, n))
    jn = -(1 + e) * m * dot(vel, n)
    size = math.sqrt(dot(slip, slip))
    jt = min(friction * jn, size / (1 / m + r * r / (0.4 * m * r * r)))
    impulse = add([jn * x for x in n], slip, -jt / size if size > 0 else 0.0)
    after = add(vel, impulse, 1 / m)
    spun = add(spin, cross(arm, impulse), 1 / (0.4 * m * r * r))
    times = [0.02, math.floor(t * 1e3 - 1) * 1e-3,
             math.ceil(t * 1e3 + 1) * 1e-3, 0.12]
    pos, vels = [], []
    for s in range(1, 1201):
        s *= 1e-4
        at_s = (add(add(start, start_vel, s), gravity, s * s / 2) if s < t else
                add(add(centre, after, s - t), gravity, (s - t) ** 2 / 2))
        if outside(box, at_s) < r + (1e-5 if abs(s - t) > 2e-4 else -1):
            return None
    for s in times:
        if s < t:
            pos.append([add(add(start, start_vel, s), gravity, s * s / 2)])
            vels.append([add(start_vel, gravity, s)])
        else:
            pos.append([add(add(centre, after, s - t), gravity,
                            (s - t) ** 2 / 2)])
            vels.append([add(after, gravity, s - t)])
    state = {"pos": centre, "vel": vel, "spin": spin}
    return {
        "name": name, "family": "sphere_box", "note": "one impact",
        "system": {"restitution": e, "friction": friction, "gravity": gravity,
                   "planes": [], "boxes": [box],
                   "spheres": [{"mass": m, "radius": r}]},
        "initial": {"spheres": [{"pos": start, "vel": start_vel,
                                 "spin": spin}]},
        "input": None,
        "expect": [
            entry("contact_time", "s", [t], 1e-7),
            entry("pos", "m", pos, 1e-6 * speed, times),
            entry("vel", "m/s", vels, 1e-6 * speed, times),
            entry("spin", "rad/s", [[spun]], 1e-5 * max(1, speed), [0.12]),
            entry("impulse_vel", "m/s", [after], 1e-8 * speed,
                  **{"from": {"spheres": [{"mass": m, "radius": r, **state}]}}),
        ],
        "invariant": never_rises(of_sphere(m, r, start, start_vel, spin),
                                 1e-9 * m * speed * speed, 0.12),
        "check": {"by": "closed form", "worst": 0},
    }


def over_an_edge(name, rolls):
    """From the top of a box about its edge: angle'' = g sin / (r k), k of the
    spin, until g cos < r angle'^2; then it flies."""
    r, m = rng.uniform(0.02, 0.08), rng.uniform(0.1, 1)
    k = 1.4 if rolls else 1.0
    v0 = rng.uniform(0.2, 0.6) * math.sqrt(G * r)
    t_edge = 0.0405
    a, w, t, dt = 0.0, v0 / r, 0.0, 1e-6
    track = []

    def slope(a):
        return G * math.sin(a) / (r * k)
    while G * math.cos(a) > r * w * w:
        k1, k2 = slope(a), slope(a + dt / 2 * w)
        k3 = slope(a + dt / 2 * w + dt * dt / 4 * k1)
        k4 = slope(a + dt * w + dt * dt / 2 * k2)
        track.append((t, a, w))
        a, w = (a + dt * w + dt * dt / 6 * (k1 + k2 + k3),
                w + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
        t += dt
    times = [0.02, round(t_edge + t / 2, 3), round(t_edge + 0.8 * t, 3),
             round(t_edge + t + 0.05, 3)]
    pos, vel = [], []
    for s in times:
        if s <= t_edge:
            pos.append([[v0 * (s - t_edge), 0.0, r]])
            vel.append([[v0, 0.0, 0.0]])
            continue
        on = min(round((s - t_edge) / dt), len(track) - 1)
        _, b, u = track[on]
        more = max(s - t_edge - t, 0.0)
        v = [r * u * math.cos(b), 0.0, -r * u * math.sin(b)]
        p = [r * math.sin(b), 0.0, r * math.cos(b)]
        pos.append([[p[0] + more * v[0], 0.0,
                     p[2] + more * v[2] - G * more * more / 2]])
        vel.append([[v[0], 0.0, v[2] - G * more]])
    return {
        "name": name, "family": "sphere_box", "note": "about an edge",
        "system": {"restitution": 0.0, "friction": 1000.0 if rolls else 0.0,
                   "gravity": [0.0, 0.0, -G], "planes": [],
                   "boxes": [{"center": [-1.0, 0.0, -1.0],
                              "size": [2.0, 2.0, 2.0]}],
                   "spheres": [{"mass": m, "radius": r}]},
        "initial": {"spheres": [{"pos": [-v0 * t_edge, 0.0, r],
                                 "vel": [v0, 0.0, 0.0],
                                 "spin": [0.0, v0 / r if rolls else 0.0,
                                          0.0]}]},
        "input": None,
        "expect": [entry("pos", "m", pos, 2e-3 * r, times),
                   entry("vel", "m/s", vel, 5e-3 * math.sqrt(G * r), times)],
        "invariant": never_rises(
            of_sphere(m, r, [0.0, 0.0, r], [v0, 0.0, 0.0],
                      [0.0, v0 / r if rolls else 0.0, 0.0]),
            1e-6 * m * G * r, 0.3),
        "check": {"by": "pendulum equation", "worst": 0},
    }


def links(columns, rows):
    for c in range(columns):
        for w in range(rows):
            for dc, dw, kind, length in ((0, 1, 0, 1), (1, 0, 0, 1),
                                         (1, 1, 1, math.sqrt(2)),
                                         (1, -1, 1, math.sqrt(2)),
                                         (0, 2, 2, 2), (2, 0, 2, 2)):
                if c + dc < columns and 0 <= w + dw < rows:
                    yield (c * rows + w, (c + dc) * rows + w + dw, kind,
                           length)


def cloth(name, columns, rows):
    """A flat cloth falls on some of its own nodes, which are held under it."""
    spacing, mass = rng.uniform(0.05, 0.08), rng.uniform(0.003, 0.008)
    k = [rng.uniform(60, 120), rng.uniform(20, 40), rng.uniform(0.5, 2)]
    c = [rng.uniform(0.02, 0.05) for _ in range(3)]
    drag = rng.uniform(0.002, 0.006)
    across, push, loss = 0.8 * spacing, rng.uniform(150, 300), rng.uniform(0, 1)
    nodes = columns * rows
    # the first column is held below the third one, the rest is folded over it
    place = {0: 0.0, 1: 1.0}
    pos = []
    for i in range(nodes):
        column = i // rows
        x = place.get(column, 2.0 - column) * spacing
        pos.append([x, spacing * (i % rows),
                    0.0 if column < 2 else 1.2 * across * (column - 1)])
    pinned = list(range(2 * rows))
    springs = list(links(columns, rows))

    def force(p, v):
        f = [[0.0, 0.0, -mass * G] for _ in range(nodes)]
        for i in range(nodes):
            f[i] = add(f[i], v[i], -drag)

        def pull(i, j, tension, axis):
            f[i] = add(f[i], axis, tension)
            f[j] = add(f[j], axis, -tension)
        for i, j, kind, length in springs:
            d = add(p[j], p[i], -1)
            l = math.sqrt(dot(d, d))
            axis = [x / l for x in d]
            pull(i, j, k[kind] * (l - spacing * length) +
                 c[kind] * dot(add(v[j], v[i], -1), axis), axis)
        for i in range(nodes):
            for j in range(i):
                d = add(p[j], p[i], -1)
                square = dot(d, d)
                if square >= across * across:
                    continue
                l = math.sqrt(square)
                axis = [x / l for x in d]
                deep = across - l
                pull(i, j, -max(0.0, deep * (
                    push - loss * dot(add(v[j], v[i], -1), axis) / across)),
                     axis)
        return [[0.0] * 3 if i in pinned else [x / mass for x in f[i]]
                for i in range(nodes)]

    start = sum(mass * G * p[2] for p in pos)
    for i, j, kind, length in springs:
        start += k[kind] / 2 * (math.dist(pos[i], pos[j]) -
                                spacing * length) ** 2
    for i in range(nodes):
        for j in range(i):
            start += push / 2 * max(0.0, across -
                                    math.dist(pos[i], pos[j])) ** 2

    def moved(p, by, times):
        return [add(a, b, times) for a, b in zip(p, by)]
    p, v, dt = pos, [[0.0] * 3 for _ in range(nodes)], 0.5e-4
    times, want, nearest = [0.05, 0.1, 0.15], [], across
    for s in range(round(times[-1] / dt)):
        a1 = force(p, v)
        v2 = moved(v, a1, dt / 2)
        a2 = force(moved(p, v, dt / 2), v2)
        v3 = moved(v, a2, dt / 2)
        a3 = force(moved(p, v2, dt / 2), v3)
        v4 = moved(v, a3, dt)
        a4 = force(moved(p, v3, dt), v4)
        for a, b, times_ in ((v, a1, 1), (v2, a2, 2), (v3, a3, 2),
                             (v4, a4, 1)):
            p = moved(p, a, dt / 6 * times_)
        v = [add(add(add(add(v[i], a1[i], dt / 6), a2[i], dt / 3), a3[i],
                     dt / 3), a4[i], dt / 6) for i in range(nodes)]
        nearest = min(nearest, min(math.dist(p[i], p[j])
                                   for i in range(nodes) for j in range(i)))
        if round((s + 1) * dt * 1e6) in [round(x * 1e6) for x in times]:
            want.append(p)
    assert nearest < 0.999 * across, "nothing touches"
    return {
        "name": name, "family": "cloth_spheres",
        "note": f"nodes come as near as {nearest / across:.3f} of a diameter",
        "system": {"columns": columns, "rows": rows, "spacing": spacing,
                   "node_mass": mass, "structural": k[0], "shear": k[1],
                   "bending": k[2], "damping_structural": c[0],
                   "damping_shear": c[1], "damping_bending": c[2],
                   "drag_linear": drag, "pinned": pinned,
                   "pin_pos": [pos[i] for i in pinned],
                   "gravity": [0.0, 0.0, -G],
                   "spheres": {"diameter": across, "stiffness": push,
                               "damping": loss}},
        "initial": {"pos": pos, "vel": [[0.0] * 3 for _ in range(nodes)]},
        "input": None,
        "expect": [entry("pos", "m", want, 2e-4 * spacing, times)],
        "invariant": never_rises(start, 1e-9, 3.0),
        "check": {"by": "Runge and Kutta, 0.05 ms", "worst": 0},
    }


def main():
    cases = []
    for i in range(16):
        feature, friction = i % 3, 0.0 if i < 10 else rng.uniform(0.05, 0.5)
        case = None
        while case is None:
            case = bounce(f"{('face', 'edge', 'corner')[feature]}_{i}", feature,
                          friction)
        cases.append(case)
    for i in range(4):
        cases.append(over_an_edge(f"over_{i}", i % 2 == 0))
    for i in range(20):
        cases.append(cloth(f"fold_{i}", 4 + i % 2, 2 + i // 10))
    print(json.dumps({"format": 1, "generator": "tests/peers/physics_vectors.py",
                      "units": "SI", "cases": cases}))


main()
