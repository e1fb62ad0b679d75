"""Data sheets made at random, valid by CiA 306 with its optional features and
with what makers write beside it, read by slew and by python-canopen.

    EDS_FILES=200 EDS_SEED=1 peer_eds.py

What python-canopen reads slew reads likewise, or warns of; what it refuses slew
reads or warns of.  No rig is refused for an object that it does not use.
Reads no clock."""
import json
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile

import canopen

SLEW = os.environ["SLEW"]
SHEET = os.path.join(os.environ["PEERS"], "sheet")
FILES = int(os.environ.get("EDS_FILES", "200"))
SEED = int(os.environ.get("EDS_SEED", "1"))
NODE = 5

INTEGERS = {1: (1, False), 2: (8, True), 3: (16, True), 4: (32, True),
            5: (8, False), 6: (16, False), 7: (32, False), 0x10: (24, True),
            0x12: (40, True), 0x13: (48, True), 0x14: (56, True),
            0x15: (64, True), 0x16: (24, False), 0x18: (40, False),
            0x19: (48, False), 0x1A: (56, False), 0x1B: (64, False)}
REAL = (8, 0x11)
OTHERS = (9, 0xA, 0xB, 0xF)


class Maker:
    """One file: sections as lists of lines, so that oddities find them."""

    def __init__(self, rng, base):
        self.rng = rng
        self.sections = [list(section) for section in base]
        self.used = {name for name, _ in base}
        self.eol = rng.choice(("\n", "\r\n"))
        self.bom = False
        self.encoding = "utf-8"

    def number(self, value, bits=32):
        """A number as people write it; a negative one perhaps as its bits."""
        rng = self.rng
        if value < 0 and rng.random() < 0.4:
            value += 1 << bits
        form = rng.choice(("%d", "0x%X", "0x%x", "0x%08X"))
        if value < 0:
            return "-" + form % -value if form != "0x%08X" else str(value)
        return form % value

    def index(self, low=0x2000, high=0x5FFF):
        while True:
            index = self.rng.randrange(low, high)
            if "%04X" % index not in self.used:
                self.used.add("%04X" % index)
                return index

    def value(self, kind):
        rng = self.rng
        if kind in INTEGERS:
            bits, signed = INTEGERS[kind]
            low = -(1 << bits - 1) if signed else 0
            high = (1 << bits - signed) - 1
            number = rng.choice((low, high, 0, rng.randint(low, high)))
            return self.number(number, bits)
        if kind in REAL:
            return rng.choice(("0", "1.5", "-2.25e3", "0.0"))
        return rng.choice(("text", "", "00 11", "a = b"))

    def variable(self, kind=None):
        """The keys of one object, in any order."""
        rng = self.rng
        kind = kind or rng.choice(list(INTEGERS) + list(REAL) + list(OTHERS))
        keys = ["ParameterName=" + rng.choice(("Thing", "A thing, with = in it",
                                               "X" * 90, "Grösse"))]
        if rng.random() < 0.8:
            keys.append("ObjectType=" + rng.choice(("7", "0x7", "0x07")))
        keys.append("DataType=" + rng.choice(("0x%04X", "%d", "0x%x")) % kind)
        keys.append("AccessType=" + rng.choice(("ro", "rw", "wo", "const",
                                                "rwr", "rww", "RO", "Rw")))
        if rng.random() < 0.8:
            keys.append("PDOMapping=" + rng.choice(("0", "1", "0x1", "0x0")))
        if rng.random() < 0.6:
            keys.append("DefaultValue=" + self.value(kind))
        if rng.random() < 0.15:
            keys.append("ParameterValue=" + self.value(kind))
        if rng.random() < 0.3 and kind in INTEGERS:
            keys.append("LowLimit=" + self.value(kind))
            keys.append("HighLimit=" + rng.choice(("", self.value(kind))))
        if rng.random() < 0.2:
            keys.append("ObjFlags=0x0")
        if rng.random() < 0.7:
            rng.shuffle(keys)
        return keys

    def node_value(self):
        base = self.rng.choice(("0x200", "0x180", "512"))
        return self.rng.choice(("$NODEID+" + base, base + "+$NODEID", "$NODEID",
                                "$NODEID + " + base, base + " + $NODEID",
                                "$nodeid+" + base))

    def add(self, name, lines):
        self.sections.append([name, lines])

    def some(self):
        rng = self.rng
        kind = rng.choice(("var", "var", "var", "record", "array", "compact",
                           "node", "own type"))
        index = self.index()
        name = "%04X" % index
        head = ["ParameterName=Head", "ObjectType=" +
                ("0x9" if kind == "record" else "0x8")]
        if kind == "var":
            self.add(name, self.variable())
        elif kind == "node":
            lines = [k for k in self.variable(7)
                     if not k.startswith(("DefaultValue", "ParameterValue"))]
            self.add(name, lines + ["DefaultValue=" + self.node_value()])
        elif kind == "own type":
            own = "%X" % (0xA0 + len(self.sections))
            self.add(own, ["ParameterName=Type", "ObjectType=6"])
            self.add(own + "sub1", ["ParameterName=T", "DataType=0x5",
                                    "AccessType=ro", "DefaultValue=0x6"])
            lines = [k for k in self.variable(6) if not k.startswith("DataType")]
            self.add(name, lines + ["DataType=0x" + own])
        elif kind == "compact":
            count = rng.randint(1, 6)
            lines = [k for k in self.variable() if not
                     k.startswith(("ObjectType", "ParameterValue"))]
            lines += ["ObjectType=8", "CompactSubObj=%d" % count]
            rng.shuffle(lines)
            self.add(name, lines)
            if rng.random() < 0.5:
                self.add(name + "Name", ["NrOfEntries=%d" % count] +
                         ["%d=Named %d" % (i, i) for i in range(1, count + 1)])
        else:
            count = rng.randint(1, 4)
            self.add(name, head + ["SubNumber=%d" % (count + 1)])
            self.add(name + "sub0", ["ParameterName=Highest", "ObjectType=7",
                     "DataType=5", "AccessType=ro", "DefaultValue=%d" % count,
                     "PDOMapping=0"])
            for sub in range(1, count + 1):
                self.add(name + rng.choice(("sub%X", "Sub%X", "sub%x")) % sub,
                         self.variable())

    # --- what makers write ---

    def pick(self):
        """The number of a section of ours that is an object, or None."""
        ours = [i for i, (name, _) in enumerate(self.sections[self.own:])
                if len(name) == 4 or (len(name) > 6 and "ub" in name)]
        return self.own + self.rng.choice(ours) if ours else None

    def odd(self):
        rng = self.rng
        at = self.pick()
        if at is None:
            return
        name, lines = self.sections[at]

        def put(key, text):
            lines[:] = [k for k in lines if not k.startswith(key + "=")]
            lines.append(key + "=" + text)

        what = rng.choice(("number", "limit") * 4 + ("lead", "comment") * 2 + (
            "access", "type", "mapping", "junk", "twice", "key twice", "bom",
            "latin", "blank", "missing", "compact"))
        if what == "number":
            put("DefaultValue", rng.choice((
                "0.0", "1.5", "12 V", "0x", "0xG1", "seven", "--1", "1e3",
                "0x1FFFFFFFFFFFFFFFF", "99999999999999999999", "-1", "1,5",
                "$NODEID-1", "$NODEID*2", "$FOO+1", "{0}", "0b101", "1_000")))
        elif what == "limit":
            put(rng.choice(("LowLimit", "HighLimit")), rng.choice((
                "0xFFFFFFFFFFFFFFFF", "-9223372036854775808", "none", "1.5",
                "$NODEID+1", "18446744073709551616", "-1", "max")))
        elif what == "access":
            put("AccessType", rng.choice(("r/w", "read", "", "rwx", "ro/rw")))
        elif what == "type":
            put("DataType", rng.choice(("seven", "", "0xFFFFF", "0", "0x1F",
                                        "UNSIGNED8")))
        elif what == "mapping":
            put("PDOMapping", rng.choice(("yes", "2", "TRUE", "", "01")))
        elif what == "junk":
            lines.insert(rng.randrange(len(lines) + 1), "this is no key")
        elif what == "comment":
            i = rng.randrange(len(lines))
            lines[i] += rng.choice((" ; a comment", "\t;x", ";x", " # y"))
        elif what == "twice":
            self.sections.insert(rng.randint(at + 1, len(self.sections)),
                                 [name, list(lines)])
        elif what == "key twice":
            lines.append(rng.choice(lines))
        elif what == "bom":
            self.bom = True
        elif what == "latin":
            self.encoding = "latin-1"
        elif what == "blank":
            i = rng.randrange(len(lines))
            lines[i] = lines[i].replace("=", rng.choice((" = ", "= ", " =")), 1)
        elif what == "missing":
            lines.pop(rng.randrange(len(lines)))
        elif what == "compact":
            put("CompactSubObj", rng.choice(("0", "300", "-1", "x")))
        elif what == "lead":
            put("DefaultValue", rng.choice(("010", "007", "00", "-010", "0100",
                                            "08")))

    def text(self):
        out = []
        for name, lines in self.sections:
            out.append("[" + name + "]")
            out += lines
            if self.rng.random() < 0.3:
                out.append(self.rng.choice(("", "; a remark", "# another")))
        data = (self.eol.join(out) + self.eol).encode(self.encoding, "replace")
        return (b"\xef\xbb\xbf" if self.bom else b"") + data


