#include "host/rig/nef_bytes.h"

#include "core/mem.h"
#include "host/rig/ptp_pack.h"

#include <math.h>
#include <string.h>

/* TIFF types. */
enum { BYTE = 1, ASCII = 2, SHORT = 3, LONG = 4, RATIONAL = 5 };

enum { HEADER_BYTES = 1024, N_MAIN = 17, N_EXIF = 7, ENTRY_BYTES = 12 };

typedef struct directory {
    ptp_writer entries, *values; /* values lie behind both directories */
} directory;

/* One value that fits into its entry. */
static void add_number(directory *d, unsigned tag, unsigned type, uint32_t value)
{
    ptp_put(&d->entries, tag, 2);
    ptp_put(&d->entries, type, 2);
    ptp_put(&d->entries, 1, 4);
    ptp_put(&d->entries, value, 4);
}

static void add_bytes(directory *d, unsigned tag, unsigned type, uint32_t count, const void *bytes, size_t n)
{
    static const uint8_t zeros[4] = {0};
    ptp_put(&d->entries, tag, 2);
    ptp_put(&d->entries, type, 2);
    ptp_put(&d->entries, count, 4);
    const uint8_t *const from = bytes;
    ptp_writer *const to = n <= 4 ? &d->entries : d->values;
    if (n > 4)
        ptp_put(&d->entries, d->values->used, 4);
    for (size_t i = 0; i < n; i++)
        ptp_put(to, from[i], 1);
    for (size_t i = n; i < 4; i++)
        ptp_put(to, zeros[0], 1);
    if (n > 4 && n % 2)
        ptp_put(to, 0, 1); /* values begin at even offsets */
}

static void add_text(directory *d, unsigned tag, const char *text)
{
    add_bytes(d, tag, ASCII, (uint32_t)strlen(text) + 1, text, strlen(text) + 1);
}

static void add_rational(directory *d, unsigned tag, uint32_t numerator, uint32_t denominator)
{
    uint8_t eight[8];
    ptp_writer w = {.bytes = eight, .size = sizeof eight};
    ptp_put(&w, numerator, 4);
    ptp_put(&w, denominator, 4);
    add_bytes(d, tag, RATIONAL, 1, eight, sizeof eight);
}

/* Tags in rising order, as TIFF wants them. */
static void add_main(directory *d, const weft_nef_info *info, uint32_t raw_width, uint32_t exif_offset)
{
    static const uint8_t cell[4] = {2, 0, 2, 0}, pattern[4] = {0, 1, 1, 2};
    const uint32_t height = (uint32_t)info->height;
    add_number(d, 254, LONG, 0);
    add_number(d, 256, LONG, raw_width);
    add_number(d, 257, LONG, height);
    add_number(d, 258, SHORT, 16);
    add_number(d, 259, SHORT, 1);
    add_number(d, 262, SHORT, 32803); /* colour filter array */
    add_text(d, 271, "NIKON CORPORATION");
    add_text(d, 272, "NIKON D5100");
    add_number(d, 273, LONG, HEADER_BYTES);
    add_number(d, 274, SHORT, 1);
    add_number(d, 277, SHORT, 1);
    add_number(d, 278, LONG, height);
    add_number(d, 279, LONG, 2 * raw_width * height);
    add_text(d, 306, info->date_time);
    add_bytes(d, 33421, SHORT, 2, cell, sizeof cell);
    add_bytes(d, 33422, BYTE, 4, pattern, sizeof pattern);
    add_number(d, 34665, LONG, exif_offset);
}

static void add_exif(directory *d, const weft_nef_info *info)
{
    static const char version[4] = {'0', '2', '2', '1'};
    add_rational(d, 33434, info->exposure_num, info->exposure_den);
    add_rational(d, 33437, 8, 1);
    add_number(d, 34855, SHORT, info->iso);
    add_bytes(d, 36864, 7, 4, version, sizeof version);
    add_text(d, 36867, info->date_time);
    add_rational(d, 37386, 85, 1); /* focal length, mm */
    add_text(d, 42033, info->serial);
}

static void write_header(const weft_nef_info *info, uint32_t raw_width, uint8_t *bytes)
{
    const uint32_t main_offset = 8, exif_offset = main_offset + 2 + N_MAIN * ENTRY_BYTES + 4;
    ptp_writer values = {
        .bytes = bytes, .size = HEADER_BYTES, .used = exif_offset + 2 + N_EXIF * ENTRY_BYTES + 4};
    directory d = {.entries = {.bytes = bytes, .size = HEADER_BYTES}, .values = &values};
    ptp_put(&d.entries, 0x002a4949, 4); /* "II", 42 */
    ptp_put(&d.entries, main_offset, 4);
    ptp_put(&d.entries, N_MAIN, 2);
    add_main(&d, info, raw_width, exif_offset);
    ptp_put(&d.entries, 0, 4);
    ptp_put(&d.entries, N_EXIF, 2);
    add_exif(&d, info);
    ptp_put(&d.entries, 0, 4);
}

/* Masked photosites get no light: after the body's subtraction they read 0. */
static void write_samples(const weft_nef_info *info, const uint16_t *dn, double black, double white,
                          uint8_t *bytes)
{
    const size_t raw_width = (size_t)info->width + WEFT_NEF_MASKED_COLUMNS;
    const double scale = WEFT_NEF_WHITE / (white - black);
    for (int v = 0; v < info->height; v++)
        for (int u = 0; u < info->width; u++) {
            const double value = ((double)dn[(size_t)v * (size_t)info->width + (size_t)u] - black) * scale;
            const uint16_t stored = (uint16_t)floor(fmin(fmax(value, 0), WEFT_NEF_WHITE) + 0.5);
            uint8_t *const to = bytes + 2 * ((size_t)v * raw_width + (size_t)u);
            to[0] = (uint8_t)stored;
            to[1] = (uint8_t)(stored >> 8);
        }
}

weft_err weft_nef_make(const weft_nef_info *info, const uint16_t *dn, double black_dn, double white_dn,
                       uint8_t **bytes, size_t *n_bytes, weft_error *err)
{
    const size_t raw_width = (size_t)info->width + WEFT_NEF_MASKED_COLUMNS;
    const size_t n = HEADER_BYTES + 2 * raw_width * (size_t)info->height;
    uint8_t *const file = weft_alloc(n, 1, err);
    if (!file)
        return WEFT_ERR_NOMEM;
    write_header(info, (uint32_t)raw_width, file);
    write_samples(info, dn, black_dn, white_dn, file + HEADER_BYTES);
    *bytes = file;
    *n_bytes = n;
    return WEFT_OK;
}
