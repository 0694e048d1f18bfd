#!/usr/bin/env python3
"""Prints poses from a miniBIRD: track.py (tcp:HOST:PORT | /dev/ttyX) COUNT. A whole tracker program in a page."""
import os, socket, sys, time

if len(sys.argv) != 3 or not sys.argv[2].isdigit():
    sys.exit("usage: track.py (tcp:HOST:PORT | /dev/ttyX) COUNT")
where, line, until = sys.argv[1], None, time.monotonic() + 2
while line is None:  # the simulator may have been started at the same time
    try:
        if where.startswith("tcp:"):
            host, port = where[4:].rsplit(":", 1)
            line = socket.create_connection((host, int(port)), 2).makefile("rwb", buffering=0)
        else:
            line = open(os.open(where, os.O_RDWR | os.O_NOCTTY), "r+b", buffering=0)
    except (OSError, OverflowError, ValueError) as error:
        if time.monotonic() > until or not isinstance(error, OSError):
            sys.exit("track.py: no tracker at %s (%s)" % (where, error))
        time.sleep(0.05)


def call(what, argument):
    try:
        done = what(argument)
    except OSError as error:  # it was reset, or said nothing for 2 s
        sys.exit("track.py: the tracker at %s answers no more (%s)" % (where, error))
    return done or sys.exit("track.py: the tracker at %s has gone" % where)


call(line.write, b"O\x0f")  # EXAMINE the model: ten characters
model = b""
while len(model) < 10:
    model += call(line.read, 10 - len(model))
print(model.decode().strip())

call(line.write, b"YF@")  # position and angles; run; stream
for _ in range(int(sys.argv[2])):
    record = b""
    while len(record) < 12:
        byte = call(line.read, 1)
        if byte[0] & 0x80:  # bit 7 marks a record's first byte
            record = byte
        elif record:
            record += byte
    words = [(record[i] & 0x7F) << 2 | record[i + 1] << 9 for i in range(0, 12, 2)]
    words = [w - 65536 if w > 32767 else w for w in words]
    position = [w * 914.4 / 32768 for w in words[:3]]
    angles = [w * 180 / 32768 for w in words[3:]]
    print("%8.1f %8.1f %8.1f mm %8.1f %8.1f %8.1f deg" % (*position, *angles))
call(line.write, b"B")  # stop
