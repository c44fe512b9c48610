#!/usr/bin/env bash
# weft preview and weft contact on maps made by formula.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
"$WEFT_TEST_BUILD/tests/make-weave-maps" weave.maps
"$WEFT_TEST_BUILD/tests/make-weave-maps" sensor.maps sensor

is_png() { # FILE WIDTH HEIGHT
    python3 -c 'import pngfile, sys
assert pngfile.read(sys.argv[1])[:2] == (int(sys.argv[2]), int(sys.argv[3]))' "$@"
}

expect 0 'plane.png: 400 x 300, lambert' "$weft" preview weave.maps -o plane.png
is_png plane.png 400 300
expect 0 '"width":64' "$weft" preview weave.maps/ -o ball.png --json --shape sphere --brdf cloth --param f0=0.2,0.1,0.1 \
    --size 64x48 --fov 20 --light 60,20
is_png ball.png 64 48
grep -qF 'warning: f0 0.2,0.1,0.1: only metals' out
grep -qF 'warning: f0 0.2: dielectrics end at 0.067' out
expect 0 'beside the f0 of a metal' "$weft" preview weave.maps -o metal.png --brdf ggx --param f0=0.9 --param albedo=0.5 --size 8x8
"$weft" preview weave.maps -o bare.png --brdf ggx --param f0=0.9 --param albedo=0.1 --size 8x8 2>out >/dev/null
[ ! -s out ]
expect 0 'point.exr' "$weft" preview weave.maps -o point.exr --light-mm=-20,0,40 --brdf ggx --param alpha=weave.maps/confidence.exr
expect 2 '1 to 16' "$weft" preview weave.maps -o never.png --taps 17
expect 2 'samples|trilinear' "$weft" preview weave.maps -o never.png --filter bilinear
[ ! -e never.png ]

# a material's mips, eight texels a pixel: every filter; those that look at mips are alike here, level 0 is not
echo ':cloth := ( opaquematerial :scan = "weave.maps" )' >cloth.radattr
"$weft" bake cloth.radattr -o cloth.material >bake.log 2>&1
for filter in samples trilinear anisotropic; do
    expect 0 "cloth-$filter.png: 50 x 38, ggx" "$weft" preview cloth.material -o "cloth-$filter.png" --brdf ggx --size 50x38 --filter "$filter" --draft
    is_png "cloth-$filter.png" 50 38
done
# a size that no cloth has is refused before it becomes the scale of everything
for size in '[-5, 3]' '[1e300, 1]'; do
    jq ".size_mm = $size" cloth.material/material.json >head.json
    cp -r cloth.material damaged.material && cp head.json damaged.material/material.json
    expect 1 '"size_mm" has' "$weft" preview damaged.material -o damaged.png
    rm -r damaged.material
done
cmp cloth-trilinear.png cloth-anisotropic.png
refuse cmp cloth-samples.png cloth-anisotropic.png
expect 0 "unreal takes the root of alpha" "$weft" preview cloth.material -o root.png --brdf unreal --size 8x8

expect 0 'sheet.png: 672 x ' "$weft" contact weave.maps sensor.maps -o sheet.png --tile 120x80

# a captured set of three small mosaics: the red light is twice as bright as the other, which must stay visible
python3 - <<'EOF'
import json, os, pngfile
os.mkdir("small.set")
frames = []
for name, level, role in (("ambient", 300, "ambient"), ("a", 4256, "light"), ("b", 2256, "light")):
    pngfile.write(f"small.set/{name}.png", 32, 24, 16, 1, [[level if (x < 16) else 256 for x in range(32)]] * 24)
    frames.append({"file": name + ".png", "role": role, "exposure_s": 0.1, "gain": 1.0})
    if role == "light":
        frames[-1]["light"] = len(frames) - 2
json.dump({"weft": "set", "version": 1, "name": "small", "created": "2026-11-23T10:00:00Z", "state": "complete",
           "sensor": {"width": 32, "height": 24, "cfa": "RGGB", "black": [256] * 4, "white": 15871},
           "frames": frames}, open("small.set/set.json", "w"))
EOF
expect 0 'frames.png: 172 x' "$weft" contact small.set -o frames.png --tile 20x20
# the first tile is light 0: left half at white (255), right half black; the second, half as bright, 188
python3 - <<'EOF'
import pngfile
_, _, bits, channels, rows = pngfile.read("frames.png")
assert (bits, channels) == (8, 3)
def pixel(x, y):
    return rows[y][3 * x:3 * x + 3]
top = 12 + 28 + 10 # gap, title, middle of a tile
assert pixel(12 + 5, top) == (255, 255, 255), pixel(12 + 5, top)
assert pixel(12 + 15, top) == (0, 0, 0), pixel(12 + 15, top)
assert pixel(12 + 32 + 5, top) == (188, 188, 188), pixel(12 + 32 + 5, top)
EOF

