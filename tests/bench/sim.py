"""What a simulated move costs: how many times faster than the clock, and
instructions per axis and tick.

    sim.py SLEW DIRECTORY

Rigs of CiA 402 axes at 1 kHz, up to four on a bus; the program runs on one
core.  Instructions are those of a long run less those of a short one, so that
reading files and drawing up the plan do not count.  The times are those of
the processor, the best of three: what else the machine does makes a run slower,
never faster.  So a time that is missed is marked, and the exit status is that
of the instructions."""

import os
import re
import subprocess
import sys

AXES_PER_BUS = 4
RUNS = 3
# axes, telemetry, seconds of move, times faster than the clock at least
ROWS = ((1, False, 3600, 180), (8, False, 120, 100), (8, True, 120, 60),
        (64, False, 20, 10))
SPREAD = 1.2  # cost per axis, most over least
COUNTED = (1, 8, 64)

AXIS = """\
  a{number}:
    unit: mm
    limits: {{position: [0 mm, 1000 mm], velocity: 300 mm/s,
             acceleration: 1000 mm/s2, jerk: 8000 mm/s3}}
    stop: {{acceleration: 2000 mm/s2, jerk: 20000 mm/s3}}
    following_error: {{floor: 5 mm, time: 20 ms}}
    drive: {{kind: cia402, bus: can{bus}, node: {node}, counts: 4096 per mm}}
    sim: {{bandwidth: 40 Hz, damping: 0.9, start: 0 mm}}
"""


def write_rig(path, axes):
    buses = -(-axes // AXES_PER_BUS)
    with open(path, "w") as out:
        out.write("tick: 1 ms\nbuses:\n")
        for bus in range(buses):
            out.write(f"  can{bus}: {{kind: canopen, bit_rate: 1 Mbit/s}}\n")
        out.write("axes:\n")
        for number in range(axes):
            out.write(AXIS.format(number=number, bus=number // AXES_PER_BUS,
                                  node=number % AXES_PER_BUS + 1))


def write_move(path, axes, seconds):
    """To and fro, a key every two seconds, every axis a little further."""
    with open(path, "w") as out:
        out.write("axes:\n")
        for number in range(axes):
            out.write(f"  a{number}:\n    curve: quintic\n    ends: rest\n"
                      "    keys:\n")
            for key in range(seconds // 2 + 1):
                place = (200 + number) * (key % 2)
                out.write(f"      - [{2 * key} s, {place} mm]\n")


class Bench:
    def __init__(self, slew, directory):
        self.slew = slew
        self.directory = directory
        os.makedirs(directory, exist_ok=True)

    def command(self, axes, seconds, telemetry):
        rig = os.path.join(self.directory, f"rig{axes}.yaml")
        move = os.path.join(self.directory, f"move{axes}-{seconds}.yaml")
        write_rig(rig, axes)
        write_move(move, axes, seconds)
        more = ["--telemetry", os.path.join(self.directory, "run.csv")]
        return [self.slew, "run", *(more if telemetry else []), rig, move]

    def seconds(self, axes, seconds, telemetry):
        command = self.command(axes, seconds, telemetry)
        best = None
        for _ in range(RUNS if seconds < 1000 else 1):
            program = subprocess.Popen(command, stdout=subprocess.DEVNULL,
                                       stderr=subprocess.DEVNULL)
            _, status, used = os.wait4(program.pid, 0)
            if status != 0:
                sys.exit(f"failed: {' '.join(command)}")
            took = used.ru_utime + used.ru_stime
            best = took if best is None else min(best, took)
        return best

    def instructions(self, axes, seconds):
        command = self.command(axes, seconds, False)
        out = os.path.join(self.directory, "callgrind.out")
        said = subprocess.run(
            ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}",
             *command], check=True, stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE, text=True).stderr
        return int(re.search(r"Collected : (\d+)", said).group(1))


def faster(bench):
    print("axes  buses  telemetry  move        took      faster  at least")
    for axes, telemetry, seconds, least in ROWS:
        took = bench.seconds(axes, seconds, telemetry)
        ratio = seconds / took
        print(f"{axes:4}  {-(-axes // AXES_PER_BUS):5}  "
              f"{'on' if telemetry else 'off':9}  {seconds:4} s  "
              f"{took:8.2f} s  {ratio:8.0f}x  {least:6}x"
              f"{'' if ratio >= least else '  MISSED'}", flush=True)


def counted(bench):
    print("\naxes  instructions per axis and tick")
    cost = []
    for axes in COUNTED:
        longer, shorter = (bench.instructions(axes, s) for s in (4, 2))
        cost.append((longer - shorter) / 2000 / axes)
        print(f"{axes:4}  {cost[-1]:10.0f}", flush=True)
    spread = max(cost) / min(cost)
    good = spread <= SPREAD
    print(f"most over least {spread:.2f}, at most {SPREAD}"
          f"{'' if good else '  MISSED'}")
    return good


def main():
    bench = Bench(sys.argv[1], sys.argv[2])
    faster(bench)
    return 0 if counted(bench) else 1


if __name__ == "__main__":
    sys.exit(main())
