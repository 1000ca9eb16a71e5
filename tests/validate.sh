#!/bin/sh
# Every case at its own size against the checks in its scene; the table goes to stdout.
# usage: validate.sh SILT OUT [SCENE...]
#   SILT   the program; OUT a folder for the results, made when missing: a case that is already done there is not run again
#   SCENE  default: every cases/*/scene*.yaml but MARIN, which takes the better part of an hour
# Exit 1 when a run fails or a check does.
set -u

silt=$1 out=$2
shift 2
cd "$(dirname "$0")/.." || exit 2
mkdir -p "$out" || exit 2
[ $# -gt 0 ] || set -- $(ls cases/*/scene*.yaml | grep -v -e cases/marin/ -e scene-coarse)

failed=0
printf '| scene | check | value | reference | error | allowed | |\n|---|---|---|---|---|---|---|\n'
for scene; do
    name=$(printf '%s' "${scene#cases/}" | sed 's#/scene##; s#\.yaml$##')
    result=$out/$name.out
    if ! grep -qs '"status": "done"' "$result/summary.json"; then
        rm -rf "$result"
        printf '%s\n' "$scene" >&2
        if ! "$silt" run "$scene" -o "$result" >"$out/$name.log" 2>&1; then
            printf '| %s | | | | | | **the run failed**, see %s.log |\n' "$name" "$name"
            failed=1
            continue
        fi
    fi
    "$silt" verify "$result" >"$out/$name.checks" 2>&1 || failed=1
    awk -v name="$name" '
        NR > 1 && ($6 == "pass" || $6 == "FAIL") {
            note = $0; sub(/.*(pass|FAIL) */, "", note)
            mark = $6 == "FAIL" ? "**missed**" : "met"
            printf "| %s | %s | %s | %s | %s | %s | %s %s |\n", name, $1, $2, $3, $4, $5, mark, note
        }' "$out/$name.checks"
done
exit $failed
