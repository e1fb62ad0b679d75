#!/usr/bin/env python3
"""Every fault a machine must survive: how it is detected, what follows, how soon.

    tests/firmware/linux/faults.py build/slew

Runs the demo (and, where a row needs other drives, examples/modbus and
examples/odrive) in virtual time under a fault script, each fault while the axes
speed up, go and slow down, and prints a table: the worst time from the fault to
the first set point that slows the axes down (STOP) or to the tick that takes
torque (OFF), and its bound.  That is the time until the fault can be seen (three
heartbeats missing, 128 errors counted) and what docs/FAULTS.md gives from there;
where the evidence is an error above its limit, both count from that tick.  At the
end of a run torque goes after a HOLD as after a STOP, so both are STOP here.
Status 1 when one is late, reacts in another way, is blamed on another axis, goes
on by itself, or leaves torque on a drive that can be reached.

Rows that no fault on a simulated bus can make are listed with their test.
"""
import concurrent.futures
import json
import os
import shutil
import subprocess
import sys
import tempfile

import yaml

GPIO = """
gpio:
  estop: {kind: e-stop, line: GPIO5, bias: pull-up}
  near: {kind: limit-negative, axis: dolly, line: GPIO6, bias: pull-up}
  far: {kind: limit-positive, axis: dolly, line: GPIO7, bias: pull-up}
"""

# name: rig and move, tick in ms, times into the move: speeding up, going,
# slowing down
RIGS = {
    "dolly": ("examples/dolly", 1, ("1.5 s", "9 s", "20 s")),
    "modbus": ("examples/modbus", 5, ("1.5 s", "3 s", "4.5 s")),
    "odrive": ("examples/odrive", 1, ("500 ms", "1.5 s", "2 s")),
    # both, monitored
    "monitored": ("examples/odrive", 1, ("500 ms", "1.5 s", "2 s")),
    "canopen": ("examples/dolly", 1, ("1.5 s", "9 s", "20 s")),
    # its servo with registers for what it measures, and monitored
    "registers": ("examples/modbus", 5, ("1.5 s", "3 s", "4.5 s")),
    # examples/modbus, its servo on TCP
    "tcp": ("examples/modbus", 5, ("1.5 s", "3 s", "4.5 s")),
}
LINE = "{kind: modbus-rtu, device: /dev/ttyUSB0, baud: 115200, parity: none, " \
    "stop_bits: 2}"
TCP = "{kind: modbus-tcp, host: 127.0.0.1, port: 502}"

SEEN_NS = 3000000000   # of telemetry, from the fault on

H, T = 100, 1          # ms, of the demo
H_ODRIVE = 20
# Three deadlines, each counted from the end of the request and with the time of
# the answer on the wire (3 ms together), the silence of twice that after the
# first two, the transaction under way before, and a tick.
MODBUS = 3 * (50 + 3) + 2 * 100 + 6 + 5
# Where the line is never silent nothing is asked: three cycles of 23 ms and six
# deadlines without feedback, and a tick.
SILENT = 3 * 23 + 6 * 50 + 5
# Two cycles of the line of "registers", and a tick.
SERVO = 2 * 33.1 + 5

GONE = "not on the bus any more"
OLD = "feedback is too old"
FOLLOW = "does not follow"
DRIVE = "reports a fault"
PASSIVE = "error-passive"
DOWN = "the bus is down"

