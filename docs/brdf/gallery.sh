#!/usr/bin/env bash
# Draws the gallery: gallery.sh WEFT FOLDER.  A page a model with lobes, slice and spheres, and the figures
# of the sources rendered for the same situations.
set -euo pipefail
weft=$(realpath "$1") to=$2
cd "$to"

quiet() { "$weft" "$@" -q --force >/dev/null; } # some F0 are doubtful on purpose

# Spheres on one light, then under a clear sky.
model_page() { # NAME COLUMNS PARAM...
    local name=$1 columns=$2
    shift 2
    quiet brdf "$name" --plot "$name-lobes.svg" "$@"
    quiet brdf "$name" --plot "$name-slice.png" "$@"
    quiet preview -o "$name.png" --brdf "$name" --columns "$columns" --shape sphere --size 150x150 \
        --lamp 135,45 --ambient 0 --background 0.05 "$@"
    quiet preview -o "$name-sky.png" --brdf "$name" --columns "$columns" --shape sphere --size 150x150 \
        --lamp 135,40,1 --sky 135,40 --env-scale 0.5 --tone agx --ambient 0 "$@"
    {
        echo "# $name"
        echo
        echo '```'
        "$weft" brdf "$name"
        echo '```'
        echo
        echo "One light from the upper left at 45 degrees, nothing else:"
        echo
        echo "![spheres under one light]($name.png)"
        echo
        echo "The sun at 40 degrees and half a clear sky, AgX-like tones:"
        echo
        echo "![spheres under a sky]($name-sky.png)"
        echo
        echo "Lobes f cos in the plane of incidence (radius: cube root), and the slice over half angle and difference angle:"
        echo
        echo "![lobes]($name-lobes.svg) ![slice]($name-slice.png)"
        echo
        echo '```'
        echo "weft brdf $name --furnace --reciprocity $*"
        "$weft" brdf "$name" -q --furnace --reciprocity "$@"
        echo '```'
    } >"$name.md"
    echo "- [$name]($name.md)" >>index.new
}

echo "# Gallery of the reflectance models" >index.new
{
    echo
    echo "Every page and picture here is written by \`./dev gallery\`; [figures.md](figures.md) renders figures of the sources."
    echo
} >>index.new
alphas=alpha=0.05,0.15,0.3,0.6,1
model_page lambert albedo=0.1,0.3,0.5,0.7,0.9
model_page lambert-balanced f0=0,0.04,0.2,0.5,0.9
model_page lambert-coupled f0=0,0.04,0.2,0.5,0.9
model_page lambert-multiscatter gloss=0,0.235,0.471,0.706,0.941
model_page ggx-specular $alphas --param f0=0.9
model_page ggx-anisotropic anisotropy=0,0.3,0.6,0.8,0.95 --param f0=0.9
model_page ggx $alphas
model_page beckmann $alphas --param f0=0.9
model_page blinn-phong gloss=0,0.2,0.4,0.6,0.8 --param f0=0.9
model_page cook-torrance masking=0,1,2,3,5 --param f0=0.9
model_page unreal roughness=0.1,0.3,0.5,0.7,1
model_page disney sheen=0,0.25,0.5,0.75,1 --param base=0.4,0.1,0.1
model_page cloth $alphas --param f0=0.2
model_page cloth-two-tone $alphas --param f0=0.3 --param rim=1,0.6,0.3
model_page ggx-cloth cloth=0,0.25,0.5,0.75,1 --param albedo=0.05 --param f0=0.08 --param alpha=0.1 \
    --param cloth_albedo=0.3,0.05,0.05 --param cloth_f0=0.2
model_page charlie alpha=0.1,0.2,0.4,0.7,1
mv index.new README.md

# Figures of the sources.
sphere=(--shape sphere --size 150x150 --ambient 0 --background 0.05)
quiet preview -o order-6.png --brdf ggx,cloth --columns $alphas "${sphere[@]}" --lamp 90,5 --param f0=0.3 --param albedo=0.1
gloss=gloss=0,0.235,0.471,0.706,0.941
quiet preview -o cod-gloss.png --brdf lambert-multiscatter "${sphere[@]}" --columns $gloss --lamp 135,30
quiet preview -o cod-gloss-specular.png --brdf ggx-specular "${sphere[@]}" \
    --columns alpha=1,0.321,0.0742,0.0171,0.00395 --sky 135,40 --lamp 135,40 --tone agx --param f0=0.5
for area in points representative; do
    quiet preview -o "unreal-13-$area.png" --brdf ggx-specular "${sphere[@]}" --columns alpha=0.02,0.06,0.16,0.36,0.64 \
        --lamp tube:-90,60,110,90,60,110,0.5 --area $area --param f0=0.3 --tone agx
done
"$(dirname "$weft")/weft-figures" .
