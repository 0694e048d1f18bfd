"""birdseye calibrate hand-eye."""
import math

import boards
import motion
from judge import Row

HAND_EYE = (f"birdseye calibrate hand-eye --board {boards.CHESSBOARD} --images shots --poses poses --camera camera.yaml "
            "--out hand_eye.txt --json hand_eye.json")
BOTH = ("hand_eye.txt", "hand_eye.json")


def stations(folder, count=15, views=None, poses=None):
    """Pictures, the sensor's poses and the lens; poses may be changed by a function of their list."""
    views = boards.poses(count) if views is None else views
    boards.write_views(folder / "shots", boards.chessboard, views)
    sensor = boards.sensor_poses(views)
    boards.write_poses(folder / "poses", poses(sensor) if poses else sensor)
    (folder / "camera.yaml").write_text(boards.lens_yaml())


def close_to_truth(mm, unit=1.0):
    def check(folder, _):
        off = motion.distance(motion.read_matrix(folder / "hand_eye.txt"), boards.CAMERA_FROM_SENSOR) * unit
        return f"hand-eye is off by {off:.2f} mm" if off > mm else ""
    return check


def moved_at_the_fifth(sensor):
    return [motion.product(motion.shift(25.0, 0.0, 0.0), pose) if k == 5 else pose for k, pose in enumerate(sensor)]


def in_metres(sensor):
    return [[[v / 1000 if j == 3 and i < 3 else v for j, v in enumerate(row)] for i, row in enumerate(pose)] for pose in sensor]


def shifted_by_one(sensor):
    return sensor[1:] + sensor[:1]


def rolling_alone(folder):
    """All stations look the same way, turned about the camera's own axis."""
    centre = boards.CHESSBOARD_CENTRE
    stations(folder, views=[motion.product(motion.shift(0, 0, 95.0), motion.turn((0, 0, 1), 20.0 * k),
                                           motion.turn((1, 0, 0), 25.0), motion.shift(-centre[0], -centre[1], 0.0))
                            for k in range(10)])


def moving_straight(folder):
    """The scope only moves, and never turns."""
    centre = boards.CHESSBOARD_CENTRE
    stations(folder, views=[motion.product(motion.shift(4.0 * (k % 4), 3.0 * (k % 3), 90.0 + 2.0 * k), motion.turn((1, 0, 0), 25.0),
                                           motion.shift(-centre[0], -centre[1], 0.0)) for k in range(10)])


def one_pose_missing(folder):
    stations(folder)
    (folder / "poses" / "pose03.txt").unlink()


def a_pose_that_is_none(folder):
    stations(folder)
    (folder / "poses" / "pose03.txt").write_text("MISSING\n")


def a_mirror(folder):
    stations(folder, poses=lambda sensor: [[row if k != 1 else [-v for v in row[:3]] + [row[3]] for k, row in enumerate(pose)]
                                           for pose in sensor])


def of_a_left_handed_frame(pose):
    """z the other way."""
    return [[v * (-1) ** ((i == 2) + (k == 2)) for k, v in enumerate(row)] for i, row in enumerate(pose)]


def positions_turned(pose):
    """z of the position the other way, the rotation not."""
    return [row if i != 2 else row[:3] + [-row[3]] for i, row in enumerate(pose)]


def ros_lens(folder):
    stations(folder)
    (folder / "camera.yaml").write_text(
        "image_width: 640\nimage_height: 480\ncamera_name: scope\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
        "  data: [600.0, 0.0, 322.0, 0.0, 600.0, 237.0, 0.0, 0.0, 1.0]\ndistortion_model: plumb_bob\n"
        "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [-0.12, 0.0, 0.0, 0.0, 0.0]\n")


def lens_of_another_size(folder):
    stations(folder, 8)
    (folder / "camera.yaml").write_text(boards.lens_yaml().replace("640", "1920").replace("480", "1080"))


def points_found_before(folder):
    """A folder of ids, places on the board and pixels of each view, as other programs leave them."""
    views = boards.poses(15)
    (folder / "points").mkdir()
    for k, view in enumerate(views):
        seen = [(i * 5.0, j * 5.0, 0.0) for j in range(6) for i in range(9)]
        pixels = [boards.LENS.pixel(motion.apply(view, place)) for place in seen]
        for name, lines in (("ids", [str(n) for n in range(len(seen))]), ("object_points", [f"{x} {y} {z}" for x, y, z in seen]),
                            ("image_points", [f"{x:.4f} {y:.4f}" for x, y in pixels])):
            (folder / "points" / f"view.{name}.{k}.txt").write_text("\n".join(lines) + "\n")
    boards.write_poses(folder / "poses", boards.sensor_poses(views))
    (folder / "camera.yaml").write_text(boards.lens_yaml())


