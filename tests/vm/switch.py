#!/usr/bin/env python3
"""A switch on the rail of an axis: closed from a position down.

    switch.py INTERFACE NODE PULL POSITION

Listens to TPDO1 (statusword, position in counts) on the bus and drives the
simulated line whose file is PULL.
"""
import socket
import struct
import sys


def main():
    interface, node, pull, edge = sys.argv[1:]
    bus = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    bus.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER,
                   struct.pack("=II", 0x180 + int(node), 0x7FF))
    bus.bind((interface,))
    closed = None
    print("ready", flush=True)
    while True:
        data = bus.recv(16)[8:]
        at = struct.unpack("<i", data[2:6])[0]
        now = at <= int(edge)
        if now == closed:
            continue
        closed = now
        with open(pull, "w") as line:
            line.write("pull-up" if closed else "pull-down")
        print("pressed" if closed else "let go", "at", at, flush=True)


main()
