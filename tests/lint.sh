#!/bin/sh
# lint.sh BUILD [cppcheck] [tidy] [analyzer]: what reads the code without running it, over pfem and dem-coupling; without a name all three.
# BUILD: configured with -DCMAKE_EXPORT_COMPILE_COMMANDS=ON. A finding is "TOOL FILE CHECK LINE"; those whose first three words stand in
# tests/lint.txt are explained there and passed over, any other one is printed and makes the exit code 1. By hand: it takes minutes.
# LINT_FILES="FILE..." in the environment: only these; LINT_JOBS: so many of clang-tidy at a time; LINT_SECONDS: what the analyzer may take for a file (300).
set -eu
build=$1
shift
[ $# -gt 0 ] || set -- cppcheck tidy analyzer
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd -P)
cd "$root"
[ -f "$build/compile_commands.json" ] || { echo "lint.sh: $build has no compile_commands.json: cmake $build -DCMAKE_EXPORT_COMPILE_COMMANDS=ON"; exit 2; }
files=${LINT_FILES:-$(find pfem dem-coupling -name '*.c' | sort)}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
: > "$work/found"
includes=-Iinclude\ -Ipfem
for room in pfem/*/; do
    includes="$includes -I$room"
done

# what gcc and clang print: FILE:LINE:COLUMN: warning: TEXT [CHECK]
collect() {
    sed -n "s#^$root/##; s#^\([^: ]*\):\([0-9]*\):[0-9]*: \(warning\|error\): .*\[\([^]]*\)\]\$#$1 \1 \4 \2#p" "$2" >> "$work/found"
    ! grep -q ' warning: .*]$' "$2" || grep -q "^$1 " "$work/found" || { echo "lint.sh: what $1 says is not understood"; exit 2; }
}

for tool; do
    command -v "$(case $tool in tidy) echo clang-tidy ;; analyzer) echo gcc ;; *) echo "$tool" ;; esac)" > /dev/null ||
        { echo "lint.sh: $tool is not there: not run"; continue; }
    case $tool in
    cppcheck)
        # shellcheck disable=SC2086 # a list of words
        cppcheck --enable=warning,performance,portability --std=c11 $includes --suppress=missingIncludeSystem -q \
            --template='{file} {id} {line}' --template-location='' ${LINT_FILES:-pfem dem-coupling} 2> "$work/out" || true
        sed -n 's/^[^ ]* [^ ]* [0-9]*$/cppcheck &/p' "$work/out" >> "$work/found"
        ;;
    tidy)
        echo "$files" | xargs -n 4 -P "${LINT_JOBS:-1}" clang-tidy -p "$build" --quiet > "$work/out" 2> /dev/null || true
        collect tidy "$work/out"
        ;;
    analyzer)
        for file in $files; do
            command=$(/usr/bin/python3 -c 'import json, sys
for entry in json.load(open(sys.argv[1])):
    if entry["file"] == sys.argv[2]:
        print(entry["command"].split(" -o ")[0])
        break' "$build/compile_commands.json" "$root/$file")
            [ -n "$command" ] || continue
            # so many seconds of its own time, whatever else runs
            (cd "$build" && ulimit -t "${LINT_SECONDS:-300}" && $command -O1 -Wno-error -fanalyzer -S -o /dev/null "$root/$file") > "$work/out" 2>&1 ||
                echo "analyzer $file timeout 0" >> "$work/found"
            collect analyzer "$work/out"
        done
        ;;
    *) echo "lint.sh: no such tool: $tool"; exit 2 ;;
    esac
done
sort -u "$work/found" > "$work/all"
sed 's/#.*//' tests/lint.txt | awk 'NF { print $1, $2, $3 }' > "$work/allowed"
awk 'FILENAME == ARGV[1] { allowed[$0] = 1; next } !(($1 " " $2 " " $3) in allowed)' "$work/allowed" "$work/all" > "$work/new"
echo "lint.sh: $*: $(wc -l < "$work/all") findings, $(wc -l < "$work/new") of them not explained in tests/lint.txt"
cat "$work/new"
[ ! -s "$work/new" ]
