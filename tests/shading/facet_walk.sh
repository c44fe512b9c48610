#!/usr/bin/env bash
# weft-facet-walk: one seed, one table, whatever the number of threads; the fit's distance from the walks.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
walk=$WEFT_TEST_BIN/weft-facet-walk

OMP_NUM_THREADS=1 "$walk" --gloss 0 --grid 8 --walks 200 --merl one.binary >one
OMP_NUM_THREADS=3 "$walk" --gloss 0 --grid 8 --walks 200 --merl three.binary >three
cmp one three
cmp one.binary three.binary
expect 1 'one.binary' "$walk" --gloss 0 --merl one.binary
# the rows of gloss 0: the rational fit is nearest to the walks, Lambert farthest
awk '/^0/ { off[++n] = $(NF - 1) } END { exit !(n == 3 && off[2] < 0.04 && off[1] < off[3] / 2) }' one
# the table is a model: its furnace
"$weft" brdf one.binary --furnace --json |
    python3 -c 'import json, sys; a = json.load(sys.stdin)["furnace"][-1]["albedo"]; assert 0.85 < a[0] == a[1] == a[2] < 1, a'
expect 2 'numbers 0..1' "$walk" --gloss 2
expect 2 'one --gloss' "$walk" --merl two.binary
expect 2 'options only' "$walk" 0.5
expect 0 'usage: weft-facet-walk' "$walk" --help
