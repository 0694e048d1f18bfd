#!/usr/bin/env python3
"""Runs each command of docs/manual/another-tracker.md on recordings as its text has them. usage: another_tracker.py PROGRAMS
SOURCE_DIR. A command at a server, PLUS:18944, is left out: foreign_test.cpp runs it."""
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).parent))
import boards
import motion
import rows_hand_eye
import rows_points

PAGE = "docs/manual/another-tracker.md"
RESTS_S = 1.2  # of a rest, and of the way to the next one
SCOPE, POINTER = "ProbeToTracker", "StylusToTracker"
MOVED = motion.product(motion.shift(-700, 90, -1500), motion.turn((1, 0.2, 0), 170))  # tracker_from_world


def commands(page):
    """The indented lines; the one that ends in a backslash goes on in the next."""
    text = page.read_text().replace("\\\n", " ")
    return [line.strip() for line in text.splitlines() if line.startswith("    ") and line.strip()]


def numbers(pose, order="xyzw"):
    turn = dict(zip("xyzw", motion.quaternion(pose)))
    return [pose[0][3], pose[1][3], pose[2][3]] + [turn[letter] for letter in order]


def sequence(names, rows):
    lines = ["ObjectType = Image", "NDims = 3"]
    for k, poses in enumerate(rows):
        lines.append(f"Seq_Frame{k:04}_Timestamp = {100 + k / 40:.6f}")
        for name, pose in zip(names, poses):
            lines.append(f"Seq_Frame{k:04}_{name}Transform = " + " ".join(f"{v:.9g}" for row in pose for v in row))
            lines.append(f"Seq_Frame{k:04}_{name}TransformStatus = OK")
    return "\n".join(lines) + "\nElementDataFile = LOCAL\n"


def between(a, b, part):
    """A pose on the way from one to another: turned and shifted evenly enough for a test."""
    p, q = numbers(a), numbers(b)
    sign = math.copysign(1, sum(u * v for u, v in zip(p[3:], q[3:])))
    x, y, z, *turn = [(1 - part) * u + part * (v if i < 3 else sign * v) for i, (u, v) in enumerate(zip(p, q))]
    half = math.hypot(*turn[:3])
    angle = 2 * math.degrees(math.atan2(half, turn[3]))
    return motion.product(motion.shift(x, y, z), motion.turn(turn[:3], angle) if half > 1e-9 else motion.IDENTITY)


def birds(at_s, poses):
    named = [{"name": name, "tracker_from_sensor": [v for row in pose for v in row]} for name, pose in poses.items()]
    return {"Birds": {"acquired_ns": round(at_s * 1e9), "birds": named}}


def frame(number, at_s, index, size):
    at_ns = round(at_s * 1e9)
    pose = {"kind": "refused", "reason": "none", "sigma_mm": 0.0, "time_sigma_ns": 0, "speed_mm_s": 0.0, "age_ns": 0,
            "tracker_from_scope": None}
    info = {"sequence": number, "acquired_ns": at_ns, "acquired_sigma_ns": 1000, "arrived_ns": at_ns, "frames_dropped": 0, "pose": pose}
    return {"VideoFrame": {"info": info, "width_px": size[0], "height_px": size[1], "file": "video", "index": index}}


def write_recording(folder, events, tracker, pictures, size):
    """As `birdseye record` writes one; frames may share a picture. pictures: grey, a byte a pixel."""
    folder.mkdir()
    events.sort(key=lambda event: event.get("Birds", event.get("VideoFrame", {}).get("info"))["acquired_ns"])
    (folder / "events.jsonl").write_text("".join(json.dumps(event) + "\n" for event in events))
    (folder / "recording.json").write_text(json.dumps({"birdseye_recording": 1, "ended": True}))
    (folder / "tracker.igs.mha").write_text(tracker)
    header = (f"ObjectType = Image\nNDims = 3\nBinaryData = True\nCompressedData = False\nDimSize = {size[0]} {size[1]} {len(pictures)}\n"
              "ElementType = MET_UCHAR\nUltrasoundImageOrientation = MF\nUltrasoundImageType = BRIGHTNESS\n")
    frames = "".join(f"Seq_Frame{k:04}_ImageStatus = OK\n" for k in range(len(pictures)))
    (folder / "video.igs.mha").write_bytes((header + frames + "ElementDataFile = LOCAL\n").encode() + b"".join(pictures))


def write_session(folder, pgms, scope):
    """The scope rests at each station and moves on; the pointer pivots."""
    pixels = [path.read_bytes().split(b"\n255\n", 1)[1] for path in pgms]
    pointer = rows_points.pivot(count=round(2 * RESTS_S * 40 * len(scope)))
    events, rows = [], []
    for k in range(len(pointer)):
        station, since = divmod(k / 40, 2 * RESTS_S)
        here, there = scope[int(station)], scope[min(int(station) + 1, len(scope) - 1)]
        pose = between(here, there, max(0.0, since / RESTS_S - 1))
        noise = motion.shift(0.02 * math.sin(1.7 * k), 0.02 * math.cos(2.3 * k), 0.02 * math.sin(0.9 * k))
        rows.append((motion.product(pose, noise), pointer[k]))
        events.append(birds(100 + k / 40, dict(zip((SCOPE, POINTER), rows[-1]))))
        if k % 4 == 1:
            events.append(frame(k, 100 + k / 40, int(station), (640, 480)))
    write_recording(folder, events, sequence((SCOPE, POINTER), rows), pixels, (640, 480))


