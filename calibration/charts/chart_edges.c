#include "calibration/charts/chart_edges.h"

#include "calibration/charts/homography.h"
#include "calibration/charts/robust.h"
#include "core/mem.h"

#include <math.h>

enum {
    PIECES = 3,
    LINES = 7,
    PROFILE_MAX = 192,
    EDGES_MIN = 24,
    SIGHTS_MAX = WEFT_CHART_MAX_PATCHES * 4 * PIECES
};

/* Of the patch's side: how far a profile reaches inward; and of the gap to the next patch outward. */
static const double reach_in = 0.16, reach_out = 0.47;

/* Where a piece of an edge should be: middle, direction along and outward, in mm of the chart. */
typedef struct piece {
    double x, y, along_x, along_y, out_x, out_y, length, in_mm, out_mm;
} piece;

static piece make_piece(const weft_chart *chart, int patch, int side, int k)
{
    static const double out[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    piece p = {
        .out_x = out[side][0], .out_y = out[side][1], .along_x = -out[side][1], .along_y = out[side][0]};
    const double half = 0.5 * chart->patch_mm, at = (k - 1) * 0.52 * half;
    double x, y;
    weft_chart_patch_centre(chart, patch, &x, &y);
    p.x = x + p.out_x * half + p.along_x * at;
    p.y = y + p.out_y * half + p.along_y * at;
    p.length = 0.42 * half;
    p.in_mm = reach_in * chart->patch_mm;
    p.out_mm = reach_out * (chart->pitch_mm - chart->patch_mm);
    return p;
}

/* Mean profile across the piece from inside to outside; returns the number of samples, 0 when out of sight.
 */
static int read_profile(const piece *p, const weft_image *contrast, const weft_mat3 *map, double *profile)
{
    double u0, v0, u1, v1;
    if (!weft_homography_apply(map, p->x - p->out_x * p->in_mm, p->y - p->out_y * p->in_mm, &u0, &v0) ||
        !weft_homography_apply(map, p->x + p->out_x * p->out_mm, p->y + p->out_y * p->out_mm, &u1, &v1))
        return 0;
    const double span = hypot(u1 - u0, v1 - v0);
    if (!(span > 3))
        return 0;
    const int n = (int)fmin(PROFILE_MAX, ceil(2 * span) + 1);
    for (int i = 0; i < n; i++) {
        const double d = -p->in_mm + (p->in_mm + p->out_mm) * i / (n - 1);
        double sum = 0;
        for (int k = 0; k < LINES; k++) {
            const double a = p->length * (2.0 * k / (LINES - 1) - 1);
            double u, v;
            if (!weft_homography_apply(map, p->x + d * p->out_x + a * p->along_x,
                                       p->y + d * p->out_y + a * p->along_y, &u, &v) ||
                u < 0 || v < 0 || u > contrast->width - 1 || v > contrast->height - 1)
                return 0;
            sum += (double)weft_image_sample(contrast, 0, u, v);
        }
        profile[i] = sum / LINES;
    }
    return n;
}

static double level(const double *profile, int begin, int end, double *spread)
{
    double copy[PROFILE_MAX], scratch[PROFILE_MAX];
    for (int i = begin; i < end; i++)
        copy[i - begin] = profile[i];
    const weft_robust_mean m = weft_mean_robust(copy, end - begin, scratch);
    *spread = m.std_dev;
    return m.mean;
}

/* Position of the only half-way crossing as a share of the profile, or -1. */
static double crossing(const double *profile, int n)
{
    double noise_in, noise_out;
    const int third = n / 4 > 2 ? n / 4 : 2;
    const double in = level(profile, 0, third, &noise_in), out = level(profile, n - third, n, &noise_out);
    if (!(in - out > 0.15 * in) || !(in - out > 4 * (noise_in + noise_out)))
        return -1;
    const double half = 0.5 * (in + out);
    double at = -1;
    for (int i = 0; i + 1 < n; i++)
        if ((profile[i] > half) != (profile[i + 1] > half)) {
            if (at >= 0)
                return -1;
            at = (i + (profile[i] - half) / (profile[i] - profile[i + 1])) / (n - 1);
        }
    return at;
}

static bool see_edge(const piece *p, const weft_image *contrast, const weft_mat3 *map,
                     weft_homography_sight *sight)
{
    double profile[PROFILE_MAX] = {0};
    const int n = read_profile(p, contrast, map, profile);
    const double at = n ? crossing(profile, n) : -1;
    if (at < 0)
        return false;
    const double d = -p->in_mm + (p->in_mm + p->out_mm) * at;
    double u0, v0;
    sight->x = p->x;
    sight->y = p->y;
    if (!weft_homography_apply(map, p->x + d * p->out_x, p->y + d * p->out_y, &sight->u, &sight->v) ||
        !weft_homography_apply(map, p->x + d * p->out_x + 0.1 * p->along_x,
                               p->y + d * p->out_y + 0.1 * p->along_y, &u0, &v0))
        return false;
    const double length =
        hypot(u0 - sight->u, v0 - sight->v); /* the normal is across the edge in the picture */
    sight->nu = (v0 - sight->v) / length;
    sight->nv = -(u0 - sight->u) / length;
    return length > 0;
}

weft_err weft_chart_edges_refine(const weft_chart *chart, const weft_image *contrast, weft_mat3 *map,
                                 int *n_edges, double *rms, weft_error *err)
{
    weft_homography_sight *const sights = weft_alloc(SIGHTS_MAX, sizeof *sights, err);
    double *const scratch = weft_alloc((size_t)2 * SIGHTS_MAX, sizeof *scratch, err);
    weft_err status = sights && scratch ? WEFT_OK : WEFT_ERR_NOMEM;
    *n_edges = 0;
    *rms = 0;
    for (int round = 0; round < 3 && status == WEFT_OK; round++) {
        int n = 0;
        for (int p = 0; p < chart->columns * chart->rows; p++)
            for (int side = 0; side < 4; side++)
                for (int k = 0; k < PIECES; k++) {
                    const piece at = make_piece(chart, p, side, k);
                    n += see_edge(&at, contrast, map, &sights[n]);
                }
        if (n < EDGES_MIN)
            break;
        weft_mat3 refined = *map;
        double spread;
        if (weft_homography_refine(sights, n, true, scratch, &refined, &spread, NULL) != WEFT_OK)
            break;
        *map = refined;
        *rms = spread;
        *n_edges = n;
    }
    weft_free(sights);
    weft_free(scratch);
    return status;
}
