#!/bin/sh
# docs/performance.md: the tables of docs/performance.in.md measured anew, phases.csv and error-time.csv with their pictures too. The machine should be
# quiet; then it takes six minutes, and it goes on where it was stopped.
# usage: performance.sh SILT OUT [small]
#   OUT a folder for what was measured; small: one small size and few steps of each, the page goes to OUT: to try it
set -u
[ $# -ge 2 ] || { sed -n '4s/^# //p' "$0" >&2; exit 2; }
silt=$1 out=$2 small=${3:-}
docs=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd -P)
mkdir -p "$out" || exit 2
out=$(CDPATH='' cd -- "$out" && pwd -P)
to=$docs
[ -z "$small" ] || to=$out
bad=0
LC_ALL=C
export LC_ALL

# the output of a command, kept in OUT; a failed one leaves a line that says so
measure() {
    file=$out/$(printf '%s' "$*" | tr -c 'a-zA-Z0-9.\n' '-').txt
    if [ ! -e "$file" ]; then
        printf '%s\n' "$*" >&2
        # shellcheck disable=SC2048,SC2086 # words
        if "$silt" $* >"$file.part" 2>"$file.log"; then
            mv "$file.part" "$file"
        else
            printf '**failed**: silt %s: %s\n' "$*" "$(tail -n 1 "$file.log")"
            bad=1
            return
        fi
    fi
    sed 's/^/      /; s/ *$//' "$file"
}

# what the machine was, and how busy
machine() {
    printf '%s, %s processors; begun on %s at a load of %s; silt %s.\n' "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)" \
        "$(nproc)" "$(date -u '+%Y-%m-%d %H:%M UTC')" "$(cut -d ' ' -f 1 /proc/loadavg)" "$("$silt" --version | sed 's/^silt //')"
}

[ -e "$out/machine.txt" ] || machine >"$out/machine.txt"
# shellcheck disable=SC2094 # another file
while IFS= read -r line; do
    case $line in
    '{{machine}}') cat "$out/machine.txt" ;;
    '{{bench '*'}}')
        words=${line#'{{'}
        words=${words%'}}'}
        [ -z "$small" ] || words=$(printf '%s' "$words" | sed 's/--sizes [0-9k,]*/--sizes 2k/; s/\(collapse-..\) --sizes 2k/\1 --sizes 5/; s/--steps [0-9]*/--steps 2/; s/--warm-up [0-9]*/--warm-up 1/')
        measure "$words"
        ;;
    *) printf '%s\n' "$line" ;;
    esac
done <"$docs/performance.in.md" >"$out/page.md"
cat -s "$out/page.md" >"$to/performance.md"
rm "$out/page.md"

sizes=5k,10k,20k,40k,80k,160k
[ -z "$small" ] || sizes=2k,4k
[ -e "$out/phases.csv" ] || "$docs/../tests/phases.sh" "$silt" "$to/phases.svg" dam-3d "$sizes" 3 >"$out/phases.part" 2>"$out/phases.log" &&
    { [ -e "$out/phases.csv" ] || mv "$out/phases.part" "$out/phases.csv"; } || bad=1
[ -n "$small" ] || cp "$out/phases.csv" "$docs/phases.csv"
if [ -z "$small" ]; then
    [ -e "$out/error-time.csv" ] || { "$docs/../tests/curve.sh" "$silt" "$out/curve" "$docs/error-time.svg" >"$out/error-time.part" 2>"$out/curve.log" &&
        mv "$out/error-time.part" "$out/error-time.csv"; } || bad=1
    cp "$out/error-time.csv" "$docs/error-time.csv"
fi
exit $bad
