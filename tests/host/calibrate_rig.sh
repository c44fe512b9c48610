#!/usr/bin/env bash
# The virtual scanner calibrated from its own photographs and compared with what it is: lens, pose, lights.
set -u
weft=$WEFT_TEST_BIN/weft
[ -f "$WEFT_TEST_BIN/libweft_lens_opencv.so" ] || { echo "skipped: this build has no OpenCV"; exit 77; }
# shellcheck source=tests/support/rig_start.sh
. "$WEFT_TEST_SOURCE/tests/support/rig_start.sh"
dir=$(mktemp -d /tmp/weft-calibrate-XXXXXX)

# shellcheck disable=SC2317 # called by the trap
clean_up() {
    stop_rig
    rm -rf "$dir"
}
trap clean_up EXIT
cd "$dir" || exit 1

die() {
    echo "FAILED: $*"
    exit 1
}

start_rig rig

shoot() { # SAMPLE SET OPTIONS...
    local sample=$1 set=$2
    shift 2
    "$weft" rig --dir rig --tell "sample $sample" >/dev/null || die "sample $sample"
    "$weft" capture "$set" --rig rig -q "$@" >/dev/null || die "capture of $set"
}
refused() { # WORDS COMMAND...
    local words=$1
    shift
    "$@" >out 2>&1 && die "$* was taken"
    grep -qF -- "$words" out || die "$*: does not say \"$words\": $(cat out)"
}

for i in $(seq 0 14); do
    shoot "board-$i" "board-$i.set" --only-all
done
shoot board-table table.set --only-all
shoot white white.set --exposure 0.04
shoot white bright.set --exposure 0.08
shoot macbeth chart.set --exposure 0.04
"$weft" rig --dir rig --tell "truth $dir/truth" >/dev/null || die "truth"

"$weft" calibrate lens board-*.set -o scanner.cal --square-mm 10 --board-on-table table.set -q || die "lens"
refused 'of the white sheet is saturated' "$weft" calibrate lights bright.set -o scanner.cal
refused 'fill the frame' "$weft" calibrate lights chart.set -o scanner.cal
refused 'no board of 9x6' "$weft" calibrate lens -o scanner.cal --force --board-on-table white.set
"$weft" calibrate lights white.set -o scanner.cal -q || die "lights"
"$weft" compare scanner.cal truth/truth.cal
"$weft" compare scanner.cal truth/truth.cal --json >difference.json || die "compare"
python3 - <<'PY'
import json
d, c = json.load(open("difference.json")), json.load(open("scanner.cal/calibration.json"))
assert c["camera"]["rms_px"] <= 0.15, c["camera"]
assert c["reports"]["lens"]["views_used"] == 15 and c["reports"]["lights"]["settled"]
assert abs(d["camera"]["fx_ratio"] - 1) < 0.004 and d["camera"]["projection_px_max"] < 1, d["camera"]
lights = d["lights"]
assert lights["position_error_mm_mean"] < 2.5 and lights["position_error_mm_max"] < 9, lights
assert lights["direction_error_deg_max"] < 0.5 and lights["irradiance_ratio_spread"] < 0.004, lights
assert abs(lights["irradiance_ratio_mean"] - 1) < 0.01, lights
assert max(l["residual"] for l in c["lights"]) < 0.003
PY
