#!/usr/bin/env python3
"""tests/firmware/linux/hold.py SLEW RIG_AND_MOVE COUNT - hold and resume at random times.

Runs the move COUNT times on the simulated bus, each with a feed hold at a random
time, and judges the telemetry: every demanded position is the track's own at
that path time, to the bit; velocity, acceleration and jerk, as reported and as
differences of the demanded positions, are inside the limits throughout; the end
is the last key.  Prints the worst share of each limit.
"""
import csv
import json
import multiprocessing
import os
import random
import subprocess
import sys
import tempfile

import yaml

UNIT = 2.0 ** -32
TICK = 1e-3


def limit_of(text):
    return float(str(text).split()[0])


def run(slew, move, telemetry, hold_s, stand_s):
    command = [slew, 'run', move, '--telemetry', telemetry, '--hold-at',
               f'{hold_s:.4f}s', '--resume-after', f'{stand_s:.4f}s', '--json']
    return subprocess.run(command, capture_output=True, text=True, check=True)


def samples(slew, move):
    """The path itself, at every tick of an undisturbed clock."""
    command = [slew, 'sample', move, '--rate', '1000', '--raw']
    rows = subprocess.run(command, capture_output=True, text=True, check=True)
    return list(csv.DictReader(rows.stdout.splitlines()))


def judge(worst, name, share):
    worst[name] = max(worst.get(name, 0.0), share)
    return share <= 1.0


def judge_axis(worst, axis, unit, limits, rows):
    good = True
    p = [float(r[f'{axis}.demand_{unit}']) for r in rows]
    for order, suffix in enumerate(('_s', '_s2', '_s3')):
        peak = max(abs(float(r[f'{axis}.demand_{unit}{suffix}'])) for r in rows)
        good &= judge(worst, f'{axis} d{order + 1}', peak / limits[order])
        # the same as a difference, less what rounding to 2^-32 can do to it
        p = [b - a for a, b in zip(p, p[1:])]
        noise = 2 ** (order + 1) * 2 * UNIT / TICK ** (order + 1)
        peak = max(map(abs, p)) / TICK ** (order + 1) - noise
        good &= judge(worst, f'{axis} difference {order + 1}',
                      peak / limits[order])
    return good


def hold(job):
    """One run: worst shares, whether all was well, positions compared."""
    slew, move, limits, end_raw, at_tick, hold_s, stand_s = job
    worst, compared = {}, 0
    with tempfile.TemporaryDirectory() as folder:
        telemetry = os.path.join(folder, 'telemetry.csv')
        report = run(slew, move, telemetry, hold_s, stand_s)
        with open(telemetry, encoding='utf-8') as file:
            rows = [r for r in csv.DictReader(file) if r['phase'] == 'move']
    good = json.loads(report.stdout)['end'] == 'done'
    for axis, (unit, axis_limits) in limits.items():
        good &= judge_axis(worst, axis, unit, axis_limits, rows)
        for r in rows:
            same = at_tick.get(float(r['path_ns']))
            if same is None:
                continue
            compared += 1
            demand = round(float(r[f'{axis}.demand_{unit}']) / UNIT)
            good &= demand == same[axis]
        last = round(float(rows[-1][f'{axis}.demand_{unit}']) / UNIT)
        good &= last == end_raw[axis]
    return worst, good, compared


def main():
    slew, move, count = sys.argv[1], sys.argv[2], int(sys.argv[3])
    with open(os.path.join(move, 'rig.yaml'), encoding='utf-8') as file:
        rig = yaml.safe_load(file)
    limits = {axis: (spec['unit'], [limit_of(spec['limits'][k]) for k in
                                    ('velocity', 'acceleration', 'jerk')])
              for axis, spec in rig['axes'].items()}
    seed = 20
    random.seed(seed)
    path = samples(slew, move)
    end_s = int(path[-1]['t_ns']) / 1e9
    raw = [{axis: int(r[f'{axis}_pos_q32']) for axis in limits} for r in path]
    at_tick = {int(r['t_ns']): q for r, q in zip(path, raw)}
    jobs = [(slew, move, limits, raw[-1], at_tick,
             random.uniform(0.001, end_s - 0.001), random.uniform(0, 1))
            for _ in range(count)]
    worst, bad, compared = {}, 0, 0
    with multiprocessing.Pool() as pool:
        for n, (shares, good, some) in enumerate(pool.imap(hold, jobs)):
            compared += some
            for name, share in shares.items():
                judge(worst, name, share)
            if not good:
                bad += 1
                print(f'seed {seed}, run {n}: hold at {jobs[n][5]:.4f} s')
    for name, share in sorted(worst.items()):
        print(f'  {name:24s} {100 * share:6.2f} % of its limit')
    print(f'  {compared} positions compared with the path, to the bit')
    print(f'{count - bad} passed, {bad} failed')
    return 1 if bad or compared < count else 0


if __name__ == '__main__':
    sys.exit(main())
