# What the tests of the whole program share; sourced by them, with `test_name` set. sh, no program beyond Debian's base.
set -eu

work=$(mktemp -d)
pids= # of what was started and may still run

leave() {
    for pid in $pids; do
        kill -KILL "$pid" 2>/dev/null || true
        wait "$pid" 2>/dev/null || true
    done
    rm -rf "$work"
}
trap leave EXIT
trap 'exit 130' INT TERM

say() {
    printf '%s: %s\n' "$test_name" "$*"
}

fail() {
    say "FAILED: $*" >&2
    for file in "$work"/*.say; do
        [ ! -s "$file" ] || { printf -- '--- %s\n' "$file" >&2; tail -n 20 "$file" >&2; }
    done
    exit 1
}

# expect CODE COMMAND...: runs it, its words go to $work/last.say
expect() {
    expected=$1
    shift
    code=0
    "$@" >"$work/last.say" 2>&1 || code=$?
    [ "$code" -eq "$expected" ] || fail "exit code $code instead of $expected: $*"
}

# says PATTERN: the last command said so
says() {
    grep -qE -- "$1" "$work/last.say" || fail "nothing like \"$1\" was said"
}

# launch COMMAND...: in the background, its words go to $work/run.say; sets pid
launch() {
    "$@" >"$work/run.say" 2>&1 &
    pid=$!
    pids="$pids $pid"
}

# running and not a zombie that waits for its parent
alive() {
    [ -r "/proc/$1/status" ] && ! grep -q '^State:[[:space:]]*[ZX]' "/proc/$1/status" 2>/dev/null
}

# pids of the children of a process
children() {
    grep -ls "^PPid:[[:space:]]*$1\$" /proc/[0-9]*/status | cut -d/ -f3 || true
}

# finish: waits for what was launched; sets code
finish() {
    code=0
    wait "$pid" 2>/dev/null || code=$?
}

# rows OUT: whole rows of history.csv, without its header
rows() {
    if [ -e "$1/history.csv" ]; then
        echo $(($(wc -l <"$1/history.csv") - 1))
    else
        echo 0
    fi
}

# until_rows OUT N: waits until history.csv has N rows while the launched run is alive
until_rows() {
    while [ "$(rows "$1")" -lt "$2" ]; do
        alive "$pid" || fail "the run ended before step $2 was there"
        sleep 0.02
    done
}

# until_saved OUT N: waits until there are a checkpoint and N rows
until_saved() {
    while [ ! -e "$1/checkpoint-a.h5" ] || [ "$(rows "$1")" -lt "$2" ]; do
        alive "$pid" || fail "the run ended before it had a checkpoint and $2 rows"
        sleep 0.02
    done
}

# kill_hard: kill -9 of what was launched
kill_hard() {
    kill -KILL "$pid" 2>/dev/null || true
    finish
    [ "$code" -eq 137 ] || fail "the run was over (exit $code) before it could be killed"
}

# one line per row without the columns of the wall clock
plain() {
    awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) keep[i] = $i !~ /^wall_/ }
        { line = ""; for (i = 1; i <= NF; i++) if (keep[i]) line = line "," $i; print line }' "$1"
}

# same OUT OUT: the same bits in every row, in every frame and in the states of run.log
same() {
    plain "$1/history.csv" >"$work/one.csv"
    plain "$2/history.csv" >"$work/two.csv"
    if ! cmp -s "$work/one.csv" "$work/two.csv"; then
        awk -F, 'NR == FNR { row[FNR] = $0; next }
            FNR == 1 { split($0, name, ",") }
            $0 != row[FNR] { n = split(row[FNR], a, ","); m = split($0, b, ",")
                printf "row %d differs (%d and %d columns):", FNR, n, m
                for (i = 1; i <= n || i <= m; i++) if (a[i] != b[i] && ++shown < 8) printf " %s %s %s;", name[i], a[i], b[i]
                print ""; exit }' "$work/one.csv" "$work/two.csv" >&2
        fail "$1 and $2: $(wc -l <"$work/one.csv") and $(wc -l <"$work/two.csv") rows, they differ"
    fi
    for file in "$1"/*_[0-9][0-9][0-9][0-9][0-9][0-9].hdf; do
        cmp -s "$file" "$2/${file##*/}" || fail "${file##*/} differs"
    done
    # the last state of every frame: frames after a checkpoint were written twice by a run that was killed
    for out in "$1" "$2"; do
        sed -n 's/^frame \([0-9]*\) .* state \([0-9a-f]*\)$/\1 \2/p' "$out/run.log" |
            awk '{ state[$1] = $2 } END { for (k in state) print k, state[k] }' | sort
    done >"$work/states"
    [ "$(sort "$work/states" | uniq -u | wc -l)" -eq 0 ] || fail "the states in run.log differ"
}

# a checkpoint is never left half written beside a whole one of the same name
no_parts() {
    for file in "$1"/*.part; do
        [ ! -e "$file" ] || fail "$file was left"
    done
}
