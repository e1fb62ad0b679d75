#!/usr/bin/env python3
# tests/bench/latency.py - how late the ticks of a service come, beside cyclictest.
"""tests/bench/latency.py SLEW TEST_LOOP [SECONDS [WINDOWS]]

First what a tick costs in virtual time, counted: instructions of test_loop's ticks
while clients do not read, connect in hundreds, and a recording's writes do not come
back.  Then the clock; with no WINDOWS, not that.

Both wake every ms by SCHED_FIFO, memory locked, on the same processor, half a
period apart, so that what the machine does to one it does to the other: an
interrupt, a burst of another guest, time that the host takes away.  On different
processors they would be compared by which of these had the worse minutes.

What one does to the other.  cyclictest runs a priority above: a tick that is late
and still computes half a period on never delays it, while it delays a tick by its
own few us.  So the comparison is not in slewd's favour.  Simulated drives are
computed in the tick, work that real ones do not need; a tick that takes longer
than its period counts as lost.

What is compared.  WINDOWS of SECONDS each, in turn on the first processor and on
the last, a fresh service in each.  The wake-ups of all windows are put together,
and of these the 99.9th percentile is taken, of either program; the ratio of every
window is printed, too, as its least, median and most.  The service's wake-ups are
those of the window, by its own count (the command `latency`, docs/API.md) at both
ends.  From 2 ms on they are counted by 100 us, and cyclictest's likewise.

Lost.  Either program leaves out the periods that were over when it woke; these are
ticks lost of the service, and of cyclictest whole periods in its latencies.  A
service whose axes stop because ten in a row were lost (FAULTS.md) is counted, also
one that has to be begun again before its window; in a window its ticks go on.

Conditions, each with the axes moving: a full disk below a recording; clients that
ask for a stream and never read; 1,000 connections; a loop that copies memory on
the other processor.  Of each is said what it cost: rows, streams, connections; two
windows of each are too few for a percentile that passes or fails.

Fails where the ratio of the idle or of the moving service is above 1.5, where a
tick had a page fault, where instructions depend on who does not read or connects,
or where a condition had no effect at all."""
import json
import os
import re
import resource
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

RATIO = 1.5
FINE_US, STEP_US, MOST_US = 2000, 100, 20000
MOVE = ("axes: {dolly: {curve: s-curve, keys: "
        "[[0 s, 120 mm], [4 s, 240 mm], [8 s, 120 mm]]}}")
COPY = "a = bytearray(1 << 26)\nwhile True: b = bytes(a)"
COUNTED = ("undisturbed", "readers that never read", "streams nobody reads",
           "200 connections", "a blocked recording")  # the tests of test_loop.c
COUNTED_TICKS = 3000
BEGINS = 5


def bin_us(us):
    """Of the service's bins, the least us."""
    if us < FINE_US:
        return us
    return min(us // STEP_US * STEP_US, MOST_US)


def p999(count):
    """All but one in a thousand are below this, us."""
    total, later = sum(count.values()), 0
    for us in sorted(count, reverse=True):
        later += count[us]
        if later * 1000 > total:
            return us + (1 if us < FINE_US else STEP_US)
    return 1


def add(to, count):
    for us, times in count.items():
        to[us] = to.get(us, 0) + times


class Client:
    def __init__(self, path, receive=None):
        self.socket = socket.socket(socket.AF_UNIX)
        if receive:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive)
        self.socket.connect(path)
        self.lines = self.socket.makefile("r")

    def send(self, command, **members):
        line = json.dumps({"command": command, **members}) + "\n"
        self.socket.sendall(line.encode())

    def ask(self, command, **members):
        self.send(command, **members)
        for line in self.lines:
            answer = json.loads(line)
            if "ok" in answer:
                break
        if not answer["ok"]:
            raise RuntimeError(f"{command}: {answer['text']}")
        return answer


class Service:
    """On one processor; `disk`: records in that directory, on 256 KB."""

    def __init__(self, slew, directory, cpu, disk=None):
        words = [slew, "service", "run", "--sim", "--cpu", str(cpu),
                 "--socket", os.path.join(directory, "socket")]
        if disk:
            words += ["--recordings", disk]
        words.append("examples/dolly")
        if disk:
            mount = "-m" if os.geteuid() == 0 else "-rm"
            words = ["unshare", mount, "sh", "-c",
                     'mount -t tmpfs -o size=256k none "$0" && exec "$@"',
                     disk] + words
        self.run = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
        if "socket" not in self.run.stdout.readline():
            raise RuntimeError("the service did not begin")
        self.path = os.path.join(directory, "socket")
        self.client = Client(self.path)

    def until(self, state):
        for _ in range(200):
            status = self.client.ask("status")
            if status["state"] == state:
                return
            time.sleep(0.1)
        raise RuntimeError(f"not {state}: {status.get('fault')}")

    def play(self):
        ask = self.client.ask
        ask("take", lease=60)
        ask("enable")
        self.until("ready")
        ask("load", text=MOVE)
        ask("approach")
        self.until("ready")
        ask("start", times=0)
        self.until("moving")

    def phase_us(self):
        """Where in a ms of CLOCK_MONOTONIC its ticks are."""
        return round(self.client.ask("status")["t_s"] * 1e6) % 1000

    def end(self):
        self.run.send_signal(signal.SIGTERM)
        self.run.wait()


