#!/usr/bin/env bash
# weft devices finds a still camera on USB, as the kernel shows it (umockdev), and says why it cannot be opened;
# what is no camera is not listed.
# shellcheck source=tests/support/script.sh
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
command -v umockdev-run >/dev/null || { echo "skipped: needs umockdev"; exit 77; }
export HOME=$work

# device FILE NUMBER VENDOR PRODUCT CLASS SUBCLASS PROTOCOL (of its interface), in hexadecimal
device() {
    python3 - "$@" <<'PY'
import struct, sys
name, number = sys.argv[1], int(sys.argv[2])
vendor, product, *kind = (int(x, 16) for x in sys.argv[3:])
endpoints = b"".join(struct.pack("<BBBBHB", 7, 5, a, t, s, 9) for a, t, s in ((0x81, 2, 512), (2, 2, 512), (0x83, 3, 8)))
interface = struct.pack("<9B", 9, 4, 0, 0, 3, *kind, 0) + endpoints
blob = struct.pack("<BBHBBBBHHHBBBB", 18, 1, 0x200, 0, 0, 0, 64, vendor, product, 0x100, 1, 2, 3, 1)
blob += struct.pack("<BBHBBBBB", 9, 2, 9 + len(interface), 1, 1, 0, 0xC0, 1) + interface
text = blob.hex().upper()
open(name, "w").write(f"""P: /devices/pci0000:00/0000:00:14.0/usb1/1-{number}
N: bus/usb/001/{number:03}={text}
E: DEVNAME=/dev/bus/usb/001/{number:03}
E: DEVTYPE=usb_device
E: SUBSYSTEM=usb
E: BUSNUM=001
E: DEVNUM={number:03}
A: busnum=1\\n
A: devnum={number}\\n
A: idVendor={vendor:04x}\\n
A: idProduct={product:04x}\\n
A: bConfigurationValue=1\\n
A: speed=480\\n
H: descriptors={text}
""")
PY
}
device d5100.umockdev 42 04b0 0429 06 01 01
device player.umockdev 43 041e 4137 ff 00 00 # a music player that libgphoto2 knows as well
umockdev-run -d d5100.umockdev -d player.umockdev -- "$weft" devices --json >devices.json 2>err || { cat err; exit 1; }
expect 0 "gphoto:usb:001,042 Nikon DSC D5100 (PTP mode)" \
    jq -r '.cameras[] | select(.id | startswith("gphoto")) | .id + " " + .model' devices.json
[ "$(grep -c . out)" = 1 ] || { echo "not one still camera:"; cat out; exit 1; }
expect 0 "connecting: does not answer on its line; switch it off and on, check the cable" \
    jq -r '.cameras[] | select(.id | startswith("gphoto")) | .problem' devices.json
