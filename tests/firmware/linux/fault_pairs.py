#!/usr/bin/env python3
"""Two faults at random, and what must hold whatever they are.

    tests/firmware/linux/fault_pairs.py build/slew COUNT [FIRST]

COUNT random pairs (pair n comes from n alone, so FIRST=n COUNT=1 is that pair
again) on four CiA 402 axes with e-stop and limit switches, on the two
drives of examples/odrive, or with a Modbus servo on a serial line or on TCP, in
virtual time on all cores.  Of each kind of drive one is monitored, but on TCP.  In
every tick of every run:

  - a set point is within the range of its axis, its step within the highest
    speed, the change of its step within the stop acceleration;
  - what has begun to slow down does not speed up again, and path time never goes
    back;
  - a fault is latched: no state but fault follows it, and no set point moves
    after it;
  - the run ends, by itself, with status 0 or 1, and says why;
  - axes come to rest in the time that a stop may take;
  - the drives that can be reached have no torque at the end.
"""
import concurrent.futures
import json
import os
import random
import re
import subprocess
import sys
import tempfile

import yaml

from faults import GPIO, monitored_rigs, tcp_rig

# After these a drive may not hear us in the end, or not be heard, and is named.
# One that runs away hears us, but its fault reaction, which takes no order, ends
# at rest only.
LOST = ("cut_cable", "interface_down", "bus_off", "babble", "brown_out",
        "reboot", "slow_drive", "wrong_answer", "noise", "heartbeat_lost",
        "bus_errors", "runaway", "loss", "duplication", "jitter", "echo",
        "collision", "turn_around", "hang_up")
REST_S = 8.0

MOVES = {
    "dolly": """axes:
  dolly: {curve: quintic, keys: [[0 s, 120 mm], [2 s, 140 mm], [4 s, 122 mm]]}
  focus: {curve: s-curve, keys: [[0 s, 240 deg], [2 s, 220 deg], [4 s, 240 deg]]}
  pan: {curve: quintic, keys: [[0 s, 0 deg], [2 s, 4 deg], [4 s, 0 deg]]}
  tilt: {curve: s-curve, keys: [[0 s, -8 deg], [4 s, 2 deg]]}
""",
    "odrive": """axes:
  slider: {curve: quintic, keys: [[0 s, 100 mm], [2 s, 220 mm], [4 s, 110 mm]]}
  pan: {curve: s-curve, keys: [[0 s, -20 deg], [4 s, 20 deg]]}
""",
    "modbus": """axes:
  dolly: {curve: quintic, keys: [[0 s, 120 mm], [2 s, 140 mm], [4 s, 122 mm]]}
  pan: {curve: s-curve, keys: [[0 s, -58 deg], [4 s, -50 deg]]}
  tilt: {curve: s-curve, keys: [[0 s, -8 deg], [4 s, 2 deg]]}
  focus: {curve: s-curve, keys: [[0 s, 240 deg], [4 s, 180 deg]]}
""",
}
MOVE_OF = {"tcp": "modbus"}


def quantity(text):
    """The number of "300 mm/s"."""
    return float(text.split()[0])


class Rig:
    """What a rig file says of limits, buses and kinds."""

    def __init__(self, path):
        with open(path, encoding="utf-8") as file:
            spec = yaml.safe_load(file)
        self.path = path
        self.axes = spec["axes"]
        self.tick_s = quantity(spec["tick"]) / 1000
        self.can = [name for name, bus in spec["buses"].items()
                    if bus["kind"].startswith("can")]
        self.canopen = [name for name, bus in spec["buses"].items()
                        if bus["kind"] == "canopen"]
        self.buses = list(spec["buses"])
        self.rtu = [name for name, bus in spec["buses"].items()
                    if bus["kind"] == "modbus-rtu"]
        self.tcp = [name for name, bus in spec["buses"].items()
                    if bus["kind"] == "modbus-tcp"]
        self.lines = list(spec.get("gpio", ()))

    def on(self, bus):
        return {name for name, axis in self.axes.items()
                if axis["drive"]["bus"] == bus}


