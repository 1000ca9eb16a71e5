#!/bin/sh
# runs a case (coarser through -D options) and holds it against the checks in its scene
# usage: case.sh SILT SCENE OUT [run options]
set -eu
silt=$1 scene=$2 out=$3
shift 3
rm -rf "$out"
"$silt" run "$scene" -o "$out" -q "$@"
# y_plus is none until the law of the wall has something to say, gauges where there is no water
if ! grep -q 'gauges' "$scene" && awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) skip[i] = $i == "y_plus" }
    { for (i = 1; i <= NF; i++) if (!skip[i] && tolower($i) ~ /nan/) found = 1 } END { exit !found }' "$out/history.csv"; then
    echo "history.csv holds NaN" >&2
    exit 1
fi
"$silt" verify "$out"
