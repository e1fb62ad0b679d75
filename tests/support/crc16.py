"""tests/support/crc16.py - CRC-16 of Modbus RTU (polynomial 0xA001, from 0xFFFF)."""
import struct


def crc16(data):
    """Two bytes, as they follow `data` on the line."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return struct.pack("<H", crc)
