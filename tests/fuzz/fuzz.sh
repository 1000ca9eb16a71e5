#!/bin/sh
# fuzz.sh PROGRAM CORPUS MOST SECONDS SEED...: a fuzz target, first on the kept inputs (CORPUS and the files that match SEED), then on new
# ones of at most MOST bytes for SECONDS. What fails is left in the current folder as crash-*, leak-* or timeout-*: mend it, then keep it in CORPUS.
set -eu
program=$1 corpus=$2 most=$3 seconds=$4
shift 4
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/seeds" "$work/new"
for pattern; do
    # shellcheck disable=SC2086 # a pattern
    for file in $pattern; do
        [ ! -f "$file" ] || cp "$file" "$work/seeds/$(basename "$(dirname "$file")")-$(basename "$file")"
    done
done
[ ! -d "$corpus" ] || cp -r "$corpus/." "$work/seeds/"
[ -n "$(ls "$work/seeds")" ] || { echo "fuzz.sh: no seeds"; exit 1; }
# one by one: none of them may fail, whatever its size
UBSAN_OPTIONS=print_stacktrace=1 "$program" -timeout=20 "$work"/seeds/* > "$work/log" 2>&1 || { tail -60 "$work/log"; exit 1; }
dictionary=
[ ! -f "${corpus%/*}/${corpus##*/corpus-}.dict" ] || dictionary="-dict=${corpus%/*}/${corpus##*/corpus-}.dict"
# shellcheck disable=SC2086 # none or one word
UBSAN_OPTIONS=print_stacktrace=1 "$program" -max_len="$most" -max_total_time="$seconds" -timeout=20 -rss_limit_mb=2048 -close_fd_mask=1 \
    $dictionary "$work/new" "$work/seeds" > "$work/log" 2>&1 || { tail -60 "$work/log"; exit 1; }
# how many inputs; words of the leak checker may stand behind it
grep '^Done' "$work/log" || tail -3 "$work/log"
