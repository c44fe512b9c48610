#include "calibration/charts/chart_measure.h"

#include "calibration/charts/homography.h"
#include "calibration/charts/robust.h"
#include "core/mem.h"

#include <math.h>

enum { SITES_MIN = 16 };
static const double window = 0.5; /* of the patch's side */

const char *const weft_site_names[WEFT_SITES] = {"R", "G1", "G2", "B"};
const int weft_site_colour[WEFT_SITES] = {0, 1, 1, 2};

/* Pixels that may lie in the window. */
typedef struct box {
    int u0, v0, u1, v1; /* inclusive */
} box;

static bool window_box(const weft_chart_pose *pose, double x, double y, double half, const weft_image *image,
                       box *b)
{
    double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY};
    for (int k = 0; k < 4; k++) {
        double u, v;
        if (!weft_homography_apply(&pose->to_pixel, x + (k & 1 ? half : -half), y + (k & 2 ? half : -half),
                                   &u, &v))
            return false;
        lo[0] = fmin(lo[0], u);
        lo[1] = fmin(lo[1], v);
        hi[0] = fmax(hi[0], u);
        hi[1] = fmax(hi[1], v);
    }
    if (!(lo[0] >= 0 && lo[1] >= 0 && hi[0] <= image->width - 1 && hi[1] <= image->height - 1))
        return false;
    *b = (box){(int)ceil(lo[0]), (int)ceil(lo[1]), (int)floor(hi[0]), (int)floor(hi[1])};
    return true;
}

static weft_site site_of(weft_cfa cfa, int u, int v)
{
    const int colour = weft_cfa_colour(cfa, u, v);
    if (colour != 1)
        return colour == 0 ? WEFT_SITE_R : WEFT_SITE_B;
    return weft_cfa_colour(cfa, u + 1, v) == 0 ? WEFT_SITE_G1 : WEFT_SITE_G2;
}

/* Values of the window by class; the classes share one buffer of `room` each. */
typedef struct collector {
    double *values[WEFT_SITES];
    int n[WEFT_SITES];
    int clipped, total;
} collector;

static void collect_pixel(const weft_chart_picture *picture, int u, int v, collector *c)
{
    const weft_image *const image = picture->image;
    c->total++;
    if (picture->clipped && picture->clipped->data[(size_t)v * (size_t)image->width + (size_t)u]) {
        c->clipped++;
        return;
    }
    for (int s = 0; s < WEFT_SITES; s++) {
        if (picture->cfa != WEFT_CFA_NONE && site_of(picture->cfa, u, v) != (weft_site)s)
            continue;
        const float value = weft_image_row(image, image->planes == 3 ? weft_site_colour[s] : 0, v)[u];
        if (isfinite(value))
            c->values[s][c->n[s]++] = (double)value;
    }
}

static void collect(const weft_chart_picture *picture, const weft_mat3 *to_chart, double x, double y,
                    double half, const box *b, collector *c)
{
    c->clipped = c->total = 0;
    for (int s = 0; s < WEFT_SITES; s++)
        c->n[s] = 0;
    for (int v = b->v0; v <= b->v1; v++)
        for (int u = b->u0; u <= b->u1; u++) {
            double px, py;
            if (weft_homography_apply(to_chart, u, v, &px, &py) && fabs(px - x) <= half &&
                fabs(py - y) <= half)
                collect_pixel(picture, u, v, c);
        }
}

static void summarise(collector *c, double *scratch, weft_patch_reading *reading)
{
    int kept = 0, all = 0;
    for (int s = 0; s < WEFT_SITES; s++) {
        const weft_robust_mean m = weft_mean_robust(c->values[s], c->n[s], scratch);
        reading->mean[s] = m.mean;
        reading->std_dev[s] = m.std_dev;
        reading->n[s] = m.kept;
        kept += m.kept;
        all += m.n;
    }
    reading->clipped = c->total ? (double)c->clipped / c->total : 0;
    reading->outliers = all ? 1 - (double)kept / all : 0;
}

static weft_err measure_patch(const weft_chart *chart, const weft_chart_picture *picture,
                              const weft_chart_pose *pose, const weft_mat3 *to_chart, int patch,
                              weft_patch_reading *reading, weft_error *err)
{
    double x, y;
    const double half = 0.5 * window * chart->patch_mm;
    box b;
    weft_chart_patch_centre(chart, patch, &x, &y);
    if (!window_box(pose, x, y, half, picture->image, &b) ||
        !weft_homography_apply(&pose->to_pixel, x, y, &reading->u, &reading->v))
        return weft_fail(err, WEFT_ERR_NODATA, "patch \"%s\" lies outside the picture: move the chart",
                         chart->patches[patch].name);
    const size_t room = (size_t)(b.u1 - b.u0 + 1) * (size_t)(b.v1 - b.v0 + 1);
    double *const buffer = weft_alloc(room * (WEFT_SITES + 1), sizeof *buffer, err);
    if (!buffer)
        return WEFT_ERR_NOMEM;
    collector c;
    for (int s = 0; s < WEFT_SITES; s++)
        c.values[s] = buffer + room * (size_t)s;
    collect(picture, to_chart, x, y, half, &b, &c);
    weft_err status = WEFT_OK;
    const int wanted = (picture->cfa == WEFT_CFA_NONE ? 1 : 4) * SITES_MIN;
    if (c.total < wanted)
        status = weft_fail(
            err, WEFT_ERR_NODATA,
            "patch \"%s\" has only %d pixels in its middle (%d wanted): fill more of the picture with "
            "the chart",
            chart->patches[patch].name, c.total, wanted);
    else
        summarise(&c, buffer + room * WEFT_SITES, reading);
    weft_free(buffer);
    return status;
}

weft_err weft_chart_measure(const weft_chart *chart, const weft_chart_picture *picture,
                            const weft_chart_pose *pose, weft_patch_reading *readings, weft_error *err)
{
    weft_mat3 to_chart;
    if (!weft_mat3_invert(&pose->to_pixel, &to_chart))
        return weft_fail(err, WEFT_ERR_NODATA, "the chart's position is degenerate: give other corners");
    for (int p = 0; p < chart->columns * chart->rows; p++)
        WEFT_TRY(measure_patch(chart, picture, pose, &to_chart, p, &readings[p], err));
    return WEFT_OK;
}
