# Sourced by the end-to-end scripts that use the virtual scanner: its lock, its start, its end.
# shellcheck shell=bash
[ -x "$WEFT_TEST_BIN/weft-rig" ] || { echo "skipped: this build has no weft-rig"; exit 77; }
exec 9>"${WEFT_RIG_LOCK:-/tmp/weft-rig.lock}"
flock 9
rig_pid=

# start_rig FOLDER OPTIONS...: what it prints is in FOLDER.out and FOLDER.err.  However busy the machine is, it has
# started or ended at last; it ends with the script, even a killed one.
start_rig() {
    : >"$1.out" # nothing of an earlier one
    setpriv --pdeathsig TERM "$WEFT_TEST_BIN/weft" rig --dir "$@" >"$1.out" 2>"$1.err" 9>&- &
    rig_pid=$!
    until [ -s "$1.out" ]; do
        kill -0 "$rig_pid" 2>/dev/null || { echo "the virtual scanner does not start: $(cat "$1.err")"; exit 1; }
        sleep 0.05
    done
}

# Waits until it has ended by itself; its exit status.
await_rig() {
    wait "$rig_pid" 2>/dev/null
    local status=$?
    rig_pid=
    return $status
}

# Ends it and waits: the scanner that the next test starts needs its UDP port.
stop_rig() {
    [ -n "$rig_pid" ] || return 0
    kill "$rig_pid" 2>/dev/null
    await_rig
}
