"""Files of poses as programs and people write them, for birdseye calibrate tip and hand-eye."""
import motion
import rows_hand_eye
import rows_points
from judge import Row
from rows_points import TIP_BOTH, TIP_RUN, pivot, tip_close, tip_file

STREAM, BOTH = rows_hand_eye.STREAM, rows_hand_eye.BOTH
MIRROR = [[0.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]  # x and y exchanged
BODY = ((0.0, 0.0, 0.0), (50.0, 0.0, 5.0), (0.0, 80.0, 0.0), (-30.0, 20.0, 25.0))
BODY_RUN = "birdseye calibrate tip --poses points.csv --body body.csv --out tip.txt --json tip.json"
MOTIVE_RUN = "birdseye calibrate tip --poses take.csv --out tip.txt --json tip.json"


def stacked(rows=slice(0, 4), change=lambda pose: pose):
    """As numpy.savetxt writes an array of N * 4 rows of 4."""
    return "".join(" ".join(f"{v:.18e}" for v in row) + "\n" for pose in pivot() for row in change(pose)[rows])


def by_columns(pose):
    return [list(column) for column in zip(*pose)]


def one_a_row(change):
    return "".join(" ".join(f"{v:.9g}" for row in change(pose) for v in row) + "\n" for pose in pivot())


def numpy_binary(folder):
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1, 4, 4), }".ljust(117) + b"\n"
    (folder / "poses.csv").write_bytes(b"\x93NUMPY\x01\x00v\x00" + header + bytes(128))


def w_first(pose, time_s):
    x, y, z, w = motion.quaternion(pose)
    return ",".join(f"{v:.9g}" for v in (time_s, pose[0][3], pose[1][3], pose[2][3], w, x, y, z)) + "\n"


def w_last_as_q0(pose, time_s):
    """The header's names are of w, x, y, z, and the numbers are not."""
    return ("t,x,y,z,q0,q1,q2,q3\n" if time_s == 1000 else "") + motion.table_line(pose, time_s)


def y_up(pose, time_s):
    """Positions with y and z exchanged, as of a program whose y is up, beside rotations that were left alone."""
    return motion.table_line([pose[0], pose[1][:3] + [pose[2][3]], pose[2][:3] + [pose[1][3]], pose[3]], time_s)


def eye_w_first(folder):
    rows_hand_eye.stream(folder)
    lines = [line.split(",") for line in (folder / "eye.csv").read_text().splitlines()]
    (folder / "eye.csv").write_text("".join(",".join(f[:4] + f[7:] + f[4:7]) + "\n" for f in lines))


def eye_in_metres(folder):
    rows_hand_eye.stream(folder)
    lines = [[float(v) for v in line.split(",")] for line in (folder / "eye.csv").read_text().splitlines()]
    (folder / "eye.csv").write_text("".join(",".join(f"{v:.9g}" for v in [f[0], *(v / 1000 for v in f[1:4]), *f[4:]]) + "\n" for f in lines))


def motive(names=("Pointer",), unit="Meters", turns="Quaternion", space="Global", parent=False):
    """As Motive exports a take: rigid bodies, of which the first is the pointer, and a marker of each."""
    def make(folder):
        per_mm = 1e-3 if unit == "Meters" else 1.0
        n = len(names)
        each = [f",{name}" * 8 for name in names]
        lines = ["Format Version,1.23,Take Name,Take 2021-03-04 10.11.12 AM,Capture Frame Rate,120.000000,Export Frame Rate,120.000000,"
                 f"Total Exported Frames,200,Rotation Type,{turns},Length Units,{unit},Coordinate Space,{space}", "",
                 ",Type" + ",Rigid Body" * 8 * n + ",Rigid Body Marker" * 4, ",Name" + "".join(each) + f",{names[0]}:Marker1" * 4,
                 ",ID" + ',"4F2A1C"' * 8 * n + ',"4F2A1D"' * 4, *([",Parent" + "," * (8 * n + 4)] if parent else []),
                 "," + (",Rotation" * 4 + ",Position" * 3 + ",Mean Marker Error") * n + ",Position" * 3 + ",Marker Quality",
                 "Frame,Time (Seconds)" + ",X,Y,Z,W,X,Y,Z," * n + ",X,Y,Z,"]
        for k, pose in enumerate(pivot()):
            numbers = [*motion.quaternion(pose), *(pose[i][3] * per_mm for i in range(3)), 0.3 * per_mm]
            row = "," * 8 if k % 20 == 5 else "".join(f",{v:.6f}" for v in numbers)
            lines.append(f"{k},{k / 120:.6f}{row}" + ",0,0,0,1,0.5,0.5,0.5,0.0002" * (n - 1) + ",1,1,1,1.0")
        (folder / "take.csv").write_text("\n".join(lines) + "\n")
    return make


