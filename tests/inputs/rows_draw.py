"""birdseye render, replay, export and bench."""
import hashlib

import boards
import draw
import motion
import rows_register
import volumes
from judge import Row
from rows_volume import with_seg, with_seg_of_another


def ct(folder):
    volumes.write_nifti(folder / "ct.nii.gz")


def ct_and_view(folder):
    """A CT, a lens, a pose before the patient, and a frame of that lens."""
    ct(folder)
    (folder / "camera.yaml").write_text(boards.lens_yaml())
    (folder / "pose.txt").write_text(motion.matrix_text(motion.product(
        motion.shift(0, 0, 220.0), [[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]], motion.shift(0, 0, -140.0))))
    draw.write_png(folder / "frame.png", draw.view(boards.chessboard(), boards.LENS, boards.poses(3)[0]))


def mirrored_pose(folder):
    ct_and_view(folder)
    (folder / "pose.txt").write_text("1 0 0 0\n0 1 0 0\n0 0 -1 250\n0 0 0 1\n")


def small_frame(folder):
    ct_and_view(folder)
    draw.write_png(folder / "frame.png", draw.Picture(320, 240))


def labels(folder):
    ct(folder)
    volumes.write_nifti(folder / "labels.nii.gz", volumes.labels())


def slicer_labels(segments):
    """The liver's voxels have 5; segments are the lines of 3D Slicer, each "Segment0_Name:=..." and so on."""
    def make(folder):
        ct(folder)
        volumes.write_nrrd(folder / "labels.seg.nrrd", values=volumes.labels(), lines="\n".join(segments) + "\n")
    return make


def field_that_folds(folder):
    ct(folder)
    numbers = volumes.array.array("f")
    for k in range(6):
        for j in range(6):
            for i in range(6):
                numbers.extend([-60.0 * (i % 2), 0.0, 0.0])
    (folder / "field.mha").write_bytes((
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
        "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = -60 -50 100\nElementSpacing = 20 20 15\nDimSize = 6 6 6\n"
        "ElementNumberOfChannels = 3\nElementType = MET_FLOAT\nElementDataFile = LOCAL\n").encode() + numbers.tobytes())


def transfer(folder):
    ct(folder)
    (folder / "colours.json").write_text('{"points": [{"hu": 100, "rgb": [0.8, 0.4, 0.3], "extinction_per_mm": 0}')


def registration(folder):
    ct(folder)
    (folder / "patient_from_tracker.txt").write_text(motion.matrix_text(motion.inverse(rows_register.TRACKER_FROM_PATIENT)))


def sealed_registration(folder):
    """As register fiducials writes it, of a CT of which nothing is here."""
    ct(folder)
    text = ("# patient_from_tracker of birdseye, mm; do not edit: a sum binds it\n# {\"ct_sha256\":\"" + 64 * "a" + "\"}\n" +
            motion.matrix_text(motion.inverse(rows_register.TRACKER_FROM_PATIENT)))
    (folder / "patient_from_tracker.txt").write_text(text + "# sha256 " + hashlib.sha256(text.encode()).hexdigest() + "\n")


def edited_registration(folder):
    sealed_registration(folder)
    path = folder / "patient_from_tracker.txt"
    path.write_text(path.read_text().replace("\n0 0 0 1", "\n0 0 0 1.0"))


def no_rotation(folder):
    ct(folder)
    (folder / "patient_from_tracker.txt").write_text("2 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")


def fisheye(folder):
    (folder / "camchain.yaml").write_text(
        "cam0:\n  camera_model: pinhole\n  intrinsics: [600.0, 600.0, 322.0, 237.0]\n  distortion_model: equidistant\n"
        "  distortion_coeffs: [0.1, 0.0, 0.0, 0.0]\n  resolution: [640, 480]\n")


def lens(folder):
    (folder / "camera.yaml").write_text(boards.lens_yaml())


