"""pymodbus as client of our simulated servos, RTU over a pseudo-terminal and TCP.

Functions 3, 4, 6, 16, 22 and 23, exceptions, and a move: the servo enables, goes
and arrives.
"""
import os
import subprocess
import sys
import time

from pymodbus.client import ModbusSerialClient, ModbusTcpClient


def start():
    slew = subprocess.Popen([os.environ["SLEW"], "sim", "tests/peers/rig.yaml"],
                            stdout=subprocess.PIPE, text=True)
    rtu = slew.stdout.readline().split(":")[0].rsplit(" ", 1)[1]
    tcp = int(slew.stdout.readline().split(":")[0].rsplit(" ", 1)[1])
    return slew, rtu, tcp


def i32(registers):
    value = registers[0] << 16 | registers[1]
    return value - (1 << 32) if value >> 31 else value


def expect(what, got, want):
    if got != want:
        sys.exit(f"  {what}: got {got}, expected {want}")


def registers(reply):
    if reply.isError():
        sys.exit(f"  {reply}")
    return reply.registers


def on_rtu(client):
    """The servo of leadshine-el7 at unit 3."""
    unit = {"slave": 3}
    expect("mode", registers(client.read_holding_registers(3, 1, **unit)), [6])
    expect("no function 4", client.read_input_registers(3, 1,
                                                        **unit).exception_code, 1)
    at = i32(registers(client.read_holding_registers(0x602C, 2, **unit)))
    expect("position", at, 50000)
    expect("write", client.write_register(0x0401, 0x83, **unit).isError(), False)
    expect("no function 22", client.mask_write_register(
        0x0401, 0xFFF0, 0x0003, **unit).exception_code, 1)
    expect("written", registers(client.read_holding_registers(0x0401, 1, **unit)),
           [0x83])
    expect("refused", client.read_holding_registers(100, 1,
                                                    **unit).exception_code, 2)
    time.sleep(0.3)  # the brake
    go = [0x0001, 0, 60000, 600, 50, 50, 0, 0x10]
    expect("go", client.write_registers(0x6200, go, **unit).isError(), False)
    for _ in range(400):
        state = registers(client.read_holding_registers(0x0B05, 1, **unit))[0]
        if state & 0x12 == 0x10:  # in position, not moving
            break
        time.sleep(0.05)
    at = i32(registers(client.read_holding_registers(0x602C, 2, **unit)))
    if abs(at - 60000) > 8:
        sys.exit(f"  went to {at}, expected 60000")
    print(f"  RTU: 3, 6, 16, exceptions, a move of 10000 counts: at {at}")


def on_tcp(client):
    """The servo of lexium-32 at unit 5."""
    unit = {"slave": 5}
    at = i32(registers(client.read_holding_registers(0x1E1A, 2, **unit)))
    expect("position", at, 409600)
    expect("without access", client.write_registers(
        0x1B02, [0, 6], **unit).exception_code, 4)
    expect("access", client.write_registers(0x011A, [0, 1], **unit).isError(),
           False)
    for word in (6, 7, 15):
        reply = client.readwrite_registers(read_address=0x1B04, read_count=2,
                                           write_address=0x1B02,
                                           values=[0, word], **unit)
        expect("controlword", reply.isError(), False)
    time.sleep(0.3)
    status = registers(client.read_holding_registers(0x1B04, 2, **unit))[1]
    expect("operation enabled", status & 0x6F, 0x27)
    expect("no such unit", client.read_holding_registers(0, 1,
                                                         slave=9).exception_code,
           0x0B)
    print("  TCP: 3, 16, 23, exceptions, operation enabled")


def main():
    slew, rtu, tcp = start()
    try:
        # a pseudo-terminal has no parity, and pyserial insists
        client = ModbusSerialClient(port=rtu, baudrate=115200, parity="N",
                                    timeout=10)
        client.connect()
        on_rtu(client)
        client.close()
        client = ModbusTcpClient("127.0.0.1", port=tcp, timeout=10)
        client.connect()
        on_tcp(client)
        client.close()
    finally:
        slew.terminate()
        slew.wait()


main()
