#!/bin/sh
# A step fails for good after bed, grains or bodies have gone on: the steps since the last checkpoint are made again, and the last state from
# which a run goes on to the same bits is saved. It is, byte by byte, the checkpoint of a run that is told to end there.
# usage: go_back.sh SILT SCENE FAILING_WORKER SILT_DEM RUNS [option of silt run]...
#   RUNS  of the worker, the last of which fails; no checkpoint is due before it
test_name=go_back
[ $# -ge 5 ] || { sed -n '4,5s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
silt=$1
scene=$2
failing=$3
SILT_FAIL_WORKER=$4
SILT_FAIL_FROM=$5
SILT_FAIL_MOST=0
export SILT_FAIL_WORKER SILT_FAIL_FROM SILT_FAIL_MOST
shift 5

whole=$work/whole
expect 0 "$silt" run "$scene" -q -o "$whole" "$@"
cut=$work/cut
expect 1 "$silt" run "$scene" -q -o "$cut" --worker "$failing" -D time.retries=0 "$@"
says "^step [0-9]+ at t = .* made to fail"
step=$(sed -n 's/^step \([0-9]*\) at .*/\1/p' "$work/last.say")
[ "$(rows "$cut")" -eq "$step" ] || fail "$(rows "$cut") rows of steps 0 to $((step - 1))"
saved=$(sed -n 's/^the last checkpoint is of step \([0-9]*\), .*/\1/p' "$work/last.say")
[ "${saved:-0}" -gt 0 ] && [ $((step - saved)) -le 16 ] || fail "the checkpoint is of step ${saved:-none}"
no_parts "$cut"
expect 0 "$silt" run "$scene" -q -o "$work/told" -D time.retries=0 -D time.steps="$saved" "$@"
cmp "$cut/checkpoint-a.h5" "$work/told/checkpoint-a.h5" || fail "the checkpoint is not that of a run that ends at step $saved"
say "step $step fails: step $saved is saved as it was"
sed -i 's/^\( *retries: \)0$/\18/' "$cut/scene.yaml"
expect 0 "$silt" resume "$cut" -q
same "$whole" "$cut"
say "resumed with another worker: the same bits"
