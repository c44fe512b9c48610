#include "shading/preview/sheet.h"

#include "core/colour.h"
#include "core/colour_map.h"
#include "core/mem.h"
#include "shading/preview/font.h"

#include <assert.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#define GAP 12 /* pixels between tiles */
#define INK 0.75f

static int label_height(const weft_sheet *sheet)
{
    return (WEFT_FONT_HEIGHT + 4) * sheet->label_scale;
}

weft_err weft_sheet_init(weft_sheet *sheet, int columns, int rows, int tile_width, int tile_height,
                         const char *title, weft_error *err)
{
    weft_sheet made = {
        .columns = columns, .rows = rows, .tile_width = tile_width, .tile_height = tile_height};
    made.label_scale = tile_width >= 240 ? 2 : 1;
    made.top = title[0] ? (WEFT_FONT_HEIGHT + 6) * (made.label_scale + 1) : 0;
    WEFT_TRY(weft_image_init(&made.image, GAP + columns * (tile_width + GAP),
                             GAP + made.top + rows * (tile_height + label_height(&made) + GAP), 3, err));
    for (size_t i = 0; i < 3 * weft_image_plane_size(&made.image); i++)
        made.image.data[i] = (float)WEFT_SHEET_GROUND;
    weft_font_draw(&made.image, GAP, GAP, made.label_scale + 1, title, INK);
    *sheet = made;
    return WEFT_OK;
}

void weft_sheet_fini(weft_sheet *sheet)
{
    weft_image_fini(&sheet->image);
    *sheet = (weft_sheet){0};
}

/* Source pixels begin..end (fractional) of one line averaged; step is the distance of neighbours. */
static float average(const float *line, size_t step, int size, double begin, double end)
{
    double sum = 0;
    if (end - begin <= 1) { /* enlarging: between the two nearest */
        const double at = fmin(fmax((begin + end) / 2 - 0.5, 0), size - 1);
        const int first = (int)at, next = first + 1 < size ? first + 1 : first;
        return (float)((1 - (at - first)) * (double)line[(size_t)first * step] +
                       (at - first) * (double)line[(size_t)next * step]);
    }
    for (int i = (int)begin; i < size && i < end; i++)
        sum += (fmin(i + 1, end) - fmax(i, begin)) * (double)line[(size_t)i * step];
    return (float)(sum / (end - begin));
}

weft_err weft_image_scale(weft_image *scaled, const weft_image *image, int width, int height, weft_error *err)
{
    weft_image wide = {0}, made = {0};
    weft_err status = weft_image_init(&wide, width, image->height, image->planes, err);
    if (status == WEFT_OK)
        status = weft_image_init(&made, width, height, image->planes, err);
    const double step_x = (double)image->width / width, step_y = (double)image->height / height;
    for (int p = 0; p < image->planes && status == WEFT_OK; p++) {
        for (int y = 0; y < image->height; y++)
            for (int x = 0; x < width; x++)
                weft_image_row(&wide, p, y)[x] =
                    average(weft_image_row(image, p, y), 1, image->width, x * step_x, (x + 1) * step_x);
        for (int y = 0; y < height; y++)
            for (int x = 0; x < width; x++)
                weft_image_row(&made, p, y)[x] = average(weft_image_plane(&wide, p) + x, (size_t)width,
                                                         image->height, y * step_y, (y + 1) * step_y);
    }
    weft_image_fini(&wide);
    if (status != WEFT_OK)
        weft_image_fini(&made);
    else
        *scaled = made;
    return status;
}

weft_err weft_image_crop(weft_image *part, const weft_image *image, int x, int y, int width, int height,
                         weft_error *err)
{
    weft_image made;
    assert(x >= 0 && y >= 0 && x + width <= image->width && y + height <= image->height);
    WEFT_TRY(weft_image_init(&made, width, height, image->planes, err));
    for (int p = 0; p < image->planes; p++)
        for (int row = 0; row < height; row++)
            memcpy(weft_image_row(&made, p, row), weft_image_row(image, p, y + row) + x,
                   (size_t)width * sizeof(float));
    *part = made;
    return WEFT_OK;
}

/* Cuts a label to what fits; the text keeps its end, which tells files of one folder apart. */
static const char *fitting(const weft_sheet *sheet, const char *label)
{
    while (*label && weft_font_width(sheet->label_scale, label) > sheet->tile_width)
        label++;
    return label;
}

