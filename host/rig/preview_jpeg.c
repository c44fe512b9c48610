#include "host/rig/preview_jpeg.h"

#include "core/mem.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jpeglib.h>

static uint8_t code(double value, double black, double white)
{
    const double linear = fmin(fmax((value - black) / (white - black), 0), 1);
    return (uint8_t)lround(255 * pow(linear, 1 / 2.2));
}

static void make_row(int width, const uint16_t *upper, double black, double white, uint8_t *rgb)
{
    const uint16_t *const lower = upper + width;
    for (size_t u = 0; u < (size_t)width / 2; u++) {
        rgb[3 * u] = code(upper[2 * u], black, white);
        rgb[3 * u + 1] = code(0.5 * (upper[2 * u + 1] + lower[2 * u]), black, white);
        rgb[3 * u + 2] = code(lower[2 * u + 1], black, white);
    }
}

weft_err weft_preview_jpeg(int width, int height, const uint16_t *dn, double black, double white,
                           uint8_t **bytes, size_t *n_bytes, weft_error *err)
{
    struct jpeg_compress_struct jpeg;
    struct jpeg_error_mgr errors;
    unsigned char *made = NULL;
    unsigned long n_made = 0;
    uint8_t *const row = weft_alloc((size_t)width / 2, 3, err);
    if (!row)
        return WEFT_ERR_NOMEM;
    jpeg.err =
        jpeg_std_error(&errors); /* writing to memory fails only without memory, which ends the program */
    jpeg_create_compress(&jpeg);
    jpeg_mem_dest(&jpeg, &made, &n_made);
    jpeg.image_width = (JDIMENSION)width / 2;
    jpeg.image_height = (JDIMENSION)height / 2;
    jpeg.input_components = 3;
    jpeg.in_color_space = JCS_RGB;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, 90, TRUE);
    jpeg_start_compress(&jpeg, TRUE);
    for (int v = 0; v + 1 < height; v += 2) {
        JSAMPROW rows[1] = {row};
        make_row(width, dn + (size_t)v * (size_t)width, black, white, row);
        jpeg_write_scanlines(&jpeg, rows, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    weft_free(row);
    *bytes = weft_alloc(n_made, 1, err);
    if (*bytes)
        memcpy(*bytes, made, n_made);
    free(made);
    *n_bytes = n_made;
    return *bytes ? WEFT_OK : WEFT_ERR_NOMEM;
}