# fault, rig, script (AT is the time), what it is blamed on, the axis, reaction,
# the time until the evidence, the bound from there; in ms
ROWS = [
    ("drive heartbeat lost", "dolly", "fault: heartbeat_lost, axis: pan",
     GONE, "pan", "STOP", 3 * H, T),
    ("drive heartbeat lost, ODrive", "odrive",
     "fault: heartbeat_lost, axis: slider", GONE, "slider", "STOP",
     3 * H_ODRIVE, T),
    ("CAN warning", "dolly", "fault: bus_errors, bus: can0, count: 12",
     "", "", "none", 0, 0),
    ("CAN error-passive: HOLD", "dolly", "fault: bus_errors, bus: can0, count: 17",
     PASSIVE, "all axes", "STOP", 2, 2 * T),
    ("bus-off", "dolly", "fault: bus_off, bus: can0",
     PASSIVE, "all axes", "OFF", 4, 2 * T),
    ("interface down", "dolly", "fault: interface_down, bus: can1",
     DOWN, "all axes", "OFF", 0, 2 * T),
    ("CAN wire full: a babbling node", "dolly", "fault: babble, bus: can0",
     (GONE, OLD), ("dolly", "focus"), "STOP", 0, 4 * T),
    ("noise on the wire, 5 %", "dolly",
     "fault: noise, bus: can0, rate: 5 %, for: 1 s", "", "", "none", 0, 0),
    ("cable to all drives cut", "dolly", "fault: cut_cable, bus: can0",
     PASSIVE, "all axes", "STOP", 2, 2 * T),
    ("stale feedback: cable cut, CiA 402", "dolly",
     "fault: cut_cable, axis: tilt", (OLD, GONE), "tilt", "STOP", 0, 4 * T),
    ("cable to the only drive cut, ODrive", "odrive",
     "fault: cut_cable, axis: slider", PASSIVE, "all axes", "STOP", 2, 2 * T),
    ("cable to the only drive cut, moteus", "odrive",
     "fault: cut_cable, axis: pan", PASSIVE, "all axes", "STOP", 2, 2 * T),
    ("stale feedback: a drive 20 ms late", "dolly",
     "fault: slow_drive, axis: tilt, delay: 20 ms", (OLD, GONE), "tilt", "STOP",
     3 * T, 2 * T),
    ("all frames from a drive lost", "dolly",
     "fault: loss, axis: tilt, rate: 100 %", (OLD, GONE), "tilt", "STOP", 0,
     4 * T),
    ("all frames to a drive lost", "dolly",
     "fault: loss, axis: tilt, rate: 100 %, direction: to", (OLD, GONE), "tilt",
     "STOP", 0, 4 * T),
    ("a drive hears 20 ms late", "dolly",
     "fault: slow_drive, axis: tilt, delay: 20 ms, direction: to", (OLD, GONE),
     "tilt", "STOP", 3 * T, 2 * T),
    ("frames to a drive twice, 30 %", "dolly",
     "fault: duplication, axis: tilt, rate: 30 %, direction: to, for: 1 s", "",
     "", "none", 0, 0),
    ("frames from a drive twice, 30 %", "dolly",
     "fault: duplication, axis: tilt, rate: 30 %, for: 1 s", "", "", "none", 0,
     0),
    ("a drive's frames jitter by 0.5 ms", "dolly",
     "fault: jitter, axis: tilt, delay: 0.5 ms, for: 1 s", "", "", "none", 0,
     0),
    ("Modbus timeout", "modbus", "fault: cut_cable, axis: pan",
     (OLD, GONE), "pan", "STOP", 0, MODBUS),
    ("Modbus answers spoilt (CRC)", "modbus",
     "fault: noise, bus: line1, rate: 100 %", (OLD, GONE), "pan", "STOP", 0,
     MODBUS),
    ("Modbus answers of another unit", "modbus",
     "fault: wrong_answer, axis: pan, count: 100", (OLD, GONE), "pan", "STOP",
     0, MODBUS),
    ("Modbus drive late", "modbus",
     "fault: slow_drive, axis: pan, delay: 200 ms", (OLD, GONE), "pan", "STOP",
     0, MODBUS),
    ("all requests to a Modbus drive lost", "modbus",
     "fault: loss, axis: pan, rate: 100 %, direction: to", (OLD, GONE), "pan",
     "STOP", 0, MODBUS),
    ("Modbus requests spoilt (CRC)", "modbus",
     "fault: noise, bus: line1, rate: 100 %, direction: to", (OLD, GONE),
     "pan", "STOP", 0, MODBUS),
    ("a Modbus drive hears 200 ms late", "modbus",
     "fault: slow_drive, axis: pan, delay: 200 ms, direction: to", (OLD, GONE),
     "pan", "STOP", 0, MODBUS),
    ("Modbus answers jitter by 10 ms", "modbus",
     "fault: jitter, axis: pan, delay: 10 ms, for: 1 s", "", "", "none", 0, 0),
    ("Modbus requests jitter by 10 ms", "modbus",
     "fault: jitter, axis: pan, delay: 10 ms, direction: to, for: 1 s", "", "",
     "none", 0, 0),
    ("Modbus answers twice, 10 %", "modbus",
     "fault: duplication, axis: pan, rate: 10 %, for: 1 s", "", "", "none", 0,
     0),
    ("Modbus requests twice, 10 %", "modbus",
     "fault: duplication, axis: pan, rate: 10 %, direction: to, for: 1 s", "",
     "", "none", 0, 0),
    ("RS-485: the adapter hears itself", "modbus",
     "fault: echo, bus: line1", "", "", "none", 0, 0),
    ("RS-485: collisions with another master", "modbus",
     "fault: collision, bus: line1", (OLD, GONE), "pan", "STOP", 0, SILENT),
    ("RS-485: a babbling node", "modbus",
     "fault: babble, bus: line1", OLD, "pan", "STOP", 0, SILENT),
    ("RS-485: the adapter turns 10 ms late", "modbus",
     "fault: turn_around, bus: line1, delay: 10 ms", (OLD, GONE), "pan",
     "STOP", 0, MODBUS),
    ("Modbus TCP: the server hangs up", "tcp",
     "fault: hang_up, bus: line1", DOWN, "all axes", "OFF", 0,
     3 * 50 + 10),
    ("Modbus TCP: hangs up, back at once", "tcp",
     "fault: hang_up, bus: line1, for: 50 ms", "", "", "none", 0, 0),
    ("Modbus TCP: half open, connected anew", "tcp",
     "fault: half_open, bus: line1", (OLD, GONE), "pan", "STOP", 0, MODBUS),
    ("Modbus TCP: all segments lost", "tcp",
     "fault: loss, axis: pan, rate: 100 %", (OLD, GONE), "pan", "STOP", 0,
     MODBUS),
    ("Modbus TCP: all segments to it lost", "tcp",
     "fault: loss, axis: pan, rate: 100 %, direction: to", (OLD, GONE), "pan",
     "STOP", 0, MODBUS),
    ("Modbus TCP: one segment in 100 sent again", "tcp",
     "fault: loss, axis: pan, rate: 1 %, for: 1 s", "", "", "none", 0, 0),
    ("Modbus TCP: a server 200 ms late", "tcp",
     "fault: slow_drive, axis: pan, delay: 200 ms", (OLD, GONE), "pan", "STOP",
     0, MODBUS),
    ("Modbus TCP: answers jitter by 20 ms", "tcp",
     "fault: jitter, axis: pan, delay: 20 ms, for: 1 s", "", "", "none", 0, 0),
    ("Modbus TCP: another transaction's answers", "tcp",
     "fault: noise, bus: line1, rate: 100 %", (OLD, GONE), "pan", "STOP", 0,
     MODBUS),
    ("Modbus TCP: answers twice, 10 %", "tcp",
     "fault: duplication, axis: pan, rate: 10 %, for: 1 s", "", "", "none", 0,
     0),
    ("following error: an obstacle", "dolly", "fault: obstacle, axis: dolly",
     FOLLOW, "dolly", "STOP", "error", T),
    ("following error: an obstacle, Modbus", "modbus",
     "fault: obstacle, axis: pan", FOLLOW, "pan", "STOP", "error", 5),
    ("following error: an obstacle, ODrive", "odrive",
     "fault: obstacle, axis: slider", FOLLOW, "slider", "STOP", "error", T),
    ("following error: encoder stuck", "dolly",
     "fault: stuck_encoder, axis: dolly", FOLLOW, "dolly", "STOP", "error", T),
    ("runaway", "dolly", "fault: runaway, axis: pan",
     (FOLLOW, DRIVE), "pan", "OFF", "error", 3 * T),
    ("limit switch", "dolly",
     "fault: stuck_switch, line: far, level: active", "limit switch", "dolly",
     "STOP", 0, 2 * T),
    ("limit switch, broken wire", "dolly",
     "fault: stuck_switch, line: far, level: open", "limit switch", "dolly",
     "STOP", 0, 2 * T),
    ("e-stop input", "dolly",
     "fault: stuck_switch, line: estop, level: active", "e-stop", "all axes",
     "STOP", 0, T),
    ("e-stop input, broken wire", "dolly",
     "fault: stuck_switch, line: estop, level: open", "e-stop", "all axes",
     "STOP", 0, T),
    ("encoder jump that stays", "dolly",
     "fault: encoder_jump, axis: tilt, by: 5 deg", FOLLOW, "tilt", "STOP", 0,
     2 * T),
    ("wrong answers", "dolly",
     "fault: wrong_answer, axis: pan, count: 5", None, "pan", "STOP", 0, 5 * T),
    ("two masters on the bus", "dolly", "fault: other_master, bus: can1",
     "another master", "all axes", "STOP", 0, 2 * T),
    ("drive fault", "dolly",
     "fault: drive_fault, axis: dolly, code: 0x2310", DRIVE, "dolly", "STOP",
     0, 2 * T),
    ("drive fault, Modbus", "modbus", "fault: drive_fault, axis: pan",
     DRIVE, "pan", "STOP", 0, 50),
    ("drive fault, ODrive", "odrive", "fault: drive_fault, axis: slider",
     DRIVE, "slider", "STOP", H_ODRIVE, 2 * T),
    ("drive fault, moteus", "odrive", "fault: drive_fault, axis: pan, code: 33",
     DRIVE, "pan", "STOP", T, 2 * T),
    ("drive reboots", "dolly", "fault: reboot, axis: pan",
     None, "pan", "STOP", 0, 4 * T),
    ("drive reboots, ODrive", "odrive", "fault: reboot, axis: slider",
     None, "slider", "STOP", 3 * H_ODRIVE, 2 * T),
    ("drive reboots, moteus", "odrive", "fault: reboot, axis: pan",
     None, "pan", "STOP", 3 * T, 2 * T),
    ("brown-out", "dolly", "fault: brown_out, axis: pan, for: 30 ms",
     None, "pan", "STOP", 0, 4 * T),
    ("bus voltage: the drive's own limit", "dolly",
     "fault: drive_fault, axis: focus, code: 0x3210", DRIVE, "focus", "STOP",
     0, 2 * T),
    ("near a limit of temperature, ODrive", "monitored",
     "fault: overheat, axis: slider, by: 43 degC", "", "", "none", 0, 0),
    ("over-temperature, ODrive", "monitored",
     "fault: overheat, axis: slider, by: 60 degC", DRIVE, "slider", "STOP", 100,
     T),
    ("over-temperature, moteus", "monitored",
     "fault: overheat, axis: pan, by: 60 degC", DRIVE, "pan", "STOP", 100, T),
    ("over-temperature, CiA 402", "canopen",
     "fault: overheat, axis: dolly, by: 60 degC", DRIVE, "dolly", "STOP", 100,
     T),
    ("under-voltage, CiA 402", "canopen",
     "fault: supply, axis: dolly, by: -6 V", DRIVE, "dolly", "STOP", 100, T),
    ("temperature, voltage missing, CiA 402", "canopen",
     "fault: reading_lost, axis: dolly", DRIVE, "dolly", "STOP", 100, T),
    ("over-voltage, ODrive", "monitored",
     "fault: supply, axis: slider, by: 7 V", DRIVE, "slider", "STOP", 100, T),
    ("under-voltage, moteus", "monitored",
     "fault: supply, axis: pan, by: -6 V", DRIVE, "pan", "STOP", 100, T),
    ("temperature, voltage missing, ODrive", "monitored",
     "fault: reading_lost, axis: slider", DRIVE, "slider", "STOP", 100, T),
    ("temperature, voltage missing, moteus", "monitored",
     "fault: reading_lost, axis: pan", DRIVE, "pan", "STOP", 100, T),
    ("near a limit of temperature, Modbus", "registers",
     "fault: overheat, axis: pan, by: 46 degC", "", "", "none", 0, 0),
    ("over-temperature, Modbus", "registers",
     "fault: overheat, axis: pan, by: 60 degC", DRIVE, "pan", "STOP", 0, SERVO),
    ("over-voltage, Modbus", "registers",
     "fault: supply, axis: pan, by: 7 V", DRIVE, "pan", "STOP", 0, SERVO),
    ("under-voltage, Modbus", "registers",
     "fault: supply, axis: pan, by: -6 V", DRIVE, "pan", "STOP", 0, SERVO),
    ("temperature, voltage missing, Modbus", "registers",
     "fault: reading_lost, axis: pan", DRIVE, "pan", "STOP", 0, SERVO),
]

