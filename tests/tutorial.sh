#!/bin/sh
# The tutorial, word by word: its scenes are saved under the names in their first lines, its commands run in order.
# usage: tutorial.sh SILT TUTORIAL.md
test_name=tutorial
[ $# -eq 2 ] || { sed -n '3s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
PATH=$(dirname "$1"):$PATH
text=$(realpath "$2")
cd "$work"

# a file for every block: 001.yaml, 002.sh, ...
awk '/^```(yaml|sh)$/ { file = sprintf("%03d.%s", ++n, substr($0, 4)); next } /^```$/ { file = ""; next } file { print > file }' "$text"
blocks=0
commands=0
for block in [0-9][0-9][0-9].*; do
    blocks=$((blocks + 1))
    case $block in
    *.yaml)
        name=$(sed -n '1s/^# //p' "$block")
        [ -n "$name" ] || fail "$block has no name in its first line"
        cp "$block" "$name"
        ;;
    *.sh)
        while IFS= read -r line; do
            commands=$((commands + 1))
            # shellcheck disable=SC2086 # words as a shell makes them
            expect 0 sh -c "$line" </dev/null
        done <"$block"
        ;;
    esac
done
[ $blocks -ge 7 ] && [ $commands -ge 12 ] || fail "only $blocks blocks and $commands commands were found"
[ -s flood.out/picture_000010.png ] && [ -s sill.out/picture_000016.png ] && [ -s sill.out/report.html ] || fail "a picture or the report is missing"
[ "$(wc -l <study.out/study.csv)" -eq 4 ] || fail "the study has not three rows"
say "$blocks blocks, $commands commands"
