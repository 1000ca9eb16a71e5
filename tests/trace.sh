#!/bin/sh
# contact.trace: the largest force of an impact from the trace, with steps ten times as long as the impact's rise
# usage: trace.sh SILT SCENE OUT
set -eu
rm -rf "$3"
"$1" run "$2" -o "$3" -q -D contact.trace=true -D time.step=1.0e-5
# two spheres of glass (cases/contact): 10696.9 N, and nothing before and after
awk -F, 'NR == 1 { next } { if (-$2 > most) most = -$2; last = $2; rows++ }
    END { printf "%g N in %d rows, at the end %g\n", most, rows, last; exit !(most > 10696 && most < 10698 && last == 0 && rows == 390) }' "$3/trace.csv"