def cyclictest(cpu, seconds, phase_us):
    """Wake-ups by us."""
    out = subprocess.run(
        ["cyclictest", "-m", "-q", "-t", "1", "-a", str(cpu), "-p", "41",
         "-i", "1000", "-D", str(seconds), "-h", "100000",
         f"--secaligned={phase_us}"],
        capture_output=True, text=True, check=True).stdout
    count = {}
    for us, times in re.findall(r"^(\d+) (\d+)$", out, re.MULTILINE):
        if int(times):
            count[int(us)] = int(times)
    # Later than the histogram: a tenth of a second, at least.
    over = int(re.search(r"Overflows: 0*(\d+)", out).group(1))
    if over:
        count[100000] = over
    return count


# --- what is done to the service ------------------------------------------

class Nothing:
    name, disk, moves = "moving", False, True

    def begin(self, service, other):
        pass

    def end(self, service):
        """What it cost."""
        return ""


class Idle(Nothing):
    name, moves = "off", False


class FullDisk(Nothing):
    name, disk = "full disk", True

    def begin(self, service, other):
        service.client.ask("record", file="take.csv")

    def end(self, service):
        service.client.send("record stop")
        for line in service.client.lines:
            event = json.loads(line)
            if event.get("event") == "record":
                break
        if event["rows_lost"] == 0:
            raise RuntimeError("the disk was not full")
        return f"{event['rows_lost']} of {event['rows']} rows lost"


class Deaf(Nothing):
    name = "blocked readers"

    def begin(self, service, other):
        self.deaf = [Client(service.path, 4096) for _ in range(16)]
        for client in self.deaf:
            client.send("stream", rate=100)

    def end(self, service):
        dropped, end_s = 0, service.client.ask("status")["t_s"]
        for client in self.deaf:
            most = 0
            client.socket.settimeout(5)
            while most == 0:
                row = json.loads(client.lines.readline())
                most = row.get("dropped", 0)
                if most == 0 and row.get("t_s", 0) > end_s:
                    raise RuntimeError("all streams went through: longer windows")
            dropped += most
            client.socket.close()
        return f"{dropped} streams dropped"


class Connections(Nothing):
    name = "1,000 connections"

    def begin(self, service, other):
        self.clients = [Client(service.path) for _ in range(1000)]

    def end(self, service):
        refused = service.client.ask("status")["clients_refused"]
        for client in self.clients:
            client.socket.close()
        if refused == 0:
            raise RuntimeError("all connections were taken")
        return f"{refused} refused"


class Load(Nothing):
    name = "loaded processor"

    def begin(self, service, other):
        self.run = subprocess.Popen(
            ["taskset", "-c", str(other), sys.executable, "-c", COPY])

    def end(self, service):
        with open(f"/proc/{self.run.pid}/stat") as file:
            ticks = sum(map(int, file.read().rsplit(")")[1].split()[11:13]))
        self.run.kill()
        self.run.wait()
        if ticks == 0:
            raise RuntimeError("the load did not run")
        return f"{ticks / os.sysconf('SC_CLK_TCK'):.1f} s of the other processor"


# --- windows ----------------------------------------------------------------

