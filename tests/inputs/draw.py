"""Draws flat boards in perspective, in plain Python: polygons on the board, through a lens, into grey pictures."""
import dataclasses
import math
import random
import struct
import zlib
from pathlib import Path

from motion import apply

DARK, LIGHT, TABLE = 25, 225, 150
_CHANCE = random.Random(4711)
NOISE = [_CHANCE.gauss(0.5, 1.5) for _ in range(16384)]
SUBROWS = 4  # a pixel's coverage: exact along x, by so many lines along y

# The first tags of OpenCV's DICT_4X4_250, row by row from the highest bit; 1 is light.
TAGS = (0xb532, 0x0f9a, 0x332d, 0x9946, 0x549e, 0x79cd, 0x9e2e, 0xc4f2, 0xfeda, 0xcf56, 0xf991, 0x11a7, 0x0eb7, 0x2a0f,
        0x24b1, 0x263e, 0x4665, 0x6600, 0x6c5e, 0x76af, 0x868b, 0xb02b, 0xccd5, 0xdd82, 0xfe47, 0x9471, 0xace4, 0xa554,
        0x2123, 0x346f, 0x4415, 0x57b2, 0x9ecf, 0xf0cb, 0x08ae, 0x0929, 0x1875, 0x04ff, 0x0df6, 0x1c5a)


@dataclasses.dataclass(frozen=True)
class Lens:
    """A pinhole with radial distortion, px."""
    width: int = 640
    height: int = 480
    fx: float = 600.0
    fy: float = 600.0
    cx: float = 322.0
    cy: float = 237.0
    k1: float = -0.12
    k2: float = 0.0

    def pixel(self, point):
        """Where a point of the camera's frame of coordinates, mm, is seen."""
        x, y = point[0] / point[2], point[1] / point[2]
        r2 = x * x + y * y
        bend = 1 + r2 * (self.k1 + r2 * self.k2)
        return self.fx * x * bend + self.cx, self.fy * y * bend + self.cy


@dataclasses.dataclass(frozen=True)
class Taken:
    """A picture that is not drawn on any more."""
    width: int
    height: int
    grey_bytes: bytes

    def taken(self):
        return self


class Picture:
    """Grey levels, row by row."""

    def __init__(self, width, height, grey=TABLE):
        self.width, self.height = width, height
        self.rows = [[float(grey)] * width for _ in range(height)]

    def fill(self, polygon, grey):
        """Paints a polygon of pixel coordinates; a pixel is a square about its whole coordinates."""
        top = max(0, math.ceil(min(y for _, y in polygon) - 0.5))
        bottom = min(self.height - 1, math.floor(max(y for _, y in polygon) + 0.5))
        left = max(0, math.floor(min(x for x, _ in polygon) + 0.5))
        right = min(self.width - 1, math.floor(max(x for x, _ in polygon) + 0.5))
        if left > right:
            return
        edges = list(zip(polygon, polygon[1:] + polygon[:1]))
        for y in range(top, bottom + 1):
            cover = [0.0] * (right - left + 1)
            for sub in range(SUBROWS):
                line = y - 0.5 + (sub + 0.5) / SUBROWS
                cuts = sorted(x0 + (line - y0) * (x1 - x0) / (y1 - y0) for (x0, y0), (x1, y1) in edges
                              if (y0 <= line) != (y1 <= line))
                for begin, end in zip(cuts[::2], cuts[1::2]):
                    _cover(cover, begin - left + 0.5, end - left + 0.5)
            row = self.rows[y]
            for k, share in enumerate(cover):
                if share:
                    row[left + k] += (grey - row[left + k]) * share / SUBROWS

    def taken(self):
        """The picture as a camera takes it: bytes row by row, with a noise of 1.5 grey levels, the same each time."""
        noisy = []
        for number, row in enumerate(self.rows):
            begin = number * 7919 % (len(NOISE) - self.width)
            noisy.append(bytes(min(255, max(0, int(value + off))) for value, off in zip(row, NOISE[begin:begin + self.width])))
        return Taken(self.width, self.height, b"".join(noisy))


