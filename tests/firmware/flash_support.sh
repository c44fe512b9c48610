# Sourced by the tests of weft flash: simulated boards, each a process with a pty, and what they need.
# shellcheck shell=bash
# shellcheck disable=SC2034 # used by the scripts
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
programs=$WEFT_TEST_BUILD/tests/firmware
optiboot=$programs/optiboot-328p.hex
old_boot=/usr/share/arduino/hardware/arduino/avr/bootloaders/atmega/ATmegaBOOT_168_atmega328.hex
boards=()
clean() {
    local b
    for b in "${boards[@]}"; do kill "$b" 2>/dev/null; done
    rm -rf "$work"
}
trap clean EXIT

die() { echo "FAILED: $*"; exit 1; }

# more words that the last command of `expect` must have printed
also() { grep -qF -- "$1" out || die "does not say \"$1\": $(cat out)"; }

# board NAME FIRMWARE|none [BOOTLOADER]: sets $pty; `tell NAME WORDS` talks to it
board() {
    mkfifo "$1.in"
    "$WEFT_TEST_BUILD/tests/virtual_controller" "$2" ${3:+"$3"} <"$1.in" >"$1.out" 2>&1 &
    boards+=($!)
    exec {fd}>"$1.in"
    eval "in_$1=$fd"
    until [ -s "$1.out" ]; do # however busy the machine is, it has started or ended at last
        kill -0 "${boards[-1]}" 2>/dev/null || break
        sleep 0.02
    done
    read -r pty <"$1.out"
    [ -c "$pty" ] || die "no board $1: $(cat "$1.out")"
}
tell() {
    local name=in_$1
    shift
    echo "$@" >&"${!name}"
}

# whether the machine has more work than processors
is_busy() { awk -v n="$(nproc)" '{ exit !($1 > n) }' /proc/loadavg; }

# expect_patiently STATUS WORDS COMMAND...: on a machine with far more work than processors a bootloader gives up, as
# it should, before avrdude has its turn; then again, as weft flash says.  Elsewhere once.  $tries is how many it took:
# a flashing that was broken off leaves no firmware for the next one to compare with.
expect_patiently() {
    local status
    for tries in 1 2 3 4 5 6 7 8; do
        is_busy || break
        status=0
        "${@:3}" >out 2>&1 || status=$?
        [ "$status" = "$1" ] && grep -qF -- "$2" out && return
    done
    expect "$@"
}

# starts flashing $pty in the background and waits until avrdude writes
flash_until_writing() {
    : >flash.err # nothing of an earlier one: the new one may not have begun when this first looks
    "$weft" flash --port "$pty" -v >flash.out 2>flash.err &
    flasher=$!
    until grep -q 'avrdude: writing' flash.err; do
        kill -0 "$flasher" 2>/dev/null || die "ended before it wrote: $(cat flash.err)"
        sleep 0.02
    done
}
# ended STATUS WORDS: how that flashing ended
ended() {
    local status=0
    wait "$flasher" || status=$?
    [ $status = "$1" ] || die "flashing ended with $status, wanted $1: $(cat flash.out flash.err)"
    grep -qF -- "$2" flash.out flash.err || die "does not say \"$2\": $(cat flash.out flash.err)"
}
