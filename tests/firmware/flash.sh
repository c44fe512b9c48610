#!/usr/bin/env bash
# weft flash for real: avrdude, through a bootloader on a simulated board, from the blank chip on.
set -u
. "$WEFT_TEST_SOURCE/tests/firmware/flash_support.sh"
version=$(sed -n 's/^#define FW_VERSION_MINOR \(.*\)/1.\1.0/p' "$WEFT_TEST_SOURCE/firmware/fw_config.h")
avr-objcopy -O ihex "$programs/firmware-1.0.elf" old.hex

# A blank chip, then an update of an older firmware: what the EEPROM holds stays.  Before, the bootloader's answer has
# no sense, or has been missed: either is told with the remedy.
board uno none "$optiboot"
expect 1 'weft flash' "$weft" light status --port "$pty"
expect_patiently 0 'firmware  none that is known -> 1.0.0' "$weft" flash --port "$pty" --image old.hex
also 'settings  unknown before'
expect_patiently 0 'serial WL-00042' "$weft" light set serial WL-00042 --port "$pty"
expect_patiently 0 'trim-7 200' "$weft" light set trim-7 200 --port "$pty"
expect_patiently 0 "-> $version (" "$weft" flash --port "$pty"
also ': serial WL-00042, 10 lights, at most 2000 ms'
if [ "$tries" = 1 ]; then
    also 'firmware  1.0.0'
    also 'settings  kept'
fi
also 'verified'
expect_patiently 0 'trim-7 200' "$weft" light set trim-7 --port "$pty"

# Killed while avrdude goes on: the port stays taken until that has ended, and the board is whole.  Over other
# contents, or it would be whole by luck.
head -c 12000 /dev/zero >zeros.bin
avr-objcopy -I binary -O ihex zeros.bin zeros.hex
avrdude -qq -p m328p -c arduino -P "$pty" -b 115200 -D -V -U flash:w:zeros.hex:i >out 2>&1 || die "$(cat out)"
flash_until_writing
kill -KILL $flasher
wait $flasher 2>/dev/null
expect 1 'another program is using this port: ' "$weft" light status --port "$pty"
for _ in $(seq 100); do
    "$weft" light status --port "$pty" >out 2>&1 && break
    sleep 0.1
done
also 'serial      WL-00042'
exit 0
