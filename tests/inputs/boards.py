"""Pictures of boards, and the poses that belong to them."""
import functools
import math
import random
from pathlib import Path

import draw
import motion

LENS = draw.Lens()
CHESSBOARD = "chessboard:9x6:5mm"
CHESSBOARD_CENTRE = (20.0, 12.5)  # mm, of chessboard() below


def chessboard():
    return draw.chessboard(9, 6, 5.0)


def poses(count, centre=CHESSBOARD_CENTRE, distance_mm=95.0, tilt_deg=30.0, seed=1):
    """camera_from_board of views from all sides, the board's centre in all parts of the picture."""
    chance = random.Random(seed)
    made = []
    for k in range(count):
        around = 2 * math.pi * k / count * 3.0
        tilt = motion.turn((math.cos(around), math.sin(around), 0.0), tilt_deg * (0.5 + 0.5 * ((k * 7) % count) / count))
        roll = motion.turn((0.0, 0.0, 1.0), 25.0 * math.sin(2.3 * k))
        z = distance_mm * (1 + 0.12 * math.sin(1.7 * k))
        place = motion.shift(0.22 * z * math.cos(1.3 * k) + chance.uniform(-1, 1), 0.15 * z * math.sin(1.9 * k), z)
        made.append(motion.product(place, roll, tilt, motion.shift(-centre[0], -centre[1], 0.0)))
    return made


@functools.cache
def _drawn(board, lens, pose):
    return draw.view(board(), lens, pose).taken()


def write_views(folder, board, views, lens=LENS, name="view{:02d}.pgm", write=draw.write_pgm):
    """A picture of each pose; the board may be a generator function."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    for k, camera_from_board in enumerate(views):
        write(Path(folder) / name.format(k), _drawn(board, lens, tuple(map(tuple, camera_from_board))))


# Where the camera sits on the simulated sensor, and where the board lies before the simulated tracker.
CAMERA_FROM_SENSOR = motion.product(motion.shift(12.0, -8.0, -240.0), motion.turn((0.3, 1.0, 0.2), 35.0))
TRACKER_FROM_BOARD = motion.product(motion.shift(320.0, 40.0, 110.0), motion.turn((1.0, 0.4, -0.2), 160.0))


def sensor_poses(views):
    """tracker_from_sensor of each camera_from_board."""
    return [motion.product(TRACKER_FROM_BOARD, motion.inverse(view), CAMERA_FROM_SENSOR) for view in views]


def write_poses(folder, transforms, name="pose{:02d}.txt"):
    Path(folder).mkdir(parents=True, exist_ok=True)
    for k, transform in enumerate(transforms):
        (Path(folder) / name.format(k)).write_text(motion.matrix_text(transform))


def lens_yaml(lens=LENS):
    """The lens as OpenCV writes it."""
    return (f"%YAML:1.0\n---\nimage_width: {lens.width}\nimage_height: {lens.height}\n"
            "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
            f"   data: [ {lens.fx}, 0., {lens.cx}, 0., {lens.fy}, {lens.cy}, 0., 0., 1. ]\n"
            "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n"
            f"   data: [ {lens.k1}, {lens.k2}, 0., 0., 0. ]\n")
