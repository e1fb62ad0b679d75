"""pymodbus as server for our driver, RTU over a pseudo-terminal and TCP: every
function of ours, asked by build/peers/master through hal/linux/libmodbus.c."""
import os
import subprocess
import sys
import threading
import time

from pymodbus.datastore import (ModbusSequentialDataBlock,
                                ModbusServerContext, ModbusSlaveContext)
from pymodbus.server import StartSerialServer, StartTcpServer
from pymodbus.transaction import ModbusRtuFramer

from terminals import terminals

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


def main():
    master = os.path.join(os.environ["PEERS"], "master")
    store = context()
    left, right = terminals()
    serve(StartSerialServer, context=store, port=left, baudrate=115200,
          framer=ModbusRtuFramer)
    rtu = subprocess.run([master, "rtu", right]).returncode
    coils = store[UNIT].getValues(1, 0, 20)
    if [int(c) for c in coils] != [1, 0, 1, 0] * 5:
        sys.exit(f"  coils are {coils}")
    serve(StartTcpServer, context=context(), address=("127.0.0.1", 15021))
    tcp = subprocess.run([master, "tcp", "15021"]).returncode
    sys.stdout.flush()
    os._exit(rtu or tcp)


main()
