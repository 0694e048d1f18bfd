#!/usr/bin/env python3
"""Writes the seeds of the fuzz targets into a folder, TARGET/NAME: what lies in seeds/ beside this, and those that are bytes
or long JSON, made here from the pages of their formats (docs/manual). Checksums are 0: the targets make them fit.
usage: seeds.py FOLDER"""
import base64
import json
import pathlib
import shutil
import struct
import sys
import zlib

IDENTITY = [1, 0, 0, 0, 1, 0, 0, 0, 1]  # columns; a place follows
MATRIX = [1, 0, 0, 10, 0, 1, 0, 20, 0, 0, 1, 30, 0, 0, 0, 1]  # rows
ROWS = [MATRIX[4 * i:4 * i + 4] for i in range(4)]
MADE = {"made_utc": "2026-11-22T09:30:00Z", "software": "birdseye 0.1.0", "made_from": "a board", "verdict": "pass"}


def zeros(n):
    return [[0] * n for _ in range(n)]


# Messages of OpenIGTLink: docs/manual/wire.md, and the standard.

def message(kind, device, content, version=1, meta=None):
    body = content
    if version > 1:
        meta = meta or {}
        texts = b"".join(k.encode() + v.encode() for k, v in meta.items())
        index = struct.pack(">H", len(meta)) + b"".join(struct.pack(">HHI", len(k), 3, len(v)) for k, v in meta.items())
        body = struct.pack(">HHII", 12, len(index), len(texts), 7) + content + index + texts
    return struct.pack(">H12s20sQQQ", version, kind.encode(), device.encode(), 5 << 32, len(body), 0) + body


def string(device, value):
    text = json.dumps(value).encode()
    return message("STRING", device, struct.pack(">HH", 3, len(text)) + text)


def image(device, width, height, components=3, version=1):
    head = struct.pack(">HBBBBHHH12f6H", 1, components, 3, 2, 1, width, height, 1, *IDENTITY, 0, 0, 0, 0, 0, 0, width, height, 1)
    return message("IMAGE", device, head + bytes(range(width * height * components)), version)


def element(name):
    return struct.pack(">20sBB12f", name.encode(), 1, 0, *IDENTITY, 10, 20, 30)


def status(device, code, text):
    return message("STATUS", device, struct.pack(">Hq20s", code, 0, b"") + text.encode() + b"\0")


def frame_info():
    pose = {"kind": "interpolated", "reason": "", "sigma_mm": 0.3, "time_sigma_ns": 1000, "speed_mm_s": 10, "age_ns": 0,
            "tracker_from_scope": MATRIX}
    return {"sequence": 7, "acquired_ns": 10**9, "acquired_sigma_ns": 10**6, "arrived_ns": 11 * 10**8, "frames_dropped": 0,
            "pose": pose, "latency_ns": 8 * 10**7}


def health():
    clock = {"known": True, "synchronised": True, "tai_known": False, "max_error_ns": 5, "est_error_ns": 1,
             "wall_minus_monotonic_ns": 10**18, "source": "ptp"}
    camera = {"name": "camera", "state": "running", "text": "a camera", "times_lost": 1, "identity": {"model": "m"}}
    return {"state": "ready", "instruments": [camera], "frame_rate_hz": 25.0, "measurements": 7, "clock": clock}


