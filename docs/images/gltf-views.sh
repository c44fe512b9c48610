#!/usr/bin/env bash
# Draws gltf-views.png: gltf-views.sh WEFT TWILL.maps FOLDER.  A scanned twill in weft preview, and its .glb with PNG
# and with KTX2 pictures in three.js (headless Chromium), near and from afar.  WEFT_JUDGES is build/judges; montage is
# ImageMagick's.
set -euo pipefail
weft=$(realpath "$1") maps=$(realpath "$2") to=$(realpath "$3")
render=$(realpath "$(dirname "$0")/../../tests/judges/render_gltf.mjs")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

"$weft" weave "$maps" -o tile.maps >/dev/null
echo ':twill := ( opaquematerial :scan = "tile.maps" :specular_roughness = 0.1 :specular_intensity = 0.06 )' >twill.radattr
"$weft" bake twill.radattr -o twill.material --size 1024x652 --periodic --export gltf,gltf-ktx2 >/dev/null
look=("$weft" preview twill.material --brdf ggx --light "135,45" --ambient 0 --filter samples)
"${look[@]}" -o near-0.png --crop 392,248,240,156 --size 240x156 >/dev/null
"${look[@]}" -o far-0.png --size 128x82 >/dev/null
for export in gltf gltf-ktx2; do
    node "$render" "twill.material/$export/twill.glb" "near-$export.png" 240 156 135 45 4.2667
    node "$render" "twill.material/$export/twill.glb" "far-$export.png" 128 82
done
for far in far-*.png; do convert "$far" -filter point -resize 240x "$far"; done
montage near-0.png near-gltf.png near-gltf-ktx2.png far-0.png far-gltf.png far-gltf-ktx2.png -tile 3x2 -geometry 240x+3+3 \
    -background white +repage "$to/gltf-views.png"
