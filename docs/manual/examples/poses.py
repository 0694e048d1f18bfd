#!/usr/bin/env python3
"""Prints poses and pictures as an OpenIGTLink server sends them: poses.py [HOST [PORT [COUNT]]]. Ends after COUNT poses.
Reads TRANSFORM and IMAGE, as birdseyed, PLUS and 3D Slicer send them. Standard library only."""
import socket, struct, sys

host, port, count = (sys.argv[1:] + ["127.0.0.1", "18944", "20"][len(sys.argv) - 1:])[:3]
stream = socket.create_connection((host, int(port)), 5).makefile("rb")
left = int(count)
while left > 0 and len(header := stream.read(58)) == 58:
    # Version, type, device, seconds and 2^-32 seconds of the time stamp, size of the body, its checksum; big endian.
    version, kind, device, seconds, fraction, size, _ = struct.unpack(">H12s20sIIQQ", header)
    if len(body := stream.read(size)) < size:
        break
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
sys.exit(left > 0 and "the server has gone")
