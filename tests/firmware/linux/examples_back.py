#!/usr/bin/env python3
"""tests/firmware/linux/examples_back.py SLEW [FPS] - every example through every
format and back.

A row per example: `ok` where what is read again is inside the limits of its rig
by slew check, `(ok)` where slew export or slew import has said what the format
cannot hold; `curve` where it is with a --curve that slew import has offered, `fit`
where slew fit then made it so.  Anything else fails.
"""
import json
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

FORMATS = ("kuper", "flair", "raw", "csv", "maya", "blender", "ros-yaml", "ros-json")


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    return done.returncode, done.stdout, done.stderr


def report(text):
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return {}


def back(slew, example, name, fps, folder):
    """What stands in the table, what was said, and whether it fails."""
    rig = str(example / "rig.yaml")
    out, move = str(folder / "out"), str(folder / "move.yaml")
    code, said, error = run(slew, "export", name, str(example), "--fps", fps, "--out", out, "--json")
    if code == 2:
        return "refused", [error.strip()], False
    if code != 0:
        return "FAILS", [error.strip()], True
    wrote = report(said)
    lost = list(wrote.get("lost", []))
    code, said, error = run(slew, "import", name, out, "--rig", rig, "--out", move, "--json",
                            *shlex.split(wrote.get("import_options", "")))
    if code != 0:
        return "FAILS", [error.strip()], True
    read = report(said)
    lost += [read["lost"]] if read.get("lost") else []
    lost += [row["note"] for row in read.get("curves", []) if row["note"]]
    code, said, error = run(slew, "check", rig, move)
    if code == 0:
        return ("(ok)" if lost else "ok"), lost, False
    for curve in sorted(set(re.findall(r"--curve (\S+) would pass", " ".join(lost)))):
        if run(slew, "import", name, out, "--rig", rig, "--out", move, "--curve", curve,
               *shlex.split(wrote.get("import_options", "")))[0] == 0:
            if run(slew, "check", rig, move)[0] == 0:
                return "curve", lost, False
    if any("slew fit cures" in text for text in lost):
        fitted = str(folder / "fitted.yaml")
        if run(slew, "fit", rig, move, "--output", fitted)[0] == 0:
            if run(slew, "check", rig, fitted)[0] == 0:
                return "fit", lost, False
    return "FAILS", lost + [(error or said).strip().splitlines()[0]], True


def main():
    slew = str(Path(sys.argv[1]).resolve())
    fps = sys.argv[2] if len(sys.argv) > 2 else "25"
    notes, failed = {}, 0
    print(f"{'example':12}" + "".join(f"{name:>10}" for name in FORMATS))
    for rig in sorted(Path("examples").glob("*/rig.yaml")):
        example = rig.parent
        if not (example / "move.yaml").exists():
            continue
        row = f"{example.name:12}"
        for name in FORMATS:
            with tempfile.TemporaryDirectory() as folder:
                cell, said, fails = back(slew, example, name, fps, Path(folder))
            row += f"{cell:>10}"
            failed += fails
            for text in said:
                notes.setdefault((example.name, text), []).append(name)
        print(row, flush=True)
    print()
    for (example, text), names in notes.items():
        print(f"{example}, {' '.join(names)}: {text}")
    return failed > 0


if __name__ == "__main__":
    sys.exit(main())
