#!/usr/bin/env bash
# Draws preview-filter.png: preview-filter.sh WEFT TWILL.maps FOLDER.  A ball of scanned twill from afar: one sample a
# pixel of the finest maps, of their mips, and every texel shaded.  montage is ImageMagick's.
set -euo pipefail
weft=$(realpath "$1") maps=$(realpath "$2") to=$(realpath "$3")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

"$weft" weave "$maps" -o tile.maps >/dev/null
echo ':twill := ( opaquematerial :scan = "tile.maps" :specular_roughness = 0.2 :specular_intensity = 0.1 )' >twill.radattr
"$weft" bake twill.radattr -o twill.material --size 1024x652 --periodic >/dev/null
look=("$weft" preview twill.material --brdf ggx --shape sphere --repeat 5 --size 240x240 --light "120,40")
"${look[@]}" -o unfiltered.png --filter samples --draft >/dev/null
"${look[@]}" -o filtered.png --draft >/dev/null
"${look[@]}" -o every.png --filter samples >/dev/null
montage unfiltered.png filtered.png every.png -tile 3x1 -geometry 240x+2+2 -background white +repage -strip "$to/preview-filter.png"