def _cover(cover, begin, end):
    """Adds what pixels k, from k to k + 1 each, have of the stretch from begin to end."""
    begin, end = max(begin, 0.0), min(end, float(len(cover)))
    if begin >= end:
        return
    first, last = int(begin), min(int(end), len(cover) - 1)
    if first == last:
        cover[first] += end - begin
        return
    cover[first] += first + 1 - begin
    for k in range(first + 1, last):
        cover[k] += 1.0
    cover[last] += end - last


def _square(x, y, side):
    return [(x, y), (x + side, y), (x + side, y + side), (x, y + side)]


def chessboard(columns, rows, pitch):
    """A chessboard of inner corners, the first at (0, 0) mm, as polygons with their grey levels."""
    yield [(-2 * pitch, -2 * pitch), ((columns + 1) * pitch, -2 * pitch), ((columns + 1) * pitch, (rows + 1) * pitch),
           (-2 * pitch, (rows + 1) * pitch)], LIGHT
    for i in range(-1, columns):
        for j in range(-1, rows):
            if (i + j) % 2 == 0:
                yield _square(i * pitch, j * pitch, pitch), DARK


def charuco(columns, rows, pitch, tag, legacy=False):
    """A ChArUco board of squares, its corner at (0, 0) mm."""
    yield [(-pitch, -pitch), ((columns + 1) * pitch, -pitch), ((columns + 1) * pitch, (rows + 1) * pitch),
           (-pitch, (rows + 1) * pitch)], LIGHT
    light_first = 1 if not legacy or rows % 2 else 0
    number = 0
    for j in range(rows):
        for i in range(columns):
            if (i + j) % 2 != light_first:
                yield _square(i * pitch, j * pitch, pitch), DARK
                continue
            x, y = i * pitch + (pitch - tag) / 2, j * pitch + (pitch - tag) / 2
            yield _square(x, y, tag), DARK
            for k in range(16):
                if TAGS[number] >> (15 - k) & 1:
                    yield _square(x + (1 + k % 4) * tag / 6, y + (1 + k // 4) * tag / 6, tag / 6), LIGHT
            number += 1


def dots(columns, rows, pitch, larger=(), larger_by=2.0):
    """Round dots, half of the pitch wide where larger ones leave room, numbered row by row from 0."""
    yield [(-2 * pitch, -2 * pitch), ((columns + 1) * pitch, -2 * pitch), ((columns + 1) * pitch, (rows + 1) * pitch),
           (-2 * pitch, (rows + 1) * pitch)], LIGHT
    for number in range(columns * rows):
        radius = 0.17 * pitch * (larger_by if number in larger else 1.0)
        x, y = number % columns * pitch, number // columns * pitch
        turns = [2 * math.pi * k / 24 for k in range(24)]
        yield [(x + radius * math.cos(a), y + radius * math.sin(a)) for a in turns], DARK


def view(board, lens, camera_from_board):
    """The picture of a board at a pose."""
    picture = Picture(lens.width, lens.height)
    for polygon, grey in board:
        seen = []
        for (x0, y0), (x1, y1) in zip(polygon, polygon[1:] + polygon[:1]):
            pieces = 4 if len(polygon) == 4 else 1  # a lens bends edges
            seen += [lens.pixel(apply(camera_from_board, (x0 + (x1 - x0) * k / pieces, y0 + (y1 - y0) * k / pieces, 0.0)))
                     for k in range(pieces)]
        picture.fill(seen, grey)
    return picture


def mirrored(picture):
    other = Picture(picture.width, picture.height)
    other.rows = [row[::-1] for row in picture.rows]
    return other


def write_pgm(path, picture):
    Path(path).write_bytes(b"P5\n%d %d\n255\n" % (picture.width, picture.height) + picture.taken().grey_bytes)


def write_ppm(path, picture):
    grey = picture.taken().grey_bytes
    Path(path).write_bytes(b"P6\n%d %d\n255\n" % (picture.width, picture.height) + bytes(v for v in grey for _ in range(3)))


def write_png(path, picture):
    grey = picture.taken().grey_bytes
    rows = b"".join(b"\0" + grey[k:k + picture.width] for k in range(0, len(grey), picture.width))

    def chunk(name, content):
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))

    Path(path).write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", picture.width, picture.height, 8, 0, 0, 0, 0)) +
                           chunk(b"IDAT", zlib.compress(rows, 1)) + chunk(b"IEND", b""))
