#!/usr/bin/env python3
"""Prints poses and pictures as an OpenIGTLink server sends them: poses.py [HOST [PORT [COUNT]]]. Ends after COUNT poses.
Reads TRANSFORM and IMAGE, as birdseyed, PLUS and 3D Slicer send them. Standard library only."""
import socket, struct, sys

host, port, count = (sys.argv[1:] + ["127.0.0.1", "18944", "20"][len(sys.argv) - 1:])[:3]
left = int(count) if port.isdigit() and count.isdigit() else sys.exit("poses.py: PORT and COUNT are numbers")
try:
    stream = socket.create_connection((host, int(port)), 5).makefile("rb")
except (OSError, OverflowError) as error:
    sys.exit("poses.py: nobody answers at %s:%s (%s): is the server running there?" % (host, port, error))


def read(size):
    try:
        got = stream.read(size)
    except OSError as error:  # it was reset, or said nothing for 5 s
        sys.exit("poses.py: the server at %s:%s sends no more (%s)" % (host, port, error))
    return got if len(got) == size else sys.exit("poses.py: the server at %s:%s has gone" % (host, port))


while left > 0:
    # Version, type, device, seconds and 2^-32 seconds of the time stamp, size of the body, its checksum; big endian.
    version, kind, device, seconds, fraction, size, _ = struct.unpack(">H12s20sIIQQ", read(58))
    body = read(size)
    if version >= 2:  # an extended header, which begins with its own size, lies before the content
        body = body[struct.unpack(">H", body[:2])[0]:]
    kind, name = kind.rstrip(b"\0").decode(), device.rstrip(b"\0").decode()
    time = seconds + fraction / 2**32
    if kind == "TRANSFORM":  # a 3 x 4 matrix, column by column: three axes, then the place, mm
        columns = struct.unpack(">12f", body[:48])
        print("%-20s %14.6f s  %8.2f %8.2f %8.2f mm" % (name, time, *columns[9:]), flush=True)
        left -= 1
    elif kind == "IMAGE":  # components, type of the values and the size in pixels; 72 bytes, then the pixels, row by row
        components, values, width, height = body[2], body[3], *struct.unpack(">HH", body[6:10])
        print("%-20s %14.6f s  %d x %d, %d components" % (name, time, width, height, components), flush=True)
    elif kind == "STATUS":  # 1: OK; else the text says what is wrong
        code = struct.unpack(">H", body[:2])[0]
        print("%-20s %s" % (name, "OK" if code == 1 else body[30:].rstrip(b"\0").decode()), flush=True)
