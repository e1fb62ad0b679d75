"""FMPy takes the units of slew sim export: it validates their description and
runs them with steps of 0.1 to 10 ms.  Reads no clock.

    SLEW=build/slew PEERS=build/peers python tests/peers/peer_fmu.py

The direct simulation is slew run, whose telemetry has what was demanded of every
drive at every tick, and what it reported.  The same demands into the unit must
give the same positions, to the bit.  Longer steps carry a set point on by its
velocity and acceleration, so there the set points are parabolas.
"""

import csv
import os
import subprocess
import sys

import numpy as np
from fmpy import read_model_description, extract
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

SLEW = os.environ["SLEW"]
DIR = os.path.join(os.environ["PEERS"], "fmu")
HALF_A_DIGIT = 0.501e-7  # telemetry has seven decimals of a position
STEPS_MS = 0.1, 0.25, 0.5, 1, 2, 5, 10
failed = 0


def claim(text, good):
    global failed
    failed += not good
    print(f"  {text}: {'yes' if good else 'NO'}")


class Unit:
    """An instance of a unit that has been exported and unpacked."""

    def __init__(self, path):
        self.about = read_model_description(path, validate=False)
        self.of = {v.name: v.valueReference for v in self.about.modelVariables}
        two = self.about.fmiVersion.startswith("2")
        kind = FMU2Slave if two else FMU3Slave
        self.fmu = kind(
            guid=self.about.guid, unzipDirectory=extract(path),
            modelIdentifier=self.about.coSimulation.modelIdentifier,
            instanceName="unit")
        self.fmu.instantiate()
        self.two = two
        self.now = 0.0

    def start(self, **parameters):
        if self.two:
            self.fmu.setupExperiment(startTime=0.0)
        for name, value in parameters.items():
            self.set(name.replace("__", "."), value)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def set_all(self, references, values):
        real = self.fmu.setReal if self.two else self.fmu.setFloat64
        real(references, values)

    def set(self, name, value):
        self.set_all([self.of[name]], [value])

    def get(self, name):
        real = self.fmu.getReal if self.two else self.fmu.getFloat64
        return real([self.of[name]])[0]

    def yes(self, name):
        return bool(self.fmu.getBoolean([self.of[name]])[0])

    def say(self, name, value):
        self.fmu.setBoolean([self.of[name]], [value])

    def step(self, until):
        self.fmu.doStep(currentCommunicationPoint=self.now,
                        communicationStepSize=until - self.now)
        self.now = until

    def keep(self):
        return (self.fmu.getFMUState if hasattr(self.fmu, "getFMUState")
                else self.fmu.getFMUstate)()

    def put_back(self, state, now):
        (self.fmu.setFMUState if hasattr(self.fmu, "setFMUState")
         else self.fmu.setFMUstate)(state)
        self.now = now

    def forget(self, state):
        (self.fmu.freeFMUState if hasattr(self.fmu, "freeFMUState")
         else self.fmu.freeFMUstate)(state)

    def written(self, state):
        return (self.fmu.serializeFMUState
                if hasattr(self.fmu, "serializeFMUState")
                else self.fmu.serializeFMUstate)(state)

    def read(self, written):
        for name in ("deserializeFMUState", "deSerializeFMUState",
                     "deSerializeFMUstate"):
            if hasattr(self.fmu, name):
                return getattr(self.fmu, name)(written)
        raise AttributeError("FMPy deserializes no state")

    def end(self):
        self.fmu.terminate()
        self.fmu.freeInstance()


def exported(rig, version):
    path = os.path.join(DIR, f"{os.path.basename(rig)}{version}.fmu")
    subprocess.run([SLEW, "sim", "export", "--fmi", str(version), "--out", path,
                    rig], check=True, stdout=subprocess.DEVNULL)
    return path


