#include "host/camera/aravis_formats.h"

#include <stdio.h>
#include <string.h>

static const struct {
    char name[3];
    weft_cfa cfa;
} orders[] = {
    {"RG", WEFT_CFA_RGGB},
    {"GR", WEFT_CFA_GRBG},
    {"GB", WEFT_CFA_GBRG},
    {"BG", WEFT_CFA_BGGR},
};

/* Best first: more bits, then less work. */
static const struct {
    const char *suffix;
    int bits;
    weft_packing packing;
} depths[] = {
    {"16", 16, WEFT_PACKING_16}, {"14", 14, WEFT_PACKING_16}, {"14p", 14, WEFT_PACKING_P},
    {"12", 12, WEFT_PACKING_16}, {"12p", 12, WEFT_PACKING_P}, {"12Packed", 12, WEFT_PACKING_12GV},
    {"10", 10, WEFT_PACKING_16}, {"10p", 10, WEFT_PACKING_P}, {"8", 8, WEFT_PACKING_8},
};

enum { N_ORDERS = sizeof orders / sizeof orders[0], N_DEPTHS = sizeof depths / sizeof depths[0] };

static const weft_camera_quirk quirks[] = {
    /* The virtual scanner: 14 bits in 16, as the Nikon body whose sensor it copies. */
    {"Weft", "Virtual scanner", 256, 15871, WEFT_GAIN_DB, 0},
    {"", "", 0, 0, WEFT_GAIN_FIXED, 0},
};

const weft_camera_quirk *weft_camera_find_quirk(const char *vendor, const char *model)
{
    for (const weft_camera_quirk *q = quirks; q->vendor[0]; q++)
        if (strcmp(q->vendor, vendor) == 0 && strcmp(q->model, model) == 0)
            return q;
    return NULL;
}

static bool parse(const char *name, weft_raw_format *format, int *rank)
{
    if (strncmp(name, "Bayer", 5) != 0 || strlen(name) < 8 || strlen(name) >= sizeof format->name)
        return false;
    for (int o = 0; o < N_ORDERS; o++)
        for (int d = 0; d < N_DEPTHS; d++)
            if (memcmp(name + 5, orders[o].name, 2) == 0 && strcmp(name + 7, depths[d].suffix) == 0) {
                *format = (weft_raw_format){
                    .cfa = orders[o].cfa, .bits = depths[d].bits, .packing = depths[d].packing};
                snprintf(format->name, sizeof format->name, "%s", name);
                *rank = d;
                return true;
            }
    return false;
}

bool weft_raw_format_from_name(const char *name, weft_raw_format *format)
{
    return parse(name, format, &(int){0});
}

bool weft_raw_format_best(const char *const *names, unsigned n, weft_raw_format *format)
{
    int best = N_DEPTHS;
    for (unsigned i = 0; i < n; i++) {
        weft_raw_format this_one;
        int rank;
        if (parse(names[i], &this_one, &rank) && rank < best) {
            best = rank;
            *format = this_one;
        }
    }
    return best < N_DEPTHS;
}

size_t weft_raw_format_bytes(const weft_raw_format *format, size_t n)
{
    switch (format->packing) {
    case WEFT_PACKING_16:
        return 2 * n;
    case WEFT_PACKING_8:
        return n;
    case WEFT_PACKING_P:
    case WEFT_PACKING_12GV:
        break;
    }
    return ((size_t)format->bits * n + 7) / 8;
}

/* One sample after the other without gaps; never reads behind the last byte of n samples. */
static void unpack_bits(const uint8_t *bytes, size_t n, int bits, uint16_t *samples)
{
    uint32_t held = 0;
    int n_held = 0;
    for (size_t i = 0; i < n; i++) {
        while (n_held < bits) {
            held |= (uint32_t)*bytes++ << n_held;
            n_held += 8;
        }
        samples[i] = (uint16_t)(held & ((1u << bits) - 1));
        held >>= bits;
        n_held -= bits;
    }
}

static uint16_t sample_12gv(const uint8_t *bytes, size_t i)
{
    const uint8_t *const b = bytes + i / 2 * 3;
    return (uint16_t)(i % 2 == 0 ? b[0] << 4 | (b[1] & 15) : b[2] << 4 | b[1] >> 4);
}

void weft_raw_format_unpack(const weft_raw_format *format, const uint8_t *bytes, size_t n, uint16_t *samples)
{
    switch (format->packing) {
    case WEFT_PACKING_16:
        for (size_t i = 0; i < n; i++)
            samples[i] = (uint16_t)(bytes[2 * i] | bytes[2 * i + 1] << 8);
        return;
    case WEFT_PACKING_8:
        for (size_t i = 0; i < n; i++)
            samples[i] = bytes[i];
        return;
    case WEFT_PACKING_P:
        unpack_bits(bytes, n, format->bits, samples);
        return;
    case WEFT_PACKING_12GV:
        for (size_t i = 0; i < n; i++)
            samples[i] = sample_12gv(bytes, i);
        return;
    }
}
