#!/usr/bin/env bash
# weft flash and weft doctor find the board on USB: devices as the kernel shows them (umockdev), their serial port the
# pty of a simulated board.
set -u
. "$WEFT_TEST_SOURCE/tests/firmware/flash_support.sh"
command -v umockdev-run >/dev/null || { echo "no umockdev-run: apt install umockdev"; exit 77; }

# usb FILE NUMBER VENDOR PRODUCT SERIAL: a device on USB; descriptors of a CDC ACM device, as libusb reads them
usb() {
    local low=${3:2:2}${3:0:2}${4:2:2}${4:0:2}
    cat >"$1" <<TEXT
P: /devices/pci0000:00/0000:00:14.0/usb1/1-$2
N: bus/usb/001/00$2
E: BUSNUM=001
E: DEVNAME=/dev/bus/usb/001/00$2
E: DEVNUM=00$2
E: DEVTYPE=usb_device
E: SUBSYSTEM=usb
A: busnum=1
A: devnum=$2
A: idProduct=$4
A: idVendor=$3
A: serial=$5
A: speed=12
A: bConfigurationValue=1
H: descriptors=1201100102000008${low}010001020301090212000101008032090400000002020100

TEXT
}
# tty FILE NUMBER NAME: its serial port
tty() {
    cat >>"$1" <<TEXT
P: /devices/pci0000:00/0000:00:14.0/usb1/1-$2/1-$2:1.0/tty/$3
N: $3
E: DEVNAME=/dev/$3
E: SUBSYSTEM=tty
E: MAJOR=166
E: MINOR=0

TEXT
}
# shellcheck disable=SC2016,SC2317
# on_usb FILES -- COMMAND...: with these devices and no others; /dev/ttyACM0 is the simulated board
on_usb() {
    local devices=()
    while [ "$1" != -- ]; do
        devices+=(--device "$1")
        shift
    done
    shift
    umockdev-run "${devices[@]}" -- bash -c '
        [ -e "$UMOCKDEV_DIR/dev/ttyACM0" ] && ln -sf "$0" "$UMOCKDEV_DIR/dev/ttyACM0"
        exec "$@"' "$pty" "$@"
}

usb uno.umockdev 4 2341 0043 75830333238351F0B1A0
tty uno.umockdev 4 ttyACM0
usb nano.umockdev 5 1a86 7523 ""
tty nano.umockdev 5 ttyUSB0
usb bare.umockdev 6 1a86 7523 ""
usb mouse.umockdev 7 046d c077 ""

board uno none "$optiboot"
expect 1 'no Arduino was found on USB' on_usb mouse.umockdev -- "$weft" flash
expect 1 'the copy of an Arduino with a CH340 (1a86:7523, bus 1, device 6) is on USB but has no serial port' \
    on_usb bare.umockdev mouse.umockdev -- "$weft" flash
also 'sudo apt remove brltty'
expect 1 'there are 2 boards' on_usb uno.umockdev nano.umockdev -- "$weft" flash
also '/dev/ttyACM0 (Arduino Uno R3, serial 75830333238351F0B1A0)'
also '/dev/ttyUSB0 (copy of an Arduino with a CH340)'
expect 0 'port      /dev/ttyACM0' on_usb uno.umockdev mouse.umockdev -- "$weft" flash
also 'verified'
expect 1 'ok       controller ' on_usb uno.umockdev -- "$weft" doctor --camera aravis:none
also "ok       controller's port  /dev/ttyACM0"
exit 0
