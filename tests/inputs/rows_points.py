"""birdseye calibrate tip, latency, field and record."""
import json
import math
import random

import boards
import motion
import rows_camera
from judge import Row

TIP = (158.0, -6.0, 11.0)
DIVOT = (400.0, 20.0, 60.0)
TIP_RUN = "birdseye calibrate tip --poses poses.csv --out tip.txt --json tip.json"
TIP_BOTH = ("tip.txt", "tip.json")


def pivot(count=200, tilt_deg=30.0, noise_mm=0.3, seed=3):
    """tracker_from_sensor of a pointer that is led round in its divot."""
    chance = random.Random(seed)
    made = []
    for k in range(count):
        around = 2 * math.pi * k / count * 5
        turn = motion.product(motion.turn((0, math.cos(around), math.sin(around)), tilt_deg * (0.4 + 0.6 * math.sin(0.031 * k) ** 2)),
                              motion.turn((1, 0, 0), 30 * math.sin(0.05 * k)))
        tip = motion.apply(turn, TIP)
        made.append(motion.product(motion.shift(*(d - t + chance.gauss(0, noise_mm) for d, t in zip(DIVOT, tip))), turn))
    return made


def table(transforms, rate_hz=40.0):
    return "".join(motion.table_line(pose, 100 + k / rate_hz) for k, pose in enumerate(transforms))


def tip_file(text):
    def make(folder):
        (folder / "poses.csv").write_text(text() if callable(text) else text)
    return make


def read_tip(folder):
    lines = [line for line in (folder / "tip.txt").read_text().splitlines() if not line.startswith("#")]
    return [float(v) for v in lines[0].split()]


def tip_close(mm, truth=TIP):
    def check(folder, _):
        off = math.dist(read_tip(folder), truth)
        return f"the tip is off by {off:.2f} mm" if off > mm else ""
    return check


def no_times():
    return "x,y,z,qx,qy,qz,qw\n" + "".join(motion.table_line(pose) for pose in pivot())


def ndi_log():
    lines = ["Tools,Port 1,Frame,Face,State,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error,Markers"]
    for k, pose in enumerate(pivot()):
        x, y, z, w = motion.quaternion(pose)
        state = "OK" if k % 20 else "Missing"
        numbers = [w, x, y, z, pose[0][3], pose[1][3], pose[2][3], 0.21]
        lines.append(f"1,1,{1000 + k},0,{state}," + (",".join(f"{v:.6f}" for v in numbers) if k % 20 else "," * 7) + ",4")
    return "\n".join(lines) + "\n"


def excel():
    """As a spreadsheet of a German office saves it: a mark before UTF-8, semicolons, decimal commas, DOS' ends of lines."""
    lines = ["t;x;y;z;qx;qy;qz;qw"] + [line.strip().replace(",", ";").replace(".", ",") for line in table(pivot()).splitlines()]
    return "\ufeff" + "\r\n".join(lines) + "\r\n"


def with_outliers():
    poses = pivot()
    return table([motion.product(motion.shift(0, 0, 30), pose) if k % 25 == 7 else pose for k, pose in enumerate(poses)])


def with_nan():
    lines = table(pivot()).splitlines()
    lines[10] = "nan,nan,nan,nan,nan,nan,nan,nan"
    lines[20] = "100.5,1e30,2,3,0,0,0,1"
    return "\n".join(lines) + "\n"


def columns_twice():
    return "t,x,y,z,x,qy,qz,qw\n" + table(pivot(30))


def in_metres():
    return table([[[v / 1000 if j == 3 and i < 3 else v for j, v in enumerate(row)] for i, row in enumerate(pose)] for pose in pivot()])


def latency_streams(folder, moves=True, periodic=False, late_s=0.083, body_s=(0, 20), eye_s=(0, 20)):
    """Poses of the tracker and of the eye, from when to when each."""
    chance = random.Random(5)

    def turned(t):
        if not moves:
            return motion.IDENTITY
        if periodic:
            return motion.turn((0, 1, 0), 20 * math.sin(2 * math.pi * t))
        return motion.product(motion.turn((0, 1, 0), 18 * math.sin(2.9 * t) + 9 * math.sin(7.3 * t + 1)),
                              motion.turn((1, 0, 0), 15 * math.sin(2.1 * t + 2) + 8 * math.sin(5.9 * t)))

    body, eye = [], []
    for k in range(body_s[0] * 60, body_s[1] * 60):
        t = k / 60
        noise = motion.turn((1, 0.3, 0.2), chance.gauss(0, 0.05))
        body.append(motion.table_line(motion.product(motion.shift(300, 0, 0), turned(t), noise, boards.CAMERA_FROM_SENSOR), 50 + t))
    for k in range(eye_s[0] * 30, eye_s[1] * 30):
        t = k / 30
        eye.append(motion.table_line(motion.product(motion.shift(0, 0, 80), turned(t), motion.turn((0, 1, 0), chance.gauss(0, 0.05))),
                                     50 + t + late_s))
    (folder / "poses.csv").write_text("".join(body))
    (folder / "eye.csv").write_text("".join(eye))


