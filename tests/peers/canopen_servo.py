#!/usr/bin/env python3
"""A servo made of python-canopen's LocalNode and an EDS file, for our master.

    canopen_servo.py INTERFACE NODE EDS [AXES]

Answers SDOs from the dictionary, sends a heartbeat and TPDO1 at SYNC, walks
through the CiA 402 states, and follows 0x607A.  In NMT Stopped it takes no SDO
(CiA 301 7.3.2.2), which LocalNode by itself would, and keeps the state of its
drive.  Ends when its input does.
"""
import struct
import sys

import canopen

from canopen_axes import OBJECTS, PDOS, RX, TX, with_second_axis

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


class Axis:
    """One axis of the node: its objects and PDOs, from 0."""

    def __init__(self, servo, number):
        self.servo, self.sdo = servo, servo.node.sdo
        self.objects, self.pdos = OBJECTS * number, PDOS * number
        self.tx = TX if number else 0x180 + servo.node.id
        self.state, self.target, self.actual = DISABLED, 0, 1000
        self.pending = None
        self.answered = 0
        self.publish()
        servo.network.subscribe(RX if number else 0x200 + servo.node.id,
                                self.rpdo)

    def object(self, index):
        return self.sdo[index + self.objects]

    def statusword(self):
        follows = 0x1000 if self.state == ENABLED else 0
        return self.state | 0x0210 | follows | (0x20 if self.state in (
            READY, ON, ENABLED) else 0)

    def publish(self):
        self.object(0x6064).raw = self.actual
        self.object(0x6041).raw = self.statusword()

    def written(self, index, data):
        if index == 0x6060:
            self.object(0x6061).raw = struct.unpack("b", data)[0]
        elif index == 0x607A and self.state != ENABLED:
            self.target = struct.unpack("<i", data)[0]
        elif index == 0x6040:
            self.state = next_state(self.state, struct.unpack("<H", data)[0])
            self.publish()

    def rpdo(self, can_id, data, timestamp):
        self.pending = bytes(data)

    def sync(self):
        if self.pending is not None:
            word, target = struct.unpack("<Hi", self.pending[:6])
            self.pending = None
            self.state = next_state(self.state, word)
            if self.state == ENABLED:
                self.actual = self.target  # reached in one period
                self.target = target
        self.publish()
        if self.sdo[0x1A00 + self.pdos][0].raw != 2:
            return
        self.answered += 1
        self.servo.network.send_message(
            self.tx, struct.pack("<Hi", self.statusword(), self.actual))

    def told(self):
        limit = self.object(0x607D)
        return (f"limits {limit[1].raw} .. {limit[2].raw}, following error "
                f"{self.object(0x6065).raw} for {self.object(0x6066).raw} ms, "
                f"options {self.object(0x605A).raw} "
                f"{self.object(0x605D).raw}")


class Servo:
    def __init__(self, interface, number, eds, axes):
        self.network = canopen.Network()
        self.network.connect(channel=interface, interface="socketcan")
        self.node = canopen.LocalNode(
            number, with_second_axis(eds, number) if axes > 1 else eds)
        self.network.add_node(self.node)
        server = self.node.sdo
        self.network.unsubscribe(server.rx_cobid, server.on_request)
        self.network.subscribe(server.rx_cobid, self.request)
        self.axis = [Axis(self, i) for i in range(axes)]
        self.syncs = 0
        self.node.add_write_callback(self.written)
        self.network.subscribe(0x80, self.sync)
        self.node.nmt.send_command(0)  # boot-up, once
        self.node.nmt.send_command(128)
        self.node.nmt.start_heartbeat(50)

    def request(self, can_id, data, timestamp):
        if self.node.nmt.state != "STOPPED":
            self.node.sdo.on_request(can_id, data, timestamp)

    def written(self, index, subindex, od, data):
        if index == 0x1017:
            self.node.nmt.start_heartbeat(struct.unpack("<H", data)[0])
        for axis in self.axis:
            axis.written(index - axis.objects, data)

    def sync(self, can_id, data, timestamp):
        self.syncs += 1
        if self.node.nmt.state == "OPERATIONAL":
            for axis in self.axis:
                axis.sync()


def main():
    interface, number, eds, *axes = sys.argv[1:]
    servo = Servo(interface, int(number), eds, int(axes[0]) if axes else 1)
    print("ready", flush=True)
    sys.stdin.read()
    for axis in servo.axis:
        print(f"told: {axis.told()}, SYNC counts to "
              f"{servo.node.sdo[0x1019].raw}", flush=True)
    for axis in servo.axis:
        print(f"{servo.syncs} SYNCs, {axis.answered} answered, "
              f"at {axis.actual}", flush=True)
    servo.network.disconnect()


main()
