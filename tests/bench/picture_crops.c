/*
 * picture_crops OUT.png LEFT TOP WIDTH HEIGHT SCALE PICTURE...: the same crop of several PNGs side by side,
 * each pixel SCALE pixels large, with a white gap between.  For the pictures in docs/images.
 */
#include "core/formats/png_file.h"

#include <stdio.h>
#include <stdlib.h>

enum { GAP = 8 };

/* One crop into column `at` of the output. */
static weft_err paste(const char *path, const int box[4], int scale, int at, weft_raster *out,
                      weft_error *err)
{
    weft_raster in;
    WEFT_TRY(weft_png_read(path, &in, err));
    weft_err status = WEFT_OK;
    if (box[0] < 0 || box[1] < 0 || box[0] + box[2] > in.width || box[1] + box[3] > in.height)
        status = weft_fail(err, WEFT_ERR_RANGE, "%s: the crop leaves its %d x %d pixels", path, in.width,
                           in.height);
    for (int v = 0; status == WEFT_OK && v < box[3] * scale; v++)
        for (int u = 0; u < box[2] * scale; u++) {
            const size_t from =
                (size_t)(box[1] + v / scale) * (size_t)in.width + (size_t)(box[0] + u / scale);
            const size_t to = (size_t)v * (size_t)out->width + (size_t)(at + u);
            for (size_t c = 0; c < 3; c++)
                out->data[3 * to + c] =
                    (uint16_t)(in.data[from * (size_t)in.channels + (in.channels >= 3 ? c : 0)] >>
                               (in.bits - 8));
        }
    weft_raster_fini(&in);
    return status;
}

int main(int argc, char **argv)
{
    weft_error error = {0};
    weft_raster out;
    int box[4];
    if (argc < 8) {
        fprintf(stderr, "usage: picture_crops OUT.png LEFT TOP WIDTH HEIGHT SCALE PICTURE...\n");
        return 2;
    }
    for (int i = 0; i < 4; i++)
        box[i] = (int)strtol(argv[2 + i], NULL, 10);
    const int scale = (int)strtol(argv[6], NULL, 10), n = argc - 7, step = box[2] * scale + GAP;
    weft_err status = weft_raster_init(&out, n * step - GAP, box[3] * scale, 3, 8, &error);
    if (status == WEFT_OK) {
        for (size_t i = 0; i < (size_t)out.width * (size_t)out.height * 3; i++)
            out.data[i] = 255;
        for (int i = 0; i < n && status == WEFT_OK; i++)
            status = paste(argv[7 + i], box, scale, i * step, &out, &error);
        if (status == WEFT_OK)
            status = weft_png_write(argv[1], &out, &error);
        weft_raster_fini(&out);
    }
    if (status != WEFT_OK)
        fprintf(stderr, "picture_crops: %s\n", error.text);
    return status == WEFT_OK ? 0 : 1;
}
