#!/bin/sh
# Films: as many pictures as the run has frames, of the right kind; a wrong name is refused; without ffmpeg a word. Skipped (77)
# behind that where ffmpeg is missing.
# usage: film.sh SILT SCENE [option of silt run]...
test_name=film
[ $# -ge 2 ] || { sed -n '4s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
silt=$1
scene=$2
shift 2

out=$work/out
expect 0 "$silt" run "$scene" -q -o "$out" "$@"
expect 2 "$silt" draw "$out" --film "$work/film.doc"
says 'film.doc: its name ends in .mp4, .webm, .webp or .gif'
mkdir "$work/none"
expect 1 env PATH="$work/none" "$silt" draw "$out" --film "$work/film.mp4"
says 'ffmpeg is not installed; Debian: apt-get install ffmpeg'
[ ! -e "$work/film.mp4" ] || fail "a film without ffmpeg"
if ! command -v ffmpeg >/dev/null || ! command -v ffprobe >/dev/null; then
    say "skipped, ffmpeg is not installed"
    exit 77
fi
expect 1 "$silt" draw "$out" --film "$work/absent/film.mp4"
says 'ffmpeg failed'

frames=$(grep -c '"name":' "$out/fluid.hdf.series")
expect 0 "$silt" draw "$out" --film "$work/film.mp4"
says "$work/film.mp4"
found=$(ffprobe -v error -count_frames -select_streams v -show_entries stream=codec_name,nb_read_frames -of csv=p=0 "$work/film.mp4")
[ "$found" = "h264,$frames" ] || fail "the film is $found, not h264,$frames"
# the last picture of the film is the last frame's, but for what the codec loses
expect 0 "$silt" draw "$out" --to "$work"
difference=$(ffmpeg -v info -i "$work/film.mp4" -i "$work"/picture_*.png -filter_complex \
    "[0:v]select=eq(n\\,$((frames - 1)))[a];[1:v]crop=trunc(iw/2)*2:trunc(ih/2)*2[b];[a][b]psnr" -f null - 2>&1 | sed -n 's/.*average:\([0-9.inf]*\).*/\1/p')
awk -v d="$difference" 'BEGIN { exit !(d == "inf" || d > 30) }' || fail "the last picture is $difference dB from the frame's"
# a name that could be taken for an option or a protocol
(cd "$work" && expect 0 "$silt" draw "$out" --film '-v:1.mp4' && cmp -- "-v:1.mp4" film.mp4)
expect 0 "$silt" draw "$out" --film "$work/film.webp"
[ "$(head -c 12 "$work/film.webp" | tail -c 4)" = WEBP ] || fail "the webp is none"
say "$frames frames, the last $difference dB from its picture; $(wc -c <"$work/film.mp4") bytes as mp4, $(wc -c <"$work/film.webp") as webp"
