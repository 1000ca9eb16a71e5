#!/bin/sh
# What water alone pays for parts that it does not use, counted by valgrind's callgrind, not timed: in the loop no function of such a part
# is called for nodes, cells or facets, only a few times a step to ask whether the part is there; at the start as little.
# usage: lean.sh SILT PLAIN FULL
# PLAIN: a scene of water alone in laminar flow between walls of slip. FULL: one with some of the parts, to see that they would be seen.
# Both are run for 5 and for 15 steps; what the ten more call is the loop's. Functions are told apart by their files' objects in the
# build folder; one that the compiler has put into another is seen in the other one only.
test_name=lean
[ $# -eq 3 ] || { sed -n '4s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
silt=$1
plain=$2
full=$3
build=$(dirname "$silt")
command -v valgrind >/dev/null && command -v nm >/dev/null || { say "valgrind or nm is not there: skipped"; exit 77; }
export OMP_NUM_THREADS=1 GOMP_SPINCOUNT=2000 # set, the program does not begin once more

# objects of the parts that a plain scene has not; level.c: of fluid and of run
optional=' turbulence eddy rheology wall_law tension air pocket level seepage seep bed bed_mesh bed_store bed_fill bed_space bed_law bed_cover bed_slope
 bed_deposit bed_others bed_grow solid solid_mesh gmsh gmsh_module grains bodies uplift sediment feed gauge_grains verify_grains formula '
# FUNCTION OBJECT, those of the coupling under the object "coupling"; a name that a needed object has too is no sign
{
    nm --defined-only "$build/pfem/libsilt_pfem.a" "$build/pfem/libsilt_run.a" 2>/dev/null
    echo coupling:
    nm --defined-only "$build/dem-coupling/libsilt_coupling.a" 2>/dev/null | sed 's/.*:$/coupling.c.o:/'
} | awk -v optional="$(echo "$optional" | tr '\n' ' ') coupling " '
    /:$/ { object = $1; sub(/\.c.*/, "", object); next }
    $2 ~ /^[tTi]$/ { if (index(optional, " " object " ")) part[$3] = object; else needed[$3] = 1 }
    END { for (name in part) if (!(name in needed)) print name, part[name] }' >"$work/parts"
[ "$(wc -l <"$work/parts")" -gt 100 ] || fail "only $(wc -l <"$work/parts") functions of optional parts found in $build"

# look SCENE STEPS: FUNCTION CALLS INSTRUCTIONS of a run, into $work/seen.STEPS
look() {
    expect 0 valgrind --tool=callgrind --callgrind-out-file="$work/out" "$silt" run "$1" -q --force -o "$work/run" \
        -D time.step=1.0e-4 -D time.output=1 -D "time.end=$(echo "$2" | awk '{ printf "%.4f", 1e-4 * $1 }')"
    awk 'function full(text,  id) { id = text; sub(/\).*/, ")", id); if (length(text) > length(id)) name[id] = substr(text, length(id) + 2)
             return name[id] }
        /^fn=/ { sub(/^fn=/, ""); f = full($0); next }
        /^cfn=/ { sub(/^cfn=/, ""); c = full($0); next }
        /^calls=/ { sub(/^calls=/, ""); split($0, n, " "); calls[c] += n[1]; inner = 1; next }
        /^[0-9+*-]/ { if (inner) inner = 0; else { self[f] += $2; calls[f] += 0 } }
        END { for (f in calls) { name_ = f; sub(/\047.*/, "", name_); a[name_] += calls[f]; b[name_] += self[f] }
              for (f in a) print f, a[f], b[f] + 0 }' "$work/out" >"$work/seen.$2"
}

# weigh SCENE: into $work/sum "loop ALL PARTS MOST-CALLS-PER-STEP ITS-FUNCTION start ALL PARTS", instructions
weigh() {
    look "$1" 5
    look "$1" 15
    awk -v parts="$work/parts" -v few="$work/seen.5" '
        BEGIN { while ((getline <parts) > 0) part[$1] = $2
                while ((getline <few) > 0) { calls[$1] = $2; self[$1] = $3 } }
        { more = $3 - self[$1]; all += more; start_all += self[$1] - more / 2
          if (!($1 in part)) next
          own += more; start_own += self[$1] - more / 2
          if (($2 - calls[$1]) / 10 > most) { most = ($2 - calls[$1]) / 10; who = part[$1] "/" $1 } }
        END { printf "loop %d %d %d %s start %d %d\n", all, own, most, who == "" ? "none" : who, start_all, start_own }' \
        "$work/seen.15" >"$work/sum"
    say "$(basename "$1"): $(cat "$work/sum")"
    # shellcheck disable=SC2046 # words
    set -- $(cat "$work/sum")
    all=$2 own=$3 most=$4 who=$5 start_all=$7 start_own=$8
}

weigh "$full"
[ "$most" -gt 100 ] || fail "the parts of $full are not seen: $who is called most, $most times a step"
[ "$own" -gt $((all / 100)) ] || fail "the parts of $full are not seen: $own of $all instructions"
weigh "$plain"
[ "$most" -le 10 ] || fail "water alone calls $who $most times a step"
[ "$own" -le $((all / 10000)) ] || fail "parts that are not there take $own of the loop's $all instructions"
[ "$start_own" -le $((start_all / 10000)) ] || fail "parts that are not there take $start_own of the start's $start_all instructions"
say "ok: of ten steps' $all instructions $own ask for parts that are not there, of the start's $start_all $start_own"
