#!/usr/bin/env bash
# weft brdf: the list, and values at the rows of a table.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"

expect 0 'cloth: velvet' "$weft" brdf
expect 0 'alpha        0.0001 to 1 (default 0.3)' "$weft" brdf ggx
"$weft" brdf --json | python3 -c '
import json, sys
models = {m["name"]: m for m in json.load(sys.stdin)["models"]}
assert models["cloth"]["passive"] and not models["ggx"]["passive"]
assert [p["name"] for p in models["ggx"]["parameters"]] == ["albedo", "f0", "alpha"]'
expect 2 'no such BRDF; there are lambert' "$weft" brdf gxg

# f at normal incidence: GGX f0/(4 pi alpha^2), Lambert albedo/pi, to 17 digits
printf 'nl,nv,phi,alpha,f0,tag\n1,1,0,0.5,0.04,"a, b"\n' >"$work/t.csv"
"$weft" brdf ggx-specular --eval "$work/t.csv" >"$work/got"
printf 'nl,nv,phi,alpha,f0,tag,value\n1,1,0,0.5,0.04,"a, b",0.012732395447351628\n' | diff - "$work/got"
printf 'lx,ly,lz,vx,vy,vz\n0,0,1,0.6,0,0.8\n' >"$work/t.csv"
"$weft" brdf lambert --eval "$work/t.csv" --param albedo=1,0.5,0 | tail -1 >"$work/got"
echo '0,0,1,0.6,0,0.8,0.31830988618379069,0.15915494309189535,0' | diff - "$work/got"
# light at azimuth 0, view at 90 degrees
printf 'alpha,nx\n0.5,1\n' >"$work/t.csv"
expect 0 '0.5,1,1.2732395447351628,1,0.5' "$weft" brdf ord_ggx_terms --eval "$work/t.csv"

bad() { # WORDS HEADER ROW
    printf '%s\n%s\n' "$2" "$3" >"$work/bad.csv"
    expect 1 "$1" "$weft" brdf ggx --eval "$work/bad.csv"
}
bad 'column aplha is neither' 'nl,nv,aplha' '1,1,0.5'
bad 'there is no column nv' 'nl,alpha' '1,0.5'
bad 'there is no column vz' 'lx,ly,lz,vx,vy' '0,0,1,0,0'
bad 'row 1: nl is 1.5' 'nl,nv' '1.5,1'
bad 'row 1: lx ly lz is 2 long' 'lx,ly,lz,vx,vy,vz' '0,0,2,0,0,1'
bad 'row 1: alpha of ggx is 2' 'nl,nv,alpha' '1,1,2'
bad '"x" is not a number' 'nl,nv' 'x,1'
bad 'columns nl and nl give the same thing' 'nl,nv,nl' '1,1,0.5'
bad 'columns f0 and f0_g give the same thing' 'nl,nv,f0,f0_g' '1,1,0.5,0.5'
bad 'vectors (lx ly lz vx vy vz) or angles' 'lx,ly,lz,vx,vy,vz,phi' '0,0,1,0,0,1,0'
expect 2 'it has albedo, f0, alpha' "$weft" brdf ggx --eval "$work/t.csv" --param roughness=1
expect 2 'wants the NAME' "$weft" brdf --eval "$work/t.csv"
expect 1 'absent.csv' "$weft" brdf ggx --eval "$work/absent.csv"
printf 'alpha,nv\n0.5,0.5\n0.5,1.5\n' >"$work/t.csv"
expect 1 'row 2: there is no value' "$weft" brdf cloth_albedo --eval "$work/t.csv"
printf 'alpha,nv\n0.5,0\n' >"$work/t.csv"
expect 0 '0.5,0,' "$weft" brdf ggx_furnace --eval "$work/t.csv"

# plots and proofs: 1 - ln 2 of a white rough conductor's light comes back straight up (Smith, alpha 1)
expect 0 'lobes.svg: cloth' "$weft" brdf cloth --plot lobes.svg -p alpha=0.4
python3 -c 'import xml.dom.minidom as x; assert len(x.parse("lobes.svg").getElementsByTagName("path")) + len(x.parse("lobes.svg").getElementsByTagName("polyline")) >= 4'
expect 1 'lobes.svg' "$weft" brdf cloth --plot lobes.svg
expect 0 'slice.png' "$weft" brdf disney --plot slice.png
expect 2 'NAME.svg for lobes' "$weft" brdf ggx --plot lobes.pdf
expect 2 'NAME of a model' "$weft" brdf --furnace
"$weft" brdf ggx-specular --furnace --reciprocity -p f0=1 -p alpha=1 --json | python3 -c '
import json, math, sys
d = json.load(sys.stdin)
assert abs(d["furnace"][-1]["albedo"][2] - (1 - math.log(2))) < 1e-5 and d["largest_change"] < 1e-12, d'
expect 0 'change f by' "$weft" brdf disney --reciprocity --furnace

# a table of the MERL form: written, read as a model, the same furnace (of what 90 cells hold), looked at
expect 0 'cloth.binary: cloth' "$weft" brdf cloth --merl cloth.binary -p albedo=0.8,0.4,0.2
expect 1 'cloth.binary' "$weft" brdf cloth --merl cloth.binary
expect 2 'wants NAME.binary' "$weft" brdf cloth --merl cloth.bin
expect 2 'anisotropic' "$weft" brdf ggx-anisotropic --merl t.binary
test ! -e t.binary
expect 0 'over half and difference angles' "$weft" brdf cloth.binary
"$weft" brdf cloth.binary --furnace --json >of-table
"$weft" brdf cloth -p albedo=0.8,0.4,0.2 --furnace --json >of-model
python3 -c '
import json
a, b = (json.load(open(f))["furnace"] for f in ("of-table", "of-model"))
for x, y in zip(a, b):
    assert max(abs(p - q) for p, q in zip(x["albedo"], y["albedo"])) < 2e-3, (x, y)'
printf 'nl,nv,phi\n0.8,0.6,2\n' >"$work/t.csv"
expect 0 '0.8,0.6,2,0.2' "$weft" brdf cloth.binary --eval "$work/t.csv"
expect 0 'lobes' "$weft" brdf cloth.binary --plot merl-lobes.svg
expect 0 'merl.png' "$weft" preview -o merl.png --brdf cloth.binary --shape sphere --size 64x64 --ambient 0
expect 0 'model.png' "$weft" preview -o model.png --brdf cloth -p albedo=0.8,0.4,0.2 --shape sphere --size 64x64 --ambient 0
"$weft" compare merl.png model.png --json | python3 -c 'import json, sys; assert json.load(sys.stdin)["psnr_db"] > 60'
head -c 1000000 cloth.binary >cut.binary
expect 1 'this file 1000000; copy it again' "$weft" brdf cut.binary --furnace
expect 1 'cut.binary' "$weft" preview -o cut.png --brdf cut.binary --shape sphere
test ! -e cut.png
