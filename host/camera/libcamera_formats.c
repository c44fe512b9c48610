#include "host/camera/libcamera_formats.h"

#include <stdlib.h>
#include <string.h>

/* Samples in a group that ends on a byte, and its bytes. */
static const struct {
    int bits, samples, bytes;
} groups[] = {{10, 4, 5}, {12, 2, 3}, {14, 4, 7}};

bool weft_raw_layout_from_name(const char *name, weft_raw_layout *layout)
{
    char order[5] = "", *rest = NULL;
    if (name[0] != 'S' || strlen(name) < 6)
        return false;
    memcpy(order, name + 1, 4);
    if (!weft_cfa_from_name(order, &layout->cfa) || layout->cfa == WEFT_CFA_NONE)
        return false;
    const long bits = strtol(name + 5, &rest, 10);
    layout->bits = (int)bits;
    layout->csi2 = strcmp(rest, "_CSI2P") == 0;
    if (*rest && !layout->csi2)
        return false;
    return layout->csi2 ? bits == 10 || bits == 12 || bits == 14
                        : bits == 8 || bits == 10 || bits == 12 || bits == 14 || bits == 16;
}

size_t weft_raw_layout_row_bytes(const weft_raw_layout *layout, int width)
{
    if (!layout->csi2)
        return (size_t)width * (layout->bits == 8 ? 1 : 2);
    for (size_t i = 0; i < sizeof groups / sizeof groups[0]; i++)
        if (groups[i].bits == layout->bits)
            return ((size_t)width + (size_t)groups[i].samples - 1) / (size_t)groups[i].samples *
                   (size_t)groups[i].bytes;
    return 0;
}

static void unpack_10(const uint8_t *b, int width, uint16_t *s)
{
    for (int u = 0; u < width; u++)
        s[u] = (uint16_t)(b[u / 4 * 5 + u % 4] << 2 | (b[u / 4 * 5 + 4] >> 2 * (u % 4) & 3));
}

static void unpack_12(const uint8_t *b, int width, uint16_t *s)
{
    for (int u = 0; u < width; u++)
        s[u] = (uint16_t)(b[u / 2 * 3 + u % 2] << 4 | (b[u / 2 * 3 + 2] >> 4 * (u % 2) & 15));
}

/* Four high bytes, then four times six low bits one behind the other. */
static void unpack_14(const uint8_t *b, int width, uint16_t *s)
{
    for (int u = 0; u < width; u++) {
        const uint8_t *const g = b + (size_t)(u / 4) * 7;
        const uint32_t low = (uint32_t)g[4] | (uint32_t)g[5] << 8 | (uint32_t)g[6] << 16;
        s[u] = (uint16_t)((unsigned)g[u % 4] << 6 | (low >> (unsigned)(6 * (u % 4)) & 63u));
    }
}

void weft_raw_layout_unpack(const weft_raw_layout *layout, const uint8_t *bytes, int width, uint16_t *samples)
{
    if (layout->csi2 && layout->bits == 10)
        unpack_10(bytes, width, samples);
    else if (layout->csi2 && layout->bits == 12)
        unpack_12(bytes, width, samples);
    else if (layout->csi2)
        unpack_14(bytes, width, samples);
    else if (layout->bits == 8)
        for (int u = 0; u < width; u++)
            samples[u] = bytes[u];
    else
        for (int u = 0; u < width; u++)
            samples[u] = (uint16_t)(bytes[2 * (size_t)u] | bytes[2 * (size_t)u + 1] << 8);
}
