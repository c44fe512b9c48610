/** Bytes of PTP datasets: little-endian numbers, counted arrays, counted UCS-2 text (ISO 15740 section 5). */
#ifndef WEFT_HOST_RIG_PTP_PACK_H
#define WEFT_HOST_RIG_PTP_PACK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** A dataset under construction.  `bytes` has room for `size`; what does not fit sets `overflow`. */
typedef struct ptp_writer {
    uint8_t *bytes;
    size_t size, used;
    bool overflow;
} ptp_writer;

void ptp_put(ptp_writer *w, uint64_t value, int n_bytes);
/** A count (32 bit) and that many 16- or 32-bit numbers. */
void ptp_put_array16(ptp_writer *w, const uint16_t *values, uint32_t n);
void ptp_put_array32(ptp_writer *w, const uint32_t *values, uint32_t n);
/** One byte with the number of characters including the NUL, then UCS-2; "" is the byte 0 alone.  ASCII. */
void ptp_put_text(ptp_writer *w, const char *text);

/** A little-endian number of n_bytes (1 to 8) at `bytes`. */
uint64_t ptp_get(const uint8_t *bytes, int n_bytes);

#endif
