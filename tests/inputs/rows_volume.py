"""birdseye volume."""
import json
import math
import shutil
import struct
import subprocess

import dicom
import volumes
from judge import Row

INFO = "birdseye volume info ct --json info.json"
ONE = ("info.json",)


def info_of(path):
    return INFO.replace(" ct ", f" {path} ")


def is_the_ct(folder, _):
    """The figures of the CT that was made: its size, spacing, origin and the air about it."""
    told = json.loads((folder / "info.json").read_text())
    text = json.dumps(told)
    for wanted in ("60", "50", "40"):
        if wanted not in text:
            return f"the size lacks {wanted}: {text[:200]}"
    return ""


def series(folder):
    volumes.write_series(folder / "ct")


def through(tool, *options):
    """A series of which each file went through a tool of DCMTK."""
    def make(folder):
        series(folder)
        for path in sorted((folder / "ct").iterdir()):
            subprocess.run([tool, *options, path, path.with_suffix(".tmp")], check=True, capture_output=True)
            path.with_suffix(".tmp").replace(path)
    return make


def two_phases(folder):
    volumes.write_series(folder / "ct" / "a", series=3, description="Leber arteriell")
    volumes.write_series(folder / "ct" / "b", series=4, description="Leber portalvenoes")


def export_cd(folder):
    """A CD: a series, a localizer, a report, a directory file of another name, a viewer."""
    series(folder)
    dicom.write(folder / "ct" / "SR" / "R1", {**dicom.an_object(dicom.REPORT, "SR", 20, 1)})
    localizer = dicom.ct_slice(volumes.slice_bytes(0), volumes.COLUMNS, volumes.ROWS, (0, 0, 0), series=2, description="Topogram",
                               across=(1, 0, 0), down=(0, 0, -1))
    localizer[0x00080008] = ("CS", "ORIGINAL\\PRIMARY\\LOCALIZER")
    dicom.write(folder / "ct" / "L1", localizer)
    subprocess.run(["dcmmkdir", "--general-purpose", "--output-file", "INDEX", "--recurse", "--pattern", "zz*"], cwd=folder / "ct",
                   capture_output=True)
    (folder / "ct" / "autorun.inf").write_text("[autorun]\nopen=viewer.exe\n")
    (folder / "ct" / "viewer.exe").write_bytes(b"MZ" + b"\0" * 500)


def no_suffixes(folder):
    series(folder)
    for number, path in enumerate(sorted((folder / "ct").iterdir(), reverse=True)):
        path.rename(path.with_name(f"IM{number:06d}"))


def missing_slice(folder):
    volumes.write_series(folder / "ct", [k for k in range(volumes.SLICES) if k != 17])


def doubled_slice(folder):
    series(folder)
    dicom.write(folder / "ct" / "again.dcm", dicom.ct_slice(volumes.slice_bytes(8), volumes.COLUMNS, volumes.ROWS,
                                                            volumes.place(0, 0, 9), instance=10))


def copied_file(folder):
    """The same file twice, as a download that was interrupted leaves it."""
    series(folder)
    shutil.copy(folder / "ct" / "s1_005.dcm", folder / "ct" / "s1_005 (1).dcm")


def plan_beside(folder):
    series(folder)
    dicom.write(folder / "ct" / "plan.dcm", dicom.ct_slice(volumes.slice_bytes(9), volumes.COLUMNS, volumes.ROWS, volumes.place(0, 0, 9),
                                                           series=9, description="plan"))


def jpeg_cut(option, tool="dcmcjpeg"):
    """A compressed series whose twelfth slice lacks the second half of its stream; its file is whole."""
    def make(folder):
        through(tool, option)(folder)
        dicom.halve_stream(folder / "ct" / "s1_011.dcm")
    return make


def mixed_spacing(folder):
    """Slices of 2 mm, then of 4 mm."""
    volumes.write_series(folder / "ct", place_of=lambda k: (*volumes.ORIGIN_MM[:2], 100.0 + (2 * k if k < 20 else 40 + 4 * (k - 20))))


