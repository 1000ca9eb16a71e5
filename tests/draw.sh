#!/bin/sh
# silt draw as it is called: every field, parts left out, a cut through a sphere against its area; words for what is wrong. Pixels are counted
# with ffmpeg; without it that is left out.
# usage: draw.sh SILT BALL PLANE SPACE    scenes: a sphere of radius 0.125 m about (0.3, 0.3, 0.45) in water; water, bed and grains in the plane and
#   grains in space
test_name=draw
[ $# -eq 4 ] || { sed -n '4,5s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
silt=$1

# pixels PICTURE: how often each colour stands in it
pixels() {
    ffmpeg -v error -i "$1" -f rawvideo -pix_fmt rgb24 - | od -An -v -tx1 -w3 | awk '{ n[$1 $2 $3]++ } END { for (k in n) print n[k], k }'
}
# stone PICTURE: pixels of a body and half of those of its outline
stone() {
    pixels "$1" | awk '$2 == "b9b4ac" { n += $1 } $2 == "3a3733" { n += 0.5 * $1 } END { print n + 0 }'
}
# picture OUT OPTION...: draws, sets `made`
picture() {
    run=$1
    shift
    mkdir "$work/to"
    expect 0 "$silt" draw "$run" --to "$work/to" "$@"
    made=$work/picture.png
    mv "$work"/to/picture_*.png "$made"
    rmdir "$work/to"
    [ "$(head -c 4 "$made" | tail -c 3)" = PNG ] || fail "no picture: $*"
}

mkdir "$work/here"
mkdir "$work/here/drop"
cp "$2" "$work/here/drop/ball.yaml"
# without -o: the name of the scene's folder
(cd "$work/here" && expect 0 "$silt" run drop/ball.yaml -q -D fluid.size=0.1 -D time.step=0.001 -D time.output=0.001 -D time.end=0.001 -D checks=[])
ball=$work/here/drop.out
[ -s "$ball/summary.json" ] || fail 'no folder drop.out'
for field in mesh pressure speed elevation porosity bed; do
    picture "$ball" --field "$field"
done
picture "$ball" --field pressure --slice y=0.3
picture "$ball" --field mesh --slice z=0.45
if command -v ffmpeg >/dev/null; then
    picture "$ball" --slice y=0.3 --without walls
    whole=$(stone "$made")
    picture "$ball" --slice y=0.375 --without walls
    part=$(stone "$made")
    picture "$ball" --slice x=0.225 --without walls
    other=$(stone "$made")
    picture "$ball" --slice y=0.43
    beside=$(stone "$made")
    picture "$ball" --slice y=0.3 --without bodies,walls
    without=$(stone "$made")
    # 1 - (0.075/0.125)^2, within what the triangles cut off; the same from another side
    echo "$whole $part $other $beside $without" | awk '{ print "pixels of the sphere:", $0
        exit !($1 > 5000 && $2 / $1 > 0.63 && $2 / $1 < 0.65 && $3 / $2 > 0.99 && $3 / $2 < 1.01 && $4 == 0 && $5 == 0) }' ||
        fail 'the cuts of the sphere have other areas'
    picture "$ball"
    all=$(pixels "$made" | wc -l)
    picture "$ball" --without water,bodies,walls,grains,bed
    [ "$(pixels "$made" | wc -l)" -lt $((all / 2)) ] || fail 'without everything something is drawn'
fi
say 'a sphere in space, whole and cut'

expect 0 "$silt" run "$3" -q -o "$work/plane" --until 0.1
for field in mesh pressure speed elevation vorticity porosity bed; do
    picture "$work/plane" --field "$field"
done
picture "$work/plane" --frame 0 --without water,grains
cp "$made" "$work/first.png"
picture "$work/plane" --frame 0
! cmp -s "$made" "$work/first.png" || fail 'nothing was left out'
expect 0 "$silt" run "$4" -q -o "$work/space" --until 0.01
picture "$work/space"
picture "$work/space" --slice x=0.02
say 'water, bed and grains'

expect 2 "$silt" draw "$ball" --field colour
says 'field colour is not known: mesh'
expect 2 "$silt" draw "$ball" --field vorticity
says 'vorticity is drawn in two dimensions'
expect 2 "$silt" draw "$work/plane" --slice y=0.1
says 'a slice is for three dimensions'
expect 2 "$silt" draw "$ball" --slice y=
says 'slice y= is no plane'
expect 2 "$silt" draw "$ball" --without sky
says 'without sky: water, bed'
expect 2 "$silt" draw "$ball" --frame 99
says 'has no frame 99; its frames are 0 to 1'
expect 2 "$silt" draw "$ball" --frame last
says "a frame's number or all is needed"
expect 1 "$silt" draw "$ball" --to "$ball/history.csv"
says 'history.csv.*(cannot|File exists|Not a directory)'
mkdir "$work/empty"
expect 1 "$silt" draw "$work/empty"
says 'has no frames'
say 'what is refused'

# what there is to know of a scene with bodies, of a run, and of one that was killed
expect 0 "$silt" info "$2"
says 'ball'
expect 0 "$silt" info "$ball"
says '1 steps'
rm "$ball/summary.json"
expect 0 "$silt" info "$ball"
says 'reached +0.001 s in 1 steps so far; no summary'
expect 0 "$silt" help bench
says 'Scenes and their sizes:'
expect 0 "$silt" help study
says 'Keys of a study'
expect 0 "$silt" bench still-2d --sizes 300 --steps 2 --warm-up 1 -q -o "$work/bench.json"
[ -s "$work/bench.json" ] || fail 'no bench.json'
say 'info, help, bench'
