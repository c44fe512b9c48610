#!/usr/bin/env bash
# weft import, solve and compare from the command line, on a set made here.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"

# 16-bit grey PNGs of a flat matte plate (z up, albedo 0.5) under five lights
python3 - <<'PY'
import os, pngfile
lights = [(0, 0, 1), (0.6, 0, 0.8), (-0.6, 0, 0.8), (0, 0.6, 0.8), (0, -0.6, 0.8)]
os.mkdir("flat")
with open("flat/flat.lp", "w") as f:
    print(len(lights), file=f)
    for i, (x, y, z) in enumerate(lights):
        pngfile.write(f"flat/p{i}.png", 32, 24, 16, 1, [[round(65535 * 0.5 * z)] * 32] * 24)
        print(f"p{i}.png {x} {y} {z}", file=f)
PY

expect 0 'flat.set: 5 lights, 32 x 24 px' "$weft" import flat -o flat.set
expect 1 '--force' "$weft" import flat -o flat.set
expect 0 '100.0 % with an answer' "$weft" solve flat.set -c flat.cal -o flat.maps
expect 1 'flat.maps' "$weft" solve flat.set -c flat.cal -o flat.maps
expect 0 '' "$weft" solve flat.set -c flat.cal -o flat.maps --force -q
test -f flat.maps/uncertainty.exr -a -f flat.maps/lights.png -a -f flat.maps/quality.png
test -f flat.maps/normal.exr -a -f flat.maps/maps.json -a -f flat.maps/albedo.png
expect 0 'max 0.0000 deg' "$weft" compare flat.maps flat.maps
"$weft" compare flat.maps flat.maps --json | python3 -c '
import json, sys
d = json.load(sys.stdin)
assert d["normal_deg"]["n"] == 32 * 24 and d["normal_deg"]["max"] == 0, d'
python3 -c '
import json
i = json.load(open("flat.maps/maps.json"))
assert i["options"]["method"] == "robust" and i["result"]["answered_px"] == 768, i
assert i["result"]["residual_mean"] < 1e-4 and i["result"]["confidence_mean"] > 0.9, i'
cp -r flat.set other.set
"$weft" solve flat.set other.set -c flat.cal -o both -q --json | python3 -c '
import json, sys
assert [s["maps"] for s in json.load(sys.stdin)["solved"]] == ["both/flat.maps", "both/other.maps"]'
test -f both/flat.maps/maps.json -a -f both/other.maps/maps.json
expect 1 'two sets are called flat' "$weft" solve flat.set flat.set/ -c flat.cal -o twice
test ! -e twice

expect 0 'each light from the others, 768 px' "$weft" check flat.set -c flat.cal --flat --map error.exr
expect 0 'repeated scan    normal mean 0.0000' "$weft" check flat.set -c flat.cal --repeat other.set
expect 1 'error.exr' "$weft" check flat.set -c flat.cal --map error.exr
# before anything is solved
expect 1 'no folder absent' "$weft" check flat.set -c flat.cal --map absent/error.exr
expect 1 'absent.set' "$weft" check flat.set -c flat.cal --repeat absent.set
refuse grep 'each light' out
"$weft" check flat.set -c flat.cal --flat --json | python3 -c '
import json, sys
d = json.load(sys.stdin)
assert len(d["relighting"]["lights"]) == 5 and d["relighting"]["rms_full_scale"] < 1e-3, d
assert d["flatness"]["rms_deg"] < 0.01, d'
# the maps rendered again under the lights of their set
expect 0 'match.png: 5 lights' "$weft" preview flat.maps --match flat.set -c flat.cal -o match.png
"$weft" preview flat.maps --match flat.set -c flat.cal -o dark.png --param albedo=0.25 --json | python3 -c '
import json, sys
for row in json.load(sys.stdin)["lights"]:
    assert abs(row["ratio"] - 0.5) < 1e-3 and row["pixels"] == 768 and 8 < row["psnr_db"] < 20, row'
"$weft" preview flat.maps --match flat.set -c flat.cal -o same.png --json | python3 -c '
import json, sys
for row in json.load(sys.stdin)["lights"]:
    assert abs(row["ratio"] - 1) < 1e-3 and row["psnr_db"] > 60 and row["psnr_linear_db"] > 60, row'
