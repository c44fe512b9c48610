#!/usr/bin/env bash
# weft-rig --render: sets without a running scanner, the same to the bit each time.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
rig=$WEFT_TEST_BIN/weft-rig
[ -x "$rig" ] || { echo "skipped: this build has no weft-rig"; exit 77; }

echo '{"weft":"scene","version":1,"strip_mm":[-70,44,70,49],"light_drift":0.01}' >scene.json
"$rig" --render a --size 308x204 --scene scene.json --sample white,board-3 -q
"$rig" --render b --size 308x204 --scene scene.json --sample board-3,munsell,white --seed 1 -q
"$rig" --render c --size 308x204 --scene scene.json --sample white --seed 2 --exposure 0.01,0.02 -q
for frame in white.set/light-03.dng white.set/ambient.dng board-3.set/all.dng; do
    cmp "a/$frame" "b/$frame"
done
if cmp -s a/white.set/light-03.dng a/white.set/light-04.dng; then exit 1; fi
python3 - <<'PY'
import json
a, c = json.load(open("a/white.set/set.json")), json.load(open("c/white.set/set.json"))
assert len(a["frames"]) == 11 and len(c["frames"]) == 22 and a["state"] == "complete", a
assert {f["exposure_s"] for f in c["frames"]} == {0.01, 0.02}
board = json.load(open("a/board-3.set/set.json"))
left, top, right, bottom = board["strip"]["rect_px"]
assert 0 < left < 25 and 283 < right < 308 and 0 < top < bottom < 24, board["strip"]
assert "strip" not in a  # the sheet lies over it
assert json.load(open("a/truth.cal/calibration.json"))["camera"]["width"] == 308
PY
expect 1 'there already' "$rig" --render a --size 308x204 --sample white
expect 0 'white.set after' "$rig" --render a --size 308x204 --sample white --force
expect 2 'did you mean "satin"' "$rig" --render d --size 308x204 --sample satim
expect 2 '--exposure' "$rig" --render d --size 308x204 --sample satin --exposure 0
echo '{"weft":"scene","version":1,"strip_mm":[5,0,-5,1]}' >scene.json
expect 1 'strip_mm' "$rig" --render d --size 308x204 --scene scene.json --sample white
echo '{"weft":"scene","version":1,"sheet":{"bow":[1,0]}}' >scene.json
expect 1 '"bow" is not a key' "$rig" --render d --size 308x204 --scene scene.json --sample white