# What needs more than a simulated bus.
ELSEWHERE = [
    ("TX queue full", "canopen: three_refused_cycles_in_a_row_are_a_fault"),
    ("Modbus exception", "drive_modbus: an_exception_latches"),
    ("loop overrun", "controller: ten_lost_in_a_row_or_one_in_ten_stop"),
    ("crash, kill -9, hang", "real_stop.sh; vm/can.sh"),
    ("power loss in log; disk full", "output; squeeze"),
    ("bad move file", "wrong"),
    ("hostile client; two clients", "service"),
    ("camera trigger", "trigger: a_dead_line_is_counted_and_stops_nothing"),
    ("homing lost", "homing: a_drive_that_was_lost_is_unhomed"),
    ("internal check failed",
     "controller: the_gate_stops_what_planning_should_have"),
]


def tcp_rig(directory):
    """Writes examples/modbus with its servo on TCP; the path."""
    path = f"{directory}/tcp.yaml"
    with open("examples/modbus/rig.yaml", encoding="utf-8") as file:
        text = file.read()
    assert LINE in text
    with open(path, "w", encoding="utf-8") as file:
        file.write(text.replace(LINE, TCP))
    return path


LIMITS = "temperature: 80 degC, voltage: [20 V, 30 V]}"
# name: what stands in the example, and in its place so that a drive has limits
MONITORED = {
    "monitored": (
        ("endpoints: endpoints.json}",
         f"endpoints: endpoints.json, monitor: {{{LIMITS}}}"),
        ("turns: 50 per rev}", f"turns: 50 per rev, monitor: {{{LIMITS}}}")),
    "canopen": (
        ("counts: 4096 per mm}",
         "counts: 4096 per mm, monitor: {object: 2003, scale: 0.1 degC, "
         f"{LIMITS}}}"),),
    "registers": (
        ("map: leadshine-el7\n",
         f"map: servo.yaml\n      monitor: {{{LIMITS}\n"),),
}
BESIDE = ("examples/odrive/endpoints.json", "tests/data/monitored/servo.yaml")