def one_fault(draw, rig):
    """A fault at random, as a flow map."""
    axis = draw.choice(list(rig.axes))
    unit = rig.axes[axis]["unit"]
    kind = rig.axes[axis]["drive"]["kind"]
    way = draw.choice(("", ", direction: from", ", direction: to"))
    lasting = f", for: {draw.randint(1, 800)} ms" if draw.random() < 0.5 else ""
    choices = [
        f"drive_fault, axis: {axis}",
        f"reboot, axis: {axis}",
        f"stuck_encoder, axis: {axis}{lasting}",
        f"encoder_jump, axis: {axis}, by: {draw.uniform(-9, 9):.3f} {unit}"
        f"{lasting}",
        f"cut_cable, axis: {axis}{lasting}",
        f"cut_cable, bus: {draw.choice(rig.buses)}{lasting}",
        f"noise, bus: {draw.choice(rig.buses)}, "
        f"rate: {draw.choice((1, 10, 40, 100))} %{lasting}",
        f"brown_out, axis: {axis}, for: {draw.randint(1, 500)} ms",
        f"slow_drive, axis: {axis}, delay: {draw.randint(1, 60)} ms{way}"
        f"{lasting}",
        f"wrong_answer, axis: {axis}, count: {draw.randint(1, 30)}{way}",
        f"friction_step, axis: {axis}, by: {draw.uniform(1, 400):.1f} "
        f"{unit}/s2{lasting}",
        f"obstacle, axis: {axis}{lasting}",
        f"runaway, axis: {axis}{lasting}",
        f"bus_off, bus: {draw.choice(rig.can)}{lasting}",
        f"bus_errors, bus: {draw.choice(rig.can)}, count: {draw.randint(1, 40)}",
        f"interface_down, bus: {draw.choice(rig.can)}{lasting}",
        f"babble, bus: {draw.choice(rig.can + rig.rtu)}{lasting}",
        f"loss, axis: {axis}, rate: {draw.choice((1, 10, 40, 100))} %"
        f"{way}{lasting}",
        f"duplication, axis: {axis}, rate: {draw.choice((1, 30, 100))} %"
        f"{way}{lasting}",
        f"jitter, axis: {axis}, delay: {draw.uniform(0.1, 40):.1f} ms"
        f"{way}{lasting}",
    ]
    if "monitor" in rig.axes[axis]["drive"]:
        choices += [
            f"overheat, axis: {axis}, by: {draw.randint(20, 90)} degC{lasting}",
            f"supply, axis: {axis}, by: {draw.uniform(-9, 9):.2f} V{lasting}",
            f"reading_lost, axis: {axis}{lasting}",
        ]
    for line in rig.rtu:
        choices += [
            f"echo, bus: {line}{lasting}",
            f"collision, bus: {line}{lasting}",
            f"turn_around, bus: {line}, "
            f"delay: {draw.uniform(0.1, 30):.1f} ms{lasting}",
            f"noise, bus: {line}, rate: {draw.choice((1, 10, 40, 100))} %"
            f"{way}{lasting}",
        ]
    for line in rig.tcp:
        choices += [
            f"half_open, bus: {line}",
            f"hang_up, bus: {line}{lasting}",
            f"noise, bus: {line}, rate: {draw.choice((1, 10, 40, 100))} %"
            f"{way}{lasting}",
        ]
    if rig.canopen:
        choices.append(f"other_master, bus: {draw.choice(rig.canopen)}")
    if kind in ("cia402", "odrive"):
        choices.append(f"heartbeat_lost, axis: {axis}{lasting}")
    if rig.lines:
        choices.append(
            f"stuck_switch, line: {draw.choice(rig.lines)}, "
            f"level: {draw.choice(('active', 'inactive', 'open'))}{lasting}")
    return f"fault: {draw.choice(choices)}"


def when(draw, second):
    """Alone at any time; the second soon after what the first has begun."""
    if second and draw.random() < 0.6:
        event = draw.choice(("stop", "fault", "off"))
        return f"event: {event}, at: {draw.randint(0, 400)} ms"
    event = draw.choices(("enable", "approach", "move", "settle"),
                         (2, 1, 8, 1))[0]
    most = {"enable": 600, "approach": 200, "move": 4200, "settle": 400}[event]
    return f"event: {event}, at: {draw.randint(0, most)} ms"


def may_be_lost(rig, faults):
    """Axes that may not hear us in the end."""
    lost = set()
    for fault in faults:
        kind = fault.split(": ")[1].split(",")[0]
        if kind not in LOST:
            continue
        place = re.search(r"axis: (\w+)", fault)
        bus = re.search(r"bus: (\w+)", fault)
        lost |= {place[1]} if place else rig.on(bus[1])
    return lost


