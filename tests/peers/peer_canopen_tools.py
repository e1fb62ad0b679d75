"""slew scan and slew drive against python-canopen's LocalNode made from an EDS
file.  The frames go through a pair of sockets, so that no CAN is needed."""
import os
import socket
import struct
import subprocess
import sys
import tempfile

import can
import canopen

NODE = 5
FRAME = struct.Struct("<IB3x8s")  # struct can_frame
failed = []


class SocketBus(can.BusABC):
    def __init__(self, end):
        super().__init__(channel="pair")
        self.end = end

    def send(self, msg, timeout=None):
        self.end.send(FRAME.pack(msg.arbitration_id, msg.dlc,
                                 bytes(msg.data).ljust(8, b"\0")))

    def _recv_internal(self, timeout):
        self.end.settimeout(timeout)
        try:
            raw = self.end.recv(64)
        except (socket.timeout, BlockingIOError):
            return None, False
        if len(raw) != FRAME.size:
            return None, False
        number, length, data = FRAME.unpack(raw)
        return can.Message(arbitration_id=number & 0x7FF, data=data[:length],
                           is_extended_id=False), False


def claim(name, good, seen):
    print(f"  {name}: {'ok' if good else f'FAILED: {seen}'}", flush=True)
    if not good:
        failed.append(name)


def local_node(bus, eds):
    network = canopen.Network()
    network.bus = bus
    network.notifier = can.Notifier(bus, network.listeners, 0.05)
    node = canopen.LocalNode(NODE, eds)
    network.add_node(node)
    node.sdo[0x6041].raw = 0x0250
    node.nmt.start_heartbeat(100)
    return node


def main():
    peers = os.environ["PEERS"]
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    with tempfile.NamedTemporaryFile(suffix=".eds") as eds:
        subprocess.run([os.environ["SLEW"], "sim", "--eds",
                        "examples/dolly"], stdout=eds, check=True)
        node = local_node(SocketBus(ours), eds.name)
    done = subprocess.run([os.path.join(peers, "tools"), str(NODE),
                           str(theirs.fileno())],
                          pass_fds=[theirs.fileno()], capture_output=True,
                          text=True, timeout=300)
    out = done.stdout
    lines = out.splitlines()
    claim("scan finds the node, its state and its product",
          [x for x in lines if x.startswith("found")] ==
          ["found 5: pre-operational, switch on disabled, 402, kind: cia402"],
          out)
    claim("an object by its name", "statusword: 592" in lines, out)
    claim("an object by its number", "6065: 65536" in lines, out)
    claim("what is written arrives and is read back",
          node.sdo[0x6065].raw == 4321 and "set: 0" in lines and
          "Following error window: 4321" in lines, out)
    claim("an abort is told in words",
          "2F00: no such object (0x06020000)" in lines, out)
    claim("a node that is not there does not answer",
          "1000: node 99 does not answer" in lines, out)
    sys.stdout.flush()
    os._exit(1 if failed else 0)


main()