def monitored_rigs(directory):
    """Writes the examples with limits for their drives."""
    for name, drives in MONITORED.items():
        with open(f"{RIGS[name][0]}/rig.yaml", encoding="utf-8") as file:
            text = file.read()
        for drive, monitored in drives:
            assert drive in text
            text = text.replace(drive, monitored)
        with open(f"{directory}/{name}.yaml", "w", encoding="utf-8") as file:
            file.write(text)
    for path in BESIDE:
        shutil.copy(path, directory)


class Run:
    """One run: what telemetry and report say of it."""

    def __init__(self, slew, directory, row, at, number):
        _, rig, script, *_ = row
        base = os.path.join(directory, str(number))
        with open(base + ".yaml", "w", encoding="utf-8") as file:
            file.write(f"faults: [{{{script}, at: {at}}}]\n")
        path = RIGS[rig][0]
        rig_path = f"{directory}/{rig}.yaml" \
            if rig in ("dolly", "tcp", *MONITORED) else f"{path}/rig.yaml"
        done = subprocess.run(
            [slew, "run", "--json", "--faults", base + ".yaml", "--telemetry",
             base + ".csv", rig_path, f"{path}/move.yaml"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            check=False)
        try:
            self.report = json.loads(done.stdout)
        except ValueError:
            sys.exit(f"{script}: {done.stderr}")
        self.tick_ns = RIGS[rig][1] * 1000000
        self.begun_ns = round(self.report["faults"][0]["t_s"] * 1e9)
        with open(base + ".csv", encoding="utf-8") as file:
            names = next(file).rstrip("\n").split(",")
            self.rows = [dict(zip(names, line.split(","))) for line in file
                         if 0 <= int(line[:line.index(",")]) - self.begun_ns
                         < SEEN_NS]
        os.unlink(base + ".csv")

    def blamed(self):
        fault = self.report.get("fault")
        return (fault["what"], fault["axis"]) if fault else ("", "")

    def after(self):
        """Rows that can see the fault, each with the one before it."""
        for before, row in zip(self.rows, self.rows[1:]):
            if int(row["t_ns"]) > self.begun_ns:
                yield before, row

    def reaction(self):
        """STOP, OFF or none, and the time of its first tick."""
        for before, row in self.after():
            state = row["state"]
            slows = (before["phase"] == row["phase"] == "move" and
                     float(row["path_ns"]) - float(before["path_ns"]) <
                     self.tick_ns - 0.001)
            if row["phase"] in ("settle", "stop") and state == "ready":
                return "none", None
            if state in ("holding", "stopping", "fault") or slows:
                return self.kind(int(row["t_ns"])), int(row["t_ns"])
        return "none", None

    def kind(self, from_ns):
        """Torque goes at once, or as with bus-off a few ticks after it has
        begun to stop."""
        states = [row["state"] for row in self.rows
                  if from_ns <= int(row["t_ns"]) <= from_ns + 20 * self.tick_ns]
        if "fault" in states and states.index("fault") < 5:
            return "OFF"
        return "STOP"

    def error_ns(self, axis, rig):
        """When the error of following was first above its limit."""
        floor, k_s, unit = rig
        for _, row in self.after():
            most = max(floor,
                       k_s * abs(float(row[f"{axis}.demand_{unit}_s"])))
            if abs(float(row[f"{axis}.following_{unit}"])) > most:
                return int(row["t_ns"])
        return self.begun_ns

    def resumes(self, from_ns):
        """Path time that goes on after it has stood."""
        stood = False
        for before, row in self.after():
            if int(row["t_ns"]) <= from_ns or row["phase"] != "move":
                continue
            grows = float(row["path_ns"]) > float(before["path_ns"])
            if stood and grows:
                return True
            stood = stood or not grows
        return False


def following_limit(path, axis):
    """Floor, time in s and unit of an axis."""
    with open(f"{path}/rig.yaml", encoding="utf-8") as file:
        spec = yaml.safe_load(file)["axes"][axis]
    limit = spec["following_error"]
    return (float(limit["floor"].split()[0]),
            float(limit["time"].split()[0]) / 1000, spec["unit"])


def unreachable(path, script):
    """Axes whose drive does not hear us in the end, or is not heard, or runs
    away: its fault reaction, which takes no order, ends at rest only."""
    word = dict(part.split(": ") for part in script.split(", "))
    if "for" in word:
        return set()
    with open(path, encoding="utf-8") as file:
        axes = yaml.safe_load(file)["axes"]
    if word["fault"] in ("cut_cable", "bus_off", "interface_down", "babble",
                         "noise", "bus_errors", "heartbeat_lost", "runaway",
                         "loss", "echo", "collision", "turn_around",
                         "hang_up"):
        return {name for name, axis in axes.items()
                if name == word.get("axis") or
                axis["drive"]["bus"] == word.get("bus")}
    # a Modbus drive without its supply or with wrong answers is as good as cut
    return {name for name, axis in axes.items()
            if axis["drive"]["kind"] == "modbus" and name == word.get("axis") and
            word["fault"] in ("slow_drive", "wrong_answer", "reboot",
                              "brown_out")}


def any_of(wanted):
    return wanted if isinstance(wanted, tuple) else (wanted,)


def bound_of(row):
    """From the fault, or from an error above its limit."""
    return row[7] if row[6] == "error" else row[6] + row[7]


def judge(slew, directory, row, at, number):
    """What was seen, the time in ms, and what is wrong."""
    name, rig, _, what, axis, reaction, wait, _ = row
    run = Run(slew, directory, row, at, number)
    blamed, of = run.blamed()
    seen, react_ns = run.reaction()
    wrong = []
    if what is not None and not any(
            w in blamed if w else not blamed for w in any_of(what)):
        wrong.append(f"blamed on: {blamed or 'nothing'}")
    if name == "CAN warning" and not any(
            "error_warning" in bus for bus in run.report["buses"]):
        wrong.append("not in the report")
    if axis is not None and of not in any_of(axis):
        wrong.append(f"blamed on {of or 'no axis'}")
    if seen not in any_of(reaction):
        wrong.append(f"reaction {seen}")
    left = [item["axis"] for item in run.report["torque_not_confirmed_off"]]
    left = set(left) - unreachable(f"{RIGS[rig][0]}/rig.yaml", row[2])
    if left:
        wrong.append(f"torque left on {', '.join(sorted(left))}")
    if seen == "none":
        if run.report["end"] != "done":
            wrong.append(f"ended: {run.report['end']}")
        return name, "-", seen, None, wrong
    from_ns = run.begun_ns
    if wait == "error":
        from_ns = run.error_ns(axis, following_limit(RIGS[rig][0], axis))
    if run.resumes(react_ns):
        wrong.append("went on by itself")
    after_ms = (react_ns - from_ns) / 1e6
    if after_ms > bound_of(row) + 1e-6:
        wrong.append("late")
    return name, f"{of}: {blamed}", seen, after_ms, wrong


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    slew, failed = sys.argv[1], 0
    with tempfile.TemporaryDirectory() as directory, \
            concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        with open("examples/dolly/rig.yaml", encoding="utf-8") as file:
            text = file.read()
        with open(f"{directory}/dolly.yaml", "w", encoding="utf-8") as file:
            file.write(text + GPIO)
        tcp_rig(directory)
        monitored_rigs(directory)
        jobs = [[pool.submit(judge, slew, directory, row, at, f"{n}-{i}")
                 for i, at in enumerate(RIGS[row[1]][2])]
                for n, row in enumerate(ROWS)]
        print(f"{'fault':41} {'detected as':57} {'reaction':8} "
              f"{'worst':>8} {'bound':>8}  from")
        for row, three in zip(ROWS, jobs):
            done = [job.result() for job in three]
            times = [one[3] for one in done if one[3] is not None]
            wrong = sorted({w for one in done for w in one[4]})
            seen = "/".join(dict.fromkeys(one[2] for one in done))
            since = "the error" if row[6] == "error" else "the fault"
            print(f"{row[0]:41} {done[0][1]:57.57} {seen:8} "
                  + (f"{max(times):5.0f} ms {bound_of(row):5.0f} ms  {since}"
                     if times else f"{'-':>8} {'-':>8}  -")
                  + (f"  WRONG: {', '.join(wrong)}" if wrong else ""))
            failed += bool(wrong)
    for name, where in ELSEWHERE:
        print(f"{name:41} measured by: {where}")
    print(f"faults: {len(ROWS)} rows, each while speeding up, going and slowing "
          f"down; {failed} outside")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
