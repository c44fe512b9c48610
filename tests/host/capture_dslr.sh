#!/usr/bin/env bash
# Ten lights through libgphoto2 and the virtual D5100: capture, stop, resume, solve, against the truth and against
# the same scan by the GigE Vision camera.
# shellcheck source=tests/support/script.sh
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
[ -x "$WEFT_TEST_BIN/weft-rig" ] || { echo "skipped: this build has no weft-rig"; exit 77; }
exec 9>/tmp/weft-rig.lock
flock 9
export HOME=$work
rig=
# shellcheck disable=SC2317
clean_up() {
    [ -z "$rig" ] || kill "$rig" 2>/dev/null
    rm -rf "$work"
}
trap clean_up EXIT
fail() {
    echo "FAILED: $*"
    exit 1
}

"$weft" rig --dir r --sample twill --size 616x408 >rig.out 2>rig.err 9>&- &
rig=$!
for _ in $(seq 300); do
    [ -s rig.out ] && break
    kill -0 "$rig" 2>/dev/null || { cat rig.err; exit 1; }
    sleep 0.1
done
tell() { "$weft" rig --dir r --tell "$1"; }
expect_dark() {
    tell state | jq -e '.lights_on == []' >/dev/null || fail "$1: lamps are on"
}

expect 0 "ready" "$weft" devices --rig r --camera gphoto
expect 0 "11 frames (11 taken" "$weft" capture dslr.set --rig r --camera gphoto --exposure 0.04
expect 0 "11 frames (11 taken" "$weft" capture gige.set --rig r --exposure 0.04
jq -e '.camera.backend == "gphoto" and .camera.serial == "6001234" and .sensor.white == 15846 and
       ([.frames[].file] | index("light-09.nef")) != null and .state == "complete"' dslr.set/set.json >/dev/null ||
    fail "set.json: $(jq -c '[.camera, .sensor, [.frames[].file]]' dslr.set/set.json)"
# Normals of both scans against the truth: the DSLR's are as good.
expect 0 ok tell "truth $work/truth"
for set in dslr gige; do
    expect 0 "with an answer" "$weft" solve $set.set -c truth/truth.cal -o $set.maps --geometry sensor
    "$weft" compare truth/sensor.maps $set.maps --json >$set.json 2>err || fail "compare $set: $(cat err)"
done
jq -ne 'input as $dslr | input as $gige |
    ($dslr.normal_deg.mean - $gige.normal_deg.mean | fabs) < 0.05 and
    ($dslr.albedo_luminance.mean - $gige.albedo_luminance.mean | fabs) < 0.005' dslr.json gige.json >/dev/null ||
    fail "not as good: $(jq -c '[.normal_deg.mean, .albedo_luminance.mean]' dslr.json gige.json)"
jq -rs 'map("normals \(.normal_deg.mean) deg, luminance \(.albedo_luminance.mean)") | "DSLR: \(.[0])\nGigE: \(.[1])"' \
    dslr.json gige.json

# The cable is pulled in mid download: dark lamps, words, whole files; plugged in, the set is completed.
(
    until [ -e cut.set/light-02.nef ]; do sleep 0.02; done
    tell "dslr fault unplug 50" >/dev/null
) &
expect 1 "does not come back; plug it in" "$weft" capture cut.set --rig r --camera gphoto --exposure 0.04
wait $!
expect_dark "unplugged"
[ -z "$(find cut.set -name '.weft-*')" ] || fail "half a file: $(ls -a cut.set)"
[ "$(jq -r .state cut.set/set.json)" = capturing ] || fail "the set says it is complete"
for frame in $(jq -r '.frames[] | .sha256 + ":" + .file' cut.set/set.json); do
    [ "$(sha256sum <"cut.set/${frame#*:}" | cut -c1-64)" = "${frame%%:*}" ] || fail "${frame#*:} is not whole"
done
expect 1 "check the cable" "$weft" capture cut.set --rig r --camera gphoto --resume
expect 0 ok tell "dslr plug"
expect 0 "11 frames" "$weft" capture cut.set --rig r --camera gphoto --resume
expect_dark "resumed"

# An empty battery.
expect 0 ok tell "dslr turn 0x5001 4"
expect 1 "battery is at 4 %" "$weft" capture flat.set --rig r --camera gphoto --exposure 0.04
expect 0 ok tell "dslr turn 0x5001 90"
expect 0 "3 frames" "$weft" capture flat.set --rig r --camera gphoto --exposure 0.04 --lights 0,1
expect 0 ok tell quit
wait "$rig"
