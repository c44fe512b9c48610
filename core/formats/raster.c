#include "core/formats/raster.h"

#include "core/colour.h"
#include "core/mem.h"
#include "core/mem_limit.h"

weft_err weft_raster_init(weft_raster *raster, int width, int height, int channels, int bits, weft_error *err)
{
    if (width < 1 || height < 1 || width > WEFT_IMAGE_MAX_SIDE || height > WEFT_IMAGE_MAX_SIDE)
        return weft_fail(err, WEFT_ERR_RANGE, "a picture of %d x %d pixels is not possible (1 to %d a side)",
                         width, height, WEFT_IMAGE_MAX_SIDE);
    if (channels < 1 || channels > 4 || (bits != 8 && bits != 16))
        return weft_fail(err, WEFT_ERR_RANGE,
                         "a picture of %d channels of %d bits is not possible (1 to 4 of 8 or 16)", channels,
                         bits);
    uint16_t *const data = weft_alloc((size_t)width * (size_t)height * (size_t)channels, sizeof *data, err);
    if (!data)
        return WEFT_ERR_NOMEM;
    *raster = (weft_raster){width, height, channels, bits, data};
    return WEFT_OK;
}

void weft_raster_fini(weft_raster *raster)
{
    weft_free(raster->data);
    *raster = (weft_raster){0};
}

static bool is_srgb(weft_transfer transfer, int bits)
{
    return transfer == WEFT_TRANSFER_SRGB || (transfer == WEFT_TRANSFER_BY_BITS && bits == 8);
}

/* One entry per code: 65536 roots are cheaper than one per pixel. */
static float *make_decode_table(int bits, weft_transfer transfer, weft_error *err)
{
    const int n = 1 << bits;
    float *const table = weft_alloc((size_t)n, sizeof *table, err);
    for (int i = 0; table && i < n; i++) {
        const double x = (double)i / (n - 1);
        table[i] = (float)(is_srgb(transfer, bits) ? weft_srgb_decode(x) : x);
    }
    return table;
}

weft_err weft_image_from_raster(weft_image *image, const weft_raster *raster, weft_transfer transfer,
                                weft_error *err)
{
    const int planes = raster->channels < 3 ? 1 : 3;
    float *const table = make_decode_table(raster->bits, transfer, err);
    if (!table)
        return WEFT_ERR_NOMEM;
    weft_image made;
    const weft_err status = weft_image_init(&made, raster->width, raster->height, planes, err);
    if (status == WEFT_OK) {
        const size_t width = (size_t)raster->width, step = (size_t)raster->channels;
        for (int v = 0; v < raster->height; v++, weft_mem_trim())
            for (int p = 0; p < planes; p++) {
                float *const row = weft_image_row(&made, p, v);
                const uint16_t *const from = raster->data + (size_t)v * width * step + (size_t)p;
                for (size_t i = 0; i < width; i++)
                    row[i] = table[from[i * step]];
            }
        *image = made;
    }
    weft_free(table);
    return status;
}

static uint16_t encode(float value, double top, bool srgb)
{
    if (!(value > 0)) /* NaN too */
        return 0;
    if (value >= 1)
        return (uint16_t)top;
    const double x = (double)value;
    return (uint16_t)(top * (srgb ? weft_srgb_encode(x) : x) + 0.5);
}

weft_err weft_raster_from_image(weft_raster *raster, const weft_image *image, int bits,
                                weft_transfer transfer, weft_error *err)
{
    if (image->planes != 1 && image->planes != 3)
        return weft_fail(err, WEFT_ERR_RANGE, "a picture file holds 1 or 3 planes, not %d", image->planes);
    weft_raster made;
    WEFT_TRY(weft_raster_init(&made, image->width, image->height, image->planes, bits, err));
    const size_t width = (size_t)image->width, step = (size_t)image->planes;
    const double top = (1 << bits) - 1;
    const bool srgb = is_srgb(transfer, bits);
    for (int v = 0; v < image->height; v++, weft_mem_trim())
        for (int p = 0; p < image->planes; p++) {
            const float *const row = weft_image_row(image, p, v);
            uint16_t *const to = made.data + (size_t)v * width * step + (size_t)p;
            for (size_t i = 0; i < width; i++)
                to[i * step] = encode(row[i], top, srgb);
        }
    *raster = made;
    return WEFT_OK;
}
