#!/usr/bin/env python3
"""A servo made of python-canopen's LocalNode and an EDS file, for our master.

    canopen_servo.py INTERFACE NODE EDS

Answers SDOs from the dictionary, sends a heartbeat and TPDO1 at SYNC, walks
through the CiA 402 states, and follows 0x607A.  Ends when its input does.
"""
import struct
import sys

import canopen

# Controlword to state, by the state it is in (CiA 402-2, transitions 2 to 10).
READY, ON, ENABLED, DISABLED, QUICK = 0x21, 0x23, 0x27, 0x40, 0x07


def next_state(state, word):
    if not word & 2:
        return DISABLED
    if not word & 4:
        return state if state == QUICK else \
            QUICK if state == ENABLED else DISABLED
    wish = word & 0xF
    if state == DISABLED:
        return READY if wish & 7 == 6 else state
    if state == READY:
        return ON if wish & 7 == 7 else state
    if wish & 7 == 6:
        return READY
    if state in (ON, ENABLED):
        return ENABLED if wish == 0xF else ON
    return state


class Servo:
    def __init__(self, interface, number, eds):
        self.network = canopen.Network()
        self.network.connect(channel=interface, interface="socketcan")
        self.node = canopen.LocalNode(number, eds)
        self.network.add_node(self.node)
        self.state, self.target, self.actual = DISABLED, 0, 1000
        self.pending = None
        self.syncs = self.answered = 0
        self.node.sdo[0x6064].raw = self.actual
        self.node.sdo[0x6041].raw = self.statusword()
        self.node.add_write_callback(self.written)
        self.network.subscribe(0x80, self.sync)
        self.network.subscribe(0x200 + number, self.rpdo)
        self.node.nmt.send_command(0)
        self.node.nmt.start_heartbeat(50)

    def statusword(self):
        follows = 0x1000 if self.state == ENABLED else 0
        return self.state | 0x0210 | follows | (0x20 if self.state in (
            READY, ON, ENABLED) else 0)

    def written(self, index, subindex, od, data):
        if index == 0x6060:
            self.node.sdo[0x6061].raw = struct.unpack("b", data)[0]
        elif index == 0x607A and self.state != ENABLED:
            self.target = struct.unpack("<i", data)[0]
        elif index == 0x6040:
            self.state = next_state(self.state, struct.unpack("<H", data)[0])
            self.node.sdo[0x6041].raw = self.statusword()
        elif index == 0x1017:
            self.node.nmt.start_heartbeat(struct.unpack("<H", data)[0])

    def rpdo(self, can_id, data, timestamp):
        self.pending = bytes(data)

    def sync(self, can_id, data, timestamp):
        self.syncs += 1
        if self.node.nmt.state != "OPERATIONAL":
            return
        if self.pending is not None:
            word, target = struct.unpack("<Hi", self.pending[:6])
            self.pending = None
            self.state = next_state(self.state, word)
            if self.state == ENABLED:
                self.actual = self.target  # reached in one period
                self.target = target
        self.node.sdo[0x6064].raw = self.actual
        self.node.sdo[0x6041].raw = self.statusword()
        mapped = self.node.sdo[0x1A00][0].raw
        if mapped != 2:
            return
        self.answered += 1
        self.network.send_message(
            0x180 + self.node.id,
            struct.pack("<Hi", self.statusword(), self.actual))


def main():
    interface, number, eds = sys.argv[1:]
    servo = Servo(interface, int(number), eds)
    print("ready", flush=True)
    sys.stdin.read()
    sdo = servo.node.sdo
    print(f"told: limits {sdo[0x607D][1].raw} .. {sdo[0x607D][2].raw}, "
          f"following error {sdo[0x6065].raw} for {sdo[0x6066].raw} ms, "
          f"options {sdo[0x605A].raw} {sdo[0x605D].raw}, "
          f"SYNC counts to {sdo[0x1019].raw}", flush=True)
    print(f"{servo.syncs} SYNCs, {servo.answered} answered, "
          f"at {servo.actual}", flush=True)
    servo.network.disconnect()


main()
