#!/bin/sh
# A run that is killed and resumed ends with the same bits as one that is left alone, whatever it is killed at.
# usage: resume.sh SILT SCENE ROWS UNTIL [option of silt run]...
#   ROWS   rows of history.csv after which the run is killed; a checkpoint must be there by then
#   UNTIL  a time at which a checkpoint is due, before the end
# e.g.:  resume.sh build/silt cases/dam-break/scene.yaml 150 0.2 -D fluid.size=0.004 -D time.end=0.3
test_name=resume
[ $# -ge 4 ] || { sed -n '3,6s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
silt=$1
scene=$2
wanted=$3
until=$4
shift 4

whole=$work/whole
expect 0 "$silt" run "$scene" -q -o "$whole" --threads 1 "$@"
say "left alone, one thread: $(rows "$whole") rows"

# two threads
expect 0 "$silt" run "$scene" -q -o "$work/two" --threads 2 "$@"
same "$whole" "$work/two"
say "two threads: the same bits"

# killed, resumed with another number of threads
cut=$work/cut
launch "$silt" run "$scene" -q -o "$cut" --threads 1 "$@"
until_saved "$cut" "$wanted"
kill_hard
at=$(rows "$cut")
cp -rp "$cut" "$work/twice"
cp -rp "$cut" "$work/damaged"
expect 0 "$silt" resume "$cut" -q --threads 2
same "$whole" "$cut"
no_parts "$cut"
say "killed with $at rows, resumed: the same bits"

# resumed once more: there is nothing left to do, and nothing changes
cp "$cut/history.csv" "$work/before.csv"
expect 0 "$silt" resume "$cut" -q
cmp -s "$work/before.csv" "$cut/history.csv" || fail "resuming a finished run changed its history"
say "resumed when finished: nothing changed"

# killed again after the resume
cut=$work/twice
launch "$silt" resume "$cut" -q
until_rows "$cut" $((at + 5))
kill_hard
expect 0 "$silt" resume "$cut" -q
same "$whole" "$cut"
say "killed and resumed twice: the same bits"

# the newest checkpoint is cut short: the older one serves, or the run says that none is left
cut=$work/damaged
newest=$cut/checkpoint-a.h5
oldest=$cut/checkpoint-b.h5
if [ -e "$oldest" ] && [ "$oldest" -nt "$newest" ]; then
    newest=$oldest
    oldest=$cut/checkpoint-a.h5
fi
size=$(wc -c <"$newest")
head -c $((size / 2)) "$newest" >"$work/half"
if [ ! -e "$oldest" ]; then
    mv "$newest" "$work/kept"
    cp "$work/half" "$newest"
    expect 1 "$silt" resume "$cut" -q
    says 'no checkpoint to go on from'
    mv "$work/kept" "$oldest"
fi
cp "$work/half" "$newest"
expect 0 "$silt" resume "$cut" -q
grep -q "from ${oldest##*/}; passed over: .*${newest##*/}" "$cut/run.log" || fail "run.log does not say that ${newest##*/} was passed over"
same "$whole" "$cut"
say "newest checkpoint cut short: the older one gave the same bits"

# a run that was asked for less is finished, then taken further
expect 0 "$silt" run "$scene" -q -o "$work/until" --until "$until" "$@"
[ "$(rows "$work/until")" -lt "$(rows "$whole")" ] || fail "--until $until ran to the end"
expect 0 "$silt" resume "$work/until" -q
same "$whole" "$work/until"
say "finished at $until s, taken further: the same bits"

# killed while a checkpoint is being written: what is half written does not count. A checkpoint per frame, so that the
# moment comes soon; when checkpoints are written has no influence on the bits either
cut=$work/writing
# a run that was over before its moment came is started again
for again in 1 2 3 4 5; do
    rm -rf "$cut"
    launch "$silt" run "$scene" -q -o "$cut" -D time.checkpoint=1e-9 "$@"
    until_saved "$cut" $((wanted / 2))
    until [ -e "$cut/checkpoint-a.h5.part" ] || [ -e "$cut/checkpoint-b.h5.part" ]; do
        kill -0 "$pid" 2>/dev/null || break
    done
    kill -KILL "$pid" 2>/dev/null || true
    finish
    [ "$code" -ne 137 ] || break
done
[ "$code" -eq 137 ] || fail "the run was over (exit $code) before it could be killed, $again times"
part=$(ls "$cut" | grep '^checkpoint-.*part$' || true)
expect 0 "$silt" resume "$cut" -q
same "$whole" "$cut"
no_parts "$cut"
say "killed while writing (${part:-just behind it}): the same bits"

# with one of the two checkpoints gone
cut=$work/until
rm "$cut/checkpoint-a.h5"
expect 0 "$silt" resume "$cut" -q
same "$whole" "$cut"
rm "$cut"/checkpoint-?.h5
expect 1 "$silt" resume "$cut" -q
says 'no checkpoint to go on from'
say "one checkpoint is enough, none is an error"
