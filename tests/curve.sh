#!/bin/bash
# Error against run time: cases with an exact or measured answer over h, time.cfl, scheme and pressure, one run at a time.
# usage: curve.sh SILT OUT [PICTURE]
#   SILT     the program; OUT a folder for the results, made when missing; PICTURE an SVG (gnuplot)
# The table goes to stdout: case, h over the case's own, cfl, scheme, pressure, steps, seconds of processor, check, error as
# `silt verify` gives it. A run that fails has no rows, and a line on stderr.
set -u
silt=$1 out=$2 picture=${3:-}
cd "$(dirname "$0")/.." || exit 2
mkdir -p "$out" || exit 2
LC_ALL=C
TIMEFORMAT=%U

# case, h, factor on h, cfl, scheme, pressure
run() {
    local result=$out/$1-$3-$4-$5-$6 size seconds
    size=$(awk "BEGIN {print $2*$3}")
    rm -rf "$result"
    if ! seconds=$({ time "$silt" run "cases/$1/scene.yaml" -q -D fluid.size="$size" -D time.cfl="$4" -D fluid.scheme="$5" \
        -D fluid.pressure="$6" -o "$result" >"$result.log" 2>&1; } 2>&1); then
        printf '%s failed: %s\n' "$result" "$(tail -1 "$result.log")" >&2
        return
    fi
    "$silt" verify "$result" 2>/dev/null | awk -v head="$1,$3,$4,$5,$6,$(sed -n 's/.*"steps": \([0-9]*\).*/\1/p' "$result/summary.json"),$seconds" \
        'NR > 1 && ($6 == "pass" || $6 == "FAIL") {printf "%s,%s,%s\n", head, $1, $4}'
    rm -rf "$result"
}

{
    echo case,h,cfl,scheme,pressure,steps,seconds,check,error
    while read -r name h; do
        for factor in 2 1.414 1; do
            for cfl in 0.125 0.25 0.5 1; do
                run "$name" "$h" "$factor" "$cfl" implicit consistent
            done
        done
        for factor in 2 1.414 1; do
            run "$name" "$h" "$factor" 0.5 fractional consistent
            run "$name" "$h" "$factor" 0.5 implicit laplacian
        done
    done <<'EOF'
standing-wave 0.025
elliptic-drop 0.04
taylor-green 0.03125
dam-break 0.00142875
EOF
} | tee "$out/curve.csv"

[ -n "$picture" ] || exit 0
# one panel a case: the check that says most of the field
panel() {
    echo "set title '$1: $2'"
    printf 'plot '
    local first=1
    for cfl in 0.125 0.25 0.5 1; do
        [ $first ] || printf ', '
        first=
        printf "'< grep ^%s, %s/curve.csv | grep ,%s,implicit,consistent, | grep ,%s,' using 7:(abs(\$9)) with linespoints title 'cfl %s'" "$1" "$out" "$cfl" "$2" "$cfl"
    done
    printf ", '< grep ^%s, %s/curve.csv | grep ,fractional, | grep ,%s,' using 7:(abs(\$9)) with points pt 6 title 'fractional'" "$1" "$out" "$2"
    printf ", '< grep ^%s, %s/curve.csv | grep ,laplacian, | grep ,%s,' using 7:(abs(\$9)) with points pt 8 title 'laplacian'\n" "$1" "$out" "$2"
}
{
    echo "set terminal svg size 900,700 background 'white'; set output '$picture'; set datafile separator ','"
    echo "set logscale xy; set xlabel 'seconds of processor'; set ylabel 'error'; set format y '%.0e'; set key below maxrows 2; set grid; set termoption noenhanced"
    echo "set multiplot layout 2,2"
    panel standing-wave amplitude
    panel elliptic-drop pressure
    panel taylor-green slide_bottom
    panel dam-break front
    echo "unset multiplot"
} | gnuplot
