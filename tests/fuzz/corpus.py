#!/usr/bin/env python3
"""Write tests/fuzz/corpus: what the fuzz targets start from.

    make build && tests/fuzz/corpus.py build/slew

Small files, each with something of its own: one of every kind of section, value
and frame.  Files named found-* came from a fuzzer and stay."""
import pathlib
import struct
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
CORPUS = HERE / "corpus"
sys.path.insert(0, str(ROOT / "tests/support"))
from crc16 import crc16  # noqa: E402

SLEW = sys.argv[1] if len(sys.argv) > 1 else "build/slew"


def put(target, name, data):
    folder = CORPUS / target
    folder.mkdir(parents=True, exist_ok=True)
    if isinstance(data, str):
        data = data.encode()
    (folder / name).write_bytes(data)


def copy(target, *names):
    for name in names:
        path = ROOT / name
        put(target, name.replace("/", "-"), path.read_bytes())


def slew(*words):
    done = subprocess.run([SLEW, *words], cwd=ROOT, capture_output=True)
    if done.returncode != 0:
        sys.exit(f"slew {' '.join(words)}: {done.stderr.decode()}")
    return done.stdout


# --- files that people write ---

copy("rig", "examples/dolly/rig.yaml", "tests/data/lines/rig.yaml",
     "examples/modbus/rig.yaml")
put("rig", "tcp", """\
buses:
  net1: {kind: modbus-tcp, host: 127.0.0.1, port: 1502, timeout: 80 ms}
axes:
  lift:
    unit: rev
    limits: {position: [0 rev, 9 rev], velocity: 60 rpm, acceleration: 1 rev/s2}
    following_error: {floor: 1 rev, time: 1 s}
    drive: {kind: modbus, bus: net1, node: 7, map: lexium-32, counts: {num: 131072, den: 1}}
""")

MOVES = {
    "curves": """\
title: Every curve
fps: 24
axes:
  pan:
    curve: s-curve
    ease: [20 %, 70 %]
    keys:
      - [0 s, 0 deg]
      - {t: 1 s, p: 30 deg}
      - {t: frame 48 @ 24, p: 1 rad, curve: quintic}
      - [3 s, 40 deg, 0 deg/s, 1 deg/s2]
  dolly:
    curve: kochanek-bartels
    tcb: [0.1, 0, -0.5]
    ends: {first: rest, last: natural}
    keys: [[0 s, 0 mm], [1.5 s, 2 in], [4 s, 1 m]]
""",
    "bezier": """\
axes:
  dolly:
    curve: bezier
    handles: auto
    extrapolation: linear
    cycles: {before: mirror, before_count: 2, after: repeat-offset}
    until: 9 s
    keys:
      - [0 s, 120 mm]
      - {t: 3 s, p: 330 mm, left: [-0.8 s, -60 mm], right: [1 s, 75 mm]}
      - {t: 6 s, p: 930 mm, interpolation: elastic, amplitude: 3 mm, period: 1 s}
      - {t: 8 s, p: 940 mm, interpolation: back, easing: in-out, back: 1.7}
""",
    "orient": """\
path:
  axes: [x, y]
  curve: c2
  points: [[0 mm, 0 mm], [900 mm, 100 mm], [1900 mm, -600 mm]]
  speed: {law: quintic, time: 8 s}
camera:
  axes: {pan: pan, tilt: tilt}
  up: [0, 0, 1]
  look:
    curve: squad
    keys:
      - {at: 0 %, angles: [10 deg, -5 deg]}
      - {at: 700 mm, quaternion: [1, 1, -1, -1]}
      - {at: 90 %, forward: [1, 2, 0.5], up: [0, 0, 1]}
""",
    "path": """\
path:
  axes: [x, y]
  curve: rounded
  corner: 40 mm
  points: [[0 mm, 0 mm], [900 mm, 100 mm], [1900 mm, -600 mm]]
  speed:
    - {law: ramp, time: 1.5 s, to: 450 mm/s}
    - {law: constant, time: 1 s}
    - {law: ramp, time: 1 s, to: 0 mm/s}
    - {law: drawn, length: rest, distance: {keys: [[0 s, 0 %], [6 s, 100 %]]}}
camera:
  axes: {pan: pan, tilt: tilt}
  look: {dwell: [{at: [2 m, 1 m, 0], from: 0 %, to: 40 %}]}
""",
    "blend": """\
poses:
  wide: {dolly: 600 mm, pan: -12 deg}
  close: {dolly: 1150 mm, pan: 18 deg}
blend:
  base: wide
  weights: {close: {curve: s-curve, keys: [[1 s, 0 %], [9 s, 100 %]]}}
layers:
  - axes: {pan: {keys: [[0 s, 0 deg], [4 s, 0.5 deg]]}}
fade:
  axes: {pan: {keys: [[0 s, 5 deg], [18 s, 0 deg]]}}
  weight: {keys: [[12 s, 0 %], [17 s, 100 %]]}
warp:
  ends: one-sided
  keys: [[0 s, 0 s], [6 s, 6 s], [15 s, 12 s]]
""",
}
for name, text in MOVES.items():
    put("move", name, text)

