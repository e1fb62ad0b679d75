#!/usr/bin/env python3
"""tests/firmware/linux/follow.py SLEW - a move that keeps to MIDI timecode which
runs fast, to frame pulses of a simulated line, and to timecode that ends; the first
and the last also of a service, which slew run asks for it.

Timecode is written into a pipe by the real clock.
"""
import multiprocessing
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time

FPS = 25
RIG = """
tick: 10 ms
watchdog: 100 ms
buses: {can: {kind: canopen, bit_rate: 1 Mbit/s}}
axes:
  pan:
    unit: deg
    limits: {position: [-90 deg, 90 deg], velocity: 30 deg/s,
             acceleration: 60 deg/s2, jerk: 500 deg/s3}
    following_error: {floor: 5 deg, time: 100 ms}
    drive: {kind: cia402, bus: can, node: 1, counts: 1048576 per rev}
gpio:
  sync: {kind: frame, line: rig0, sim: 39.6 ms}
"""
MOVE = """
fps: 25
axes:
  pan: {curve: s-curve, keys: [[0 s, 0 deg], [9 s, 40 deg]]}
"""


def fail(text):
    print("follow.py:", text)
    sys.exit(1)


def quarter_frames(pipe, frame, rate, seconds):
    """MTC from that frame on, `rate` times as fast as it should be."""
    with open(pipe, "wb", buffering=0) as file:
        begin = time.monotonic()
        for n in range(int(seconds * FPS * 4)):
            at = frame + n // 8 * 2  # a number takes two frames
            h, m, s, f = (at // FPS // 3600, at // FPS // 60 % 60,
                          at // FPS % 60, at % FPS)
            data = [f & 15, f >> 4, s & 15, s >> 4, m & 15, m >> 4, h & 15,
                    h >> 4 | 1 << 1][n % 8]
            wait = begin + n / (4 * FPS * rate) - time.monotonic()
            if wait > 0:
                time.sleep(wait)
            try:
                file.write(bytes([0xF1, n % 8 << 4 | data]))
            except BrokenPipeError:
                return


def start(slew, directory, *options):
    return subprocess.Popen(
        [slew, "run", "--realtime", *options, "rig.yaml", "move.yaml"],
        env=dict(os.environ, SLEW_RUN_DIR=directory),
        cwd=directory, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True)


def off_ms(what, run):
    out = run.communicate(timeout=90)[0]
    off = re.search(r"followed to ([0-9.]+) ms", out)
    if run.returncode != 0 or off is None:
        fail("%s: status %d, not followed:\n%s" % (what, run.returncode, out))
    return out, float(off.group(1))


def judge(what, run, rate):
    """It took as long as it takes on that clock, and was never far from it."""
    out, off = off_ms(what, run)
    took = re.search(r"done after ([0-9.]+) s", out)
    if took is None:
        fail("%s: not done:\n%s" % (what, out))
    took = float(took.group(1))
    if off > 60 or abs(took - 9 / rate) > 0.045:
        fail("%s: off by %.3f ms, after %.3f s instead of %.3f" %
             (what, off, took, 9 / rate))
    print("%s: off by %.3f ms at most, %.3f s for 9 s at %.2f %%" %
          (what, off, took, 100 * rate))


def mtc_that_runs_fast(slew, directory):
    pipe = os.path.join(directory, "mtc")
    writer = threading.Thread(target=quarter_frames, daemon=True,
                              args=(pipe, 3600 * FPS, 1.01, 20))
    writer.start()
    run = start(slew, directory, "--follow", "mtc:" + pipe, "--follow-at",
                "01:00:04:00")
    judge("mtc", run, 1.01)


def pulses_of_a_line(slew, directory):
    run = start(slew, directory, "--follow", "sync")
    judge("line", run, 40 / 39.6)


def timecode_that_ends(slew, directory, seconds=11):
    pipe = os.path.join(directory, "mtc")
    writer = threading.Thread(target=quarter_frames, daemon=True,
                              args=(pipe, 0, 1, 7))
    writer.start()
    run = start(slew, directory, "--follow", "mtc:" + pipe, "--follow-at",
                "00:00:04:00")
    time.sleep(seconds)
    run.send_signal(signal.SIGINT)
    out = run.communicate(timeout=90)[0]
    if "is lost: the move is held" not in out:
        fail("timecode that ends: it is not said:\n" + out)
    if run.returncode != 130:
        fail("status %d:\n%s" % (run.returncode, out))
    print("timecode that ends: held")


def of_a_service(slew, directory):
    """As long as it runs, slew run asks it; it ends with torque off."""
    service = subprocess.Popen(
        [slew, "service", "run", "--sim", "rig.yaml"], cwd=directory,
        env=dict(os.environ, SLEW_RUN_DIR=directory),
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True)
    line = service.stdout.readline()
    while line and "socket" not in line:
        line = service.stdout.readline()
    try:
        pipe = os.path.join(directory, "mtc")
        writer = threading.Thread(target=quarter_frames, daemon=True,
                                  args=(pipe, 3600 * FPS, 1.01, 20))
        writer.start()
        run = start(slew, directory, "--follow", "mtc:mtc", "--follow-at",
                    "01:00:06:00")
        out, off = off_ms("service", run)
        if off > 60 or "a service has this rig" not in out:
            fail("service: off by %.3f ms:\n%s" % (off, out))
        print("service: off by %.3f ms at most" % off)
        writer.join()
        timecode_that_ends(slew, directory, 22)  # from where it was left
    finally:
        service.terminate()
        service.communicate(timeout=30)


def alone(case, slew):
    """In a directory and a process of its own."""
    with tempfile.TemporaryDirectory() as directory:
        for name, text in (("rig.yaml", RIG), ("move.yaml", MOVE)):
            with open(os.path.join(directory, name), "w") as file:
                file.write(text)
        os.mkfifo(os.path.join(directory, "mtc"))
        case(slew, directory)


def main():
    """All wait more than they work: side by side."""
    slew = os.path.abspath(sys.argv[1])
    cases = [multiprocessing.Process(target=alone, args=(case, slew))
             for case in (of_a_service, mtc_that_runs_fast, pulses_of_a_line,
                          timecode_that_ends)]
    for case in cases:
        case.start()
    for case in cases:
        case.join()
    return any(case.exitcode != 0 for case in cases)


sys.exit(main())
