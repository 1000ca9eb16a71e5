#!/bin/sh
# runs a case (coarser through -D options) and holds it against the checks in its scene
# usage: case.sh SILT SCENE OUT [run options]
set -eu
silt=$1 scene=$2 out=$3
shift 3
rm -rf "$out"
"$silt" run "$scene" -o "$out" -q "$@"
if grep -qi nan "$out/history.csv" && ! grep -q 'gauges' "$scene"; then
    echo "history.csv holds NaN" >&2
    exit 1
fi
"$silt" verify "$out"
