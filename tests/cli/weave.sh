#!/usr/bin/env bash
# weft weave on maps made by formula: 0.6 mm a thread, plain weave.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
"$WEFT_TEST_BUILD/tests/make-weave-maps" weave.maps
expect 0 'threads    16.67 x 16.67 per cm' "$weft" weave weave.maps -o tile.maps --picture tile.png
grep -q 'repeat     2 x 2 threads' out
expect 0 '"repeat":[2,2]' "$weft" weave tile.maps --json
expect 1 "is there already" "$weft" weave weave.maps -o tile.maps
printf ':t := ( opaquematerial :scan = "tile.maps" )\n' >t.radattr
expect 0 't.material: t: ' "$weft" bake t.radattr -o t.material --periodic
rm weave.maps/normal.exr
expect 1 'has no normals' "$weft" weave weave.maps
