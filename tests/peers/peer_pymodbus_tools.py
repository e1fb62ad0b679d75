"""slew scan and slew drive against pymodbus as server, over a pseudo-terminal
and TCP: who is there by functions 3, 11 and 2B, registers read and written."""
import json
import os
import subprocess
import sys
import threading
import time

from pymodbus.datastore import (ModbusSequentialDataBlock,
                                ModbusServerContext, ModbusSlaveContext)
from pymodbus.device import ModbusDeviceIdentification
from pymodbus.server import StartSerialServer, StartTcpServer
from pymodbus.transaction import ModbusRtuFramer

from terminals import terminals

UNIT = 17
PORT = 15022
failed = []


def context():
    return ModbusServerContext(slaves={UNIT: ModbusSlaveContext(
        hr=ModbusSequentialDataBlock(0, [0x1000 + 3 * i for i in range(256)]),
        zero_mode=True)}, single=False)


def serve(target, **arguments):
    identity = ModbusDeviceIdentification(
        info_name={"VendorName": "Peer", "ProductCode": "P17",
                   "MajorMinorRevision": "3.6"})
    thread = threading.Thread(target=target, daemon=True,
                              kwargs={"identity": identity, **arguments})
    thread.start()
    time.sleep(3)


def slew(*words):
    done = subprocess.run([os.environ["SLEW"], *words], capture_output=True,
                          text=True, timeout=120)
    return done.returncode, done.stdout, done.stderr


def claim(name, good, seen):
    print(f"  {name}: {'ok' if good else f'FAILED: {seen}'}", flush=True)
    if not good:
        failed.append(name)


def tools(where, store):
    code, out, err = slew("scan", where, "--units", "15-19", "--json",
                          "--timeout", "1s")
    found = json.loads(out)["found"] if code == 0 else []
    claim(f"scan {where} finds unit {UNIT} by its name",
          [(f["id"], f["name"]) for f in found] == [(UNIT, "Peer P17 3.6")],
          (out, err))
    code, out, err = slew("drive", "get", where, str(UNIT), "0x10", "--json",
                          "--timeout", "5s")
    claim("get reads a register",
          code == 0 and json.loads(out)["values"][0]["value"] == 0x1030,
          (out, err))
    code, out, err = slew("drive", "set", where, str(UNIT), "0x20", "70000",
                          "--type", "u32", "--yes", "--timeout", "5s")
    claim("set writes two registers and reads them back", code == 0 and
          store[UNIT].getValues(3, 0x20, 2) == [1, 70000 - 65536], (out, err))
    code, out, err = slew("drive", "set", where, str(UNIT), "0x20", "1",
                          "--timeout", "5s")
    claim("nothing is written to a drive that does not say whether it is on",
          code == 2 and "--yes" in err, (out, err))
    code, out, err = slew("drive", "get", where, str(UNIT), "0x7000",
                          "--timeout", "5s")
    claim("an exception is told in words",
          code == 1 and "illegal data address" in out, (out, err))


def main():
    ours, theirs = terminals()
    store = context()
    serve(StartSerialServer, context=store, port=theirs, baudrate=115200,
          framer=ModbusRtuFramer)
    tools(ours, store)
    store = context()
    serve(StartTcpServer, context=store, address=("127.0.0.1", PORT))
    tools(f"127.0.0.1:{PORT}", store)
    sys.stdout.flush()
    os._exit(1 if failed else 0)


main()
