#!/usr/bin/env bash
# weft rig, weft rig --tell and weft capture as a user types them: two samples, two sets that differ.
set -u
# shellcheck source=tests/support/rig_start.sh
. "$WEFT_TEST_SOURCE/tests/support/rig_start.sh"
weft=$WEFT_TEST_BIN/weft
work=$(mktemp -d)
# shellcheck disable=SC2317
clean() {
    stop_rig
    rm -rf "$work"
}
trap clean EXIT
fail() {
    echo "rig_capture: $*" >&2
    cat "$work/r.err" >&2
    exit 1
}
cd "$work" || exit 1

# What cannot be meant is refused before any device is looked for.
refused() { # WORDS OPTIONS...
    local words=$1
    shift
    "$weft" capture x.set --rig r "$@" >capture.out 2>capture.err
    [ $? = 2 ] || fail "capture $*: the exit status is not 2"
    grep -qF -- "$words" capture.err || fail "capture $*: says $(cat capture.err)"
}
for wrong in 0.04,0.05 each,auto 3:0.01,3:0.02 99:1 0.5:1 '0.04,' ',' soon 0 -1 nan 3:each 3: :1 0.04,3:0.01s; do
    refused "--exposure $wrong: wanted auto, each or" --exposure "$wrong"
done
for wrong in 0 10 1.5 3,1 3:0 3:auto 40:3 3: some; do
    refused "--bracket $wrong: wanted auto or 1 to 9" --bracket "$wrong"
done
refused "light 3 has its own --exposure but is not in --lights" --lights 0,1 --exposure 0.04,3:0.01
refused "light 3 has its own --bracket but is not in --lights" --lights 0,1 --bracket 3:3
refused "there is no field {lamp}" --file-name "{kind}-{lamp}"
refused "leave out the '/'" --file-name "{kind}/{light}"

start_rig r --sample white --size 308x204 --seed 5
cmp -s <(jq -S . r.out) <(jq -S . r/rig.json) || fail "rig.json is not what was printed"

"$weft" capture white.set --rig r --exposure 0.03 -q || fail "capture of the white sheet"
"$weft" rig --dir r --tell "sample twill" >tell.out || fail "sample twill"
[ "$(jq -r .sample tell.out)" = twill ] || fail "the reply names no twill"
"$weft" capture twill.set --rig r --exposure 0.03 -q || fail "capture of the twill"
[ "$(jq '[.frames[] | select(.role == "light")] | length' twill.set/set.json)" = 10 ] || fail "not ten lights"
cmp -s white.set/light-00.dng twill.set/light-00.dng && fail "both samples look the same"

# Exposures and brackets of single lights, names from a template, sidecars; the set solves whatever its files are called.
"$weft" capture --dry-run --rig r --json -q >look.json || fail "dry run"
jq -e '(.lights | length) == 11 and (.lights[1:] | all(.suggested_s > 0 and .bracket >= 1)) and .longest_s >= .suggested_s' \
    look.json >tell.out || fail "the dry run suggests nothing: $(cat look.json)"
"$weft" capture own.set --rig r -q --exposure each,3:0.01 --bracket auto,3:3,4:2 --sidecar --name "Harris Tweed/7" \
    --file-name "{set}_{kind}{light}_{exposure}" --json >own.json || fail "capture of single lights"
jq -e '.shortest_s == 0.01 and .exposure_s > 0.01' own.json >tell.out || fail "exposures: $(cat own.json)"
jq -e '[.frames[] | select(.light == 3) | .exposure_s] == [0.01, 0.0025, 0.04]' own.set/set.json >tell.out ||
    fail "light 3 has not the bracket that was asked for"
jq -e '[.frames[] | select(.light == 4)] | length == 2 and .[1].exposure_s / .[0].exposure_s > 3.9' own.set/set.json \
    >tell.out || fail "light 4 has not the bracket that was asked for"
jq -e '[.frames[] | select(.role == "light" and .light != 3 and (.capture.bracket // 0) == 0)
    | .capture.statistics.high | max > 0.6 and max < 0.8] | all' own.set/set.json >tell.out ||
    fail "a light's own exposure misses 70 %: $(jq -c '[.frames[].capture.statistics.high]' own.set/set.json)"
jq -e '[.frames[] | select(.light == 3) | .capture.weight] | add > 0.999 and add < 1.001 and .[1] < .[0] and .[0] < .[2]' \
    own.set/set.json >tell.out || fail "weights: $(jq -c '[.frames[].capture.weight]' own.set/set.json)"
# the sensor's full well is 30000 electrons
jq -e '.sensor.noise | .shot * 30000 > 0.9 and .shot * 30000 < 1.1 and .gain == 1' own.set/set.json >tell.out ||
    fail "noise: $(jq -c .sensor own.set/set.json)"
