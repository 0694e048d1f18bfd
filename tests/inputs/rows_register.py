"""birdseye register."""
import math
import random

import boards
import motion
import volumes
from judge import Row

MARKERS = ((0, 0, 0), (120, 10, 5), (15, 140, -10), (130, 150, 30), (60, 70, 90), (-20, 60, 45))
TRACKER_FROM_PATIENT = motion.product(motion.shift(300.0, -40.0, 120.0), motion.turn((0.3, -0.5, 1.0), 70.0))
FIDUCIALS = "birdseye register fiducials --ct ct.txt --tracker touched.txt --out patient_from_tracker.txt --json r.json"
BOTH = ("patient_from_tracker.txt", "r.json")


def points_text(points):
    return "".join(" ".join(f"{v:.5f}" for v in point) + "\n" for point in points)


def fiducials(folder, count=6, change=None, noise_mm=0.3, header=""):
    chance = random.Random(17)
    places = [tuple(float(v) for v in marker) for marker in MARKERS[:count]]
    touched = [tuple(v + chance.gauss(0, noise_mm) for v in motion.apply(TRACKER_FROM_PATIENT, place)) for place in places]
    if change:
        places, touched = change(places, touched)
    (folder / "ct.txt").write_text(header + points_text(places))
    (folder / "touched.txt").write_text(points_text(touched))


def close(mm):
    def check(folder, _):
        found = motion.inverse(motion.read_matrix(folder / "patient_from_tracker.txt"))
        off = max(math.dist(motion.apply(found, m), motion.apply(TRACKER_FROM_PATIENT, m)) for m in MARKERS)
        return f"a marker is off by {off:.2f} mm" if off > mm else ""
    return check


def mirrored(places, touched):
    return [(-x, y, z) for x, y, z in places], touched


def swapped(places, touched):
    return places, [touched[1], touched[0], *touched[2:]]


def scrambled(places, touched):
    return places, [touched[k] for k in (3, 0, 5, 1, 4, 2)]


def one_off(places, touched):
    return places, [*touched[:4], tuple(v + 8 for v in touched[4]), *touched[5:]]


def in_metres(places, touched):
    return places, [tuple(v / 1000 for v in point) for point in touched]


def on_a_line(places, touched):
    return [(10.0 * k, 5.0 * k, 0.0) for k in range(5)], [motion.apply(TRACKER_FROM_PATIENT, (10.0 * k, 5.0 * k, 0.0)) for k in range(5)]


def with_nan(places, touched):
    return places, [(math.nan, 0.0, 0.0), *touched[1:]]


def one_more(places, touched):
    return places, touched[:-1]


def same_point(places, touched):
    return places, [touched[0]] * len(touched)


def numbered(folder):
    fiducials(folder)
    for name in ("ct.txt", "touched.txt"):
        lines = (folder / name).read_text().splitlines()
        (folder / name).write_text("".join(f"{number} {line}\n" for number, line in enumerate(lines, 1)))


def comments(folder):
    fiducials(folder, header="# x y z, mm, LPS\r\n")


def named(folder):
    """As 3D Slicer saves its points."""
    fiducials(folder)
    lines = (folder / "ct.txt").read_text().splitlines()
    (folder / "ct.txt").write_text("# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n"
                                   "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n" +
                                   "".join(f"{k},{','.join(line.split())},0,0,0,1,1,1,0,F-{k},,\n" for k, line in enumerate(lines)))


NAMES = ("left ear", "right ear", "nose", "chin", "brow", "nape")


def both_named(folder):
    fiducials(folder)
    places = dict(zip(NAMES, (folder / "ct.txt").read_text().splitlines()))
    touched = dict(zip(NAMES, (folder / "touched.txt").read_text().splitlines()))
    (folder / "ct.txt").write_text("".join(f"{name} {places[name]}\n" for name in reversed(NAMES)))
    (folder / "touched.txt").write_text("name,x,y,z\n" + "".join(f"{name},{','.join(touched[name].split())}\n" for name in NAMES[1:]))


def spreadsheet(folder):
    fiducials(folder)
    lines = (folder / "ct.txt").read_text().replace(".", ",").splitlines()
    (folder / "ct.txt").write_text("\ufeffNr;Name;x [mm];y [mm];z [mm]\r\n" +
                                   "".join(f"{k};Punkt {k};{';'.join(line.split())}\r\n" for k, line in enumerate(lines)))


def larger(places, touched):
    return [tuple(1.05 * v for v in place) for place in places], touched