def wire():
    told = {"Doubt": {"acquired_ns": 1, "bird": "scope", "why": "frozen"},
            "ClockChange": {"at_ns": 1, "clock": "tracker", "kind": "step", "by_ns": 5, "by_ppm": 0.5},
            "Pedal": {"pressed": True, "at_ns": 1},
            "ClockPong": {"host_sent_ns": 1, "device_received_ns": 2, "device_sent_ns": 3},
            "CameraControls": {"locked": True, "done": ["gain 5"], "refused": []},
            "Calibration": {"in_force": True, "why_not": "", "record": "{}"}}
    yield "wire_message", "frame", string("FrameInfo", frame_info()) + image("Laparoscope", 4, 3)
    yield "wire_message", "health", string("Health", health()) + status("birdseyed", 1, "")
    yield "wire_message", "birds", message("TDATA", "Birds", element("scope") + element("pointer"))
    yield "wire_message", "told", b"".join(string(device, value) for device, value in told.items())
    asked = [string("ClockPing", {"host_sent_ns": 1}), string("Subscribe", {"frames": True, "tracking": False}),
             string("CameraLock", {"on": True}), message("STT_TDATA", "", struct.pack(">I32s", 20, b"")),
             message("STP_TDATA", "", b""), message("GET_STATUS", "", b"", 2)]
    yield "wire_request", "all", b"".join(asked)
    matrix = struct.pack(">12f", *IDENTITY, 10, 20, 30)
    turn = struct.pack(">7f", 10, 20, 30, 0, 0, 0.6, 0.8)
    yield "foreign_message", "transform", message("TRANSFORM", "ProbeToTracker", matrix)
    yield "foreign_message", "valid", message("TRANSFORM", "ProbeToTracker", matrix, 2, {"TransformStatus": "OK"})
    yield "foreign_message", "lists", message("TDATA", "Tools", element("Probe")) + message(
        "QTDATA", "Tools", struct.pack(">20sBB", b"Stylus", 1, 0) + turn)
    yield "foreign_message", "position", message("POSITION", "Stylus", turn) + status("Server", 3, "no tracker")
    yield "foreign_message", "pictures", image("Video", 4, 3, 1) + image("Video", 4, 3, 3, 2)


# The miniBIRD: docs/manual/minibird.md.

def record(words):
    out = bytearray(b"".join(bytes([w >> 2 & 0x7F, w >> 9 & 0x7F]) for w in words))
    out[0] |= 0x80
    return bytes(out)


def pose_words(step):
    return [8000 + 10 * step, 300, 500, 0x7FFC, 0, 0, 0, 0x7FFC, 0, 0, 0, 0x7FFC]


def chunked(stream, how=23):
    """`how` is the time that passes, and 1 more is the bytes that come then."""
    size = 1 + how % 64
    return b"".join(bytes([how]) + stream[at:at + size] for at in range(0, len(stream), size))


def minibird():
    stream = b"".join(record(pose_words(i)) for i in range(40))
    yield "minibird_stream", "matrix", b"\0\0" + chunked(stream)
    flock = b"".join(record(pose_words(i)) + bytes([1 + i % 2]) for i in range(40))
    yield "minibird_stream", "flock", b"\6\0\0" + chunked(flock)
    angles = b"".join(record([8000 + i, 300, 500, 1000, 2000, 3000]) for i in range(40))
    yield "minibird_stream", "angles", b"\0\1" + chunked(angles, 11)
    quaternions = b"".join(record([8000 + i, 300, 500, 0x7FFC, 0, 0, 0]) + b"\0" for i in range(40))
    yield "minibird_stream", "quaternions", b"\1\2" + chunked(quaternions, 14)
    yield "minibird_replies", "new", b"\x03\x47" + b"\x14\x00" + b"6DFOB     " + bytes(range(1, 7)) + b"\x0d\x21\x20\0\0\0"
    yield "minibird_replies", "old", b"\x03\x1f" + b"\x21\x00" + b"MINIBIRD  " + b"\0\0\0\0\0\0\0\0"


# USB: docs/manual/vm-test.md names the protocol; serial-lines.md the chip.

def redir(kind, ident, body, wide=True):
    return struct.pack("<IIQ" if wide else "<III", kind, len(body), ident) + body


def usb():
    hello = redir(0, 0, struct.pack("<64sI", b"qemu", 0xFF), False)
    control = struct.pack("<BBBBHHH", 0, 9, 0x40, 0, 4, 0, 0)
    asked = struct.pack("<BBBBHHH", 0x80, 6, 0x80, 0, 0x0100, 0, 64)
    read = struct.pack("<BBHIH", 0x81, 0, 512, 0, 0)
    write = struct.pack("<BBHIH", 0x02, 0, 4, 0, 0) + b"FB@?"
    yield "usb_redir", "session", (hello + redir(6, 1, b"\1") + redir(9, 2, b"\0\0") + redir(100, 3, control) +
                                   redir(100, 4, asked) + redir(101, 5, read) + redir(101, 6, write) + redir(21, 5, b""))
    packet = bytes([0x01, 0x60]) + b"0123456789"
    damaged = bytes([0x01, 0x62]) + b"01234"
    yield "ftdi_transfer", "packets", b"\0" + bytes([4]) + packet + b"junk" + bytes([43, 2]) + damaged + b"\x37"
    yield "serial_marks", "marked", b"ab\xff\xffcd\xff\0xef"
    yield "serial_marks", "cut", b"\xff\xff\xff\0"


