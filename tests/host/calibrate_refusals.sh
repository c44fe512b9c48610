#!/usr/bin/env bash
# What the calibration refuses: each picture that would spoil it, in one line that names it, with exit status 1, and the
# calibration as it was.  Pictures come from the virtual scanner's renderer.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
[ -x "$WEFT_TEST_BIN/weft-rig" ] || { echo "skipped: this build has no weft-rig"; exit 77; }
[ -f "$WEFT_TEST_BIN/libweft_lens_opencv.so" ] || { echo "skipped: this build has no OpenCV"; exit 77; }

scene() { # NAME JSON: a scene file
    echo "{\"weft\":\"scene\",\"version\":1,$2}" >"$1.json"
}
render() { # DIR OPTIONS...
    "$WEFT_TEST_BIN/weft-rig" --render "$@" --size 616x408 -q
}
refused() { # WORDS COMMAND...: prints what it says
    local words=$1
    shift
    expect 1 "$words" "$@"
    echo "exit 1: $(grep -a '^weft:' out | tail -1)"
}

scene tilted '"sheet":{"tilt_deg":[0,4]}'
scene bowed '"sheet":{"bow_mm":[4,0]}'
scene shifted '"sheet":{"offset_mm":[30,0],"size_mm":[150,120]}'
scene strip '"strip_mm":[-70,40,70,49]'
render good --sample white,flat --scene strip.json
render clipped --sample white --exposure 0.09
render tilted --sample white --scene tilted.json
render bowed --sample white --scene bowed.json
render shifted --sample white --scene shifted.json
"$WEFT_TEST_BIN/weft-rig" --render small --sample white --size 308x204 -q
render chart --sample munsell --exposure 0.004,0.01,0.02,0.04
cp -r good/truth.cal scanner.cal
python3 - <<'PY'
import json, math, pngfile, shutil
def edit(source, target, change):
    shutil.copytree(source, target)
    s = json.load(open(f"{target}/set.json"))
    change(s)
    json.dump(s, open(f"{target}/set.json", "w"))
def swap(s):
    for f in s["frames"]:
        f["light"] = {2: 5, 5: 2}.get(f.get("light"), f.get("light"))
    for f in s["frames"]:
        if f["light"] is None:
            del f["light"]
edit("good/white.set", "swapped.set", swap)
edit("good/flat.set", "swapped-scan.set", swap)
edit("good/white.set", "missing.set", lambda s: s.update(frames=[f for f in s["frames"] if f.get("light") != 7]))
def png(path, width, height, pixel):
    pngfile.write(path, width, height, 8, 1, [[pixel(u, v) for u in range(width)] for v in range(height)])
def board(u, v, u0, v0, side, soft):
    x, y = (u - u0) / side, (v - v0) / side
    if not (0 < x < 10 and 0 < y < 7):
        return 230
    wave = math.sin(math.pi * x) * math.sin(math.pi * y)
    return int(130 + 100 * (max(-1, min(1, 2 * wave)) if soft else math.copysign(1, wave)))
png("two.png", 640, 520, lambda u, v: board(u, v, 40, 30, 30, False) if v < 260 else board(u, v, 200, 280, 30, False))
png("blurred.png", 640, 520, lambda u, v: board(u, v, 40, 40, 50, True))
PY
sha256sum scanner.cal/* >before
lights=("$weft" calibrate lights -o scanner.cal --force)
refused 'of the white sheet is saturated; take it again with a shorter exposure' "${lights[@]}" clipped/white.set
refused 'the sheet is tilted by' "${lights[@]}" tilted/white.set
refused 'the sheet is not flat: its middle stands' "${lights[@]}" bowed/white.set
refused 'does it fill the frame' "${lights[@]}" shifted/white.set
refused 'light 7 has no frame' "${lights[@]}" missing.set
refused '308x204' "${lights[@]}" small/white.set
refused 'light 2 is where light 5 was expected' "${lights[@]}" swapped.set --guess good/truth.cal
sha256sum --quiet -c before
refused 'light 2: on the white strip it looks like light 5' "$weft" solve swapped-scan.set -c good/truth.cal -o s.maps
test ! -e s.maps
refused 'two.png: there are two boards of 9x6 inner corners in it' "$weft" calibrate lens -o scanner.cal --force --board-on-table two.png
refused 'blurred.png: the board is blurred' "$weft" calibrate lens -o scanner.cal --force --board-on-table blurred.png
refused 'two.png' "$weft" calibrate lens two.png -o other.cal
sha256sum --quiet -c before

# the sensor in numbers: what the virtual one was made with
"$weft" calibrate linearity chart/munsell.set -o scanner.cal --force -q --json >linearity.json
python3 - <<'PY'
import json
r = json.load(open("linearity.json"))
assert r["series"]["max_deviation"] < 0.01 and len(r["noise"]) == 4, r["series"]
for site in r["noise"]:
    print("noise:", {k: site[k] for k in ("black_dn", "gain_e_per_dn", "read_noise_e", "fixed_pattern", "saturation_dn")})
    assert abs(site["black_dn"] - 256) < 3 and abs(site["gain_e_per_dn"] / (30000 / 15615) - 1) < 0.04, site
    assert abs(site["read_noise_e"] - 3) < 1 and site["fixed_pattern"] < 0.01, site
PY
