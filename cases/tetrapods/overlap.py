#!/usr/bin/env python3
"""How deep tetrapods of a run stand in each other and in the walls of flume.stl, from their places in history.csv and the exact form.
usage: overlap.py OUT SCALE [SKIP]   prints the deepest of every SKIPth row (1), over SCALE, the height of a tetrapod"""
import csv
import sys
import numpy as np

TIP, LENGTH, ROOT = 0.151, 0.64322687604, 0.264915
TAPER = (ROOT - TIP) / LENGTH
AXIS = np.array([[0, 0, 1], [8 ** 0.5 / 3, 0, -1 / 3], [-(2 ** 0.5) / 3, (2 / 3) ** 0.5, -1 / 3], [-(2 ** 0.5) / 3, -((2 / 3) ** 0.5), -1 / 3]])


def depth(x):
    """how far points are inside a tetrapod of height 1, negative outside"""
    deepest = np.full(len(x), -1e9)
    for a in AXIS:
        s = x @ a
        r = np.linalg.norm(x - s[:, None] * a, axis=1)
        inside = np.minimum((ROOT - TAPER * s - r) / (1 + TAPER * TAPER) ** 0.5, LENGTH - s)
        deepest = np.where(s >= 0, np.maximum(deepest, inside), deepest)
    return deepest


def surface():
    points = []
    for a in AXIS:
        e = np.cross(a, [0.3, 0.5, 0.8])
        e /= np.linalg.norm(e)
        g = np.cross(a, e)
        for s in np.linspace(0.2, LENGTH, 14):
            for k in range(32):
                angle = 2 * np.pi * k / 32
                points.append(s * a + (ROOT - TAPER * s) * (np.cos(angle) * e + np.sin(angle) * g))
    points = np.array(points)
    return points[depth(points) < 1e-9]


def turn(q, x):
    w, v = q[0], np.array(q[1:])
    t = 2 * np.cross(v, x)
    return x + w * t + np.cross(v, t)


def main():
    out, scale, skip = sys.argv[1], float(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 1
    own, worst, low = surface(), (-1, None), (-1, None)
    rows = list(csv.DictReader(open(out + "/history.csv")))
    names = [k[:-3] for k in rows[0] if k.endswith("_qw")]
    for row in rows[::skip] + rows[-1:]:
        at = {n: np.array([float(row[n + "_" + c]) for c in "xyz"]) for n in names}
        q = {n: [float(row[n + "_q" + c]) for c in "wxyz"] for n in names}
        world = {n: at[n] + scale * turn(q[n], own) for n in names}
        for a in names:
            x = world[a]
            for d, what in ((-x[:, 2], "floor"), ((0.5 * (x[:, 0] - 1.8) - x[:, 2]) / 1.25 ** 0.5, "slope"), (-x[:, 1], "side"), (x[:, 1] - 0.6, "side")):
                if d.max() / scale > low[0]:
                    low = (d.max() / scale, (row["time"], a, what))
            for b in names:
                if a == b or np.linalg.norm(at[a] - at[b]) > 1.4 * scale:
                    continue
                back = [q[b][0]] + [-k for k in q[b][1:]]
                d = depth(turn(back, x - at[b]) / scale).max()
                if d > worst[0]:
                    worst = (d, (row["time"], a, b))
    print("into each other %.4g of the height" % worst[0], worst[1])
    print("into a wall %.4g of the height" % low[0], low[1])


main()
