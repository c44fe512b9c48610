#!/usr/bin/env bash
# Weft's colour fit beside ArgyllCMS (scanin, colprof) on one picture of a chart, judged by the same colours:
#   tests/bench/peers/colour_argyll.sh [BUILD]
# ArgyllCMS is no dependency: where it is not installed (package argyll) the script says so and exits 77.
set -euo pipefail
build=${1:-build}
for program in scanin colprof profcheck; do
    command -v "$program" >/dev/null || { echo "skipped: $program is not here (package argyll)"; exit 77; }
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$build/peers/peer_colour" "$work"
cd "$work"
scanin -p -F "$(cat fiducials)" picture.tif chart.cht chart.cie >scanin.log 2>&1 || { cat scanin.log; exit 1; }

errors() { profcheck -k "$1" "$2" | sed -n 's/.*max. = \([0-9.]*\), avg. = \([0-9.]*\).*/\2 \1/p'; } # FILE.ti3 PROFILE: mean max

# Each patch by a profile made without it.
held_out() { # OPTION
    local i sum=0 first
    first=$(grep -n '^BEGIN_DATA$' picture.ti3 | cut -d: -f1)
    for i in $(seq 24); do
        awk -v drop=$((first + i)) 'NR != drop' picture.ti3 | sed 's/^NUMBER_OF_SETS 24/NUMBER_OF_SETS 23/' >part.ti3
        awk -v keep=$((first + i)) -v first="$first" 'NR <= first || NR == keep || /^END_DATA$/' picture.ti3 |
            sed 's/^NUMBER_OF_SETS 24/NUMBER_OF_SETS 1/' >one.ti3
        colprof "$1" -D part -O part.icc part >/dev/null 2>&1
        sum=$(errors one.ti3 part.icc | awk -v s="$sum" '{print s + $1}')
    done
    awk -v s="$sum" 'BEGIN {printf "%.2f", s / 24}'
}

for option in -am -ag -as; do
    colprof "$option" -D picture -O picture.icc picture >/dev/null 2>&1
    read -r mean max < <(errors picture.ti3 picture.icc)
    read -r cotton cotton_max < <(errors cotton.ti3 picture.icc)
    printf '%-28s %8.2f %8.2f %8s %8.2f %8.2f\n' "argyll colprof $option" "$mean" "$max" "$(held_out "$option")" "$cotton" "$cotton_max"
done