def base_of(text):
    """Sections of slew's own simulated drive: all that a rig needs."""
    sections = []
    for line in text.splitlines():
        if line.startswith("["):
            sections.append([line[1:-1], []])
        elif sections and "=" in line:
            sections[-1][1].append(line)
    return sections


def make(rng, base):
    maker = Maker(rng, base)
    maker.own = len(maker.sections)
    maker.used = {name[:4] for name, _ in maker.sections}
    for _ in range(rng.randint(2, 8)):
        maker.some()
    for _ in range(rng.choice((0, 0, 1, 1, 2, 4))):
        maker.odd()
    return maker.text()


# --- comparing -------------------------------------------------------------

def theirs(path):
    try:
        return canopen.import_od(path, NODE)
    except Exception as error:  # whatever it makes of it
        return str(error) or type(error).__name__


def variables(od):
    for index, thing in od.items():
        if isinstance(thing, canopen.objectdictionary.ODVariable):
            yield index, -1, thing
        else:
            for sub in thing:
                yield index, sub, thing[sub]


def same(number, other, kind):
    bits = INTEGERS[kind][0]
    return (number - other) % (1 << bits) == 0


def compare(od, ours, data):
    """What differs and is not warned of."""
    mine = {(o["index"], o["sub"]): o for o in ours["objects"]}
    warned = {word.rstrip(":") for _, word in ours["warnings"]}
    wrong = []
    for index, sub, var in variables(od):
        if index < 0x1000:
            continue
        name = "%04X" % index if sub < 0 else "%04X:%X" % (index, sub)
        told = name in warned or "%04X" % index in warned
        o = mine.get((index, sub))
        if o is None and not told:
            wrong.append(name + " is not there")
        if o is None or told:
            continue
        kind = var.data_type if var.data_type <= 0xFF else 0
        access = var.access_type
        if o["type"] != kind and o["type"] <= 0x1B:
            wrong.append("%s: type %r, theirs %r" % (name, o["type"], kind))
        if sub != 0 or var.name != "Number of entries":
            if (o["read"], o["write"]) != (access != "wo",
                                           access[:2] in ("rw", "wo")):
                wrong.append("%s: access, theirs %r" % (name, access))
            if o["map"] != bool(var.pdo_mappable):
                wrong.append("%s: mapping" % name)
        if kind not in INTEGERS:
            continue
        raw = getattr(var, "value_raw", None)
        value = var.value if raw else getattr(var, "default", None)
        if sub == 0 and var.name == "Number of entries":
            value = None
        elif value is not None:
            value -= NODE if o.get("node") else 0
            if "value" not in o or not same(o["value"], value, kind):
                wrong.append("%s: value %r, theirs %r" %
                             (name, o.get("value"), value))
        elif "value" in o and raw is None and not getattr(
                var, "default_raw", "").strip("0 "):
            pass
        elif "value" in o and not read_by_us(var):
            wrong.append("%s: value %r, theirs none" % (name, o["value"]))
        for end, limit in (("low", var.min), ("high", var.max)):
            if kind in (0x10, 0x12, 0x13, 0x14):
                continue  # they read no limits of these
            if limit is not None and (end not in o or
                                      not same(o[end], limit, kind)):
                wrong.append("%s: %s %r, theirs %r" %
                             (name, end, o.get(end), limit))
            if limit is None and end in o and b";x" not in data:
                wrong.append("%s: %s %r, theirs none" % (name, end, o[end]))
    return wrong


