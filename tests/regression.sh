#!/bin/sh
# A coupled scene against the numbers that an earlier silt stored: what the bed gave and took, the grains' mean velocity, a
# body's place, the water's volume and momentum, at every frame. The horizon ends before rounding, which is another on every
# processor, has grown into a difference (docs/testing.md). regression_store.sh writes the numbers anew.
# usage: regression.sh SILT SCENE STORED.csv PART... [until=T]
#   PART   a column that must be more than nought in the last stored row: what the scene is there to hold
#   T      the run is ended at this time and taken up from its checkpoint
test_name=regression
[ $# -ge 4 ] || { sed -n '5,7s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"

horizon=$(sed -n 's/^# horizon: \([0-9.]*\) s.*/\1/p' "$3")
[ -n "$horizon" ] || fail "$3 does not name its horizon"
parts=
until=
for word in "$@"; do
    case $word in
    until=*) until=${word#until=} ;;
    "$1" | "$2" | "$3") ;;
    *) parts="$parts $word" ;;
    esac
done
if [ -n "$until" ]; then
    expect 0 "$1" run "$2" -q -o "$work/out" --until "$until"
    expect 0 "$1" resume "$work/out" -q --until "$horizon"
else
    expect 0 "$1" run "$2" -q -o "$work/out" --until "$horizon"
fi
grep -v '^#' "$3" >"$work/stored.csv"

# both tables by column name; the difference in shares of the column's largest number
awk -F, -v tolerance=1e-6 '
    function magnitude(x) { return x < 0 ? -x : x }
    NR == FNR && FNR == 1 { for (i = 1; i <= NF; i++) name[i] = $i; columns = NF; next }
    NR == FNR { n++; for (i = 1; i <= NF; i++) { value[n, i] = $i + 0; if (magnitude($i) > most[i]) most[i] = magnitude($i) } next }
    FNR == 1 { for (i = 1; i <= NF; i++) place[$i] = i
        for (i = 1; i <= columns; i++) if (!(name[i] in place)) { print "no column " name[i]; bad = 1; exit } next }
    row < n && $place["time"] > value[row + 1, 1] - 1e-9 {
        row++
        for (i = 1; i <= columns; i++) {
            apart = magnitude($place[name[i]] - value[row, i]) / (most[i] > 0 ? most[i] : 1)
            if (apart > worst) { worst = apart; where = name[i] " at " value[row, 1] " s: " $place[name[i]] ", stored " value[row, i] }
        }
    }
    END {
        if (!bad && row < n) { print row " of " n " stored rows were reached"; bad = 1 }
        printf "largest difference %.2g (%s), tolerance %g\n", worst, where, tolerance
        exit bad || worst > tolerance
    }' "$work/stored.csv" "$work/out/history.csv" >"$work/awk.say" 2>&1 || fail "$(cat "$work/awk.say")"
say "$(cat "$work/awk.say")"

# that the numbers are worth it
awk -F, -v parts="$parts" 'NR == 1 { for (i = 1; i <= NF; i++) c[$i] = i; next } { last = $0 }
    END { split(last, value, ","); n = split(parts, part, " ")
        for (i = 1; i <= n; i++) if (!(part[i] in c) || !(value[c[part[i]]] > 0)) { print part[i]; exit 1 } }' \
    "$work/stored.csv" >"$work/part" || fail "$3 holds no $(cat "$work/part")"
