#!/usr/bin/env python3
"""tests/bench/stop.py SLEW [--tries N] [--ticks MS,MS] - how long a stop takes on the
clock of this machine: 64 clients, the one that has control sends 2,000 jogs a second,
others ask, send what is none, and read nothing; another one's stop.

The time is from before the line is sent to the nominal time of the tick that obeys,
in ticks, rounded up; two are what a service takes on a machine with real-time
priority and a processor for it.  test_stop claims them in virtual time, where no
scheduler is in the way.  Also how long status and renew take meanwhile."""
import argparse
import json
import math
import multiprocessing
import os
import random
import select
import signal
import socket
import subprocess
import tempfile
import time

RIG = """tick: %d ms
axes:
  dolly:
    unit: mm
    limits: {position: [-9000 mm, 9000 mm], velocity: 300 mm/s, acceleration: 9000 mm/s2, jerk: 800000 mm/s3}
    following_error: {floor: 90 mm, time: 20 ms}
    drive: {kind: virtual}
"""
HELD_UP_S = 0.0003  # between two looks at the clock around a line that is sent
LOOK_S = 0.005      # between two looks at what has come, where one is due every ms
LET_GO_S = 0.1      # twice what a jog lasts
JOG = b'{"command":"jog","axis":"dolly","speed":20,"to":9000,"for":0.05}\n'
CROWD = [b'{"command":"status"}\n', b'{"command":"renew"}\n', b"nonsense\n{}\n[]\n",
         b'{"command":"hel', b'{"command":"latency"}\n', b'{"command":"check","text":"stop"}\n']


class Client:
    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.connect(path)
        self.rest = b""
        self.ids = 0

    def line(self, until):
        while b"\n" not in self.rest:
            left = until - time.monotonic()
            if left <= 0 or not select.select([self.socket], [], [], left)[0]:
                return None
            got = self.socket.recv(65536)
            if not got:
                raise SystemExit("the service has hung up")
            self.rest += got
        line, self.rest = self.rest.split(b"\n", 1)
        line = json.loads(line)
        if line.get("event") == "fault" or line.get("state") == "fault":
            raise SystemExit("the machine was too busy for the tick: %s" % line)
        return line

    def until(self, look, seconds=20):
        end = time.monotonic() + seconds
        while True:
            line = self.line(end)
            if line is None:
                raise SystemExit("nothing came in %d s" % seconds)
            if look(line):
                return line

    def send(self, command, **members):
        self.ids += 1
        members.update(id=self.ids, command=command)
        self.socket.sendall(json.dumps(members).encode() + b"\n")
        return self.ids

    def ask(self, command, **members):
        number = self.send(command, **members)
        return self.until(lambda line: line.get("id") == number)

    def state(self, *wanted):
        return self.until(lambda line: line.get("event") == "state" and line["state"] in wanted)


def hold(path, ready, renewed):
    """Takes control, and sends 2,000 jogs a second, but for a while after each stop; now and
    then a renew, timed: how long it took, and the longest that this program itself was
    held up meanwhile."""
    self = Client(path)
    self.ask("take", lease=60)
    self.ask("enable")
    while self.ask("status")["state"] != "ready":
        time.sleep(0.01)
    ready.set()
    self.socket.setblocking(False)
    due, sent, said, waits, held_up = time.monotonic(), 0, b"", None, 0
    presses = due
    looked = due
    while True:
        due += 0.001
        time.sleep(max(0, due - time.monotonic()))
        held_up, looked = max(held_up, time.monotonic() - looked), time.monotonic()
        try:
            sent += 1
            if looked >= presses:
                self.socket.send(2 * JOG)
            if sent % 500 == 0 and waits is None:
                waits, held_up = time.monotonic(), 0
                self.socket.send(b'{"id":"renew","command":"renew"}\n')
            heard = self.socket.recv(1 << 20)
            if b'"state":"stopping"' in heard or b'"state":"ready"' in heard:
                presses = time.monotonic() + LET_GO_S  # what a stop has ended is let go
            said = (said + heard)[-(1 << 20):]
        except BlockingIOError:
            pass
        if waits is not None and b'"renew"' in said:
            renewed.append((time.monotonic() - waits, held_up))
            waits, said = None, b""