# lamps, surroundings, shapes, grids and sweeps; no INPUT is a smooth surface
export XDG_CACHE_HOME="$PWD/cache"
expect 0 'sky.png: 48 x 48' "$weft" preview -o sky.png --brdf ggx --shape sphere --sky 225,40 --lamp 225,40 --tone agx --size 48x48
test -f cache/weft/*.table
expect 0 'pano.png' "$weft" preview weave.maps -o pano.png --env sky.png --lamp none --brdf cloth --shape drape --size 40x40 --draft
expect 0 'roll.png' "$weft" preview weave.maps -o roll.png --shape cylinder --lamp ball:-40,40,60,9,2 --area representative --size 40x40
expect 0 'grid.png: 348 x' "$weft" preview -o grid.png --brdf ggx,cloth --columns alpha=0.1,0.3,0.9 --shape sphere --size 100x60
expect 0 'lamps.png: 196 x' "$weft" preview -o lamps.png --columns lamps --lamp 0,30 --lamp tube:-9,0,9,9,0,9 --shape sphere --size 80x80
expect 0 '3 frames' "$weft" preview weave.maps -o turn.png --sweep 3 --size 40x30
is_png turn-002.png 40 30
refuse cmp turn-000.png turn-001.png
expect 1 'turn-000.png' "$weft" preview weave.maps -o turn.png --sweep 3 --size 40x30
# resumed: what is there stays as it is, what is missing comes out the same; other options are refused
cp turn-001.png kept.png && rm turn-001.png && touch -d @1000000000 turn-000.png
expect 0 '2 of them kept' "$weft" preview weave.maps -o turn.png --sweep 3 --size 40x30 --resume
cmp turn-001.png kept.png
[ "$(stat -c %Y turn-000.png)" = 1000000000 ]
expect 1 'other options' "$weft" preview weave.maps -o turn.png --sweep 3 --size 40x30 --resume --light 10,20
expect 1 'other options' "$weft" preview sensor.maps -o turn.png --sweep 3 --size 40x30 --resume
printf '{' >turn.sequence.json
expect 1 'turn.sequence.json' "$weft" preview weave.maps -o turn.png --sweep 3 --size 40x30 --resume
# an animation that is killed goes on where it stopped, and then is what an uninterrupted one is
for shape in plane sphere cylinder drape; do
    expect 0 '"kept":0' "$weft" preview weave.maps -o $shape.webp --shape $shape --turntable 4 --size 30x24 --draft --quality 100 --json
done
long=("$weft" preview -q weave.maps -o late.webp --shape drape --turntable 999 --size 240x240 --draft --resume)
for run in first second; do # each is stopped when it has made two frames of its own
    frame=$(find . -path './late.webp.frames/*.png' | wc -l)
    frame=late.webp.frames/$(printf %03d $((frame + 1))).png
    "${long[@]}" >out 2>&1 &
    runner=$! status=0
    for ((i = 0; i < 3000 && status == 0; i++)); do
        [ ! -e "$frame" ] || break
        sleep 0.05
        kill -0 $runner 2>/dev/null || status=1
    done
    kill -INT $runner
    wait $runner || status=$?
    [ $status = 130 ]
    [ -e "$frame" ]
    [ ! -e late.webp ]
    [ $run = second ] || touch -d @1000000000 late.webp.frames/000.png
done
[ "$(stat -c %Y late.webp.frames/000.png)" = 1000000000 ]
expect 1 'interrupted run' "$weft" preview weave.maps -o late.webp --turntable 4 --size 30x24
expect 0 '"kept":0' "$weft" preview weave.maps -o late.webp --shape drape --turntable 4 --size 30x24 --draft --quality 100 --force --json
cmp late.webp drape.webp
[ ! -e late.webp.frames ]
webpinfo drape.webp >info
[ "$(grep -c 'Chunk ANMF' info)" = 4 ]
grep -q 'No error' info
webpmux -info drape.webp >info
grep -q 'Canvas size: 30 x 24' info
grep -q 'Number of frames: 4' info
webpmux -get frame 1 drape.webp -o first.webp >out 2>&1
dwebp -quiet first.webp -o first.png
expect 0 '' "$weft" preview weave.maps -o still.png --shape drape --size 30x24 --draft
expect 0 'PSNR             inf' "$weft" compare first.png still.png
expect 2 'want --sweep N' "$weft" preview weave.maps -o x.webp
expect 1 'x.jpg: a picture'"'"'s name must end in .exr, .png, .tif or .tiff' "$weft" preview absent.maps -o x.jpg
expect 2 'each is a row' "$weft" preview -o x.png --brdf ggx,cloth
expect 2 'neither with each other' "$weft" preview weave.maps -o x.webp --sweep 2 --turntable 2
expect 2 'no lamp is written' "$weft" preview -o x.png --lamp ball:1,2
expect 2 'AZ,EL is a distant one' "$weft" preview -o x.png --lamp tube:1e20,0,1,-1e20,0,2
expect 2 'strength from 0 to 1e+06' "$weft" preview -o x.png --lamp 10,20,1e300
expect 2 'within 1e+09 mm' "$weft" preview -o x.png --light-mm 1e300,0,1
expect 2 'radius above 0' "$weft" preview -o x.png --lamp ball:0,0,10,12
expect 2 'EL from 0 to 90' "$weft" preview -o x.png --sky 10,-5
expect 0 'blue.png' "$weft" preview -o blue.png --brdf ggx --shape sphere --sky 225,40 --lamp 225,40 --tone agx --size 48x48 --polarise 0.4,0.6,1
refuse cmp sky.png blue.png
expect 0 'noon.png' "$weft" preview -o noon.png --brdf ggx --shape sphere --sky 225,40 --lamp 225,40 --tone agx --size 48x48 --polarise 6:1,1,1 --polarise 12:0.4,0.6,1 --ambient-saturation 1
cmp noon.png blue.png
expect 2 'wanted R,G,B' "$weft" preview -o x.png --sky 10,5 --polarise 2,1,1
expect 2 'wanted R,G,B' "$weft" preview -o x.png --sky 10,5 --polarise 25:1,1,1
expect 2 'before that' "$weft" preview -o x.png --sky 10,5 --polarise 5:1,1,1 --polarise 4:1,1,1
expect 2 'wants a --sky' "$weft" preview -o x.png --polarise 1,1,1
expect 2 'two ways' "$weft" preview -o x.png --sky 10,5 --env sky.png
expect 2 '"lamps" with some' "$weft" preview -o x.png --columns lamps
expect 1 'no/such.exr' "$weft" preview -o x.png --env no/such.exr
expect 2 'wants the INPUT' "$weft" preview -o x.png --match small.set -c x.cal

# drawn again when a picture changes; what cannot be drawn leaves the picture as it was
cp weave.maps/confidence.exr rough.exr
: >watch.log
"$weft" preview weave.maps -o weave.maps/watched.png --brdf ggx --param alpha=rough.exr --size 40x30 --watch >watch.log 2>&1 &
watcher=$!
await_lines() { # N WORDS: until the log has N lines with WORDS
    for ((i = 0; i < 1200; i++)); do
        [ "$(grep -cF -- "$2" watch.log)" -lt "$1" ] || return 0
        kill -0 $watcher || break
        sleep 0.05
    done
    kill $watcher 2>/dev/null || true
    echo "FAILED: not $1 lines with: $2" && cat watch.log && exit 1
}
await_lines 1 'watched.png: 40 x 30'
cp weave.maps/watched.png first.png
cp weave.maps/residual.exr rough.exr
await_lines 2 'watched.png: 40 x 30'
refuse cmp weave.maps/watched.png first.png
cp weave.maps/watched.png second.png
rm rough.exr
await_lines 1 'alpha=rough.exr: there is no such picture; the picture stays'
cmp weave.maps/watched.png second.png
status=0
kill -INT $watcher
wait $watcher || status=$?
[ $status = 130 ]
[ "$(grep -c 'watched.png: 40 x 30' watch.log)" = 2 ]
rm weave.maps/watched.png
expect 2 'neither --match' "$weft" preview -o x.png --watch --sweep 3
expect 2 'no --json' "$weft" preview -o x.png --watch --json
expect 1 'alpha=rough.exr: there is no such picture' "$weft" preview -o x.png --brdf ggx --param alpha=rough.exr

# without INPUT the first picture is the surface; its 8 bits are sRGB where they are a colour: 188 is 0.503
python3 -c 'import pngfile
pngfile.write("grey.png", 30, 20, 8, 3, [[188, 188, 188] * 30] * 20)'
expect 0 'photo.png: 30 x 20' "$weft" preview -o photo.png --param albedo=grey.png --light 0,90 --ambient 0
python3 -c 'import pngfile
assert set(pngfile.read("photo.png")[4][10]) == {188}'
# shadows of the relief and of folds
expect 0 'lit.exr' "$weft" preview weave.maps -o lit.exr --light 20,15 --size 200x150
expect 0 'dark.exr' "$weft" preview weave.maps -o dark.exr --light 20,15 --size 200x150 --self-shadow
refuse cmp lit.exr dark.exr
expect 0 'coarse.png' "$weft" preview weave.maps -o coarse.png --shape sphere --size 60x60 --self-shadow --shadow-steps 4 --shadow-blur always
expect 0 'soft.png' "$weft" preview weave.maps -o soft.png --size 60x45 --light 20,15 --self-shadow --accumulate 8 --sun-disc 3
expect 2 'wants --sweep N' "$weft" preview weave.maps -o x.png --temporal
expect 0 '4 frames' "$weft" preview weave.maps -o soft.png --sweep 4 --size 30x24 --self-shadow --shadow-steps 4 --temporal
cp soft-003.png kept.png && rm soft-003.png # resumed, it remembers what the kept frames were
expect 0 '3 of them kept' "$weft" preview weave.maps -o soft.png --sweep 4 --size 30x24 --self-shadow --shadow-steps 4 --temporal --resume
cmp soft-003.png kept.png
expect 0 'fog.png' "$weft" preview weave.maps -o fog.png --shape drape --size 40x40 --lamp ball:-40,40,60,9 --fog 0.5 --draft
expect 0 'even.png' "$weft" preview weave.maps -o even.png --size 40x40 --fog 0.5 --fog-even --fog-g 0
expect 2 'fog-g' "$weft" preview weave.maps -o x.png --fog 0.5 --fog-g 2
expect 0 'folds.png' "$weft" preview weave.maps -o folds.png --shape drape --size 60x60 --folds marched --voxels 64 --lamp ball:-40,40,60,9 --draft
expect 0 'walked.png' "$weft" preview weave.maps -o walked.png --shape drape --size 60x60 --folds walked --self-shadow --height-map weave.maps/height.exr --draft
rm weave.maps/height.exr
expect 1 'solve with --height poisson' "$weft" preview weave.maps -o x.png --self-shadow
expect 1 '3 planes; heights are one' "$weft" preview weave.maps -o x.png --self-shadow --height-map weave.maps/albedo.exr
"$weft" preview -q -o small.exr --size 8x8 >/dev/null
expect 1 '3 planes' "$weft" preview weave.maps -o x.png --self-shadow --height-map small.exr
expect 1 'nothing.exr' "$weft" preview weave.maps -o x.png --self-shadow --height-map nothing.exr
expect 2 'wants --self-shadow' "$weft" preview weave.maps -o x.png --height-map x.exr
expect 2 'neither --match nor' "$weft" preview weave.maps -o x.png --self-shadow --columns alpha=1

# light from the left brightens the left flanks: the picture under 180,30 and under 0,30 must differ, and the
# same command must give the same bytes
"$weft" preview -q weave.maps -o a.png --light 180,30 >/dev/null
"$weft" preview -q weave.maps -o b.png --light 180,30 >/dev/null
"$weft" preview -q weave.maps -o c.png --light 0,30 >/dev/null
cmp a.png b.png
refuse cmp a.png c.png

expect 1 'plane.png' "$weft" preview weave.maps -o plane.png
expect 0 'plane.png' "$weft" preview weave.maps -o plane.png --force
expect 2 'output' "$weft" preview weave.maps
expect 2 'no such BRDF; there are' "$weft" preview weave.maps -o x.png --brdf gxx
expect 2 'it has albedo' "$weft" preview weave.maps -o x.png --param alpha=1
expect 2 'AZ,EL' "$weft" preview weave.maps -o x.png --light 1
expect 0 'crop.png: 50 x 40' "$weft" preview weave.maps -o crop.png --crop 10,20,50,40
expect 1 'not inside' "$weft" preview weave.maps -o x.png --crop 380,20,50,40
expect 2 'whole pixels' "$weft" preview weave.maps -o x.png --crop 0,0,1.5,4
expect 2 'four numbers' "$weft" preview weave.maps -o x.png --crop 0,0,4
expect 2 'X,Y,Z' "$weft" preview weave.maps -o x.png --light-mm 0,0,0
expect 2 'six numbers' "$weft" contact weave.maps -o x.png --lights 1,2
expect 1 'have none' "$weft" preview sensor.maps -o x.png --light-mm 0,0,100
sed 's/"width": 32/"width": 64/' small.set/set.json >json && cp -r small.set wrong.set && mv json wrong.set/set.json
expect 1 'wrong.set' "$weft" contact wrong.set -o x.png
expect 1 'absent.maps' "$weft" preview absent.maps -o x.png
expect 1 'no/such/x.png' "$weft" preview weave.maps -o no/such/x.png
printf 'not a picture' >broken.exr
expect 1 'broken.exr' "$weft" preview weave.maps -o x.png --brdf ggx --param alpha=broken.exr
cp -r weave.maps cut.maps && head -c 2000 weave.maps/normal.exr >cut.maps/normal.exr
expect 1 'normal.exr' "$weft" preview cut.maps -o x.png
[ ! -e x.png ]
[ -z "$(find . -name '.weft-*')" ]
