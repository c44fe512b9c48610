#!/usr/bin/env bash
# The fault matrix of DSLRs in mid capture, on the virtual D5100 under the stock libgphoto2: each row must end with
# dark lamps, a reason in words, whole files under their final names, and a second attempt that succeeds.
# WEFT_ALL_FAULTS=1 tries the busy camera too, which takes ten seconds more.
# The cable that is pulled during a download is in capture_dslr, what the backend itself does in check_cam_gphoto.
set -u
# shellcheck source=tests/support/rig.sh
. "$WEFT_TEST_SOURCE/tests/support/rig.sh"
export HOME=$dir
export WEFT_CAMERA_PATIENCE=$patience
capture=("$weft" capture --rig "$dir/rig" --camera gphoto -q)

# begin NAME FAULT: takes a set and orders the fault when its first frame is there.  Its exit status is in $status,
# its words are in $dir/err.
begin() {
    rm -rf "$dir/$1.set"
    "${capture[@]}" "$dir/$1.set" --exposure 0.04 --lights 0,1,2,3 >"$dir/out" 2>"$dir/err" 9>&- &
    local pid=$!
    until [ -e "$dir/$1.set/ambient.nef" ] || ! kill -0 $pid 2>/dev/null; do sleep 0.02; done
    tell "dslr $2" >/dev/null
    status=0
    wait $pid || status=$?
    expect_dark "$1"
    [ "$(wc -l <"$dir/err")" -le 1 ] || fail "$1: more than a line of words: $(cat "$dir/err")"
    [ -z "$(find "$dir/$1.set" -name '.weft-*')" ] || fail "$1: half a file: $(ls -a "$dir/$1.set")"
    whole "$dir/$1.set"
    tell "dslr reset" >/dev/null
}

# whole SET: every frame that is listed is there with its hash
whole() {
    local file hash
    while read -r file hash; do
        [ "$(sha256sum <"$1/$file" | cut -d' ' -f1)" = "$hash" ] || fail "$1/$file: is not what set.json says"
    done < <(jq -r '.frames[] | "\(.file) \(.sha256)"' "$1/set.json")
}

# goes_on NAME: five frames, of which some may have been taken twice
goes_on() {
    [ "$status" = 0 ] || expect 0 '"frames":5' "${capture[@]}" "$dir/$1.set" --resume --json
    jq -e '.state == "complete" and ([.frames[] | select(.role == "light") | .light] == [range(4)])' \
        "$dir/$1.set/set.json" >/dev/null || fail "$1: is not complete"
    whole "$dir/$1.set"
    echo "ok    $1"
}

# until_caught NAME FAULT: the same, again when the fault came too late, behind the last frame
until_caught() {
    for _ in 1 2 3 4; do
        begin "$1" "$2"
        if [ "$status" != 0 ] || jq -e '[.frames[].capture.retries[]] != []' "$dir/$1.set/set.json" >/dev/null; then break; fi
    done
}

# stopped NAME WORDS: the capture failed, and said so
stopped() {
    [ "$status" = 1 ] || fail "$1: exit $status"
    grep -q "$2" "$dir/err" || fail "$1: does not say \"$2\": $(cat "$dir/err")"
}

# survived NAME WORDS: the capture took the frame again, for this reason
survived() {
    [ "$status" = 0 ] || fail "$1: exit $status: $(cat "$dir/err")"
    jq -e --arg words "$2" '[.frames[].capture.retries[] | select(contains($words))] | length > 0' \
        "$dir/$1.set/set.json" >/dev/null || fail "$1: no retry says \"$2\": $(jq -c '[.frames[].capture.retries]' "$dir/$1.set/set.json")"
}

start_twill

if [ -n "${WEFT_ALL_FAULTS:-}" ]; then # five helpers are given up one after the other
    until_caught busy-60-s "fault stuck 60"
    stopped busy-60-s "did not answer in time"
    goes_on busy-60-s
fi

until_caught io-error "fault line 1"
survived io-error "the line to the camera broke"
goes_on io-error

begin raw-and-jpeg "turn 0x5004 5"
[ "$status" = 0 ] || fail "raw-and-jpeg: exit $status: $(cat "$dir/err")"
[ -z "$(find "$dir/raw-and-jpeg.set" -iname '*.jp*g')" ] || fail "raw-and-jpeg: a JPEG is in the set"
goes_on raw-and-jpeg

until_caught card-full "fault card-full 1"
stopped card-full "there is no room"
goes_on card-full

finish
