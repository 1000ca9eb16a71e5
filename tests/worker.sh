#!/bin/sh
# The LIGGGHTS worker is killed, and so is silt itself: a clear word, exit code 1, the last checkpoint whole, nothing left
# behind, and resume goes on to the same bits.
# usage: worker.sh SILT SCENE ROWS [option of silt run]...
test_name=worker
[ $# -ge 3 ] || { sed -n '4s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
silt=$1
scene=$2
wanted=$3
shift 3

# ours alone, so that other runs on the machine do not matter
TMPDIR=$work/tmp
export TMPDIR
mkdir "$TMPDIR"

whole=$work/whole
expect 0 "$silt" run "$scene" -q -o "$whole" "$@"

gone() {
    waited=0
    while alive "$1" || [ -e "/proc/$1" ]; do
        waited=$((waited + 1))
        [ "$waited" -le 250 ] || fail "process $1 is still there"
        sleep 0.02
    done
}

# what a worker with this pid could have left
nothing_left() {
    [ -z "$(ls "$TMPDIR")" ] || fail "left in TMPDIR: $(ls "$TMPDIR")"
    for file in /dev/shm/*"$1"* /tmp/*silt-dem*"$1"*; do
        [ ! -e "$file" ] || fail "left: $file"
    done
}

cut=$work/cut
launch "$silt" run "$scene" -q -o "$cut" "$@"
until_saved "$cut" "$wanted"
worker=$(children "$pid")
[ "$(echo "$worker" | wc -w)" -eq 1 ] || fail "the children of the run are: $worker"
tr '\0' ' ' <"/proc/$worker/cmdline" | grep -q silt-dem || fail "the child is not silt-dem"
kill -KILL "$worker"
finish
[ "$code" -eq 1 ] || fail "exit code $code after the worker's death instead of 1"
grep -q "LIGGGHTS worker (pid $worker) was killed by signal 9" "$work/run.say" || fail "no word of the worker's death"
grep -q "last checkpoint is of step .* silt resume $cut" "$work/run.say" || fail "no word of how to go on"
grep -q '"status": "failed"' "$cut/summary.json" || fail "summary.json does not say failed"
gone "$worker"
nothing_left "$worker"
no_parts "$cut"
say "worker killed with $(rows "$cut") rows: $(head -n 1 "$work/run.say" | cut -c1-80)"
expect 0 "$silt" resume "$cut" -q
same "$whole" "$cut"
say "resumed: the same bits"

# silt is killed: the worker sees it and ends
cut=$work/orphan
launch "$silt" run "$scene" -q -o "$cut" "$@"
until_saved "$cut" "$wanted"
worker=$(children "$pid")
kill_hard
gone "$worker"
nothing_left "$worker"
say "silt killed: the worker ended by itself"

# a worker that is not there, or is no worker
expect 1 "$silt" run "$scene" -q -o "$work/none" --worker "$work/no-such-program" "$@"
says 'cannot start the LIGGGHTS worker'
expect 1 "$silt" run "$scene" -q -o "$work/false" --worker /bin/false "$@"
says 'LIGGGHTS worker .* ended with exit code 1'
grep -q '"status": "failed"' "$work/false/summary.json" || fail "summary.json does not say failed"
say "no worker: exit code 1 and a word"
