#!/usr/bin/env python3
"""tests/firmware/studio/moves.py DIRECTORY COUNT [FIRST] - COUNT random rigs and
moves, each in a directory of its own: those of random_moves.py, axes of every
kind of curve with what keys may give, and files that are broken somewhere."""
import random
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "linux"))
import random_moves  # noqa: E402

CURVES = ["linear", "rounded", "smoothed", "parabolic", "sine", "s-curve",
          "hermite", "catmull-rom", "cardinal", "kochanek-bartels", "monotone",
          "akima", "akima-monotone", "c2", "quintic", "c4", "constraints",
          "b-spline", "lagrange", "bezier"]
GIVES_VELOCITY = CURVES[6:13] + ["quintic", "c4", "constraints"]
INTERPOLATIONS = ["linear", "bezier", "sine", "quad", "cubic", "quart", "quint",
                  "expo", "back", "bounce", "elastic"]


def number(r, swing):
    return "%.4g" % r.uniform(-swing, swing)


def bezier_key(r):
    kind = r.choice(["free", "aligned", "vector", "auto", "auto-clamped"])
    more = ", handles: %s" % kind
    if kind in ("free", "aligned"):
        more += ", left: [-%.3f s, %s], right: [%.3f s, %s]" % (
            r.uniform(0.01, 0.5), number(r, 5), r.uniform(0.01, 0.5),
            number(r, 5))
    if r.random() < 0.3:
        more += ", interpolation: %s" % r.choice(INTERPOLATIONS)
    return more


def key(r, curve, t):
    text = "t: %.3f s, p: %s" % (t, number(r, 50))
    if curve == "hermite" or (curve in GIVES_VELOCITY and r.random() < 0.3):
        text += ", v: %s" % number(r, 30)
    return text + (bezier_key(r) if curve == "bezier" else "")


def axis(r, name):
    curve, t, keys = r.choice(CURVES), 0.0, []
    for _ in range(r.randint(2, 9)):
        keys.append("      - {%s}\n" % key(r, curve, t))
        t += r.uniform(0.3, 3)
    more = {"cardinal": "    mu: %.3f\n" % r.uniform(0, 2),
            "rounded": "    blend: 0.2 s\n", "smoothed": "    blend: 0.2 s\n",
            "kochanek-bartels": "    tcb: [0.2, 0, %.3f]\n" % r.uniform(-1, 1),
            "sine": "    ease: [0.3, 0.7]\n"}.get(curve, "")
    return "  %s:\n    curve: %s\n%s    keys:\n%s" % (name, curve, more,
                                                     "".join(keys))


def move(r):
    names = r.sample(sorted(random_moves.AXES), r.randint(1, 4))
    return "axes:\n" + "".join(axis(r, name) for name in names)


def break_somewhere(r, text):
    at = r.randrange(len(text))
    return r.choice([text[:at] + text[at + 1:], text[:at] + r.choice("[]{}:,-x0")
                     + text[at:], text[:at]])


def main():
    directory, count = Path(sys.argv[1]), int(sys.argv[2])
    first = int(sys.argv[3]) if len(sys.argv) > 3 else 1
    for seed in range(first, first + count):
        r = random.Random(seed)
        text = random_moves.move_of(r)[0] if r.random() < 0.5 else move(r)
        if r.random() < 0.15:
            text = break_somewhere(r, text)
        limits = {name: {"vel": 10 ** r.uniform(0.5, 6),
                         "acc": 10 ** r.uniform(1, 8),
                         "jerk": r.choice([0, 10 ** r.uniform(2, 9)]),
                         "low": -1e6, "high": 10 ** r.uniform(1, 6)}
                  for name in random_moves.AXES}
        place = directory / ("%d" % seed)
        place.mkdir(parents=True, exist_ok=True)
        (place / "rig.yaml").write_text(random_moves.rig_of(limits))
        (place / "move.yaml").write_text(text)


if __name__ == "__main__":
    main()
