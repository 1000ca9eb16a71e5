#!/usr/bin/env bash
# Proves the two commands of the README in a bare Debian 12: debootstrap, then ./bootstrap test and
# ./bootstrap demo inside, and both once more without any network. Needs root and debootstrap.
set -euo pipefail

usage() {
    cat <<'END'
usage: tests/bare-debian.sh [--keep] [--reuse] [--tree] [--only test|demo] [--package FILE.deb] [FOLDER]
  FOLDER    where the file system goes; default: a new one under /var/tmp
  --keep    leave it there in the end (always so with --reuse)
  --reuse   FOLDER is a file system from an earlier run with --keep: only silt itself is put in anew
  --tree    take the working tree (tracked and new files that are not ignored) instead of the last commit
  --only    one of the two commands instead of both
  --package instead of the commands: installs a package of silt (cpack --config build/CPackConfig.cmake) where
            nothing of silt's is, and runs, verifies and draws a case with water and one with grains from it
END
}

keep=no reuse=no tree=no commands='test demo' package= root=
while [ $# -gt 0 ]; do
    case $1 in
    --keep) keep=yes ;;
    --reuse) reuse=yes keep=yes ;;
    --tree) tree=yes ;;
    --only)
        [ $# -gt 1 ] || { usage >&2; exit 2; }
        commands=$2
        shift
        ;;
    --package)
        [ -r "${2:-}" ] || { usage >&2; exit 2; }
        package=$(realpath "$2") commands=
        shift
        ;;
    -h | --help) usage; exit 0 ;;
    -*) usage >&2; exit 2 ;;
    *) root=$1 ;;
    esac
    shift
done
case $commands in 'test demo' | test | demo | '') ;; *) usage >&2; exit 2 ;; esac
[ "$(id -u)" -eq 0 ] || { echo 'bare-debian: needs root (mount, chroot)' >&2; exit 2; }
command -v debootstrap >/dev/null || { echo 'bare-debian: apt-get install debootstrap first' >&2; exit 2; }
[ $reuse = no ] || [ -x "$root/bin/sh" ] || { echo 'bare-debian: --reuse needs a FOLDER from an earlier --keep' >&2; exit 2; }

# an own mount namespace: whatever happens, no mount outlives this script
if [ -z "${SILT_BARE_NAMESPACE:-}" ]; then
    args=()
    case $commands in test | demo) args+=(--only "$commands") ;; esac
    [ -z "$package" ] || args+=(--package "$package")
    [ $keep = no ] || args+=(--keep)
    [ $reuse = no ] || args+=(--reuse)
    [ $tree = no ] || args+=(--tree)
    [ -z "$root" ] || args+=("$root")
    SILT_BARE_NAMESPACE=1 exec unshare --mount --propagation private -- "$0" "${args[@]}"
fi

source=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
made=no
if [ -z "$root" ]; then
    root=$(mktemp -d /var/tmp/silt-bare.XXXXXX)
    made=yes
elif [ $reuse = no ]; then
    [ -z "$(ls -A "$root" 2>/dev/null)" ] || { echo "bare-debian: $root is not empty" >&2; exit 2; }
    made=yes
fi
mkdir -p "$root"
root=$(cd "$root" && pwd -P)
# the path inside has a space on purpose
inside='/root/a folder/silt'

