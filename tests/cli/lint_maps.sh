#!/usr/bin/env bash
# weft lint on maps that are right, and on maps that were spoilt in a known way.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
"$WEFT_TEST_BUILD/tests/make-weave-maps" weave.maps
printf ':w := ( opaquematerial :scan = "weave.maps" )\n' >w.radattr
"$weft" bake w.radattr -o w.material --size 256x256 --export png >/dev/null
expect 0 '0 wrong' "$weft" lint w.material/png
python3 - <<'TEXT'
import math, pngfile

def waves(sign):  # rows go down where y goes up
    lines = []
    for y in range(128):
        line = bytearray()
        for x in range(128):
            a, b = 2 * math.pi * x / 16, 2 * math.pi * y / 32
            p, q = 0.6 * math.cos(a) * math.cos(b), -0.3 * math.sin(a) * math.sin(b)
            n = (-p, sign * q, 1.0)
            r = math.sqrt(sum(v * v for v in n))
            line += bytes(round(127.5 + 127.5 * v / r) for v in n)
        lines.append(line)
    return lines

pngfile.write("up_normal.png", 128, 128, 8, 3, waves(1))
pngfile.write("down_normal.png", 128, 128, 8, 3, waves(-1))
pngfile.write("short_normal.png", 128, 128, 8, 3, [bytes(128 + (v - 128) // 2 for v in line) for line in waves(1)])
w, h, bits, n, lines = pngfile.read("w.material/png/albedo.png")
pngfile.write("dark_albedo.png", w, h, bits, n, [[v // 8 for v in line] for line in lines])

# 16 bits are linear, 8 bits sRGB: the same F0 of 0.045 in both; 0.1 is nothing's, 0.5 a metal's
def even(path, bits, rgb):
    pngfile.write(path, 64, 64, bits, 3, [list(rgb) * 64] * 64)
even("good_specular.png", 16, [2949] * 3)
even("coded_specular.png", 8, [60] * 3)
even("blue_specular.png", 16, [2621, 2621, 3932])
even("high_specular.png", 16, [6554] * 3)
even("metal_specular.png", 16, [32768] * 3)
even("coded_albedo.png", 8, [188] * 3)
even("Other_albedo.png", 8, [188] * 3)
even("Metal_albedo.png", 8, [188] * 3)
TEXT
expect 0 'grows upwards' "$weft" lint up_normal.png
expect 0 'grows downwards' "$weft" lint down_normal.png
expect 1 'of the normals are not of unit length' "$weft" lint short_normal.png
expect 1 'less than the black patch' "$weft" lint dark_albedo.png
expect 1 'WRONG' "$weft" lint w.material/png/albedo.png w.material/png/normal.png weave.maps
grep -q 'but the first map of the set is 256 x 256' out
"$weft" lint --json w.material/png | python3 -c 'import json, sys; assert json.load(sys.stdin)["wrong"] == 0'
expect 0 '0.0 % are neither dielectric nor metal' "$weft" lint good_specular.png
expect 0 '0.0 % are neither dielectric nor metal' "$weft" lint coded_specular.png
expect 0 '100.0 % of the texels have a coloured F0' "$weft" lint blue_specular.png
expect 0 '100.0 % of the texels are neither' "$weft" lint high_specular.png
expect 0 '100.0 % of the texels have an albedo above 0.2' "$weft" lint Metal_albedo.png metal_specular.png
expect 0 '0.0 % are above 0.2 in both' "$weft" lint coded_albedo.png coded_specular.png
"$weft" lint Other_albedo.png metal_specular.png >out # of different sets
refuse grep 'specular, albedo' out
# our own folders, with mips and without; solved maps have holes where the sample ends
expect 0 'mip chain' "$weft" lint w.material
grep -q 'height.exr .*range' out
expect 0 'has no normal' "$weft" lint weave.maps
grep -q 'unit normals    0.0 %' out
# one that cannot be read is said, the rest is looked at
mkdir mixed
cp w.material/png/normal.png mixed/Weave_Normal.png
echo no >mixed/Weave_AO.jpg
expect 1 'Weave_AO.jpg: is a damaged JPEG' "$weft" lint mixed
grep -q 'Weave_Normal.png .*unit normals' out
expect 1 'nothing.png: is not there' "$weft" lint nothing.png
mkdir empty
expect 1 'empty: holds no pictures' "$weft" lint empty