def write_swayed(folder):
    """The scope turns to and fro before a textured wall, 20 s; the pictures are 40 ms late."""
    size, rate_hz = (160, 120), 25

    def turned(t):
        return (9 * math.sin(2.9 * t) + 5 * math.sin(7.3 * t + 1), 8 * math.sin(2.1 * t + 2) + 4 * math.sin(5.9 * t))

    def grey(u, v):
        return 128 + 50 * math.sin(0.21 * u + 2 * math.sin(0.05 * v)) + 45 * math.sin(0.17 * v + 0.9 * math.sin(0.07 * u)) + 20 * math.sin(0.6 * u) * math.sin(0.5 * v)

    events, rows, pictures = [], [], []
    for k in range(20 * 60):
        right, up = turned(k / 60)
        pose = motion.product(motion.shift(300, 0, 0), motion.turn((0, 1, 0), right), motion.turn((1, 0, 0), up))
        rows.append((pose,))
        events.append(birds(100 + k / 60, {SCOPE: pose}))
    for k in range(20 * rate_hz):
        right, up = turned(k / rate_hz)
        dx, dy = 200 * math.tan(math.radians(right)), -200 * math.tan(math.radians(up))
        pictures.append(bytes(min(255, max(0, round(grey(x + dx, y + dy)))) for y in range(size[1]) for x in range(size[0])))
        events.append(frame(k, 100 + k / rate_hz + 0.04, k, size))
    write_recording(folder, events, sequence((SCOPE,), rows), pictures, size)


def write_recordings(folder):
    pivot = rows_points.pivot()
    (folder / "pivot.tsv").write_text(rows_points.ndi_log().replace(",", "\t"))
    (folder / "pivot.igs.mha").write_text(sequence((POINTER, "ReferenceToTracker"),
                                                   [(motion.product(MOVED, pose), MOVED) for pose in pivot]))
    scope_lines = [f"Scope,{100 + k / 40:.4f}," + ",".join(f"{v:.6f}" for v in numbers(motion.product(MOVED, pose))) for k, pose in enumerate(pivot)]
    tools = ["tool,t,x,y,z,qx,qy,qz,qw"]
    for k, pose in enumerate(pivot):
        tools += [f"Pointer,{100 + k / 40:.4f}," + ",".join(f"{v:.6f}" for v in numbers(pose)), scope_lines[-k]]
    (folder / "tools.csv").write_text("\n".join(tools) + "\n")
    take = ["Format Version,1.23,Take Name,pivot,Rotation Type,Quaternion,Length Units,Meters", "", ",Type" + ",Rigid Body" * 8,
            ",Name" + ",Pointer" * 8, ",ID" + ",1" * 8, ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error", "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,"]
    for k, pose in enumerate(pivot):
        x, y, z, *turn = numbers(pose)
        take.append(",".join([str(k), f"{k / 40:.4f}"] + [f"{v:.6f}" for v in (*turn, x / 1000, y / 1000, z / 1000, 0.0002)]))
    (folder / "take.csv").write_text("\n".join(take) + "\n")

    views = boards.poses(15)
    boards.write_views(folder / "pictures", boards.chessboard, views)
    names = sorted((folder / "pictures").iterdir())
    scope = boards.sensor_poses(views)
    stations = [f"{name.name}," + motion.table_line(pose).strip() for name, pose in zip(names, scope)]
    (folder / "stations.csv").write_text("\n".join(["picture,x,y,z,qx,qy,qz,qw", *reversed(stations)]) + "\n")
    rows_points.latency_streams(folder)
    (folder / "poses.csv").rename(folder / "sway.csv")
    (folder / "eye.csv").rename(folder / "sway-eye.csv")
    rows_hand_eye.stream(folder)
    (folder / "sensor.csv").rename(folder / "scope.csv")
    rows_points.grid(folder)
    metres = []
    for line in (folder / "grid.csv").read_text().splitlines():
        name, *values = line.split(",")
        metres.append(line if name == "name" else ",".join([name, *values[:3], *(f"{float(v) / 1000:.7f}" for v in values[3:])]))
    (folder / "grid.csv").write_text("\n".join(metres) + "\n")
    write_session(folder / "session", names, scope)
    write_swayed(folder / "swayed")


def main(programs, source):
    environment = {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}"}
    faults, ran = [], 0
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        environment["BIRDSEYE_IDENTITY"] = str(folder / "identity")
        write_recordings(folder)
        for command in commands(Path(source) / PAGE):
            if "PLUS:" in command:
                continue
            ran += 1
            if "--recording" in command:  # those of this file are not signed, as those of `birdseye record` are
                command += " --accept-unsigned"
            done = subprocess.run(["bash", "-c", command], cwd=folder, env=environment, capture_output=True, text=True, timeout=120)
            print(f"$ {command}\n{done.stdout}{done.stderr}", flush=True)
            if done.returncode != 0 or (command.startswith("birdseye") and "verdict: " not in done.stdout):
                faults.append(f"{PAGE}: exit code {done.returncode}: {command}")
    if ran < 12:
        faults.append(f"{PAGE}: has only {ran} commands")
    print("\n".join(faults))
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve(), sys.argv[2]))
