#include "host/rig/ptp_pack.h"

#include <string.h>

void ptp_put(ptp_writer *w, uint64_t value, int n_bytes)
{
    if (w->size - w->used < (size_t)n_bytes) {
        w->overflow = true;
        return;
    }
    for (int i = 0; i < n_bytes; i++)
        w->bytes[w->used++] = (uint8_t)(value >> (8 * i));
}

void ptp_put_array16(ptp_writer *w, const uint16_t *values, uint32_t n)
{
    ptp_put(w, n, 4);
    for (uint32_t i = 0; i < n; i++)
        ptp_put(w, values[i], 2);
}

void ptp_put_array32(ptp_writer *w, const uint32_t *values, uint32_t n)
{
    ptp_put(w, n, 4);
    for (uint32_t i = 0; i < n; i++)
        ptp_put(w, values[i], 4);
}

void ptp_put_text(ptp_writer *w, const char *text)
{
    const size_t n = strlen(text);
    ptp_put(w, n ? n + 1 : 0, 1);
    for (size_t i = 0; n && i <= n; i++)
        ptp_put(w, (uint8_t)text[i], 2);
}

uint64_t ptp_get(const uint8_t *bytes, int n_bytes)
{
    uint64_t value = 0;
    for (int i = n_bytes - 1; i >= 0; i--)
        value = value << 8 | bytes[i];
    return value;
}
