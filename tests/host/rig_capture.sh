#!/usr/bin/env bash
# weft rig, weft rig --tell and weft capture as a user types them: two samples, two sets that differ.
set -u
exec 9>/tmp/weft-rig.lock
flock 9
weft=$WEFT_TEST_BIN/weft
work=$(mktemp -d)
rig=
# shellcheck disable=SC2317
clean() {
    [ -n "$rig" ] && kill "$rig" 2>/dev/null && wait "$rig"
    rm -rf "$work"
}
trap clean EXIT
fail() {
    echo "rig_capture: $*" >&2
    cat "$work/rig.err" >&2
    exit 1
}
cd "$work" || exit 1

"$weft" rig --dir r --sample white --size 308x204 --seed 5 >rig.out 2>rig.err &
rig=$!
for _ in $(seq 300); do
    [ -s rig.out ] && break
    kill -0 "$rig" 2>/dev/null || fail "the rig ended before it was ready"
    sleep 0.1
done
[ -s rig.out ] || fail "the rig is not ready after 30 s"
cmp -s <(jq -S . rig.out) <(jq -S . r/rig.json) || fail "rig.json is not what was printed"

"$weft" capture white.set --rig r --exposure 0.03 -q || fail "capture of the white sheet"
"$weft" rig --dir r --tell "sample twill" >tell.out || fail "sample twill"
[ "$(jq -r .sample tell.out)" = twill ] || fail "the reply names no twill"
"$weft" capture twill.set --rig r --exposure 0.03 -q || fail "capture of the twill"
[ "$(jq '[.frames[] | select(.role == "light")] | length' twill.set/set.json)" = 10 ] || fail "not ten lights"
cmp -s white.set/light-00.dng twill.set/light-00.dng && fail "both samples look the same"

# A relative folder is the client's, not the rig's.
mkdir elsewhere
(cd elsewhere && "$weft" rig --dir ../r --tell "truth out 0.5") >tell.out || fail "truth"
[ -f elsewhere/out/plane.maps/normal.exr ] || fail "the truth is not where the client asked for it"

# Refusals: exit 1, one line that says why.
"$weft" rig --dir r --tell "sample tweed" >tell.out 2>tell.err && fail "an unknown sample was accepted"
[ "$(wc -l <tell.err)" = 1 ] || fail "not one line: $(cat tell.err)"
grep -q 'no sample "tweed"' tell.err || fail "unknown sample: $(cat tell.err)"
"$weft" rig --dir nowhere --tell state >tell.out 2>tell.err && fail "no rig answered"
grep -q 'nowhere/control.sock' tell.err || fail "no rig: $(cat tell.err)"

"$weft" rig --dir r --tell quit >tell.out || fail "quit"
wait "$rig"
status=$?
rig=
[ $status = 0 ] || fail "the rig ended with $status"
[ -e r/rig.json ] && fail "rig.json is still there"
exit 0
