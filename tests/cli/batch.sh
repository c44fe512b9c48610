#!/usr/bin/env bash
# weft batch: many sets, killed twice and started again; one that fails; Ctrl-C; changed inputs.
# WEFT_BATCH_SETS is the number of sets of the killed batch.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
sets=${WEFT_BATCH_SETS:-${WEFT_TEST_SANITIZE:+6}}
sets=${sets:-16}
export OMP_NUM_THREADS=1
size=${WEFT_BATCH_SIZE:-308x204}

"$WEFT_TEST_BIN/weft-rig" --render r --sample twill,satin --size "$size" >/dev/null 2>&1
mkdir in
for i in $(seq -w 1 "$sets"); do
    sample=twill
    [ $((10#$i % 2)) -eq 0 ] || sample=satin
    mkdir "in/s$i.set"
    ln r/$sample.set/*.dng "in/s$i.set/"
    sed "s/\"name\": \"$sample\"/\"name\": \"s$i\"/" r/$sample.set/set.json >"in/s$i.set/set.json"
done
batch=("$weft" batch in/*.set -c r/truth.cal -o maps -j 2)

# what is whole now: maps with their stamp, by inode and time of change
whole() { find maps -path 'maps/*.maps/*' ! -path 'maps/batch/*' -printf '%p %i %T@\n' | sort; }
events() { grep -c "\"event\":\"$1\"" maps/batch/events.jsonl; }
count() { find maps -maxdepth 1 -name '*.maps' | wc -l; }

still_there() { kill -0 $pid 2>/dev/null || { echo "FAILED: the batch ended too early"; cat batch.out; exit 1; }; }

# killed twice, when a third and when two thirds are done, in the middle of others
for part in 1 2; do
    "${batch[@]}" >batch.out 2>&1 &
    pid=$!
    until [ -d maps ] && [ "$(count)" -ge $((sets * part / 3)) ]; do still_there; sleep 0.05; done
    until [ "$(events begin)" -gt "$(events solved)" ]; do still_there; sleep 0.02; done
    sleep 0.1
    kill -KILL $pid
    wait $pid 2>/dev/null || true
    sleep 0.2 # its workers die with it
    whole >"whole-$part"
    echo "killed with $(count) of $sets sets in place, $(find maps/batch -name '.weft-*' | wc -l) half-written"
    [ "$(count)" -lt "$sets" ]
done
"${batch[@]}" >table
whole >whole-3
tail -2 table

# nothing is missing
for s in in/*.set; do
    n=$(basename "$s" .set)
    test -s "maps/$n.maps/normal.exr" -a -s "maps/$n.maps/maps.json" -a -s "maps/$n.maps/batch.json"
done
[ "$(grep -c 'solved\|there already' table)" -gt "$sets" ]
# nothing is solved twice: one "solved" a set at most, and what was whole at a kill was never touched again
python3 - "$sets" <<'PY'
import collections, json, sys
n = int(sys.argv[1])
solved, begun, placed = collections.Counter(), collections.Counter(), [set(open(f"whole-{i}")) for i in (1, 2, 3)]
for line in open("maps/batch/events.jsonl"):
    e = json.loads(line)
    (solved if e["event"] == "solved" else begun)[e["set"]] += 1
assert max(solved.values()) == 1, solved
assert placed[0] <= placed[1] <= placed[2], "maps that were in place were touched"
assert 0 < len(placed[0]) < len(placed[1]) < len(placed[2])
r = json.load(open("maps/report.json"))
assert len(r["sets"]) == n and r["counts"]["failed"] == r["counts"]["waiting"] == 0, r["counts"]
assert r["counts"]["kept"] >= 2 * n // 3, r["counts"]
print(f"{n} sets: begun {sum(begun.values())} times, solved {sum(solved.values())} times, none twice; "
      f"{sum(v > 1 for v in begun.values())} were cut off by the kills and begun again")
PY
if find maps -name '.weft-*' | grep .; then echo "FAILED: left behind"; exit 1; fi

# again: nothing to do
before=$(wc -l <maps/batch/events.jsonl)
expect 0 '0 solved' "${batch[@]}"
[ "$(wc -l <maps/batch/events.jsonl)" -eq "$before" ]
grep -q '<svg' maps/report.html
grep -q 'data:image/jpeg;base64' maps/report.html
if grep -E 'src="?http|href="?http|NaN' maps/report.html; then exit 1; fi

# maps that are solved but not in place, as a kill between the two leaves them, are put there and not solved again
first=$(find in -name '*.set' | sort | head -1)
first=$(basename "$first" .set)
key=$(jq -r '.key[:16]' "maps/$first.maps/batch.json")
mv "maps/$first.maps" "maps/batch/$first-$key.maps"
rm "maps/batch/$first-$key.maps/batch.json"
expect 0 '1 solved' "${batch[@]}"
[ "$(wc -l <maps/batch/events.jsonl)" -eq "$before" ]

# other options: refused, then replaced; the same maps as weft solve makes
cp -r in/$first.set one.set
expect 0 '1 solved' "$weft" batch one.set -c r/truth.cal -o other --solve method=lsq
expect 0 '0 solved, 1 there already' "$weft" batch one.set -c r/truth.cal -o other --solve method=lsq
expect 1 'was made of other inputs' "$weft" batch one.set -c r/truth.cal -o other --solve method=robust
expect 0 '1 solved' "$weft" batch one.set -c r/truth.cal -o other --solve method=robust --force
"$weft" solve one.set -c r/truth.cal -o alone.maps -q >/dev/null
cmp alone.maps/normal.exr other/one.maps/normal.exr
expect 2 '--solve: --metod=lsq: no such option' "$weft" batch one.set -c r/truth.cal -o x --solve metod=lsq
expect 2 'is not for batches' "$weft" batch one.set -c r/truth.cal -o x --solve output=y
expect 1 'calibration.json' "$weft" batch one.set -c absent.cal -o x
expect 1 'two sets are called one' "$weft" batch one.set "$PWD/one.set/" -c r/truth.cal -o x
test ! -e x

# a changed frame is solved again, and a calibration too
printf x >>one.set/light-03.dng
expect 1 'was made of other inputs' "$weft" batch one.set -c r/truth.cal -o other --solve method=robust

# failures stop nothing and are told; mended, only they are solved
cp -r one.set two.set && cp -r one.set three.set && mkdir four.set
truncate -s 5000 two.set/light-05.dng
status=0
"$weft" batch one.set two.set three.set four.set -c r/truth.cal -o some >table 2>err || status=$?
[ $status -eq 1 ]
grep -q 'two  *failed.*light-05.dng' table
grep -q 'four  *failed.*set.json' table
grep -q '4 sets: 2 solved, 0 there already, 2 failed' table
grep -q '2 of 4 sets could not be solved' err
cp one.set/light-05.dng two.set/
expect 1 '4 sets: 1 solved, 2 there already, 1 failed' "$weft" batch one.set two.set three.set four.set -c r/truth.cal -o some

# Ctrl-C: the workers end, nothing is half there, and the same command goes on
"$weft" batch in/*.set -c r/truth.cal -o stopped -j 2 >table 2>err &
pid=$!
until [ -d stopped ] && [ "$(find stopped -maxdepth 1 -name '*.maps' | wc -l)" -ge 2 ]; do sleep 0.05; done
kill -TERM $pid
status=0
wait $pid || status=$?
[ $status -eq 130 ]
grep -q 'not solved' table
if find stopped -name '.weft-*' | grep .; then echo "FAILED: left behind after Ctrl-C"; exit 1; fi
for m in stopped/*.maps; do test -s "$m/batch.json"; done
if pgrep -f -- "-o $PWD/stopped" >/dev/null; then echo "FAILED: a worker lives"; exit 1; fi

# two in one folder
before=$(wc -l <stopped/batch/events.jsonl)
"$weft" batch in/*.set -c r/truth.cal -o stopped -j 1 >/dev/null 2>&1 &
pid=$!
until [ "$(wc -l <stopped/batch/events.jsonl)" -gt "$before" ]; do sleep 0.02; done
expect 1 'another weft batch works' "$weft" batch in/*.set -c r/truth.cal -o stopped
kill -TERM $pid
wait $pid 2>/dev/null || true
