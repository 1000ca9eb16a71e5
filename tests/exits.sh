#!/bin/sh
# Exit codes and the output folder: 0 done, 1 failed, 2 wrong usage or scene (3, stopped by a signal: signals.sh).
# usage: exits.sh SILT SCENE WRONG    (WRONG: a scene with an error)
test_name=exits
[ $# -eq 3 ] || { sed -n '3s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
silt=$1
scene=$2
wrong=$3
short="-q -D time.steps=3"

# wrong usage
expect 2 "$silt"
expect 2 "$silt" dance
expect 2 "$silt" run
expect 2 "$silt" run "$scene" --no-such-option
expect 2 "$silt" run "$scene" --threads 0 -o "$work/x"
expect 2 "$silt" run "$scene" --until soon -o "$work/x"
expect 2 "$silt" run "$scene" "$scene" -o "$work/x"
expect 2 "$silt" run "$scene" -D nonsense -o "$work/x"
expect 2 "$silt" resume "$work/absent"
expect 2 "$silt" resume "$scene"
expect 0 "$silt" --help
expect 0 "$silt" help fluid.size
expect 0 "$silt" check "$scene"
say "usage: 2"

# wrong scene: nothing is made
expect 2 "$silt" run "$wrong" -o "$work/x"
expect 2 "$silt" run "$work/absent.yaml" -o "$work/x"
expect 2 "$silt" run "$scene" -D fluid.size=-1 -o "$work/x"
says 'fluid.size'
[ ! -e "$work/x" ] || fail "a run that was refused made its folder"
say "scene: 2"

# the folder: made once, refused, replaced; what is not silt's stays
# shellcheck disable=SC2086 # words
expect 0 "$silt" run "$scene" -o "$work/out" $short
[ "$(rows "$work/out")" -eq 4 ] || fail "3 steps made $(rows "$work/out") rows"
cp "$work/out/history.csv" "$work/kept.csv"
# shellcheck disable=SC2086
expect 2 "$silt" run "$scene" -o "$work/out" $short
says 'exists already.*--force.*silt resume'
cmp -s "$work/kept.csv" "$work/out/history.csv" || fail "a run that was refused changed the folder"
for file in notes.txt fluid_000777.hdf fluid_000777.hdf.part picture_000777.png checkpoint-b.h5; do
    echo old >"$work/out/$file"
done
# shellcheck disable=SC2086
expect 0 "$silt" run "$scene" -o "$work/out" --force $short
same "$work/out" "$work/out"
plain "$work/kept.csv" >"$work/one.csv"
plain "$work/out/history.csv" | cmp -s - "$work/one.csv" || fail "the same run gave other bits"
grep -q old "$work/out/notes.txt" || fail "--force took a file that is not silt's"
for file in fluid_000777.hdf fluid_000777.hdf.part picture_000777.png; do
    [ ! -e "$work/out/$file" ] || fail "--force left $file of the run before"
done
[ ! -e "$work/out/checkpoint-b.h5" ] || fail "--force left a checkpoint of the run before"
say "folder: refused without --force, replaced with it"

# a file in its place; a place where none can be made
echo text >"$work/file"
expect 2 "$silt" run "$scene" -o "$work/file"
expect 2 "$silt" run "$scene" -o "$work/file" --force
grep -q text "$work/file" || fail "a file was overwritten"
expect 1 "$silt" run "$scene" -o "$work/file/out"
says 'cannot make the output folder'
expect 1 "$silt" run "$scene" -o "$work/absent/out"
expect 1 "$silt" run "$scene" -o /proc/silt
mkdir "$work/shut"
chmod 555 "$work/shut"
if [ "$(id -u)" -ne 0 ]; then
    expect 1 "$silt" run "$scene" -o "$work/shut/out"
    expect 1 "$silt" run "$scene" -o "$work/shut" --force
fi
chmod 755 "$work/shut"
say "folder that cannot be made: 1"

# resume of what is no run, and of a run without a checkpoint
mkdir "$work/empty"
expect 2 "$silt" resume "$work/empty"
cp -r "$work/out" "$work/bare"
rm -f "$work"/bare/checkpoint-?.h5
expect 1 "$silt" resume "$work/bare"
says 'no checkpoint to go on from'
cp -r "$work/out" "$work/torn"
head -n 2 "$work/out/history.csv" >"$work/torn/history.csv"
expect 1 "$silt" resume "$work/torn"
says 'ends at step 0, before the checkpoint'
cp -r "$work/out" "$work/other"
sed -i '1s/time/thyme/' "$work/other/history.csv"
expect 1 "$silt" resume "$work/other"
says 'header does not belong'
expect 2 "$silt" verify "$work/absent"
say "resume without a run: 2, without a checkpoint or its history: 1"
