#!/usr/bin/env bash
# Run-time layers: what an engine blends from the exported masks and materials is the flattened material.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
export OMP_NUM_THREADS=1
fail() { echo "FAILED: $*"; exit 1; }

"$WEFT_TEST_BUILD/tests/make-weave-maps" weave.maps
cat >coat.radattr <<'TEXT'
include <leather.radattr>
:rough := ( opaquematerial :albedo_color = [0.02, 0.3, 0.5] :specular_roughness = 0.9 :specular_intensity = 0.02 )
:wet := ( opaquematerial :albedo_color = 0.03 :specular_roughness = 0.08 )
:coat := ( opaquematerial :scan = "weave.maps" :specular_roughness = 0.4
    :layers = [ ( rough ) ( wet :alpha = 0.1 ) ]
    :runtime_layers = [
        ( wet :mask = ( :from = noise :period = 4 ) )
        ( rough :alpha = 0.5 :channels = albedo )
        ( wet :alpha = 0.8 :mask = ( :from = cavity :low = 0.6 :high = 0.1 ) :channels = specular_normal )
        ( rough :albedo_tint_color = 0.5 :mask = ( :from = noise :seed = 9 ) )
    ] )
TEXT
bake() { "$weft" bake coat.radattr -o coat.material --size 96x72 --export all --why >out; }
bake
python3 "$WEFT_TEST_SOURCE/tests/cli/runtime_layers.py" coat.material/png

# every export has them: the same masks, each material once, its own files of each, and says that it cannot carry them
for export in coat.material/*/; do
    name=$(basename "$export")
    cmp "$export/layers/masks.png" coat.material/png/layers/masks.png
    cmp "$export/layers/layers.json" coat.material/png/layers/layers.json
    [ "$(ls "$export/layers/shared")" = "$(printf 'rough\nrough_3\nwet')" ] || fail "$name shares other materials"
    grep -q "run-time layers: $name has none" "$export/report.json" || fail "$name does not say that it is flattened"
done
for file in gltf/layers/shared/wet/wet.glb unreal/layers/base/coat_BaseColor.png; do
    [ -e "coat.material/$file" ] || fail "an exporter's own files of base and layers: $file"
done
strings coat.material/gltf/coat.glb | grep -q '"runtime_layers":"layers/layers.json"' || fail "the glTF does not point at them"

# a change that the flattened maps do not show is exported all the same
sed -i 's/:albedo_tint_color = 0.5 :mask = ( :from = noise :seed = 9 )/:albedo_tint_color = 0.6 :alpha = 0/' coat.radattr
bake
sed -i 's/:albedo_tint_color = 0.6 :alpha = 0/:albedo_tint_color = 0.7 :alpha = 0/' coat.radattr
bake
for line in '^albedo +kept' '^export png +rebuilt'; do
    grep -qE "$line" out || { cat out; fail "a hidden layer's change"; }
done
bake
grep -qE '^export png +kept' out || fail "nothing changed"
sed 's/^        ( rough :alpha/        ( wet ) ( rough :alpha/' coat.radattr >five.radattr
expect 1 'at most 4 layers are blended at run time, not 5' "$weft" bake five.radattr -o five.material