# Video: docs/manual/frame-socket.md.

JPEG = base64.b64decode(
    "/9j/4AAQSkZJRgABAgAAAQABAAD//gAQTGF2YzU5LjM3LjEwMAD/2wBDAAgoKC8oLzc3Nzc3N0E8QUNDQ0FBQUFDQ0NISEhVVVVISEhDQ0hIUFBVVVxf"
    "XFdXVVdfX2RkZHh4c3OMjJGsrM//xABqAAEBAQAAAAAAAAAAAAAAAAAHAgYBAQEAAAAAAAAAAAAAAAAAAAIDEAABAgQHAQEAAAAAAAAAAAABAAIzExEh"
    "YVFSBNEiAzFBEQABAgUFAQEAAAAAAAAAAAABMRESAFECAyMTwWEEISL/wAARCAAIABADASIAAhEAAxEA/9oADAMBAAIRAxEAPwDLt8XyB1uSf0ZjFI05"
    "g3INbCtfunlWyExHj4r0cOuP182ooW7ZVpNgX9IxlLQQKpcOZ//Z")


def frame(kind, width, height, pixels, number=1):
    return struct.pack("<8sII4sIQqqQQ", b"BEFRAME1", width, height, kind, 0, number, 10**9, 10**6, len(pixels), 0) + pixels


def video():
    yield "frame_socket", "plain", frame(b"RGB3", 4, 3, bytes(36)) + frame(b"GREY", 5, 3, bytes(15), 2)
    yield "frame_socket", "packed", frame(b"YUYV", 3, 2, bytes(16)) + frame(b"UYVY", 4, 1, bytes(8), 5)
    yield "frame_socket", "planes", frame(b"NV12", 3, 3, bytes(9 + 8)) + frame(b"BGR3", 1, 1, bytes(3), 2)
    yield "frame_socket", "jpeg", frame(b"MJPG", 16, 8, JPEG)
    yield "jpeg_frame", "picture", bytes([15, 7]) + JPEG


# Recordings: docs/manual/appliance-recording.md, session-recording.md.

def ns(ms):
    return {"ns": ms * 10**6}


def block(kind, payload):
    return struct.pack("<IQ", kind, len(payload)) + payload + bytes(8)


def texted(value):
    text = value.encode()
    return struct.pack("<Q", len(text)) + text


def appliance():
    pose = {"capacity": 4096, "max_gap": ns(60), "max_prediction": ns(100), "max_time_sigma": ns(10),
            "acceleration_mm_s2": 500.0, "smoothing": ns(0)}
    settings = {"bird_names": ["scope"], "transforms": True, "pose": pose, "pose_wait": ns(0), "calibration": "",
                "frame_clock": {"rate_hz": 25.0, "exposure": ns(0), "strobe": False}}
    limits = {"most_speed_mm_s": 2000, "most_turn_deg_s": 1000, "most_acceleration_mm_s2": 20000, "slack_mm": 4, "slack_deg": 5,
              "step_confirms": 5, "start_confirms": 1, "gap": ns(150), "frozen_after": 100, "frozen_moved_mm": 2,
              "hemisphere_border_mm": 15, "flip_memory": ns(2000)}
    bird = {"format": 5, "mm_per_count": 0.0279, "into_hemisphere": [1, 0, 0]}
    layout = {"birds": [bird], "group_mode": False, "button_byte": False, "rate_hz": 103.3, "baud": 115200, "delay": ns(7),
              "plausibility": limits}
    start = b"BEREC002" + block(1, json.dumps(settings).encode())

    def changed(instrument, told, rate_hz):
        return block(2, struct.pack("<BB", instrument, 3) + texted("here") + struct.pack("<q", 10**9) + texted(told) +
                     struct.pack("<dBq", rate_hz, 1, 5 * 10**6) + texted('{"model": "m"}'))

    tracker = b"".join(block(3, struct.pack("<qBB", 10**9 + i * 97 * 10**5, 0, 0) + struct.pack("<Q", 24) + record(pose_words(i)))
                       for i in range(8))
    picture = block(4, struct.pack("<iiQqqBqq", 2, 1, 1, 105 * 10**7, 10**6, 1, 106 * 10**7, 0) + struct.pack("<Q", 6) + bytes(6))
    edges = block(5, struct.pack("<qQ", 106 * 10**7, 2) + struct.pack("<BBqBBq", 0, 1, 105 * 10**7, 1, 1, 105 * 10**7))
    tick = block(6, struct.pack("<q", 107 * 10**7))
    yield "appliance_recording", "tracker", start + changed(0, json.dumps(layout), 0.0) + tracker + tick
    yield "appliance_recording", "camera", start + changed(1, "", 25.0) + picture + edges + tick


