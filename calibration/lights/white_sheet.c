#include "calibration/lights/white_sheet.h"

#include "core/mem.h"

#include <assert.h>
#include <math.h>

#define CELLS_ACROSS 80

weft_err weft_white_sheet_init(weft_white_sheet *sheet, int width, int height, int n_lights, weft_error *err)
{
    weft_white_sheet s = {.width = width, .height = height, .n_lights = n_lights};
    assert(n_lights >= 1 && n_lights <= WEFT_LIGHTS_MAX);
    s.cell_px = width > 4 * CELLS_ACROSS ? (width + CELLS_ACROSS) / (2 * CELLS_ACROSS) * 2 : 2;
    s.columns = width / s.cell_px; /* a rest at the right and bottom edge is not used */
    s.rows = height / s.cell_px;
    if (s.columns < 8 || s.rows < 8)
        return weft_fail(err, WEFT_ERR_RANGE, "frames of %dx%d are too small to see how light falls off",
                         width, height);
    const size_t n = (size_t)n_lights * 3 * (size_t)(s.columns * s.rows);
    s.value = weft_alloc(n, sizeof *s.value, err);
    if (!s.value)
        return WEFT_ERR_NOMEM;
    for (size_t i = 0; i < n; i++)
        s.value[i] = NAN;
    *sheet = s;
    return WEFT_OK;
}

void weft_white_sheet_fini(weft_white_sheet *sheet)
{
    weft_free(sheet->value);
    *sheet = (weft_white_sheet){0};
}

/* Means of one cell; false when a pixel of it is clipped. */
static bool average_cell(const weft_white_sheet *sheet, int i, int j, const weft_image *image, weft_cfa cfa,
                         const weft_mask *clipped, double mean[3])
{
    double sum[3] = {0};
    int n[3] = {0};
    const int u0 = i * sheet->cell_px, v0 = j * sheet->cell_px;
    for (int v = v0; v < v0 + sheet->cell_px; v++)
        for (int u = u0; u < u0 + sheet->cell_px; u++) {
            if (clipped->data[(size_t)v * (size_t)clipped->width + (size_t)u])
                return false;
            for (int p = 0; p < image->planes; p++) {
                const int c = cfa == WEFT_CFA_NONE ? p : weft_cfa_colour(cfa, u, v);
                sum[c] += (double)weft_image_row(image, p, v)[u];
                n[c]++;
            }
        }
    for (int c = 0; c < 3; c++)
        mean[c] = n[c] ? sum[c] / n[c] : sum[0] / n[0]; /* grey: all three alike */
    return true;
}

static weft_err check_clipped(const weft_white_sheet *sheet, int light, const weft_mask *clipped,
                              weft_error *err)
{
    const size_t total = (size_t)sheet->width * (size_t)sheet->height;
    size_t n = 0;
    for (size_t i = 0; i < total; i++)
        n += clipped->data[i] != 0;
    if ((double)n > WEFT_WHITE_SHEET_CLIPPED_MOST * (double)total)
        return weft_fail(
            err, WEFT_ERR_RANGE,
            "light %d: %.1f %% of the white sheet is saturated; take it again with a shorter exposure", light,
            100.0 * (double)n / (double)total);
    return WEFT_OK;
}

weft_err weft_white_sheet_add(weft_white_sheet *sheet, int light, const weft_image *image, weft_cfa cfa,
                              const weft_mask *clipped, weft_error *err)
{
    assert(light >= 0 && light < sheet->n_lights && (image->planes == 1 || image->planes == 3));
    assert(cfa == WEFT_CFA_NONE || image->planes == 1);
    if (image->width != sheet->width || image->height != sheet->height || clipped->width != sheet->width ||
        clipped->height != sheet->height)
        return weft_fail(err, WEFT_ERR_MISMATCH, "light %d: its frame is %dx%d, the calibration is for %dx%d",
                         light, image->width, image->height, sheet->width, sheet->height);
    WEFT_TRY(check_clipped(sheet, light, clipped, err));
    for (int j = 0; j < sheet->rows; j++)
        for (int i = 0; i < sheet->columns; i++) {
            double mean[3];
            if (!average_cell(sheet, i, j, image, cfa, clipped, mean))
                continue;
            if (!isfinite(mean[0] + mean[1] + mean[2]))
                return weft_fail(err, WEFT_ERR_RANGE, "light %d: its frame has no number near pixel (%d, %d)",
                                 light, i * sheet->cell_px, j * sheet->cell_px);
            for (int c = 0; c < 3; c++)
                weft_white_sheet_plane(sheet, light, c)[j * sheet->columns + i] = (float)mean[c];
        }
    return WEFT_OK;
}