expect 2 'go together' "$weft" preview flat.maps --match flat.set -o x.png
expect 1 'absent.set' "$weft" preview flat.maps --match absent.set -c flat.cal -o x.png
"$WEFT_TEST_BUILD/tests/make-weave-maps" other-sensor.maps sensor
expect 1 'do not belong together' "$weft" preview other-sensor.maps --match flat.set -c flat.cal -o x.png
test ! -e x.png

expect 2 'SET... is missing' "$weft" solve -c flat.cal -o x
expect 2 '--calibration' "$weft" solve flat.set -o x
expect 2 'there are: robust, lsq, svd' "$weft" solve flat.set -c flat.cal -o x --method robuster
expect 1 'absent.cal' "$weft" solve flat.set -c absent.cal -o x
expect 1 'absent.set' "$weft" solve absent.set -c flat.cal -o x
expect 1 'there is no folder nowhere' "$weft" solve flat.set -c flat.cal -o nowhere/x
expect 1 'weft calibrate lens' "$weft" solve flat.set -c flat.cal -o x --geometry plane
# what needs pixels that are millimetres: known before the work with --geometry sensor, after it without a camera
for option in --flaws "--ground 0.02" "--height poisson" "--flatten 20"; do
    # shellcheck disable=SC2086 # an option and its value
    expect 2 "${option%% *} is for maps of the plane" "$weft" solve flat.set -c flat.cal -o x --geometry sensor $option
    # shellcheck disable=SC2086
    expect 1 "${option%% *} needs maps of the plane" "$weft" solve flat.set -c flat.cal -o x $option
done
test ! -e x
expect 2 '--ground' "$weft" solve flat.set -c flat.cal -o x --ground 0.5
# one pixel explained
expect 0 '5 of 5 lights' "$weft" solve flat.set -c flat.cal --explain 16,12 --explain-plot pixel.svg
expect 1 'pixel.svg' "$weft" solve flat.set -c flat.cal --explain 16,12 --explain-plot pixel.svg
"$weft" solve flat.set -c flat.cal --explain 3,4 --json | jq -e \
    '.n_used == 5 and (.lights | length) == 5 and .lights[2].used and .normal[2] > 0.9999 and .colour == -1' >/dev/null
python3 -c 'import xml.dom.minidom; xml.dom.minidom.parse("pixel.svg")'
expect 1 'the maps are 32 x 24' "$weft" solve flat.set -c flat.cal --explain 32,0
expect 2 '--explain X,Y' "$weft" solve flat.set -c flat.cal -o plot.maps --explain-plot plot.svg
test ! -e plot.maps
expect 2 'column and row' "$weft" solve flat.set -c flat.cal --explain 3
expect 2 'column and row' "$weft" solve flat.set -c flat.cal --explain 3.5,2
expect 2 '--output is missing' "$weft" solve flat.set -c flat.cal

rm flat/p3.png
expect 1 'p3.png' "$weft" solve flat.set -c flat.cal -o x
expect 1 'line 5: the picture' "$weft" import flat -o again.set
test ! -e x -a ! -e again.set -a ! -e again.cal
expect 2 'different kinds' "$weft" compare flat.maps flat/p1.png
expect 0 'PSNR             inf dB' "$weft" compare flat/p1.png flat/p2.png
expect 0 'light direction  mean 0.000' "$weft" compare flat.cal flat.cal

# a layout of lights
printf 'x_mm,y_mm,z_mm\n200,0,200\n-200,0,200\n0,200,200\n0,-200,200\n' >lights.csv
expect 0 'gain of the directions 1.41' "$weft" layout lights.csv --plot noise.svg
expect 1 'noise.svg' "$weft" layout lights.csv --plot noise.svg
python3 -c 'import xml.dom.minidom; xml.dom.minidom.parse("noise.svg")'
"$weft" layout lights.csv --json | jq -e '.mean_deg > 0 and (.lights | length) == 4' >/dev/null
expect 2 '--plate wants' "$weft" layout lights.csv --plate 3
expect 1 'absent.csv' "$weft" layout absent.csv
