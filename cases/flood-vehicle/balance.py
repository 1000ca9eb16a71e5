#!/usr/bin/env python3
# speed of the stream at which a vehicle slides, by hand: python3 balance.py held.out [mu ...]
# drag = a U^2 and lift = b U^2 of the vehicle held fast, least squares over the whole rise; it slides when a U^2 = mu (W - B - b U^2)
import csv
import math
import sys

W, B = 1300 * 0.08 * 9.81, 1000 * 0.08 * 9.81


def speed(t):
    x = min(t / 4, 1)
    return x * x * (3 - 2 * x)


rows = [{k: float(r[k]) for k in ("time", "car_fx", "car_fy")} for r in csv.DictReader(open(sys.argv[1] + "/history.csv"))]
rows = [r for r in rows if r["time"] > 0]
u4 = sum(speed(r["time"]) ** 4 for r in rows)
a = sum(r["car_fx"] * speed(r["time"]) ** 2 for r in rows) / u4
b = sum((r["car_fy"] - B) * speed(r["time"]) ** 2 for r in rows) / u4
print(f"drag {a:.0f} U^2, lift {b:.0f} U^2, under water it weighs {W - B:.1f} N")
for mu in map(float, sys.argv[2:] or ["0.3", "0.5", "0.8"]):
    u = math.sqrt(mu * (W - B) / (a + mu * b))
    t = next(i * 1e-3 for i in range(4001) if speed(i * 1e-3) >= u)
    print(f"mu {mu}: slides from {u:.3f} m/s, at {t:.2f} s; 0.9 of it at",
          f"{next(i * 1e-3 for i in range(4001) if speed(i * 1e-3) >= 0.9 * u):.2f} s, 1.1 at",
          f"{next(i * 1e-3 for i in range(4001) if speed(i * 1e-3) >= 1.1 * u):.2f} s")
