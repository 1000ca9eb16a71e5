#!/bin/sh
# The stability atlas: all studies of this folder; docs/stability.md goes to stdout. What has been run in OUT is not run again.
# usage: atlas.sh SILT OUT [JOBS] [STUDY...]
#   SILT the program; OUT a folder for the results, made when missing; JOBS at the same time (1); STUDY default: all
# Exit 1 when a run crashed, hung, is wrong, or ended without a word.
set -u
[ $# -ge 2 ] || { sed -n '3,4s/^# //p' "$0" >&2; exit 2; }
silt=$1 out=$2 jobs=${3:-1}
shift 2
[ $# -eq 0 ] || shift
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$out" || exit 2
[ $# -gt 0 ] || set -- "$here"/*.study.yaml
bad=0
for study; do
    name=$(basename "$study" .study.yaml)
    printf '%s: ' "$name" >&2
    "$silt" study "$study" -o "$out/$name" -q -j "$jobs" >"$out/$name.txt" 2>&1 || bad=1
    head -n 1 "$out/$name.txt" >&2
done
awk -F'\t' '
    FNR == 1 { runs++ }
    $1 == "status" { count[$2]++ }
    $1 == "cpu_seconds" { cpu += $2 }
    END {
        printf "# Stability\n\nOne scene each, over stiff and extreme ranges; made by `tests/atlas/atlas.sh SILT OUT > docs/stability.md`.\n\n"
        printf "%d runs, %.0f s of processor:", runs, cpu
        split("ok cut-and-recovered warned beyond-bounds refused failed unfinished hung crashed wrong", order, " ")
        for (k = 1; k <= 10; k++)
            printf "%s %d %s", (k > 1 ? "," : ""), count[order[k]], order[k]
        print ".\n"
    }' "$out"/*/runs/*.row
cat "$here/stability.head"
for study; do
    name=$(basename "$study" .study.yaml)
    printf '\n'
    sed "s#$here/##g" "$out/$name/study.md"
done
exit $bad
