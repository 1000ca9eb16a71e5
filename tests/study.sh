#!/bin/sh
# silt study: a grid, that finished runs are kept, a plan and its collection, a search with a known answer, every way a run can end, no gnuplot.
# usage: study.sh SILT FOLDER    (FOLDER: with drop.yaml, grid.yaml, seek.yaml, statuses.yaml)
test_name=study
[ $# -eq 2 ] || { sed -n '3s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
silt=$1
cp -r "$2" "$work/in"
in=$work/in
out=$work/out

# column NAME FILE: its values, a line each; no comma stands in what is asked for here
column() {
    awk -F, -v name="$1" 'NR == 1 { for (k = 1; k <= NF; k++) if ($k == name) c = k } NR > 1 && c { print $c }' "$2"
}
same() {
    [ "$1" = "$2" ] || fail "$3: '$1' instead of '$2'"
}

# a grid on two processors: way is the speed times 0.1 s, exactly
expect 0 "$silt" study "$in/grid.yaml" -o "$out" -j 2
says '^4 runs: 4 ok'
same "$(column fluid.velocity.vector "$out/study.csv" | tr '\n' ' ')" '1 2 1 2 ' 'speeds'
same "$(column way_value "$out/study.csv" | awk '{ printf "%.3f ", $1 }')" '0.100 0.200 0.100 0.200 ' 'ways'
[ "$(ls "$out/runs" | grep -c 'out$')" -eq 0 ] || fail 'folders of runs are still there'
if command -v gnuplot >/dev/null; then
    for plot in order cost map; do
        grep -q '</svg>' "$out/$plot.svg" || fail "no plot $plot"
    done
fi
say 'a grid'

# what is there is not done again; what is lost or asks for other things is
touch -d '2001-01-01' "$out"/runs/*.row
rm "$out/runs/00003.row"
expect 0 "$silt" study "$in/grid.yaml" -o "$out"
same "$(find "$out/runs" -name '*.row' -newermt 2002-01-01 | wc -l)" 1 'runs done again'
sed -i 's/density: 1000/density: 900/' "$in/drop.yaml"
expect 0 "$silt" study "$in/grid.yaml" -o "$out"
same "$(find "$out/runs" -name '*.row' -newermt 2002-01-01 | wc -l)" 4 'runs of the changed scene'
say 'kept, and made anew'

# killed in the middle: no run is lost or half there
expect 0 "$silt" study "$in/grid.yaml" -o "$work/whole"
launch "$silt" study "$in/grid.yaml" -o "$work/cut" -D repeats=3
i=0
while [ ! -e "$work/cut/runs/00001-02.row" ] && [ $i -lt 500 ]; do sleep 0.01; i=$((i + 1)); done
kill -KILL "$pid"
wait "$pid" 2>/dev/null || true
[ ! -e "$work/cut/runs/00004-03.row" ] || fail 'it was done before it was killed'
expect 0 "$silt" study "$in/grid.yaml" -o "$work/cut" -D repeats=3
says '^12 runs: 12 ok'
same "$(column way_value "$work/cut/study.csv" | sort -u | tr '\n' ' ')" "$(column way_value "$work/whole/study.csv" | sort -u | tr '\n' ' ')" 'ways after the kill'
say 'killed and taken up'

# the plan's lines do the same
"$silt" study "$in/grid.yaml" -o "$work/plan" --plan >"$work/plan.sh"
same "$(wc -l <"$work/plan.sh")" 4 'lines of the plan'
[ ! -e "$work/plan" ] || fail 'a plan made a folder'
tail -n 2 "$work/plan.sh" >"$work/half.sh"
expect 0 sh "$work/half.sh"
expect 0 "$silt" study "$in/grid.yaml" -o "$work/plan" --collect
says '^2 runs of 4: 2 ok'
expect 0 sh "$work/plan.sh"
expect 0 "$silt" study "$in/grid.yaml" -o "$work/plan" --collect
same "$(column way_value "$work/plan/study.csv")" "$(column way_value "$work/whole/study.csv")" 'ways of the plan'
say 'plan and collect'

# without -o: the folder's name where the file is called study.yaml, else the file's; a plan's words go through a shell whatever stands in them
own="$work/it's own"
mkdir "$own" "$work/here"
cp "$in/drop.yaml" "$own"
cp "$in/grid.yaml" "$own/study.yaml"
(cd "$work/here" && "$silt" study "$own/study.yaml" --plan -D "title=what's odd; exit 9" >"$work/plan.sh")
same "$(wc -l <"$work/plan.sh")" 4 'lines of the plan with quotes'
expect 0 sh "$work/plan.sh"
same "$(ls "$work/here/it's own.study/runs" | tr '\n' ' ')" \
    '00001.log 00001.row 00002.log 00002.row 00003.log 00003.row 00004.log 00004.row ' 'files of the plan with quotes'
odd="what's odd; \`touch $work/here/ran\` & \"a_b\""
(cd "$work/here" && expect 0 "$silt" study "$own/study.yaml" -D "title='$(echo "$odd" | sed "s/'/''/g")'" --collect)
grep -qxF "## $odd" "$work/here/it's own.study/study.md" || fail 'another title'
[ ! -e "$work/here/ran" ] || fail 'gnuplot ran what stands in the title'
if command -v gnuplot >/dev/null; then
    says '^4 runs: 4 ok'
    ! grep -q gnuplot "$work/last.say" || fail 'gnuplot said something'
    for plot in order cost map; do
        grep -q "what's odd; .touch .* &amp; .*a_b" "$work/here/it's own.study/$plot.svg" || fail "no title in $plot"
    done
fi
(cd "$work/here" && expect 0 "$silt" study "$in/grid.yaml" -q)
[ -s "$work/here/grid.study/study.csv" ] || fail 'no folder of the name of the study'
say 'names without -o, quotes in a plan'

# a job's own process is killed: its run ends with it, and its row says what happened
launch "$silt" study "$in/grid.yaml" -o "$work/lost" -D 'vary=[{key: fluid.size, values: [0.25]}]' -D 'set=[time.step=1.0e-5, time.end=100]'
i=0
while [ "$(rows "$work/lost/runs/00001.out")" -lt 3 ] && [ $i -lt 500 ]; do sleep 0.02; i=$((i + 1)); done
job=$(children "$pid")
run=$(children "$job")
kill -KILL "$job"
finish
same "$code" 1 'exit code after a lost job'
same "$(awk -F'\t' '$1 == "status" { print $2 }' "$work/lost/runs/00001.row")" crashed 'end of a lost job'
grep -q 'ended by signal 9' "$work/lost/study.md" || fail 'study.md does not say that a job was lost'
! alive "$run" || fail 'the run of a lost job goes on'
say 'a lost job'

# speed = way / time: 0.5 m/s and 1 m/s
expect 0 "$silt" study "$in/seek.yaml" -o "$work/seek"
awk '/^sought: time.end 0.1,/ { for (k = 1; k < NF; k++) if ($k == "fluid.velocity.vector") a = $(k + 2) }
    /^sought: time.end 0.05,/ { for (k = 1; k < NF; k++) if ($k == "fluid.velocity.vector") b = $(k + 2) }
    END { exit !(a > 0.4995 && a < 0.5005 && b > 0.999 && b < 1.001) }' "$work/last.say" || fail 'another speed was found'
expect 0 "$silt" study "$in/seek.yaml" -o "$work/none" -D seek.value=100
says 'both ends of the range are on the same side'
# W_c of a bed that begins to leave after a given time: 0.7 J/m3 is exact, the time is met within 1 %
expect 0 "$silt" study "$2/onset.yaml" -o "$work/onset"
awk '/^sought: bed.work/ { found = $4 > 0.69 && $4 < 0.71 && $NF == "found" } END { exit !found }' "$work/last.say" || fail 'another W_c was found'
say 'a search'

# every end
expect 1 "$silt" study "$in/statuses.yaml" -o "$work/ends"
same "$(cat "$work"/ends/runs/*.row | awk -F'\t' '$1 == "status" { printf "%s ", $2 }')" 'ok refused unfinished wrong ' 'ends'
grep -q "fluid.density" "$work/ends/study.md" || fail 'study.md has no reason'
expect 1 "$silt" study "$in/grid.yaml" -o "$work/small" -D memory=0.03
says 'crashed|failed'
say 'ends of runs'

# usage; a folder of something else; no gnuplot
expect 2 "$silt" study "$in/absent.yaml" -o "$work/x"
expect 2 "$silt" study "$in/grid.yaml" -o "$work/x" --run 5
mkdir "$work/other"
touch "$work/other/file"
expect 2 "$silt" study "$in/grid.yaml" -o "$work/other"
says 'something else than the results of a study'
mkdir "$work/bare"
rm -f "$out"/*.svg
PATH=$work/bare expect 0 "$silt" study "$in/grid.yaml" -o "$out"
says 'gnuplot is not installed'
[ -s "$out/study.csv" ] || fail 'no study.csv without gnuplot'
say 'usage, no gnuplot'
