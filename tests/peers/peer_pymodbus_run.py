"""pymodbus as a servo: `slew run --real` as a whole, RTU over pseudo-terminals
and TCP, streamed and from key to key.  The servo is written here, from the
registers of a Leadshine EL7-RS alone; what it has done is held against the keys
and against the report."""
import json
import math
import os
import subprocess
import sys
import tempfile
import threading
import time

from pymodbus.datastore import ModbusServerContext, ModbusSlaveContext
from pymodbus.server import StartSerialServer, StartTcpServer
from pymodbus.transaction import ModbusRtuFramer

from terminals import terminals

UNIT = 3
PORT = 15022
COUNTS = 1000  # per degree
REVOLUTION = 10000  # counts
START = 2000
KEYS = [(0, 2), (2, 12), (4, 32), (6, 2)]  # s, deg

MODE, SRV_ON, ALARM, STATE, TRIGGER, POSITION, PATH0 = (
    0x0003, 0x0401, 0x0B03, 0x0B05, 0x6002, 0x602C, 0x6200)
KNOWN = ([MODE, SRV_ON, ALARM, 0x0B04, STATE, 0x1801, TRIGGER,
          POSITION, POSITION + 1] + list(range(PATH0, PATH0 + 8)))
TAKES_OVER = 0x0011  # and absolute


class Servo(ModbusSlaveContext):
    """A trapezoid towards the target that was written last."""

    def __init__(self):
        super().__init__(zero_mode=True)
        self.lock = threading.Lock()
        self.words = {at: 0 for at in KNOWN}
        self.words[MODE] = 6
        self.at, self.speed, self.target = float(START), 0.0, float(START)
        self.most, self.up, self.down = 1000.0, 1e5, 1e5
        self.on = False
        self.since = time.monotonic()
        self.goals, self.stood = [], []

    # -- motion, up to now, in steps of a millisecond --

    def step(self, dt):
        distance = self.target - self.at
        if distance == 0 and self.speed == 0:
            return
        want = math.copysign(min(self.most, math.sqrt(2 * self.down *
                                                      abs(distance))), distance)
        faster = abs(want) > abs(self.speed) and want * self.speed >= 0
        most = (self.up if faster else self.down) * dt
        self.speed += max(-most, min(most, want - self.speed))
        self.at += self.speed * dt
        if abs(self.target - self.at) <= abs(self.speed) * dt + 1 and \
                abs(self.speed) <= 2 * self.down * dt + 1:
            self.at, self.speed = self.target, 0.0
            self.stood.append(self.at)

    def go_on(self):
        now = time.monotonic()
        while self.since + 0.001 <= now:
            if self.on:
                self.step(0.001)
            self.since += 0.001

    # -- registers --

    def show(self):
        moves = self.at != self.target or self.speed != 0
        self.words[STATE] = (0x01 | 0x02 * moves |
                             0x10 * (not moves)) if self.on else 0x10
        counts = round(self.at) & 0xFFFFFFFF
        self.words[POSITION] = counts >> 16
        self.words[POSITION + 1] = counts & 0xFFFF

    def take_path(self):
        mode, high, low, rpm, up, down, _, go = (
            self.words[PATH0 + i] for i in range(8))
        if go != 0x10 or not self.on:
            return
        if mode != TAKES_OVER and self.at != self.target:
            return  # a path that does not take over waits for no other
        target = high << 16 | low
        target -= (target & 0x80000000) << 1
        ramp = 1000 / 60 * REVOLUTION * 1000  # of 1 ms per 1000 rpm
        self.target = float(target)
        self.most = rpm / 60 * REVOLUTION
        self.up, self.down = ramp / up, ramp / down
        self.goals.append(target)

    def validate(self, fc_as_hex, address, count=1):
        return all(at in self.words for at in range(address, address + count))

    def getValues(self, fc_as_hex, address, count=1):
        with self.lock:
            self.go_on()
            self.show()
            return [self.words[at] for at in range(address, address + count)]

    def setValues(self, fc_as_hex, address, values):
        with self.lock:
            self.go_on()
            for i, value in enumerate(values):
                self.words[address + i] = value
            if address == SRV_ON:
                self.on = values[0] == 0x83
            if address == TRIGGER and values[0] == 0x40:
                self.target = self.at
                self.speed = 0.0
            if address == PATH0:
                self.take_path()


