#!/bin/bash
# Seconds of processor a step over the number of nodes, by what they go into: Figure 7 of Onate, Idelsohn, Celigueta, Rossi and Latorre
# ("Possibilities of the PFEM in computational mechanics", 2010) with this program's figures.
# usage: phases.sh SILT [PICTURE] [SCENE] [SIZES] [STEPS]
#   PICTURE an SVG (gnuplot); SCENE, SIZES, STEPS as of silt bench (dam-3d, 5k,10k,20k,40k,80k,160k, 4)
# The table goes to stdout: nodes, seconds a step of meshing, assembling, solving, and all else.
set -u
silt=$1 picture=${2:-} scene=${3:-dam-3d} sizes=${4:-5k,10k,20k,40k,80k,160k} steps=${5:-4}
LC_ALL=C
work=$(mktemp -d) || exit 2
trap 'rm -rf "$work"' EXIT

"$silt" bench "$scene" --sizes "$sizes" --steps "$steps" --warm-up 2 --threads 1 -o "$work/bench.json" >&2 || exit 1
awk '
    function put() { if (nodes) printf "%d,%.4g,%.4g,%.4g,%.4g\n", nodes, part["mesh"], part["assemble"], part["solve"], part["else"] }
    BEGIN {
        print "nodes,meshing,assembling,solving,else"
        split("triangulate decide heal book index refine handover", mesh, " ")
        split("assemble matrix", assemble, " ")
        split("momentum analyse factor apply solve", solve, " ")
        for (k in mesh) kind[mesh[k]] = "mesh"
        for (k in assemble) kind[assemble[k]] = "assemble"
        for (k in solve) kind[solve[k]] = "solve"
    }
    match($0, /"nodes": [0-9.e+]+/) {
        put()
        nodes = substr($0, RSTART + 9, RLENGTH - 9) + 0
        split("", part)
    }
    match($0, /^ *"[a-z]+": \{"ns_per_node_step": /) {
        split($0, word, "\"")
        name = word[2]
        ns = substr($0, RSTART + RLENGTH) + 0
        part[name in kind ? kind[name] : "else"] += ns * nodes * 1e-9
    }
    END { put() }' "$work/bench.json" | tee "$work/phases.csv"

[ -n "$picture" ] || exit 0
gnuplot <<EOF
set terminal svg size 900,400 background 'white'; set output '$picture'; set datafile separator ','
set multiplot layout 1,2
set key top left; set grid; set xlabel 'nodes'; set ylabel 'seconds of processor a step'; set format x '%.0s%c'
plot for [k = 2:5] '$work/phases.csv' using 1:k with linespoints pt k title columnheader(k)
set ylabel 'share of a step, %'; set logscale x; set yrange [0:60]; set key top right
plot for [k = 2:5] '$work/phases.csv' using 1:(100 * column(k) / (\$2 + \$3 + \$4 + \$5)) with linespoints pt k title columnheader(k)
EOF