copy("map", "hal/maps/oriental-az.yaml", "hal/maps/lexium-32.yaml",
     "tests/data/maps/coils.yaml", "tests/data/maps/floats.yaml",
     "tests/data/maps/holes.yaml")

put("eds", "odd", """\
\ufeff[DeviceInfo]
NrOfRXPDO=3
CompactPDO=0x3F
[1016]
ObjectType=8
CompactSubObj=0x02
DataType=0x0007 ; unsigned
AccessType=rw
[1016Name]
NrOfEntries=1
1=First
[1016Value]
2=0x200 + $NODEID
[2000]
DefaultValue=0.0
DataType=0xA0
[A0sub1]
DefaultValue=0x1B
[2000]
HighLimit=0xFFFFFFFFFFFFFFFF
LowLimit=-1
no key
[2001sub01]
AccessType=r/w
""")
put("eds", "small", """\
[DeviceInfo]
VendorName=slew
ProductName=servo
[MandatoryObjects]
SupportedObjects=1
1=0x1000
[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0x00020192
PDOMapping=0
[1400sub1]
ParameterName=COB-ID
DataType=0x0007
AccessType=rw
DefaultValue=$NODEID+0x200
[607A]
ParameterName=Target position
DataType=0x0004
AccessType=rww
ParameterValue=-5
PDOMapping=1
""")

# --- files that programs write ---

put("telemetry", "run", """\
t_ns,phase,state,path_ns,pan.demand_deg,pan.actual_deg,pan.statusword
1000000,move,moving,0,0.5,0.4998,567
2000000,move,moving,1000000,0.6,0.5,0x1237
3000000,settle,standing,2000000,-1e-3,0.5,0
""")
put("otg", "position", """\
p0,v0,a0,pf,vf,af,vmax,vmin,amax,amin,jmax
0,0,0,10,0,0,5,-5,10,-10,40
1e-3,0.5,-2,-7,0.25,0,3,-4,5,-6,7
""")
put("otg", "velocity", """\
v0,a0,vf,af,amax,amin,jmax,duration,category
0,1,3,0,5,-5,30,1.5,x
""")
put("otg", "through", """\
p0,v0,a0,pf,vf,af,vmax,vmin,amax,amin,jmax
0,0,0,20,,0,10,-10,20,-20,200
,,,50,,,,,,,
,,,30,2,,,,,,
""")
put("otg", "replan", """\
t,p0,v0,a0,pf,vf,af,vmax,vmin,amax,amin,jmax
0,0,0,0,100,0,0,10,-10,20,-20,200
2.5,,,,40,,,,,,,
4,,,,60,,,5,-5,,,
""")
for name in ("kuper.txt", "flair.txt", "raw.txt"):
    put("import_" + name.split(".")[0], "small",
        (ROOT / "tests/data/import" / name).read_bytes())
