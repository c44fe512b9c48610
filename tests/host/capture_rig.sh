#!/usr/bin/env bash
# weft capture on the virtual scanner: a set, Ctrl-C, kill -9, a full disk, a scanner that vanishes.
# Each failure must leave dark lamps, whole files, one line of words, and a set that resume completes.
set -u
# shellcheck source=tests/support/rig.sh
. "$WEFT_TEST_SOURCE/tests/support/rig.sh"

capture=("$weft" capture --rig "$dir/rig" -q)

expect 1 "no virtual scanner runs there" "${capture[@]}" "$dir/none.set"
start_twill

# ---- a set ----
expect 0 '"frames":11,"taken":11' "${capture[@]}" "$dir/full.set" --exposure 0.04 --json
check_files "$dir/full.set" complete 11
jq -e '[.frames[] | select(.role == "light") | .light] == [range(10)]' "$dir/full.set/set.json" >/dev/null ||
    fail "full.set: the lights are not 0 to 9"
jq -e '.frames[1].capture.statistics.clipped | max == 0' "$dir/full.set/set.json" >/dev/null || fail "full.set clips"
expect 1 "complete set; give another name, or --force" "${capture[@]}" "$dir/full.set" --exposure 0.04
expect 0 '"exposure_s":0.0' "${capture[@]}" "$dir/board.set" --only-all --json
jq -e '[.frames[].role] == ["all"]' "$dir/board.set/set.json" >/dev/null || fail "board.set is not one frame"
jq -e '.frames[0].capture.statistics.high | max > 0.6 and max < 0.8' "$dir/board.set/set.json" >/dev/null ||
    fail "board.set: the automatic exposure misses 70 %"
expect 0 "Virtual scanner" "$weft" devices --rig "$dir/rig"

# ---- Ctrl-C ----
(trap - INT; exec "${capture[@]}" "$dir/int.set" --exposure 0.3 9>&-) 2>"$dir/err" &
pid=$!
wait_for_frames "$dir/int.set" 3
kill -INT $pid
wait $pid
[ $? = 130 ] || fail "SIGINT: the exit status is not 130"
expect_dark SIGINT
grep -q "frames are kept, --resume goes on" "$dir/err" || fail "SIGINT: says $(cat "$dir/err")"
[ "$(wc -l <"$dir/err")" = 1 ] || fail "SIGINT: says more than a line: $(cat "$dir/err")"
check_files "$dir/int.set" capturing 3
expect 1 "exposure_s 0.3, not 0.2" "${capture[@]}" "$dir/int.set" --resume --exposure 0.2
expect 0 '"frames":11,.*"kept":[3-9]' "${capture[@]}" "$dir/int.set" --resume --json
check_files "$dir/int.set" complete 11

# ---- kill -9 with a lamp on ----
"${capture[@]}" "$dir/kill.set" --exposure 0.6 --no-ambient 9>&- &
pid=$!
wait_for_frames "$dir/kill.set" 2
for _ in $(seq 100); do
    tell state | grep -q '"lights_on":\[\]' || break
    sleep 0.02
done
kill -KILL $pid
wait $pid 2>/dev/null
await_dark SIGKILL
jq -e '.dark_for_s > 0' "$dir/state" >/dev/null || fail "SIGKILL: dark since $(cat "$dir/state")"
cp "$dir/full.set/ambient.dng" "$dir/kill.set/ambient.dng" # the size that check_files compares with
check_files "$dir/kill.set" capturing 2
rm "$dir/kill.set/ambient.dng"
touch "$dir/kill.set/.weft-light-05.dng-1-1"
expect 0 '"frames":10,.*"kept":[2-9]' "${capture[@]}" "$dir/kill.set" --resume --json
cp "$dir/full.set/ambient.dng" "$dir/kill.set/ambient.dng"
check_files "$dir/kill.set" complete 10
[ -z "$(find "$dir/kill.set" -name '.weft-*')" ] || fail "SIGKILL: temporaries are left"

# ---- disks and folders ----
expect 1 "/proc/weft" "${capture[@]}" /proc/weft/x.set --exposure 0.04
mkdir "$dir/small"
if mount -t tmpfs -o size=2m none "$dir/small" 2>/dev/null; then
    expect 1 "small/x.set: the disk has 2 MB free and 11 frames need" "${capture[@]}" "$dir/small/x.set" --exposure 0.04
    expect 1 "31 frames need" "${capture[@]}" "$dir/small/x.set" --exposure 0.04 --bracket 3
    [ ! -e "$dir/small/x.set" ] || fail "full disk: something was begun"
    mount -o remount,size=12m "$dir/small"
    "${capture[@]}" "$dir/small/y.set" --exposure 0.3 2>"$dir/err" 9>&- &
    pid=$!
    wait_for_frames "$dir/small/y.set" 2
    dd if=/dev/zero of="$dir/small/filler" bs=64k 2>/dev/null # somebody else fills it meanwhile
    wait $pid
    [ $? = 1 ] || fail "disk that fills up: the exit status is not 1"
    grep -q "small/y.set/.*\(disk full\|No space\)" "$dir/err" || fail "disk that fills up: says $(cat "$dir/err")"
    expect_dark "disk that fills up"
    check_files "$dir/small/y.set" capturing 2
    rm "$dir/small/filler"
    expect 0 '"frames":11' "${capture[@]}" "$dir/small/y.set" --resume --json
    check_files "$dir/small/y.set" complete 11
else
    echo "note: no tmpfs may be mounted here: the full disk is not tried"
fi

# ---- the scanner vanishes ----
"${capture[@]}" "$dir/gone.set" --exposure 0.3 2>"$dir/err" 9>&- &
pid=$!
wait_for_frames "$dir/gone.set" 2
kill -KILL "$(jq .pid "$dir/rig/rig.json")"
await_rig
start_s=$SECONDS
wait $pid
[ $? = 1 ] || fail "vanished scanner: the exit status is not 1"
[ $((SECONDS - start_s)) -le 60 ] || fail "vanished scanner: noticed after $((SECONDS - start_s)) s"
[ "$(wc -l <"$dir/err")" = 1 ] || fail "vanished scanner: says $(cat "$dir/err")"
check_files "$dir/gone.set" capturing 2
expect 1 "the virtual scanner has ended" "${capture[@]}" "$dir/gone.set" --resume
start_twill
expect 0 '"frames":11' "${capture[@]}" "$dir/gone.set" --resume --json
check_files "$dir/gone.set" complete 11

finish
