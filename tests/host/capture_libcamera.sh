#!/usr/bin/env bash
# Ten lights through libcamera: its stock library and UVC pipeline on a sensor that v4l2_sensor.c plays under
# umockdev, which sees the virtual scanner's table; and the ways in which such a camera fails.
set -u
command -v umockdev-run >/dev/null || { echo "skipped: umockdev is not installed"; exit 77; }
[ -x "$WEFT_TEST_BIN/weft-camera-libcamera" ] || { echo "skipped: this build has no libcamera"; exit 77; }
[ -z "${WEFT_TEST_SANITIZED:-}" ] || { echo "skipped: umockdev and the sanitizers cannot both be first"; exit 77; }
# shellcheck source=tests/support/rig.sh
. "$WEFT_TEST_SOURCE/tests/support/rig.sh"
export WEFT_SENSOR_RIG=$dir/rig/control.sock WEFT_SENSOR_SIZE=616x408 WEFT_SENSOR_FAULT=$dir/fault
export WEFT_CAMERA_PATIENCE=$((4 + patience))
id='libcamera:\_SB_.PCI0.XHC_-2:1.0-0bda:5e1f'

with_sensor() { # COMMAND...: runs it where the sensor is plugged in
    umockdev-run -d "$WEFT_TEST_SOURCE/tests/host/v4l2_sensor.umockdev" -- \
        sh -c 'LD_PRELOAD="$0:$LD_PRELOAD" exec "$@"' "$WEFT_TEST_BUILD/tests/libv4l2_sensor.so" "$@"
}

capture() { with_sensor "$weft" capture --rig "$dir/rig" -q --exposure 0.04 --camera "$id" "$@"; }

# fault NAME: what the sensor does wrong in its next frame
fault() {
    wait_for_frames "$1.set" 3
    echo "$2" >"$dir/fault"
}

start_twill
expect 0 "libcamera Weft test sensor: ready" with_sensor "$weft" devices
expect 1 "there is no such camera; check its cable" "$weft" capture --rig "$dir/rig" --camera "$id" "$dir/none.set"
expect 2 "wire" "$weft" capture --rig "$dir/rig" --camera "$id" --trigger pigeon "$dir/none.set"

expect 0 '"frames":11,"taken":11' capture "$dir/ten.set" --json
check_files "$dir/ten.set" complete 11
expect_dark "ten lights"

# each light's frame shows its own light: what GigE Vision sees of the same table, but for noise
expect 0 '"frames":11' "$weft" capture --rig "$dir/rig" -q --exposure 0.04 "$dir/gige.set" --json
worst=$(jq -s '[range(11) as $i | [.[] | .frames[$i].capture.statistics.mean[1]] |
    (.[0] - 256 / 15871) / (.[1] * 15615 / 15871) - 1 | fabs] | .[1:] | max' "$dir/ten.set/set.json" "$dir/gige.set/set.json")
jq -n -e "$worst < 0.004" >/dev/null || fail "libcamera and GigE Vision differ by $worst"

tell "truth $dir/truth" >/dev/null
for kind in ten gige; do
    expect 0 "" "$weft" solve "$dir/$kind.set" -c "$dir/truth/truth.cal" -o "$dir/$kind.maps" -q
done
"$weft" compare "$dir/ten.maps" "$dir/gige.maps" --json >"$dir/maps.json" 2>"$dir/err" || fail "compare: $(cat "$dir/err")"
jq -e '.normal_deg.mean < 1 and .only_a == 0' "$dir/maps.json" >/dev/null || fail "maps: $(cat "$dir/maps.json")"

# ---- faults ----
for kind in error gap dqbuf; do
    : >"$dir/fault"
    capture "$dir/$kind.set" >"$dir/out" 2>&1 9>&- &
    pid=$!
    fault "$dir/$kind" $kind
    wait $pid || fail "$kind: $(cat "$dir/out")"
    check_files "$dir/$kind.set" complete 11
    expect_dark "$kind"
    jq -c --arg k "$kind" '[$k, (.frames[].capture.retries[])]' "$dir/$kind.set/set.json"
done
jq -e '[.frames[].capture.retries[] | select(contains("skipped 3 frames"))] | length > 0' "$dir/gap.set/set.json" \
    >/dev/null || fail "gap: nobody noticed"
jq -e '[.frames[].capture.retries[] | select(contains("damaged"))] | length > 0' "$dir/error.set/set.json" \
    >/dev/null || fail "error: nobody noticed"

: >"$dir/fault"
capture "$dir/unplug.set" >"$dir/out" 2>&1 9>&- &
pid=$!
fault "$dir/unplug" unplug
wait $pid && fail "unplug: the capture went on"
grep -q "light [0-9]: .*camera .*0bda:5e1f" "$dir/out" || fail "unplug: says $(cat "$dir/out")"
cat "$dir/out"
expect_dark unplug
check_files "$dir/unplug.set" capturing 3
: >"$dir/fault"
expect 0 '"frames":11' capture "$dir/unplug.set" --resume --json
check_files "$dir/unplug.set" complete 11

finish