def flat(places, touched):
    chance = random.Random(5)
    places = [(0.0, 0.0, 0.0), (120.0, 10.0, 0.0), (15.0, 140.0, 0.0), (130.0, 150.0, 0.0), (60.0, 70.0, 0.0)]
    return places, [tuple(v + chance.gauss(0, 0.3) for v in motion.apply(TRACKER_FROM_PATIENT, place)) for place in places]


IN_CT = FIDUCIALS + " --volume ct.nii.gz"


def in_ct(folder, wrong):
    """Markers of the small CT, of which the patient's middle is 300 mm to the left of the frame's, and what a wrong file makes of them."""
    volumes.write_nifti(folder / "ct.nii.gz", shift_mm=(300.0, 0.0, 0.0))
    places = [(x + 300.0, y, z) for x, y, z in volumes.MARKERS_MM] + [(285.0, 35.0, 140.0)]
    (folder / "touched.txt").write_text(points_text([motion.apply(TRACKER_FROM_PATIENT, place) for place in places]))
    (folder / "ct.txt").write_text(points_text([wrong(place) for place in places]))


def landmarks_in_ct(folder, wrong):
    """Places amid the small CT that no marker shows; the patient's middle is that of the frame, so that he is at the turned places too."""
    volumes.write_nifti(folder / "ct.nii.gz")
    places = [(-30.0, -10.0, 120.0), (25.0, -12.0, 125.0), (-22.0, 20.0, 150.0), (28.0, 15.0, 160.0), (4.0, -20.0, 140.0), (0.0, 25.0, 130.0)]
    (folder / "touched.txt").write_text(points_text([motion.apply(TRACKER_FROM_PATIENT, place) for place in places]))
    (folder / "ct.txt").write_text(points_text([wrong(place) for place in places]))


PELVIS = "$DATA/fiducial_registration_pelvis_phantom"


def unspaced_case(stated=""):
    def make(folder):
        case(folder, **{'path = "ct.nii.gz"\n': 'path = "ct.mha"\n' + stated})
        volumes.write_mha(folder / "whole.mha")
        (folder / "ct.mha").write_bytes((folder / "whole.mha").read_bytes().replace(b"ElementSpacing = 2 2 2\n", b""))
    return make


def case(folder, **changes):
    """A case of a CT and one picture, to be refused."""
    volumes.write_nifti(folder / "ct.nii.gz")
    (folder / "camera.yaml").write_text(boards.lens_yaml())
    boards.write_views(folder, boards.chessboard, boards.poses(2), name="view{}.png", write=boards.draw.write_png)
    boards.write_poses(folder, [motion.product(motion.shift(0, 0, 260.0), motion.turn((1, 0, 0), 90.0), motion.shift(15, 0, -140))] * 2,
                       name="view{}.txt")
    text = ('[volume]\npath = "ct.nii.gz"\ntransfer = "liver"\n[model]\ncontrol_points = "auto"\n' +
            "".join(f'[[view]]\nimage = "view{k}.png"\ncamera = "camera.yaml"\ncamera_from_patient = "view{k}.txt"\n' for k in range(2)))
    for old, new in changes.items():
        text = text.replace(old, new)
    (folder / "case.toml").write_text(text)


def inverted_case(folder):
    case(folder)
    for k in range(2):
        pose = folder / f"view{k}.txt"
        pose.write_text(motion.matrix_text(motion.inverse(motion.read_matrix(pose))))


def case_but(old, new):
    return lambda folder: case(folder, **{old: new})


def case_without(name):
    def make(folder):
        case(folder)
        (folder / name).unlink()
    return make


def simulated(seed, change="true", options=""):
    """A simulated case of small pictures, with one thing changed, is registered."""
    return (f"birdseye-sim case --out case --seed {seed} --size 384x288 {options}>/dev/null 2>&1 && {change} && "
            "birdseye register views --case case/case.toml --out out")


LONGER_LENS = "sed -i -e 's/2[.]991[0-9]*e+02/3.1416e+02/' -e 's/3[.]009[0-9]*e+02/3.1600e+02/' case/camera.yaml"
NEARER_VIEW = "awk 'NR == 3 { $4 -= 15 } { print }' case/view2.txt > moved.txt && mv moved.txt case/view2.txt"
EXCHANGED_VIEWS = "mv case/view0.txt moved.txt && mv case/view2.txt case/view0.txt && mv moved.txt case/view2.txt"

VIEWS = "birdseye register views --case case.toml --out out"

