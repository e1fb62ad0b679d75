#!/usr/bin/env python3
"""What curves cost to plan and to play, and that it does not grow.

    curves.py PROCESSOR=FILE...

FILE is what curves_image.c printed on that processor.  Fails where planning
costs more per key with more keys, or a tick more with more segments: the
natural cubic spline from 1,000 to 100,000 keys, the others from 100 to
1,000."""
import sys

RATIO = 1.1  # of the cost per key
TICK_RATIO = 1.1  # of the worst tick, played forwards or backwards


def read(path):
    plan, play = {}, {}
    with open(path, encoding="ascii") as lines:
        for line in lines:
            word = line.split()
            if word[0] == "plan":
                plan.setdefault(word[1], {})[int(word[2])] = int(word[3])
            else:
                play.setdefault(word[1], {})[int(word[2])] = (
                    int(word[3]), int(word[4]))
    return plan, play


def plan_table(name, plan):
    """Ten keys are too few to compare: ends and start-up are a part of them."""
    sizes = sorted({n for costs in plan.values() for n in costs})
    print(f"{name}: instructions per key")
    print(f"  {'':<18}" + "".join(f"{n:>10,} keys" for n in sizes))
    bad = 0
    for kind, costs in plan.items():
        per = {n: costs[n] / n for n in costs}
        beside = 1000 if max(per) > 1000 else 100
        ratio = per[max(per)] / per[beside] if max(per) > beside else 0
        bad += ratio > RATIO
        print(f"  {kind:<18}"
              + "".join(f"{per[n]:>15,.0f}" if n in per else f"{'':>15}"
                        for n in sizes)
              + (f"   x {ratio:.3f}" if ratio else "")
              + ("  NOT LINEAR" if ratio > RATIO else ""))
    return bad


def play_table(name, play):
    sizes = sorted(next(iter(play.values())))
    print(f"{name}: instructions per tick, mean / worst")
    print(f"  {'':<18}" + "".join(f"{n:>10,} segments" for n in sizes))
    bad = 0
    for way, costs in play.items():
        grows = costs[sizes[-1]][1] > TICK_RATIO * costs[sizes[0]][1]
        is_bad = grows and way != "seek"
        bad += is_bad
        print(f"  {way:<18}"
              + "".join(f"{costs[n][0]:>11} / {costs[n][1]:>5}" for n in sizes)
              + ("  GROWS" if is_bad else ""))
    return bad


def main(arguments):
    bad = 0
    for argument in arguments:
        name, path = argument.split("=")
        plan, play = read(path)
        bad += plan_table(name, plan)
        bad += play_table(name, play)
    print(f"bench-curves: {bad} figures grow that must not")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