def tilted(folder):
    c, s = math.cos(math.radians(15)), math.sin(math.radians(15))
    volumes.write_series(folder / "ct", down=(0, c, -s), place_of=lambda k: (*volumes.ORIGIN_MM[:2], 100.0 + 2.0 * k / c))


def cut_slice(folder):
    series(folder)
    path = folder / "ct" / "s1_011.dcm"
    path.write_bytes(path.read_bytes()[:3000])


def magnetic_resonance(folder):
    volumes.write_series(folder / "ct", range(12), sop_class=dicom.MR, modality="MR")


def enhanced(folder):
    dicom.write(folder / "ct" / "all.dcm", dicom.enhanced_ct([volumes.slice_bytes(k) for k in range(volumes.SLICES)], volumes.COLUMNS,
                                                             volumes.ROWS, [volumes.place(0, 0, k) for k in range(volumes.SLICES)]))


def seg_masks():
    size = volumes.COLUMNS * volumes.ROWS
    values = volumes.labels()
    return [[1 if v else 0 for v in values[k * size:(k + 1) * size]] for k in range(volumes.SLICES)]


def with_seg(folder):
    series(folder)
    dicom.write(folder / "liver.seg.dcm", dicom.segmentation(seg_masks(), volumes.COLUMNS, volumes.ROWS,
                                                             [volumes.place(0, 0, k) for k in range(volumes.SLICES)]))


def with_seg_of_another(folder):
    """A CT of patient A1, and a segmentation of patient B2 on the same grid."""
    size = volumes.COLUMNS, volumes.ROWS
    places = [volumes.place(0, 0, k) for k in range(volumes.SLICES)]
    for k, place in enumerate(places):
        dicom.write(folder / "ct" / f"{k:03d}.dcm", {**dicom.ct_slice(volumes.slice_bytes(k), *size, place, instance=k + 1),
                                                     0x00100020: ("LO", "A1")})
    dicom.write(folder / "liver.seg.dcm", {**dicom.segmentation(seg_masks(), *size, places), 0x00100020: ("LO", "B2")})


def nifti(name="ct.nii.gz", **more):
    return lambda folder: volumes.write_nifti(folder / name, **more)


def nifti_of_floats_with_nan(folder):
    values = volumes.array.array("f", [float(v) for v in volumes.hounsfield()])
    values[777] = math.nan
    volumes.write_nifti(folder / "ct.nii", values, kind=16)


def mha(**more):
    return lambda folder: volumes.write_mha(folder / "ct.mha", **more)


def pair(folder):
    volumes.write_nifti(folder / "whole.nii")
    whole = (folder / "whole.nii").read_bytes()
    (folder / "ct.hdr").write_bytes(whole[:108] + struct.pack("<f", 0.0) + whole[112:344] + b"ni1\0")
    (folder / "ct.img").write_bytes(whole[352:])


def detached(voxels=True):
    def make(folder):
        volumes.write_nrrd(folder / "whole.nrrd")
        head, content = (folder / "whole.nrrd").read_bytes().split(b"\n\n", 1)
        (folder / "ct.nhdr").write_bytes(head + b"\ndata file: ct.raw\n\n")
        if voxels:
            (folder / "ct.raw").write_bytes(content.lstrip(b"\n"))
    return make


def own_scale(elements, k):
    stored = volumes.array.array("H", elements[0x7fe00010][1])
    elements[0x7fe00010] = ("OW", volumes.array.array("H", [value + k for value in stored]).tobytes())
    elements[0x00281052] = ("DS", f"{-1024 - k}")


def slices_with(change):
    """A series of which change(elements, k) changes the elements of slice k."""
    def make(folder):
        for k in range(volumes.SLICES):
            elements = dicom.ct_slice(volumes.slice_bytes(k), volumes.COLUMNS, volumes.ROWS, volumes.place(0, 0, k), instance=k + 1)
            change(elements, k)
            dicom.write(folder / "ct" / f"s1_{k:03d}.dcm", elements)
    return make