put("import_csv", "small", (ROOT / "tests/data/import/table.csv").read_bytes())
put("import_maya", "small",
    (ROOT / "tests/data/import/tangents.anim").read_bytes())
put("import_arcm", "small", """\
<?xml version="1.0"?>
<scen:scene xmlns:scen="http://caliri.com/motion/scene" endframe="48">
<scen:axis name="pan" units="deg" base="0"><scen:points x="1" y="0" type="5"/>\
<scen:points x="49.5" y="-30"/><scen:controlPoints x="20" y="1e1"/>\
<scen:controlPoints x="20" y="-30"/></scen:axis>
<scen:axis name="dolly" units="cm"><scen:points x="7" y="0"/></scen:axis>
</scen:scene>
""")

with tempfile.TemporaryDirectory() as folder:
    for name in ("curves", "bezier"):
        move = pathlib.Path(folder) / "move.yaml"
        move.write_text(MOVES[name])
        out = pathlib.Path(folder) / "out"
        slew("compile", "--out", str(out), "tests/fuzz/rig.yaml", str(move))
        put("compiled", name, out.read_bytes())
        slew("export", "blender", "--fps", "24", "--out", str(out),
             "tests/fuzz/rig.yaml", str(move))
        put("import_blender", name, out.read_bytes())

# --- buses ---


def frame(can_id, data=b"", shape=0):
    """As fuzz_frame reads it."""
    return struct.pack("<HB", can_id, shape | len(data)) + bytes(data)


CANFD = "<IBBBB"
put("can_frame", "classic", struct.pack(CANFD, 0x185, 8, 0, 0, 0) + bytes(range(8)))
put("can_frame", "short", struct.pack(CANFD, 0x80, 0, 0, 0, 0) + bytes(8))
put("can_frame", "extended", struct.pack(CANFD, 0x80000000 | 0x1ABCDEF, 3, 0, 0, 0) + bytes(8))
put("can_frame", "fd", struct.pack(CANFD, 0x123, 12, 5, 0, 0) + bytes(64))
put("can_frame", "error", struct.pack(CANFD, 0x20000000 | 0x04, 8, 0, 0, 0) + b"\0\x20\0\0\0\0\x80\x10")
put("can_frame", "remote", struct.pack(CANFD, 0x40000000 | 0x706, 1, 0, 0, 0) + bytes(8))


def ask(what):
    return bytes([4, what])


ANSWER = 0x580
put("canopen", "boot", bytes([1]) + frame(0x705, b"\0") + bytes([0, 0, 0])
    + bytes([1]) + frame(0x585, bytes.fromhex("4300100092010200"))
    + bytes([1]) + frame(0x585, bytes.fromhex("80006502000002 06".replace(" ", ""))))
put("canopen", "pdo", b"".join(
    bytes([2]) + frame(0x185, bytes.fromhex("371210270000"))
    + frame(0x705, b"\5") for _ in range(6)))
put("canopen", "emcy", bytes([2]) + frame(0x85, bytes.fromhex("1023010000000000"))
    + frame(0x85, bytes.fromhex("0000000000000000")))
put("canopen", "segments", ask(2) + bytes([0, 1])
    + frame(0x586, bytes.fromhex("4108100009000000"))
    + bytes([1]) + frame(0x586, bytes.fromhex("00736c6577207365"))
    + bytes([1]) + frame(0x586, bytes.fromhex("1b72760000000000")))
put("canopen", "block", ask(10) + bytes([0, 1])
    + frame(0x586, bytes.fromhex("c608100009000000"))
    + bytes([2]) + frame(0x586, bytes.fromhex("01736c6577207365"))
    + frame(0x586, bytes.fromhex("8272760000000000"))
    + bytes([1]) + frame(0x586, bytes.fromhex("d500000000000000")))