class Line:
    """A pymodbus server; its servo is another one for every run."""

    def __init__(self, target, **arguments):
        self.store = ModbusServerContext(slaves={UNIT: Servo()}, single=False)
        threading.Thread(target=target, daemon=True, kwargs={
            "context": self.store, **arguments}).start()

    def servo(self):
        self.store[UNIT] = Servo()
        return self.store[UNIT]


RIG = """tick: 20 ms
buses:
  line: %s
axes:
  pan:
    unit: deg
    limits: {position: [-90 deg, 90 deg], velocity: 40 deg/s, acceleration: 100 deg/s2}
    following_error: {floor: %s}
    drive: {kind: modbus, bus: line, node: 3, map: leadshine-el7,
            counts: 360000 per rev, unsupervised: yes%s}
"""
RTU = ("{kind: modbus-rtu, device: %s, baud: 115200, parity: none, "
       "stop_bits: 2, timeout: 500 ms}")
TCP = "{kind: modbus-tcp, host: 127.0.0.1, port: %d, timeout: 500 ms}" % PORT
# A shared machine may pause for 100 ms and more: 40 deg/s then are 4 deg.
MODES = {
    "streamed": ("20 deg", ""),
    "point-to-point": ("0.1 deg", ", mode: point-to-point, late: 5 s"),
}


def write_files(where, bus, mode):
    floor, rest = MODES[mode]
    with open(os.path.join(where, "rig.yaml"), "w") as file:
        file.write(RIG % (bus, floor, rest))
    keys = ", ".join("[%d s, %d deg]" % key for key in KEYS)
    with open(os.path.join(where, "move.yaml"), "w") as file:
        file.write("axes: {pan: {curve: s-curve, keys: [%s]}}\n" % keys)


def judge(servo, mode, report):
    """What is wrong, as a sentence, or None."""
    if report.get("end") != "done":
        return "ended with " + json.dumps(report.get("fault", report))
    axis = report["axes"][0]
    if abs(servo.at - KEYS[-1][1] * COUNTS) > 20:
        return "the servo stands at %.0f counts" % servo.at
    if servo.on:
        return "the servo still has torque"
    if mode == "streamed":
        if len(servo.goals) < 60:
            return "%d set points" % len(servo.goals)
        return None
    want = [place * COUNTS for _, place in KEYS[1:]]
    if servo.goals != want:
        return "goals %s, expected %s" % (servo.goals, want)
    if [round(place) for place in servo.stood] != want:
        return "stood at %s, expected %s" % (servo.stood, want)
    keys = [key["key"] for key in axis["keys"] if key["reached"]]
    if keys != [2, 3, 4]:
        return "keys %s reached, expected 2, 3, 4" % keys
    return None


def one(line, bus, mode, what):
    servo = line.servo()
    with tempfile.TemporaryDirectory() as where:
        write_files(where, bus, mode)
        done = subprocess.run(
            [os.environ["SLEW"], "run", "--real", "--yes", "--json", where],
            capture_output=True, text=True, timeout=90)
    try:
        report = json.loads(done.stdout)
    except ValueError:
        report = {"end": done.stdout + done.stderr}
    wrong = judge(servo, mode, report)
    if wrong is None:
        print("  %s, %s: %d goals, at the last key" %
              (what, mode, len(servo.goals)))
    else:
        print("  %s, %s: %s" % (what, mode, wrong))
    return wrong is not None


def main():
    left, right = terminals()
    rtu = Line(StartSerialServer, port=left, baudrate=115200,
               framer=ModbusRtuFramer)
    tcp = Line(StartTcpServer, address=("127.0.0.1", PORT))
    time.sleep(1)
    bad = 0
    for mode in MODES:
        bad += one(rtu, RTU % right, mode, "RTU")
        bad += one(tcp, TCP, mode, "TCP")
    sys.stdout.flush()
    os._exit(bad != 0)


main()