def session():
    bird = {"name": "scope", "tracker_from_sensor": MATRIX}
    events = {"Birds": {"acquired_ns": 10**9, "birds": [bird]}, "Status": {"ok": False, "text": "no camera"},
              "Doubt": {"acquired_ns": 1, "bird": "scope", "why": "frozen"}, "Pedal": {"pressed": True, "at_ns": 1},
              "ClockChange": {"at_ns": 1, "clock": "tracker", "kind": "step", "by_ns": 5, "by_ppm": 0.5},
              "CameraControls": {"locked": True, "done": [], "refused": ["gain"]}, "Health": health(),
              "Calibration": {"in_force": False, "why_not": "another camera", "record": ""},
              "VideoFrame": {"info": frame_info(), "width_px": 4, "height_px": 3, "file": "video", "index": 0}}
    lines = [json.dumps({kind: event}) for kind, event in events.items()]
    for kind, line in zip(events, lines):
        yield "event_line", kind, line.encode()
    yield "session_recording", "all", "".join(line + "\n" for line in lines).encode()[:2000]
    yield "session_recording", "short", (lines[0] + "\n" + lines[8] + "\n" + lines[1] + "\n").encode()
    head = ("ObjectType = Image\nNDims = 3\nBinaryData = True\nCompressedData = {}\nDimSize = 4 3 2\n"
            "ElementNumberOfChannels = {}\nElementType = MET_UCHAR\nUltrasoundImageOrientation = {}\n")
    for number in range(2):
        at = f"Seq_Frame{number:04}_"
        head += (f"{at}ProbeToTrackerTransform = {' '.join(map(str, MATRIX))}\n{at}ProbeToTrackerTransformStatus = OK\n"
                 f"{at}Timestamp = {1 + number / 10}\n{at}FrameNumber = {number}\n{at}ImageStatus = OK\n")
    head += "ElementDataFile = LOCAL\n"
    yield "sequence", "rgb", head.format("False", 3, "MFA").encode() + bytes(72)
    yield "sequence", "grey", head.format("True", 1, "UN").encode() + zlib.compress(bytes(range(24)))


# Volumes and surfaces: docs/manual/volumes.md.

def nifti(extension):
    """A header of NIfTI-1 alone: 2 x 2 x 2 voxels of 16 bits, a millimetre apart, by qform and sform."""
    offset = 352 + len(extension)
    head = struct.pack("<i36s8hfffhhhh8f", 348, b"", 3, 2, 2, 2, 1, 1, 1, 1, 0, 0, 0, 0, 4, 16, 0, 1, 1, 1, 1, 0, 0, 0, 0)
    head += struct.pack("<fffhbb", offset, 1, 0, 0, 0, 2)
    head += bytes(252 - len(head)) + struct.pack("<hh6f", 1, 1, 0, 0, 0, 10, 20, 30)
    head += struct.pack("<12f", 1, 0, 0, 10, 0, 1, 0, 20, 0, 0, 1, 30) + bytes(16) + b"n+1\0"
    return head + struct.pack("<bbbb", 1 if extension else 0, 0, 0, 0) + extension + bytes(16)


def volumes():
    names = b'<CaretExtension><Label Key="5" Red="1">liver</Label></CaretExtension>'
    names += bytes(-(len(names) + 8) % 16)
    yield "nifti_header", "plain", nifti(b"")
    yield "label_names", "nifti", nifti(struct.pack("<ii", len(names) + 8, 30) + names)
    surface = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nelement face 1\nend_header\n"
    yield "ply_file", "triangle", surface + struct.pack("<18f", *range(18)) + struct.pack("<BIII", 3, 0, 1, 2)


# What calibrations and operations write: docs/manual/calibration-record.md, calibrate-field.md, live.md.