weft_err weft_sheet_place(weft_sheet *sheet, int column, int row, const weft_image *picture,
                          const char *label, weft_error *err)
{
    weft_image fitted;
    const double scale =
        fmin((double)sheet->tile_width / picture->width, (double)sheet->tile_height / picture->height);
    const int width = (int)fmax(1, floor(picture->width * scale + 0.5));
    const int height = (int)fmax(1, floor(picture->height * scale + 0.5));
    WEFT_TRY(weft_image_scale(&fitted, picture, width, height, err));
    const int tile_x = GAP + column * (sheet->tile_width + GAP);
    const int tile_y = GAP + sheet->top + row * (sheet->tile_height + label_height(sheet) + GAP);
    const int x = tile_x + (sheet->tile_width - width) / 2, y = tile_y + (sheet->tile_height - height) / 2;
    for (int c = 0; c < 3; c++)
        for (int line = 0; line < height; line++)
            memcpy(weft_image_row(&sheet->image, c, y + line) + x,
                   weft_image_row(&fitted, fitted.planes == 3 ? c : 0, line), (size_t)width * sizeof(float));
    weft_font_draw(&sheet->image, tile_x, tile_y + sheet->tile_height + 3 * sheet->label_scale,
                   sheet->label_scale, fitting(sheet, label), INK);
    weft_image_fini(&fitted);
    return WEFT_OK;
}

weft_err weft_sheet_show_colour(weft_image *picture, const weft_image *colour, const weft_mask *mask,
                                weft_error *err)
{
    weft_image made;
    WEFT_TRY(weft_image_copy(&made, colour, err));
    for (int p = 0; p < made.planes && mask; p++)
        for (size_t i = 0; i < weft_image_plane_size(&made); i++)
            if (!mask->data[i])
                weft_image_plane(&made, p)[i] = (float)WEFT_SHEET_NONE;
    *picture = made;
    return WEFT_OK;
}

weft_err weft_sheet_show_normals(weft_image *picture, const weft_image *normal, weft_error *err)
{
    weft_image made;
    WEFT_TRY(weft_image_init(&made, normal->width, normal->height, 3, err));
    const size_t n = weft_image_plane_size(normal);
    for (size_t i = 0; i < n; i++) {
        const float *const x = &normal->data[i], *const y = &normal->data[n + i],
                           *const z = &normal->data[2 * n + i];
        const bool none = !(*x * *x + *y * *y + *z * *z > 1e-12f);
        made.data[i] = none ? (float)WEFT_SHEET_NONE : (float)weft_srgb_decode(0.5 + 0.5 * (double)*x);
        made.data[n + i] = none ? (float)WEFT_SHEET_NONE : (float)weft_srgb_decode(0.5 + 0.5 * (double)*y);
        made.data[2 * n + i] =
            none ? (float)WEFT_SHEET_NONE : (float)weft_srgb_decode(0.5 + 0.5 * (double)*z);
    }
    *picture = made;
    return WEFT_OK;
}

static void viridis(double t, float *r, float *g, float *b)
{
    double code[3];
    weft_colour_map_get(WEFT_MAP_VIRIDIS, t, code);
    *r = (float)weft_srgb_decode(code[0]);
    *g = (float)weft_srgb_decode(code[1]);
    *b = (float)weft_srgb_decode(code[2]);
}

weft_err weft_sheet_show_scalar(weft_image *picture, const weft_image *scalar, const weft_mask *mask,
                                double low, double high, weft_error *err)
{
    weft_image made;
    WEFT_TRY(weft_image_init(&made, scalar->width, scalar->height, 3, err));
    const size_t n = weft_image_plane_size(scalar);
    for (size_t i = 0; i < n; i++) {
        const double value = (double)scalar->data[i];
        float *const r = &made.data[i], *const g = &made.data[n + i], *const b = &made.data[2 * n + i];
        if ((mask && !mask->data[i]) || isnan(value))
            *r = *g = *b = (float)WEFT_SHEET_NONE;
        else
            viridis(high > low ? (value - low) / (high - low) : 0, r, g, b);
    }
    *picture = made;
    return WEFT_OK;
}

static int by_value(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

weft_err weft_image_quantile(const weft_image *image, int plane, const weft_mask *mask, double share,
                             double *value, weft_error *err)
{
    const size_t n = weft_image_plane_size(image);
    const float *const from = weft_image_plane(image, plane);
    float *const sorted = weft_alloc(n, sizeof *sorted, err);
    size_t kept = 0;
    if (!sorted)
        return WEFT_ERR_NOMEM;
    for (size_t i = 0; i < n; i++)
        if ((!mask || mask->data[i]) && isfinite(from[i]))
            sorted[kept++] = from[i];
    qsort(sorted, kept, sizeof *sorted, by_value);
    *value = kept ? (double)sorted[(size_t)(share * (double)(kept - 1) + 0.5)] : 0;
    weft_free(sorted);
    return WEFT_OK;
}
