#!/bin/sh
# A disk that is full in the middle of a run: exit code 1 with the reason, the last checkpoint is kept, and with room again
# resume goes on to the same bits. Mounts a small file system of its own; skipped (77) where that is not allowed.
# usage: full_disk.sh SILT SCENE SIZE [option of silt run]...
#   SIZE  of the disk, for example 1m: enough for the first checkpoint, not for the run
test_name=full_disk
[ $# -ge 3 ] || { sed -n '4,5s/^# //p' "$0" >&2; exit 2; }
if [ -z "${SILT_OWN_MOUNTS:-}" ]; then
    SILT_OWN_MOUNTS=yes
    export SILT_OWN_MOUNTS
    for way in '' --map-root-user; do
        # shellcheck disable=SC2086 # none or one word
        if unshare --mount $way sh -c 'mount -t tmpfs none /mnt' 2>/dev/null; then
            # shellcheck disable=SC2086
            exec unshare --mount $way "$0" "$@"
        fi
    done
    echo "full_disk: skipped, no file system can be mounted here"
    exit 77
fi
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
silt=$1
scene=$2
size=$3
shift 3

expect 0 "$silt" run "$scene" -q -o "$work/whole" "$@"

disk=$work/disk
mkdir "$disk"
trap 'umount -l "$disk" 2>/dev/null || true; leave' EXIT
mount -t tmpfs -o "size=$size" none "$disk"
expect 1 "$silt" run "$scene" -q -o "$disk/out" "$@"
says 'cannot be written.*(No space left|HDF5 refused)'
says "last checkpoint is of step .* silt resume $disk/out"
[ -e "$disk/out/checkpoint-a.h5" ] || fail "no checkpoint is left; a larger disk is needed for this test"
for file in "$disk"/out/*.part; do
    [ ! -e "$file" ] || fail "$file takes room for nothing"
done
say "full with $(rows "$disk/out") rows: $(head -n 1 "$work/last.say")"

# no room yet: the same again, and the checkpoint is still there
expect 1 "$silt" resume "$disk/out" -q
[ -e "$disk/out/checkpoint-a.h5" ] || fail "the checkpoint was lost"

mount -o remount,size=256m "$disk"
expect 0 "$silt" resume "$disk/out" -q
same "$work/whole" "$disk/out"
say "with room again: the same bits"

# a disk that cannot be written to
mount -o remount,ro "$disk"
expect 1 "$silt" run "$scene" -q -o "$disk/new" "$@"
expect 1 "$silt" run "$scene" -q -o "$disk/out" --force "$@"
expect 1 "$silt" resume "$disk/out" -q --until 100
same "$work/whole" "$disk/out"
say "read-only: exit code 1, nothing changed"
