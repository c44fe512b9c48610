#!/usr/bin/env bash
# Every export of four materials, each before its independent judge.  Judges that are not here are named.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
judges=$WEFT_TEST_SOURCE/tests/judges
export WEFT_JUDGES=$WEFT_TEST_BUILD/judges
[ -d "$WEFT_JUDGES" ] || WEFT_JUDGES=$WEFT_TEST_BUILD/../judges # the sanitizer build lies inside
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
:damp := ( velvet :layers = [ ( velvet :scan = "twill.maps" ) ( wet :mask = ( :from = noise ) ) ] )
TEXT
for material in pile shine gold damp; do
    "$weft" bake swatch.radattr --material $material -o $material.material --size 256x128 --export all >/dev/null
done
python3 - pile shine gold damp <<'TEXT'
import json, sys
for name in sys.argv[1:]:
    for export in ("gltf", "u3m", "mtlx"):
        report = json.load(open(f"{name}.material/{export}/report.json"))
        assert report["material"] == name and report["cannot_carry"], export
TEXT

missing=()
judge() { # NEEDS-FILE COMMAND...
    local needs=$1
    shift
    if [ ! -e "$needs" ]; then
        missing+=("$needs")
        return
    fi
    "$@" >judge.log 2>&1 || { echo "FAILED: $*"; cat judge.log; exit 1; }
}
modules=$WEFT_JUDGES/node_modules
judge "$modules/gltf-validator" node "$judges/judge_gltf.js" ./*.material/gltf*/*.glb
judge "$modules/@needle-tools/materialx" node "$judges/judge_mtlx.js" ./*.material/mtlx/*.mtlx
judge "$modules/three" node "$judges/judge_basisu.mjs" pile.material gold.material damp.material
judge "$modules/ktx-parse" node "$judges/judge_ktx2.mjs" ./*.material/ktx2/*.ktx2
judge "$shared/data/u3m/u3m1.1/spec/u3m_schema.json" python3 "$judges/judge_u3m.py" \
    "$shared/data/u3m/u3m1.1/spec/u3m_schema.json" ./*.material/u3m
judge /usr/bin/pngcheck pngcheck -q ./*.material/*/*.png ./*.material/u3m/textures/*.png
judge /usr/bin/exrinfo exrinfo -s ./*.material/*.exr

# the judges can fail
if [ -e "$modules/gltf-validator" ]; then
    head -c 2000 pile.material/gltf/pile.glb >cut.glb
    ! node "$judges/judge_gltf.js" cut.glb >/dev/null
fi
if [ ${#missing[@]} -gt 0 ]; then
    echo "these judges are not here, the others agree: ${missing[*]}"
    [ ${#missing[@]} -lt 7 ] || exit 77
fi
