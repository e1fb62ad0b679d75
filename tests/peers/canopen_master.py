#!/usr/bin/env python3
"""python-canopen as master of one of our simulated drives.

    canopen_master.py INTERFACE NODE EDS

Reads the dictionary, long objects by segments and by blocks, takes the drive
through the CiA 402 states, moves it in CSP, provokes a fault and clears it, then
goes to a position, runs at speeds, homes it and stores a position.
"""
import logging
import sys
import time

import canopen
from canopen.profiles.p402 import BaseNode402

logging.disable(logging.WARNING)
claims = 0


def claim(what, holds):
    global claims
    if not holds:
        sys.exit(f"canopen_master: {what}: no")
    claims += 1
    print(f"  {what}")


def aborts(call):
    try:
        call()
    except canopen.SdoAbortedError as error:
        return error.code
    return None


def sdo(node):
    od = node.sdo
    claim("device type is a servo", od[0x1000].raw == 0x20192)
    claim("identity", od[0x1018][2].raw == 402)
    claim("name by segments", od[0x1008].raw == "slew servo")
    text = bytes(range(256)) * 3 + b"end"
    with od[0x2002].open("wb", size=len(text)) as file:
        file.write(text)
    with od[0x2002].open("rb") as file:
        claim("771 bytes by segments, both ways", file.read() == text)
    text = bytes(reversed(text))
    with od[0x2002].open("wb", size=len(text), block_transfer=True) as file:
        file.write(text)
    with od[0x2002].open("rb", block_transfer=True) as file:
        claim("771 bytes by blocks, both ways, with CRC", file.read() == text)
    claim("a missing object aborts",
          aborts(lambda: node.sdo.upload(0x5FFF, 0)) == 0x06020000)
    claim("a missing sub-index aborts",
          aborts(lambda: node.sdo.upload(0x1018, 9)) == 0x06090011)
    claim("a read-only object aborts",
          aborts(lambda: node.sdo.download(0x1000, 0, bytes(4))) == 0x06010002)
    claim("a wrong length aborts",
          aborts(lambda: node.sdo.download(0x1017, 0, bytes(4))) == 0x06070010)


def network_services(network, node):
    node.sdo[0x1017].raw = 50
    claim("heartbeat", node.nmt.wait_for_heartbeat(2) == "PRE-OPERATIONAL")
    node.nmt.state = "OPERATIONAL"
    node.nmt.wait_for_heartbeat(2)
    claim("operational", node.nmt.wait_for_heartbeat(2) == "OPERATIONAL")
    node.nmt.state = "PRE-OPERATIONAL"
    node.nmt.wait_for_heartbeat(2)
    claim("pre-operational again",
          node.nmt.wait_for_heartbeat(2) == "PRE-OPERATIONAL")
    network.time.transmit()
    network.lss.send_switch_state_global(network.lss.CONFIGURATION_STATE)
    claim("LSS tells the node number",
          network.lss.inquire_node_id() == node.id)
    claim("LSS tells the product",
          network.lss.inquire_lss_address(0x5B) == 402)
    network.lss.send_switch_state_global(network.lss.WAITING_STATE)


def map_pdos(node):
    node.rpdo.read()
    node.tpdo.read()
    for pdo, objects in ((node.rpdo[1], (0x6040, 0x607A)),
                         (node.tpdo[1], (0x6041, 0x6064))):
        pdo.clear()
        for index in objects:
            pdo.add_variable(index)
        pdo.trans_type = 1
        pdo.enabled = True
    node.rpdo.save()
    node.tpdo.save()


def mapping_is_read_back(node):
    claim("mapping is read back",
          [v.index for v in node.tpdo[1].map] == [0x6041, 0x6064]
          and node.sdo[0x1600][2].raw == 0x607A0020)


def move(node):
    start = node.sdo[0x6064].raw
    target = start
    for step in range(60):  # like every CSP master: a little further each time
        target = start + 20 * step
        node.rpdo[1][0x607A].raw = target
        time.sleep(0.02)
    time.sleep(0.5)
    actual = node.sdo[0x6064].raw
    claim(f"it follows: {actual - start} of {target - start}",
          abs(actual - target) <= 5 and target != start)


