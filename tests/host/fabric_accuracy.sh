#!/usr/bin/env bash
# Fabrics of virtual scanners, calibrated from their own photographs, solved and compared with the truth: mean and
# median angle of the normals and CIEDE2000 of the albedo, lsq beside robust.
#   WEFT_FABRIC_SEEDS="1 2 ... 10"  one scanner each: lamps, lens, cloth and noise   (default 1)
#   WEFT_FABRIC_SAMPLES="satin ..." (default satin corduroy)
#   WEFT_FABRIC_SIZE=1232x816       (default 616x408)
#   WEFT_FABRIC_GEOMETRIES="sensor plane" (default sensor)
#   WEFT_FABRIC_FIGURES=FILE        where each figure is kept as soon as it is known (appended to)
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
[ -x "$WEFT_TEST_BIN/weft-rig" ] || { echo "skipped: this build has no weft-rig"; exit 77; }
[ -f "$WEFT_TEST_BIN/libweft_lens_opencv.so" ] || { echo "skipped: this build has no OpenCV"; exit 77; }
figures=${WEFT_FABRIC_FIGURES:-$work/figures}
seeds=${WEFT_FABRIC_SEEDS:-1} size=${WEFT_FABRIC_SIZE:-616x408}
samples=${WEFT_FABRIC_SAMPLES:-${WEFT_TEST_SANITIZE:+satin}}
samples=${samples:-satin corduroy}
boards=$(seq -s, -f "board-%g" 0 8)
mm=$(python3 -c "print(0.125 * 1232 / int('$size'.split('x')[0]))")

# shellcheck disable=SC2154 # set by script.sh
calibrate() { # in the scanner's folder
    "$weft" calibrate lens board-?.set -o s.cal --square-mm 10 --board-on-table board-table.set -q
    "$weft" calibrate lights white.set -o s.cal -q
    "$weft" calibrate linearity munsell.set -o s.cal -q
    "$weft" calibrate white munsell.set -o s.cal -q
    "$weft" calibrate colour macbeth.set -o s.cal -q
}

for seed in $seeds; do
    mkdir "$seed"
    (
        cd "$seed"
        "$WEFT_TEST_BIN/weft-rig" --render . --size "$size" --seed "$seed" \
            --sample "white,munsell,macbeth,$boards,board-table,${samples// /,}" >render.log 2>&1 ||
            { cat render.log; exit 1; }
        # shellcheck disable=SC2086 # a list
        "$WEFT_TEST_BUILD/tests/fabric_truth" . "$seed" "$size" "$mm" $samples
        calibrate >calibrate.log 2>&1 || { cat calibrate.log; exit 1; }
        for sample in $samples; do
            for method in lsq robust; do
                for geometry in ${WEFT_FABRIC_GEOMETRIES:-sensor}; do
                    "$weft" solve "$sample.set" -c s.cal -o m.maps --method $method --geometry "$geometry" \
                        --mm-per-px "$mm" --force -q >/dev/null
                    "$weft" compare m.maps "$sample.truth/$geometry.maps" --json |
                        python3 -c "
import json, sys
d = json.load(sys.stdin)
print('$seed', '$sample', '$method', '$geometry', d['normal_deg']['mean'], d['normal_deg']['median'],
      d['albedo_delta_e']['mean'])" >>"$figures"
                done
            done
            rm -rf "$sample.set" "$sample.truth" m.maps
        done
    )
    rm -rf "$seed"
done

python3 - "$size" "$figures" <<'PY'
import sys
from collections import defaultdict

rows = defaultdict(dict)
for line in open(sys.argv[2]):
    seed, sample, method, geometry, mean, median, delta_e = line.split()
    rows[sample, geometry, method][seed] = (float(mean), float(median), float(delta_e))
most = {"plain-weave": 0.7, "twill": 0.7, "satin": 1.5, "corduroy": 2.5}
print(f"{'sample':12} {'geometry':8} {'method':7} {'mean':>6} {'worst':>6} {'median':>6} {'dE2000':>6}  seeds")
failed = []
for (sample, geometry, method), of in rows.items():
    n = len(of)
    mean, median, delta_e = (sum(x[i] for x in of.values()) / n for i in range(3))
    worst = max(x[0] for x in of.values())
    print(f"{sample:12} {geometry:8} {method:7} {mean:6.2f} {worst:6.2f} {median:6.2f} {delta_e:6.2f}  {n}")
    if method == "robust":
        if any(of[s][0] >= rows[sample, geometry, "lsq"][s][0] for s in of):
            failed.append(f"{sample} {geometry}: robust is not better than lsq")
        # what is asked for is asked at 1232 pixels: half as many blur the yarns
        limit = most.get(sample, 9) * (1 if int(sys.argv[1].split("x")[0]) >= 1232 else 2)
        if geometry == "sensor" and worst > limit:
            failed.append(f"{sample}: {worst:.2f} degrees, wanted {limit}")
if failed:
    sys.exit("FAILED: " + "; ".join(failed))
PY
