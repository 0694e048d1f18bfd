#!/usr/bin/env python3
"""Draws a board as a page to print: board.py SPEC > board.svg, SPEC as chessboard:11x8:6mm or charuco:12x9:5mm:4mm:DICT_4X4_50[:legacy].
A ChArUco board needs OpenCV (Debian's python3-opencv), which has the tags."""
import re, sys

spec = re.fullmatch(r"(chessboard|charuco):(\d+)x(\d+):([\d.]+)mm(?::([\d.]+)mm:(DICT_\w+?)(:legacy)?)?", " ".join(sys.argv[1:]))
if not spec or (spec[1] == "charuco") != bool(spec[6]):
    sys.exit("usage: board.py (chessboard:11x8:6mm | charuco:12x9:5mm:4mm:DICT_4X4_50[:legacy]) > board.svg")
columns, rows, side = int(spec[2]), int(spec[3]), float(spec[4])
tags, white_first = [], False
if spec[6]:
    try:
        from cv2 import aruco
    except ImportError as error:
        sys.exit("board.py: a ChArUco board needs OpenCV (%s): apt install python3-opencv" % error)
    if not hasattr(aruco, spec[6]):
        sys.exit("board.py: OpenCV has no dictionary " + spec[6])
    dictionary = aruco.getPredefinedDictionary(getattr(aruco, spec[6]))
    draw = getattr(aruco, "generateImageMarker", None) or aruco.drawMarker
    modules, tag = dictionary.markerSize + 2, float(spec[5])  # a tag's bits, and its black rim
    tags = [draw(dictionary, i, modules) for i in range(len(dictionary.bytesList))]
    if len(tags) < columns * rows // 2:
        sys.exit("board.py: %s has %d tags, and the board %d" % (spec[6], len(tags), columns * rows // 2))
    white_first = bool(spec[7]) and rows % 2 == 0
else:
    columns, rows = columns + 1, rows + 1  # squares, one more than inner corners


def black(x, y, width, height):
    print('<rect x="%.6g" y="%.6g" width="%.6g" height="%.6g"/>' % (x, y, width, height))


wide, high = (columns + 2) * side, (rows + 2) * side  # with a white border one square wide
print('<svg xmlns="http://www.w3.org/2000/svg" width="%gmm" height="%gmm" viewBox="0 0 %g %g" shape-rendering="crispEdges">'
      % (wide, high, wide, high))
print('<rect width="100%" height="100%" fill="white"/>')
number = 0
for row in range(rows):
    for column in range(columns):
        x, y = (column + 1) * side, (row + 1) * side
        if (row + column + white_first) % 2 == 0:
            black(x, y, side, side)
        elif tags:
            module, margin = tag / modules, (side - tag) / 2
            for r, line in enumerate(tags[number]):
                c = 0
                while c < modules:  # black modules side by side are one bar: no hairline is printed between them
                    start = c
                    while c < modules and line[c] == 0:
                        c += 1
                    if c > start:
                        black(x + margin + start * module, y + margin + r * module, (c - start) * module, module)
                    c += c == start
            number += 1
print("</svg>")
