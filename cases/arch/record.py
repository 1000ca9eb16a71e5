"""A synthetic record of an earthquake on firm ground, as CSV of time in s and accelerations in g: python3 record.py > record.csv

White noise through the filter of Kanai and Tajimi (ground 2.5 Hz, damping 0.6) and a high pass at 0.3 Hz, under an envelope that rises over 2 s,
stands for 5 s and dies away; the largest horizontal acceleration is 0.35 g, upwards it has half of that. The numbers are those of a linear
congruential generator, the same everywhere. No record of a real earthquake is used."""
import math

N, DT = 1200, 0.01


def noise(seed):
    state, out = seed, []
    for _ in range(N):
        total = 0.0
        for _ in range(12):
            state = (1103515245 * state + 12345) % 2147483648
            total += state / 2147483648.0
        out.append(total - 6)
    return out


def envelope(t):
    return (t / 2) ** 2 if t < 2 else 1.0 if t < 7 else math.exp(-0.9 * (t - 7))


def shaken(seed, peak):
    w, z, w0 = 2 * math.pi * 2.5, 0.6, 2 * math.pi * 0.3
    x = v = y = u = 0.0
    out = []
    for k, n in enumerate(noise(seed)):
        fine = 20
        for _ in range(fine):
            h = DT / fine
            v += h * (-n - 2 * z * w * v - w * w * x)
            x += h * v
            a = -(2 * z * w * v + w * w * x)
            u += h * (a - 2 * 0.7 * w0 * u - w0 * w0 * y)
            y += h * u
            b = a - 2 * 0.7 * w0 * u - w0 * w0 * y
        out.append(b * envelope(k * DT))
    most = max(abs(b) for b in out)
    return [peak * b / most for b in out]


print("# synthetic, by record.py: Kanai and Tajimi, 2.5 Hz, damping 0.6; accelerations in g")
print("time,ax,ay")
for k, (a, b) in enumerate(zip(shaken(20260611, 0.35), shaken(7, 0.175))):
    print("%.2f,%.5f,%.5f" % (k * DT, a, b))
