#!/usr/bin/env python3
"""python-canopen as master of one of our simulated drives.

    canopen_master.py INTERFACE NODE EDS

Reads the dictionary, long objects by segments and by blocks, takes the drive
through the CiA 402 states, moves it in CSP, provokes a fault and clears it, then
goes to a position (PP), runs at speeds (PV, CSV) and homes it (HM).
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


def comes(holds, seconds=10):
    """Whether it comes to hold: waits for it, since either side may be late."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if holds():
            return True
        time.sleep(0.01)
    return False


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
    claim(f"it follows to {target - start}",
          comes(lambda: abs(node.sdo[0x6064].raw - target) <= 5))


def states(network, node):
    map_pdos(node)
    mapping_is_read_back(node)
    node.sdo[0x2001].raw = 0  # our targets are not as regular as SYNC
    node.setup_402_state_machine(False)
    network.sync.start(0.02)
    node.nmt.state = "OPERATIONAL"
    claim("starts disabled",
          comes(lambda: node.state == "SWITCH ON DISABLED"))
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
    claim("EMCY tells of it", comes(lambda: 0x2310 in heard))
    claim("fault", comes(lambda: node.state == "FAULT"))
    claim("error code", node.sdo[0x603F].raw == 0x2310)
    node.state = "SWITCH ON DISABLED"  # resets
    claim("reset", node.state == "SWITCH ON DISABLED")
    claim("EMCY says all clear", comes(lambda: heard[-1] == 0))


def status_comes(node, mask, value):
    return comes(lambda: node.tpdo[1][0x6041].raw & mask == value)


def speed_comes(node, wanted):
    node.sdo[0x60FF].raw = wanted
    return comes(lambda: abs(node.sdo[0x606C].raw - wanted) <= 2)


def go_to(node, target):
    # homing leaves bit 4 set, and bit 12 means something else there: the edge
    # counts, so the drive must have seen it low
    node.controlword = 0x0F
    claim("PP: nothing is asked for",
          comes(lambda: node.sdo[0x6040].raw == 0x0F)
          and status_comes(node, 0x1000, 0))
    node.rpdo[1][0x607A].raw = target
    node.controlword = 0x1F
    claim("PP: set point acknowledged", status_comes(node, 0x1000, 0x1000))
    node.controlword = 0x0F
    claim("PP: buffer free", status_comes(node, 0x1000, 0))
    claim("PP: target reached", status_comes(node, 0x400, 0x400))


def profile_position(node):
    node.op_mode = "PROFILED POSITION"
    for index, value in ((0x6081, 3000), (0x6083, 20000), (0x6084, 20000)):
        node.sdo[index].raw = value
    start = node.sdo[0x6064].raw
    for distance in (1500, -700):
        go_to(node, start + distance)
        claim(f"PP: at {distance}",
              comes(lambda: abs(node.sdo[0x6064].raw - start - distance) <= 2))


def speeds(node):
    for mode, wanted in (("PROFILED VELOCITY", 1200),
                         ("CYCLIC SYNCHRONOUS VELOCITY", -800)):
        node.op_mode = mode
        claim(f"{mode.lower()}: {wanted} counts/s", speed_comes(node, wanted))
        claim(f"{mode.lower()}: stands", speed_comes(node, 0))


def homing(node):
    node.sdo[0x6099][1].raw = 4000
    node.sdo[0x6099][2].raw = 400
    node.sdo[0x609A].raw = 20000
    node.sdo[0x607C].raw = -250
    node.sdo[0x6098].raw = 20  # the lower edge of the home switch, at 20 mm
    claim("HM: python-canopen says it is homed",
          node.homing(timeout=30) is True)
    node.op_mode = "PROFILED POSITION"
    go_to(node, -250)
    claim("HM: back at the home point, which the offset calls -250",
          comes(lambda: abs(node.sdo[0x6064].raw + 250) <= 2))
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
