#!/usr/bin/env python3
# outline of the water at the start: a solitary wave (Grimshaw, third order) in front of a slope 1:2 with its toe at x = 3.2:
#   python3 wave.py > wave.csv
import math
d, h, x1, toe, slope = 0.3, 0.12, 1.3, 3.2, 2.0
e = h / d
k = math.sqrt(0.75 * e) * (1 - 5 / 8 * e + 71 / 128 * e * e) / d
print(f"# water at the start: solitary wave, {h} m high, in water {d} m deep, crest at x = {x1} m; made by wave.py\nx,y")
print(f"0,0\n{toe},0\n{toe + slope * d},{d}")
for i in range(127, -1, -1):
    x = i * 0.03
    S = 1 / math.cosh(k * (x - x1)) ** 2
    T = 1 - S
    eta = d * (e * S - 0.75 * e * e * S * T + e ** 3 * (5 / 8 * S * T - 101 / 80 * S * S * T))
    if x < toe + slope * d:
        print(f"{x:.6g},{d + eta:.6g}")