def latency_is(ms):
    def check(folder, _):
        found = json.loads((folder / "latency.json").read_text())["offset_ms"]
        return f"the offset is {found}, not {ms} ms" if abs(found - ms) > 2 else ""
    return check


LATENCY = "birdseye calibrate latency --poses poses.csv --eye-poses eye.csv --out latency.toml --json latency.json"


def bent(place):
    """What metal makes of a place of the tracker, mm."""
    x, y, z = place
    near = math.exp(-((x - 400) ** 2 + (y - 100) ** 2 + (z - 50) ** 2) / (2 * 180.0 ** 2))
    return x + 9 * near, y - 6 * near, z + 5 * near


def grid(folder, unit=1.0, count=(6, 6, 5), header="name,true_x,true_y,true_z,x,y,z"):
    chance = random.Random(11)
    board = motion.product(motion.shift(120, -240, -200), motion.turn((0.2, 0.5, 1), 6))
    lines = [header]
    for k in range(count[2]):
        for j in range(count[1]):
            for i in range(count[0]):
                true = (100.0 * i, 96.0 * j, 100.0 * k)
                seen = [(v + chance.gauss(0, 0.2)) / unit for v in bent(motion.apply(board, true))]
                lines.append(f"P{i}{j}{k}," + ",".join(f"{v:.4f}" for v in (*true, *seen)))
    (folder / "grid.csv").write_text("\n".join(lines) + "\n")


FIELD = "birdseye calibrate field --grid grid.csv --out field.json --json figures.json"
PLATE = [("A", 0, 0), ("B", 150, 0), ("C", 150, 100), ("D", 0, 100), ("E", 75, 50), ("F", 75, 0)]


def plate(folder, bend_mm=0.0, days=9, swap=False, metres=False):
    chance = random.Random(8)
    (folder / "plate.csv").write_text("name,x,y,z\n" + "".join(f"{n},{x},{y},0\n" for n, x, y in PLATE))
    pose = motion.product(motion.shift(300, -50, 40), motion.turn((0, 0, 1), 20))

    def touched(bend):
        lines = []
        for name, x, y in PLATE:
            place = [v + chance.gauss(0, 0.25) for v in motion.apply(pose, (x, y, 0))]
            place[2] += bend if name == "C" else 0
            lines.append((name, [v / 1000 if metres else v for v in place]))
        if swap:
            lines[0], lines[2] = (lines[0][0], lines[2][1]), (lines[2][0], lines[0][1])
        return "name,x,y,z\n" + "".join(f"{n}," + ",".join(f"{v:.4f}" for v in p) + "\n" for n, p in lines)

    for day in range(days):
        (folder / f"day{day}.csv").write_text(touched(0.0))
    (folder / "today.csv").write_text(touched(bend_mm))


CHECK = ("for day in day?.csv; do birdseye calibrate field check --plate plate.csv --measured $day --history history.csv --when "
         "2026-11-2$(echo $day | tr -dc 0-9) >/dev/null 2>&1; done; birdseye calibrate field check --plate plate.csv --measured today.csv --history history.csv --when 2026-11-29 --json check.json")
CHECK_ONE = "birdseye calibrate field check --plate plate.csv --measured today.csv --history history.csv --when 2026-11-29"


def damaged_history(folder):
    plate(folder)
    (folder / "history.csv").write_text("\x00\x01 no history\n")


def record_of(folder):
    rows_camera.chessboards(folder, 15)


RECORD = (f"birdseye calibrate camera --board {boards.CHESSBOARD} --images shots --record scope.json && "
          "birdseye calibrate record scope.json")

