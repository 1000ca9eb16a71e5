"""Blocks of a semicircular arch: python3 make.py BLOCKS RADIUS THICKNESS > list of bodies (YAML). RADIUS is that of the centre line."""
import math
import sys

n, R, t = int(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3])
gap = float(sys.argv[4]) if len(sys.argv) > 4 else 0


def centroid(p):
    a = x = y = 0
    for (x0, y0), (x1, y1) in zip(p, p[1:] + p[:1]):
        c = x0 * y1 - x1 * y0
        a, x, y = a + c / 2, x + c * (x0 + x1) / 6, y + c * (y0 + y1) / 6
    return x / a, y / a


for k in range(n):
    a, b = math.pi * (1 - k / n), math.pi * (1 - (k + 1) / n)
    p = [((R + s * t / 2) * math.cos(w), (R + s * t / 2) * math.sin(w)) for s, w in ((-1, a), (1, a), (1, b), (-1, b))]
    x, y = centroid(p)
    points = ", ".join("[%.9f, %.9f]" % (u - x, v - y) for u, v in p)
    print("  - {name: block%d, shape: polygon, at: [%.9f, %.9f], density: 2500, points: [%s]}" % (k + 1, x, y, points))
