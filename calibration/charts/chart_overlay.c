#include "calibration/charts/chart_overlay.h"

#include "calibration/charts/homography.h"
#include "calibration/charts/robust.h"
#include "core/colour.h"
#include "core/mem.h"

#include <math.h>

enum { SAMPLES = 20000 };

typedef struct pen {
    weft_raster *raster;
    weft_mat3 to_raster; /* chart mm to raster pixels */
    int rgb[3];
    double width_px;
} pen;

static void dot(const pen *p, double u, double v)
{
    const double r = 0.5 * p->width_px;
    for (int y = (int)floor(v - r); y <= (int)ceil(v + r); y++)
        for (int x = (int)floor(u - r); x <= (int)ceil(u + r); x++) {
            if (x < 0 || y < 0 || x >= p->raster->width || y >= p->raster->height ||
                hypot(x - u, y - v) > r + 0.2)
                continue;
            uint16_t *const to = p->raster->data + ((size_t)y * (size_t)p->raster->width + (size_t)x) * 3;
            for (int c = 0; c < 3; c++)
                to[c] = (uint16_t)p->rgb[c];
        }
}

static void line(const pen *p, double x0, double y0, double x1, double y1)
{
    double u0, v0, u1, v1;
    if (!weft_homography_apply(&p->to_raster, x0, y0, &u0, &v0) ||
        !weft_homography_apply(&p->to_raster, x1, y1, &u1, &v1))
        return;
    const int steps = (int)fmin(2 * hypot(u1 - u0, v1 - v0) + 1, 1e5);
    for (int i = 0; i <= steps; i++)
        dot(p, u0 + (u1 - u0) * i / steps, v0 + (v1 - v0) * i / steps);
}

static void rectangle(const pen *p, double x, double y, double half_x, double half_y)
{
    line(p, x - half_x, y - half_y, x + half_x, y - half_y);
    line(p, x + half_x, y - half_y, x + half_x, y + half_y);
    line(p, x + half_x, y + half_y, x - half_x, y + half_y);
    line(p, x - half_x, y + half_y, x - half_x, y - half_y);
}

/* Each channel's 99th percentile becomes white. */
static weft_err develop(const weft_image *cells, weft_raster *raster, weft_error *err)
{
    const size_t n = weft_image_plane_size(cells), stride = n / SAMPLES + 1;
    double *const scratch = weft_alloc(SAMPLES + 1, sizeof *scratch, err);
    if (!scratch)
        return WEFT_ERR_NOMEM;
    weft_err status = weft_raster_init(raster, cells->width, cells->height, 3, 8, err);
    for (int c = 0; c < 3 && status == WEFT_OK; c++) {
        const float *const from = weft_image_plane(cells, c);
        int k = 0;
        for (size_t i = 0; i < n; i += stride)
            scratch[k++] = isfinite(from[i]) ? (double)from[i] : 0;
        const double white = weft_select(scratch, k, (int)(0.99 * (k - 1)));
        for (size_t i = 0; i < n; i++)
            raster->data[3 * i + (size_t)c] =
                (uint16_t)weft_srgb_encode8(white > 0 ? 0.9 * (double)from[i] / white : 0);
    }
    weft_free(scratch);
    return status;
}

static void draw(const weft_chart *chart, const weft_chart_pose *pose, const unsigned char *left_out,
                 int side, weft_raster *raster)
{
    const double c = 0.5 / side - 0.5;
    const weft_mat3 to_cell = {{1.0 / side, 0, c, 0, 1.0 / side, c, 0, 0, 1}};
    pen p = {raster, weft_mat3_multiply(&to_cell, &pose->to_pixel), {255, 220, 0}, 2};
    double half_x, half_y, x, y;
    weft_chart_half_size(chart, &half_x, &half_y);
    rectangle(&p, 0, 0, half_x, half_y);
    for (int i = 0; i < 48; i++) { /* a ring at the first corner */
        const double a = i * 0.1308996938995747, b = (i + 1) * 0.1308996938995747;
        line(&p, -half_x + 4 * cos(a), half_y + 4 * sin(a), -half_x + 4 * cos(b), half_y + 4 * sin(b));
    }
    for (int k = 0; k < chart->columns * chart->rows; k++) {
        const bool bad = left_out && left_out[k];
        p.rgb[0] = bad ? 255 : 0;
        p.rgb[1] = bad ? 40 : 230;
        p.rgb[2] = bad ? 40 : 60;
        weft_chart_patch_centre(chart, k, &x, &y);
        p.width_px = 2;
        rectangle(&p, x, y, 0.5 * chart->patch_mm, 0.5 * chart->patch_mm);
        p.width_px = 1;
        rectangle(&p, x, y, 0.25 * chart->patch_mm, 0.25 * chart->patch_mm);
        if (bad) {
            line(&p, x - 3, y - 3, x + 3, y + 3);
            line(&p, x - 3, y + 3, x + 3, y - 3);
        }
    }
}

weft_err weft_chart_overlay(const weft_chart *chart, const weft_chart_picture *picture,
                            const weft_chart_pose *pose, const unsigned char *left_out, weft_raster *raster,
                            weft_error *err)
{
    const int side = picture->cfa == WEFT_CFA_NONE ? 1 : 2;
    weft_image cells;
    WEFT_TRY(weft_chart_picture_reduce(picture, side, &cells, err));
    const weft_err status = develop(&cells, raster, err);
    weft_image_fini(&cells);
    if (status == WEFT_OK)
        draw(chart, pose, left_out, side, raster);
    return status;
}