def crowd(path, clients):
    """The others; every fourth reads nothing."""
    all_of_them = [Client(path) for _ in range(clients)]
    for client in all_of_them:
        client.socket.setblocking(False)
    while True:
        time.sleep(0.002)
        for client in random.sample(all_of_them, 8):
            try:
                client.socket.send(random.choice(CROWD))
            except BlockingIOError:
                pass
        for i, client in enumerate(all_of_them):
            try:
                if i % 4:
                    client.socket.recv(1 << 16)
            except BlockingIOError:
                pass


def share(values, part):
    return sorted(values)[min(len(values) - 1, int(part * len(values)))]


def row(what, values, unit):
    print("  %-28s p50 %8.3f  p99 %8.3f  max %8.3f %s" %
          (what, share(values, 0.5), share(values, 0.99), max(values), unit), flush=True)


def tries(path, tick_s, count, renewed):
    self = Client(path)
    ticks, looks = [], []

    def lost():
        return self.ask("status")["tick"]["ticks_lost"]

    before = lost()
    while self.ask("status")["state"] != "moving":
        time.sleep(0.01)
    for i in range(count):
        if i > 0:
            self.state("moving")
        time.sleep(random.random() * 4 * tick_s)
        if i % 10 == 0:
            begin = time.monotonic()
            self.ask("status")
            looks.append(1000 * (time.monotonic() - begin))
        begin = time.monotonic()
        number = self.send("stop")
        sent = time.monotonic()
        seen = []
        self.until(lambda line: (
            seen.append(line) if line.get("id") == number or
            (line.get("event") == "state" and line["state"] in ("stopping", "ready") and
             line["t_s"] > begin - tick_s) else None,
            len(seen) == 2)[1])
        obeyed = [line for line in seen if "event" in line]
        if sent - begin < HELD_UP_S:
            ticks.append(math.ceil((obeyed[0]["t_s"] - begin) / tick_s))
    print("ticks of %g ms, 64 clients, %d tries, of %d more this program was itself held up:" %
          (1000 * tick_s, len(ticks), count - len(ticks)))
    row("a stop is obeyed", ticks, "ticks")
    print("  %-28s %d of %d" % ("in more than two", sum(t > 2 for t in ticks), len(ticks)))
    print("  %-28s %d" % ("ticks that the machine lost", lost() - before))
    row("status is answered", looks, "ms")
    own = [1000 * took for took, held_up in renewed if held_up < LOOK_S]
    if own:
        row("renew of who has control", own, "ms")
        print("  %-28s %d" % ("and so many held up", len(renewed) - len(own)))


def serve(slew, tick_ms, count):
    with tempfile.TemporaryDirectory() as folder, multiprocessing.Manager() as manager:
        rig, path = os.path.join(folder, "rig.yaml"), os.path.join(folder, "socket")
        with open(rig, "w") as file:
            file.write(RIG % tick_ms)
        service = subprocess.Popen([slew, "service", "run", "--sim", "--socket", path, rig])
        while not os.path.exists(path):
            time.sleep(0.05)
        ready, renewed = multiprocessing.Event(), manager.list()
        others = [multiprocessing.Process(target=hold, args=(path, ready, renewed), daemon=True),
                  multiprocessing.Process(target=crowd, args=(path, 62), daemon=True)]
        others[0].start()
        ready.wait(30)
        others[1].start()
        try:
            tries(path, tick_ms / 1000, count, renewed)
        finally:
            for other in others:
                other.kill()
            service.send_signal(signal.SIGTERM)
            service.wait(30)


def main():
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("slew")
    words.add_argument("--tries", type=int, default=1000)
    words.add_argument("--ticks", default="1,10")
    chosen = words.parse_args()
    for tick_ms in chosen.ticks.split(","):
        serve(chosen.slew, int(tick_ms), chosen.tries)


if __name__ == "__main__":
    main()