def kept():
    lens = {**MADE, "model": "radial3_tangential2", "width_px": 768, "height_px": 576, "covariance": zeros(9), "rms_px": 0.2,
            "held_out_px": 0.25, "rod_angle_deg": 30, "round_field": {"centre_px": [380, 280], "radius_px": 300}}
    lens.update({"fx_px": 608.7, "fy_px": 606.1, "cx_px": 383, "cy_px": 287, "k1": -0.4, "k2": 0.2, "p1": 0, "p2": 0, "k3": 0})
    rod = {"reference_angle_deg": 30, "axis_in_sensor": [0, 0, 1], "axis_point_in_sensor_mm": [1, 2, 3], "picture_turn": 1}
    hand_eye = {**MADE, "camera_from_sensor": ROWS, "covariance": zeros(6), "rms_px": 1.5, "held_out_px": 1.7,
                "held_out_mm": 0.5, "rod": rod, "independent_stations": 14}
    tip = {**MADE, "tip_in_sensor_mm": [1, 2, 3], "covariance_mm2": zeros(3), "rms_mm": 0.3}
    latency = {**MADE, "offset_ms": 83.1, "offset_ci95_ms": [82.6, 83.6], "drift_ppm": 12}
    start = {"format": "birdseye calibration record", "version": 1, "scope": "no. 17",
             "hardware": {"tracker": {"model": "6DFOB"}, "camera": {"model": "m", "serial": "1"}}}
    yield "calibration_record", "lens", json.dumps({**start, "lens": lens, "hand_eye": hand_eye}).encode()
    yield "calibration_record", "rest", json.dumps({**start, "tip": tip, "latency": latency}).encode()
    polynomial = {"kind": "polynomial", "order": 1, "box_mm": [[-100, -100, -100], [100, 100, 100]], "centres_mm": [],
                  "position_mm": [[1, 2, 3]] * 4, "rotation_rad": [], "sigma_mm": [1] * 729}
    start = {"format": "birdseye field map", "version": 1, "held_out_mm": 0.7, "tracker": {"model": "m"}, **MADE}
    signed = {"signed": {"machine": "m", "key": "0" * 32, "utc": "u", "signature": "0" * 32}}
    for name, field in (("polynomial", polynomial),
                        ("distances", {**polynomial, "kind": "rbf", "centres_mm": [[0, 0, 0]], "position_mm": [[0, 0, 0]] * 5,
                                       "rotation_rad": [[0, 0, 0]] * 5})):
        by = signed if name == "distances" else {}
        yield "field_map", name, json.dumps({**start, **by, "map": field}, separators=(",", ":")).encode()
    floats = base64.b64encode(zlib.compress(struct.pack("<24f", *range(24)))).decode()
    calibrated = {"made_utc": MADE["made_utc"], "made_from": "board", "tracker": {"model": "m"}, "camera": {},
                  "lens": {"width_px": 768, "height_px": 576, "fx_fy_cx_cy_k1_k2_p1_p2_k3": [608, 606, 383, 287, 0, 0, 0, 0, 0],
                           "covariance": zeros(9)}, "camera_from_sensor": ROWS, "held_out_mm": 0.5}
    registered = {"made_utc": MADE["made_utc"], "made_from": "touched fiducials", "tracker": {}, "tracker_from_patient": ROWS,
                  "fre_mm": 0.8, "fiducials_in_patient_mm": [[0, 0, 0], [50, 0, 0], [0, 70, 0]]}
    deformed = {"made_utc": MADE["made_utc"], "made_from": "views", "size": [2, 2, 2], "patient_from_lattice": ROWS,
                "displacement_mm_float32_zlib_base64": floats, "target": {"rms_mm": 2.5, "radius95_mm": 4}}
    operation = {"format": {"name": "birdseye operation", "version": 2}, "made": MADE, "ct": {"sha256": "00"}}
    yield "operation_file", "scope", json.dumps({**operation, "calibrated": calibrated, "labels": {"sha256": "1"}}).encode()
    yield "operation_file", "patient", json.dumps({**operation, "registered": registered, "deformed": deformed}).encode()


def main(folder):
    shutil.copytree(pathlib.Path(__file__).parent / "seeds", folder, dirs_exist_ok=True)
    for makes in (wire, minibird, usb, video, appliance, session, volumes, kept):
        for target, name, content in makes():
            if len(content) > 2048:
                sys.exit(f"seeds.py: {target}/{name} is of {len(content)} bytes: a seed is small")
            (folder / target).mkdir(parents=True, exist_ok=True)
            (folder / target / name).write_bytes(content)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
