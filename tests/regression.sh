#!/bin/sh
# The coupled scene against the numbers that an earlier silt stored: what the bed gave and took, the grains' mean velocity, the
# temple's place, the water's volume and momentum, at every frame. The horizon ends before rounding, which is another on every
# processor, has grown into a difference (docs/testing.md). regression_store.sh writes the numbers anew.
# usage: regression.sh SILT SCENE STORED.csv
test_name=regression
[ $# -eq 3 ] || { sed -n '5s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"

horizon=$(sed -n 's/^# horizon: \([0-9.]*\) s.*/\1/p' "$3")
[ -n "$horizon" ] || fail "$3 does not name its horizon"
expect 0 "$1" run "$2" -q -o "$work/out" --until "$horizon"
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

# that the numbers are worth it: something was released and something deposited
awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) c[$i] = i } END { exit !($c["released_mass"] > 0 && $c["deposited_mass"] > 0 && $c["grain_count"] > 0) }' \
    "$work/stored.csv" || fail "$3 holds no release or no deposit"
