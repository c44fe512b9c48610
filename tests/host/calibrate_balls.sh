#!/usr/bin/env bash
# Lights from glossy balls on the table, and from positions measured by hand, against the truth.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
[ -x "$WEFT_TEST_BIN/weft-rig" ] || { echo "skipped: this build has no weft-rig"; exit 77; }
"$WEFT_TEST_BIN/weft-rig" --render r --sample balls,white --seed 3 -q
cp -r r/truth.cal scanner.cal
lights=("$weft" calibrate lights r/white.set -o scanner.cal --force)
expect 1 '0 dark balls are wholly in the picture' "${lights[@]}" --balls r/white.set
expect 1 'seems to have a radius of 1' "${lights[@]}" --balls r/balls.set --ball-radius 15
expect 2 'give one of them' "${lights[@]}" --balls r/balls.set --guess r/truth.cal
expect 0 'settled after' "${lights[@]}" --balls r/balls.set
python3 - <<'PY'
import csv, json, math, random
c, t = json.load(open("scanner.cal/calibration.json")), json.load(open("r/truth.cal/calibration.json"))
r, truth = c["reports"]["lights"], [l["position_mm"] for l in t["lights"]]
balls = [math.dist(a, b) for a, b in zip(r["positions_by_balls"], truth)]
both = [math.dist(l["position_mm"], b) for l, b in zip(c["lights"], truth)]
print("balls alone off by", [round(x, 2) for x in balls], "mm; with the sheet", [round(x, 2) for x in both])
assert max(balls) < 6 and sum(balls) / 10 < 4 and sum(both) / 10 < 1.0
random.seed(1)  # a tape measure: 2 mm
with open("measured.csv", "w") as f:
    rows = csv.writer(f)
    rows.writerow(["x_mm", "y_mm", "z_mm"])
    rows.writerows([[x + random.gauss(0, 2) for x in p] for p in truth])
PY
"${lights[@]}" --positions measured.csv --positions-sigma 2 -q --json >report.json
python3 - <<'PY'
import json, math
c, t = json.load(open("scanner.cal/calibration.json")), json.load(open("r/truth.cal/calibration.json"))
off = [math.dist(l["position_mm"], b["position_mm"]) for l, b in zip(c["lights"], t["lights"])]
print("measured to 2 mm, with the sheet off by", [round(x, 2) for x in off])
assert sum(off) / 10 < 1.0 and json.load(open("report.json"))["lights"]["positions_sigma_mm"] == 2
PY
