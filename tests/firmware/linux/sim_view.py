#!/usr/bin/env python3
"""slew sim on a terminal: a view of the axes below the commands, redrawn in place,
and the terminal as it was at the end.

    tests/firmware/linux/sim_view.py build/slew
"""
import fcntl
import os
import pty
import select
import struct
import sys
import tempfile
import termios
import time

RIG = """buses:
  line: {kind: modbus-rtu, device: /dev/ttyUSB0, baud: 115200}
axes:
  slide:
    unit: mm
    limits: {position: [0 mm, 600 mm], velocity: 50 mm/s, acceleration: 200 mm/s2, jerk: 4000 mm/s3}
    following_error: {floor: 5 mm, time: 100 ms}
    drive: {kind: modbus, bus: line, node: 1, map: leadshine-el7, counts: 1000 per mm, unsupervised: yes}
"""


def main():
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "rig.yaml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(RIG)
        child, terminal = pty.fork()
        if child == 0:
            fcntl.ioctl(0, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
            os.execv(sys.argv[1], [sys.argv[1], "sim", path])
        said = b""
        asked = False
        until = time.monotonic() + 60
        while time.monotonic() < until:
            if not select.select([terminal], [], [], 1)[0]:
                continue
            try:
                more = os.read(terminal, 65536)
            except OSError:
                break
            if not more:
                break
            said += more
            # drawn three times in its place, which is line 24
            if not asked and said.count(b"\x1b[24;1Hslide") >= 3:
                asked = True
                os.write(terminal, b"status\nquit\n")
        status = os.waitpid(child, 0)[1]
    text = said.decode(errors="replace")
    assert asked, f"the view was not redrawn: {text!r}"
    assert status == 0, (status, text)
    assert "\x1b[1;22r" in text, "the lines above do not scroll alone"
    assert text.rindex("\x1b[r") > text.rindex("slide"), "the terminal is not as it was"


main()
