#!/usr/bin/env python3
"""python-canopen as master of two axes behind one of our simulated nodes.

    canopen_axes.py INTERFACE NODE EDS

The data sheet is that of a drive of one axis: here the second gets the objects
that CiA 301 7.5.2.1 gives it, 0x800 further, and its PDOs from number 65 on.
"""
import copy
import logging
import sys
import time

import canopen

OBJECTS, PDOS, KIND = 0x800, 64, 0x200  # of an axis; of one kind of PDO
RX, TX = 0x405, 0x385  # of the second axis, in the rig's `pdo:`
claims = 0


def moved(entry, by):
    entry = copy.deepcopy(entry)
    entry.index += by
    entry.name = f"{entry.name} of axis 2"
    for sub in getattr(entry, "subindices", {}).values():
        sub.index += by
    return entry


def with_second_axis(eds, number):
    """The dictionary of a drive of two axes."""
    od = canopen.import_od(eds, number)
    for index in list(od.indices):
        if 0x6000 <= index < 0x6000 + OBJECTS:
            od.add_object(moved(od[index], OBJECTS))
        elif 0x1400 <= index < 0x1C00 and index % KIND < PDOS:
            od.add_object(moved(od[index], PDOS))
    return od


def claim(what, holds):
    global claims
    if not holds:
        sys.exit(f"canopen_axes: {what}: no")
    claims += 1
    print(f"  {what}")


def comes(holds, seconds=10):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if holds():
            return True
        time.sleep(0.01)
    return False


def axis(node, index, number):
    return node.sdo[index + OBJECTS * (number - 1)]


def enable(node, number):
    for word, state in ((0x06, 0x21), (0x07, 0x23), (0x0F, 0x27)):
        axis(node, 0x6040, number).raw = word
        if not comes(lambda: axis(node, 0x6041, number).raw & 0x6F == state):
            return False
    return True


def stands(node, number):
    return axis(node, 0x6041, number).raw & 0x4F == 0x40 and \
        axis(node, 0x606C, number).raw == 0


def second_pdo(node, heard):
    """Its own identifier and mapping, as the rig's master would set them."""
    parameter, mapping = node.sdo[0x1800 + PDOS], node.sdo[0x1A00 + PDOS]
    parameter[1].raw = 0x80000000 | TX
    mapping[0].raw = 0
    mapping[1].raw = 0x68410010
    mapping[2].raw = 0x68640020
    mapping[0].raw = 2
    parameter[2].raw = 1
    parameter[1].raw = TX
    node.network.subscribe(TX, lambda can_id, data, t: heard.append(data))


def main():
    logging.disable(logging.WARNING)
    interface, number, eds = sys.argv[1:]
    network = canopen.Network()
    network.connect(channel=interface, interface="socketcan")
    node = network.add_node(canopen.RemoteNode(
        int(number), with_second_axis(eds, int(number))))
    node.sdo.RESPONSE_TIMEOUT = 5
    heard = []
    claim("both axes are servos", node.sdo[0x6FFF].raw & 0xFFFF == 402
          and node.sdo[0x1000].raw & 0xFFFF == 402)
    second_pdo(node, heard)
    claim("the second axis's mapping is read back",
          node.sdo[0x1A00 + PDOS][2].raw == 0x68640020)
    network.sync.start(0.02)
    node.nmt.state = "OPERATIONAL"
    for which in (1, 2):
        axis(node, 0x6060, which).raw = 3  # profile velocity
        axis(node, 0x6083, which).raw = axis(node, 0x6084, which).raw = 20000
    claim("the second axis is enabled by its own controlword",
          enable(node, 2))
    claim("the first is not", stands(node, 1))
    axis(node, 0x60FF, 2).raw = 1200
    claim("it turns, and the first stands",
          comes(lambda: abs(axis(node, 0x606C, 2).raw - 1200) <= 2)
          and stands(node, 1))
    claim("its PDO tells of it", comes(lambda: len(heard) > 2) and
          heard[-1][0] & 0x6F == 0x27 and
          int.from_bytes(heard[-1][2:6], "little", signed=True) >
          int.from_bytes(heard[0][2:6], "little", signed=True))
    claim("the first is enabled beside it", enable(node, 1))
    axis(node, 0x60FF, 1).raw = -800
    claim("both turn, each as it is told",
          comes(lambda: abs(axis(node, 0x606C, 1).raw + 800) <= 2) and
          abs(axis(node, 0x606C, 2).raw - 1200) <= 2)
    for which in (1, 2):
        axis(node, 0x6040, which).raw = 0
    claim("both are off", comes(lambda: all(
        axis(node, 0x6041, which).raw & 0x4F == 0x40 for which in (1, 2))))
    network.sync.stop()
    network.disconnect()
    print(f"  {claims} claims")


if __name__ == "__main__":
    main()