def states(network, node):
    map_pdos(node)
    mapping_is_read_back(node)
    node.sdo[0x2001].raw = 0  # our targets are not as regular as SYNC
    node.setup_402_state_machine(False)
    network.sync.start(0.02)
    node.nmt.state = "OPERATIONAL"
    time.sleep(0.3)
    claim("starts disabled", node.state == "SWITCH ON DISABLED")
    node.op_mode = "CYCLIC SYNCHRONOUS POSITION"
    claim("CSP is the mode",
          node.op_mode == "CYCLIC SYNCHRONOUS POSITION")
    node.rpdo[1][0x607A].raw = node.sdo[0x6064].raw
    node.rpdo[1].start(0.02)
    for state in ("READY TO SWITCH ON", "SWITCHED ON", "OPERATION ENABLED"):
        node.state = state
        claim(state.lower(), node.state == state)
    move(node)


def faults(node):
    heard = []
    node.emcy.add_callback(lambda error: heard.append(error.code))
    node.sdo.download(0x2000, 0, b"\x01")  # an over-current
    time.sleep(1)
    claim("EMCY tells of it", 0x2310 in heard)
    claim("fault", node.state == "FAULT")
    claim("error code", node.sdo[0x603F].raw == 0x2310)
    node.state = "SWITCH ON DISABLED"  # resets
    claim("reset", node.state == "SWITCH ON DISABLED")
    claim("EMCY says all clear", heard[-1] == 0)


def until(node, mask, value, seconds=10):
    """Wait for bits of the statusword; False when they do not come."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if node.tpdo[1][0x6041].raw & mask == value:
            return True
        time.sleep(0.01)
    return False


def profile_position(node):
    node.op_mode = "PROFILED POSITION"
    for index, value in ((0x6081, 3000), (0x6083, 20000), (0x6084, 20000)):
        node.sdo[index].raw = value
    start = node.sdo[0x6064].raw
    for way in (1500, -700):
        target = start + way
        node.rpdo[1][0x607A].raw = target
        node.controlword = 0x1F
        claim("PP: set point acknowledged", until(node, 0x1000, 0x1000))
        node.controlword = 0x0F
        claim("PP: buffer free", until(node, 0x1000, 0))
        claim("PP: target reached", until(node, 0x400, 0x400))
        time.sleep(0.5)
        actual = node.sdo[0x6064].raw
        claim(f"PP: at {actual - start} of {way}", abs(actual - target) <= 2)


def speeds(node):
    for mode, target in (("PROFILED VELOCITY", 1200),
                         ("CYCLIC SYNCHRONOUS VELOCITY", -800)):
        node.op_mode = mode
        node.sdo[0x60FF].raw = target
        time.sleep(1)
        actual = node.sdo[0x606C].raw
        claim(f"{mode.lower()}: {actual} of {target} counts/s",
              abs(actual - target) <= 20)
        node.sdo[0x60FF].raw = 0
        time.sleep(0.5)
        claim(f"{mode.lower()}: stands", abs(node.sdo[0x606C].raw) <= 2)


def homing(node):
    for index, sub, value in ((0x6099, 1, 4000), (0x6099, 2, 400),
                              (0x609A, 0, 20000)):
        entry = node.sdo[index][sub] if sub else node.sdo[index]
        entry.raw = value
    node.sdo[0x607C].raw = -250
    node.sdo[0x6098].raw = 20  # the lower edge of the home switch, at 20 mm
    claim("HM: python-canopen says it is homed",
          node.homing(timeout=30) is True)
    time.sleep(0.5)
    node.op_mode = "PROFILED POSITION"
    node.rpdo[1][0x607A].raw = -250
    node.controlword = 0x1F
    until(node, 0x1000, 0x1000)
    node.controlword = 0x0F
    claim("HM: back to the home point", until(node, 0x1400, 0x400))
    claim("a homing method it has not aborts",
          aborts(lambda: node.sdo.download(0x6098, 0, b"\x0F")) == 0x06090030)


def modes(node):
    node.rpdo[1][0x607A].raw = node.sdo[0x6064].raw
    for state in ("READY TO SWITCH ON", "SWITCHED ON", "OPERATION ENABLED"):
        node.state = state
    profile_position(node)
    speeds(node)
    homing(node)


def main():
    interface, number, eds = sys.argv[1:]
    network = canopen.Network()
    network.connect(channel=interface, interface="socketcan")
    node = BaseNode402(int(number), eds)
    network.add_node(node)
    sdo(node)
    network_services(network, node)
    states(network, node)
    faults(node)
    modes(node)
    node.rpdo[1].stop()
    network.sync.stop()
    node.nmt.state = "PRE-OPERATIONAL"
    network.disconnect()
    print(f"{claims} passed")


main()
