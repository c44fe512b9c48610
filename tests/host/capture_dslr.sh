#!/usr/bin/env bash
# Ten lights through libgphoto2 and the virtual D5100: capture and solve, against the truth and against the same scan
# by the GigE Vision camera.  Cut off in mid download and resumed.  Then WEFT_SOAK_COUNT sets (default 1) while the
# body misbehaves at random (WEFT_SOAK_SEED) and its helper process is killed: every set gets complete, and its
# normals are those of the undisturbed scan, so no frame has another light.
# shellcheck source=tests/support/script.sh
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
# shellcheck source=tests/support/rig_start.sh
. "$WEFT_TEST_SOURCE/tests/support/rig_start.sh"
export HOME=$work
# shellcheck disable=SC2317
clean_up() {
    stop_rig
    rm -rf "$work"
}
trap clean_up EXIT
fail() {
    echo "FAILED: $*"
    exit 1
}

start_rig r --sample twill --size 616x408
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

# Misbehaving at random.
RANDOM=${WEFT_SOAK_SEED:-7}
calm=$(jq -r .normal_deg.mean dslr.json)
deeds=("fault stale 1" "fault twice 1" "fault line 1" "fault short 1" "fault burst 1" "fault busy 1" "fault stuck 1"
    "fault no-shutter 1" "fault unplug 50" "fault jpeg 1" "turn 0x5004 2" "turn 0x5004 5" "turn 0xd100 65566" kill)
n_deeds=0
: >deeds
disturb() { # PID of weft
    local deed=${deeds[RANDOM % ${#deeds[@]}]}
    n_deeds=$((n_deeds + 1))
    echo "$deed" >>deeds
    if [ "$deed" = kill ]; then
        pgrep -P "$1" | xargs -r kill -9
    else
        tell "dslr $deed" >/dev/null
    fi
}
n_resumes=0
for n in $(seq "${WEFT_SOAK_COUNT:-1}"); do
    options=(--exposure 0.04)
    for _ in $(seq 12); do
        "$weft" capture "$n.set" --rig r --camera gphoto -q "${options[@]}" >out 2>err &
        pid=$!
        while kill -0 $pid 2>/dev/null; do
            sleep "0.$((RANDOM % 9))"
            [ $((RANDOM % 3)) != 0 ] || disturb $pid
        done
        wait $pid && break
        n_resumes=$((n_resumes + 1))
        [ "$(wc -l <err)" -le 2 ] || fail "more than a line of words: $(cat err)"
        [ -e "$n.set/set.json" ] && options=(--resume)
        tell "dslr reset" >/dev/null
    done
    tell "dslr reset" >/dev/null
    [ "$(jq -r .state "$n.set/set.json")" = complete ] || fail "set $n is not complete: $(cat err)"
    "$weft" solve "$n.set" -c truth/truth.cal -o soak.maps --geometry sensor --force -q >out 2>&1 || fail "$(cat out)"
    found=$("$weft" compare truth/sensor.maps soak.maps --json 2>/dev/null | jq -r .normal_deg.mean)
    jq -en "($found - $calm) | fabs < 0.01" >/dev/null ||
        fail "set $n: normals are $found degrees off, undisturbed $calm; $(cat deeds)"
    rm -rf "$n.set"
done
echo "${WEFT_SOAK_COUNT:-1} sets complete, normals as undisturbed ($calm degrees); $n_deeds deeds, $n_resumes resumes"
sort deeds | uniq -c
expect 0 ok tell quit
await_rig