def stream(folder, late_s=0.05, eye_unit_s=1.0, sensor_line=motion.table_line):
    """Poses of the sensor and of the eye, by two clocks, while the scope is turned about all axes."""
    def eye(t):
        return motion.product(motion.shift(20 + 15 * math.sin(1.1 * t), 12 + 12 * math.sin(1.7 * t + 1), 95 + 8 * math.sin(0.9 * t)),
                              motion.turn((1, 0, 0), 180 + 25 * math.sin(2.1 * t) + 8 * math.sin(5.3 * t)),
                              motion.turn((0, 1, 0), 25 * math.sin(1.6 * t + 0.7) + 7 * math.sin(4.1 * t)),
                              motion.turn((0, 0, 1), 40 * math.sin(1.3 * t + 2)))
    lines, eyes = [], []
    for k in range(30 * 40):
        t = k / 40
        lines.append(sensor_line(motion.product(boards.TRACKER_FROM_BOARD, eye(t), boards.CAMERA_FROM_SENSOR), 1000 + t))
    for k in range(30 * 25):
        t = k / 25
        eyes.append(motion.table_line(eye(t), (1000 + t + late_s) / eye_unit_s))
    (folder / "sensor.csv").write_text("".join(lines))
    (folder / "eye.csv").write_text("".join(eyes))


def matrix_row(pose, time_s):
    """A time and 16 numbers, row by row."""
    return f"{time_s:.6f}," + ",".join(f"{v:.9g}" for row in pose for v in row) + "\n"


def matrix_column_row(pose, time_s):
    """The same, column by column."""
    return matrix_row([list(column) for column in zip(*pose)], time_s)


def angles_line(pose, time_s):
    """Only whether the header is understood matters."""
    return ("t,x,y,z,yaw,pitch,roll\n" if time_s == 1000 else "") + f"{time_s:.6f},{pose[0][3]},{pose[1][3]},{pose[2][3]},0.1,0.2,0.3\n"


STREAM = "birdseye calibrate hand-eye --poses sensor.csv --eye-poses eye.csv --out hand_eye.txt --json hand_eye.json"

