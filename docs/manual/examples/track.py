#!/usr/bin/env python3
"""Prints poses from a miniBIRD: track.py (tcp:HOST:PORT | /dev/ttyX) COUNT. A whole tracker program in a page."""
import os, socket, sys

if sys.argv[1].startswith("tcp:"):
    host, port = sys.argv[1][4:].rsplit(":", 1)
    line = socket.create_connection((host, int(port)), 2).makefile("rwb", buffering=0)
else:
    line = open(os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY), "r+b", buffering=0)

line.write(b"O\x0f")  # EXAMINE the model: ten characters
model = b""
while len(model) < 10:
    model += line.read(10 - len(model))
print(model.decode().strip())

line.write(b"YF@")  # position and angles; run; stream
for _ in range(int(sys.argv[2])):
    record = b""
    while len(record) < 12:
        byte = line.read(1)
        if byte[0] & 0x80:  # bit 7 marks a record's first byte
            record = byte
        elif record:
            record += byte
    words = [(record[i] & 0x7F) << 2 | record[i + 1] << 9 for i in range(0, 12, 2)]
    words = [w - 65536 if w > 32767 else w for w in words]
    position = [w * 914.4 / 32768 for w in words[:3]]
    angles = [w * 180 / 32768 for w in words[3:]]
    print("%8.1f %8.1f %8.1f mm %8.1f %8.1f %8.1f deg" % (*position, *angles))
line.write(b"B")  # stop
