#!/usr/bin/env bash
# U3M read and written again: nothing is lost, only what changed is written anew, bad archives are refused.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
tool=$WEFT_TEST_SOURCE/tests/cli/u3m.py
schema=${WEFT_SHARED:-$WEFT_TEST_SOURCE/../shared}/data/u3m
judged=() # folders for the schema and the rules of archives, all at the end
fail() { echo "FAILED: $*"; exit 1; }
export OMP_NUM_THREADS=1 # pictures of a postage stamp
python3 "$tool" make

# another maker's material: all of it comes back, from an archive, a folder, an archive with a folder, a legacy zip
for input in tweed.u3ma "folder/Harris Tweed 7.u3m" inside.u3ma legacy.u3ma; do
    out=$(basename "$input").material
    "$weft" bake "$input" -o "$out" --export u3m >/dev/null 2>log || { cat log; exit 1; }
    case $input in
    folder*) rm folder/nobody/refers.txt && python3 "$tool" same folder "$out/u3m" ;; # nothing names it
    *) python3 "$tool" same "$input" "$out/u3m/Harris_Tweed_7.u3ma" ;;
    esac
    judged+=("$out/u3m")
done
grep -q 'warning: legacy.u3ma: is not a strict U3MA' log || fail "a legacy archive is not remarked upon"

# what the parameters mean: mode, factor, offset, scale, Disney's widths, 8 % specular (u3m_additional_spec_u3m.txt)
python3 - "$out" <<'TEXT'
import json, math, sys
doc = json.load(open(sys.argv[1] + "/material.json"))
near = lambda a, b, e=2e-3: abs(a - b) <= e * max(abs(b), 1) or sys.exit(f"{a} is not {b}")
decode = lambda v: v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4
texels = [(x, y) for y in range(32) for x in range(64)]
mean = lambda f: sum(map(f, texels)) / len(texels)
maps = doc["maps"]
assert (doc["type"], doc["width"], doc["height"], doc["size_mm"]) == ("anisotropicmaterial", 64, 32, [40.5, 20.25]), doc["type"]
near(maps["albedo"]["constant"][0], mean(lambda t: decode((40 + 3 * t[0]) / 255)))
near(maps["albedo"]["constant"][1], mean(lambda t: decode((200 - 4 * t[1]) / 255)) * decode(0.5))
near(maps["roughness"]["constant"][0], mean(lambda t: (0.25 + 0.5 * 4 * t[0] / 255) ** 2) / math.sqrt(1 - 0.9 * 0.4))
near(maps["anisotropy"]["constant"][0], 0.36)
near(maps["specular"]["constant"][0], 0.04, 1e-6)
assert (doc["thickness_mm"], doc["weight_gsm"]) == (0.8, 310)
TEXT

# a child that changes the colour: that alone is written anew
cat >red.radattr <<'TEXT'
:Harris_Tweed_7 := ( anisotropicmaterial :u3m = "tweed.u3ma" :albedo_tint_color = [1, 0.2, 0.2] )
:rough := ( anisotropicmaterial :u3m = "tweed.u3ma" :specular_roughness = 0.8 :weight_gsm = 290 )
TEXT
for material in Harris_Tweed_7 rough; do
    "$weft" bake red.radattr --material $material -o $material.material --export u3m >/dev/null
    judged+=("$material.material/u3m")
done
python3 - <<'TEXT'
import json, zipfile
read = lambda path: {n: z.read(n) for z in [zipfile.ZipFile(path)] for n in z.namelist()}
old, red, rough = read("tweed.u3ma"), read("Harris_Tweed_7.material/u3m/Harris_Tweed_7.u3ma"), read("rough.material/u3m/rough.u3ma")
name = "Harris Tweed 7.u3m"
a, b, c = json.loads(old[name]), json.loads(red[name]), json.loads(rough["rough.u3m"])
assert {k: v for k, v in b["custom"].items() if k != "weft"} == a["custom"] and b["custom"]["weft"]["model"] == "ggx-aniso"
changed = {k for k in a["material"]["front"] if a["material"]["front"][k] != b["material"]["front"][k]}
assert changed == {"basecolor"}, changed
assert {k for k in a["material"] if a["material"][k] != b["material"][k]} == {"front", "modified"}
assert set(red) == set(old) - {"maps/Base Colour.png"} | {"textures/weft/basecolor.png"}, set(red) ^ set(old)
assert all(red[n] == old[n] for n in set(red) & set(old) - {name})
changed = {k for k in a["material"]["front"] if a["material"]["front"][k] != c["material"]["front"][k]}
assert changed == {"roughness"}, changed
assert c["material"]["physics"] == {**a["material"]["physics"], "weight": 290}
assert c["material"]["name"] == "rough" and c["material"]["id"] != a["material"]["id"]
TEXT