put("canopen", "write", ask(3) + bytes([0, 1])
    + frame(0x586, bytes.fromhex("60501f0100000000"))
    + b"".join(bytes([1]) + frame(0x586, bytes([0x20 + 0x10 * (i % 2)]) + bytes(7))
               for i in range(4)))
put("canopen", "lss", ask(4) + b"".join(
    bytes([1]) + frame(0x7E4, bytes.fromhex("4f00000000000000")) for _ in range(5)))
put("canopen", "guard", bytes([0, 0]) + bytes([1]) + frame(0x706, b"\x7f")
    + bytes([7]) + bytes([255]) + bytes([1]) + frame(0x706, b"\xff"))

# ODrive 3: heartbeat, position and speed, error; then enable.  Every frame is
# followed by a byte that says whether it is an FD one.
ODRIVE = 3 << 5
put("can_bus", "odrive", b"".join(
    bytes([2]) + frame(ODRIVE | 1, struct.pack("<IBBBB", 0, 1, 0, 0, 0)) + b"\0"
    + frame(ODRIVE | 9, struct.pack("<ff", 1.5, -0.25)) + b"\0"
    + (ask(8) if i == 4 else b"") for i in range(8)))
put("can_bus", "odrive-fault", bytes([1]) + frame(
    ODRIVE | 3, struct.pack("<II", 0x200, 0)) + b"\0"
    + bytes([1]) + frame(ODRIVE | 1, struct.pack("<IBBBB", 0x200, 1, 0, 0, 0))
    + b"\0" + ask(24))
# moteus 5: mode, position, velocity, torque as floats; voltage, fault.
REPLY = (bytes([0x24, 0x00]) + struct.pack("<HH", 10, 0)[:2] + b"\x2d\x01"
         + struct.pack("<ff", 0.5, 0.1))
put("can_bus", "moteus", b"".join(
    bytes([1]) + struct.pack("<HB", 0x500, 0) + bytes([8 | 3])
    + REPLY.ljust(20, b"\x50") + (ask(9) if i == 3 else b"")
    for i in range(6)))

WRITE = [(0x1017, 0, 2, 100), (0x6060, 0, 1, 8), (0x6040, 0, 2, 6),
         (0x6040, 0, 2, 7), (0x6040, 0, 2, 15)]
put("sdo_server", "enable", b"".join(
    frame(0x605, struct.pack("<BHBI", 0x23 | (4 - size) << 2, index, sub, value))
    for index, sub, size, value in WRITE) + frame(0, b"\1\0") + frame(0x80)
    + frame(0x205, bytes.fromhex("0f0010270000")) + frame(0x80))
put("sdo_server", "segments", frame(0x605, bytes.fromhex("4108100000000000"))
    + frame(0x605, bytes.fromhex("6000000000000000"))
    + frame(0x605, bytes.fromhex("7000000000000000")))
put("sdo_server", "download", frame(0x605, bytes.fromhex("2102200009000000"))
    + frame(0x605, bytes.fromhex("0001020304050607"))
    + frame(0x605, bytes.fromhex("1b08090000000000"))
    + frame(0x605, bytes.fromhex("4002200000000000")))
put("sdo_server", "block", frame(0x605, bytes.fromhex("c602200009000000"))
    + frame(0x605, bytes.fromhex("0101020304050607"))
    + frame(0x605, bytes.fromhex("8208090000000000"))
    + frame(0x605, bytes.fromhex("d500000000000000"))
    + frame(0x605, bytes.fromhex("a0022000 7f000000".replace(" ", "")))
    + frame(0x605, bytes.fromhex("a300000000000000")))
put("sdo_server", "lss", frame(0x7E5, bytes.fromhex("0401000000000000"))
    + frame(0x7E5, bytes.fromhex("1109000000000000"))
    + frame(0x7E5, bytes.fromhex("5100000000000000"))
    + frame(0x7E5, bytes.fromhex("4c00000000000000")))
put("sdo_server", "services", frame(0x705, b"", 0x10) + frame(0x100, bytes(6))
    + frame(0, b"\x81\5") + frame(0x1F5, bytes(8), 0x20))


