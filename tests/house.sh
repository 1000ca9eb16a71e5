#!/bin/sh
# The rules of the house that a compiler does not check. Prints every breach, exit 1 if there is one.
# usage: house.sh [FOLDER]
set -eu

cd "${1:-$(dirname "$0")/..}"
breaches=0

breach() {
    printf 'house: %s\n' "$*"
    breaches=$((breaches + 1))
}

# what is or could be committed; in a copy without git everything that is not a result
files=$(mktemp)
trap 'rm -f "$files"' EXIT
if ! git ls-files --cached --others --exclude-standard >"$files" 2>/dev/null || [ ! -s "$files" ]; then
    find . \( -name .git -o -name 'build*' -type d -o -name '*.out' \) -prune -o -type f -print | sed 's#^\./##' >"$files"
fi
[ "$(wc -l <"$files")" -gt 10 ] || breach "only $(wc -l <"$files") files found in $(pwd): this is not the house"

# files that one can read in one go
while read -r file; do
    [ -f "$file" ] || continue
    case $file in
    pfem/*.[ch] | pfem/*.cpp | dem-coupling/*.[ch] | include/*.h | tests/*.[ch])
        lines=$(wc -l <"$file")
        [ "$lines" -le 800 ] || breach "$file has $lines lines, at most 800"
        ;;
    esac

    # C++ only where CGAL is included
    case $file in
    pfem/mesh/delaunay.cpp) ;;
    *.cpp | *.cc | *.cxx | *.hpp | *.hh | *.hxx) breach "$file: C++ belongs in pfem/mesh/delaunay.cpp alone" ;;
    esac

    # the library never ends the program (but base.c when no memory is left); the worker is a program
    case $file in
    pfem/run/main.c | pfem/base.c | dem-coupling/worker.c | dem-coupling/script.c | dem-coupling/motion.c) ;;
    pfem/*.c | dem-coupling/*.c)
        if grep -nE '(^|[^[:alnum:]_])(exit|abort) ?\(' "$file"; then
            breach "$file ends the program: a library function returns a status"
        fi
        ;;
    esac

    # no path of the machine that somebody works on
    if grep -nIE '/wor[k]/|/tmp/bash_job[s]|/hom[e]/|/Users[/]' "$file"; then
        breach "$file names a folder of one machine"
    fi
done <"$files"

for file in .clang-format docs/scene.md README.md LICENSE .ci/run; do
    [ -f "$file" ] || breach "$file is missing"
done
for file in bootstrap .ci/run tests/bare-debian.sh tests/processes.sh; do
    [ ! -f "$file" ] || [ -x "$file" ] || breach "$file is not executable"
done

if [ "$breaches" -gt 0 ]; then
    printf 'house: %d breaches\n' "$breaches"
    exit 1
fi
printf 'house: %d files, no breach\n' "$(wc -l <"$files")"
