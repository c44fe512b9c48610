#!/usr/bin/env bash
# Every export of four materials, each before its independent judge.  Judges that are not here are named.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
judges=$WEFT_TEST_SOURCE/tests/judges
export WEFT_JUDGES=$WEFT_TEST_BUILD/judges
[ -d "$WEFT_JUDGES" ] || WEFT_JUDGES=$WEFT_TEST_BUILD/../judges # the sanitizer build lies inside
export OMP_NUM_THREADS=1
shared=${WEFT_SHARED:-$WEFT_TEST_SOURCE/../shared}

"$WEFT_TEST_BUILD/tests/make-weave-maps" twill.maps
cat >swatch.radattr <<'TEXT'
include <silk.radattr>
include <velvet.radattr>
include <metal_thread.radattr>
:pile := ( velvet :scan = "twill.maps" :albedo_tint_color = [0.5, 0.1, 0.1] )
:shine := ( silk_satin :width_mm = 30 :tangent_rotation_deg = 30 )
:gold := ( gold_thread :scan = "twill.maps" )
:wet := ( opaquematerial :specular_roughness = 0.1 :albedo_color = 0.02 )
:damp := ( velvet :layers = [ ( velvet :scan = "twill.maps" ) ( wet :mask = ( :from = noise ) ) ]
    :runtime_layers = [ ( velvet :alpha = 0.4 :mask = ( :from = noise :seed = 2 ) ) ( wet :alpha = 0.1 ) ] )
TEXT
while read -r material size; do # sides that are no multiples of 4 among them: glTF's KTX2 wants those
    "$weft" bake swatch.radattr --material "$material" -o "$material.material" --size "$size" --export all >/dev/null
done <<'TEXT'
pile 128x64
shine 128x64
gold 127x62
damp 128x64
TEXT
python3 - pile shine gold damp <<'TEXT'
import json, sys
for name in sys.argv[1:]:
    for export in ("gltf", "u3m", "mtlx"):
        report = json.load(open(f"{name}.material/{export}/report.json"))
        assert report["material"] == name and report["cannot_carry"], export
TEXT

"$weft" preview pile.material -o look.tif --brdf cloth-two-tone --size 64x32 >/dev/null

missing=() silent=()
judge() { # NAME NEEDS-FILE COMMAND...: exit 0, and not a word on stderr
    local name=$1 needs=$2
    shift 2
    if [ ! -e "$needs" ]; then
        missing+=("$name")
        return
    fi
    "$@" >judge.log 2>judge.err || { echo "FAILED: $name: $1"; cat judge.log judge.err; exit 1; }
    [ ! -s judge.err ] || { echo "FAILED: $name has something to say"; cat judge.err; exit 1; }
    silent+=("$name")
}
all() { find . -name "$1" | sort; } # base and layers of run-time layers too
mapfile -t glb < <(all '*.glb') && mapfile -t mtlx < <(all '*.mtlx') && mapfile -t png < <(all '*.png') && mapfile -t tif < <(all '*.tif')
mapfile -t exr < <(all '*.exr') && mapfile -t u3m < <(all '*.u3ma' | xargs -n1 dirname) && mapfile -t ktx2 < <(all '*.ktx2')
modules=$WEFT_JUDGES/node_modules
judge gltf-validator "$modules/gltf-validator" node "$judges/judge_gltf.js" "${glb[@]}"
judge MaterialX "$modules/@needle-tools/materialx" node "$judges/judge_mtlx.js" "${mtlx[@]}"
judge basis_transcoder "$modules/three" node "$judges/judge_basisu.mjs" pile.material gold.material damp.material
judge ktx-parse "$modules/ktx-parse" node "$judges/judge_ktx2.mjs" "${ktx2[@]}"
judge "U3M schema and zip rules" "$shared/data/u3m/u3m1.1/spec/u3m_schema.json" python3 "$judges/judge_u3m.py" \
    "$shared/data/u3m/u3m1.1/spec/u3m_schema.json" "${u3m[@]}"
judge pngcheck /usr/bin/pngcheck pngcheck -q "${png[@]}"
judge exrinfo /usr/bin/exrinfo exrinfo -s "${exr[@]}"
judge exrheader /usr/bin/exrheader exrheader "${exr[@]}"
judge tiffinfo /usr/bin/tiffinfo tiffinfo -D "${tif[@]}"
echo "${#glb[@]} .glb, ${#mtlx[@]} .mtlx, ${#ktx2[@]} .ktx2, ${#u3m[@]} .u3ma, ${#png[@]} .png, ${#tif[@]} .tif, ${#exr[@]} .exr"
echo "silent: ${silent[*]}"

# the judges can fail
if [ -e "$modules/gltf-validator" ]; then
    head -c 2000 pile.material/gltf/pile.glb >cut.glb
    if node "$judges/judge_gltf.js" cut.glb >/dev/null; then echo "FAILED: half a .glb is taken"; exit 1; fi
fi
if [ ${#missing[@]} -gt 0 ]; then
    echo "these judges are not here, the others agree: ${missing[*]}"
    [ ${#silent[@]} -gt 0 ] || exit 77
fi
