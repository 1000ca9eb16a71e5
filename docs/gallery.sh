#!/bin/sh
# The reports and pictures of docs/report.md: runs the four cases where FOLDER does not have them yet (about fifteen minutes on
# one thread), makes FOLDER/CASE.html and the pictures beside this file. Needs chromium, ffmpeg and libjs-three.
# usage: docs/gallery.sh SILT FOLDER
set -eu
[ $# -eq 2 ] || { sed -n '4s/^# //p' "$0" >&2; exit 2; }
silt=$1
folder=$2
docs=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd -P)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$folder"
folder=$(CDPATH='' cd -- "$folder" && pwd -P)

# small CASE INPUT...: pictures one below the other, 820 wide, of 256 colours
small() {
    to=$docs/$1
    shift
    n=$#
    inputs=
    filter=
    k=0
    for file in "$@"; do
        inputs="$inputs -i $file"
        filter="$filter[$k]scale=820:-1:flags=area[s$k];"
        k=$((k + 1))
    done
    k=0
    while [ "$k" -lt "$n" ]; do
        filter="$filter[s$k]"
        k=$((k + 1))
    done
    [ "$n" -eq 1 ] && stack=null || stack=vstack=$n
    # shellcheck disable=SC2086 # words
    ffmpeg -loglevel error -y $inputs -filter_complex "$filter$stack,split[a][b];[a]palettegen=max_colors=256[p];[b][p]paletteuse=dither=none" \
        -frames:v 1 "$to"
}

# picture CASE NAME FRAME [option of silt draw]...: into the work folder as NAME.png
picture() {
    case=$1
    name=$2
    frame=$3
    shift 3
    "$silt" draw "$folder/$case.out" --frame "$frame" --to "$work" "$@" >/dev/null
    mv "$work"/picture_*.png "$work/$name.png"
}

# page CASE TIME HEIGHT [option of silt report]...: the report, and its top as a picture with the view at a time
page() {
    case=$1
    time=$2
    height=$3
    shift 3
    "$silt" report "$folder/$case.out" -o "$folder/$case.html" "$@"
    chromium --headless=new --no-sandbox --disable-dev-shm-usage --user-data-dir="$work/chromium" --use-angle=swiftshader \
        --enable-unsafe-swiftshader --hide-scrollbars --window-size="1200,$height" --virtual-time-budget=4000 \
        --screenshot="$work/page.png" "file://$folder/$case.html#t=$time" 2>/dev/null
    small "report-$case.png" "$work/page.png"
}

run() {
    [ -e "$folder/$1.out/summary.json" ] || "$silt" run "$docs/../cases/$2" -o "$folder/$1.out" --force -q
}

run dam-break dam-break/scene-gate.yaml
run temple temple/scene.yaml
run earth-dam earth-dam/scene.yaml
run ten-tetrapods tetrapods/scene.yaml

page dam-break 1.16 2900
page temple 8 1900
page earth-dam 4 2500 --slice y=0.4
page ten-tetrapods 0.75 1900

picture dam-break a 15
picture dam-break b 58
small dam-break.png "$work/a.png" "$work/b.png"
picture temple a 60
picture temple b 156
picture temple c 190
small temple.png "$work/a.png" "$work/b.png" "$work/c.png"
picture earth-dam a 8
picture earth-dam b 16 --without water
picture earth-dam c 16 --slice y=0.4
small earth-dam.png "$work/a.png" "$work/b.png" "$work/c.png"
picture ten-tetrapods a 14
picture ten-tetrapods b 18
picture ten-tetrapods c 16 --slice y=0.15
small ten-tetrapods.png "$work/a.png" "$work/b.png" "$work/c.png"
ls -l "$docs"/*.png
