#!/bin/sh
# tests/firmware/linux/fault_times.sh - when a fault was seen, and when all had stopped
# after it, is the same in telemetry, in what a run says, in its JSON and in slew report;
# and so is the code of a drive, which those behind a node of two axes are asked for.
#
# RUNS=200 for more; SEED for others.
set -eu
slew=${SLEW:-build/slew}
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT

cat >"$dir/rig.yaml" <<'END'
buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}
axes:
  x:
    unit: mm
    limits: {position: [0 mm, 2000 mm], velocity: 800 mm/s, acceleration: 2000 mm/s2, jerk: 20000 mm/s3}
    following_error: {floor: 5 mm}
    drive: {kind: cia402, bus: can0, node: 1, counts: 1000 per mm}
    sim: {start: 100 mm}
  z:
    unit: mm
    limits: {position: [0 mm, 500 mm], velocity: 300 mm/s, acceleration: 1500 mm/s2, jerk: 15000 mm/s3}
    following_error: {floor: 3 mm}
    drive: {kind: cia402, bus: can0, node: 2, counts: 1000 per mm}
  y:
    unit: mm
    limits: {position: [0 mm, 500 mm], velocity: 300 mm/s, acceleration: 1500 mm/s2, jerk: 15000 mm/s3}
    following_error: {floor: 3 mm}
    drive: {kind: cia402, bus: can0, node: 2, axis: 2, counts: 1000 per mm, pdo: {rx: 0x405, tx: 0x385}}
END
cat >"$dir/move.yaml" <<'END'
axes:
  x: {curve: s-curve, keys: [[0 s, 100 mm], [2 s, 900 mm], [4 s, 100 mm]]}
  z: {curve: s-curve, keys: [[0 s, 0 mm], [1 s, 60 mm], [3 s, 0 mm]]}
  y: {curve: s-curve, keys: [[0 s, 0 mm], [1 s, 60 mm], [3 s, 0 mm]]}
END

python3 - "$slew" "$dir" "${RUNS:-12}" "${SEED:-1}" <<'END'
import csv, json, os, random, re, subprocess, sys

slew, where, runs, seed = sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
draw = random.Random(seed)
entries = ("fault: drive_fault, code: 0x3210", "fault: obstacle, for: 1 s",
           "fault: encoder_jump, by: 40 mm", "fault: reboot", "fault: cut_cable")


def times(rows):
    """When the first row says that it stops, and when all stand: the first that is in
    fault, or the last in which an axis is further than its floor from where it was."""
    seen = next(row for row in rows if row["state"] in ("stopping", "fault"))
    stopped = int(next(row for row in rows if row["state"] == "fault")["t_ns"])
    moves = False
    for axis, floor in (("x", 5), ("z", 3)):
        moves |= abs(float(rows[-1][f"{axis}.actual_mm_s"])) > 10 * floor
        still = float(rows[0][f"{axis}.actual_mm"])
        for row in rows:  # an axis without torque runs out by itself
            at = float(row[f"{axis}.actual_mm"])
            if abs(at - still) > floor:
                still, stopped = at, max(stopped, int(row["t_ns"]))
    return int(seen["t_ns"]) / 1e9, None if moves else stopped / 1e9


def run(number):
    entry = entries[number % len(entries)]
    axis = f"axis: {draw.choice('xyz')}, "
    at = draw.randint(100, 2900)
    files = {name: f"{where}/{name}" for name in ("rig.yaml", "move.yaml", "f.yaml",
                                                  "t.csv", "r.mcap")}
    with open(files["f.yaml"], "w") as file:
        file.write(f"faults: [{{{entry}, {axis}at: {at} ms}}]\n")
    for name in ("t.csv", "r.mcap"):
        if os.path.exists(files[name]):
            os.remove(files[name])
    done = subprocess.run(
        [slew, "run", "--json", "--telemetry", files["t.csv"], "--record",
         files["r.mcap"], "--faults", files["f.yaml"], files["rig.yaml"],
         files["move.yaml"]], capture_output=True, text=True)
    what = f"SEED={seed}, run {number}: {entry}, {axis}at {at} ms"
    report = json.loads(done.stdout)
    if report["end"] != "stopped by a fault":
        return 0
    with open(files["t.csv"]) as file:
        seen, stopped = times(list(csv.DictReader(file)))
    fault = report["fault"]
    if report["torque_not_confirmed_off"]:
        stopped = None  # it does not say where it is, either
    assert (fault["t_s"], fault.get("stopped_t_s")) == (seen, stopped), \
        (what, fault, seen, stopped)
    said = subprocess.run([slew, "report", "--json", files["r.mcap"]],
                          capture_output=True, text=True, check=True).stdout
    notes = json.loads(said)["notes"]
    assert notes == sorted(notes, key=lambda note: note["t_s"]), (what, notes)
    notes = [note for note in notes if note["level"] == "fault"]
    assert len(notes) == 1 and notes[0]["t_s"] == seen, (what, notes, seen)
    if "drive_fault" in entry:
        assert fault["drive_code"] == 0x3210, (what, fault)
        for text in (fault["reason"], notes[0]["text"], json.loads(said)["reason"]):
            assert "drive fault 0x3210: " in text, (what, text)
    if "value" in fault:
        number = r"\(([-0-9.e]+) \S+, limit ([-0-9.e]+)"
        value, limit = re.search(number, notes[0]["text"]).groups()
        assert abs(float(value) / fault["value"] - 1) < 1e-3, (what, notes, fault)
        assert abs(float(limit) / fault["limit"] - 1) < 1e-3, (what, notes, fault)
    return 1


def runs_out(at):
    """What is left to itself is not said to have stopped before it has.  True: it has."""
    with open(f"{where}/f.yaml", "w") as file:
        file.write(f"faults: [{{fault: interface_down, bus: can0, at: {at}, for: 50 ms}}]\n")
    command = [slew, "run", "--telemetry", f"{where}/t.csv", "--faults", f"{where}/f.yaml",
               f"{where}/rig.yaml", f"{where}/move.yaml"]
    said = subprocess.run(command, capture_output=True, text=True).stdout
    report = json.loads(subprocess.run([*command[:2], "--json", *command[2:]],
                                       capture_output=True, text=True).stdout)
    with open(f"{where}/t.csv") as file:
        seen, stopped = times(list(csv.DictReader(file)))
    assert report["fault"]["t_s"] == seen, (report["fault"], seen)
    assert report["fault"].get("stopped_t_s") == stopped, (report["fault"], stopped)
    assert stopped is None or stopped > seen + 0.05, (seen, stopped)
    assert f"seen after {seen:.3f} s of the run" in said, said
    assert (f", all stopped after {stopped or 0:.3f} s" in said) == (stopped is not None), said
    return stopped is not None


assert runs_out("1.85 s")
assert not runs_out("1 s")  # the run ends before
faults = sum(run(number) for number in range(runs))
print(f"{faults} faults in {runs} runs")
assert faults > runs // 2
END
