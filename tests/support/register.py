#!/usr/bin/python3
"""register.py PORT UNIT ADDRESS: one holding register of a Modbus TCP server of
this computer, as a number; for scripts whose servo another program has."""
import socket
import struct
import sys

port, unit, address = (int(word, 0) for word in sys.argv[1:])
line = socket.create_connection(("127.0.0.1", port), 2)
line.sendall(struct.pack(">HHHBBHH", 1, 0, 6, unit, 3, address, 1))
answer = b""
while len(answer) < 11:
    more = line.recv(11 - len(answer))
    if not more:
        sys.exit("the server hung up")
    answer += more
if answer[7] != 3:
    sys.exit("exception %d" % answer[8])
print(struct.unpack(">H", answer[9:])[0])
