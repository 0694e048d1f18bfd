"""Writes DICOM objects, explicit VR little endian, in plain Python."""
import struct
from pathlib import Path

CT = "1.2.840.10008.5.1.4.1.1.2"
ENHANCED_CT = "1.2.840.10008.5.1.4.1.1.2.1"
MR = "1.2.840.10008.5.1.4.1.1.4"
SEGMENTATION = "1.2.840.10008.5.1.4.1.1.66.4"
REPORT = "1.2.840.10008.5.1.4.1.1.88.11"
EXPLICIT_LITTLE = "1.2.840.10008.1.2.1"
LONG = ("OB", "OW", "OF", "SQ", "UN", "UT")  # of which the length has four bytes


def element(tag, vr, value):
    """An element's bytes: text, whole numbers, bytes, or for SQ items, each a dictionary of elements."""
    if vr == "SQ":
        items = [elements(item) for item in value]
        content = b"".join(b"\xfe\xff\x00\xe0" + struct.pack("<I", len(item)) + item for item in items)
    elif isinstance(value, bytes):
        content = value
    elif vr == "US":
        content = struct.pack("<H", value)
    elif vr == "UL":
        content = struct.pack("<I", value)
    elif vr == "AT":
        content = struct.pack("<HH", value >> 16, value & 0xffff)
    else:
        content = str(value).encode("utf-8")
    if len(content) % 2:
        content += b"\0" if vr in ("UI", "OB") else b" "
    head = struct.pack("<HH", tag >> 16, tag & 0xffff) + vr.encode()
    return head + (b"\0\0" + struct.pack("<I", len(content)) if vr in LONG else struct.pack("<H", len(content))) + content


def elements(dataset):
    """A dictionary of tag to (VR, value), in the order of the tags."""
    return b"".join(element(tag, *dataset[tag]) for tag in sorted(dataset))


def write(path, dataset):
    meta = {0x00020001: ("OB", b"\0\1"), 0x00020002: ("UI", dataset[0x00080016][1]), 0x00020003: ("UI", dataset[0x00080018][1]),
            0x00020010: ("UI", EXPLICIT_LITTLE), 0x00020012: ("UI", "2.25.4711")}
    text = elements(meta)
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"\0" * 128 + b"DICM" + element(0x00020000, "UL", len(text)) + text + elements(dataset))


def halve_stream(path):
    """Takes the second half of a compressed slice's stream away, with lengths that say so: a whole file of half a picture."""
    data = path.read_bytes()
    at = data.rindex(b"\xe0\x7f\x10\x00OB\0\0\xff\xff\xff\xff") + 12
    at += 8 + struct.unpack_from("<I", data, at + 4)[0]  # past the table of offsets
    half = struct.unpack_from("<I", data, at + 4)[0] // 4 * 2
    path.write_bytes(data[:at + 4] + struct.pack("<I", half) + data[at + 8:at + 8 + half] + b"\xfe\xff\xdd\xe0" + b"\0" * 4)


def numbers(values):
    return "\\".join(f"{v:.6g}" for v in values)


def an_object(sop_class, modality, series, instance):
    return {0x00080016: ("UI", sop_class), 0x00080018: ("UI", f"2.25.{series}{instance:04d}"), 0x00080021: ("DA", "20210503"),
            0x00080060: ("CS", modality), 0x0020000d: ("UI", "2.25.99"), 0x0020000e: ("UI", f"2.25.7{series}"),
            0x00200011: ("IS", series), 0x00200013: ("IS", instance), 0x00200052: ("UI", "2.25.77")}


def pixels(columns, rows, content, bits=16, frames=1):
    return {0x00280002: ("US", 1), 0x00280004: ("CS", "MONOCHROME2"), 0x00280010: ("US", rows), 0x00280011: ("US", columns),
            0x00280100: ("US", bits), 0x00280101: ("US", bits), 0x00280102: ("US", bits - 1), 0x00280103: ("US", 0),
            0x7fe00010: ("OB" if bits < 16 else "OW", content), **({0x00280008: ("IS", frames)} if frames > 1 else {})}


def ct_slice(content, columns, rows, place_mm, series=1, instance=1, description="abdomen", spacing_mm=(2.0, 2.0),
             across=(1, 0, 0), down=(0, 1, 0), thick_mm=2.0, sop_class=CT, modality="CT"):
    """A slice of 16-bit values of HU + 1024; spacing between rows, then between columns."""
    return {**an_object(sop_class, modality, series, instance), **pixels(columns, rows, content),
            0x00080008: ("CS", "ORIGINAL\\PRIMARY\\AXIAL"), 0x0008103e: ("LO", description), 0x00180050: ("DS", f"{thick_mm:g}"),
            0x00200032: ("DS", numbers(place_mm)), 0x00200037: ("DS", numbers((*across, *down))),
            0x00280030: ("DS", numbers(spacing_mm)), 0x00281052: ("DS", "-1024"), 0x00281053: ("DS", "1")}


def enhanced_ct(slices, columns, rows, places_mm):
    """All slices in one object, with their places frame by frame."""
    shared = {0x00289110: ("SQ", [{0x00180050: ("DS", "2"), 0x00280030: ("DS", "2\\2")}]),
              0x00209116: ("SQ", [{0x00200037: ("DS", "1\\0\\0\\0\\1\\0")}]),
              0x00289145: ("SQ", [{0x00281052: ("DS", "-1024"), 0x00281053: ("DS", "1"), 0x00281054: ("LO", "HU")}])}
    own = [{0x00209113: ("SQ", [{0x00200032: ("DS", numbers(place))}])} for place in places_mm]
    return {**an_object(ENHANCED_CT, "CT", 5, 1), **pixels(columns, rows, b"".join(slices), frames=len(slices)),
            0x00080008: ("CS", "ORIGINAL\\PRIMARY\\VOLUME\\NONE"), 0x52009229: ("SQ", [shared]), 0x52009230: ("SQ", own)}


def segmentation(masks, columns, rows, places_mm, segment="liver"):
    """One binary segment; masks has a list of 0 and 1 for each frame."""
    bits = [bit for mask in masks for bit in mask]
    packed = bytes(sum(bit << n for n, bit in enumerate(bits[k:k + 8])) for k in range(0, len(bits), 8))
    code = {0x00080100: ("SH", "T-62000"), 0x00080102: ("SH", "SRT"), 0x00080104: ("LO", segment)}
    shared = {0x00289110: ("SQ", [{0x00180050: ("DS", "2"), 0x00280030: ("DS", "2\\2")}]),
              0x00209116: ("SQ", [{0x00200037: ("DS", "1\\0\\0\\0\\1\\0")}])}
    own = [{0x00209113: ("SQ", [{0x00200032: ("DS", numbers(place))}]), 0x0062000a: ("SQ", [{0x0062000b: ("US", 1)}])}
           for place in places_mm]
    return {**an_object(SEGMENTATION, "SEG", 30, 1), **pixels(columns, rows, packed, bits=1, frames=len(masks)),
            0x00620001: ("CS", "BINARY"), 0x00620002: ("SQ", [{
                0x00620003: ("SQ", [code]), 0x00620004: ("US", 1), 0x00620005: ("LO", segment), 0x00620008: ("CS", "AUTOMATIC"),
                0x0062000f: ("SQ", [code])}]),
            0x52009229: ("SQ", [shared]), 0x52009230: ("SQ", own)}
