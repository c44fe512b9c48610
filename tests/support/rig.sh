# Sourced by the end-to-end scripts that capture with the virtual scanner: a scratch folder, the scanner with a twill,
# and what must hold after every failure.
# shellcheck shell=bash
weft=$WEFT_TEST_BIN/weft
# shellcheck source=tests/support/rig_start.sh
. "$WEFT_TEST_SOURCE/tests/support/rig_start.sh"
dir=$(mktemp -d /tmp/weft-rig-test-XXXXXX)
failures=0
# Seconds for WEFT_CAMERA_PATIENCE: one where this test has a processor, more where it must share.
# shellcheck disable=SC2034 # used by the scripts
patience=$(awk -v n="$(nproc)" '{ print 1 + int($1 / n) }' /proc/loadavg)

# shellcheck disable=SC2317 # called by the trap
clean_up() {
    stop_rig
    ! mountpoint -q "$dir/small" || umount "$dir/small"
    rm -rf "$dir"
}
trap clean_up EXIT

fail() {
    echo "FAILED: $*"
    failures=$((failures + 1))
}

# expect STATUS WORDS COMMAND...: the exit status, and words in what it says
expect() {
    local wanted=$1 words=$2 status=0
    shift 2
    "$@" >"$dir/out" 2>"$dir/err" || status=$?
    [ "$status" = "$wanted" ] || fail "$*: exit $status, wanted $wanted: $(cat "$dir/err")"
    grep -qe "$words" "$dir/out" "$dir/err" || fail "$*: does not say \"$words\": $(cat "$dir/out" "$dir/err")"
}

start_twill() {
    start_rig "$dir/rig" --size 616x408 --sample twill
}

tell() {
    "$weft" rig --dir "$dir/rig" --tell "$1"
}

# The lamps are dark, and went dark within a second of simulated time before now.
expect_dark() {
    tell state | tee "$dir/state" | grep -q '"lights_on":\[\]' || fail "$1: lamps are on: $(cat "$dir/state")"
}

# The lamps go dark within a second and a bit by the board's clock, which is the machine's only when it is not busy.
await_dark() {
    local begun=
    while tell state >"$dir/state" && ! jq -e '.lights_on == []' "$dir/state" >/dev/null; do
        begun=${begun:-$(jq .simulated_s "$dir/state")}
        jq -e ".simulated_s - $begun < 1.2" "$dir/state" >/dev/null || break
        sleep 0.02
    done
    expect_dark "$1"
}

# check_files SET STATE FRAMES: set.json says so; every frame is there with its hash; nothing is half written
check_files() {
    local listed=0 file hash
    jq -e --arg state "$2" --argjson n "$3" '.state == $state and (.frames | length) >= $n' "$1/set.json" >/dev/null ||
        fail "$1: not $2 with at least $3 frames: $(jq -c '[.state, (.frames | length)]' "$1/set.json")"
    while read -r file hash; do
        listed=$((listed + 1))
        [ "$(sha256sum <"$1/$file" | cut -d' ' -f1)" = "$hash" ] || fail "$1/$file: is not what set.json says"
    done < <(jq -r '.frames[] | "\(.file) \(.sha256)"' "$1/set.json")
    for file in "$1"/*.dng; do # one may be written and not yet listed, but never half written
        [ "$(stat -c %s "$file")" = "$(stat -c %s "$1/ambient.dng")" ] || fail "$file: is not whole"
    done
    [ "$(find "$1" -name '*.dng' | wc -l)" -le $((listed + 1)) ] || fail "$1: holds frames that set.json does not list"
}

# Waits until SET has N frames.
wait_for_frames() {
    local begun=$SECONDS
    while [ $((SECONDS - begun)) -lt 60 ]; do
        [ "$(jq '.frames | length' "$1/set.json" 2>/dev/null || echo 0)" -ge "$2" ] && return
        sleep 0.02
    done
    fail "$1: never had $2 frames"
}

finish() {
    [ $failures = 0 ] && echo "all as it should be in $SECONDS s"
    exit $((failures > 0))
}
