#!/usr/bin/env bash
# weft light run, set and status --watch against the real firmware on a simulated board.
set -u
weft=$WEFT_TEST_BIN/weft
dir=$(mktemp -d)
failures=0
trap 'rm -rf "$dir"' EXIT

coproc board { "$WEFT_TEST_BUILD/tests/virtual_controller" "$WEFT_TEST_BUILD/firmware/weft-firmware.elf"; }
read -r pty <&"${board[0]}" || exit 1

fail() { echo "FAILED: $*"; failures=$((failures + 1)); }
tell() { echo "$*" >&"${board[1]}"; read -r mask _ <&"${board[0]}"; }
# expect STATUS WORDS COMMAND...: exit status, and words in what it says on either stream
expect() {
    local wanted=$1 words=$2 got
    shift 2
    "$@" >"$dir/out" 2>"$dir/err"
    got=$?
    [ $got = "$wanted" ] || fail "$* gave $got, wanted $wanted: $(cat "$dir/err")"
    grep -q -- "$words" "$dir/out" "$dir/err" || fail "$* does not say \"$words\": $(cat "$dir/out" "$dir/err")"
    tell lights
    [ "$mask" = 0 ] || fail "$* leaves lights $mask on"
}

# a sequence: without a camera, with one
cat >"$dir/two.json" <<'END'
{"weft": "sequence", "version": 1, "steps": [
  {"lights": [3], "hold_ms": 10},
  {"lights": [0, 9], "level": 50, "settle_ms": 1, "hold_ms": 20, "until": "time"},
  {"lights": [], "hold_ms": 5}]}
END
expect 0 'step 0: lights 3 on for 1[12]\.[0-9]* ms, .*not seen' "$weft" light run "$dir/two.json" --port "$pty"
grep -q 'step 1: lights 0,9 on for 2[01]\.' "$dir/out" || fail "step 1: $(cat "$dir/out")"
grep -q 'step 2: lights none' "$dir/out" || fail "step 2: $(cat "$dir/out")"
tell camera 100 3000
expect 0 'exposure from 2\.1[0-9]* to 5\.1[0-9]* ms: proved' "$weft" light run "$dir/two.json" --port "$pty" -n 3
[ "$(grep -c proved "$dir/out")" = 9 ] || fail "three runs: $(cat "$dir/out")"
expect 0 '"proved":true' "$weft" light run "$dir/two.json" --port "$pty" --json
tell camera 0 0
echo '{"weft":"sequence","version":1,"steps":[{"lights":[1],"hold_ms":5,"until":"exposure"}]}' >"$dir/camera.json"
expect 1 'the exposure line did not rise' "$weft" light run "$dir/camera.json" --port "$pty"

# files that are none
expect 1 'nothere.json' "$weft" light run "$dir/nothere.json" --port "$pty"
echo '{"weft":"sequence","version":2,"steps":[]}' >"$dir/bad.json"
expect 1 'version' "$weft" light run "$dir/bad.json" --port "$pty"
echo '{"weft":"sequence","version":1,"steps":[]}' >"$dir/bad.json"
expect 1 '0 steps: wanted 1' "$weft" light run "$dir/bad.json" --port "$pty"
echo '{"weft":"sequence","version":1,"steps":[{"lights":["a"],"hold_ms":5}]}' >"$dir/bad.json"
expect 1 'step 0: "lights"' "$weft" light run "$dir/bad.json" --port "$pty"
echo '{"weft":"sequence","version":1,"steps":[{"lights":[1],"hold_ms":5,"until":"noon"}]}' >"$dir/bad.json"
expect 1 '"until" is "noon"' "$weft" light run "$dir/bad.json" --port "$pty"
echo '{"weft":"sequence","version":1,"steps":[{"lights":[1],"hold_ms":2001}]}' >"$dir/bad.json"
expect 1 'at most 2000 ms' "$weft" light run "$dir/bad.json" --port "$pty"
echo '{"weft":"sequence","version":1,"steps":[{"lights":[12],"hold_ms":1}]}' >"$dir/bad.json"
expect 1 'no light 12' "$weft" light run "$dir/bad.json" --port "$pty"
echo '{"weft":"sequence","version":1,"steps":[{"lights":[1],"hold_ms":5,"setle_ms":9}]}' >"$dir/bad.json"
expect 1 '"setle_ms" is not a key of a step' "$weft" light run "$dir/bad.json" --port "$pty"

# settings
expect 0 'serial (none)' "$weft" light set serial --port "$pty"
expect 0 'serial WL-7' "$weft" light set serial WL-7 --port "$pty"
expect 0 '"max-on":150' "$weft" light set max-on 150 --port "$pty" --json
expect 0 'trim-3 128' "$weft" light set trim-3 128 --port "$pty"
expect 0 'trim-3 128' "$weft" light set trim-3 --port "$pty"
expect 0 'serial      WL-7' "$weft" light status --port "$pty"
grep -q 'at most 150 ms' "$dir/out" || fail "status: $(cat "$dir/out")"
expect 2 'wanted 1 to 2000' "$weft" light set max-on 2001 --port "$pty"
expect 2 'no serial number' "$weft" light set serial 'too long for it' --port "$pty"
expect 2 'is no setting' "$weft" light set trim-10 5 --port "$pty"
expect 2 'is no setting' "$weft" light set colour 5 --port "$pty"
expect 2 'takes no value' "$weft" light set defaults 1 --port "$pty"
expect 0 'built-in' "$weft" light set defaults --port "$pty"
expect 0 'max-on 2000' "$weft" light set max-on --port "$pty"

# a live view, until it is interrupted
"$weft" light status --watch --port "$pty" >"$dir/watch" 2>"$dir/err" &
watcher=$!
for _ in $(seq 1200); do
    [ "$(grep -c 'IDLE.*lights none' "$dir/watch")" -ge 3 ] && break
    sleep 0.05
done
kill -INT $watcher
wait $watcher || fail "status --watch ended with $?: $(cat "$dir/err")"
[ "$(grep -c 'IDLE.*lights none' "$dir/watch")" -ge 3 ] || fail "status --watch: $(cat "$dir/watch")"

board_in=${board[1]}
exec {board_in}>&-
exit $((failures > 0))