def without_scale(elements, _):
    del elements[0x00281052], elements[0x00281053]


def without_scale_of_one(elements, k):
    if k == 11:
        without_scale(elements, k)


def two_frames(elements, k):
    elements[0x00200052] = ("UI", "2.25.77" if k < 20 else "2.25.78")


def said_apart(elements, _):
    elements[0x00180088] = ("DS", "5")


def deep_folder(folder):
    volumes.write_series(folder / "ct" / "PAT0" / "STU0" / "SER0")
    (folder / "ct" / "PAT0" / "again").symlink_to(folder / "ct")


def markers_close(folder, _):
    found = [[float(v) for v in line.split()] for line in (folder / "markers.txt").read_text().splitlines()
             if line.strip() and not line.startswith("#")]
    if len(found) != len(volumes.MARKERS_MM):
        return f"{len(found)} markers, not {len(volumes.MARKERS_MM)}"
    worst = max(min(math.dist(marker, place) for place in found) for marker in volumes.MARKERS_MM)
    return f"a marker is off by {worst:.2f} mm" if worst > 0.4 else ""


def sphere_stl(folder, radius=20.0, centre=(0.0, 0.0, 90.0), nan=False):
    """A ball as binary STL."""
    triangles = []
    steps = 16

    def point(a, b):
        return tuple(c + radius * v for c, v in zip(centre, (math.sin(a) * math.cos(b), math.sin(a) * math.sin(b), math.cos(a))))

    for i in range(steps):
        for j in range(2 * steps):
            a0, a1, b0, b1 = (math.pi * i / steps, math.pi * (i + 1) / steps, math.pi * j / steps, math.pi * (j + 1) / steps)
            triangles += [(point(a0, b0), point(a1, b0), point(a1, b1)), (point(a0, b0), point(a1, b1), point(a0, b1))]
    if nan:
        triangles[3] = ((math.nan, 0, 0), *triangles[3][1:])
    (folder / "skin.stl").write_bytes(b"made here".ljust(80) + struct.pack("<I", len(triangles)) + b"".join(
        struct.pack("<12fH", 0, 0, 0, *(v for p in t for v in p), 0) for t in triangles))


MARKERS = "birdseye volume markers ct --shape ball --diameter 8 --out markers.txt --picture markers.png"
SURFACE = "birdseye volume from-surface skin.stl --out slab.nii.gz"