def read_by_us(var):
    """python-canopen leaves a value out where a key has a comment without a
    blank before it, or zeros before a digit that means the same in every base,
    or the number of the node alone."""
    raw = getattr(var, "value_raw", None) or getattr(var, "default_raw", "")
    return (";" in raw or (raw[:1] == "0" and raw.strip("0").isdigit()) or
            raw.upper() == "$NODEID")


RIG = """\
buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}
axes:
  a:
    unit: mm
    limits: {position: [0, 100], velocity: 10, acceleration: 10}
    following_error: {floor: 1}
    drive: {kind: cia402, bus: can0, node: 1, counts: 1000 per mm, eds: a.eds}
"""
MOVE = "axes: {a: {keys: [[0 s, 0], [9 s, 1]]}}\n"


def check(folder, data):
    (folder / "a.eds").write_bytes(data)
    done = subprocess.run([SLEW, "check", folder / "rig.yaml",
                           folder / "move.yaml"], capture_output=True)
    return done.returncode, done.stderr.decode(errors="replace")


def main():
    rng = random.Random(SEED)
    count = {"same": 0, "warned": 0, "refused by them": 0}
    bad = 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "rig.yaml").write_text(RIG)
        (folder / "move.yaml").write_text(MOVE)
        base = base_of(subprocess.run(
            [SLEW, "sim", "--eds", "examples/dolly"], check=True,
            capture_output=True, text=True).stdout)
        for i in range(FILES):
            data = make(rng, base)
            path = folder / "x.eds"
            path.write_bytes(data)
            done = subprocess.run([SHEET, path], capture_output=True,
                                  check=True)
            ours = json.loads(done.stdout)
            od = theirs(str(path))
            wrong = []
            if "refused" in ours:
                wrong = ["slew refuses it"]
            elif isinstance(od, str):
                count["refused by them"] += 1
                if "EDS_WHY" in os.environ:
                    print(i, od.replace("\n", " "), ours.get("warnings"))
                if not ours["warnings"] and not is_fine(od, data):
                    wrong = ["they refuse it and slew says nothing: " + od]
            else:
                wrong = compare(od, ours, data)
                count["warned" if ours["warnings"] else "same"] += 1
            status, said = check(folder, data)
            if status != 0:
                wrong.append("the rig is refused: " + said)
            if ("warnings" in ours and bool(ours["warnings"]) !=
                    ("of the data sheet cannot be read" in said)):
                wrong.append("the rig does not say so: " + said)
            if wrong:
                bad += 1
                keep = pathlib.Path(os.environ["PEERS"]) / ("eds-%d.eds" % i)
                keep.write_bytes(data)
                print("%s (seed %d):" % (keep, SEED), *wrong[:5], sep="\n  ")
    print("seed %d: %d data sheets, %s" % (SEED, FILES, ", ".join(
        "%d %s" % (n, what) for what, n in count.items())))
    return 1 if bad else 0


def is_fine(why, data):
    """What slew reads and python-canopen does not, without a word: a byte order
    mark, Latin-1, a key that may be missing, a number with zeros before it."""
    where = re.search(r"'DataType' in section: '(\w+)'", why)
    if where:
        section = data.split(b"[%s]" % where[1].encode())[1].split(b"[")[0]
        return b"SubNumber" in section
    return ("not subscriptable" in why or data[:3] == b"\xef\xbb\xbf" or "codec" in why or
            "ParameterName" in why or "base 0: ''" in why or
            b";x" in data or "invalid literal for int() with base 0: '0" in why)


if __name__ == "__main__":
    sys.exit(main())
