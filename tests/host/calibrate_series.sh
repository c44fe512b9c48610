#!/usr/bin/env bash
# Calibrations of virtual scanners against the truth: one by default, WEFT_SERIES_SEEDS=1-10 for more,
# WEFT_SERIES_SIZE=4928x3264 for full frames.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
[ -x "$WEFT_TEST_BIN/weft-rig" ] || { echo "skipped: this build has no weft-rig"; exit 77; }
[ -f "$WEFT_TEST_BIN/libweft_lens_opencv.so" ] || { echo "skipped: this build has no OpenCV"; exit 77; }
series() {
    python3 "$WEFT_TEST_SOURCE/tests/host/calibrate_series.py" --bin "$WEFT_TEST_BIN" --work "$PWD/series" \
        --flatness "$WEFT_TEST_BUILD/tests/flatness" --size "${WEFT_SERIES_SIZE:-1232x816}" "$@"
}
series --seeds "${WEFT_SERIES_SEEDS:-1}" --check
# Without the strip the drift tilts the sheet: the check can fail.
if series --seeds 1 --no-strip --drift 0.03 --check >without; then
    echo "FAILED: a drift of 3 % is not seen"
    cat without
    exit 1
fi
grep -q 'MISSED: seed 1: block_mean' without
