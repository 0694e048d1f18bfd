"""A small CT of a body with a liver and markers, in the formats that volumes come in."""
import array
import functools
import gzip
import struct
from pathlib import Path

import dicom

COLUMNS, ROWS, SLICES = 60, 50, 40
SPACING_MM = 2.0
ORIGIN_MM = (-60.0, -50.0, 100.0)  # patient LPS of the first voxel's centre
MARKERS_MM = ((-40.0, -43.0, 120.0), (35.0, -43.0, 125.0), (-38.5, -43.5, 160.0), (36.0, -42.5, 165.0), (2.0, -44.0, 142.0))
MARKER_DIAMETER_MM = 8.0


def place(i, j, k):
    return tuple(o + SPACING_MM * n for o, n in zip(ORIGIN_MM, (i, j, k)))


def _share(place_mm):
    """How much of a voxel a marker fills."""
    filled = 0.0
    for marker in MARKERS_MM:
        if max(abs(a - b) for a, b in zip(place_mm, marker)) < 6.5:
            inside = sum(sum((place_mm[axis] + step[axis] - marker[axis]) ** 2 for axis in range(3)) < (MARKER_DIAMETER_MM / 2) ** 2
                         for step in _STEPS)
            filled = max(filled, inside / len(_STEPS))
    return filled


_PARTS = (-0.75, -0.25, 0.25, 0.75)
_STEPS = [(x, y, z) for x in _PARTS for y in _PARTS for z in _PARTS]


@functools.cache
def hounsfield():
    """HU, x fastest, as an array of 16-bit integers."""
    values = array.array("h")
    for k in range(SLICES):
        for j in range(ROWS):
            for i in range(COLUMNS):
                x, y, z = place(i, j, k)
                body = ((x / 50) ** 2 + ((y - 5) / 38) ** 2) < 1
                liver = ((x + 15) / 25) ** 2 + ((y - 5) / 20) ** 2 + ((z - 140) / 28) ** 2 < 1
                hu = -1000 if not body else 160 if liver else 40
                share = _share((x, y, z))
                values.append(int(hu + share * (1200 - hu)))
    return values


@functools.cache
def labels():
    """5 where the liver is, else 0."""
    return array.array("h", [5 if hu == 160 else 0 for hu in hounsfield()])


def slice_bytes(k):
    """The stored values of a slice, HU + 1024."""
    stored = array.array("H", [hu + 1024 for hu in hounsfield()[k * COLUMNS * ROWS:(k + 1) * COLUMNS * ROWS]])
    return stored.tobytes()


def write_series(folder, which=range(SLICES), series=1, description="abdomen", place_of=None, **more):
    """A DICOM series, a file a slice; place_of(k) says where slice k lies, if not where it is."""
    for number, k in enumerate(which):
        dicom.write(Path(folder) / f"s{series}_{number:03d}.dcm",
                    dicom.ct_slice(slice_bytes(k), COLUMNS, ROWS, (place_of or (lambda k: place(0, 0, k)))(k), series=series,
                                   instance=number + 1, description=description, **more))


def write_nifti(path, values=None, form=(1, 1), kind=4, extra=b"", scale=1.0, shift_mm=(0.0, 0.0, 0.0)):
    """NIfTI-1 of the CT; form are the codes of qform and sform, kind 4 is int16, 16 float, 128 colours."""
    values = hounsfield() if values is None else values
    content = values.tobytes()
    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, 3, COLUMNS, ROWS, SLICES, 1, 1, 1, 1)
    struct.pack_into("<hh", head, 70, kind, {4: 16, 16: 32, 128: 24}[kind])
    struct.pack_into("<8f", head, 76, 1.0, SPACING_MM * scale, SPACING_MM * scale, SPACING_MM * scale, 0, 0, 0, 0)
    struct.pack_into("<fff", head, 108, 352.0 + len(extra), 1.0, 0.0)
    struct.pack_into("<b", head, 123, 2)
    struct.pack_into("<hh", head, 252, *form)
    # RAS: the first two axes are those of LPS turned round.
    x, y, z = (o + moved for o, moved in zip(ORIGIN_MM, shift_mm))
    s = SPACING_MM * scale
    struct.pack_into("<6f", head, 256, 0.0, 0.0, 1.0, -x, -y, z)  # turned by half a turn about z
    struct.pack_into("<12f", head, 280, -s, 0, 0, -x, 0, -s, 0, -y, 0, 0, s, z)
    head[344:348] = b"n+1\0"
    if extra:
        head[348] = 1
    everything = bytes(head) + extra + content
    Path(path).write_bytes(gzip.compress(everything, 1) if str(path).endswith(".gz") else everything)


def write_nrrd(path, space="left-posterior-superior", lines="", values=None, encoding="raw"):
    x, y, z = ORIGIN_MM
    head = ("NRRD0004\ntype: short\ndimension: 3\n" + (f"space: {space}\n" if space else "") +
            f"sizes: {COLUMNS} {ROWS} {SLICES}\n" +
            (f"space directions: (2,0,0) (0,2,0) (0,0,2)\nspace origin: ({x},{y},{z})\n" if space else "spacings: 2 2 2\n") +
            f"kinds: domain domain domain\nendian: little\nencoding: {encoding}\n{lines}\n")
    Path(path).write_bytes(head.encode() + (hounsfield() if values is None else values).tobytes())


def write_mha(path, values=None, cut=0, direction="1 0 0 0 1 0 0 0 1", place="Offset", lines=""):
    """MetaImage of the CT; place is the name under which its first voxel stands, if any, lines are further ones of its header."""
    offset = f"{place} = {ORIGIN_MM[0]} {ORIGIN_MM[1]} {ORIGIN_MM[2]}\n" if place else ""
    head = (f"ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
            f"TransformMatrix = {direction}\n{offset}ElementSpacing = 2 2 2\n{lines}"
            f"DimSize = {COLUMNS} {ROWS} {SLICES}\nElementType = MET_SHORT\nElementDataFile = LOCAL\n")
    content = (hounsfield() if values is None else values).tobytes()
    Path(path).write_bytes(head.encode() + content[:len(content) - cut])
