# Curves over time as an SVG: crest, the bed's mass and the discharge over the outfall's section.
# usage: awk -F, -f history.awk OUT/history.csv >history.svg
BEGIN { n = 0 }
NR == 1 { for (i = 1; i <= NF; i++) column[$i] = i; next }
NR == 2 { bed = $column["bed_mass"] }
{
    time[n] = $column["time"]
    value[0, n] = $column["crest"] == "nan" ? 0 : $column["crest"] / 0.35
    value[1, n] = $column["bed_mass"] / bed
    value[2, n] = $column["discharge"]
    value[3, n++] = $column["left_mass"] / bed
}
function line(k, colour, label,    i, mean, m) {
    printf "<path fill='none' stroke='%s' stroke-width='1.5' d='", colour
    for (i = 0; i < n; i += 8) {
        mean = 0
        for (m = 0; m < 8 && i + m < n; m++) mean += value[k, i + m]
        printf "%s%.1f,%.1f", i ? "L" : "M", 50 + 520 * time[i] / time[n - 1], 230 - 180 * mean / m
    }
    printf "'/>\n<text x='%d' y='262' fill='%s'>%s</text>\n", 50 + 140 * k, colour, label
}
END {
    print "<svg xmlns='http://www.w3.org/2000/svg' width='620' height='275' font-family='sans-serif' font-size='12'>"
    print "<rect width='620' height='275' fill='white'/><path stroke='black' fill='none' d='M50,20V230H570'/>"
    for (k = 0; k <= 5; k++)
        printf "<text x='20' y='%d'>%.1f</text><text x='%d' y='246'>%.1f s</text>\n", 234 - 36 * k, k / 5, 45 + 104 * k, k / 5 * time[n - 1]
    line(0, "#8a5a00", "crest / 0.35 m")
    line(1, "#c02020", "bed / bed at start")
    line(2, "#2050c0", "discharge, m2/s")
    line(3, "#208040", "carried out / bed")
    print "</svg>"
}
