#!/usr/bin/env bash
# weft flash broken off in the middle: a board that holds part of a firmware, and the way back.
set -u
. "$WEFT_TEST_SOURCE/tests/firmware/flash_support.sh"

# Ctrl-C in the middle: dark, and the next flashing mends it.
board uno none "$optiboot"
flash_until_writing
expect 1 'another program is using this port: ' "$weft" light status --port "$pty"
expect 1 'another program is using this port: ' "$weft" flash --port "$pty"
kill -INT $flasher
ended 130 'run "weft flash" again'
expect 1 "$pty" "$weft" light status --port "$pty"
# Power fails in the middle, too.
flash_until_writing
tell uno power
ended 1 'the board fell silent while it was written'
tail -n 1 uno.out | grep -q '^0 ' || die "lights are on: $(tail -n 1 uno.out)"
expect_patiently 0 'settings  unknown before: serial (none), 10 lights' "$weft" flash --port "$pty"
exit 0
