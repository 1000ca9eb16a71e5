#!/bin/sh
# SIGUSR1: a checkpoint, and on. SIGTERM, or time.wall over: a checkpoint and exit code 3; resume goes on to the end, with the same bits.
# usage: signals.sh SILT SCENE ROWS [option of silt run]...
test_name=signals
[ $# -ge 3 ] || { sed -n '3s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
silt=$1
scene=$2
wanted=$3
shift 3

whole=$work/whole
expect 0 "$silt" run "$scene" -q -o "$whole" "$@"
say "left alone: $(rows "$whole") rows"

# no checkpoint is due before the signals: what is there is theirs
cut=$work/cut
launch "$silt" run "$scene" -q -o "$cut" -D time.checkpoint=1e9 "$@"
until_rows "$cut" $((wanted / 2))
kill -USR1 "$pid"
while [ ! -e "$cut/checkpoint-a.h5" ]; do
    alive "$pid" || fail "the run ended without a checkpoint after SIGUSR1"
    sleep 0.02
done
at=$(rows "$cut")
until_rows "$cut" "$wanted"
[ ! -e "$cut/checkpoint-b.h5" ] || fail "a second checkpoint appeared by itself"
say "SIGUSR1: a checkpoint near row $at, and on"

# a second run is refused while this one is going
expect 2 "$silt" resume "$cut" -q
says 'another silt is running in this folder'

kill -TERM "$pid"
finish
[ "$code" -eq 3 ] || fail "exit code $code after SIGTERM instead of 3"
grep -q "stopped by a signal at t = .* silt resume $cut" "$work/run.say" || fail "SIGTERM: no word of it"
grep -q '"status": "stopped"' "$cut/summary.json" || fail "summary.json does not say stopped"
[ -e "$cut/checkpoint-b.h5" ] || fail "no checkpoint after SIGTERM"
no_parts "$cut"
at=$(rows "$cut")
[ "$at" -lt "$(rows "$whole")" ] || fail "the run was over before SIGTERM"
expect 0 "$silt" resume "$cut" -q
grep -q "^resumed at step $((at - 1))," "$cut/run.log" || fail "the resumed run did not start at step $((at - 1))"
same "$whole" "$cut"
say "SIGTERM: stopped with $at rows, exit code 3, resumed: the same bits"

# time.wall: each process takes the one step that it must, or goes on to where a checkpoint may be taken
expect 0 "$silt" run "$scene" -q -o "$work/short" "$@" -D time.steps=12
expect 3 "$silt" run "$scene" -q -o "$work/legs" "$@" -D time.steps=12 -D time.wall=1e-6
says 'stopped since time.wall is over at t = '
legs=1
while [ "$code" -eq 3 ]; do
    legs=$((legs + 1))
    [ $legs -le 12 ] || fail "$legs processes for 12 steps"
    code=0
    "$silt" resume "$work/legs" -q >"$work/last.say" 2>&1 || code=$?
done
[ "$code" -eq 0 ] && [ $legs -gt 1 ] || fail "exit code $code after $legs processes"
same "$work/short" "$work/legs"
say "time.wall: 12 steps in $legs processes: the same bits"