# Weft's own: what was written is read as what was baked, and written again as it was
"$WEFT_TEST_BUILD/tests/make-weave-maps" twill.maps
cat >own.radattr <<'TEXT'
include <silk.radattr>
include <velvet.radattr>
include <metal_thread.radattr>
:pile := ( velvet :scan = "twill.maps" :rim_tint_color = [1, 0.5, 0.25] )
:shine := ( silk_satin :width_mm = 30 :tangent_rotation_deg = 30 :thickness_mm = 0.25 :weight_gsm = 80 )
:gold := ( gold_thread :scan = "twill.maps" )
TEXT
for material in pile shine gold; do
    "$weft" bake own.radattr --material $material -o $material.material --size 128x64 --export u3m >/dev/null
    "$weft" bake $material.material/u3m/$material.u3ma -o $material.again --export u3m >/dev/null
    python3 "$tool" same $material.material/u3m/$material.u3ma $material.again/u3m/$material.u3ma
    python3 - $material <<'TEXT'
import json, sys
a, b = (json.load(open(f"{sys.argv[1]}.{k}/material.json")) for k in ("material", "again"))
assert all(a[k] == b[k] for k in ("type", "thickness_mm", "weight_gsm")) and all(abs(x - y) < 1e-3 for x, y in zip(a["size_mm"], b["size_mm"])), (a["size_mm"], b["size_mm"])
for kind in ("albedo", "specular", "roughness", "anisotropy", "tangent", "normal", "height", "opacity", "cloth", "front_tint", "rim_tint", "rim_amplitude"):
    map = a["maps"][kind]
    tolerance = 0.02 if sys.argv[1] == "gold" and kind in ("specular", "albedo") else 2e-3 # a metal's F0 is its base colour
    for x, y in zip(map["constant"], b["maps"][kind]["constant"]):
        assert abs(x - y) <= tolerance * max(1, abs(x)), (kind, map["constant"], b["maps"][kind]["constant"])
TEXT
    if [ -e $material.material/normal.exr ]; then
        "$weft" compare $material.material $material.again >compared
        grep -qE 'normal.* 0\.0[0-4]' compared || { cat compared; fail "normals of $material differ"; }
    fi
done

# the published sample of version 1.0, with pictures drawn for it
if [ -e "$schema/u3m1.0" ]; then
    mkdir -p old/textures
    cp "$schema/u3m1.0/Example_1.0.u3m" old/
    expect 1 'its picture "textures/Example_0.9_BASE.jpg" is not there' "$weft" bake old/Example_1.0.u3m -o none
    sample=$(find "${schema%/u3m}/images" -name "*.jpg" -size -400k | sort | head -1)
    cp "$sample" old/textures/Example_0.9_BASE.jpg
    for part in ALPHA MTL NRM ROUGH; do cp old/textures/Example_0.9_BASE.jpg old/textures/Example_0.9_$part.jpg; done
    "$weft" bake old/Example_1.0.u3m --size 64x48 -o old.material --export u3m >/dev/null
    python3 "$tool" same old old.material/u3m
    grep -q '121.759' old.material/material.json || fail "centimetres are not read as such"
    echo ':now := ( opaquematerial :u3m = "old/Example_1.0.u3m" :albedo_tint_color = 0.5 )' >now.radattr
    "$weft" bake now.radattr --size 64x48 -o now.material --export u3m >/dev/null
    judged+=(now.material/u3m) # a changed one is 1.1, and valid
fi

[ ! -e "$schema/u3m1.1" ] ||
    python3 "$WEFT_TEST_SOURCE/tests/judges/judge_u3m.py" "$schema/u3m1.1/spec/u3m_schema.json" "${judged[@]}"

# refused: one clear line, exit 1, nothing written
for bad in bad-*.u3ma; do
    expect 1 "$bad: " "$weft" bake "$bad" -o none.material
    cp out "said-$bad"
    [ "$(wc -l <out)" = 1 ] || fail "$bad: more than one line"
    [ ! -e none.material ] || fail "$bad: something was written"
done
says() { grep -qF -- "$2" "said-$1" || { cat "said-$1"; fail "$1: wanted $2"; }; }
says bad-bomb.u3ma 'refused, its entry "bomb" promises more than can be packed'
says bad-twice.u3ma 'is there twice'
says bad-slip.u3ma 'not safe to unpack: "../evil.png"'
says bad-cut-21.u3ma 'is cut short'
says bad-overlap.u3ma 'entries overlap or leave gaps'
says bad-big.u3ma 'unpacks to more than'
says bad-bits.u3ma 'its entry "maps/Base Colour.png" is damaged'
says bad-version.u3ma '1.0 and 1.1 are known'
says bad-path.u3ma 'front.normal names its picture by a path'
