"""Rigid transforms as 4x4 rows of numbers, in plain Python, and files of them. Lengths are mm, angles degrees."""
import math
from pathlib import Path

IDENTITY = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]


def product(*transforms):
    """a_from_b, b_from_c, .. to a_from_.."""
    result = transforms[0]
    for other in transforms[1:]:
        result = [[sum(result[i][k] * other[k][j] for k in range(4)) for j in range(4)] for i in range(4)]
    return result


def inverse(a):
    back = [[a[j][i] for j in range(3)] for i in range(3)]
    return [[*back[i], -sum(back[i][k] * a[k][3] for k in range(3))] for i in range(3)] + [[0.0, 0.0, 0.0, 1.0]]


def apply(a, point):
    return tuple(a[i][0] * point[0] + a[i][1] * point[1] + a[i][2] * point[2] + a[i][3] for i in range(3))


def shift(x, y, z):
    return [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z], [0.0, 0.0, 0.0, 1.0]]


def turn(axis, degrees):
    """Right-handed about an axis of any length."""
    length = math.sqrt(sum(v * v for v in axis))
    x, y, z = (v / length for v in axis)
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return [[c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s, 0.0],
            [y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s, 0.0],
            [z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c), 0.0], [0.0, 0.0, 0.0, 1.0]]


def quaternion(a):
    """x, y, z, w of a transform's rotation, which is turned by less than half a turn."""
    w = math.sqrt(max(0.0, 1 + a[0][0] + a[1][1] + a[2][2])) / 2
    if w > 0.1:
        return (a[2][1] - a[1][2]) / (4 * w), (a[0][2] - a[2][0]) / (4 * w), (a[1][0] - a[0][1]) / (4 * w), w
    big = max(range(3), key=lambda k: a[k][k])
    i, j, k = big, (big + 1) % 3, (big + 2) % 3
    root = math.sqrt(max(0.0, 1 + a[i][i] - a[j][j] - a[k][k]))
    q = [0.0] * 4
    q[i] = root / 2
    q[j], q[k], q[3] = ((a[j][i] + a[i][j]) / (2 * root), (a[k][i] + a[i][k]) / (2 * root),
                        (a[k][j] - a[j][k]) / (2 * root))
    return tuple(q)


def matrix_text(a):
    return "".join(" ".join(f"{v:.9g}" for v in row) + "\n" for row in a)


def read_matrix(path):
    return [[float(v) for v in line.split()] for line in Path(path).read_text().splitlines() if line.strip() and line[0] != "#"][:4]


def table_line(a, time_s=None):
    """x, y, z and quaternion, with a time before it if there is one."""
    numbers = [a[0][3], a[1][3], a[2][3], *quaternion(a)]
    return ",".join(f"{v:.9g}" for v in ([] if time_s is None else [time_s]) + numbers) + "\n"


def distance(a, b):
    return math.dist([a[i][3] for i in range(3)], [b[i][3] for i in range(3)])