def body(body_unit=1.0, points_unit=1.0, text=None):
    """A body's points and where they were tracked, each in a unit of so many mm."""
    def make(folder):
        (folder / "body.csv").write_text(text or "".join(",".join(f"{v / body_unit:.9g}" for v in p) + "\n" for p in BODY))
        (folder / "points.csv").write_text("".join(
            ",".join(f"{v / points_unit:.9g}" for p in BODY for v in motion.apply(pose, p)) + "\n" for pose in pivot()))
    return make


ROWS = [
    Row("calibrate tip", "good", "4x4 matrices one below another, as numpy.savetxt writes them", "pass; the tip to 0.5 mm", TIP_RUN, 0,
        tip_file(stacked), "pass", writes=TIP_BOTH, check=tip_close(0.5)),
    Row("calibrate tip", "good", "the same column by column, said by --column-major", "pass; the tip to 0.5 mm", TIP_RUN + " --column-major", 0,
        tip_file(lambda: stacked(change=by_columns)), "pass", writes=TIP_BOTH, check=tip_close(0.5)),
    Row("calibrate tip", "odd", "the same, and nobody says so", "refused: --column-major", TIP_RUN, 2, tip_file(lambda: stacked(change=by_columns)),
        says=["column by column: say --column-major"]),
    Row("calibrate tip", "wrong", "4x4 matrices one below another without their last rows", "refused: 0 0 0 1 below each", TIP_RUN, 2,
        tip_file(lambda: stacked(slice(0, 3))), says=["0 0 0 1 below three"]),
    Row("calibrate tip", "wrong", "4x4 matrices one below another, of which the last line is cut off", "refused: four rows each", TIP_RUN, 2,
        tip_file(lambda: "".join(stacked().splitlines(True)[:-1])), says=["799 rows of four numbers", "each has four rows"]),
    Row("calibrate tip", "wrong", "matrices with x and y exchanged", "refused: a mirror, determinant -1", TIP_RUN, 2,
        tip_file(lambda: one_a_row(lambda pose: motion.product(MIRROR, pose))), says=["mirror", "determinant -1", "right-handed"]),
    Row("calibrate tip", "wrong", "an array that NumPy saved", "refused: numpy.savetxt", TIP_RUN, 2, numpy_binary, says=["NumPy", "savetxt"]),
    Row("calibrate tip", "odd", "quaternions with w first", "fail; w first, and the header's names", TIP_RUN, 3,
        tip_file(lambda: "".join(w_first(pose, k / 40) for k, pose in enumerate(pivot()))), "fail", says=["w first", "qw,qx,qy,qz"], writes=["tip.json"]),
    Row("calibrate tip", "odd", "quaternions with w last under the names q0 to q3", "fail; w last, and the header's names", TIP_RUN, 3,
        tip_file(lambda: "t,x,y,z,q0,q1,q2,q3\n" + rows_points.table(pivot())), "fail", says=["w last", "qx,qy,qz,qw"], writes=["tip.json"]),
    Row("calibrate hand-eye", "odd", "the sensor's quaternions with w first", "fail; whose, w first, and the header's names", STREAM, 3,
        lambda folder: rows_hand_eye.stream(folder, sensor_line=w_first), "fail",
        says=["quaternions of the tracker's poses seem to have w first", "qw,qx,qy,qz"], writes=["hand_eye.json"]),
    Row("calibrate hand-eye", "odd", "the sensor's quaternions with w last under the names q0 to q3", "fail; whose, w last, and the header's names",
        STREAM, 3, lambda folder: rows_hand_eye.stream(folder, sensor_line=w_last_as_q0), "fail",
        says=["quaternions of the tracker's poses seem to have w last", "qx,qy,qz,qw"], writes=["hand_eye.json"]),
    Row("calibrate hand-eye", "odd", "the eye's quaternions with w first", "fail; whose, w first, and the header's names", STREAM, 3, eye_w_first, "fail",
        says=["quaternions of the camera's poses seem to have w first", "qw,qx,qy,qz"], writes=["hand_eye.json"]),
    Row("calibrate hand-eye", "odd", "positions with y and z exchanged, rotations without", "fail; the axes are exchanged, and how", STREAM, 3,
        lambda folder: rows_hand_eye.stream(folder, sensor_line=y_up), "fail", says=["axes .* exchanged", "read from x, z, y"], writes=["hand_eye.json"]),
    Row("calibrate hand-eye", "good", "the eye's poses in metres, said by --eye-unit m", "pass; to 1 mm", STREAM + " --eye-unit m", 0, eye_in_metres, "pass",
        writes=BOTH, check=rows_hand_eye.close_to_truth(1.0)),
    Row("calibrate hand-eye", "odd", "the eye's poses in metres, and nobody says so", "fail; --eye-unit m", STREAM, 3, eye_in_metres, "fail",
        says=["--eye-unit m"], writes=["hand_eye.json"]),
    Row("calibrate hand-eye", "wrong", "--eye-unit metres", "refused: the units, and of what", STREAM + " --eye-unit metres", 2, rows_hand_eye.stream,
        says=["--eye-unit", "metres", "mm, cm, m or in", "--eye-poses"]),
    Row("calibrate tip", "good", "an export of OptiTrack Motive with one rigid body", "pass; metres as its header says", MOTIVE_RUN, 0, motive(), "pass",
        says=["OptiTrack Motive", "metres"], writes=TIP_BOTH, check=tip_close(0.5)),
    Row("calibrate tip", "good", "an export of Motive 3 with two rigid bodies, of which --tool names one", "pass; the tip to 0.5 mm",
        MOTIVE_RUN + " --tool Pointer", 0, motive(("Pointer", "Scope"), parent=True), "pass", writes=TIP_BOTH, check=tip_close(0.5)),
    Row("calibrate tip", "odd", "the same, and nobody says which", "refused: --tool, and both names", MOTIVE_RUN, 2, motive(("Pointer", "Scope")),
        says=["--tool NAME", "Pointer, Scope"]),
    Row("calibrate tip", "wrong", "an export of Motive with angles", "refused: Rotation Type Quaternion", MOTIVE_RUN, 2, motive(turns="XYZ"),
        says=["Motive", "Rotation Type Quaternion"]),
    Row("calibrate tip", "good", "where a body's points were tracked, and the body", "pass; the tip to 0.5 mm", BODY_RUN, 0, body(), "pass",
        writes=TIP_BOTH, check=tip_close(0.5)),
    Row("calibrate tip", "odd", "the same in metres, and nobody says so", "refused: the body is too small, --unit m", BODY_RUN, 2, body(1000.0, 1000.0),
        says=["body.csv", "--unit m"]),
    Row("calibrate tip", "odd", "the same in inches, and nobody says so", "refused: the body is too small, --unit in", BODY_RUN, 2, body(25.4, 25.4),
        says=["body.csv", "inches", "--unit in"]),
    Row("calibrate tip", "good", "the same in inches, said by --unit in", "pass; the tip to 0.5 mm", BODY_RUN + " --unit in", 0, body(25.4, 25.4), "pass",
        writes=TIP_BOTH, check=tip_close(0.5)),
    Row("calibrate tip", "odd", "a body in mm, its tracked points in inches", "refused: one unit for both", BODY_RUN, 2, body(1.0, 25.4),
        says=["1/25", "inches", "one unit"]),
    Row("calibrate tip", "odd", "a body in cm, its tracked points in mm", "refused: one unit for both", BODY_RUN, 2, body(10.0, 1.0),
        says=["10 times", "cm", "one unit"]),
    Row("calibrate tip", "wrong", "a body as 4x4 matrices", "refused: x y z a line", BODY_RUN, 2, body(text="1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"),
        says=["body.csv", "x,y,z"]),
    Row("calibrate tip", "wrong", "a body as a JSON file", "refused: x y z a line", BODY_RUN, 2, body(text='{"points": [[0, 0, 0], [50, 0, 5]]}\n'),
        says=["body.csv", "x,y,z"]),
    Row("calibrate tip", "wrong", "a body whose points stand in one line", "refused: x y z a line", BODY_RUN, 2,
        body(text="0,0,0,50,0,5,0,80,0,-30,20,25\n"), says=["body.csv", "12 numbers", "x,y,z"]),
]
