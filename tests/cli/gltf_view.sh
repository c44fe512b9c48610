#!/usr/bin/env bash
# The .glb as three.js shows it in headless Chromium, beside weft preview of the same view and light.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
judges=$WEFT_TEST_SOURCE/tests/judges
export WEFT_JUDGES=$WEFT_TEST_BUILD/judges OMP_NUM_THREADS=1
[ -d "$WEFT_JUDGES" ] || WEFT_JUDGES=$WEFT_TEST_BUILD/../judges # the sanitizer build lies inside
for needed in chromium node; do
    command -v $needed >/dev/null || { echo "$needed is not here"; exit 77; }
done
[ -e "$WEFT_JUDGES/node_modules/three" ] || { echo "three.js is not here: ./dev test fetches it"; exit 77; }

"$WEFT_TEST_BUILD/tests/make-weave-maps" weave.maps
echo ':weave := ( opaquematerial :scan = "weave.maps" :specular_roughness = 0.3 )' >weave.radattr
"$weft" bake weave.radattr -o weave.material --export gltf,gltf-ktx2 >/dev/null
look() { # EXPORT OUT SIZE...
    local status=0
    node "$judges/render_gltf.mjs" "weave.material/$1/weave.glb" "$2" "${@:3}" >log 2>&1 || status=$?
    [ $status = 0 ] || { cat log; exit $status; }
}
ours() { # OUT SIZE...
    "$weft" preview weave.material -o "$1" --brdf ggx --light 90,35 --ambient 0 --filter samples --size "$2" >/dev/null
}
compare() { # A B MIN-CORRELATION MAX-RATIO MAX-DEGREES
    python3 "$judges/compare_views.py" "$@" || { echo "FAILED: $1 and $2 are different swatches"; exit 1; }
}
ours near.png 400x300
look gltf near-png.png 400 300 90 35
look gltf-ktx2 near-ktx2.png 400 300 90 35
compare near.png near-png.png 0.9 1.05 5
compare near.png near-ktx2.png 0.9 1.05 5
# from afar the filtered mips keep what the bumps do to the highlight
ours far.png 40x30
look gltf-ktx2 far-ktx2.png 40 30 90 35
compare far.png far-ktx2.png 0.2 1.08 90
# the judge can fail: the light from another side
"$weft" preview weave.material -o other.png --brdf ggx --light 0,35 --ambient 0 --size 400x300 >/dev/null
if python3 "$judges/compare_views.py" near-png.png other.png 0.9 1.05 5; then echo "FAILED: any light will do"; exit 1; fi
