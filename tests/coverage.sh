#!/bin/sh
# coverage.sh BUILD [CTEST-OPTIONS]: runs tests of a build that was configured with -DSILT_COVERAGE=ON (all of them, or those that ctest
# picks with the options: -R '^(base|scene)$'), then prints how many lines of each file of pfem and dem-coupling they went through and
# which not. Needs Debian's package gcovr. Counts of runs before go first.
set -eu
build=$1
shift
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd -P)
command -v gcovr > /dev/null || { echo "coverage.sh: gcovr is not there: apt-get install gcovr"; exit 2; }
grep -q '^SILT_COVERAGE:BOOL=ON' "$build/CMakeCache.txt" || { echo "coverage.sh: $build has no SILT_COVERAGE: cmake $build -DSILT_COVERAGE=ON"; exit 2; }
find "$build" -name '*.gcda' -delete
status=0
ctest --test-dir "$build" --output-on-failure "$@" || status=$?
# threads that count at the same time may leave a number below nought, which gcovr would stop at
gcovr --gcov-ignore-parse-errors --root "$root" --object-directory "$build" --filter "$root/pfem/" --filter "$root/dem-coupling/" --exclude-throw-branches "$build"
exit "$status"
