#!/bin/sh
# Writes the numbers that regression.sh holds a coupled scene against. Do so only when a change of the result is wanted, and
# say in the commit why the result changed.
# usage: regression_store.sh SILT SCENE STORED.csv [HORIZON]
# e.g.:  tests/regression_store.sh build/silt tests/scenes/hill.yaml tests/scenes/hill.csv
# HORIZON in s, by default that of the file that is there. Is it short enough? Build once more with -DSILT_NATIVE=ON, whose rounding is another, and run
# regression.sh with that silt: the largest difference must stay far below the tolerance.
test_name=regression_store
[ $# -ge 3 ] || { sed -n '4,5s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
horizon=${4:-$(sed -n 's/^# horizon: \([0-9.]*\) s.*/\1/p' "$3")}
[ -n "$horizon" ] || fail "$3 does not name its horizon: give one"

expect 0 "$1" run "$2" -q -o "$work/out" --until "$horizon"
# rows at the frames' times
sed -n 's/^ *{"name": .* "time": \([0-9.e-]*\)}.*/\1/p' "$work/out/fluid.hdf.series" >"$work/times"
{
    echo "# $(basename "$2") at its frames, for regression.sh; written by regression_store.sh"
    echo "# horizon: $horizon s"
    awk -F, -v space="$(grep -c '^dimension: 3' "$2")" '
        NR == FNR { frame[$1] = 1; next }
        FNR == 1 {
            m = split("time released_mass deposited_mass fed_mass left_mass bed_mass pore_water_mass inflow_mass outflow_mass " \
                "grain_count grain_mass grain_velocity_x grain_velocity_y grain_velocity_z grain_kinetic_energy grain_water_x " \
                "grain_water_y grain_water_z fluid_volume momentum_x momentum_y momentum_z kinetic_energy", wanted, " ")
            for (i = 1; i <= NF; i++) {
                place[$i] = i
                if ($i ~ /_qz$/) body = substr($i, 1, length($i) - 3)
            }
            if (body) { wanted[++m] = body "_x"; wanted[++m] = body "_y"; wanted[++m] = body "_qz" }
            # what the scene has; in the plane nothing goes along z
            for (i = 1; i <= m; i++) if (wanted[i] in place && (space || wanted[i] !~ /_z$/)) wanted[++n] = wanted[i]
            for (i = 1; i <= n; i++) printf "%s%s", wanted[i], i < n ? "," : "\n"
        }
        FNR > 1 && $place["time"] in frame { for (i = 1; i <= n; i++) printf "%s%s", $place[wanted[i]], i < n ? "," : "\n" }
    ' "$work/times" "$work/out/history.csv"
} >"$work/stored.csv"
[ "$(grep -vc '^#' "$work/stored.csv")" -eq $(($(wc -l <"$work/times") + 1)) ] || fail "not every frame has a row"
cp "$work/stored.csv" "$3"
say "$3: $(wc -l <"$work/times") rows"
