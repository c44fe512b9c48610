#!/usr/bin/env bash
# A ball under one point light: "weft preview" against Blender's Cycles on the CPU, pixel by pixel.
#   tests/bench/peers/preview_cycles.sh [BUILD] [FOLDER FOR THE PICTURES]
# Blender is no dependency: where it is not installed (package blender) the script says so and exits 77.
# Exits 1 when GGX differs by 1 % anywhere away from terminator and outline.
set -euo pipefail
build=${1:-build}
pictures=${2:-$build/peers/cycles}
command -v blender >/dev/null || { echo "skipped: blender is not here (package blender)"; exit 77; }
mkdir -p "$pictures"
blender -b --factory-startup -P "$(dirname "$0")/preview_cycles.py" -- "$(realpath "$build/bin/weft")" \
    "$(realpath "$pictures")" 2>&1 | grep -vE '^(Fra:|Saved:|Blender |Read |Time:| Time|$)' || true
exit "${PIPESTATUS[0]}"
