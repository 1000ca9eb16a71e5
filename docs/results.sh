#!/bin/sh
# docs/results.md and docs/validation.md: runs what is not there yet (every case at its own size, docs/results.runs, the studies beside the
# cases, the tests that the template names) and puts the figures into docs/results.in.md.
# usage: results.sh SILT BUILD OUT [gather]
#   SILT the program; BUILD its build folder, for ctest; OUT a folder for what is run, which goes on where it was stopped: about two hours
#   gather: run nothing, take what is there; what is not there is `not run` in the table
# Exit 1 when a run or a check failed. `ninja results` does this.
set -u
[ $# -ge 3 ] || { sed -n '4s/^# //p' "$0" >&2; exit 2; }
silt=$1 build=$2 out=$3 gather=${4:-}
docs=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd -P)
top=$docs/..
work=$(mktemp -d) || exit 2
trap 'rm -rf "$work"' EXIT
mkdir -p "$out" || exit 2
out=$(CDPATH='' cd -- "$out" && pwd -P)
bad=0
LC_ALL=C
export LC_ALL

# ---- runs
if [ -z "$gather" ]; then
    "$top/tests/validate.sh" "$silt" "$out" >"$out/validation.table" || bad=1
    grep -v '^#' "$docs/results.runs" | while read -r name scene set; do
        file=$out/$(printf '%s' "$name" | tr / -)
        grep -qs '"status": "done"' "$file.out/summary.json" && continue
        rm -rf "$file.out"
        printf '%s\n' "$name" >&2
        # shellcheck disable=SC2046 # words
        "$silt" run "$top/$scene" -q -o "$file.out" $(for key in $set; do printf ' -D %s' "$key"; done) >"$file.log" 2>&1
        "$silt" verify "$file.out" >"$file.checks" 2>&1
    done
    "$docs/studies.sh" "$silt" "$out" >"$out/studies.md" || bad=1
    # the tests that the template names
    tests=$(grep -o '| ctest [^|]*' "$docs/results.in.md" | sed 's/| ctest //; s/;.*//; s/, /\n/g; s/ *$//' | sort -u | sed 's/\(.*[^_]\)$/\1$/' | paste -sd '|')
    SILT_TELL=1 ctest --test-dir "$build" -V -R "^($tests)" >"$out/tests.log" 2>&1 || bad=1
fi

