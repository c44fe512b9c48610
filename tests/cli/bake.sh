#!/usr/bin/env bash
# weft bake: what is rebuilt after which change, kill and restart, refusals; judges of the files.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"

"$WEFT_TEST_BUILD/tests/make-weave-maps" twill.maps
cat >house.radattr <<'TEXT'
include <cotton.radattr>
:dirt := ( opaquematerial :albedo_color = 0.05 :specular_roughness = 0.9 )
:thread := ( cotton :specular_roughness = 0.6 )
TEXT
cat >coat.radattr <<'TEXT'
include "house.radattr"
include <metal_thread.radattr>
:coat := ( clothmaterial
    :layers = [
        ( thread :scan = "twill.maps" )
        ( dirt :alpha = 0.4 :mask = ( :from = cavity :low = 0.6 :high = 0.2 ) )
        ( dirt :alpha = 0.2 :channels = albedo :mask = ( :from = noise ) )
        ( thread :alpha = 0.3 :albedo_tint_color = #406080 :channels = albedo )
    ]
)
TEXT
bake() { "$weft" bake coat.radattr -o coat.material --export png --why "$@" >out 2>&1 || { cat out; exit 1; }; }
kept() { # STEP...: each is kept
    for step in "$@"; do grep -qE "^$step +kept" out || { echo "FAILED: $step is not kept"; cat out; exit 1; }; done
}
rebuilt() {
    for step in "$@"; do grep -qE "^$step +rebuilt" out || { echo "FAILED: $step is not rebuilt"; cat out; exit 1; }; done
}

expect 0 'materials, 1 pictures and scans, 0 warnings' "$weft" bake coat.radattr --check
bake
rebuilt composite albedo normal height occlusion 'export png'
bake
kept maps 'export png'
python3 - "$("$weft" bake coat.radattr -o coat.material --json)" <<'TEXT'
import json, sys
assert json.loads(sys.argv[1])["rebuilt"] == 0
TEXT

# a template is touched: nothing; a property this material overrides: nothing; a colour: colours alone
touch house.radattr
bake
kept maps
echo '// a remark' >>house.radattr
bake
kept maps
sed -i 's/albedo_color = 0.05/albedo_color = 0.07/' house.radattr
bake
grep -q 'albedo_color was .* is .*dirt' out
rebuilt albedo 'export png'
kept height 'occlusion, cavity, curvature' normal roughness
# another rule for the mips: normals and roughness alone
bake --mips vmf
rebuilt normal roughness
kept albedo height cavity

# killed at some moment and started again: the same bytes as from nothing
for delay in 0.1 0.4; do
    rm -rf coat.material
    "$weft" bake coat.radattr -o coat.material --export png >/dev/null 2>&1 &
    sleep "$delay"
    kill -9 $! 2>/dev/null || true
    wait $! 2>/dev/null || true
    bake
done
"$weft" bake coat.radattr -o fresh.material --export png >/dev/null
for file in fresh.material/*.exr fresh.material/png/*.png; do cmp "$file" "coat.material/${file#fresh.material/}"; done
OMP_NUM_THREADS=3 "$weft" bake coat.radattr -o threads.material --export png >/dev/null
for file in fresh.material/*.exr; do cmp "$file" "threads.material/${file#fresh.material/}"; done

# stopped when some maps are new and others old: what is on record is what is on disk, so a change that is taken back
# is built again, and no old height is taken for that of the new normals
again() { "$weft" bake bump.radattr -o bump.material --size 96x64 >out 2>&1; }
say_strength() { echo ":bump := ( opaquematerial :scan = \"twill.maps\" :normal_strength = $1 :albedo_tint_color = $1 )" >bump.radattr; }
same_as() { for file in "$1"/*.exr; do cmp "$file" "bump.material/${file##*/}"; done; }
say_strength 1 && again
cp -r bump.material one.material
rm bump.material/normal.exr && mkdir -p bump.material/normal.exr/in-the-way
say_strength 0.5
if again; then echo "FAILED: a map that cannot be written is no failure"; exit 1; fi
if cmp -s {one,bump}.material/albedo.exr; then echo "FAILED: nothing was written before"; exit 1; fi
rm -r bump.material/normal.exr && cp {one,bump}.material/normal.exr
say_strength 1 && again
same_as one.material
say_strength 0.5 && again
cp -r bump.material half.material
cp {one,bump}.material/height.exr
python3 - <<'TEXT'
import json
one, bump = (json.load(open(f"{name}.material/material.json")) for name in ("one", "bump"))
bump["keys"]["height"] = one["keys"]["height"]
del bump["keys"]["composite"]
json.dump(bump, open("bump.material/material.json", "w"))
TEXT
again
same_as half.material
# where the scan has an answer is a part of it
python3 - <<'TEXT'
import pngfile
w, h, bits, n, lines = pngfile.read("twill.maps/mask.png")
pngfile.write("twill.maps/mask.png", w, h, bits, n, [[0] * (w * n // 2) + list(line)[w * n // 2:] for line in lines])
TEXT
again
grep -q ' 0 rebuilt' out && { echo "FAILED: another mask of the scan changes nothing"; exit 1; }

# judges
if command -v exrinfo >/dev/null; then exrinfo -s fresh.material/*.exr >/dev/null; fi
if command -v pngcheck >/dev/null; then pngcheck -q fresh.material/png/*.png; fi

# the text
expect 0 'is as it should be' "$weft" bake "$WEFT_TEST_SOURCE/shading/material/library/silk.radattr" --format
printf ':a:=(opaquematerial :opacity=1)\n' >loose.radattr
expect 1 'is not in the one form' "$weft" bake loose.radattr --format --check
grep -q ':a:=' loose.radattr
expect 0 'rewritten' "$weft" bake loose.radattr --format
expect 0 'is as it should be' "$weft" bake loose.radattr --format --check
expect 0 ':albedo_color = ( :r = 0.07 :g = 0.07 :b = 0.07 )  // dirt' \
    "$weft" bake house.radattr --material dirt --explain
expect 1 "there is no material 'thrad'; did you mean 'thread'?" "$weft" bake house.radattr --material thrad --explain
sed 's/( clothmaterial/( cloathmaterial/' coat.radattr >bad.radattr
expect 1 "did you mean 'clothmaterial'?" "$weft" bake bad.radattr -o bad.material
expect 2 "there is no exporter 'gltff'" "$weft" bake coat.radattr -o x.material --export gltff
mkdir other && echo x >other/notes.txt
expect 1 'is there already and is no material' "$weft" bake coat.radattr -o other
rm twill.maps/*.exr
expect 1 'coat.radattr:5:' "$weft" bake coat.radattr -o gone.material
[ ! -e gone.material ]
[ ! -e bad.material ]