ROWS = [
    Row("calibrate tip", "good", "a table of 200 poses of a pivot", "pass; the tip to 0.5 mm", TIP_RUN, 0,
        tip_file(lambda: table(pivot())), "pass", writes=TIP_BOTH, check=tip_close(0.5)),
    Row("calibrate tip", "good", "a table without times", "pass; rows count by their order", TIP_RUN, 0, tip_file(no_times), "pass",
        writes=TIP_BOTH, check=tip_close(0.5)),
    Row("calibrate tip", "good", "an NDI log in which the tool is missing now and then", "pass; the missing ones are counted", TIP_RUN, 0,
        tip_file(ndi_log), "pass", says=["10 .*missing|missing.*10"], writes=TIP_BOTH, check=tip_close(0.5)),
    Row("calibrate tip", "odd", "a spreadsheet's table: mark before UTF-8, semicolons, decimal commas, DOS' ends of lines", "read all the same; pass",
        TIP_RUN, 0, tip_file(excel), "pass", writes=TIP_BOTH, check=tip_close(0.5)),
    Row("calibrate tip", "odd", "8 of 200 poses are off by 30 mm", "they are named and left out; the tip to 0.5 mm", TIP_RUN, 0,
        tip_file(with_outliers), "pass", says=["line 8, .*line 33, .*line 58"], writes=TIP_BOTH, check=tip_close(0.5)),
    Row("calibrate tip", "odd", "a row of nan and a row of 1e30", "both lines are named and left out; pass", TIP_RUN, 0, tip_file(with_nan),
        "pass", says=["line 11", "line 21"], writes=TIP_BOTH, check=tip_close(0.5)),
    Row("calibrate tip", "odd", "poses in metres, and nobody says so", "fail; --unit m is named", TIP_RUN, 3, tip_file(in_metres), "fail",
        says=["--unit m"], writes=["tip.json"]),
    Row("calibrate tip", "odd", "tilted by 6 degrees only", "fail; tilt further; no tip.txt", TIP_RUN, 3,
        tip_file(lambda: table(pivot(tilt_deg=3.0))), "fail", says=["tilt"], writes=["tip.json"]),
    Row("calibrate tip", "wrong", "a pointer that lies still: one pose 200 times", "no tip comes of it", TIP_RUN, 3,
        tip_file(lambda: table([pivot(1)[0]] * 200)), "fail", says=["differ"], writes=["tip.json"]),
    Row("calibrate tip", "wrong", "a header with one column twice", "refused; the column is named", TIP_RUN, 2, tip_file(columns_twice),
        says=["poses.csv", r"\bx\b"]),
    Row("calibrate tip", "wrong", "an empty file", "refused; the file is named", TIP_RUN, 2, tip_file(""), says=["poses.csv"]),
    Row("calibrate tip", "wrong", "a picture in place of poses", "refused; what is read", TIP_RUN.replace("poses.csv", "shots/view00.pgm"), 2,
        lambda folder: rows_camera.chessboards(folder, 1), says=["view00.pgm"]),
    Row("calibrate tip", "wrong", "--phases beyond the file's end", "refused; how many poses there are", TIP_RUN + " --phases 0-99,150-900", 2,
        tip_file(lambda: table(pivot())), says=["900|200"]),
    Row("calibrate tip", "wrong", "an appliance that is not there", "refused within seconds; the address is named",
        "birdseye calibrate tip --server 127.0.0.1:1 --seconds 2 --out tip.txt", 2, says=["127.0.0.1:1"], slow=True),
    Row("calibrate tip", "odd", "a map of the field that another machine signed", "refused: the map, and that its machine is not known here",
        "BIRDSEYE_IDENTITY=$PWD/../other " + FIELD + " >/dev/null; " + TIP_RUN + " --field field.json", 2,
        lambda folder: (grid(folder), tip_file(lambda: table(pivot()))(folder)), says=["field.json: the map of the field is signed by .* not known"],
        writes=["field.json", "figures.json"]),
    Row("calibrate tip", "odd", "57 real poses of an optical pointer, with outliers", "marginal; the tip that the manual has, to 2 mm of the published one",
        TIP_RUN.replace("poses.csv", "$DATA/pivot_optical_pointer"), 0, verdict="marginal", data=["pivot_optical_pointer"], writes=TIP_BOTH,
        check=tip_close(2, (-14.473, 394.634, -7.407))),
    Row("calibrate tip", "odd", "Latin-1 remarks in a table", "the odd line is named, the result is written",
        TIP_RUN.replace("poses.csv", "$DATA/hostile/latin1.csv"), 0, data=["hostile/latin1.csv"], verdict="pass", says=["line 82"],
        writes=TIP_BOTH),

    Row("calibrate latency", "good", "two streams of poses, the eye 83 ms late", "pass; 83 ms", LATENCY, 0, latency_streams, "pass",
        says=["83"], writes=["latency.toml", "latency.json"], check=latency_is(83)),
    Row("calibrate latency", "good", "20 s of the tracker's poses within 60 s of the eye's", "pass; 83 ms, by the 20 s that both have", LATENCY, 0,
        lambda folder: latency_streams(folder, body_s=(30, 50), eye_s=(0, 60)), "pass", says=["only the 20.0 s that both have were used", "60.0 s of"],
        writes=["latency.toml", "latency.json"], check=latency_is(83)),
    Row("calibrate latency", "wrong", "5 s of the tracker's poses within 60 s of the eye's", "fail: how long the part in common has to be", LATENCY, 3,
        lambda folder: latency_streams(folder, body_s=(30, 35), eye_s=(0, 60)), "fail", says=["5.0 s in common, of at least 8"],
        writes=["latency.json"]),
    Row("calibrate latency", "odd", "an even swing", "fail: the motion repeats itself", LATENCY, 3,
        lambda folder: latency_streams(folder, periodic=True), "fail", says=["repeats"], writes=["latency.json"]),
    Row("calibrate latency", "wrong", "nothing moves", "fail: the tracker hardly moves", LATENCY, 3,
        lambda folder: latency_streams(folder, moves=False), "fail", says=["hardly moves"], writes=["latency.json"]),
    Row("calibrate latency", "wrong", "poses without times", "refused: times are needed", LATENCY, 2,
        lambda folder: [(folder / n).write_text(no_times()) for n in ("poses.csv", "eye.csv")], says=["time"]),
    Row("calibrate latency", "wrong", "streams 5 s apart", "fail: at no lag do they agree", LATENCY, 3,
        lambda folder: latency_streams(folder, late_s=5.0), "fail", writes=["latency.json"]),
    Row("calibrate latency", "wrong", "--recording of something else", "refused: no appliance recording",
        "birdseye calibrate latency --recording poses.csv", 2, latency_streams, says=["poses.csv"]),

    Row("calibrate field", "good", "180 places of a board, bent by up to 12 mm", "pass; the map is written", FIELD, 0, grid, "pass",
        writes=["field.json", "figures.json"]),
    Row("calibrate field", "odd", "the tracker's values in metres", "refused: mm against m", FIELD, 2,
        lambda folder: grid(folder, unit=1000.0), says=["mm"]),
    Row("calibrate field", "wrong", "12 places only", "refused: 30 are needed", FIELD, 2, lambda folder: grid(folder, count=(3, 2, 2)),
        says=["30"]),
    Row("calibrate field", "wrong", "a table without true places", "refused: the columns that lack", FIELD, 2,
        lambda folder: grid(folder, header="name,a,b,c,x,y,z"), says=["true_x"]),
    Row("calibrate field check", "good", "a tenth ordinary day", "pass", CHECK, 0, plate, "pass", writes=["history.csv", "check.json"]),
    Row("calibrate field check", "odd", "a table leg bends one place by 4 mm on the tenth day", "called out; look for metal", CHECK, 3,
        lambda folder: plate(folder, bend_mm=4.0), "fail", says=["metal"], writes=["history.csv", "check.json"]),
    Row("calibrate field check", "odd", "two divots were touched in the wrong order", "fail",
        CHECK_ONE, 3, lambda folder: plate(folder, swap=True), "fail", writes=["history.csv"]),
    Row("calibrate field check", "wrong", "touches in metres", "refused: metres; the history is left alone", CHECK_ONE, 2,
        lambda folder: plate(folder, metres=True), says=["were measured seem to be in metres"]),
    Row("calibrate field check", "wrong", "a history that is none", "refused; the file is left alone", CHECK_ONE, 2, damaged_history,
        says=["history.csv"]),

    Row("calibrate record", "good", "the record that calibrate camera wrote", "the lens with its verdict", RECORD, 0, record_of, "pass",
        says=["lens"], writes=["scope.json"]),
    Row("calibrate record", "wrong", "one figure changed by hand", "refused: changed",
        RECORD.split(" && ")[0] + " >/dev/null && sed -i 's/\"fx\": 6/\"fx\": 7/; s/\\[6/[7/; s/ 60/ 70/; s/59/69/' scope.json; birdseye calibrate record scope.json", 2, record_of,
        says=["scope.json", "chang|checksum"], writes=["scope.json"]),
    Row("calibrate record", "wrong", "a file that is not there", "refused: the file is named", "birdseye calibrate record none.json", 2,
        says=["none.json"]),
    Row("calibrate record", "wrong", "--bind where no appliance is", "refused: the address is named; the record is left alone",
        RECORD.split(" && ")[0] + " >/dev/null; birdseye calibrate record scope.json --bind 127.0.0.1:1", 2, record_of,
        says=["127.0.0.1:1"], writes=["scope.json"], slow=True),
]
