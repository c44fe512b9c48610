#!/usr/bin/env bash
# The picture of bench_preview beside three.js (MeshPhysicalMaterial, a rectangular area light, a prefiltered
# environment) on Chromium's software rasteriser, SwiftShader: frames a second of both, and both pictures.
#   tests/bench/peers/preview_three.sh [BUILD] [FOLDER FOR THE PICTURES]
# three.js is that of tests/judges/package.json, installed into BUILD/judges.  Where node, npm or chromium are not
# here, or npm cannot be reached, it exits 77.
set -euo pipefail
build=${1:-build}
pictures=${2:-$build/peers}
peers=$(dirname "$0")
judges=$(realpath "$peers/../../judges")
for program in node npm chromium; do
    command -v "$program" >/dev/null || { echo "skipped: $program is not here"; exit 77; }
done
mkdir -p "$build/judges" "$pictures"
if ! cmp -s "$judges/package.json" "$build/judges/package.json" || [ ! -d "$build/judges/node_modules/three" ]; then
    cp "$judges/package.json" "$build/judges/"
    npm install --prefix "$build/judges" --no-audit --no-fund --silent >/dev/null 2>&1 ||
        { rm -f "$build/judges/package.json"; echo "skipped: npm cannot install three.js now"; exit 77; }
fi
load() { echo "load: $(cut -d' ' -f1-3 /proc/loadavg) on $(getconf _NPROCESSORS_ONLN) cores"; }
load
"$build/bench/bench_preview" "$pictures/preview-weft.png" 2>/dev/null
load
WEFT_JUDGES=$(realpath "$build/judges") node "$peers/preview_three.mjs" "$peers/preview_three.html" "$pictures/preview-three.png"
load
if command -v montage >/dev/null; then # the middle of both, side by side: docs/images/preview-three.png
    montage "$pictures/preview-weft.png" "$pictures/preview-three.png" -crop 360x200+780+440 +repage -tile 2x1 \
        -geometry +2+2 -background white -strip "$pictures/preview-three-both.png"
fi
