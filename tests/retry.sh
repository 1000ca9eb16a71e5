#!/bin/sh
# LIGGGHTS fails at long steps: they are cut and tried again, nothing is lost, and a run that cannot go on says why.
# usage: retry.sh SILT SCENE FAILING_WORKER SILT_DEM [option of silt run]...
test_name=retry
[ $# -ge 4 ] || { sed -n '3s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
silt=$1
scene=$2
failing=$3
SILT_FAIL_WORKER=$4
SILT_FAIL_FROM=2
export SILT_FAIL_WORKER SILT_FAIL_FROM
shift 4

# of all steps, the largest of a column's values
worst() {
    awk -F, -v name="$2" 'NR == 1 { for (k = 1; k <= NF; k++) if ($k == name) c = k; if (!c) exit 1; next }
        { x = $c < 0 ? -$c : $c; if (x > most) most = x } END { printf "%.3g\n", most }' "$1/history.csv"
}

# the longest steps are of two hundred substeps
SILT_FAIL_MOST=80
export SILT_FAIL_MOST
cut=$work/cut
expect 0 "$silt" run "$scene" -q -o "$cut" --worker "$failing" "$@"
retries=$(sed -n 's/.*"retries": \([0-9]*\).*/\1/p' "$cut/summary.json")
[ "${retries:-0}" -gt 0 ] || fail "no step was tried again"
awk -v x="$(worst "$cut" sediment_error)" 'BEGIN { exit !(x < 1e-12) }' || fail "sediment_error reaches $(worst "$cut" sediment_error)"
say "$retries tries again of $(rows "$cut") rows, sediment closes to $(worst "$cut" sediment_error)"

# it can never go on
SILT_FAIL_MOST=0
expect 1 "$silt" run "$scene" -q -o "$work/never" --worker "$failing" "$@"
says "gave up: LIGGGHTS: made to fail"
say "always failing: told"