[ -f own.set/Harris-Tweed-7_light03_0.0025s.dng ] || fail "names: $(ls own.set)"
jq -e --slurpfile set own.set/set.json '.frame == ($set[0].frames[] | select(.light == 3 and .capture.bracket == 0))' \
    own.set/Harris-Tweed-7_light03_0.0025s.dng.json >tell.out || fail "a sidecar differs from set.json"
"$weft" rig --dir r --tell "truth t" >tell.out || fail "truth"
"$weft" solve own.set -c t/truth.cal -o own.maps --height poisson -q || fail "solve of the set with brackets"
jq -e '.result | .height == (.height | floor) and .width > .height and .height > 100 and .height_map.method == "poisson" and
    .height_map.relief_mm > 0' own.maps/maps.json >tell.out || fail "maps.json: $(jq -c .result own.maps/maps.json)"

# A wire that goes to another lamp: the controller says all is well, the picture does not.
"$weft" rig --dir r --tell "board lamp 5 as 2" >tell.out || fail "board lamp 5 as 2"
"$weft" rig --dir r --tell "board lamp 5 as 12" >tell.out 2>tell.err && fail "there is no lamp 12"
"$weft" capture wire.set --rig r -q --lights 2,5,7 --exposure 0.03 2>capture.err
[ $? = 1 ] || fail "another lamp: the exit status is not 1"
grep -q "light 5: the same picture as under light 2 (they differ by 0.[0-9]* %): does its wire go to that lamp?" capture.err ||
    fail "another lamp: says $(cat capture.err)"
"$weft" rig --dir r --tell "board lamp 5 good" >tell.out || fail "board lamp 5 good"
"$weft" capture wire.set --rig r -q --resume --json >wire.json || fail "another lamp: the second attempt"
jq -e '.kept == 2 and .taken == 2' wire.json >tell.out || fail "another lamp: $(cat wire.json)"

# A relative folder is the client's, not the rig's.
mkdir elsewhere
(cd elsewhere && "$weft" rig --dir ../r --tell "truth out 0.5") >tell.out || fail "truth"
[ -f elsewhere/out/plane.maps/normal.exr ] || fail "the truth is not where the client asked for it"

# A sequence that is cut off by the cable: dark, and begun again when the cable is in again.
tell() { "$weft" rig --dir r --tell "$1" >tell.out || fail "$1"; }
echo '{"weft":"sequence","version":1,"steps":[{"lights":[3],"hold_ms":1500},{"lights":[5],"hold_ms":20}]}' >two.json
"$weft" light set serial WL-3 --rig r >tell.out || fail "light set"
for try in 1 2 3; do # until the cable is pulled while the lamp is on
    "$weft" light run two.json --rig r --json >run.out 2>run.err 9>&- &
    run=$!
    until tell state && jq -e '.lights_on == [3]' tell.out >lit.out; do
        kill -0 $run 2>/dev/null || fail "light run: $(cat run.err)"
    done
    tell "board unplug"
    for _ in $(seq 1000); do
        tell state
        jq -e '.lights_on == []' tell.out >lit.out && break
        sleep 0.02
    done
    jq -e '.lights_on == []' tell.out >lit.out || fail "unplugged, and still lit: $(cat tell.out)"
    tell "board plug"
    wait $run || fail "light run did not go on: $(cat run.err)"
    jq -e '.cut_off == [0]' run.out >lit.out && break
    [ $try -lt 3 ] || fail "nothing was cut off: $(cat run.out run.err)"
done
jq -e '.runs | length == 1 and (.[0] | length) == 2' run.out >lit.out || fail "light run: $(cat run.out)"
grep -q 'run 0 was cut off, the lights are off: .*has vanished' run.err || fail "light run says: $(cat run.err)"
grep -q 'run 0 begins again with its first step' run.err || fail "light run says: $(cat run.err)"

# Refusals: exit 1, one line that says why.
"$weft" rig --dir r --tell "sample tweed" >tell.out 2>tell.err && fail "an unknown sample was accepted"
[ "$(wc -l <tell.err)" = 1 ] || fail "not one line: $(cat tell.err)"
grep -q 'no sample "tweed"' tell.err || fail "unknown sample: $(cat tell.err)"
"$weft" rig --dir nowhere --tell state >tell.out 2>tell.err && fail "no rig answered"
grep -q 'nowhere/control.sock' tell.err || fail "no rig: $(cat tell.err)"

"$weft" rig --dir r --tell quit >tell.out || fail "quit"
await_rig || fail "the rig ended with $?"
[ -e r/rig.json ] && fail "rig.json is still there"
exit 0
