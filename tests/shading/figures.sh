#!/usr/bin/env bash
# weft-figures: the quick ones are drawn and say something; wrong names are refused.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
figures=$WEFT_TEST_BIN/weft-figures

expect 0 'order-1.png' "$figures" new order-1 order-2 unreal-11
pngcheck -q new/order-1.png new/order-2.png
grep -q 'sphere (eq. 13)' new/unreal-11.svg
expect 2 'no such figure' "$figures" new order-99
expect 2 'usage: weft-figures' "$figures"
expect 0 'unreal-4' "$figures" --help
