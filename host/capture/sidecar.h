/**
 * A file beside each frame that says all there is to say of it, for programs that know nothing of sets:
 * light-03.dng.json beside light-03.dng (docs/formats.md).
 *
 * It repeats the frame's entry of set.json, which stays what Weft itself reads, and what the raw file says
 * when it is read back: so a sidecar is also the proof that the file on disk opens.
 */
#ifndef WEFT_HOST_CAPTURE_SIDECAR_H
#define WEFT_HOST_CAPTURE_SIDECAR_H

#include "host/set/set.h"

#define WEFT_SIDECAR_VERSION 1
#define WEFT_SIDECAR_SUFFIX  ".json"

/** Writes the sidecar of a frame, whole or not at all; one that is there is replaced.
 *  @return WEFT_ERR_IO and what weft_raw_read() returns */
weft_err weft_sidecar_write(const weft_set *set, int frame, weft_error *err);

/** Writes those that are not there. */
weft_err weft_sidecar_write_missing(const weft_set *set, weft_error *err);

#endif