mounted=()
leave() {
    local i
    for ((i = ${#mounted[@]} - 1; i >= 0; i--)); do
        umount "${mounted[i]}" 2>/dev/null || umount -l "${mounted[i]}" || true
    done
    if [ $keep = no ] && [ $made = yes ]; then
        rm -rf --one-file-system "$root"
    else
        echo "bare-debian: kept in $root; silt alone again: tests/bare-debian.sh --reuse $root"
    fi
}
trap leave EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

put_mount() { # put_mount TARGET mount-arguments...
    local target=$root/$1
    shift
    mkdir -p "$target"
    mount "$@" "$target"
    mounted+=("$target")
}

report=()
timed() { # timed NAME command...
    local name=$1 started status=0
    shift
    started=$(date +%s)
    echo "bare-debian: $name"
    "$@" || status=$?
    report+=("$(printf '%-28s %5d s  %s' "$name" $(($(date +%s) - started)) "$([ $status -eq 0 ] && echo ok || echo "exit $status")")")
    if [ $status -ne 0 ]; then
        printf '%s\n' "${report[@]}"
        exit $status
    fi
}

# where the packages come from is nobody's business
no_hosts() {
    sed -u -E 's#[a-z]+://[^ ]+#(mirror)#g'
}

# the first place of bookworm that apt knows here, and nothing of it into the repository
mirror() {
    # shellcheck disable=SC2016 # apt expands these
    apt-get indextargets --format '$(REPO_URI) $(CODENAME) $(SUITE)' 'Created-By: Packages' 2>/dev/null |
        awk '$2 == "bookworm" || $3 == "bookworm" { print $1; exit }'
}

make_base() {
    local from
    from=$(mirror)
    # an empty mirror means debootstrap's own
    debootstrap --variant=minbase bookworm "$root" ${from:+"$from"} 2>&1 | no_hosts
}

# how apt reaches its packages here: sources, keys, proxies, names
copy_apt() {
    local key
    rm -f "$root/etc/apt/sources.list"
    tar -C / -cf - etc/apt | tar -C "$root" -xf -
    grep -rhoE '(signed-by=|Signed-By: *)/[^] ]+' /etc/apt 2>/dev/null | sed -E 's/^[^/]*//' | sort -u | while read -r key; do
        [ ! -r "$key" ] || install -D -m 644 "$key" "$root$key"
    done
    cp -L /etc/resolv.conf "$root/etc/resolv.conf" 2>/dev/null || true
    if [ -d /usr/local/share/ca-certificates ]; then
        mkdir -p "$root/usr/local/share/ca-certificates"
        cp -rL /usr/local/share/ca-certificates/. "$root/usr/local/share/ca-certificates/"
    fi
}

mount_all() {
    local node
    put_mount proc -t proc proc
    put_mount sys -t sysfs -o ro sysfs
    put_mount dev -t tmpfs -o mode=755,nosuid tmpfs
    for node in null zero full random urandom tty; do
        touch "$root/dev/$node"
        put_mount_file "$node"
    done
    ln -s /proc/self/fd "$root/dev/fd"
    ln -s fd/0 "$root/dev/stdin"
    ln -s fd/1 "$root/dev/stdout"
    ln -s fd/2 "$root/dev/stderr"
    put_mount dev/pts -t devpts -o newinstance,ptmxmode=0666,mode=620 devpts
    ln -s pts/ptmx "$root/dev/ptmx"
    put_mount dev/shm -t tmpfs -o mode=1777 tmpfs
    # OpenMPI looks its own host name up
    { cat /etc/hosts; printf '127.0.0.1 localhost\n127.0.1.1 %s\n' "$(uname -n)"; } >"$root/etc/hosts"
    uname -n >"$root/etc/hostname"
}

put_mount_file() {
    mount --bind "/dev/$1" "$root/dev/$1"
    mounted+=("$root/dev/$1")
}

copy_silt() {
    rm -rf "${root:?}$inside"
    mkdir -p "$root$inside"
    if [ $tree = yes ]; then
        (cd "$source" && git ls-files -z --cached --others --exclude-standard |
            while IFS= read -r -d '' file; do [ ! -e "$file" ] || printf '%s\0' "$file"; done |
            tar --null -T - -cf -) | tar -C "$root$inside" -xf -
    else
        git -C "$source" archive HEAD | tar -C "$root$inside" -xf -
    fi
}

# a clean environment: only what reaches the packages and what this processor's BLAS needs comes along
variables=(PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 "TERM=${TERM:-dumb}")
for name in http_proxy https_proxy no_proxy HTTP_PROXY HTTPS_PROXY NO_PROXY OPENBLAS_CORETYPE OPENBLAS_L2_SIZE; do
    [ -z "${!name:-}" ] || variables+=("$name=${!name}")
done
in_bare() {
    env -i "${variables[@]}" chroot "$root" "$@" </dev/null 2>&1 | no_hosts
}
# loopback only, nothing else
in_bare_alone() {
    # shellcheck disable=SC2016 # expanded inside
    unshare --net -- sh -c '! command -v ip >/dev/null || ip link set lo up; exec "$@"' sh \
        env -i "${variables[@]}" chroot "$root" "$@" </dev/null 2>&1
}

[ $reuse = yes ] || timed 'debootstrap' make_base
copy_apt
mount_all
if [ -n "$package" ]; then
    cp "$package" "$root/root/silt.deb"
    in_bare dpkg --purge silt >/dev/null || true
    in_bare apt-get -qq update
    timed 'apt-get install ./silt.deb' in_bare apt-get -qq -y --no-install-recommends install /root/silt.deb
    for scene in standing-wave/scene.yaml settling-grain/scene.yaml; do
        rm -rf "$root/root/bare.out"
        timed "silt run, $scene" in_bare silt run "/usr/share/silt/cases/$scene" -q -o /root/bare.out
        timed "silt verify, $scene" in_bare silt verify /root/bare.out
        timed "silt draw, $scene" in_bare silt draw /root/bare.out
    done
    printf '%s\n' "${report[@]}"
    exit 0
fi
timed 'silt put in' copy_silt
for command in $commands; do
    timed "bootstrap $command" in_bare "$inside/bootstrap" "$command"
done
for command in $commands; do
    timed "bootstrap $command, no network" in_bare_alone "$inside/bootstrap" "$command"
done
if [[ $commands == *demo* ]] && ! ls "$root$inside"/temple.out/*.png >/dev/null 2>&1; then
    echo 'bare-debian: the demo left no picture' >&2
    exit 1
fi
printf '%s\n' "${report[@]}"
echo 'bare-debian: all done'
