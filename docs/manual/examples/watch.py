#!/usr/bin/env python3
"""Prints once a second what birdseyed publishes: watch.py [HOST [PORT]]. A whole OpenIGTLink client in a page."""
import json, socket, struct, sys

host, port = (sys.argv[1:] + ["127.0.0.1", "18944"][len(sys.argv) - 1:])[:2]
try:
    stream = socket.create_connection((host, int(port)), 5).makefile("rb")
except (OSError, OverflowError, ValueError) as error:
    sys.exit("watch.py: nobody answers at %s:%s (%s): is birdseyed running there?" % (host, port, error))


def read(size):
    try:
        got = stream.read(size)
    except KeyboardInterrupt:
        sys.exit(0)
    except OSError as error:  # it was reset, or said nothing for 5 s
        sys.exit("watch.py: birdseyed at %s:%s sends no more (%s)" % (host, port, error))
    return got if len(got) == size else sys.exit("watch.py: birdseyed at %s:%s has gone" % (host, port))


bird, frame = "no pose", {"sequence": "-", "pose": {"kind": "none yet", "reason": ""}}
while True:
    _, kind, device, _, size, _ = struct.unpack(">H12s20sQQQ", read(58))
    body = read(size)
    kind, device = kind.rstrip(b"\0"), device.rstrip(b"\0")
    if kind == b"STATUS":  # code, sub-code, name of the error, text
        print("STATUS", struct.unpack(">H", body[:2])[0], body[30:].rstrip(b"\0").decode())
    elif kind == b"TDATA":  # of the first bird: its name, and a matrix column by column, the place last
        bird = "%s at %.1f %.1f %.1f mm" % (body[:20].rstrip(b"\0").decode(), *struct.unpack(">3f", body[58:70]))
    elif device == b"FrameInfo":  # a STRING: encoding, length, text
        frame = json.loads(body[4:])
    elif device == b"Health":
        health, pose = json.loads(body[4:]), frame["pose"]
        print("%-8s %5.1f measurements/s, %s; %4.1f frames/s, frame %s: %s %s" % (health["state"], health["tracker_rate_hz"],
              bird, health["frame_rate_hz"], frame["sequence"], pose["kind"], pose["reason"]), flush=True)