def recorded(move):
    """Telemetry from the tick on in which the drives are ready."""
    path = os.path.join(DIR, "run.csv")
    subprocess.run([SLEW, "run", "--telemetry", path, move], check=True,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    first = next(i for i, row in enumerate(rows) if row["state"] == "ready")
    last = next(i for i, row in enumerate(rows) if row["phase"] == "stop")
    return rows[first:last]


def columns(rows, axis, unit):
    demand = [f"{axis}.demand_{unit}{per}" for per in ("", "_s", "_s2")]
    return np.array([[float(row[name]) for name in demand] for row in rows])


def played(path, rows, axes, step_ms):
    """Positions that the unit reports at every tick, given those demands."""
    unit = Unit(path)
    unit.start()
    per_tick = round(1 / step_ms)
    demand = np.hstack([columns(rows, axis, u) for axis, u in axes.items()])
    inputs = [unit.of[f"{axis}.demand.{of}"] for axis in axes
              for of in ("position", "velocity", "acceleration")]
    seen = np.empty((len(rows), len(axes)))
    for tick in range(len(rows)):
        unit.set_all(inputs, list(demand[tick]))
        for part in range(per_tick):
            unit.step((tick * per_tick + part + 1) * step_ms * 1e-3)
        seen[tick] = [unit.get(f"{axis}.actual.position") for axis in axes]
    still = all(unit.yes(f"{axis}.enabled") for axis in axes)
    unit.end()
    return seen, still


def like_run(rig, axes, steps_ms):
    rows = recorded(rig)
    told = np.array([[float(row[f"{axis}.actual_{unit}"])
                      for axis, unit in axes.items()] for row in rows])
    for version in 2, 3:
        path = exported(rig, version)
        problems = validate_fmu(path)
        claim(f"{os.path.basename(rig)}: FMI {version}.0 is valid"
              f"{''.join(problems)}", not problems)
        for step_ms in steps_ms:
            seen, still = played(path, rows, axes, step_ms)
            off = np.abs(seen - told).max()
            claim(f"{os.path.basename(rig)}: FMI {version}.0, steps of "
                  f"{step_ms:g} ms: {len(rows)} ticks of {len(axes)} axes, "
                  f"largest difference from the 7 decimals of slew run {off:g}",
                  still and off < HALF_A_DIGIT)


def parabola(path, axis, step_ms, start):
    """Positions at every 10 ms of 1 s, of a set point with constant acceleration
    that turns round in the middle."""
    unit = Unit(path)
    unit.start()
    seen = []
    for k in range(round(1000 / step_ms)):
        t = k * step_ms * 1e-3
        first = t < 0.5 - 1e-9
        since = t if first else t - 0.5
        acc = 4.0 if first else -4.0
        vel = (0.0 if first else 2.0) + acc * since
        pos = start + (0.0 if first else 0.5) + (vel - acc * since / 2) * since
        for of, value in zip(("position", "velocity", "acceleration"),
                             (pos, vel, acc)):
            unit.set(f"{axis}.demand.{of}", value)
        unit.step((k + 1) * step_ms * 1e-3)
        if round((k + 1) * step_ms * 1000) % 10000 == 0:
            seen.append((unit.get(f"{axis}.actual.position"),
                         unit.get(f"{axis}.plant.position"),
                         unit.get(f"{axis}.actual.velocity")))
    unit.end()
    return np.array(seen)


def any_step(rig, axis, start):
    for version in 2, 3:
        path = exported(rig, version)
        runs = [parabola(path, axis, step_ms, start) for step_ms in STEPS_MS]
        same = all(len(run) == 100 and (run == runs[0]).all() for run in runs)
        claim(f"{os.path.basename(rig)}: FMI {version}.0: steps of "
              f"{', '.join(f'{s:g}' for s in STEPS_MS)} ms: the same numbers, "
              f"to {runs[0][-1][0]:.4f}", same)


def every_kind():
    """Drives on every kind of bus are enabled, and follow."""
    for name in "odrive", "modbus":
        path = exported(f"examples/{name}", 3)
        unit = Unit(path)
        unit.start()
        axes = sorted(v[:-len(".enabled")] for v in unit.of
                      if v.endswith(".enabled"))
        was = [unit.get(f"{axis}.plant.position") for axis in axes]
        for axis, pos in zip(axes, was):
            unit.set(f"{axis}.demand.position", pos)
        unit.step(0.05)
        for axis, pos in zip(axes, was):
            unit.set(f"{axis}.demand.position", pos + 0.02)
        unit.step(1.05)
        good = all(unit.yes(f"{axis}.enabled") and not unit.yes(f"{axis}.fault")
                   and abs(unit.get(f"{axis}.plant.position") - pos - 0.02)
                   < 0.01 for axis, pos in zip(axes, was))
        unit.end()
        claim(f"{name}: {', '.join(axes)} follow", good)


def ways(rig):
    """Parameters, a reset, torque, a set point that no drive takes."""
    path = exported(rig, 3)
    unit = Unit(path)
    unit.start(pan__start__position=5.0, pan__servo__bandwidth=20.0)
    claim("a parameter sets where it begins",
          abs(unit.get("pan.plant.position") - 5) < 1e-3)
    unit.set("pan.demand.position", 5.0)
    unit.step(0.1)
    unit.set("pan.demand.position", 5.5)
    unit.step(0.15)
    slow = unit.get("pan.plant.position")
    unit.fmu.reset()
    unit.now = 0.0
    unit.start(pan__start__position=5.0, pan__servo__bandwidth=200.0)
    unit.set("pan.demand.position", 5.0)
    unit.step(0.1)
    unit.set("pan.demand.position", 5.5)
    unit.step(0.15)
    claim("another sets how fast it follows",
          slow < unit.get("pan.plant.position") - 0.01)
    unit.say("enable", False)
    unit.step(0.4)
    off = not unit.yes("pan.enabled")
    unit.say("enable", True)
    unit.set("pan.demand.position", unit.get("pan.actual.position"))
    unit.step(2.4)
    claim("torque goes and comes", off and unit.yes("pan.enabled"))
    try:
        unit.set("pan.actual.position", 1.0)
        claim("an output is not set", False)
    except Exception:
        claim("an output is not set", True)
    unit.end()


def on(unit, axes, start, count, demand):
    """Steps of 3 ms from step `start` on; all that can be seen after each."""
    seen = []
    for k in range(start, start + count):
        for i, axis in enumerate(axes):
            for of, value in zip(("position", "velocity", "acceleration"),
                                 demand(i, k)):
                unit.set(f"{axis}.demand.{of}", value)
        unit.step((k + 1) * 3e-3)
        seen.append([unit.get(f"{axis}.{of}") for axis in axes
                     for of in ("actual.position", "actual.velocity",
                                "plant.position")] +
                    [unit.yes(f"{axis}.{of}") for axis in axes
                     for of in ("enabled", "fault")])
    return seen


def demands(begin, jumps_at):
    """A swing about where the axes begin; at one step a set point far away, at
    which drives go into fault."""
    def demand(i, k):
        far = 80.0 if k >= jumps_at else 0.0
        return begin[i] + 0.4 * np.sin(0.05 * k) + far, 0.0, 0.0
    return demand


def elsewhere(path, written, begin, jumps_at):
    """The rest of a run in another process, from a state that was written."""
    code = ("import sys; sys.path.insert(0, 'tests/peers'); import peer_fmu as p,"
            " numpy as np\n"
            "def nothing(*a): pass\n"
            f"unit = p.Unit({path!r})\n"
            "axes = sorted(n[:-8] for n in unit.of if n.endswith('.enabled'))\n"
            "state = unit.read(open(sys.argv[1], 'rb').read())\n"
            "unit.put_back(state, 300 * 3e-3)\n"
            f"seen = p.on(unit, axes, 300, 300, p.demands({begin!r}, {jumps_at}))\n"
            "np.save(sys.argv[2], np.array(seen, dtype=float))\n")
    state, seen = os.path.join(DIR, "state"), os.path.join(DIR, "seen.npy")
    with open(state, "wb") as file:
        file.write(written)
    subprocess.run([sys.executable, "-c", code, state, seen], check=True)
    return np.load(seen)


def kept(rig, version, jumps_at):
    """A state is kept after 300 steps; what follows is the same whenever and
    wherever it is put back."""
    path = exported(rig, version)
    unit, other = Unit(path), Unit(path)
    axes = sorted(n[:-8] for n in unit.of if n.endswith(".enabled"))
    unit.start()
    begin = [unit.get(f"{axis}.plant.position") for axis in axes]
    demand = demands(begin, jumps_at)
    on(unit, axes, 0, 300, demand)
    state = unit.keep()
    first = on(unit, axes, 300, 300, demand)
    faults = any(any(row[-2 * len(axes) + 1::2]) for row in first)
    unit.put_back(state, 300 * 3e-3)
    again = on(unit, axes, 300, 300, demand)
    # on beside the first one, which goes on itself
    written = bytes(unit.written(state))
    copy = other.read(written)
    other.put_back(copy, 300 * 3e-3)
    beside = []
    unit.put_back(state, 300 * 3e-3)
    mixed = []
    for k in range(300, 600):
        beside += on(other, axes, k, 1, demand)
        mixed += on(unit, axes, k, 1, demand)
    unit.fmu.reset()
    unit.put_back(state, 300 * 3e-3)
    after_reset = on(unit, axes, 300, 300, demand)
    far = elsewhere(path, written, begin, jumps_at)
    unit.forget(state)
    other.forget(copy)
    unit.end()
    other.end()
    name = (f"{os.path.basename(rig)}: FMI {version}.0"
            f"{', in a fault' if faults else ''}")
    claim(f"{name}: a state of {len(written)} bytes that is put back goes on the "
          f"same", again == first)
    claim(f"{name}: beside another instance with it, and after a reset",
          beside == first and mixed == first and after_reset == first)
    claim(f"{name}: in another process", (far == np.array(first, float)).all())
    claim(f"{name}: moves", first[0] != first[-1] and
          faults == (jumps_at < 600))


def states():
    for version in 2, 3:
        kept("tests/data/fmu", version, 1000)
        kept("examples/dolly", version, 400)
        kept("examples/dolly", version, 299)  # in the middle of it
    kept("examples/odrive", 3, 1000)
    kept("examples/modbus", 3, 400)
    path = exported("tests/data/fmu", 3)
    unit = Unit(path)
    unit.start()
    state = unit.keep()
    written = bytearray(unit.written(state))
    written[len(written) // 2] ^= 1
    try:
        unit.read(bytes(written))
        claim("bytes of no state are refused", False)
    except Exception:
        claim("bytes of no state are refused", True)
    unit.forget(state)
    unit.end()


def main():
    os.makedirs(DIR, exist_ok=True)
    like_run("examples/dolly", {"dolly": "mm", "focus": "deg", "pan": "deg",
                                "tilt": "deg"}, (1,))
    like_run("tests/data/fmu", {"pan": "deg"}, (0.1, 0.5, 1))
    any_step("tests/data/fmu", "pan", 0.0)
    ways("tests/data/fmu")
    every_kind()
    states()
    return failed > 0


if __name__ == "__main__":
    sys.exit(main())