def gpio(release_ms, *steps):
    """Steps: level (0, 1, 3: an error), half ms since the last, edges: active,
    50 us from the step, or all 64 bits of a time."""
    out = struct.pack("<BH", release_ms, 100)
    for level, halves, *edges in steps:
        out += bytes([level | halves << 2])
        for active, when in edges:
            near = -0x8000 <= when < 0x8000
            out += bytes([4 | active | near << 1])
            out += struct.pack("<h", when) if near else b"".join(
                struct.pack("<H", when >> shift & 0xFFFF)
                for shift in (48, 32, 16, 0))
        out += b"\0"
    return out


put("gpio", "press", gpio(20, (0, 2), (1, 2, (1, -10)), (1, 2), (0, 2, (0, -5)),
                          *[(0, 8)] * 6))
put("gpio", "bounce", gpio(10, (0, 2), (0, 2, (1, -20), (0, -18), (1, -15), (0, -9)),
                           (1, 2, (1, -3)), (0, 2, (0, -1), (1, -8), (1, -8)),
                           *[(0, 8)] * 4))
put("gpio", "storm", gpio(5, (0, 2), (0, 2, *[(n & 1, -n) for n in range(40)]),
                          (0, 20), (0, 20)))
put("gpio", "times", gpio(50, (0, 2), (0, 2, (1, 1 << 63)), (0, 60), (0, 60),
                          (0, 2, (1, (1 << 63) - 1)), (0, 60), (0, 60),
                          (0, 2, (1, 1 << 40), (1, -30))))
put("gpio", "dead", gpio(20, (3, 2), (3, 2, (1, -3)), (0, 2), (0, 60), (1, 2)))


def asked(function, address, count, write_address=0, write_count=0):
    return struct.pack("<BHBBB", function, address, count, write_address,
                       write_count)


READ = bytes.fromhex("0304000a000b")
put("modbus", "read", asked(3, 0, 2) + READ)
put("modbus", "rtu", asked(3, 0, 2) + b"\x09" + READ + crc16(b"\x09" + READ))
put("modbus", "tcp", asked(4, 0, 1) + bytes.fromhex("010200000005090402000a"))
put("modbus", "exception", asked(6, 5, 1) + bytes.fromhex("8602"))
put("modbus", "write", asked(16, 2, 2) + bytes.fromhex("10000200020400010002"))
put("modbus", "coils", asked(15, 0, 5) + bytes.fromhex("0f00000005011f"))
put("modbus", "both", asked(23, 0, 1, 3, 1) + bytes.fromhex("17000000010003000102ffff"))
put("modbus", "served", asked(3, 0, 1)
    + bytes.fromhex("090300000002") + crc16(bytes.fromhex("090300000002")))

# --- what clients of a service send ---

COMMANDS = {name: i for i, name in enumerate(
    "hello status stream stop take renew release enable off reset home load approach "
    "start hold resume reverse override jog jog-stop capture".split())}


def says(*names, client=0):
    return b"".join(bytes([9 | client << 2, COMMANDS[name]]) for name in names)


def sends(text, client=0):
    return bytes([8 | client << 2, len(text)]) + text.encode()


WAIT = bytes([2, 31])
put("service", "jog", says("take", "enable") + 3 * WAIT + says("jog") + WAIT + bytes([3]))
put("service", "play", says("take", "load", "enable") + 3 * WAIT
    + says("approach") + WAIT + says("start") + WAIT + says("hold") + WAIT
    + says("reverse", "resume") + WAIT + says("stop", client=1))
put("service", "pieces", sends('{"id":1,"comm') + WAIT + sends('and":"hello"}\n\n{}\n[')
    + sends("[" * 200) + sends('\n{"id":"\\u0000","command":"take","lease":1e999}\n'))
put("service", "deaf", bytes([1, COMMANDS["stream"]]) + 20 * WAIT
    + 40 * bytes([1, COMMANDS["status"]]))
