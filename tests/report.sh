#!/bin/sh
# The report of a run in a browser: needs no network, the slider moves the view, each part can be left out, playing goes on, no
# error. Without three.js the report stands without a view and says why. Skipped (77) where chromium is missing.
# usage: report.sh SILT SCENE PARTS [option of silt run]...
#   PARTS  what the view shows, for example "water bed"
# e.g.:  report.sh build/silt cases/dam-break/scene.yaml "water walls" -D fluid.size=0.004 -D time.end=0.1
# With SILT_SCREENSHOT set, a picture of the page goes to that file.
test_name=report
[ $# -ge 3 ] || { sed -n '4,6s/^# //p' "$0" >&2; exit 2; }
# shellcheck source=tests/system.sh
. "$(dirname "$0")/system.sh"
silt=$1
scene=$2
parts=$3
shift 3

out=$work/out
page=$out/report.html
expect 0 "$silt" run "$scene" -q -o "$out" "$@"

# without the package: a word, and all the rest
for way in '' --map-root-user; do
    # shellcheck disable=SC2086 # none or one word
    if unshare --mount $way sh -c 'mount -t tmpfs none /usr/share/javascript' 2>/dev/null; then
        expect 0 unshare --mount $way sh -c 'mount -t tmpfs none /usr/share/javascript && "$1" report "$2"' - "$silt" "$out"
        says 'no view: three.js is not installed .*apt-get install libjs-three'
        grep -q 'no view: three.js is not installed' "$page" || fail "the page without a view does not say so"
        grep -q '<h2>Pictures' "$page" || fail "the page without a view has no pictures"
        ! grep -q 'id="view-data"' "$page" || fail "the page without the package has a view"
        say "without three.js: no view, and a word"
        break
    fi
done

if [ ! -r /usr/share/javascript/three/three.min.js ] || ! command -v chromium >/dev/null; then
    say "skipped, chromium or libjs-three is not installed"
    exit 77
fi
expect 0 "$silt" report "$out"
! grep -q '^no view' "$work/last.say" || fail "no view though three.js is there"

# whole in itself: what a browser would fetch is in it
sed 's/src="data:[^"]*"//g' "$page" | grep -oiE '<(link|iframe|script|img)[^>]*(src|href) *= *[^>]*>' >"$work/fetched" || true
sed -n '/^<style>/,/<\/style>/p' "$page" | grep -oiE 'url\([^)]*\)|@import[^;]*' >>"$work/fetched" || true
[ ! -s "$work/fetched" ] || fail "the page fetches $(head -n 1 "$work/fetched")"

# a copy of the page with eyes: errors from its first line on; behind its last line slider, boxes and the button are used
cat >"$work/before" <<'END'
<script>
var probe = {errors: [], clocks: [], pictures: [], boxes: []};
window.onerror = function (text) { probe.errors.push(String(text)); };
['error', 'warn'].forEach(function (kind) {
    var real = console[kind];
    console[kind] = function () { probe.errors.push(kind + ': ' + Array.prototype.join.call(arguments, ' ')); real.apply(console, arguments); };
});
</script>
END
cat >"$work/behind" <<'END'
<script>
(function () {
    function picture() {
        // the view draws at once when it is asked: what was drawn is still there
        var url = document.querySelector('#stage canvas').toDataURL(), sum = 0;
        for (var i = 0; i < url.length; i++)
            sum = (31 * sum + url.charCodeAt(i)) % 4294967291;
        return url.length + '/' + sum;
    }
    var slider = document.querySelector('#controls input[type=range]'), clock = document.querySelector('#controls output');
    probe.frames = Number(slider.max) + 1;
    [0, Math.floor(slider.max / 2), Number(slider.max)].forEach(function (k) {
        slider.value = k;
        slider.dispatchEvent(new Event('input'));
        probe.clocks.push(clock.textContent);
        probe.pictures.push(picture());
    });
    Array.prototype.forEach.call(document.querySelectorAll('#controls input[type=checkbox]'), function (box) {
        var whole = picture_after(box), name = box.parentNode.textContent.trim();
        box.click();
        var other = picture();
        box.click();
        probe.boxes.push(name + (other !== whole ? ' changes' : ' STAYS') + (picture() === whole ? '' : ' AND DOES NOT COME BACK'));
    });
    function picture_after() {
        slider.dispatchEvent(new Event('input'));
        return picture();
    }
    slider.value = 0;
    slider.dispatchEvent(new Event('input'));
    document.querySelector('#controls button').click();
    setTimeout(function () {
        probe.played = Number(slider.value) > 0;
        document.querySelector('#controls button').click();
        var line = document.createElement('pre');
        line.id = 'probe';
        line.textContent = Object.keys(probe).map(function (key) { return 'probe ' + key + ': ' + [].concat(probe[key]).join('; '); }).join('\n');
        document.body.appendChild(line);
    }, 1500);
}());
</script>
END
awk -v before="$work/before" -v behind="$work/behind" '
    function put(file,  line) { while ((getline line < file) > 0) print line; close(file) }
    /^<title>/ && !done { put(before); done = 1 }
    /^<\/body>/ { put(behind) }
    { print }' "$page" >"$work/eyes.html"

browse() {
    timeout 300 chromium --headless=new --no-sandbox --disable-dev-shm-usage --user-data-dir="$work/chromium" --use-angle=swiftshader \
        --enable-unsafe-swiftshader --hide-scrollbars --window-size=1200,2400 --virtual-time-budget=4000 "$@" 2>"$work/chromium.err"
}
browse --dump-dom "file://$work/eyes.html" >"$work/dom.html" || fail "chromium ended with $?: $(tail -n 3 "$work/chromium.err")"
grep -oE 'probe [a-z]*: .*' "$work/dom.html" | sed 's/<.*//' >"$work/probe.say" || true
told() {
    sed -n "s/^probe $1: //p" "$work/probe.say"
}

[ -n "$(told frames)" ] || fail "the page's view did not come up"
[ -z "$(told errors)" ] || fail "the browser's console: $(told errors)"
frames=$(grep -c '"name":' "$out/fluid.hdf.series")
[ "$(told frames)" = "$frames" ] || fail "$(told frames) frames in the view, $frames in the run"
# the clock shows the times of the frames
times=$(sed -n 's/.*"time": \([^ }]*\).*/\1/p' "$out/fluid.hdf.series" |
    awk '{ t[NR] = $1 } END { printf "%.4g %.4g %.4g", t[1], t[1 + int((NR - 1) / 2)], t[NR] }')
shown=$(told clocks | tr ';' '\n' | awk '{ printf "%s%.4g", (NR > 1 ? " " : ""), $3 }')
[ "$times" = "$shown" ] || fail "the clock shows $shown, the frames are of $times"
[ "$(told pictures | tr ';' '\n' | tr -d ' ' | sort -u | wc -l)" -eq 3 ] || fail "the slider does not change the picture: $(told pictures)"
for part in $parts; do
    told boxes | grep -q "\(^\|; \)$part changes\(;\|\$\)" || fail "$part cannot be left out and put back: $(told boxes)"
done
[ "$(told played)" = true ] || fail "the play button does not move the slider"
[ -z "${SILT_SCREENSHOT:-}" ] || browse --screenshot="$SILT_SCREENSHOT" "file://$page" >/dev/null || fail "no screenshot"
say "$(told frames) frames, slider, $(told boxes | tr ';' '\n' | wc -l) boxes and play work, no error; $(wc -c <"$page") bytes"
