#!/usr/bin/env python3
# Small heave of a box that floats in the middle of a tank, linear potential flow, exact but for the cells of a grid:
#   python3 reference.py
# Kinetic energy of the box and of the water that box and surface move, potential energy of both; the halves of the tank are alike.
import numpy as np

B, T, W, D, G = 0.2, 0.05, 0.4, 0.25, 9.81  # box width and draft, tank width, depth of the water, gravity; density 1000
MASS = 1000 * B * T


def modes(n):
    """frequencies of modes of motion and their shares in a start with the box up and the surface level; n cells in the draft"""
    h = T / n
    nx, ny = round(W / 2 / h), round(D / h)
    nb = round(B / 2 / h)
    number = -np.ones((nx, ny), int)
    cells = [(i, j) for i in range(nx) for j in range(ny) if not (i < nb and j >= ny - n)]
    cells.sort(key=lambda c: c[0])  # narrow band along y
    for k, c in enumerate(cells):
        number[c] = k
    # flux out of a cell through box or surface: columns of the right-hand side
    free = nx - nb
    f = np.zeros((len(cells), free + 1))
    for i in range(nb, nx):
        f[number[i, ny - 1], i - nb] = h  # surface rises
    for i in range(nb):
        f[number[i, ny - n - 1], free] = h  # bottom of the box rises
    # unknowns with the sum of rises nought: box z, surfaces but the last, which takes what is left
    t = np.zeros((free + 1, free))
    for i in range(free - 1):
        t[i, i] = 1
        t[free - 1, i] = -1
    t[free, free - 1] = 1
    t[free - 1, free - 1] = -nb
    f = f @ t
    a = np.zeros((len(cells), len(cells)))
    for (i, j), k in ((c, number[c]) for c in cells):
        for di, dj in ((1, 0), (0, 1)):
            if i + di < nx and j + dj < ny and number[i + di, j + dj] >= 0:
                m = number[i + di, j + dj]
                a[k, k] += 1
                a[m, m] += 1
                a[k, m] -= 1
                a[m, k] -= 1
    a[0, 0] += 1  # the potential's constant
    x = np.linalg.solve(a, f)
    # the face on the surface is half a cell beyond the cell's middle
    half = np.zeros(free + 1)
    half[:] = h / 2 * h
    half[free] = nb * h / 2 * h
    kinetic = 1000 * (f.T @ x + t.T @ (half[:, None] * t))
    potential = 1000 * G * h * (t.T @ np.diag([1] * free + [0]) @ t)
    kinetic[-1, -1] += MASS / 2
    potential[-1, -1] += 1000 * G * B / 2
    l = np.linalg.cholesky(kinetic)
    s = np.linalg.solve(l, np.linalg.solve(l, potential).T)
    w2, v = np.linalg.eigh((s + s.T) / 2)
    shape = np.linalg.solve(l.T, v)
    # start: box up by 1, surface level, which the volume lowers
    start = np.full(free, -nb / free)
    start[-1] = 1
    share = shape[-1] * (shape.T @ kinetic @ start)
    return np.sqrt(w2), share


if __name__ == "__main__":
    period = {}
    for n in (4, 6, 8, 12):
        w, share = modes(n)
        k = np.argmax(abs(share))
        period[n] = 2 * np.pi / w[k]
        print(f"{n} cells in the draft: period {period[n]:.5f} s, share of the heave {share[k]:.4f}")
    # the corners of the box make the error fall as h^(4/3)
    for a, b in ((4, 8), (6, 12)):
        print(f"{a} and {b}, no cells: {period[b] - (period[a] - period[b]) / ((b / a) ** (4 / 3) - 1):.5f} s")
