"""birdseye calibrate camera."""
import dataclasses
import json
import subprocess

import boards
import draw
from judge import Row

CALIBRATE = "birdseye calibrate camera --board {} --images {} --out camera.yaml --json lens.json"


def focal_length_within(share, fx=boards.LENS.fx, fy=boards.LENS.fy):
    """A check that lens.json has the focal lengths that the pictures were drawn with."""
    def check(folder, _):
        matrix = json.loads((folder / "lens.json").read_text())["camera_matrix"]
        flat = [v for row in matrix for v in (row if isinstance(row, list) else [row])]
        off = max(abs(flat[0] / fx - 1), abs(flat[4] / fy - 1))
        return f"focal length is off by {100 * off:.2f} %" if off > share else ""
    return check


def chessboards(folder, count=15, **more):
    boards.write_views(folder / "shots", boards.chessboard, boards.poses(count), **more)


def charucos(folder, legacy=False):
    boards.write_views(folder / "shots", lambda: draw.charuco(9, 6, 5.0, 4.0, legacy=legacy),
                       boards.poses(15, centre=(22.5, 15.0)))


def inset_board():
    """A ChArUco board with a chessboard of 5 x 4 small squares in its middle."""
    yield from draw.charuco(9, 8, 5.0, 4.0)
    x0, y0 = 22.5 - 7.5, 20.0 - 6.0
    yield [(x0 - 3.0, y0 - 3.0), (x0 + 18.0, y0 - 3.0), (x0 + 18.0, y0 + 15.0), (x0 - 3.0, y0 + 15.0)], draw.LIGHT
    for i in range(5):
        for j in range(4):
            if (i + j) % 2 == 0:
                x, y = x0 + 3.0 * i, y0 + 3.0 * j
                yield [(x, y), (x + 3.0, y), (x + 3.0, y + 3.0), (x, y + 3.0)], draw.DARK


def insets(folder):
    boards.write_views(folder / "shots", inset_board, boards.poses(15, centre=(22.5, 20.0)))


def dotted(folder, mirror=False, larger=(27, 30, 60)):
    views = boards.poses(15, centre=(20.0, 16.0), distance_mm=100.0)
    (folder / "shots").mkdir()
    for k, pose in enumerate(views):
        picture = draw.view(draw.dots(11, 9, 4.0, larger=larger), boards.LENS, pose)
        draw.write_pgm(folder / "shots" / f"view{k:02d}.pgm", draw.mirrored(picture) if mirror else picture)


def mirrored_charucos(folder):
    (folder / "shots").mkdir()
    for k, pose in enumerate(boards.poses(12, centre=(22.5, 15.0))):
        draw.write_pgm(folder / "shots" / f"view{k:02d}.pgm",
                       draw.mirrored(draw.view(draw.charuco(9, 6, 5.0, 4.0), boards.LENS, pose)))


def blurred(folder):
    chessboards(folder, 8)
    for path in sorted((folder / "shots").iterdir()):
        soft = path.with_suffix(".png")
        subprocess.run(["ffmpeg", "-v", "error", "-i", path, "-vf", "gblur=sigma=9", soft], check=True)
        path.unlink()


def flat_views(folder):
    boards.write_views(folder / "shots", boards.chessboard, boards.poses(12, tilt_deg=1.0))


def two_sizes(folder):
    chessboards(folder, 12)
    small = draw.Lens(width=320, height=240, fx=300, fy=300, cx=161, cy=118)
    draw.write_pgm(folder / "shots" / "view99.pgm", draw.view(boards.chessboard(), small, boards.poses(3)[1]))


def truncated_png(folder):
    chessboards(folder, 15, name="view{:02d}.png", write=draw.write_png)
    path = folder / "shots" / "view03.png"
    path.write_bytes(path.read_bytes()[:700])


def rubbish_beside(folder):
    chessboards(folder, 15)
    (folder / "shots" / "notes.txt").write_text("zoom at 1.0\n")
    (folder / "shots" / "empty.png").write_bytes(b"")


