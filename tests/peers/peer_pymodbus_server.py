"""pymodbus as server for our driver, RTU over a pseudo-terminal and TCP: every
function of ours, asked by build/peers/master through hal/modbus_libmodbus."""
import os
import pty
import subprocess
import sys
import threading
import time
import tty

from pymodbus.datastore import (ModbusSequentialDataBlock,
                                ModbusServerContext, ModbusSlaveContext)
from pymodbus.server import StartSerialServer, StartTcpServer
from pymodbus.transaction import ModbusRtuFramer

UNIT = 17


def context():
    """256 holding registers 0x1000 + 3 i, input registers their inverse."""
    values = [0x1000 + 3 * i for i in range(256)]
    return ModbusServerContext(slaves={UNIT: ModbusSlaveContext(
        hr=ModbusSequentialDataBlock(0, values),
        ir=ModbusSequentialDataBlock(0, [v ^ 0xFFFF for v in values]),
        co=ModbusSequentialDataBlock(0, [0] * 256),
        zero_mode=True)}, single=False)


def serve(target, **arguments):
    thread = threading.Thread(target=target, kwargs=arguments, daemon=True)
    thread.start()
    time.sleep(3)


def bridge(a, b):
    """Two pseudo-terminals, what is written to one comes out of the other."""
    def carry(source, sink):
        while True:
            os.write(sink, os.read(source, 4096))
    for pair in ((a, b), (b, a)):
        threading.Thread(target=carry, args=pair, daemon=True).start()


def terminal():
    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    return ours, os.ttyname(theirs)


def main():
    master = os.path.join(os.environ["PEERS"], "master")
    store = context()
    left, left_path = terminal()
    right, right_path = terminal()
    bridge(left, right)
    serve(StartSerialServer, context=store, port=left_path, baudrate=115200,
          framer=ModbusRtuFramer)
    rtu = subprocess.run([master, "rtu", right_path]).returncode
    coils = store[UNIT].getValues(1, 0, 20)
    if [int(c) for c in coils] != [1, 0, 1, 0] * 5:
        sys.exit(f"  coils are {coils}")
    serve(StartTcpServer, context=context(), address=("127.0.0.1", 15021))
    tcp = subprocess.run([master, "tcp", "15021"]).returncode
    sys.stdout.flush()
    os._exit(rtu or tcp)


main()
