#!/bin/sh
# One, two and three threads, and a run that stops at its second frame and goes on with others: every row and frame has the same
# bits, and so have the checkpoints.
# usage: threads.sh SILT SCENE...
test_name=threads
[ $# -ge 2 ] || { sed -n '4s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
silt=$1
shift

for scene in "$@"; do
    for threads in 1 2 3; do
        rm -rf "$work/out$threads"
        expect 0 "$silt" run "$scene" -q -o "$work/out$threads" --threads "$threads"
        [ "$threads" -gt 1 ] || continue
        same "$work/out1" "$work/out$threads"
        for file in "$work/out1"/checkpoint-?.h5; do
            cmp -s "$file" "$work/out$threads/${file##*/}" || fail "${file##*/} differs with $threads threads"
        done
    done
    until=$(sed -n 's/^time:.*output: \([0-9.e-]*\).*/\1/p' "$scene" | awk '{ print 2 * $1 }')
    rm -rf "$work/cut"
    expect 0 "$silt" run "$scene" -q -o "$work/cut" --threads 2 --until "$until"
    [ "$(rows "$work/cut")" -lt "$(rows "$work/out1")" ] || fail "--until $until ran to the end"
    expect 0 "$silt" resume "$work/cut" -q --threads 3
    same "$work/out1" "$work/cut"
    say "${scene##*/}: $(rows "$work/out1") rows, the same bits with one, two and three threads, and resumed"
done
