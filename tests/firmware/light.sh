#!/usr/bin/env bash
# weft light against the real firmware on a simulated board.
set -u
weft=$WEFT_TEST_BIN/weft
dir=$(mktemp -d)
failures=0
trap 'kill $holder 2>/dev/null; rm -rf "$dir"' EXIT
holder=

coproc board { "$WEFT_TEST_BUILD/tests/virtual_controller" "$WEFT_TEST_BUILD/firmware/weft-firmware.elf"; }
read -r pty <&"${board[0]}" || exit 1

fail() { echo "FAILED: $*"; failures=$((failures + 1)); }
lights() { echo lights >&"${board[1]}"; read -r mask _ <&"${board[0]}"; }
# expect STATUS WORDS COMMAND...: exit status, and words in what it says on either stream
expect() {
    local wanted=$1 words=$2 got
    shift 2
    "$@" >"$dir/out" 2>"$dir/err"
    got=$?
    [ $got = "$wanted" ] || fail "$* gave $got, wanted $wanted: $(cat "$dir/err")"
    grep -q -- "$words" "$dir/out" "$dir/err" || fail "$* does not say \"$words\": $(cat "$dir/out" "$dir/err")"
}

# hold ARGUMENTS...: lights in the background; goes on when they are on
hold() {
    rm -f "$dir/on" "$dir/note"
    "$weft" light "$@" --port "$pty" >"$dir/on" 2>"$dir/note" &
    holder=$!
    while kill -0 $holder 2>/dev/null; do
        grep -q '^on' "$dir/on" 2>/dev/null && return
        sleep 0.05
    done
    fail "light $*: not on: $(cat "$dir/note")"
}
# ended STATUS: the lights held in the background have ended so
ended() {
    wait $holder
    local got=$?
    holder=
    [ $got = "$1" ] || fail "ended with $got, wanted $1: $(cat "$dir/note")"
    for _ in $(seq 600); do
        lights
        [ "$mask" = 0 ] && return
        sleep 0.05
    done
    fail "still lit: $mask"
}

# status
expect 0 'state       IDLE' "$weft" light status --port "$pty"
expect 0 '"n_lights":10' "$weft" light status --port "$pty" --json
expect 0 '"reset_cause":"EXTERNAL"' "$weft" light status --port "$pty" --json

# on, held beyond the firmware's 2 s, without going dark in between
hold on 3 5-6
grep -q '^on: 3,5,6 at 100 %' "$dir/on" || fail "light on says $(cat "$dir/on")"
for _ in 1 2 3 4 5 6; do
    lights
    [ "$mask" = $((8 + 32 + 64)) ] || fail "lights are $mask"
    sleep 0.4
done
# the port is its own
expect 1 'another program is using this port' "$weft" light off --port "$pty"
lights
[ "$mask" = 104 ] || fail "a second program disturbed the lights: $mask"
# Ctrl-C
kill -INT $holder
ended 0
grep -q 'off after [2-9]' "$dir/note" || fail "says $(cat "$dir/note")"

# a time; on the board's clock, which may be slower than ours on a busy machine
expect 0 'off after 0\.[1-5]' "$weft" light on all --seconds 0.5 --port "$pty"
expect 0 '"lights":\[0,1,2,3,4,5,6,7,8,9\]' "$weft" light on all --seconds 0.01 --port "$pty" --json
expect 0 '"level":32,"level_max":256' "$weft" light level 0 12.5 --seconds 0.01 --port "$pty" --json
lights
[ "$mask" = 0 ] || fail "still lit: $mask"

# killed
hold on 0
kill -KILL $holder
ended 137 2>/dev/null

# the terminal is closed: dark; under nohup, lit
hold on 0
kill -HUP $holder
ended 129 2>/dev/null
trap '' HUP
hold on 2
trap - HUP
kill -HUP $holder
sleep 0.3
lights
[ "$mask" = 4 ] || fail "a SIGHUP that is ignored leaves lights $mask"
kill -INT $holder
ended 0

# cancelled before its time
hold on 1 --seconds 30
kill -TERM $holder
ended 130

# a board that resets under it
hold on 1
echo reset >&"${board[1]}"
read -r mask _ <&"${board[0]}"
ended 1
grep -q 'has reset meanwhile' "$dir/note" || fail "a reset says $(cat "$dir/note")"

# off, and wrong usage
expect 0 'all lights are off' "$weft" light off --port "$pty"
expect 1 'no light 10' "$weft" light on 10 --port "$pty"
expect 2 'names no lights' "$weft" light on 3,x --port "$pty"
expect 2 'names no lights' "$weft" light on 5-3 --port "$pty"
expect 2 'names no lights' "$weft" light on -- -1
expect 2 'no level' "$weft" light level 1 101 --port "$pty"
expect 1 'the least light of this controller is 0.39 %' "$weft" light level 1 0.1 --port "$pty"
expect 0 'off: 1' "$weft" light level 1 0 --seconds 0.01 --port "$pty"
expect 2 'no level' "$weft" light level 1 nan --port "$pty"
expect 2 'LIGHTS' "$weft" light on
expect 1 'there is no such port' "$weft" light status --port /dev/ttyNOT
expect 1 'no virtual scanner' "$weft" light status --rig "$dir"
expect 2 'light on' "$weft" light

board_in=${board[1]}
exec {board_in}>&-
exit $((failures > 0))
