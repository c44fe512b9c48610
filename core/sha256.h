/** SHA-256 (FIPS 180-4). */
#ifndef WEFT_CORE_SHA256_H
#define WEFT_CORE_SHA256_H

#include "core/error.h"

#include <stddef.h>
#include <stdint.h>

typedef struct weft_sha256 {
    uint32_t state[8];
    uint64_t n_bytes;
    uint8_t block[64];
} weft_sha256;

void weft_sha256_init(weft_sha256 *hash);
void weft_sha256_update(weft_sha256 *hash, const void *bytes, size_t n);
/** Ends the hash and writes 64 lower-case hex digits and NUL. */
void weft_sha256_final_hex(weft_sha256 *hash, char hex[65]);

/** Hash of a whole file.  @return WEFT_ERR_IO naming the file. */
weft_err weft_sha256_file(const char *path, char hex[65], weft_error *err);

#endif
