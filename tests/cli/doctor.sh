#!/usr/bin/env bash
# weft doctor on a virtual scanner that is healthy, old, badly wired, badly cabled and in use; and weft flash --rig.
set -u
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
# shellcheck source=tests/support/rig_start.sh
. "$WEFT_TEST_SOURCE/tests/support/rig_start.sh"
programs=$WEFT_TEST_BUILD/tests/firmware
# shellcheck disable=SC2317
clean() {
    stop_rig
    rm -rf "$work"
}
trap clean EXIT
tell() { "$weft" rig --dir r --tell "$*" >/dev/null || exit 1; }
# line VERDICT CHECK WORDS: what the last doctor said of one check
line() {
    grep -E "^$1 +$2 +" out | grep -qF -- "$3" || { echo "FAILED: no line: $1 $2 $3"; cat out; exit 1; }
}

expect 1 'no virtual scanner runs there' "$weft" doctor --rig "$work/nothing"
expect 2 'no such option' "$weft" doctor --lights

start_rig r --sample white --size 308x204 --firmware "$programs/firmware-1.0.elf" --bootloader "$programs/optiboot-328p.hex"

# Old firmware is the one failure; its remedy mends it.
expect 1 '1 of 19 checks failed' "$weft" doctor --rig r
line FAILED firmware 'is older than'
line FAILED firmware 'remedy: weft flash'
line warning settings 'weft light set serial'
line skipped lamps 'not asked for'
expect 0 'firmware  1.0.0' "$weft" flash --rig r
expect 0 'serial WL-00007' "$weft" light set serial WL-00007 --rig r

# Healthy.
expect 0 ' 0 failed' "$weft" doctor --rig r --lamps
line ok controller 'WL-00007 answers'
line ok 'serial line' '200 questions: 0 damaged'
line ok lamps '10 lamps'
line ok camera 'aravis:127.0.0.1'
expect 0 '"ok":true' "$weft" doctor --rig r --json
[ "$(jq '.checks | length' out)" = 19 ] || { cat out; exit 1; }

# A lamp that never shines, and one that always does.
tell board lamp 3 off
expect 1 'failed' "$weft" doctor --rig r --lamps
line FAILED lamps 'sees no light of 3;'
tell board lamp 3 on
expect 1 'failed' "$weft" doctor --rig r --lamps
line FAILED lamps 'a lamp that always shines'
tell board lamp 3 good

# A wire that goes to another's lamp.
tell board lamp 7 as 8
expect 1 'failed' "$weft" doctor --rig r --lamps
line FAILED lamps 'the same lamp shines for 7 and 8;'
tell board lamp 7 good

# A bad cable, another program, a port that is not there.
tell board line both flip 0.003 seed 3
expect 1 'failed' "$weft" doctor --rig r
line FAILED 'serial line' 'a shorter or better USB cable'
tell board line both
sleep 30 7<>"$(jq -r .pty r/rig.json)" 9>&- &
other=$!
until [ "$(cat /proc/$other/comm)" = sleep ]; do # and has the port open
    sleep 0.05
done
expect 1 '"verdict":"failed"' "$weft" doctor --rig r --json
[ "$(jq -r '.checks[] | select(.verdict == "failed") | .name' <(head -n 1 out))" = 'other programs' ] || { cat out; exit 1; }
grep -q "sleep (process $other)" out || { cat out; exit 1; }
kill $other
wait $other 2>/dev/null
expect 1 '1 of 19 checks failed' "$weft" doctor --rig r --port /dev/ttyNOT
line FAILED permission 'there is no such port'
exit 0