class Judge:
    """The invariants, row by row."""

    def __init__(self, rig, names):
        self.rig = rig
        self.column = {name: i for i, name in enumerate(names)}
        self.last = self.last_step = None
        self.slowing = self.faulted = self.slow_since = None
        self.path = None  # path time and its last step, within the move
        self.wrong = set()

    def limits(self, axis):
        spec = self.rig.axes[axis]
        low, high = map(quantity, spec["limits"]["position"])
        most = max(quantity(spec["limits"]["acceleration"]),
                   quantity(spec["stop"]["acceleration"]))
        return (low, high, quantity(spec["limits"]["velocity"]) * self.rig.tick_s,
                most * self.rig.tick_s ** 2)

    def axis(self, axis, pos, before, step_before, moves):
        low, high, step_most, change_most = self.limits(axis)
        step = pos - before
        if moves and not low - 1e-6 <= pos <= high + 1e-6:
            self.wrong.add(f"{axis} outside its range")
        if moves and abs(step) > step_most * 1.001 + 1e-6:
            self.wrong.add(f"{axis} faster than its limit")
        if moves and step_before is not None and \
                abs(step - step_before) > change_most * 1.01 + 1e-6:
            self.wrong.add(f"{axis} accelerates beyond the stop limit")
        return step

    def path_time(self, path_ns, phase):
        """0.01 ns for the decimals."""
        if phase != "move":
            self.path = None
            return
        if self.path is None:
            self.path = (path_ns, None)
            return
        step, before = path_ns - self.path[0], self.path[1]
        if self.slowing and before is not None and step > before + 0.01:
            self.wrong.add("speeds up again while it stops")
        if step < -0.01:
            self.wrong.add("path time goes back")
        self.path = (path_ns, step)

    def state(self, t_s, phase, state):
        if self.faulted and state != "fault" and phase != "stop":
            self.wrong.add(f"{state} after a fault")
        self.faulted = self.faulted or state == "fault"
        if state in ("stopping", "holding", "fault") and not self.slowing:
            self.slowing, self.slow_since = True, t_s
        if state in ("stopping", "holding") and \
                t_s - self.slow_since > REST_S:
            self.wrong.add("not at rest in time")

    def row(self, cells):
        column = self.column
        phase, state = cells[1], cells[2]
        now = {axis: float(cells[column[f"{axis}.demand_{spec['unit']}"]])
               for axis, spec in self.rig.axes.items()}
        moves = phase in ("move", "approach") and \
            state in ("moving", "stopping", "holding")
        self.state(int(cells[0]) / 1e9, phase, state)
        self.path_time(float(cells[3]), phase)
        if self.last is not None:
            steps = {axis: self.axis(
                axis, now[axis], self.last[axis],
                self.last_step and self.last_step[axis], moves)
                for axis in now}
            self.last_step = steps if moves else None
        self.last = now


def pair(slew, rigs, directory, n):
    """Wrong things of pair n, and the faults."""
    draw = random.Random(n)
    which = draw.choices(("dolly", "odrive", "modbus", "tcp"),
                         (6, 3, 2, 2))[0]
    rig = rigs[which]
    faults = [f"{one_fault(draw, rig)}, {when(draw, i > 0)}" for i in range(2)]
    base = os.path.join(directory, str(n))
    with open(base + ".yaml", "w", encoding="utf-8") as file:
        file.write(f"seed: {n + 1}\nfaults:\n"
                   + "".join(f"  - {{{fault}}}\n" for fault in faults))
    try:
        done = subprocess.run(
            [slew, "run", "--json", "--faults", base + ".yaml", "--telemetry",
             base + ".csv", rig.path, f"{directory}/{MOVE_OF.get(which, which)}.move.yaml"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            check=False, timeout=120)
    except subprocess.TimeoutExpired:
        return {"does not end"}, which, faults
    wrong = check(rig, base, done, faults)
    for end in (".yaml", ".csv", ".csv.partial"):
        if os.path.exists(base + end):
            os.unlink(base + end)
    return wrong, which, faults


def check(rig, base, done, faults):
    if done.returncode not in (0, 1):
        return {f"status {done.returncode}: {done.stderr[-300:]}"}
    report = json.loads(done.stdout)
    with open(base + ".csv", encoding="utf-8") as file:
        judge = Judge(rig, next(file).rstrip("\n").split(","))
        for line in file:
            judge.row(line.split(","))
    wrong = judge.wrong
    if done.returncode == 1 and report["end"] == "done" and \
            not report["torque_not_confirmed_off"]:
        wrong.add("status 1 without a reason")
    if report["end"] == "stopped by a fault" and \
            not (report["fault"]["what"] or report["fault"]["reason"]):
        wrong.add("a fault without a name")
    left = {item["axis"] for item in report["torque_not_confirmed_off"]}
    if left - may_be_lost(rig, faults):
        wrong.add(f"torque left on {', '.join(sorted(left))}")
    return wrong


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    slew, count = sys.argv[1], int(sys.argv[2])
    first = int(sys.argv[3]) if len(sys.argv) == 4 else 0
    bad = 0
    with tempfile.TemporaryDirectory() as directory, \
            concurrent.futures.ProcessPoolExecutor(os.cpu_count()) as pool:
        for name, move in MOVES.items():
            with open(f"{directory}/{name}.move.yaml", "w",
                      encoding="utf-8") as file:
                file.write(move)
        monitored_rigs(directory)
        with open(f"{directory}/canopen.yaml", encoding="utf-8") as file:
            text = file.read()
        with open(f"{directory}/rig.yaml", "w", encoding="utf-8") as file:
            file.write(text + GPIO)
        rigs = {"dolly": Rig(f"{directory}/rig.yaml"),
                "odrive": Rig(f"{directory}/monitored.yaml"),
                "modbus": Rig(f"{directory}/registers.yaml"),
                "tcp": Rig(tcp_rig(directory))}
        jobs = [pool.submit(pair, slew, rigs, directory, n)
                for n in range(first, first + count)]
        for n, job in enumerate(jobs, first):
            wrong, which, faults = job.result()
            if wrong:
                bad += 1
                print(f"pair {n} ({which}): {'; '.join(sorted(wrong))}")
                for fault in faults:
                    print(f"    {fault}")
    print(f"fault-pairs: {count} pairs, {bad} break an invariant")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
