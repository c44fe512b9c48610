#!/usr/bin/env bash
# weft batch --slurm on a private cluster: munged, slurmctld and two slurmd on loopback, started here as root with
# their own folders and ports.  A task is killed in the middle, a node is drained, the one who waits is killed.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
: "${work:?}"
skip() { echo "skipped: $*"; exit 77; }
[ "$(id -u)" -eq 0 ] || skip "a private Slurm cluster needs root"
PATH=$PATH:/usr/sbin
for program in munged slurmctld slurmd sbatch squeue scontrol scancel; do
    command -v $program >/dev/null || skip "$program is not installed (Debian: slurm-wlm munge)"
done

# ---- the cluster ----
chmod 755 . # munge wants to be reached by everybody
mkdir -p etc state log munge
dd if=/dev/urandom of=munge/key bs=32 count=4 status=none
chmod 755 munge
chmod 400 munge/key
read -r ctld n1 n2 < <(python3 -c '
import socket
s = [socket.socket() for _ in range(3)]
for x in s: x.bind(("127.0.0.1", 0))
print(*[x.getsockname()[1] for x in s])')
cat >etc/slurm.conf <<X
ClusterName=weft
SlurmctldHost=localhost(127.0.0.1)
SlurmctldPort=$ctld
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool-%n
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd-%n.pid
SlurmctldLogFile=$work/log/slurmctld.log
SlurmdLogFile=$work/log/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
PlugStackConfig=/dev/null
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=batch_sched_delay=0
SlurmdParameters=config_overrides
KillWait=2
NodeName=n1 NodeHostname=localhost NodeAddr=127.0.0.1 Port=$n1 CPUs=1
NodeName=n2 NodeHostname=localhost NodeAddr=127.0.0.1 Port=$n2 CPUs=1
PartitionName=main Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
X
echo CgroupAutomount=no >etc/cgroup.conf
export SLURM_CONF=$work/etc/slurm.conf
daemons=()
finish() {
    if [ "${waiting:-}" ]; then kill -KILL "$waiting" 2>/dev/null || true; fi
    scancel --user=root 2>/dev/null || true
    [ ${#daemons[@]} -eq 0 ] || kill "${daemons[@]}" 2>/dev/null || true
    wait 2>/dev/null || true
    rm -rf "$work"
}
trap finish EXIT
munged -F -f --key-file=munge/key --socket=munge/socket --pid-file=munge/pid --seed-file=munge/seed \
    --log-file=munge/log --num-threads=2 >log/munged 2>&1 &
daemons+=($!)
for _ in $(seq 300); do [ -S munge/socket ] && break; sleep 0.1; done
slurmctld -D -c >log/ctld 2>&1 &
daemons+=($!)
for node in n1 n2; do
    slurmd -D -N $node >log/$node 2>&1 &
    daemons+=($!)
done
for _ in $(seq 300); do
    [ "$(sinfo -h -N -t idle -o %N 2>/dev/null | wc -l)" -eq 2 ] && break
    sleep 0.2
done
[ "$(sinfo -h -N -t idle -o %N | wc -l)" -eq 2 ] || { tail -n 5 log/*; skip "slurmd does not come up on this machine"; }

# ---- the sets ----
sets=${WEFT_SLURM_SETS:-10}
"$WEFT_TEST_BIN/weft-rig" --render r --sample satin --size "${WEFT_SLURM_SIZE:-616x408}" >/dev/null 2>&1
mkdir in
for i in $(seq -w 1 "$sets"); do
    mkdir "in/s$i.set"
    ln r/satin.set/*.dng "in/s$i.set/"
    sed "s/\"name\": \"satin\"/\"name\": \"s$i\"/" r/satin.set/set.json >"in/s$i.set/set.json"
done
batch=("$weft" batch in/*.set -c r/truth.cal -o maps --slurm)
count() { find maps -maxdepth 1 -name '*.maps' | wc -l; }
say() { echo "== $*"; }
running() { squeue -h -r -t running -o '%i %N' --name "$(squeue -h -o %j | head -1)"; } # JOB_TASK NODE

sinfo -N -l
say "weft batch --slurm, $sets sets"
"${batch[@]}" >table1 2>first &
waiting=$!
until [ -d maps ] && [ "$(count)" -ge 2 ] && running | grep -q .; do sleep 0.1; done
cat first
squeue -r

say "the process of a task is killed in the middle"
read -r victim killed < <(python3 - <<'PY'
import json, os, time
def working(): # sets that were begun and not solved, with their processes
    busy = {}
    for line in open("maps/batch/events.jsonl"):
        if line.endswith("\n"):
            e = json.loads(line)
            busy[e["set"]] = e["pid"] if e["event"] == "begin" else 0
    return {name: pid for name, pid in busy.items() if pid}
for _ in range(6000):
    for name, pid in working().items():
        try:
            os.kill(pid, 9)
        except ProcessLookupError:
            continue
        time.sleep(0.1) # it may have been at its last word
        if working().get(name) == pid:
            print(pid, name)
            raise SystemExit
    time.sleep(0.01)
PY
) || { echo "FAILED: no task was caught at work"; exit 1; }
echo "killed process $victim: $killed"

say "node n2 is drained"
scontrol update NodeName=n2 State=DRAIN Reason=test
sinfo -N -h -o '%N %T'

say "the one who waits is killed too, and started again"
kill -KILL $waiting
wait $waiting 2>/dev/null || true
echo "in place: $(count)"
"${batch[@]}" >table2 2>second &
waiting=$!
for _ in $(seq 600); do # what n2 was doing it may end; then it does no more
    running | grep -q ' n2$' || break
    sleep 0.1
done
drained=$(date -u +%FT%TZ)
status=0
wait $waiting || status=$?
waiting=
cat second table2
sinfo -N -h -o '%N %T %E'
[ $status -eq 0 ]
grep -q "earlier run are in Slurm's queue" second
[ "$(grep -c 'submitted as Slurm job' first)" -eq 1 ]

python3 - "$sets" "$drained" "$killed" <<'PY'
import collections, json, sys
sets, drained, killed = int(sys.argv[1]), sys.argv[2], sys.argv[3]
begun, solved, nodes = collections.Counter(), collections.Counter(), collections.Counter()
for line in open("maps/batch/events.jsonl"):
    e = json.loads(line)
    if e["event"] == "begin":
        begun[e["set"]] += 1
        assert not (e["host"] == "n2" and e["when"] > drained), f"begun on the drained node: {e}"
    if e["event"] == "solved":
        solved[e["set"]] += 1
        nodes[e["host"]] += 1
assert len(solved) == sets and max(solved.values()) == 1, solved
assert begun[killed] == 2, (killed, begun)
assert nodes["n1"] > nodes["n2"], nodes
r = json.load(open("maps/report.json"))
assert r["counts"]["solved"] + r["counts"]["kept"] == sets, r["counts"]
print(f"{sets} sets, each solved once, {dict(nodes)}; {killed} was begun twice")
PY

say "a set that cannot be solved fails alone; nothing to do needs no cluster"
scontrol update NodeName=n2 State=RESUME
mkdir bad
cp -r in/s*1.set bad/a.set
cp -r in/s*1.set bad/b.set
truncate -s 5000 bad/b.set/light-05.dng
expect 1 'light-05.dng' "$weft" batch bad/*.set -c r/truth.cal -o mixed --slurm --sbatch=--time=5 -j 1
test -s mixed/a.maps/batch.json -a ! -e mixed/b.maps
SLURM_CONF=/nowhere expect 0 "0 solved, $sets there already" "${batch[@]}"

say "sbatch refuses: its words are ours"
expect 1 'invalid partition' "$weft" batch bad/a.set -c r/truth.cal -o other --slurm --sbatch=--partition=nowhere

say "Ctrl-C leaves the array in the queue"
scontrol update NodeName=n1,n2 State=DRAIN Reason=test
"$weft" batch bad/a.set -c r/truth.cal -o third --slurm >table3 2>err3 &
waiting=$!
until grep -q 'submitted as' err3; do sleep 0.1; done
kill -TERM $waiting
status=0
wait $waiting || status=$?
waiting=
cat err3
[ $status -eq 130 ]
grep -q 'go on; the same command waits for them again' err3
expect 1 'of an earlier batch' "$weft" batch bad/a.set -c r/truth.cal -o third --slurm --solve method=lsq
scontrol update NodeName=n1,n2 State=RESUME
expect 0 '1 solved' "$weft" batch bad/a.set -c r/truth.cal -o third --slurm
echo "all as it should be"
