#!/usr/bin/env python3
"""Averages the poses of session recordings, one of each place at which a sensor rested:
average.py [--bird Scope] [--places places.csv | --tip tip.txt] FOLDER... > table.csv
--places: name,true_x,true_y,true_z, a line a place; names are those of the folders. The table is one for calibrate field --grid.
--tip: the tip in the sensor's frame, mm. The table is name,x,y,z of the tip, one for calibrate field check --measured."""
import argparse, csv, math, os, re, sys

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--bird", default="Scope")
parser.add_argument("--places")
parser.add_argument("--tip")
parser.add_argument("folders", nargs="+")
given = parser.parse_args()


def poses(folder):
    """Each good measurement's 16 numbers, tracker_from_sensor row by row."""
    path = os.path.join(folder, "tracker.igs.mha")
    field = re.compile(r"Seq_Frame(\d+)_%sToTrackerTransform(Status)? = (.*)" % re.escape(given.bird), re.I)
    found, good = {}, set()
    with open(path, encoding="latin-1") as file:
        for line in file:
            match = field.match(line)
            if match and match[2]:
                good.update([match[1]] * (match[3].strip() == "OK"))
            elif match:
                found[match[1]] = [float(word) for word in match[3].split()]
    return [numbers for frame, numbers in found.items() if frame in good]


def quaternion(m):
    """x, y, z, w of a rotation, the largest of them above 0."""
    squares = [1 + m[0] - m[5] - m[10], 1 - m[0] + m[5] - m[10], 1 - m[0] - m[5] + m[10], 1 + m[0] + m[5] + m[10]]
    i = squares.index(max(squares))
    q = [[squares[0], m[1] + m[4], m[2] + m[8], m[9] - m[6]], [m[1] + m[4], squares[1], m[6] + m[9], m[2] - m[8]],
         [m[2] + m[8], m[6] + m[9], squares[2], m[4] - m[1]], [m[9] - m[6], m[2] - m[8], m[4] - m[1], squares[3]]][i]
    return [part / math.hypot(*q) for part in q]


def mean(rows):
    return [sum(column) / len(rows) for column in zip(*rows)]


try:
    lines = [line for line in open(given.tip) if not line.startswith("#")] if given.tip else ["0 0 0"]
    tip = [float(word) for word in " ".join(lines).split()]
    if len(tip) != 3:
        sys.exit("average.py: %s: not three numbers" % given.tip)
    true = {row["name"]: row for row in csv.DictReader(open(given.places))} if given.places else {}
    table = []
    for folder in given.folders:
        name = os.path.basename(os.path.normpath(folder))
        if given.places and name not in true:
            sys.exit("average.py: %s: %s has no such place" % (folder, given.places))
        all_poses = poses(folder)
        if not all_poses:
            sys.exit("average.py: %s: no pose of %s" % (folder, given.bird))
        places = [[sum(m[4 * r + c] * tip[c] for c in range(3)) + m[4 * r + 3] for r in range(3)] for m in all_poses]
        place = mean(places)
        off = math.sqrt(mean([[math.dist(place, one) ** 2] for one in places])[0])
        print("%s: %d poses, %.2f mm rms about their mean" % (name, len(places), off), file=sys.stderr)
        first = quaternion(all_poses[0])
        turns = []  # a quaternion and its negative are one turn
        for q in map(quaternion, all_poses):
            turns.append(q if sum(a * b for a, b in zip(q, first)) > 0 else [-part for part in q])
        turn = mean(turns)
        turn = [part / math.hypot(*turn) for part in turn]
        table.append([name] + [true[name][key] for key in ("true_x", "true_y", "true_z") if given.places]
                     + ["%.3f" % part for part in place] + ["%.5f" % part for part in turn if not given.tip])
except (OSError, ValueError, KeyError) as error:
    sys.exit("average.py: %s" % error)
writer = csv.writer(sys.stdout, lineterminator="\n")
writer.writerow(["name"] + ["true_x", "true_y", "true_z"] * bool(given.places) + ["x", "y", "z"]
                + ["qx", "qy", "qz", "qw"] * (not given.tip))
writer.writerows(table)
