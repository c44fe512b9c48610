#!/usr/bin/env bash
# Scans two swatches on the virtual scanner, from the lights to a lit picture.
#
#   demo/demo.sh BUILD OUT
#
# Everything is measured from captured images; the rig's truth is used only at the end, to say how wrong
# the result is.  OUT/summary.json holds the figures and the seconds of each stage.
set -euo pipefail
export OPENBLAS_NUM_THREADS=1

build=$1 out=$2
weft=$build/bin/weft
samples=(plain-weave twill)
boards=$(seq 0 14)

rm -rf "$out"
mkdir -p "$out"/{boards,sets,pictures}
log=$out/log.txt

cleanup() { [ -z "${rig_pid:-}" ] || kill "$rig_pid" 2>/dev/null || true; }
trap cleanup EXIT
trap 'echo "demo: failed at line $LINENO; the log is $log" >&2; tail -5 "$log" >&2' ERR

seconds='{}'
stage() { # stage NAME COMMAND...: runs it, keeps its seconds
    local name=$1 begin
    shift
    begin=$(date +%s.%N)
    printf '%-22s' "$name"
    "$@" >>"$log" 2>&1
    seconds=$(jq -c --arg n "$name" --argjson t "$(echo "$(date +%s.%N) $begin" | awk '{printf "%.2f", $1 - $2}')" '.[$n] = $t' <<<"$seconds")
    jq -r --arg n "$name" '.[$n] | "\(.) s"' <<<"$seconds"
}

tell() { "$weft" rig --dir "$out/rig" --tell "$1"; }

start_rig() {
    "$weft" rig --dir "$out/rig" --seed 1 >"$out/rig.log" 2>&1 &
    rig_pid=$!
    for _ in $(seq 600); do
        [ -f "$out/rig/rig.json" ] && return
        kill -0 "$rig_pid" 2>/dev/null || { cat "$out/rig.log"; return 1; }
        sleep 0.1
    done
    return 1
}

capture() { # capture SAMPLE SET [OPTIONS]
    tell "sample $1"
    "$weft" capture "$2" --rig "$out/rig" "${@:3}"
}

capture_boards() {
    local i
    for i in $boards table; do
        capture "board-$i" "$out/boards/board-$i.set" --only-all
    done
}

calibrate() {
    "$weft" calibrate "$1" "${@:2}" -o "$out/scanner.cal"
}

stage "start the rig" start_rig
stage "capture boards" capture_boards
for set in white munsell macbeth; do
    stage "capture $set" capture "$set" "$out/sets/$set.set"
done
for sample in "${samples[@]}"; do
    stage "capture $sample" capture "$sample" "$out/sets/$sample.set"
    stage "truth $sample" tell "truth $out/truth/$sample 0.125" # while the sample lies there; read at the end
done
tell quit >>"$log"
stage "calibrate lens" calibrate lens "$out"/boards/board-?.set "$out"/boards/board-??.set --square-mm 10 \
    --board-on-table "$out/boards/board-table.set"
stage "calibrate lights" calibrate lights "$out/sets/white.set"
stage "calibrate linearity" calibrate linearity "$out/sets/munsell.set"
stage "calibrate white" calibrate white "$out/sets/munsell.set"
stage "calibrate colour" calibrate colour "$out/sets/macbeth.set" --overlay "$out/pictures/macbeth-found.png"
stage "calibration report" "$weft" calibrate report "$out/scanner.cal" -o "$out/report"
for sample in "${samples[@]}"; do
    stage "solve $sample" "$weft" solve "$out/sets/$sample.set" -c "$out/scanner.cal" -o "$out/$sample.maps" --mm-per-px 0.125
done
for sample in "${samples[@]}"; do
    stage "preview $sample" "$weft" preview "$out/$sample.maps" -o "$out/pictures/$sample-plane.png" --light 135,35
    stage "sphere $sample" "$weft" preview "$out/$sample.maps" -o "$out/pictures/$sample-sphere.png" --shape sphere --light 135,45
    stage "contact $sample" "$weft" contact "$out/sets/$sample.set" "$out/$sample.maps" -o "$out/pictures/$sample-contact.png"
done
for sample in "${samples[@]}"; do
    "$weft" compare "$out/$sample.maps" "$out/truth/$sample/plane.maps" --json >"$out/compare-$sample.json"
done
"$weft" compare "$out/scanner.cal" "$out/truth/twill/truth.cal" --json >"$out/compare-calibration.json"

# The figures at the top are those of the worse fabric.
jq -n --argjson seconds "$seconds" --slurpfile cal "$out/scanner.cal/calibration.json" \
    --slurpfile lights "$out/compare-calibration.json" --slurpfile a "$out/compare-plain-weave.json" \
    --slurpfile b "$out/compare-twill.json" '
    def figures: {normal_mean_deg: .normal_deg.mean, normal_median_deg: .normal_deg.median,
                  normal_p95_deg: .normal_deg.p95, albedo_delta_e_mean: .albedo_delta_e.mean};
    {"plain-weave": ($a[0] | figures), twill: ($b[0] | figures)} as $samples
    | ($samples | [.[]]) as $all
    | {normal_mean_deg: ([$all[].normal_mean_deg] | max),
       normal_median_deg: ([$all[].normal_median_deg] | max),
       albedo_delta_e_mean: ([$all[].albedo_delta_e_mean] | max),
       lens_rms_px: $cal[0].camera.rms_px,
       light_position_error_mm_mean: $lights[0].lights.position_error_mm_mean,
       samples: $samples,
       seconds: ($seconds + {total: ([$seconds[]] | add)})}' >"$out/summary.json"

echo
jq '. + {seconds: .seconds.total}' "$out/summary.json"
echo "pictures: $out/pictures/   figures: $out/summary.json   log: $log"
if ! jq -e '.normal_mean_deg <= 2 and .lens_rms_px <= 0.25 and .albedo_delta_e_mean <= 3' "$out/summary.json" >/dev/null; then
    echo "demo: a figure is beyond its limit (normals 2 deg, lens 0.25 px, albedo delta E 3)" >&2
    exit 1
fi
