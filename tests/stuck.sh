#!/bin/sh
# A step that does not converge: exit code 1, a sentence with where and why, and a checkpoint of the state before the step.
# With more tries allowed the run goes on from there to the same bits as one that had them from the start.
# usage: stuck.sh SILT SCENE ITERATIONS [option of silt run]...
#   ITERATIONS  of a step, so few that a step somewhere needs another try
test_name=stuck
[ $# -ge 3 ] || { sed -n '4,5s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
silt=$1
scene=$2
iterations=$3
shift 3

# set KEY FROM TO: in the scene that a run left
set_key() {
    grep -q "^ *$1: $2\$" "$cut/scene.yaml" || fail "$cut/scene.yaml has no line \"$1: $2\""
    sed -i "s/^\\( *$1: \\)$2\$/\\1$3/" "$cut/scene.yaml"
}

last_step() {
    tail -n 1 "$1/history.csv" | cut -d, -f1
}

whole=$work/whole
expect 0 "$silt" run "$scene" -q -o "$whole" -D fluid.iterations="$iterations" "$@"
retries=$(sed -n 's/^ *"retries": \([0-9]*\),$/\1/p' "$whole/summary.json")
[ "$retries" -gt 0 ] || fail "no step needed a second try: fewer iterations are needed for this test"
say "with tries: $(rows "$whole") rows, $retries more tries"

# none allowed
cut=$work/cut
expect 1 "$silt" run "$scene" -q -o "$cut" -D fluid.iterations="$iterations" -D time.retries=0 "$@"
step=$(last_step "$cut")
says "^step $((step + 1)) at t = [0-9.e-]+ s gave up after 1 tries, the last with dt = [0-9.e-]+ s: .* at \\([0-9.e-]+, [0-9.e-]+\\)"
says "last checkpoint is of step $step, t = .* silt resume $cut"
grep -q '"status": "failed"' "$cut/summary.json" || fail "summary.json does not say failed"
no_parts "$cut"
say "without: $(head -n 1 "$work/last.say")"
expect 1 "$silt" resume "$cut" -q
says "^step $((step + 1)) at t = "
[ "$(last_step "$cut")" = "$step" ] || fail "the failed step left a row"
set_key retries 0 8
expect 0 "$silt" resume "$cut" -q
grep -q "^resumed at step $step," "$cut/run.log" || fail "the run did not go on at step $step"
same "$whole" "$cut"
say "tries allowed, resumed: the same bits"

# nothing helps: the first step fails, the start is kept
cut=$work/never
expect 1 "$silt" run "$scene" -q -o "$cut" -D fluid.iterations=1 -D fluid.tolerance=1e-30 "$@"
says '^step 1 at t = 0 s gave up after 9 tries'
says 'last checkpoint is of step 0, t = 0 s'
set_key iterations 1 "$iterations"
set_key tolerance 1e-30 1e-6
expect 0 "$silt" resume "$cut" -q
same "$whole" "$cut"
say "failed at the first step, mended, resumed: the same bits"
