#!/bin/sh
# A scene of water alone stays in one process without LIGGGHTS, MPI and VTK, and what draws is not loaded: looks at a run while it runs.
# usage: processes.sh SILT SCENE [option of silt run]...
# e.g.:  processes.sh build/silt cases/dam-break/scene.yaml -D fluid.size=0.0146 -D time.end=100
# The scene must run for some seconds; it is stopped as soon as enough was seen.
set -eu

[ $# -ge 2 ] || { sed -n '3,4s/^# //p' "$0" >&2; exit 2; }
silt=$1
scene=$2
shift 2

folder=$(mktemp -d)
out=$folder/run.out
pid=
leave() {
    if [ -n "$pid" ]; then
        kill -KILL "$pid" 2>/dev/null || true
        wait "$pid" 2>/dev/null || true
    fi
    rm -rf "$folder"
}
trap leave EXIT
trap 'exit 130' INT TERM

fail() {
    printf 'processes: %s\n' "$*" >&2
    [ ! -s "$folder/say" ] || tail -n 20 "$folder/say" >&2
    exit 1
}

# running and not a zombie that waits for its parent
alive() {
    [ -r "/proc/$pid/status" ] && ! grep -q '^State:[[:space:]]*[ZX]' "/proc/$pid/status" 2>/dev/null
}

# pids of all processes whose parent is the run
children() {
    # a process may be gone between the glob and the look
    grep -ls "^PPid:[[:space:]]*$pid\$" /proc/[0-9]*/status | cut -d/ -f3 || true
}

"$silt" run "$scene" -o "$out" -q "$@" >"$folder/say" 2>&1 &
pid=$!

# it is in its time loop once the first frame is there or the history has rows; at most 60 s to get there
waited=0
while :; do
    alive || fail "the run ended before it could be looked at: it failed, or the scene is too short"
    if [ -e "$out/fluid_000000.hdf" ]; then
        break
    fi
    if [ -s "$out/history.csv" ] && [ "$(wc -l <"$out/history.csv")" -ge 2 ]; then
        break
    fi
    waited=$((waited + 1))
    [ "$waited" -le 1200 ] || fail "no frame and no history row within 60 s"
    sleep 0.05
done

# twenty looks over two seconds, so that a helper started late or for a short time is seen too
look=0
while [ "$look" -lt 20 ]; do
    look=$((look + 1))
    maps=$(cat "/proc/$pid/maps" 2>/dev/null || true)
    helpers=$(children | tr '\n' ' ')
    alive || fail "the run ended during the looks ($look of 20): the scene is too short"

    # that the right process is looked at: the program and its solver are mapped
    case $maps in
    *cholmod*) ;;
    *) fail "process $pid maps no CHOLMOD: this is not the solver" ;;
    esac
    foreign=$(printf '%s\n' "$maps" | awk 'NF >= 6 { print $6 }' | sort -u |
        grep -iE 'liggghts|libmpi|libopen-(rte|pal)|libpmix|openmpi|mpich|libvtk|libcairo|libpixman|libfontconfig|libX11|gmsh|silt-draw' || true)
    [ -z "$foreign" ] || fail "the solver has mapped: $foreign"
    if [ -n "$helpers" ]; then
        for helper in $helpers; do
            printf 'processes: %s is %s\n' "$helper" "$(tr '\0' ' ' <"/proc/$helper/cmdline" 2>/dev/null || true)" >&2
        done
        fail "the solver has child processes: $helpers"
    fi
    sleep 0.1
done

# it ends by itself on SIGTERM; not being patient about it is no finding of this test
kill -TERM "$pid"
waited=0
while alive && [ "$waited" -lt 200 ]; do
    waited=$((waited + 1))
    sleep 0.05
done
echo "processes: 20 looks: one process, no LIGGGHTS, MPI, VTK, cairo or gmsh mapped"