def same_lens(folder, _):
    """Of a lens that went to Kalibr and back: the numbers of the first."""
    text = (folder / "back.yaml").read_text()
    wanted = (boards.LENS.fx, boards.LENS.cx, boards.LENS.cy, boards.LENS.k1)
    return "".join(f"the lens lacks {value:g}; " for value in wanted if f"{value:g}" not in text)


def recording_of_nothing(folder):
    registration(folder)
    lens(folder)
    (folder / "hand_eye.txt").write_text(motion.matrix_text(boards.CAMERA_FROM_SENSOR))
    (folder / "session").mkdir()


RENDER = "birdseye render --volume ct.nii.gz --size 320x240 --out ct.png"
SEEN = "birdseye render --volume ct.nii.gz --camera camera.yaml --pose pose.txt --transfer liver --out ct.png"
EXPORT = "birdseye export --registration patient_from_tracker.txt --volume ct.nii.gz --out out"
REPLAY = ("birdseye replay session --volume ct.nii.gz --registration patient_from_tracker.txt --camera camera.yaml "
          "--camera-from-sensor hand_eye.txt --out out")

ROWS = [
    Row("render", "good", "a CT, no camera", "a picture", RENDER, 0, ct, writes=["ct.png"]),
    Row("render", "good", "a lens and a pose, over a frame of its video", "a picture of the frame's size", SEEN + " --over frame.png", 0,
        ct_and_view, writes=["ct.png"]),
    Row("render", "good", "the frame straight, --display undistorted", "a picture", SEEN + " --over frame.png --display undistorted", 0, ct_and_view,
        writes=["ct.png"]),
    Row("render", "good", "a DICOM segmentation, --show liver", "the liver alone",
        "birdseye render --volume ct --labels liver.seg.dcm --show liver --transfer liver --size 320x240 --out ct.png", 0, with_seg,
        writes=["ct.png"]),
    Row("render", "wrong", "a DICOM segmentation of another patient, on the CT's grid", "refused: both patients",
        "birdseye render --volume ct --labels liver.seg.dcm --show liver --out ct.png", 2, with_seg_of_another,
        says=["liver.seg.dcm: is of patient B2, and the CT of patient A1"]),
    Row("render", "good", "labels without names, --show liver", "taken to be TotalSegmentator's, which is said",
        RENDER + " --labels labels.nii.gz --show liver", 0, labels, says=["TotalSegmentator"], writes=["ct.png"]),
    Row("render", "good", "a segmentation of 3D Slicer, --show segment_1", "that one, by Slicer's name",
        RENDER + " --labels labels.seg.nrrd --show segment_1", 0, slicer_labels(["Segment0_Name:=Segment_1", "Segment0_LabelValue:=5"]),
        says_not=["TotalSegmentator"], writes=["ct.png"]),
    Row("render", "odd", "one that calls 5 the spleen, --show liver", "refused: the names that it has",
        RENDER + " --labels labels.seg.nrrd --show liver", 2, slicer_labels(["Segment0_Name:=spleen", "Segment0_LabelValue:=5"]),
        says=["no label 'liver'; it has spleen"]),
    Row("render", "wrong", "one of Slicer before 4.11: names without values", "refused: save it again",
        RENDER + " --labels labels.seg.nrrd --show liver", 2, slicer_labels(["Segment0_Name:=liver"]),
        says=["SegmentN_LabelValue", "4.11"]),
    Row("render", "odd", "a label that the file has not", "refused: the file is named", RENDER + " --labels labels.nii.gz --show spleen", 2, labels,
        says=["labels.nii.gz"]),
    Row("render", "odd", "a picture to draw over of another size", "refused: both sizes", SEEN + " --over frame.png", 2, small_frame,
        says=["320 ?x ?240", "640 ?x ?480"]),
    Row("render", "wrong", "a pose that is a mirror", "refused: no rotation", SEEN, 2, mirrored_pose, says=["pose.txt", "rotation|mirror"]),
    Row("render", "wrong", "a preset of colours that there is not", "refused: those that there are", RENDER + " --transfer bones", 2, ct,
        says=["bones", "abdomen"]),
    Row("render", "wrong", "a file of colours that was cut short", "refused: it is named", RENDER + " --transfer colours.json", 2, transfer,
        says=["colours.json"]),
    Row("render", "wrong", "a deformation that folds", "refused: it folds", RENDER + " --deformation field.mha", 2, field_that_folds,
        says=["field.mha", "fold"]),
    Row("render", "wrong", "a CT in place of the deformation", "refused: a displacement field is due", RENDER + " --deformation ct.nii.gz", 2, ct,
        says=["displacement field"]),
    Row("render", "wrong", "--out as JPEG", "refused before the work: PNG", RENDER.replace("ct.png", "ct.jpg"), 2, ct, says=["png"]),
    Row("render", "wrong", "a view of no size", "refused", RENDER.replace("320x240", "0x240"), 2, ct, says=["0x240"]),
    Row("render", "wrong", "hostile deep.yaml as the lens", "refused at once",
        SEEN.replace("camera.yaml", "$DATA/hostile/deep.yaml"), 2, ct_and_view, data=["hostile/deep.yaml"], says=["deep.yaml"]),

    Row("replay", "wrong", "an empty folder in place of a recording", "refused: no session recording", REPLAY, 2, recording_of_nothing,
        says=["session"]),
    Row("replay", "wrong", "a CT in place of a recording", "refused: no session recording", REPLAY.replace("replay session", "replay ct.nii.gz"), 2,
        recording_of_nothing, says=["ct.nii.gz"]),
    Row("replay", "wrong", "no lens at all", "refused: what gives one", REPLAY.replace("--camera camera.yaml ", ""), 2, recording_of_nothing,
        says=["--camera|calibration|session"]),

    Row("export", "good", "a registration and its CT", "CT and transforms for Slicer, pass", EXPORT, 0, registration, "pass", writes=["out/*"]),
    Row("export", "wrong", "a registration of another CT", "refused: of another CT", EXPORT, 2, sealed_registration,
        says=["patient_from_tracker.txt: is of another CT"]),
    Row("export", "wrong", "a registration that was edited since", "refused: it was changed", EXPORT, 2, edited_registration,
        says=["patient_from_tracker.txt: was changed"]),
    Row("export", "wrong", "a matrix that is no rotation", "refused: it is named", EXPORT, 2, no_rotation,
        says=["patient_from_tracker.txt", "rotation"]),
    Row("export", "wrong", "nothing to export", "refused: what to give", "birdseye export --out out", 2, says=["--registration|--volume"]),
    Row("export lens", "good", "OpenCV to Kalibr and back", "the same lens",
        "birdseye export lens --camera camera.yaml --as kalibr --out camchain.yaml && birdseye export lens --camera camchain.yaml --as opencv --out back.yaml",
        0, lens, writes=["camchain.yaml", "back.yaml"], check=same_lens),
    Row("export lens", "good", "OpenCV to ROS and back", "the same lens",
        "birdseye export lens --camera camera.yaml --as ros --out info.yaml && birdseye export lens --camera info.yaml --as opencv --out back.yaml",
        0, lens, writes=["info.yaml", "back.yaml"], check=same_lens),
    Row("export lens", "wrong", "a fisheye of Kalibr", "refused: equidistant", "birdseye export lens --camera camchain.yaml --as ros --out info.yaml", 2,
        fisheye, says=["equidistant"]),
    Row("export lens", "wrong", "a record without a lens", "refused", "birdseye export lens --record none.json --as ros --out info.yaml", 2,
        says=["none.json"]),

    Row("bench", "good", "the measures of likeness", "a table", "birdseye bench similarity --rounds 1 --json t.json", 0, writes=["t.json"], slow=True),
    Row("bench", "wrong", "an engine that there is not", "refused: those that there are", "birdseye bench render --engine quantum", 2,
        says=["quantum", "cpu"]),
]