ROWS = [
    Row("volume info", "good", "a folder of 40 DICOM slices", "size, spacing, HU", INFO, 0, series, says=["60", "LPS"], writes=ONE,
        check=is_the_ct),
    Row("volume info", "good", "compressed by RLE", "as the uncompressed one", INFO, 0, through("dcmcrle"), writes=ONE, check=is_the_ct),
    Row("volume info", "good", "deflated", "as the uncompressed one", INFO, 0, through("dcmconv", "+td"), writes=ONE, check=is_the_ct),
    Row("volume info", "good", "compressed by JPEG, lossless", "as the uncompressed one", INFO, 0, through("dcmcjpeg", "+e1"), writes=ONE,
        check=is_the_ct),
    Row("volume info", "good", "an enhanced CT, one file of 40 frames", "as the series", INFO, 0, enhanced, writes=ONE, check=is_the_ct),
    Row("volume info", "good", "NIfTI, compressed", "as the series, in LPS", info_of("ct.nii.gz"), 0, nifti(), says=["RAS|LPS|LPI"], writes=ONE,
        check=is_the_ct),
    Row("volume info", "good", "NRRD", "as the series", info_of("ct.nrrd"), 0, lambda folder: volumes.write_nrrd(folder / "ct.nrrd"),
        writes=ONE, check=is_the_ct),
    Row("volume info", "good", "MetaImage", "as the series", info_of("ct.mha"), 0, lambda folder: volumes.write_mha(folder / "ct.mha"),
        writes=ONE, check=is_the_ct),
    Row("volume info", "good", "MetaImage that names its place Origin", "as the series, without a note", info_of("ct.mha"), 0, mha(place="Origin"),
        says=["first voxel  \\(-60.000, -50.000, 100.000\\)"], says_not=["^note"], writes=ONE, check=is_the_ct),
    Row("volume info", "good", "MetaImage with an Offset and the same Position", "as the series", info_of("ct.mha"), 0,
        mha(lines="Position = -60 -50 100\n"), says_not=["^note"], writes=ONE, check=is_the_ct),
    Row("volume info", "good", "a NIfTI file of aligned coordinates (code 2), as nibabel writes it", "as the series", info_of("ct.nii"), 0,
        nifti("ct.nii", form=(0, 2)), writes=ONE, check=is_the_ct),
    Row("volume info", "good", "a pair of NIfTI files, header and voxels", "as the series", info_of("ct.hdr"), 0, pair, writes=ONE, check=is_the_ct),
    Row("volume info", "good", "a NRRD header beside its voxels", "as the series", info_of("ct.nhdr"), 0, detached(), writes=ONE, check=is_the_ct),
    Row("volume info", "good", "DICOM whose slices each have their own Rescale Intercept", "as the series: each slice by its own", INFO, 0,
        slices_with(own_scale), says=["HU           -1000 to 1200, mean -475.8"], writes=ONE, check=is_the_ct),
    Row("volume info", "good", "two phases in a folder, one chosen by --series portal", "that one", INFO + " --series portal", 0, two_phases,
        says=["Leber portalvenoes"], writes=ONE),
    Row("volume info", "good", "two phases in a folder, none chosen", "both are listed, and how to choose", INFO, 0, two_phases,
        says=["arteriell", "portalvenoes", "--series"], writes=ONE),
    Row("volume info", "odd", "a CD: series, localizer, report, viewer, autorun", "the CT is read; the rest is passed over or told", INFO, 0,
        export_cd, says=["Topogram"], writes=ONE, check=is_the_ct),
    Row("volume info", "good", "files without a suffix, named in the wrong order", "ordered by where they lie", INFO, 0, no_suffixes,
        writes=ONE, check=is_the_ct),
    Row("volume info", "odd", "folders in folders, and a link that goes round", "read once; nothing hangs", INFO, 0, deep_folder, writes=ONE,
        check=is_the_ct),
    Row("volume info", "good", "big-endian pixels", "as the series", INFO, 0, through("dcmconv", "+tb"), writes=ONE, check=is_the_ct),
    Row("volume info", "odd", "one file twice, under another name", "read once, and said", INFO, 0, copied_file,
        says=["passed over 1 copy of slices: s1_005"], writes=ONE, check=is_the_ct),
    Row("volume info", "odd", "a single slice beside a series", "the series; the slice is passed over, and said", INFO, 0, plan_beside,
        says=["passed over series 9 'plan': one slice"], writes=ONE, check=is_the_ct),
    Row("volume info", "odd", "lossless JPEG, one slice cut in the middle of its pixels", "refused: the file is named", INFO, 2,
        jpeg_cut("+e1"), says=["s1_011.dcm", "again"]),
    Row("volume info", "odd", "lossy JPEG, one slice cut in the middle of its pixels", "refused: the file is named", INFO, 2,
        jpeg_cut("+ee"), says=["s1_011.dcm", "again"]),
    Row("volume info", "odd", "JPEG-LS, one slice cut in the middle of its pixels", "refused: the file is named", INFO, 2,
        jpeg_cut("+el", tool="dcmcjpls"), says=["s1_011.dcm", "again"]),
    Row("volume info", "odd", "a file of labels without names", "its labels, no Hounsfield units", info_of("labels.mha"), 0,
        lambda folder: volumes.write_mha(folder / "labels.mha", volumes.labels()), says=["labels       5 \\(no Hounsfield"],
        says_not=["^HU"], writes=ONE),
    Row("volume info", "good", "tilted gantry, --untilt", "resampled, and how much that blurs", INFO + " --untilt", 0, tilted, says=["blur"],
        writes=ONE),
    Row("volume info", "odd", "tilted gantry", "refused: --untilt is named", INFO, 2, tilted, says=["tilt", "--untilt"]),
    Row("volume info", "odd", "a slice is missing", "refused: where it is missing; export the whole series", INFO, 2, missing_slice,
        says=["134|132|missing", "export"]),
    Row("volume info", "odd", "two different slices at one place", "refused: doubled; which file", INFO, 2, doubled_slice,
        says=["same place|doubled", "again.dcm|s1_009"]),
    Row("volume info", "odd", "slices of 2 mm, then of 4 mm", "refused: unevenly spaced", INFO, 2, mixed_spacing, says=["spac|apart|distance"]),
    Row("volume info", "odd", "a slice that was cut short", "refused: the file is named; copy it again", INFO, 2, cut_slice,
        says=["s1_011.dcm", "again"]),
    Row("volume info", "wrong", "MR slices", "refused: no CT", INFO, 2, magnetic_resonance, says=["MR", "CT"]),
    Row("volume info", "odd", "a MetaImage that is cut short", "refused: it ends before its voxels do", info_of("ct.mha"), 2,
        lambda folder: volumes.write_mha(folder / "ct.mha", cut=5000), says=["ct.mha", "ends|cut|short"]),
    Row("volume info", "wrong", "a NIfTI file without a frame of coordinates", "refused: what to do", info_of("ct.nii"), 2,
        nifti("ct.nii", form=(0, 0)), says=["ct.nii"]),
    Row("volume info", "odd", "the same, --orientation RAS", "read; the note says that a person stated it",
        info_of("ct.nii") + " --orientation RAS", 0, nifti("ct.nii", form=(0, 0)), says=["RAS, was stated by a person"], writes=ONE),
    Row("volume info", "odd", "the same, --orientation LPS, which is what its unset sform holds", "read; the unset sform counts for nothing",
        info_of("ct.nii") + " --orientation LPS", 0, nifti("ct.nii", form=(0, 0)), says=["LPS, was stated by a person", "does not say it, nor",
                                                                                        "first voxel  \\(0.000, 0.000, 0.000\\)"], writes=ONE),
    Row("volume info", "wrong", "a NIfTI file in the space of the MNI152 atlas", "refused: no patient's; the CT as it was scanned",
        info_of("ct.nii"), 2, nifti("ct.nii", form=(0, 4)), says=["MNI152", "as it was scanned", "-setsformcode 1"]),
    Row("volume info", "wrong", "a NIfTI file whose sform has a code that there is not", "refused: the code", info_of("ct.nii"), 2,
        nifti("ct.nii", form=(1, 9)), says=["sform code 9", "-setsformcode 1"]),
    Row("volume info", "odd", "a MetaImage that does not say where its first voxel lies", "read; what that means for points", info_of("ct.mha"), 0,
        mha(place=""), says=["note .*no Offset", "points of other programs"], writes=ONE),
    Row("volume info", "wrong", "a MetaImage with an Offset and another Position", "refused: both", info_of("ct.mha"), 2,
        mha(lines="Position = 0 0 0\n"), says=["Offset -60.0 -50.0 100.0, Position 0 0 0"]),
    Row("volume info", "wrong", "a MetaImage with a TransformMatrix and another Orientation", "refused: both", info_of("ct.mha"), 2,
        mha(lines="Orientation = -1 0 0 0 -1 0 0 0 1\n"), says=["TransformMatrix 1 0 0", "Orientation -1 0 0"]),
    Row("volume info", "wrong", "a NRRD header whose file of voxels is not there", "refused: that file", info_of("ct.nhdr"), 2,
        detached(voxels=False), says=["\"ct.raw\" is not there"], says_not=["damaged"]),
    Row("volume info", "odd", "a NRRD in an encoding that is not read", "refused: the encoding", info_of("ct.nrrd"), 2,
        lambda folder: volumes.write_nrrd(folder / "ct.nrrd", encoding="bzip2"), says=["\"bzip2\", which is not read"], says_not=["damaged"]),
    Row("volume info", "wrong", "a NIfTI file of colours", "refused: the datatype", info_of("ct.nii"), 2, nifti("ct.nii", kind=128),
        says=["colours \\(datatype 128\\)"], says_not=["damaged"]),
    Row("volume info", "odd", "DICOM whose Spacing Between Slices is not that of the positions", "read by the positions; both are said", INFO, 0,
        slices_with(said_apart), says=["5 mm by Spacing Between Slices", "2 mm by their positions"], writes=ONE, check=is_the_ct),
    Row("volume info", "wrong", "DICOM slices of two frames of reference", "refused: both are named", INFO, 2, slices_with(two_frames),
        says=["2 frames of reference", "2.25.77", "2.25.78"]),
    Row("volume info", "odd", "DICOM without Rescale Intercept and Slope", "read; the values may be no Hounsfield units", INFO, 0,
        slices_with(without_scale), says=["lack Rescale Intercept"], writes=ONE),
    Row("volume info", "wrong", "DICOM of which one slice has no Rescale Intercept", "refused: the file", INFO, 2,
        slices_with(without_scale_of_one), says=["s1_011.dcm", "Rescale Intercept"]),
    Row("volume info", "odd", "a CT of one value throughout", "read; there is nothing in it", info_of("ct.mha"), 0,
        mha(values=volumes.array.array("h", [40] * (volumes.COLUMNS * volumes.ROWS * volumes.SLICES))), says=["all voxels are 40"], writes=ONE),
    Row("volume info", "wrong", "--orientation for a file that says its own", "refused: leave it out", info_of("ct.nii.gz") + " --orientation LPS", 2,
        nifti(), says=["leave --orientation"]),
    Row("volume info", "wrong", "a voxel that is not a number", "refused", info_of("ct.nii"), 2, nifti_of_floats_with_nan,
        says=["ct.nii", "finite|number"]),
    Row("volume info", "wrong", "an empty folder", "refused: the folder is named", INFO, 2, lambda folder: (folder / "ct").mkdir(), says=["ct"]),
    Row("volume info", "wrong", "a text file", "refused: what is read", info_of("notes.txt"), 2,
        lambda folder: (folder / "notes.txt").write_text("hello\n"), says=["notes.txt"]),
    Row("volume info", "odd", "--series that there is not", "refused: those that there are", INFO + " --series nephro", 2, two_phases,
        says=["nephro", "arteriell"]),
    Row("volume info", "wrong", "a CT in metres: voxels of 0.002 mm", "refused: metres", info_of("ct.nii"), 2,
        nifti("ct.nii", scale=0.001), says=["metres"]),
    *[Row("volume info", "wrong", f"hostile {name}", expected, info_of(f"$DATA/hostile/{name}"), 2, data=[f"hostile/{name}"], says=says)
      for name, expected, says in (
          ("nocode.nii", "refused, with the remedy", ["qform nor its sform", "--orientation"]),
          ("conflict.nii", "refused, with the remedy", ["RAS and LAS", "--orientation"]),
          ("nospace.nrrd", "refused, with the remedy", ['no "space"', "--orientation"]),
          ("nospc.mha", "refused, with the remedy", ["nospc.mha", "--"]),
          ("hang.nii", "refused at once", ["hang.nii"]), ("hang.mha", "refused at once", ["hang.mha"]),
          ("rss4g.dcm", "refused, with little memory", ["rss4g.dcm"]))],
    Row("volume info", "good", "20 real slices in JPEG 2000, with empty UIDs", "512 x 512 x 20, spacing 0.977, 0.977, 2 mm",
        info_of("$DATA/ct_abdomen/example_ct_dicom"), 0, data=["ct_abdomen/example_ct_dicom"], says=["512", "0.977"], writes=ONE),
    Row("volume info", "wrong", "12 real slices, tilted and unevenly spaced", "refused", info_of("$DATA/ct_gantry_tilt"), 2,
        data=["ct_gantry_tilt"], says=["tilt"]),
    Row("volume info", "good", "the same with --untilt", "resampled, and told what it costs", info_of("$DATA/ct_gantry_tilt") + " --untilt", 0,
        data=["ct_gantry_tilt"], says=["blur"], writes=ONE),
    Row("volume info", "good", "a real file of segment labels", "its labels are listed", info_of("$DATA/ct_abdomen/example_seg.nii.gz"), 0,
        data=["ct_abdomen/example_seg.nii.gz"], says=["liver"], writes=ONE),
    Row("volume info", "odd", "a real slice whose JPEG 2000 contradicts its header", "read, or refused for being tilted",
        info_of("$DATA/ct_dicom_oddities/J2K_pixelrep_mismatch.dcm"), 0, data=["ct_dicom_oddities"], writes=ONE),

    Row("volume markers", "good", "five balls of 8 mm in a CT", "pass; each to 0.4 mm", MARKERS, 0, series, "pass",
        writes=["markers.txt", "markers.png"], check=markers_close),
    Row("volume markers", "odd", "the diameter was given too large by half", "not a pass: none, or told that the size does not fit",
        MARKERS.replace("--diameter 8", "--diameter 12"), 3, series, "fail", says=["no ball of 12 mm is seen, and 5 of 8"], writes=["markers.*"]),
    Row("volume markers", "odd", "--near, off by 6 mm in RAS coordinates", "fail: nothing there within 10 mm",
        "birdseye volume markers ct --near 40,43,120 --out markers.txt", 3, series, "fail", says=["10 mm"], writes=["markers.txt"]),
    Row("volume markers", "good", "--near, 3 mm off three of the balls", "pass; the three centres",
        "birdseye volume markers ct --near -42,-45,119 --near 36,-43,122 --near 2,-46,144 --out markers.txt", 0, series, "pass",
        writes=["markers.txt"]),
    Row("volume markers", "wrong", "a ball without its diameter", "refused: --diameter is named",
        "birdseye volume markers ct --shape ball --out markers.txt", 2, series, says=["--diameter"]),
    Row("volume markers", "wrong", "a picture's suffix that is none", "refused before the work",
        MARKERS.replace("markers.png", "markers.xyz"), 2, series, says=["markers.xyz"]),

    Row("volume segment", "good", "voxels of 100 to 250 HU about a seed in the liver", "labels of the liver",
        "birdseye volume segment ct --hu 100,250 --seed -15,5,140 --out labels.nii.gz", 0, series, writes=["labels.nii.gz"]),
    Row("volume segment", "wrong", "a seed outside of the CT", "refused: the seed and the CT's box",
        "birdseye volume segment ct --hu 100,250 --seed 900,5,140 --out labels.nii.gz", 2, series, says=["900|seed"]),
    Row("volume segment", "wrong", "a range of HU the wrong way round", "refused",
        "birdseye volume segment ct --hu 250,100 --out labels.nii.gz", 2, series, says=["250"]),

    Row("volume from-surface", "good", "a ball as STL", "a slab of tissue, a NIfTI file", SURFACE, 0, sphere_stl, writes=["slab.nii.gz"]),
    Row("volume from-surface", "wrong", "a vertex that is not a number", "refused: the file is named", SURFACE, 2,
        lambda folder: sphere_stl(folder, nan=True), says=["skin.stl"]),
    Row("volume from-surface", "wrong", "a surface in metres", "refused: metres", SURFACE, 2,
        lambda folder: sphere_stl(folder, radius=0.02, centre=(0, 0, 0.09)), says=["metres"]),
    Row("volume from-surface", "wrong", "hostile cut.ply", "refused at once", SURFACE.replace("skin.stl", "$DATA/hostile/cut.ply"), 2,
        data=["hostile/cut.ply"], says=["cut.ply"]),
    Row("volume from-surface", "wrong", "a folder in place of a surface", "refused: it is named", SURFACE.replace("skin.stl", "ct"), 2, series,
        says=["ct"]),
]
