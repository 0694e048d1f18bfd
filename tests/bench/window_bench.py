#!/usr/bin/env python3
"""How the live window keeps up: 768x576 at 25 frames a second from birdseyed, a deformed CT over it, no graphics card.

usage: window_bench.py BIN [--seconds 60] [--size 768x576] [--rate 25]

A simulated operation gives the patient, the registration and the deformation. Then the simulated tracker goes round the
liver once in 16 seconds, 51 mm/s at the scope's tip, and the simulated camera shows a patterned post in the liver's
place, which costs it little, so that the machine is the window's and the appliance's as it is at a cart. The last line is
JSON.
"""
import argparse
import csv
import hashlib
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import time

KEYS = """wait connect 90
wait calibrate 150
wait fiducials 60
press space 1.4 views 60
key enter
key space
wait deform 180
end
"""
LENS = [0, 0, 0, 0, 0]  # k1 k2 p1 p2 k3: the simulated camera is a pinhole


def window(options, arguments, script, folder):
    (folder / "script.txt").write_text(script)
    number_from, number_to = os.pipe()
    with subprocess.Popen(["Xvfb", "-displayfd", str(number_to), "-screen", "0", "1280x720x24", "-nolisten", "tcp"],
                          pass_fds=[number_to], stderr=subprocess.DEVNULL) as server:
        display = ":" + os.read(number_from, 16).decode().strip()
        try:
            ended = subprocess.run([options.bin / "birdseye", "live", *arguments, "--script", folder / "script.txt", "--json",
                            folder / "live.json"], check=False, stdout=subprocess.DEVNULL,
                           env={**os.environ, "DISPLAY": display})
            if ended.returncode not in (0, 3):  # 3: the error against the truth, which is not judged here
                raise SystemExit(f"birdseye live: exit code {ended.returncode}")
        finally:
            server.terminate()
    return json.loads((folder / "live.json").read_text())


def seal(parts):
    """As the window seals what it keeps (host/files/sealed_text.hpp)."""
    lines = {name: f'"{name}": {json.dumps(value)}' for name, value in parts.items()}
    sums = {name: hashlib.sha256(line.encode()).hexdigest() for name, line in lines.items()}
    text = "{\n" + "".join(line + ",\n" for line in [*lines.values(), f'"sha256": {json.dumps(sums)}'])
    return text + f'"whole": "{hashlib.sha256(text.encode()).hexdigest()}"\n}}\n'


def operation(options, folder):
    """A registered, deformed patient, as `--resume` takes it, round the middle of the tracker's circle."""
    made, kept = folder / "made", folder / "operation"
    window(options, ["--simulate", "--out", made, "--look-s", "600"], KEYS, folder)
    kept.mkdir()
    parts = json.loads((made / "operation.json").read_text())
    del parts["sha256"], parts["whole"], parts["signed"]  # the machine signed what it wrote, not what is changed here
    scope, patient = parts["calibrated"], parts["registered"]
    scope["tracker"], scope["camera"], patient["tracker"] = {}, {}, {}  # with instruments of another cart
    x, y, z = json.loads((made / "phantom" / "truth.json").read_text())["liver_centre_mm"]
    patient["tracker_from_patient"] = [[1, 0, 0, 400 - x], [0, 1, 0, -y], [0, 0, 1, -z], [0, 0, 0, 1]]
    # 130 mm before it, looking at it.
    scope["camera_from_sensor"] = [[0, 1, 0, 0], [0, 0, -1, 0], [-1, 0, 0, -70], [0, 0, 0, 1]]
    width, height = (int(part) for part in options.size.split("x"))
    focal = 0.78 * width
    scope["lens"]["width_px"], scope["lens"]["height_px"] = width, height
    scope["lens"]["fx_fy_cx_cy_k1_k2_p1_p2_k3"] = [focal, focal, width / 2, height / 2, *LENS]
    scope["lens"].pop("covariance", None)
    (kept / "operation.json").write_text(seal(parts))
    return made / "phantom"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("bin", type=lambda text: pathlib.Path(text).resolve())
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--size", default="768x576")
    parser.add_argument("--rate", type=float, default=25)
    options = parser.parse_args()
    folder = pathlib.Path(tempfile.mkdtemp(prefix="birdseye-window-"))
    phantom = operation(options, folder)
    width, height = options.size.split("x")
    (folder / "cart.toml").write_text(f"""[tracker]
device = "{folder}/tty"
[camera]
source = "socket:{folder}/camera"
width = {width}
height = {height}
rate_hz = {options.rate}
[wire]
port = 18977
""")
    simulator, circle = options.bin / "birdseye-sim", folder / "circle.json"
    running = []

    def start(*command):
        running.append(subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))

    start(simulator, "minibird", "--tty", folder / "tty", "--boot-ms", "100", "--position-noise-mm", "0.1",
          "--angle-noise-deg", "0.05", "--period-s", "16", "--truth", circle)
    for _ in range(100):
        if circle.exists():
            break
        time.sleep(0.1)
    start(simulator, "camera", "--socket", folder / "camera", "--size", options.size, "--rate", str(options.rate), "--post",
          circle)
    start(options.bin / "birdseyed", "--config", folder / "cart.toml")
    try:
        figures = window(options, [
            "--server", "127.0.0.1:18977", "--ct", phantom / "ct", "--labels", phantom / "segmentation.nii.gz", "--show",
            "2,3,4", "--organ", "1,2,3,4", "--targets", "4", "--resume", folder / "operation", "--accept-unsigned",
            "--out", folder / "out"],
            "wait connect 30\nsleep 5\nkey space\nsleep 1.2\nkey space\nsleep 1.2\nkey 6\nkey space\nwait run 5\n"
            f"sleep {options.seconds + 4}\nend\n", folder)
    finally:
        for program in running:
            program.terminate()
            program.wait()
    with open(folder / "out" / "frames.csv", newline="") as file:
        frames = [(int(row[0]), float(row[1]), float(row[2])) for row in list(csv.reader(file))[1:]]
    overlaid = [frame for frame in frames if frame[2] > 0]
    began = overlaid[int(4 * options.rate)][0]  # the overlay has just appeared, and everything was made for it
    judged = [frame for frame in frames if began <= frame[0] <= overlaid[-1][0]]
    ages = sorted(age for _, age, _ in judged)
    print(json.dumps({
        "size": options.size, "rate_hz": options.rate, "frames_sent": judged[-1][0] - began + 1, "frames_shown": len(judged),
        "frames_overlaid": sum(strength > 0 for _, _, strength in judged),
        "exposure_to_swap_ms_p50": ages[len(ages) // 2], "exposure_to_swap_ms_p95": ages[int(0.95 * len(ages))],
        "exposure_to_swap_ms_max": ages[-1], "oldest_overlay_ms": figures["oldest_overlay_ms"],
        "stood_still": figures["stood_still"], "engine": figures["engine"]}))
    shutil.rmtree(folder)


if __name__ == "__main__":
    main()
