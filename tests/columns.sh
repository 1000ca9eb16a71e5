#!/bin/sh
# Every column of history.csv, every array of a frame, every key of summary.json stands in docs/output.md.
# usage: columns.sh SILT DOC SCENE...
test_name=columns
[ $# -ge 3 ] || { sed -n '3s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
silt=$1
doc=$2
shift 2

n=0
for scene in "$@"; do
    out=$work/out$n
    expect 0 "$silt" run "$scene" -q -o "$out" -D time.steps=2
    # a body's columns are explained once, for NAME; gauges have the names of the scene
    bodies=$(sed -n '/^bodies:/,/^[a-z]/s/.*name: "\{0,1\}\([a-z_0-9]*\).*/\1/p' "$out/scene.yaml")
    gauges=$(sed -n '/^gauges:/,/^[a-z]/s/.*name: "\{0,1\}\([a-z_0-9]*\).*/\1/p' "$out/scene.yaml")
    for column in $(head -n 1 "$out/history.csv" | tr ',' ' '); do
        for gauge in $gauges; do
            case $column in
            "$gauge" | "$gauge"_[xyz]) continue 2 ;;
            esac
        done
        for body in $bodies; do
            column=$(printf '%s\n' "$column" | sed "s/^${body}_/NAME_/")
        done
        grep -q "\`$column\`" "$doc" || fail "column $column is not in $doc"
        n=$((n + 1))
    done
    for key in $(sed -n 's/^  "\([a-z_]*\)":.*/\1/p' "$out/summary.json"); do
        grep -q "\`$key\`" "$doc" || fail "key $key of summary.json is not in $doc"
    done
    for file in "$out"/*; do
        name=$(basename "$file" | sed 's/_[0-9]\{6\}\./_NNNNNN./; s/^surface_NNNNNN.*\|^bed_NNNNNN.*\|^grains_NNNNNN.*\|^bodies_NNNNNN.*/fluid_NNNNNN.hdf/; s/^[a-z]*\.hdf\.series/fluid.hdf.series/')
        case $name in
        *.csv) [ "$name" != history.csv ] || grep -q "\`$name\`" "$doc" || fail "$name is not in $doc" ;;
        *) grep -q "\`$name\`" "$doc" || fail "file $name is not in $doc" ;;
        esac
    done
done
say "$n columns are explained in $(basename "$doc")"
