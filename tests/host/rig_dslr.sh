#!/usr/bin/env bash
# The virtual D5100 under the stock gphoto2, with dcraw and exiftool as judges of its files.
# shellcheck source=tests/support/script.sh
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
command -v gphoto2 dcraw exiftool >/dev/null || { echo "skipped: needs gphoto2, dcraw and exiftool"; exit 77; }
# shellcheck source=tests/support/rig_start.sh
. "$WEFT_TEST_SOURCE/tests/support/rig_start.sh"
export HOME=$work # gphoto2 remembers ports and cameras there
# shellcheck disable=SC2317
clean_up() {
    stop_rig
    rm -rf "$work"
}
trap clean_up EXIT

start_rig r --sample twill --size 308x204
port=$(jq -r '.cameras[1]' r.out | sed 's/.*://')
tell() { "$weft" rig --dir r --tell "dslr $1"; }
camera() { timeout 60 gphoto2 --port "ptpip:127.0.0.1:$port:$port" "$@"; }

expect 0 "Model: D5100" camera --summary
expect 0 "Serial Number: 6001234" camera --summary
expect 0 "Choice: 52 Bulb" camera --get-config shutterspeed2

# A raw photograph as set, by two other readers.
expect 0 "Saving file as a.nef" camera --set-config imagequality="NEF (Raw)" --set-config shutterspeed2=1/25 \
    --set-config iso=200 --capture-image-and-download --filename a.nef
expect 0 "Camera: Nikon D5100" dcraw -i -v a.nef
expect 0 "Image size:   308 x 204" dcraw -i -v a.nef
expect 0 "Filter pattern: RG/GB" dcraw -i -v a.nef
expect 0 "1/25" exiftool -ExposureTime a.nef
expect 0 ": 200" exiftool -ISO a.nef
expect 0 ": 6001234" exiftool -SerialNumber a.nef

# JPEG, and a setting that the body does not have.
tell "turn 0x5004 2" >/dev/null
expect 0 "Saving file as b.jpg" camera --capture-image-and-download --filename b.jpg
expect 0 "154x102" exiftool -ImageSize b.jpg
expect 1 "no such setting" tell "turn 0x500f 123"

# What is refused, what breaks.
tell "fault card-full" >/dev/null
expect 0 "Store Full" camera --capture-image # gphoto2 2.5.28 exits 0 all the same
tell unplug >/dev/null
expect 1 "Connection refused" camera --summary
tell plug >/dev/null
head -c 3000 /dev/urandom >"/dev/tcp/127.0.0.1/$port"
printf '\xff\xff\xff\xff\x01\x00\x00\x00' >"/dev/tcp/127.0.0.1/$port"
expect 0 "Model: D5100" camera --summary
expect 0 '"releases":2' tell state

expect 0 ok "$weft" rig --dir r --tell quit
await_rig
