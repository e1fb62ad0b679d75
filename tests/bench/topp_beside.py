"""Time-optimal timing of one path by slew and by toppra, in one run.

topp_beside.py PROGRAM [AXES [WAYPOINTS]] runs `make bench-topp`'s program, then
toppra on the same waypoints, limits and number of intervals, and fails when slew
takes more than a fifth of toppra's time or more than in proportion to the
intervals.  Both begin with the waypoints: the spline's set-up counts.
Times are of the processor, so that a busy machine matters little.
"""

import json
import logging
import subprocess
import sys
import time

import numpy as np
import toppra
import toppra.algorithm
import toppra.constraint

RATIO_MOST = 1 / 5
GROWTH_MOST = 1.5  # beyond in proportion: caches
RUNS = 10

logging.disable(logging.CRITICAL)


def toppra_solve(problem, intervals):
    """Seconds and duration of one run."""
    waypoints = np.array(problem["waypoints"])
    vel, acc = np.array(problem["vel"]), np.array(problem["acc"])
    start = time.process_time()
    knots = np.arange(len(waypoints), dtype=float)
    path = toppra.SplineInterpolator(knots, waypoints, "natural")
    limits = [
        toppra.constraint.JointVelocityConstraint(np.stack([-vel, vel], 1)),
        toppra.constraint.JointAccelerationConstraint(np.stack([-acc, acc], 1)),
    ]
    grid = np.linspace(0, knots[-1], intervals + 1)
    law = toppra.algorithm.TOPPRA(
        limits, path, gridpoints=grid, solver_wrapper="seidel"
    )
    _, speed, _ = law.compute_parameterization(0, 0)
    seconds = time.process_time() - start
    duration = np.sum(2 * np.diff(grid) / (speed[1:] + speed[:-1]))
    return seconds, duration


def main():
    program = sys.argv[1]
    axes = sys.argv[2] if len(sys.argv) > 2 else "7"
    waypoints = sys.argv[3] if len(sys.argv) > 3 else "10"
    seconds, ratios, growths = [], [], []
    for seed in range(1, 6):
        text = subprocess.run(
            [program, waypoints, axes, str(seed)],
            check=True, capture_output=True, text=True, timeout=300,
        ).stdout
        problem = json.loads(text)
        ours = problem["runs"]
        runs = [toppra_solve(problem, ours[0]["intervals"]) for _ in range(RUNS)]
        theirs = min(run[0] for run in runs)
        ratios.append(ours[0]["seconds"] / theirs)
        growths.append(
            ours[-1]["seconds"] / ours[0]["seconds"]
            * ours[0]["intervals"] / ours[-1]["intervals"]
        )
        seconds.append(theirs)
        print(
            f"seed {seed}: slew {1e3 * ours[0]['seconds']:.3f} ms, toppra "
            f"{1e3 * theirs:.3f} ms, ratio {ratios[-1]:.3f}; durations "
            f"{ours[0]['duration']:.6f} and {runs[0][1]:.6f} s; "
            f"{ours[-1]['intervals']} intervals "
            f"{1e3 * ours[-1]['seconds']:.1f} ms, {growths[-1]:.2f} of in proportion"
        )
    ratio, growth = max(ratios), max(growths)
    is_good = ratio <= RATIO_MOST and growth <= GROWTH_MOST
    print(
        f"{axes} axes, {waypoints} waypoints: at most {ratio:.3f} of toppra's time "
        f"({RATIO_MOST:.3f} allowed), growth at most {growth:.2f} "
        f"({GROWTH_MOST} allowed): {'PASS' if is_good else 'FAIL'}"
    )
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main())