def squeezed(folder):
    lens = dataclasses.replace(boards.LENS, height=240, fy=300.0, cy=118.0)
    chessboards(folder, 15, lens=lens)


def ppm_of_two_cameras(folder):
    boards.write_views(folder / "shots", boards.chessboard, boards.poses(12), name="left{:02d}.ppm", write=draw.write_ppm)
    draw.write_pgm(folder / "shots" / "right00.pgm", draw.view(boards.chessboard(), boards.LENS, boards.poses(3)[0]))


def grey_only(folder):
    (folder / "shots").mkdir()
    for k in range(6):
        draw.write_pgm(folder / "shots" / f"view{k}.pgm", draw.Picture(320, 240))


def a_record_that_was_cut(folder):
    chessboards(folder, 15)
    (folder / "scope.json").write_text('{"scope": "30 degrees", "le')


def record_left_alone(folder, _):
    return "" if (folder / "scope.json").read_text().endswith('"le') else "scope.json was written over"


CHESS = CALIBRATE.format(boards.CHESSBOARD, "shots")
CHARUCO = CALIBRATE.format("charuco:9x6:5mm:4mm:DICT_4X4_250", "shots")
BOTH = ("camera.yaml", "lens.json")

ROWS = [
    Row("calibrate camera", "good", "15 sharp views of a chessboard, tilted to all sides",
        "pass; the lens that the pictures were drawn with, to 0.5 %", CHESS, 0, chessboards, "pass",
        writes=BOTH, check=focal_length_within(0.005)),
    Row("calibrate camera", "good", "15 views of a ChArUco board", "pass; focal length to 0.5 %", CHARUCO, 0, charucos, "pass",
        writes=BOTH, check=focal_length_within(0.005)),
    Row("calibrate camera", "good", "a ChArUco board with a chessboard in its middle",
        "pass; focal length to 0.5 %; points of both are used",
        CALIBRATE.format("charuco:9x8:5mm:4mm:DICT_4X4_250:inset=4x3:3mm", "shots"), 0, insets, "pass", writes=BOTH,
        check=focal_length_within(0.005)),
    Row("calibrate camera", "good", "dots, three of them larger", "pass; focal length to 0.5 %",
        CALIBRATE.format("dots:11x9:4mm:markers=27,30,60", "shots"), 0, dotted, "pass", writes=BOTH,
        check=focal_length_within(0.005)),
    Row("calibrate camera", "good", "colour PPM pictures, chosen by `?` out of a folder of two cameras",
        "that camera's pictures alone are used; pass", CALIBRATE.format(boards.CHESSBOARD, '"shots/left??.ppm"'), 0, ppm_of_two_cameras,
        "pass", says=["views used"], says_not=["right00"], writes=BOTH, check=focal_length_within(0.005)),
    Row("calibrate camera", "good", "rows of a field alone (640 x 240), with --pixel-aspect",
        "pass; fy is half of fx", CHESS + " --pixel-aspect 0.5", 0, squeezed, "pass", writes=BOTH,
        check=focal_length_within(0.01, 600.0, 300.0)),
    Row("calibrate camera", "odd", "a ChArUco board of the old layout, told as new",
        "the pictures decide: pass, and a line says that it is the old layout", CHARUCO, 0,
        lambda folder: charucos(folder, legacy=True), "pass", says=["old layout|legacy"], writes=BOTH,
        check=focal_length_within(0.005)),
    Row("calibrate camera", "odd", "a note and an empty picture among the views",
        "the views are used; the empty picture is named", CHESS, 0, rubbish_beside, "pass", says=["empty.png"], writes=BOTH),
    Row("calibrate camera", "odd", "one PNG of 15 was cut short", "it is named and left out or read as far as it goes; pass",
        CHESS, 0, truncated_png, "pass", says=["view03.png"], writes=BOTH, check=focal_length_within(0.005)),
    Row("calibrate camera", "odd", "only 6 views", "not a pass: too few; marginal at best, with advice", CHESS, 0,
        lambda folder: chessboards(folder, 6), "marginal", says=["views used: 6, less than 10", "next"], writes=BOTH),
    Row("calibrate camera", "odd", "rows of a field alone, without --pixel-aspect",
        "fail: fx and fy are apart, and what to give", CHESS, 3, squeezed, "fail", says=["pixel-aspect"], writes=["lens.json"]),
    Row("calibrate camera", "odd", "all views face the board", "fail: focal length is open; tilt the board; no camera.yaml",
        CHESS, 3, flat_views, "fail", says=["tilt"], writes=["lens.json"]),
    Row("calibrate camera", "odd", "two views", "fail or refused: too few views; no camera.yaml", CHESS, 3,
        lambda folder: chessboards(folder, 2), "fail", says=["views"], writes=["lens.json"]),
    Row("calibrate camera", "wrong", "the board has 9x6 inner corners, 8x5 were given",
        "fail: no view serves, each says which board is seen", CALIBRATE.format("chessboard:8x5:5mm", "shots"), 3,
        lambda folder: chessboards(folder, 6), "fail", says=["9x6.*8x5", "next:.*(count|pattern|--board)"], writes=["lens.json"]),
    Row("calibrate camera", "wrong", "the board was counted in squares, 10x7",
        "fail: no view serves; 9x6 are seen; inner corners count", CALIBRATE.format("chessboard:10x7:5mm", "shots"), 3,
        lambda folder: chessboards(folder, 6), "fail", says=["9x6 inner corners.*10x7", "next:.*(count|pattern|--board)"], writes=["lens.json"], slow=True),
    Row("calibrate camera", "odd", "pictures of two sizes", "refused: both sizes and the picture that differs are named", CHESS, 2,
        two_sizes, says=["view99", "320.*240", "640.*480"]),
    Row("calibrate camera", "wrong", "mirrored pictures of dots", "fail: they are mirrored",
        CALIBRATE.format("dots:11x9:4mm:markers=27,30,60", "shots"), 3, lambda folder: dotted(folder, mirror=True), "fail",
        says=["mirror"], writes=["lens.json"]),
    Row("calibrate camera", "wrong", "mirrored pictures of a ChArUco board", "fail: they are mirrored", CHARUCO, 3,
        mirrored_charucos, "fail", says=["mirror"], writes=["lens.json"]),
    Row("calibrate camera", "odd", "views out of focus", "fail: each is blurred, and what to do", CHESS, 3, blurred, "fail",
        says=["blurred: edges are 1\\d", "next:.*sharp"], writes=["lens.json"]),
    Row("calibrate camera", "wrong", "pictures without a board", "fail: no chessboard is found", CHESS, 3, grey_only, "fail",
        says=["no chessboard is found"], writes=["lens.json"]),
    Row("calibrate camera", "wrong", "a board without a unit of length", "refused: the unit is missing",
        CALIBRATE.format("chessboard:9x6:5", "shots"), 2, lambda folder: chessboards(folder, 2), says=["mm"]),
    Row("calibrate camera", "wrong", "an empty folder of pictures", "refused: no picture in it", CHESS, 2,
        lambda folder: (folder / "shots").mkdir(), says=["shots"]),
    Row("calibrate camera", "wrong", "a calibration record that was cut short",
        "refused before the work: it is no sound record; it is left alone", CHESS + " --record scope.json", 2,
        a_record_that_was_cut, says=["scope.json"], check=record_left_alone),
    Row("calibrate camera", "wrong", "--out into a folder that is not there", "refused: the folder is named",
        CHESS.replace("--out camera.yaml", "--out nowhere/camera.yaml"), 2, chessboards, says=["nowhere"]),
    Row("calibrate camera", "odd", "12 real webcam pictures of a chessboard", "not a pass, for the board is bent; focal length 630 px, as the manual has it, to 3 %",
        "birdseye calibrate camera --board chessboard:14x10:6mm --images $DATA/camera_chessboard_webcam --json lens.json", 0,
        data=["camera_chessboard_webcam"], verdict="marginal", writes=["lens.json"], check=focal_length_within(0.03, 630, 630)),
]
