#!/bin/sh
# One, two and three threads: every row, frame and checkpoint has the same bits.
# usage: threads.sh SILT SCENE...
test_name=threads
[ $# -ge 2 ] || { sed -n '3s/^# //p' "$0" >&2; exit 2; }
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
    say "${scene##*/}: $(rows "$work/out1") rows, the same bits with one, two and three threads"
done
