#!/usr/bin/env python3
"""tests/firmware/studio/hold_thread.py PROGRAM [ARGUMENT]... - runs a program, and
holds one of its threads still when told to: lines of standard input are "hold NAME",
"let" and "end", each answered by one on standard output.  Whoever starts a program
may trace it, so this needs no rights."""
import ctypes
import os
import signal
import subprocess
import sys

SEIZE, INTERRUPT, DETACH = 0x4206, 0x4207, 17
WALL = 0x40000000
libc = ctypes.CDLL(None, use_errno=True)
libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
libc.ptrace.restype = ctypes.c_long


def trace(request, thread):
    if libc.ptrace(request, thread, None, None) < 0:
        raise OSError(ctypes.get_errno(), "ptrace")


def find(process, name):
    for thread in os.listdir("/proc/%d/task" % process):
        with open("/proc/%d/task/%s/comm" % (process, thread)) as comm:
            if comm.read().strip() == name:
                return int(thread)
    raise SystemExit("there is no thread " + name)


def main():
    child = subprocess.Popen(sys.argv[1:], stdin=subprocess.DEVNULL, stdout=sys.stderr)
    held = None
    print("process", child.pid, flush=True)
    for line in iter(sys.stdin.readline, ""):
        words = line.split()
        if words[0] == "hold":
            held = find(child.pid, words[1])
            trace(SEIZE, held)
            trace(INTERRUPT, held)
            os.waitpid(held, WALL)
        elif words[0] == "let":
            trace(DETACH, held)
            held = None
        else:
            break
        print(words[0], flush=True)
    if held is not None:
        trace(DETACH, held)
    child.send_signal(signal.SIGTERM)
    sys.exit(child.wait())


main()
