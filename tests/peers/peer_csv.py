"""Tables written by Python's csv module in the dialects of spreadsheets and data
frames, read by slew import: the same numbers at the same times on the right axes.

    CSV_FILES=300 CSV_SEED=1 peer_csv.py

Reads no clock."""
import csv
import io
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile

SLEW = os.environ["SLEW"]
FILES = int(os.environ.get("CSV_FILES", "300"))
SEED = int(os.environ.get("CSV_SEED", "1"))
FPS = 25

AXES = {"pan": "deg", "dolly": "mm", "crane_arm": "mm", "focus": "rev"}
RIG = "axes:\n" + "".join(
    f"""\
  {name}:
    unit: {unit}
    limits: {{position: [-1000000, 1000000], velocity: 1e8, acceleration: 1e9}}
    following_error: {{floor: 1}}
    drive: {{kind: virtual}}
""" for name, unit in AXES.items())

# How many of the unit are one of the axis's own.
UNITS = {"deg": {"deg": 1, "rad": 3.14159265358979324 / 180, "rev": 1 / 360},
         "mm": {"mm": 1, "m": 1e-3, "cm": 0.1},
         "rev": {"rev": 1, "deg": 360}}


def number(value, comma):
    text = repr(round(value, 6))
    if "e" in text:
        text = "%.9f" % value
    return text.replace(".", ",") if comma else text


def name_of(rng, axis, unit):
    return rng.choice((axis, axis.upper(), axis.title())) if unit is None else \
        rng.choice(("%s_%s", "%s (%s)", "%s [%s]")) % (axis, unit)


class Table:
    """Columns as somebody's program has them, and what they mean."""

    def __init__(self, rng):
        self.rng = rng
        self.count = rng.randint(3, 12)
        self.axes = rng.sample(list(AXES), rng.randint(1, len(AXES)))
        self.time = rng.choice(("frame", "t", "time_s", "time (ms)", "t_ns",
                                "timecode", None))
        self.first = rng.choice((0, 1, 1001))
        self.values = {axis: [round(rng.uniform(-500, 500), rng.randint(0, 6))
                              for _ in range(self.count)] for axis in self.axes}
        self.units = {axis: rng.choice([None, *UNITS[AXES[axis]]])
                      for axis in self.axes}
        self.others = rng.randint(0, 2)
        self.comma = rng.random() < 0.3

    def times(self, k):
        frame = self.first + k
        seconds = frame / FPS
        return {"frame": str(frame), None: None,
                "t": number(seconds, self.comma),
                "time_s": number(seconds, self.comma),
                "time (ms)": number(1000 * seconds, self.comma),
                "t_ns": str(round(1e9 * seconds)),
                "timecode": "%02d:%02d:%02d:%02d" % (
                    frame // (FPS * 3600), frame // (FPS * 60) % 60,
                    frame // FPS % 60, frame % FPS)}[self.time]

    def columns(self):
        """(name, what --columns says, cells) of each, in a random order."""
        rng = self.rng
        out = []
        for axis in self.axes:
            unit = self.units[axis]
            factor = 1 if unit is None else UNITS[AXES[axis]][unit]
            cells = [value * factor for value in self.values[axis]]
            if factor != 1:
                cells = [("%.15g" % c).replace(".", "," if self.comma else ".")
                         if "e" not in "%.15g" % c else
                         ("%.15f" % c).replace(".", "," if self.comma else ".")
                         for c in cells]
            else:
                cells = [number(c, self.comma) for c in cells]
            out.append((name_of(rng, axis, unit), axis if unit is None else
                        "%s_%s" % (axis, unit), cells))
        for i in range(self.others):
            out.append((rng.choice(("note", "speed, set", 'a "b"')) + str(i), "-",
                        [rng.choice(("x", "", "1;2", "a, b"))
                         for _ in range(self.count)]))
        if self.time is not None:
            out.append((self.time, rng.choice(("-", self.time)),
                        [self.times(k) for k in range(self.count)]))
        rng.shuffle(out)
        return out


def write(rng, table, columns):
    """The bytes of the file."""
    delimiter = rng.choice((";", "\t") if table.comma else (",", ";", "\t"))
    quoting = rng.choice((csv.QUOTE_MINIMAL, csv.QUOTE_ALL,
                          csv.QUOTE_NONNUMERIC))
    if table.comma and rng.random() < 0.3:
        delimiter, quoting = ",", csv.QUOTE_ALL
    text = io.StringIO()
    if rng.random() < 0.15:
        text.write("sep=%s\r\n" % delimiter)
    writer = csv.writer(text, delimiter=delimiter, quoting=quoting,
                        lineterminator=rng.choice(("\r\n", "\n")))
    trailing = [""] * rng.choice((0, 0, 0, 2))
    writer.writerow([name for name, _, _ in columns] + trailing)
    for k in range(table.count):
        writer.writerow([cells[k] for _, _, cells in columns] + trailing)
        if rng.random() < 0.05:
            text.write(delimiter * (len(columns) - 1) + "\r\n")
    return text.getvalue().encode(rng.choice(("utf-8", "utf-8-sig", "utf-16")))


def read_back(path):
    """{axis: [(frame, position)]} of a move file."""
    axes, axis = {}, None
    for line in path.read_text().splitlines():
        if match := re.match(r"  (\w+):$", line):
            axis = axes.setdefault(match[1], [])
        elif match := re.match(r"      - \[(.*?) ?(s?), ([^,\]]*)", line):
            time = match[1]
            axis.append((float(time[6:]) if time.startswith("frame")
                         else FPS * float(time), float(match[3])))
    return axes


def judge(table, got):
    if set(got) != set(table.axes):
        return "axes %s, expected %s" % (sorted(got), sorted(table.axes))
    for axis in table.axes:
        want = [(k, value) for k, value in enumerate(table.values[axis])]
        for (frame, position), (k, value) in zip(got[axis], want, strict=True):
            if abs(frame - k) > 1e-6 or abs(position - value) > 2e-9:
                return "%s: %g at %g, expected %g at %d" % (
                    axis, position, frame, value, k)
    return None


def main():
    rng = random.Random(SEED)
    bad = 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "rig.yaml").write_text(RIG)
        for i in range(FILES):
            table = Table(rng)
            columns = table.columns()
            data = write(rng, table, columns)
            path = folder / "t.csv"
            path.write_bytes(data)
            words = [SLEW, "import", "csv", path, "--rig", folder / "rig.yaml",
                     "--fps", str(FPS), "--out", folder / "m.yaml"]
            if table.comma:
                words += ["--decimal", "comma"]
            if table.others or rng.random() < 0.5:
                said = [said for _, said, _ in columns]
                trailing = data.decode("utf-16" if data[:2] in (
                    b"\xff\xfe", b"\xfe\xff") else "utf-8-sig").splitlines()
                head = trailing[1 if trailing[0].startswith("sep=") else 0]
                said += ["-"] * (2 if head.endswith((",", ";", "\t", '""'))
                                 else 0)
                words += ["--columns", ",".join(said)]
            done = subprocess.run(words, capture_output=True)
            wrong = (done.stderr.decode() if done.returncode else
                     judge(table, read_back(folder / "m.yaml")))
            if wrong:
                bad += 1
                keep = pathlib.Path(os.environ["PEERS"]) / ("csv-%d.csv" % i)
                keep.write_bytes(data)
                print(keep, words[9:], wrong)
    print("seed %d: %d tables, %d read otherwise" % (SEED, FILES, bad))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
