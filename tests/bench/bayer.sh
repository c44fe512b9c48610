#!/usr/bin/env bash
# Photosites solved by their own colour beside frames that are demosaiced first, on fine weaves of the virtual
# scanner: a table, and docs/images/bayer-native.png (houndstooth at 0.25 mm a pixel, 6.4 pixels a yarn; 8 times as
# large: Bayer-native, linear demosaic, truth).
#
#   tests/bench/bayer.sh BUILD [PICTURE.png]
set -euo pipefail
build=$(realpath "$1") picture=$(realpath -m "${2:-$1/bayer-native.png}")
weft=$build/bin/weft
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
samples=(houndstooth denim tartan)
boards=$(seq -s, -f 'board-%g' 0 14)
"$build/bin/weft-rig" --render . --size 616x408 --seed 1 \
    --sample "white,munsell,macbeth,$boards,board-table,houndstooth,denim,tartan" >log 2>&1
"$build/tests/fabric_truth" . 1 616x408 0.25 "${samples[@]}"
{
    "$weft" calibrate lens board-?.set board-??.set -o s.cal --square-mm 10 --board-on-table board-table.set
    "$weft" calibrate lights white.set -o s.cal
    "$weft" calibrate white munsell.set -o s.cal
    "$weft" calibrate colour macbeth.set -o s.cal
} >>log 2>&1 || { cat log; exit 1; }
printf '%-12s %-7s %8s %8s %8s %8s %8s\n' sample frames 'normal' 'p99' 'dE2000' 'dE p99' 'dE max'
for sample in "${samples[@]}"; do
    for way in full linear; do
        "$weft" solve "$sample.set" -c s.cal -o "$sample-$way.maps" --geometry sensor --resolution $way -q >/dev/null
        "$weft" compare "$sample-$way.maps" "$sample.truth/sensor.maps" --json | python3 -c "
import json, sys
d = json.load(sys.stdin)
n, a = d['normal_deg'], d['albedo_delta_e']
print('%-12s %-7s %8.3f %8.2f %8.3f %8.2f %8.1f' % ('$sample', '$way', n['mean'], n['p99'], a['mean'], a['p99'], a['max']))"
    done
done
maps=houndstooth
"$build/peers/picture_crops" "$picture" 300 200 36 36 8 $maps-full.maps/albedo.png $maps-linear.maps/albedo.png \
    $maps.truth/sensor.maps/albedo.png
echo "$picture"
