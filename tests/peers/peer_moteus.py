#!/usr/bin/env python3
"""mjbots' own Python package against our moteus driver and our simulated moteus.

It reads what our driver sends, and builds the same frame from the same set
point; it commands our simulated servo in every resolution it has and reads
its answers.  Nothing goes over a bus: frames are lines of hex.  Reads no clock.
"""
import math
import os
import random
import struct
import subprocess

import moteus
from moteus import Register

PROGRAM = os.path.join(os.environ["PEERS"], "moteus")


class Ours:
    def __init__(self, what):
        self.process = subprocess.Popen([PROGRAM, what], text=True, bufsize=1,
                                        stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE)

    def ask(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        return self.process.stdout.readline().strip()


def single(value):
    return struct.unpack("f", struct.pack("f", value))[0]


def driver(count=5000):
    """Theirs reads ours; and the set point is, byte for byte, theirs."""
    ours, theirs = Ours("drive"), moteus.Controller(id=1)
    pick = random.Random(1)
    for i in range(count):
        span = pick.choice([0.01, 1, 100, 30000])
        pos = pick.uniform(-span, span)
        vel = pick.uniform(-span, span) if i % 10 else 0.0
        mnm = pick.randint(-20000, 20000)
        data = bytes.fromhex(ours.ask(f"{pos!r} {vel!r} {mnm}"))
        seen = moteus.moteus.parse_registers(data)
        command = seen.command
        # fixed point has 2^-32 turns, a float 2^-24 of its value
        for register, want in ((Register.COMMAND_POSITION, pos),
                               (Register.COMMAND_VELOCITY, vel),
                               (Register.COMMAND_FEEDFORWARD_TORQUE,
                                mnm / 1000)):
            got = command[register]
            assert abs(got - want) <= abs(want) * 2**-24 + 2**-31, (
                register, got, want)
        assert command[Register.MODE] == moteus.Mode.POSITION
        assert abs(command[Register.COMMAND_TIMEOUT] - 0.1) < 1e-9
        assert command[Register.COMMAND_VELOCITY_LIMIT] < 0
        assert command[Register.COMMAND_ACCEL_LIMIT] < 0
        assert {r for r, _ in seen.query} >= {
            Register.MODE, Register.POSITION, Register.VELOCITY,
            Register.TORQUE, Register.FAULT}, seen.query
        built = theirs.make_position(
            position=command[Register.COMMAND_POSITION],
            velocity=command[Register.COMMAND_VELOCITY],
            feedforward_torque=single(
                command[Register.COMMAND_FEEDFORWARD_TORQUE]),
            query=False).data
        assert data.startswith(built), (data.hex(), built.hex())
    print(f"  {count} set points of our driver read, and built the same")


def resolutions():
    """As whole numbers and as floats; ours sends floats."""
    for name, kind, tolerance in (("int16", moteus.INT16, 0.002),
                                  ("int32", moteus.INT32, 1e-4),
                                  ("float", moteus.F32, 1e-5)):
        command, query = moteus.PositionResolution(), moteus.QueryResolution()
        for what in ("position", "velocity", "feedforward_torque",
                     "watchdog_timeout"):
            setattr(command, what, kind)
        for what in ("mode", "position", "velocity", "torque"):
            setattr(query, what, kind)
        yield name, command, query, tolerance


def servo(count=300):
    """It goes where it is told and says so; stop ends it."""
    for name, command, query, tolerance in resolutions():
        ours = Ours("servo")
        theirs = moteus.Controller(id=1, position_resolution=command,
                                   query_resolution=query)

        def ask(frame):
            reply = ours.ask(frame.data.hex())
            assert reply != "-", "no reply"
            return moteus.moteus.parse_reply(bytes.fromhex(reply))

        seen = ask(theirs.make_query())
        assert seen[Register.MODE] == moteus.Mode.STOPPED, seen
        for i in range(count):  # a sine of one turn, as a stream
            t = i * 0.001
            pos = 1 - math.cos(6 * t)
            seen = ask(theirs.make_position(position=pos,
                                            velocity=6 * math.sin(6 * t),
                                            watchdog_timeout=0.1, query=True))
            assert seen[Register.MODE] == moteus.Mode.POSITION, seen
            assert seen[Register.FAULT] == 0
        assert abs(seen[Register.POSITION] - pos) < 0.05, (seen, pos)
        for _ in range(1000):
            seen = ask(theirs.make_position(position=0.5, velocity=0,
                                            velocity_limit=4, accel_limit=40,
                                            query=True))
        assert abs(seen[Register.POSITION] - 0.5) < tolerance, seen
        for _ in range(120):  # only questions: its watchdog runs out
            seen = ask(theirs.make_query())
        assert seen[Register.MODE] == moteus.Mode.TIMEOUT, seen
        seen = ask(theirs.make_position(position=0.5, query=True))
        assert seen[Register.MODE] == moteus.Mode.TIMEOUT, seen
        seen = ask(theirs.make_stop(query=True))
        assert seen[Register.MODE] == moteus.Mode.STOPPED, seen
        print(f"  our servo follows mjbots' commands, {name}")


driver()
servo()
