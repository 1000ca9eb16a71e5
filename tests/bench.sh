#!/bin/sh
# silt bench in small: the table comes, the JSON is whole, shares sum to 1, counts are positive; no time is held against a clock
# usage: bench.sh SILT
set -eu
silt=$1
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
"$silt" bench dam-2d,dam-3d,grains-1k,bed-2d --sizes 400,800 --steps 2 --warm-up 2 -q -o "$out/steps.json" >"$out/table"
"$silt" bench collapse-2d --sizes 4,6 -D time.end=0.05 -q -o "$out/whole.json" >>"$out/table"
"$silt" help bench >"$out/help"
for word in dam-2d collapse-2d --sizes; do grep -q -e "$word" "$out/help"; done
grep -q 'U2' "$out/table"
# what is wrong is told by name
! "$silt" bench nothing -q 2>"$out/err"
grep -q "no scene 'nothing'" "$out/err"
! "$silt" bench dam-2d --sizes many -q 2>"$out/err"
grep -q "the size 'many'" "$out/err"

python3 - "$out/steps.json" "$out/whole.json" <<'END'
import json
import sys

for path, rows in zip(sys.argv[1:], (8, 2)):
    data = json.load(open(path))["rows"]
    assert len(data) == rows, len(data)
    for row in data:
        name = row["scene"], row["size"]
        shares = [phase["share"] for phase in row["phases"].values()]
        assert abs(sum(shares) - 1) < 1e-6 and min(shares) >= 0, (name, shares)
        total = sum(phase["ns_per_node_step"] for phase in row["phases"].values())
        assert abs(total / row["ns_per_node_step"] - 1) < 1e-6, name
        for key in ("nodes", "cells", "steps", "threads", "ns_per_node_step", "mean_ns_per_node_step", "u1_ns_per_point",
                    "step_in_u1", "dt", "start_seconds", "peak_bytes_per_node"):
            assert row[key] > 0, (name, key, row[key])
        for key in ("iterations", "momentum_iterations", "pressure_iterations", "retries", "courant"):
            assert row[key] >= 0, (name, key, row[key])
        for phase in ("triangulate", "decide", "assemble", "factor", "solve", "move", "output"):
            assert row["phases"][phase]["ns_per_node_step"] > 0, (name, phase)
        assert (row["pressure_iterations"] > 0) == (row["dimension"] == 3), name
        if row["scene"] == "grains-1k":
            assert row["grains"] == 1000 and row["substeps"] >= 1, name
            assert row["phases"]["grains"]["share"] > 0 and row["phases"]["coupling"]["share"] > 0, name
        if row["scene"] == "bed-2d":
            assert row["phases"]["bed"]["share"] > 0, name
        if row["scene"] == "collapse-2d":
            assert row["u2_seconds"] > 0 and abs(row["model_seconds"] - 0.05) < 1e-9, name
            assert abs(row["seconds"] / row["model_seconds"] / row["u2_seconds"] / row["run_per_model_in_u2"] - 1) < 1e-6, name
            assert row["volume_error_early"] <= row["volume_error"] < 0.5, name
    for first, second in zip(data[::2], data[1::2]):
        assert first["growth"] is None and second["growth"] is not None
        assert second["nodes"] > 1.3 * first["nodes"]
END
