/* A blank sheet photographed under the light of the photographs: what to divide them by. */
#include "host/photo/photo.h"

#include "core/mem.h"

#include <math.h>

enum { FLAT_COLUMNS = 48 };
static const double most_clipped = 1e-3, least_mean = 0.03;
static const double most_detail = 0.05; /* of a cell from the mean of its neighbours, rms */

void weft_photo_flat_fini(weft_photo_flat *flat)
{
    weft_image_fini(&flat->gain);
    *flat = (weft_photo_flat){0};
}

static weft_err check_sheet(const weft_photo *sheet, weft_error *err)
{
    const size_t n = weft_image_plane_size(&sheet->image), values = n * (size_t)sheet->image.planes;
    size_t clipped = 0;
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        clipped += sheet->clipped.data[i] == 1;
    for (size_t i = 0; i < values; i++)
        sum += (double)sheet->image.data[i];
    if ((double)clipped > most_clipped * (double)n)
        return weft_fail(err, WEFT_ERR_RANGE,
                         "%.2f %% of the sheet is clipped (%.1f %% allowed): expose it less",
                         100 * (double)clipped / (double)n, 100 * most_clipped);
    if (!(sum / (double)values > least_mean))
        return weft_fail(err, WEFT_ERR_RANGE,
                         "the sheet is too dark (mean %.3f of the range, %.2f wanted): expose it more",
                         sum / (double)values, least_mean);
    return WEFT_OK;
}

/* Means of the cells, colour by colour. */
static weft_err average(const weft_photo *sheet, weft_image *cells, weft_error *err)
{
    const weft_image *const image = &sheet->image;
    const size_t n = weft_image_plane_size(cells);
    double *const count = weft_alloc(3 * n, sizeof *count, err);
    if (!count)
        return WEFT_ERR_NOMEM;
    for (int c = 0; c < image->planes; c++)
        for (int v = 0; v < image->height; v++) {
            const float *const row = weft_image_row(image, c, v);
            const int r = (int)((long)v * cells->height / image->height);
            for (int u = 0; u < image->width; u++) {
                const int channel = sheet->cfa == WEFT_CFA_NONE ? c : weft_cfa_colour(sheet->cfa, u, v);
                const size_t at = (size_t)channel * n + (size_t)r * (size_t)cells->width +
                                  (size_t)((long)u * cells->width / image->width);
                cells->data[at] += row[u];
                count[at]++;
            }
        }
    for (size_t i = 0; i < 3 * n; i++)
        cells->data[i] = (float)((double)cells->data[i] / (count[i] > 0 ? count[i] : 1));
    weft_free(count);
    return WEFT_OK;
}

/* Mean of a cell with its neighbours, edges repeated; and how far the cells stand off it. */
static double smooth_plane(const float *from, float *to, int width, int height)
{
    double square = 0;
    for (int v = 0; v < height; v++)
        for (int u = 0; u < width; u++) {
            double sum = 0;
            for (int y = v - 1; y <= v + 1; y++)
                for (int x = u - 1; x <= u + 1; x++) {
                    const int cy = y < 0         ? 0
                                   : y >= height ? height - 1
                                                 : y,
                              cx = x < 0        ? 0
                                   : x >= width ? width - 1
                                                : x;
                    sum += (double)from[cy * width + cx] / 9;
                }
            const double off = sum > 0 ? (double)from[v * width + u] / sum - 1 : 1;
            to[v * width + u] = (float)sum;
            square += off * off;
        }
    return sqrt(square / (width * height));
}

weft_err weft_photo_flat_make(const weft_photo *sheet, weft_photo_flat *flat, weft_error *err)
{
    const int width = sheet->image.width, height = sheet->image.height;
    const int columns = width < FLAT_COLUMNS ? width : FLAT_COLUMNS;
    const int rows = columns * height / width > 0 ? columns * height / width : 1;
    weft_image cells = {0};
    weft_photo_flat made = {.width = width, .height = height};
    double detail = 0;
    WEFT_TRY(check_sheet(sheet, err));
    weft_err status = weft_image_init(&cells, columns, rows, 3, err);
    if (status == WEFT_OK)
        status = weft_image_init(&made.gain, columns, rows, 3, err);
    if (status == WEFT_OK)
        status = average(sheet, &cells, err);
    for (int c = 0; c < 3 && status == WEFT_OK; c++) {
        float *const plane = weft_image_plane(&made.gain, c);
        detail = fmax(detail, smooth_plane(weft_image_plane(&cells, c), plane, columns, rows));
        const float middle = plane[(rows / 2) * columns + columns / 2];
        if (!(middle > 0))
            status = weft_fail(err, WEFT_ERR_RANGE, "the middle of the sheet is black");
        for (int i = 0; i < columns * rows && status == WEFT_OK; i++)
            plane[i] = fmaxf(plane[i] / middle, 1e-3F);
    }
    if (status == WEFT_OK && detail > most_detail)
        status = weft_fail(
            err, WEFT_ERR_RANGE,
            "this is no blank sheet: its parts differ by %.1f %% from their surroundings (%.0f %% allowed)",
            100 * detail, 100 * most_detail);
    weft_image_fini(&cells);
    if (status == WEFT_OK)
        *flat = made;
    else
        weft_photo_flat_fini(&made);
    return status;
}

weft_err weft_photo_flatten(weft_photo *photo, const weft_photo_flat *flat, weft_error *err)
{
    if (!flat->gain.data)
        return WEFT_OK;
    if (photo->image.width != flat->width || photo->image.height != flat->height)
        return weft_fail(err, WEFT_ERR_MISMATCH,
                         "has %d x %d pixels, the blank sheet %d x %d: one camera, one setting",
                         photo->image.width, photo->image.height, flat->width, flat->height);
    const double sx = (double)flat->gain.width / flat->width, sy = (double)flat->gain.height / flat->height;
    for (int c = 0; c < photo->image.planes; c++)
        for (int v = 0; v < flat->height; v++) {
            float *const row = weft_image_row(&photo->image, c, v);
            for (int u = 0; u < flat->width; u++) {
                const int channel = photo->cfa == WEFT_CFA_NONE ? c : weft_cfa_colour(photo->cfa, u, v);
                row[u] /= weft_image_sample(&flat->gain, channel, (u + 0.5) * sx - 0.5, (v + 0.5) * sy - 0.5);
            }
        }
    return WEFT_OK;
}