class Figures:
    """Of all windows of a condition."""

    def __init__(self):
        self.slewd, self.cyclic, self.ratios = {}, {}, []
        self.lost = self.missed = self.faults = self.stops = self.ticks = 0
        self.cost = []

    def window(self, service, condition, cpu, other, seconds):
        phase_us = service.phase_us()
        condition.begin(service, other)
        before = service.client.ask("latency")
        cyclic = cyclictest(cpu, seconds, (phase_us + 500) % 1000)
        after = service.client.ask("latency")
        self.cost.append(condition.end(service))
        state = service.client.ask("status")
        self.stops += state["state"] == "fault"
        ticks = dict(map(tuple, after["late_us"]))
        for us, times in before["late_us"]:
            ticks[us] -= times
        binned = {}
        for us, times in cyclic.items():
            add(binned, {bin_us(us): times})
            self.missed += us // 1000 * times
        add(self.slewd, ticks)
        add(self.cyclic, binned)
        self.ratios.append(p999(ticks) / p999(binned))
        self.lost += after["ticks_lost"] - before["ticks_lost"]
        self.ticks += after["ticks"] - before["ticks"]
        self.faults += after["page_faults"]

    def ratio(self):
        return p999(self.slewd) / p999(self.cyclic)

    def say(self, name):
        low, high = min(self.ratios), max(self.ratios)
        median = sorted(self.ratios)[len(self.ratios) // 2]
        print(f"  {name:18} {p999(self.cyclic):10d} {p999(self.slewd):6d} "
              f"{self.ratio():6.2f} {low:6.2f} {median:5.2f} {high:5.2f} "
              f"{self.ticks:7d} {self.missed:7d} {self.lost:5d} "
              f"{self.faults:6d} {self.stops:5d}  {'; '.join(filter(None, self.cost))}",
              flush=True)


def begin(slew, condition, directory, cpu, disk, figures):
    """A service as the condition needs it; one that stops on the way is counted."""
    for _ in range(BEGINS):
        service = Service(slew, directory, cpu, disk)
        try:
            if condition.moves:
                service.play()
            return service
        except RuntimeError as error:
            print(f"    begun again: {error}")
            figures.stops += 1
            service.end()
    sys.exit("latency.py: no service has come to its window")


def measure(slew, condition, seconds, windows, figures):
    last = os.cpu_count() - 1
    for window in range(windows):
        cpu, other = ((0, last), (last, 0))[window % 2]
        directory = tempfile.mkdtemp()
        disk = os.path.join(directory, "disk") if condition.disk else None
        if disk:
            os.mkdir(disk)
        service = begin(slew, condition, directory, cpu, disk, figures)
        try:
            figures.window(service, condition, cpu, other, seconds)
        finally:
            service.end()
            shutil.rmtree(directory)


def instructions(test):
    """Of the ticks of each of its tests.  Without skipping procedure linkage tables:
    what callgrind skips, --zero-before does not set to zero, so that the first count
    would have what it took to bind a function in a tick before those."""
    with tempfile.TemporaryDirectory() as directory:
        subprocess.run(
            ["valgrind", "--tool=callgrind", "--toggle-collect=service_loop_tick",
             "--zero-before=tick_main", "--dump-after=down", "--skip-plt=no",
             f"--callgrind-out-file={directory}/out", test],
            env={**os.environ, "TICK_UNFILTERED": "1"}, capture_output=True,
            check=True)
        count = []
        for number in range(len(COUNTED)):
            with open(f"{directory}/out.{number + 1}") as file:
                count.append(int(re.search(r"^totals: (\d+)", file.read(),
                                           re.MULTILINE).group(1)))
    return count


def judge_instructions(test):
    """What is wrong, a line each."""
    count = instructions(test)
    print(f"instructions of {COUNTED_TICKS} ticks of two axes")
    for name, ticks in zip(COUNTED, count):
        print(f"  {name:24} {ticks:10d}  {ticks / COUNTED_TICKS:8.0f} per tick")
    return [f"{name}: {ticks} instructions, expected {count[0]}"
            for name, ticks in zip(COUNTED[:-1], count) if ticks != count[0]]


def judge_wake_ups(slew, seconds, windows):
    """What is wrong, a line each."""
    if shutil.which("cyclictest") is None:
        sys.exit("latency.py: no cyclictest, expected the package rt-tests")
    resource.setrlimit(resource.RLIMIT_NOFILE, (4096, 4096))
    print(f"wake-ups every ms, {windows} windows of {seconds} s, on each "
          "processor in turn: all but 1 in 1000 within, us\n"
          f"  {'':18} cyclictest  slewd  ratio  least  med.  most   ticks  "
          "missed  lost faults stops")
    bad = []
    for condition in (Idle(), Nothing(), FullDisk(), Deaf(), Connections(), Load()):
        figures, name = Figures(), condition.name
        judged = name in ("off", "moving")
        measure(slew, condition, seconds, windows if judged else 2, figures)
        figures.say(name)
        if judged and figures.ratio() > RATIO:
            bad.append(f"{name}: the ratio is {figures.ratio():.2f}, at most {RATIO}")
        if figures.faults:
            bad.append(f"{name}: {figures.faults} page faults")
    return bad


def main():
    slew, test = map(os.path.abspath, sys.argv[1:3])
    seconds = int(sys.argv[3]) if len(sys.argv) > 3 else 20
    windows = int(sys.argv[4]) if len(sys.argv) > 4 else 6
    bad = judge_instructions(test)
    if windows > 0:
        bad += judge_wake_ups(slew, seconds, windows)
    for line in bad:
        print(f"latency.py: {line}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
