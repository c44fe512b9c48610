#!/usr/bin/env bash
# weft calibrate lights on a white sheet made by formula: what it finds, and what it refuses.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"

"$WEFT_TEST_BUILD/tests/make-white-set" .
cp -r camera.cal scanner.cal
expect 0 'settled after' "$weft" calibrate lights white.set -o scanner.cal
expect 1 '--force' "$weft" calibrate lights white.set -o scanner.cal
"$weft" compare scanner.cal truth.cal --json >difference.json
"$weft" calibrate lights white.set -o scanner.cal --force --guess truth.cal -q --json >report.json
python3 - <<'PY'
import json
d, r = json.load(open("difference.json")), json.load(open("report.json"))
print("found and true lights:", json.dumps(d["lights"]))
assert d["lights"]["position_error_mm_mean"] < 2 and d["lights"]["position_error_mm_max"] < 7, d
c = json.load(open("scanner.cal/calibration.json"))
assert r["n_lights"] == 10 and r["lights"]["settled"] and len(r["lights"]["lights"]) == 10, r
assert c["reports"]["lights"]["software"].startswith("weft") and c["camera"]["width"] == 616, c
assert c["light_grid"]["columns"] == 33 and c["light_grid"]["rows"] == 22
assert max(l["residual"] for l in c["lights"]) < 0.01, c["lights"]
for l in c["lights"]:
    assert abs(l["white_balance"][0] - l["intensity"][1] / l["intensity"][0]) < 1e-9
PY

# a report does without the sheet, and says so when it is damaged
expect 0 'good    lights' "$weft" calibrate report scanner.cal -o page.html
no_maps() { grep -q 'the page has no maps of the sheet' out; }
if no_maps; then cat out; exit 1; fi
cp -r scanner.cal cut.cal
truncate -s 1000 cut.cal/white-sheet.exr
expect 0 'white-sheet.exr' "$weft" calibrate report cut.cal -o cut.html
no_maps
rm cut.cal/white-sheet.exr
expect 0 'good    lights' "$weft" calibrate report cut.cal -o without.html
if no_maps; then cat out; exit 1; fi

# what is refused leaves the calibration as it was
sha256sum scanner.cal/* >before
expect 1 'weft calibrate lens' "$weft" calibrate lights white.set -o nowhere.cal
test ! -e nowhere.cal
python3 - <<'PY'
import json, os, shutil
c = json.load(open("camera.cal/calibration.json"))
del c["camera"]["rotation"], c["camera"]["translation_mm"]
os.mkdir("nopose.cal")
json.dump(c, open("nopose.cal/calibration.json", "w"))
shutil.copytree("white.set", "missing.set")
s = json.load(open("missing.set/set.json"))
s["frames"] = [f for f in s["frames"] if f.get("light") != 4]
json.dump(s, open("missing.set/set.json", "w"))
shutil.copytree("white.set", "cut.set")
with open("cut.set/light-03.dng", "r+b") as f:
    f.truncate(70000)
shutil.copytree("white.set", "dark.set")
shutil.copy("dark.set/ambient.dng", "dark.set/light-07.dng")
PY
expect 1 '--board-on-table' "$weft" calibrate lights white.set -o nopose.cal
expect 1 'light 4' "$weft" calibrate lights missing.set -o scanner.cal --force
expect 1 'light-03.dng' "$weft" calibrate lights cut.set -o scanner.cal --force
expect 1 'light 7: the sheet is dark' "$weft" calibrate lights dark.set -o scanner.cal --force
expect 2 '--grid' "$weft" calibrate lights white.set -o scanner.cal --force --grid 2x2
printf 'x_mm,y_mm\n1,2\n' >short.csv
expect 1 'z_mm' "$weft" calibrate lights white.set -o scanner.cal --force --guess short.csv
printf 'x_mm,y_mm,z_mm\n1,2,300\n' >one.csv
expect 1 'the guess has 1 lights' "$weft" calibrate lights white.set -o scanner.cal --force --guess one.csv
sha256sum --quiet -c before
