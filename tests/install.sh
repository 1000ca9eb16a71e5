#!/bin/sh
# Installs into a folder and uses it from there as another program does: through pkg-config, through find_package, and silt itself.
# usage: install.sh BUILD SOURCE
test_name=install
[ $# -eq 2 ] || { sed -n '3s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
build=$1
source=$2

cmake --install "$build" --prefix "$work/usr" >"$work/install.log" || { cat "$work/install.log"; fail "cmake --install"; }
# moved as a whole, it still works
mv "$work/usr" "$work/moved"
scene="$work/moved/share/silt/cases/dam-break/scene.yaml"
few="-D fluid.size=0.008 -D time.steps=3"

# shellcheck disable=SC2086 # a list of words
expect 0 "$work/moved/bin/silt" run "$scene" -q -o "$work/silt.out" $few
expect 0 "$work/moved/bin/silt" run "$source/tests/scenes/coupled-drag.yaml" -q -o "$work/drag.out" -D time.steps=3
say "silt and its worker run from where they were installed"

pc=$(dirname "$(find "$work/moved" -name silt.pc)")
lib=$(dirname "$pc")
flags=$(PKG_CONFIG_PATH=$pc pkg-config --cflags --libs silt) || fail "pkg-config"
# shellcheck disable=SC2086
cc -Wall -Wextra -Werror "$source/docs/example/steps.c" $flags -lm -o "$work/steps" || fail "the example does not compile with pkg-config"
LD_LIBRARY_PATH=$lib expect 0 "$work/steps" "$source/tests/scenes/coupled-drag.yaml" "$work/steps.out"
[ -s "$work/steps.out/summary.json" ] || fail "the example left no results"
say "pkg-config: the example steps through a coupled run"

mkdir "$work/project"
cat >"$work/project/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.25)
project(steps LANGUAGES C)
find_package(silt 0.1 REQUIRED)
add_executable(steps "$source/docs/example/steps.c")
target_link_libraries(steps PRIVATE silt::silt m)
END
cmake -S "$work/project" -B "$work/project/build" -DCMAKE_PREFIX_PATH="$work/moved" >"$work/cmake.log" 2>&1 &&
    cmake --build "$work/project/build" >>"$work/cmake.log" 2>&1 || { cat "$work/cmake.log"; fail "find_package(silt)"; }
[ -x "$work/project/build/steps" ] || fail "no program from find_package"
say "find_package: the same"
