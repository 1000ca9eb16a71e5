# outline of a solitary wave before a plane beach, the wave running towards the beach (-x); lengths in m
#   awk -v H=0.00555 -f wave.awk > wave.csv
# d: depth, H: height, x1: crest, slope: beach 1:slope from its toe at x = slope d, still water line at x = 0, y = 0;
# surface by Grimshaw's third order (docs/scene.md, formula solitary-wave)
BEGIN {
    if (!d) d = 0.3
    if (!slope) slope = 19.85
    if (!step) step = 0.05 * d
    e = H / d
    r = sqrt(20)
    # Synolakis: crest half a wave length from the toe, where the front is 1/20 of H high
    if (!x1) x1 = slope * d + d * log(r + sqrt(r * r - 1)) / sqrt(0.75 * e)
    if (!end) end = 70 * d
    k = sqrt(0.75 * e) * (1 - 5 / 8 * e + 71 / 128 * e * e) / d
    printf "# outline of the water at the start: solitary wave, H = %g m, d = %g m, crest at x = %.6g m; made by wave.awk\n", H, d, x1
    print "x,y"
    printf "%.6g,%.6g\n", slope * d, -d
    printf "%.6g,%.6g\n", end, -d
    n = int(end / step + 0.5)
    for (i = n; i >= 0; i--) {
        x = i * step
        z = exp(k * (x - x1))
        S = 4 / (z + 1 / z) ^ 2
        T = 1 - S
        y = d * (e * S - 0.75 * e * e * S * T + e ^ 3 * (5 / 8 * S * T - 101 / 80 * S * S * T))
        # the first corner lies on the beach
        printf "%.6g,%.6g\n", i ? x : -slope * y, y
    }
}