# ---- everything as: run:check, value, reference, error, tolerance, pass or FAIL
for file in "$out"/*.checks; do
    name=$(basename "$file" .checks)
    awk -v run="$name" 'NR > 1 && ($6 == "pass" || $6 == "FAIL") { print run ":" $1 "\t" $2 "\t" $3 "\t" $4 "\t" $5 "\t" $6 }' "$file"
done >"$work/figures"
[ ! -e "$out/tests.log" ] || awk '
    $1 == "Start" { sub(":", "", $2); name[$2] = $3 }
    match($0, /^[0-9]+: /) {
        run = name[substr($0, 1, RLENGTH - 2)]
        line = substr($0, RLENGTH + 1)
        n = split(line, told, "\t")
        if (n == 5 && told[1] == "told") {
            what = told[5]
            gsub(/[^A-Za-z0-9]+/, "_", what)
            sub(/_$/, "", what)
            d = told[2] - told[3]; d = d < 0 ? -d : d
            size = told[3] < 0 ? -told[3] : told[3]
            # of the same thing told many times the worst over what it may be
            key = run ":" what
            share = told[4] > 0 ? d / told[4] : d
            if (!(key in worst) || share > worst[key]) {
                worst[key] = share
                row[key] = key "\t" told[2] "\t" told[3] "\t" (size > 0 ? d / size : d) "\t" told[4] "\t" (d <= told[4] ? "pass" : "FAIL") "\t" d
            }
        } else if (split(line, cell, /[ ]+/) >= 6 && (cell[6] == "pass" || cell[6] == "FAIL"))
            print run ":" cell[1] "\t" cell[2] "\t" cell[3] "\t" cell[4] "\t" cell[5] "\t" cell[6]
    }
    END { for (key in row) print row[key] }' "$out/tests.log" >>"$work/figures"

# ---- {{FORMAT run:check ...}} in the template
awk -v studies="$out/studies.md" '
    function two(x) { return x == 0 ? "0" : sprintf(x >= 100 || x <= -100 ? "%.0f" : "%.2g", x) }
    function three(x) { return sprintf("%.3g", x) }
    function size(x) { return x < 0 ? -x : x }
    # the largest of the checks, or all one after the other
    function figure(format, list,    n, word, i, k, most, text, failed, met, plain, one) {
        n = split(list, word, " ")
        plain = sub(/x$/, "", format) # no target of this row
        most = -1
        for (i = 1; i <= n; i++) {
            k = word[i]
            gsub("/", "-", k)
            if (!(k in mark)) { absent++; return "not run" }
            used++
            one = mark[k] == "FAIL"
            failed += one
            met += !one
            if (format == "%" || format == "e") most = error[k] > most ? error[k] : most
            else if (format == "a" || format == "%a") most = apart[k] > most ? apart[k] : most
            else if (format == "w" || format == "w%") most = size(value[k]) > most ? size(value[k]) : most
            else if (format == "s") text = text (i > 1 ? ", " : "") sprintf("%s%s %%%s", one ? "**" : "", signed(k), one ? "**" : "")
            else if (format == "v") text = text (i > 1 ? "; " : "") (one ? "**" : "") three(value[k]) (one ? "**" : "")
        }
        missed += plain ? 0 : failed
        if (format == "met") return failed ? sprintf("**%d of %d missed**", failed, n) : n > 1 ? "all" : "yes"
        if (format == "s" || format == "v") return text
        text = two(format ~ /%/ ? 100 * most : most) (format ~ /%/ ? " %" : "")
        return failed && !plain ? "**" text "**" : text
    }
    function signed(k,    x) {
        x = reference[k] != 0 ? 100 * (value[k] - reference[k]) / size(reference[k]) : 100 * value[k]
        return sprintf(size(x) >= 100 ? "%+.0f" : "%+.2g", x)
    }
    NR == FNR { split($0, f, "\t"); value[f[1]] = f[2]; reference[f[1]] = f[3]; error[f[1]] = f[4]; mark[f[1]] = f[6]; apart[f[1]] = f[7]; all++; next }
    { sub("docs/results.in.md", "docs/results.in.md") }
    /^{{include/ { while ((getline line <studies) > 0) print line; next }
    /^{{summary}}/ {
        printf "%d figures of %d runs and comparisons of tests; %d of them miss their target", used, all, missed
        printf absent ? ", %d were not run.\n" : ".\n", absent
        next
    }
    {
        while (match($0, /{{[^}]*}}/)) {
            inside = substr($0, RSTART + 2, RLENGTH - 4)
            format = inside
            sub(/ .*/, "", format)
            sub(/^[^ ]* /, "", inside)
            $0 = substr($0, 1, RSTART - 1) figure(format, inside) substr($0, RSTART + RLENGTH)
        }
        print
    }' "$work/figures" "$docs/results.in.md" >"$work/results.md" || exit 2
mv "$work/results.md" "$docs/results.md"

# ---- every check of every case
{
    cat <<'EOF'
# Validation

Every check of every case at its own size, and of the runs of `docs/results.runs`, made by `ninja results` (`docs/results.sh`); `ninja validate` makes the
cases' alone. What the figures mean stands in [results.md](results.md) and beside the cases.

| scene | check | value | reference | error | allowed | |
|---|---|---|---|---|---|---|
EOF
    for file in "$out"/*.checks; do
        awk -v name="$(basename "$file" .checks)" '
            NR > 1 && ($6 == "pass" || $6 == "FAIL") {
                note = $0; sub(/.*(pass|FAIL) */, "", note)
                printf "| %s | %s | %s | %s | %s | %s | %s%s |\n", name, $1, $2, $3, $4, $5, $6 == "FAIL" ? "**missed**" : "met", note == "" ? "" : " " note
            }' "$file"
    done
} >"$docs/validation.md"
exit $bad
