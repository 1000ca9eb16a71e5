#!/bin/sh
# contact.trace: the largest force of an impact from the trace, with steps ten times as long as the impact's rise; a run that is taken up
# writes the same rows again, whatever it had written after its checkpoint
# usage: trace.sh SILT SCENE OUT
set -eu
rm -rf "$3" "$3.taken"
"$1" run "$2" -o "$3" -q -D contact.trace=true -D time.step=1.0e-5
# two spheres of glass (cases/contact): 10696.9 N, and nothing before and after
awk -F, 'NR == 1 { next } { if (-$2 > most) most = -$2; last = $2; rows++ }
    END { printf "%g N in %d rows, at the end %g\n", most, rows, last; exit !(most > 10696 && most < 10698 && last == 0 && rows == 390) }' "$3/trace.csv"

# killed behind its checkpoint: the rows up to there, others of later times than there are, the last one half there
"$1" run "$2" -o "$3.taken" -q -D contact.trace=true -D time.step=1.0e-5 --until 2.0e-5
rows=$(wc -l < "$3.taken/trace.csv")
[ "$rows" -gt 100 ] && [ "$rows" -lt 300 ] || { echo "$rows rows until the checkpoint"; exit 1; }
awk 'BEGIN { for (k = 0; k < 999; k++) print "4.0e-05,77,77,77"; printf "4.1e-05,7" }' >> "$3.taken/trace.csv"
cp -r "$3.taken" "$3.lost"
"$1" resume "$3.taken" -q
cmp "$3/trace.csv" "$3.taken/trace.csv" || { echo 'trace.csv of a run that is taken up has other rows'; exit 1; }

# without its file: the header and what comes from there on
rm "$3.lost/trace.csv"
"$1" resume "$3.lost" -q
sed "2,${rows}d" "$3/trace.csv" | cmp - "$3.lost/trace.csv" || { echo 'trace.csv that was lost does not go on from the checkpoint'; exit 1; }
rm -rf "$3.taken" "$3.lost"
