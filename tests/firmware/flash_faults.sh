#!/usr/bin/env bash
# weft flash when something is wrong, and the other bootloader; each on a simulated board of its own.
set -u
. "$WEFT_TEST_SOURCE/tests/firmware/flash_support.sh"
image=$WEFT_TEST_BUILD/firmware/weft-firmware.hex

# Nobody answers: looks for both rates, which takes a while; the rest goes on meanwhile.
board mute "$programs/pulses.elf"
"$weft" flash --port "$pty" >mute.out2 2>&1 &
mute=$!

# The old bootloader; firmware of another protocol is no obstacle; --json.
board nano "$programs/firmware-of-protocol-2.elf" "$old_boot"
expect_patiently 1 'speaks protocol 2' "$weft" light status --port "$pty"
expect_patiently 0 '"before":' "$weft" flash --port "$pty" --baud 57600 --json
[ "$tries" -gt 1 ] || also '"before":null'
tail -n 1 out | jq -e .now.firmware >/dev/null || die "not one JSON object: $(cat out)"

# Another processor.
board other none "$programs/optiboot-168.hex"
expect_patiently 1 'no ATmega328P (signature 0x1e9406' "$weft" flash --port "$pty"
also 'nothing was written'

# A bit of the flash memory no longer takes a 1 (at an odd address: the second line's first byte with bit 0).
worn=$(objcopy -I ihex -O binary "$image" image.bin && od -An -v -tu1 -w1 image.bin |
    awk 'NR > 5000 && $1 % 2 { print NR - 1; exit }')
board worn none "$optiboot"
tell worn wear "$worn"
expect_patiently 1 'does not hold what was written' "$weft" flash --port "$pty"

# Somebody has the port: without any lock, as a serial monitor, and with Weft's.
board busy "$WEFT_TEST_BUILD/firmware/weft-firmware.elf" "$optiboot"
sleep 60 7<>"$pty" &
sleeper=$!
until [ "$(cat /proc/$sleeper/comm)" = sleep ]; do # and has the port open
    sleep 0.05
done
expect 1 "another program is using this port: sleep (process $sleeper)" "$weft" flash --port "$pty"
kill $sleeper
wait $sleeper 2>/dev/null
for tries in 1 2 3 4 5 6 7 8; do
    "$weft" light on 1 --port "$pty" >on.out 2>&1 &
    holder=$!
    until grep -q '^on' on.out || ! kill -0 $holder 2>/dev/null; do
        sleep 0.05
    done
    { ! grep -q '^on' on.out && is_busy; } || break
done
grep -q '^on' on.out || die "the lights do not go on: $(cat on.out)"
expect 1 "another program is using this port: weft (process $holder)" "$weft" flash --port "$pty"
kill "$holder"
wait "$holder" 2>/dev/null

# What it needs is not there, or not what it should be.
expect 1 'sudo apt install avrdude' env PATH=/nonexistent "$weft" flash --port "$pty"
expect 1 'no such firmware image' "$weft" flash --port "$pty" --image absent.hex
head -c 5000 "$image" >cut.hex
expect 1 'cut.hex' "$weft" flash --port "$pty" --image cut.hex
avr-objcopy -O ihex "$programs/pulses.elf" pulses.hex
expect 1 'no firmware of a Weft light controller' "$weft" flash --port "$pty" --image pulses.hex
expect 1 'where the bootloader is' "$weft" flash --port "$pty" --image "$optiboot"
cp "$image" 'a:b.hex'
expect 2 'colon' "$weft" flash --port "$pty" --image a:b.hex
expect 1 'there is no such port' "$weft" flash --port /dev/ttyNOT
expect 1 'this is not a serial port' "$weft" flash --port /dev/null
expect 1 'this is not a serial port' "$weft" flash --port "$image"
expect 2 'no such option' "$weft" flash --prot x
expect 1 'no virtual scanner runs there' "$weft" flash --rig "$work"

# The image of an installed Weft, and none at all.
mkdir -p inst/bin inst/share/weft
cp "$weft" inst/bin/weft
expect 1 'the firmware image is not there' inst/bin/weft flash --port "$pty"
cp "$image" inst/share/weft/weft-firmware.hex
expect_patiently 0 "image     $work/inst/share/weft/weft-firmware.hex" inst/bin/weft flash --port "$pty"
[ "$tries" -gt 1 ] || also 'settings  kept'

wait $mute && die "a mute board was flashed"
expect 0 'no bootloader answers' cat mute.out2
exit 0
