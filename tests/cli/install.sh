#!/usr/bin/env bash
# What `cmake --install` puts under a prefix works there, with the build tree out of sight.
set -u
. "$WEFT_TEST_SOURCE/tests/support/script.sh"

cmake --install "$WEFT_TEST_BUILD" --prefix "$work/prefix" >log 2>&1 || { cat log; exit 1; }
for file in bin/weft bin/weftd bin/weft-rig libexec/weft/weft-camera-aravis lib/weft/libweft_lens_opencv.so \
    share/weft/weft-firmware.hex share/weft/weft-firmware.elf share/weft/library/cotton.radattr \
    share/man/man1/weft.1 share/man/man1/weft-calibrate-lens.1 share/man/man8/weftd.8 \
    share/bash-completion/completions/weft lib/udev/rules.d/70-weft.rules lib/systemd/system/weftd.service \
    lib/sysusers.d/weft.conf share/doc/weft/LICENSE share/doc/weft/README.md share/doc/weft/docs/daemon.md; do
    [ -s "prefix/$file" ] || { echo "FAILED: $file is not installed"; exit 1; }
done

# The parts of the product that are under another licence are a component of their own.
cmake --install "$WEFT_TEST_BUILD" --prefix "$work/free" --component weft >log 2>&1 || { cat log; exit 1; }
[ -x free/bin/weft ] && [ ! -e free/bin/weft-rig ] && [ ! -e free/bin/weftd ] ||
    { echo "FAILED: the component weft is not weft alone"; exit 1; }
expect 1 "the virtual scanner is not installed" free/bin/weft rig --dir rig

# In a name space of its own an empty folder lies over the build tree, where the system lets us.
away() {
    if unshare -m mount -t tmpfs none "$WEFT_TEST_BUILD" 2>/dev/null; then
        unshare -m sh -c 'mount -t tmpfs none "$0" && exec "$@"' "$WEFT_TEST_BUILD" "$@"
    else
        "$@"
    fi
}

weft=$work/prefix/bin/weft
expect 0 "weft 0." away "$weft" --version
printf 'include <cotton.radattr>\n:cloth := ( cotton )\n' >cloth.radattr
expect 0 "" away "$weft" bake cloth.radattr -o cloth.material
expect 1 "lens module        loads" away "$weft" doctor # 1: there is no scanner
cp out doctor
expect 0 "camera backends    aravis, gphoto" cat doctor
expect 0 "prefix/share/weft/weft-firmware.hex" cat doctor
expect 0 "" away "$work/prefix/bin/weftd" --help
expect 0 "weftd" grep "^ExecStart=/.*/bin/weftd" prefix/lib/systemd/system/weftd.service
expect 0 "weft-calibrate-lens" mandoc prefix/share/man/man1/weft.1

# The virtual scanner is found, and finds its firmware before it looks for the sample.
expect 2 "no-such-cloth" away "$weft" rig --dir rig --sample no-such-cloth
rm prefix/share/weft/weft-firmware.elf
expect 1 "weft-firmware.elf: is not there" away "$weft" rig --dir rig --sample no-such-cloth