ROWS = [
    Row("register fiducials", "good", "six markers, touched to 0.3 mm", "pass; to 1 mm", FIDUCIALS, 0, fiducials, "pass", writes=BOTH,
        check=close(1.0)),
    Row("register fiducials", "good", "touched in another order, --match", "pass; the order is found", FIDUCIALS + " --match", 0,
        lambda folder: fiducials(folder, change=scrambled), "pass", writes=BOTH, check=close(1.0)),
    Row("register fiducials", "good", "four real markers of a pelvis phantom", "FRE 0.43 mm, as published",
        f"birdseye register fiducials --ct {PELVIS}/pelvis_cropped_ct_fiducial_markers.txt --tracker {PELVIS}/Tracker_Fiducial_Markers.txt "
        "--out patient_from_tracker.txt --json r.json", 0, verdict="pass", data=["fiducial_registration_pelvis_phantom"], says=["0\\.43"],
        writes=BOTH),
    Row("register fiducials", "odd", "one of six touched 14 mm off", "marginal; the fifth is named; to 1 mm without it", FIDUCIALS, 0,
        lambda folder: fiducials(folder, change=one_off), "marginal", says=["\\b5\\b"], writes=BOTH),
    Row("register fiducials", "odd", "three markers alone", "marginal: a wrong one could not be told, nor a mirrored file", FIDUCIALS, 0,
        lambda folder: fiducials(folder, 3), "marginal", says=["cannot be told", "whether a file is mirrored", "off the plane"], writes=BOTH),
    Row("register fiducials", "odd", "a remark before the points, DOS' ends of lines", "read all the same", FIDUCIALS, 0, comments, "pass",
        writes=BOTH, check=close(1.0)),
    Row("register fiducials", "odd", "the CT's points as 3D Slicer saves them (.fcsv)", "read, in its frame", FIDUCIALS, 0, named,
        "pass", writes=BOTH, check=close(1.0)),
    Row("register fiducials", "good", "points of both files with names, in different orders, more in the CT", "paired by name", FIDUCIALS, 0,
        both_named, "pass", says=["paired by their names", "\\(right ear\\)"], writes=BOTH, check=close(1.0)),
    Row("register fiducials", "good", "numbered points, in both files", "read", FIDUCIALS, 0, numbered, "pass", writes=BOTH,
        check=close(1.0)),
    Row("register fiducials", "odd", "a spreadsheet's CSV with a header, semicolons and decimal commas", "read", FIDUCIALS, 0, spreadsheet,
        "pass", writes=BOTH, check=close(1.0)),
    Row("register fiducials", "wrong", "the CT's points in RAS, with the CT at hand", "fail: they look like RAS, and what to do", IN_CT, 3,
        lambda folder: in_ct(folder, lambda p: (-p[0], -p[1], p[2])), "fail", says=["looks like RAS", "other sign of x and y"], writes=["r.json"]),
    Row("register fiducials", "wrong", "the CT's points 1000 mm above the CT", "fail: where the CT lies", IN_CT, 3,
        lambda folder: in_ct(folder, lambda p: (p[0], p[1], p[2] + 1000)), "fail", says=["outside of the CT", "The CT has x from"],
        writes=["r.json"]),
    Row("register fiducials", "wrong", "landmarks of the CT in RAS, where the patient is too", "marginal: nothing tells LPS from RAS; look", IN_CT, 0,
        lambda folder: landmarks_in_ct(folder, lambda p: (-p[0], -p[1], p[2])), "marginal", says=["in LPS, or in RAS", "--report"], writes=BOTH),
    Row("register fiducials", "good", "points of the CT, with the CT at hand", "pass", IN_CT, 0, lambda folder: in_ct(folder, lambda p: p),
        "pass", writes=BOTH),
    Row("register fiducials", "wrong", "the CT's points by a spacing that is 5 % too large", "fail: the spacing", FIDUCIALS, 3,
        lambda folder: fiducials(folder, change=larger), "fail", says=["lengths in the CT are 1.05", "spacing"], writes=["r.json"]),
    Row("register fiducials", "odd", "five markers in one plane", "marginal: one more off the plane", FIDUCIALS, 0,
        lambda folder: fiducials(folder, change=flat), "marginal", says=["nearly in a plane", "off the plane"], writes=BOTH),
    Row("register fiducials", "odd", "two markers in the wrong order", "fail; --match is named", FIDUCIALS, 3,
        lambda folder: fiducials(folder, change=swapped), "fail", says=["order|--match"], writes=["r.json"]),
    Row("register fiducials", "wrong", "mirrored: the CT's points in another handedness", "fail; they are mirrored", FIDUCIALS, 3,
        lambda folder: fiducials(folder, change=mirrored), "fail", says=["mirror"], writes=["r.json"]),
    Row("register fiducials", "wrong", "touches in metres", "fail; the unit is named", FIDUCIALS, 3,
        lambda folder: fiducials(folder, change=in_metres), "fail", says=["metres"], writes=["r.json"]),
    Row("register fiducials", "wrong", "all markers on a line", "refused: on a line", FIDUCIALS, 2,
        lambda folder: fiducials(folder, change=on_a_line), says=["line"]),
    Row("register fiducials", "wrong", "two markers", "refused: three are needed", FIDUCIALS, 2, lambda folder: fiducials(folder, 2),
        says=["three|at least 3"]),
    Row("register fiducials", "odd", "six markers, five touches, no --match", "refused: both numbers; --match", FIDUCIALS, 2,
        lambda folder: fiducials(folder, change=one_more), says=["6", "5"]),
    Row("register fiducials", "wrong", "a touch that is not a number", "refused: the line is named", FIDUCIALS, 2,
        lambda folder: fiducials(folder, change=with_nan), says=["touched.txt", "line 1|1"]),
    Row("register fiducials", "wrong", "the same touch six times", "refused: they are one point", FIDUCIALS, 2,
        lambda folder: fiducials(folder, change=same_point), says=["touched|same|line"]),
    Row("register views", "good", "a simulated case of three views", "pass; a field, a report; the error is less than before",
        "birdseye-sim case --out case --seed 2 --views 4 --size 512x384 >/dev/null 2>&1 && birdseye register views --case case/case.toml --out out", 0,
        verdict="pass", says=["report\\.html: "], writes=["case/*", "out/*"], slow=True),
    Row("register views", "good", "poses of a tracker whose records are averaged", "pass; says that the lens is taken for exact",
        simulated(3, options="--pose-noise-mm 0.5 --pose-noise-deg 0.1 "), 0, verdict="pass", says=["if the lens is as its camera file says"],
        writes=["case/*", "out/*"], slow=True),
    Row("register views", "wrong", "the camera's file has focal lengths that are 5 % too long", "fail: the lens; to calibrate it again",
        simulated(1, LONGER_LENS), 3, verdict="fail", says=["focal lengths.*shorter", "calibrate the camera again"],
        writes=["case/*", "out/*"], slow=True),
    Row("register views", "odd", "one of five poses is 15 mm off along its line of sight", "marginal or fail: the view is named",
        simulated(2, NEARER_VIEW), 0, verdict="marginal", says=["view2\\.png does not agree with the other views"], writes=["case/*", "out/*"],
        slow=True),
    Row("register views", "odd", "two views have each other's pose", "marginal or fail: one of the two is named",
        simulated(4, EXCHANGED_VIEWS, "--deformation push --amplitude-mm 12 --push-width-mm 40 "), 0, verdict="marginal",
        says=["view[02]\\.png does not agree with the other views"], writes=["case/*", "out/*"], slow=True),
    Row("register views", "wrong", "a CT that is not there", "refused: the path is named", VIEWS, 2, case_without("ct.nii.gz"), says=["ct.nii.gz"]),
    Row("register views", "wrong", "a CT that does not say how far apart its voxels are", "refused: the key of the case that states it", VIEWS, 2,
        unspaced_case(), says=["no ElementSpacing", "spacing = \\[x, y, z\\] \\(mm\\) in \\[volume\\]"], says_not=["--spacing"]),
    Row("register views", "odd", "the same, with spacing = [2, 2, 2] in the case", "the CT is taken (and of a board alone nothing is found)", VIEWS, 3,
        unspaced_case("spacing = [2, 2, 2]\n"), "fail", says=["no place of the surface"], writes=["out/result.json"], slow=True),
    Row("register views", "wrong", "a pose that is not there", "refused: the path is named", VIEWS, 2, case_without("view1.txt"),
        says=["view1.txt"]),
    Row("register views", "wrong", "a key that there is not", "refused: the key is named", VIEWS, 2,
        case_but("[model]\n", "[model]\ncontroll_points = 3\n"), says=["controll_points"]),
    Row("register views", "wrong", "an optimiser that there is not", "refused: those that there are", VIEWS, 2,
        case_but("[model]\n", '[model]\noptimiser = "magic"\n'), says=["optimiser", "geometry"]),
    Row("register views", "odd", "poses of patient_from_camera", "fail: they are inverted", VIEWS, 3, inverted_case, "fail",
        says=["seem to be inverted"], writes=["out/result.json"]),
    Row("register views", "wrong", "views of a board, with no organ in them", "fail: no view tells where the organ is", VIEWS, 3, case,
        "fail", says=["no place of the surface"], writes=["out/result.json"], slow=True),
    Row("register views", "wrong", "hostile deep_case.toml", "refused at once",
        "birdseye register views --case $DATA/hostile/deep_case.toml --out out", 2, data=["hostile/deep_case.toml"], says=["deep_case.toml"]),
]
