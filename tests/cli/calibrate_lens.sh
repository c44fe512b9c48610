#!/usr/bin/env bash
# weft calibrate lens on OpenCV's own photographs: the published figures, and what is refused.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
photographs=${WEFT_SHARED:-$WEFT_TEST_SOURCE/../shared}/data/images/opencv_left
if [ ! -d "$photographs" ]; then
    echo "skipped: the staged photographs $photographs are not here (set WEFT_SHARED to their folder)"
    exit 77
fi

if ldd "$weft" | grep -qi opencv; then
    echo "FAILED: weft is linked with OpenCV"
    exit 1
fi
for f in "$photographs"/*.jpg; do
    "$WEFT_TEST_BUILD/tests/jpeg-to-png" "$f" "$(basename "$f" .jpg).png"
done

expect 2 'pictures of the board are missing' "$weft" calibrate lens -o lens.cal
expect 1 '4 views of the board; wanted 5' "$weft" calibrate lens left0[1-4].png -o lens.cal --square-mm 25
expect 1 'none of the 5 pictures shows a board of 12x9' "$weft" calibrate lens left0[1-5].png -o lens.cal --board 12x9
grep -q 'left03.png: no board of 12x9' out
expect 2 '2x6' "$weft" calibrate lens left0[1-5].png -o lens.cal --board 2x6
expect 1 'none.png' "$weft" calibrate lens left0[1-5].png none.png -o lens.cal
head -c 5000 left01.png >cut.png
expect 1 'cut.png' "$weft" calibrate lens cut.png left0[1-5].png -o lens.cal
WEFT_MODULES=$work expect 1 'libopencv-dev' "$weft" calibrate lens left0[1-5].png -o lens.cal
test ! -e lens.cal

# left01 lies nearly straight: it stands for a board on the table
"$weft" calibrate lens left*.png -o lens.cal --square-mm 25 --board-on-table left01.png \
    --board-origin-mm 10,-5 --bent no --json -q >report.json
"$weft" calibrate lens left*.png -o bent.cal --square-mm 25 --json -q >bent.json
expect 2 '--model' "$weft" calibrate lens left*.png -o other.cal --model k9
expect 2 '--bent' "$weft" calibrate lens left*.png -o other.cal --bent maybe
expect 1 '--force' "$weft" calibrate lens left*.png -o lens.cal --square-mm 25
expect 1 'has a pose already' "$weft" calibrate lens -o lens.cal --board-on-table left01.png
expect 0 'pose: camera' "$weft" calibrate lens -o lens.cal --square-mm 25 --board-on-table left01.png --force
cp -r lens.cal leaning.cal
expect 0 'did this board lie flat on the table?' "$weft" calibrate lens -o leaning.cal --square-mm 25 --board-on-table left03.png --force
python3 - <<'PY'
import json
r, c = json.load(open("report.json")), json.load(open("lens.cal/calibration.json"))
lens, cam = r["lens"], c["camera"]
print("rms %.4f held out %.4f fx %.2f pose %.3f" % (lens["rms_px"], lens["held_out_px"], cam["fx"], r["pose"]["rms_px"]))
assert abs(lens["rms_px"] - 0.1774) < 0.003 and abs(lens["held_out_px"] - 0.1826) < 0.003
assert abs(cam["fx"] - 533.35) < 0.55 and (cam["width"], cam["height"]) == (640, 480)
assert len(lens["views"]) == 13 and lens["views_used"] == 13 and lens["opencv"]
bent = json.load(open("bent.json"))["lens"]
print("bent board: rms %.4f held out %.4f bend %.2f mm" % (bent["rms_px"], bent["held_out_px"], bent["board_bend_mm"]))
assert bent["board_bent"] and bent["rms_px"] < 0.12 and bent["held_out_px"] < 0.14 and bent["model"] == "k1k2p1p2"
assert abs(json.load(open("bent.cal/calibration.json"))["camera"]["fx"] - 533.35) < 2
assert not lens["board_bent"] and len(lens["tried"]) == 3 and sum(map(sum, lens["coverage_map"])) == 13 * 54
assert all(len(v["corners"]) == 4 * 54 and 1 < v["edge_px"] < 6 for v in lens["views"])
assert r["pose"]["rms_px"] < 0.6 and r["pose"]["board_origin_mm"] == [10, -5]
R = cam["rotation"]
up, towards = R[3:6], R[6:9]
assert R[0] > 0.7 and R[4] < -0.5 and R[8] < -0.5, R  # x right, y up in the picture, z to the camera
assert set(c["reports"]) == {"lens", "pose"} and c["reports"]["pose"]["board_origin_mm"] == [0, 0]
PY
