#!/bin/sh
# A run whose ledgers end beyond the scene's bounds says so: last line on the terminal, run.log, summary.json, `silt verify`; one
# within them does not, and one taken up from a checkpoint still knows.
# usage: bounds.sh SILT SCENE    (SCENE: 2 by 4 cells of water that collapse into a film)
test_name=bounds
[ $# -eq 2 ] || { sed -n '4s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
silt=$1
scene=$2
still='-D fluid.inlets.0.velocity=[0,0]'

# shellcheck disable=SC2086 # words
expect 0 "$silt" run "$scene" $still -o "$work/out"
says 'beyond its bounds: the water.s volume was off by up to [5-9].*bounds.volume allows 5 %'
grep -q 'beyond its bounds: the water' "$work/out/run.log" || fail "run.log does not tell of it"
grep -q '"beyond": \["volume"\]' "$work/out/summary.json" || fail "summary.json does not tell of it: $(grep '"bounds"' "$work/out/summary.json")"
expect 1 "$silt" verify "$work/out"
says 'bounds.volume .*FAIL'
say "told of: run, log, summary, verify"

# what it did before it was taken up counts
# shellcheck disable=SC2086
expect 0 "$silt" run "$scene" $still -D bounds.volume=1e-9 -q -o "$work/half" --until 0.1
expect 0 "$silt" resume "$work/half" --until 0.2
says 'beyond its bounds'
sed 's/.*volume was off by up to \([0-9.e-]*\) %.*/\1/;t;d' "$work/half/run.log" | tail -n 1 >"$work/worst"
awk -F, -v told="$(cat "$work/worst")" 'NR == 1 { for (i = 1; i <= NF; i++) if ($i == "volume_error") c = i; next }
    { e = $c < 0 ? -$c : $c; if (e > most) most = e }
    END { d = 100 * most - told; exit !(told > 0 && d < 0.005 * told && d > -0.005 * told) }' "$work/half/history.csv" ||
    fail "told $(cat "$work/worst") %, history.csv has another"

# shellcheck disable=SC2086
expect 0 "$silt" run "$scene" $still -D bounds.volume=0.2 -o "$work/wide"
grep -q 'beyond its bounds' "$work/wide/run.log" && fail "told of what its bounds allow"
grep -q '"beyond": \[\]' "$work/wide/summary.json" || fail "summary.json: $(grep '"bounds"' "$work/wide/summary.json")"
expect 0 "$silt" verify "$work/wide"
say "not told of: within wider bounds"

# wrong bounds are refused
expect 2 "$silt" run "$scene" -D bounds.energy=0 -o "$work/x"
says "key 'bounds.energy': found '0', allowed a number, > 0"
