#!/usr/bin/env python3
"""Writes the surfaces of the two piers, as STL with normals out of the stone, and the wave's outline into this folder.
usage: make.py"""
import math
import os

HERE = os.path.dirname(os.path.abspath(__file__))
# column on a slab on four pillars: planes of a grid in x, y, z
X = [1.90, 2.00, 2.10, 2.20, 2.30, 2.40]
Y = [0.15, 0.25, 0.35, 0.45, 0.55, 0.65]
Z = [0.0, 0.2, 0.3, 0.8]
# cylinders: middles of both rows
FRONT = [(1.9, 0.20), (1.9, 0.60)]
BACK = [(2.15, 0.40)]
RADIUS, SIDES, TOP = 0.08, 24, 0.8
# solitary wave
DEPTH, HEIGHT, CREST, LENGTH = 0.25, 0.1, 0.9, 3.4


def stone(i, j, k):
    if not (0 <= i < 5 and 0 <= j < 5 and 0 <= k < 3):
        return False
    return [i in (0, 4) and j in (0, 4), True, i == 2 and j == 2][k]


def facet(to, a, b, c):
    u = [b[d] - a[d] for d in range(3)]
    v = [c[d] - a[d] for d in range(3)]
    n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    length = sum(x * x for x in n) ** 0.5
    to.write("facet normal %g %g %g\nouter loop\n" % tuple(x / length for x in n))
    for p in (a, b, c):
        to.write("vertex %.6g %.6g %.6g\n" % tuple(p))
    to.write("endloop\nendfacet\n")


def foundation(to):
    for i in range(5):
        for j in range(5):
            for k in range(3):
                lo, hi = (X[i], Y[j], Z[k]), (X[i + 1], Y[j + 1], Z[k + 1])
                for d in range(3 if stone(i, j, k) else 0):
                    for side in (0, 1):
                        step = [0, 0, 0]
                        step[d] = 2 * side - 1
                        if stone(i + step[0], j + step[1], k + step[2]):
                            continue
                        corner = []
                        for p, q in ((0, 0), (1, 0), (1, 1), (0, 1)):
                            x = [0, 0, 0]
                            x[d] = (lo, hi)[side][d]
                            x[(d + 1) % 3] = (lo, hi)[p][(d + 1) % 3]
                            x[(d + 2) % 3] = (lo, hi)[q][(d + 2) % 3]
                            corner.append(x)
                        if not side:
                            corner.reverse()
                        facet(to, corner[0], corner[1], corner[2])
                        facet(to, corner[0], corner[2], corner[3])


def cylinders(to, middles):
    for x, y in middles:
        rim = [(x + RADIUS * math.cos(2 * math.pi * i / SIDES), y + RADIUS * math.sin(2 * math.pi * i / SIDES)) for i in range(SIDES)]
        for i in range(SIDES):
            a, b = rim[i], rim[(i + 1) % SIDES]
            facet(to, (*a, 0), (*b, 0), (*b, TOP))
            facet(to, (*a, 0), (*b, TOP), (*a, TOP))
            facet(to, (x, y, TOP), (*a, TOP), (*b, TOP))
            facet(to, (x, y, 0), (*b, 0), (*a, 0))


def wave(to):
    e = HEIGHT / DEPTH
    k = math.sqrt(0.75 * e) * (1 - 5 / 8 * e + 71 / 128 * e * e) / DEPTH
    to.write(f"# water at the start: solitary wave of {HEIGHT} m in {DEPTH} m of water, crest at x = {CREST} m; made by make.py\nx,z\n")
    to.write(f"0,0\n{LENGTH},0\n")
    n = 120
    for i in range(n, -1, -1):
        x = i * LENGTH / n
        s = 1 / math.cosh(k * (x - CREST)) ** 2
        t = 1 - s
        z = DEPTH * (1 + e * s - 0.75 * e * e * s * t + e ** 3 * (5 / 8 * s * t - 101 / 80 * s * s * t))
        to.write(f"{x:.6g},{z:.6g}\n")


for name, write in (("foundation", foundation), ("front", lambda to: cylinders(to, FRONT)), ("back", lambda to: cylinders(to, BACK))):
    with open(os.path.join(HERE, name + ".stl"), "w") as to:
        to.write(f"solid {name}\n")
        write(to)
        to.write(f"endsolid {name}\n")
with open(os.path.join(HERE, "wave.csv"), "w") as to:
    wave(to)