ROWS = [
    Row("calibrate hand-eye", "good", "15 stations over a chessboard, folders of pictures and of poses",
        "pass; camera_from_sensor to 0.5 mm", HAND_EYE, 0, stations, "pass", writes=BOTH, check=close_to_truth(0.5)),
    Row("calibrate hand-eye", "good", "the same without --camera", "the lens is found from the same pictures; pass",
        HAND_EYE.replace("--camera camera.yaml ", ""), 0, stations, "pass", writes=BOTH, check=close_to_truth(1.0)),
    Row("calibrate hand-eye", "good", "points that were found before, as another program left them", "pass; to 0.2 mm",
        HAND_EYE.replace(f"--board {boards.CHESSBOARD} --images shots", "--points points"), 0, points_found_before, "pass",
        writes=BOTH, check=close_to_truth(0.2)),
    Row("calibrate hand-eye", "good", "two streams of poses, the eye's clock 50 ms late",
        "pass; the offset is found; to 1 mm", STREAM, 0, stream, "pass", says=["50"], writes=BOTH, check=close_to_truth(1.0)),
    Row("calibrate hand-eye", "good", "the eye's times in ms, said by --eye-time-unit ms", "pass; to 1 mm", STREAM + " --eye-time-unit ms", 0,
        lambda folder: stream(folder, eye_unit_s=1e-3), "pass", writes=BOTH, check=close_to_truth(1.0)),
    Row("calibrate hand-eye", "odd", "the same, and nobody says so", "refused: --eye-time-unit ms", STREAM, 2,
        lambda folder: stream(folder, eye_unit_s=1e-3), says=["eye.csv seem to be in milliseconds", "--eye-time-unit ms"]),
    Row("calibrate hand-eye", "good", "the sensor's poses as a time and a 4x4 matrix in a row", "pass; to 1 mm", STREAM, 0,
        lambda folder: stream(folder, sensor_line=matrix_row), "pass", writes=BOTH, check=close_to_truth(1.0)),
    Row("calibrate hand-eye", "odd", "the same matrices column by column", "refused: --column-major", STREAM, 2,
        lambda folder: stream(folder, sensor_line=matrix_column_row), says=["column by column: say --column-major"]),
    Row("calibrate hand-eye", "wrong", "turns as yaw, pitch and roll", "refused: quaternions or matrices", STREAM, 2,
        lambda folder: stream(folder, sensor_line=angles_line), says=["angles \\(yaw, pitch, roll\\)", "quaternions"]),
    Row("calibrate hand-eye", "good", "the lens as ROS' camera_info", "pass, as with OpenCV's", HAND_EYE, 0, ros_lens, "pass",
        writes=BOTH, check=close_to_truth(0.5)),
    Row("calibrate hand-eye", "good", "poses in metres, said by --unit m", "pass, in mm", HAND_EYE + " --unit m", 0,
        lambda folder: stations(folder, poses=in_metres), "pass", writes=BOTH, check=close_to_truth(0.5)),
    Row("calibrate hand-eye", "odd", "poses in metres, and nobody says so", "fail; the unit is named: --unit m", HAND_EYE, 3,
        lambda folder: stations(folder, poses=in_metres), "fail", says=["--unit m"], writes=["hand_eye.json"]),
    Row("calibrate hand-eye", "odd", "one station of 15 whose pose is off by 25 mm", "that station is named and left out; to 1 mm",
        HAND_EYE, 0, lambda folder: stations(folder, poses=moved_at_the_fifth), "pass", says=["view05|pose05"], writes=BOTH,
        check=close_to_truth(1.0)),
    Row("calibrate hand-eye", "odd", "one pose of 15 says MISSING", "the station is named and left out; pass", HAND_EYE, 0,
        a_pose_that_is_none, "pass", says=["pose03.*missing"], writes=BOTH, check=close_to_truth(0.5)),
    Row("calibrate hand-eye", "odd", "poses that are inverted", "fail; they seem to be inverted", HAND_EYE, 3,
        lambda folder: stations(folder, poses=lambda sensor: [motion.inverse(p) for p in sensor]), "fail", says=["inver"],
        writes=["hand_eye.json"]),
    Row("calibrate hand-eye", "odd", "poses of a left-handed frame", "fail; they seem to be mirrored", HAND_EYE, 3,
        lambda folder: stations(folder, poses=lambda sensor: [of_a_left_handed_frame(p) for p in sensor]), "fail",
        says=["seem to be mirrored", "left-handed"], writes=["hand_eye.json"]),
    Row("calibrate hand-eye", "odd", "positions with the wrong sign of z", "fail; the axis is named", HAND_EYE, 3,
        lambda folder: stations(folder, poses=lambda sensor: [positions_turned(p) for p in sensor]), "fail",
        says=["wrong sign of z"], writes=["hand_eye.json"]),
    Row("calibrate hand-eye", "odd", "only four stations", "not a pass: too few", HAND_EYE, 3,
        lambda folder: stations(folder, 4), "fail", says=["stations.*4|4.*stations"], writes=["hand_eye.json"]),
    Row("calibrate hand-eye", "wrong", "poses shifted by one against the pictures",
        "fail; they do not belong together, and by how much they are shifted", HAND_EYE, 3,
        lambda folder: stations(folder, poses=shifted_by_one), "fail", says=["do not belong together", "shift|next|one"],
        writes=["hand_eye.json"]),
    Row("calibrate hand-eye", "wrong", "the scope was only rolled about itself", "fail; all turns are about one axis", HAND_EYE, 3,
        rolling_alone, "fail", says=["about one axis"], writes=["hand_eye.json"]),
    Row("calibrate hand-eye", "wrong", "the scope never turned", "fail; the scope hardly turned", HAND_EYE, 3, moving_straight, "fail",
        says=["hardly turned"], writes=["hand_eye.json"]),
    Row("calibrate hand-eye", "wrong", "15 pictures, 14 poses", "refused: both numbers", HAND_EYE, 2, one_pose_missing,
        says=["15.*14|14.*15"]),
    Row("calibrate hand-eye", "wrong", "matrices that are mirrors", "refused: no rotation but a mirror", HAND_EYE, 2, a_mirror,
        says=["mirror"]),
    Row("calibrate hand-eye", "wrong", "a lens of 1920 x 1080 with pictures of 640 x 480", "refused: both sizes", HAND_EYE, 2,
        lens_of_another_size, says=["1920 ?x ?1080", "640 ?x ?480"]),
    Row("calibrate hand-eye", "wrong", "--poses that are not there", "refused: the path is named",
        HAND_EYE.replace("--poses poses", "--poses nowhere"), 2, lambda folder: stations(folder, 5), says=["nowhere"]),
    Row("calibrate hand-eye", "odd", "six real views of a Storz laparoscope, poses of scope and board",
        "fail: six stations do not tell hand-eye well enough, and what to take",
        "birdseye calibrate hand-eye --board charuco:19x26:5mm:4mm:DICT_4X4_250:legacy --images \"$DATA/laparoscope_charuco_handeye/*left*.png\" "
        "--poses \"$DATA/laparoscope_charuco_handeye/*device_tracking*.txt\" --board-poses \"$DATA/laparoscope_charuco_handeye/*calib_obj_tracking*.txt\" "
        "--out hand_eye.txt --json hand_eye.json", 3, verdict="fail", data=["laparoscope_charuco_handeye"], says=["next: take"],
        writes=["hand_eye.json"], slow=True),
    Row("calibrate hand-eye", "odd", "two real streams of poses, in metres, their clocks 15 ms apart",
        "within 3 mm of the published answer",
        "birdseye calibrate hand-eye --poses $DATA/handeye_pose_streams/*hinge.csv --eye-poses $DATA/handeye_pose_streams/*target_ir.csv "
        "--unit m --out hand_eye.txt --json hand_eye.json", 0, verdict="marginal", data=["handeye_pose_streams"], writes=BOTH, slow=True),
]
