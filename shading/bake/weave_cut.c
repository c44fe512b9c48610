#include "shading/bake/weave.h"

#include "core/mem.h"
#include "core/parallel.h"

#include <math.h>
#include <string.h>

/* Half the width in pixels over which the cut is blended. */
#define FEATHER_PX 3

/* Where the tile lies in the picture, and how large it is with the overlap of a repeat. */
typedef struct plan {
    const weft_weave *weave;
    double origin[2], across[2], down[2]; /* pixels a pixel of the tile */
    int width, height, overlap[2], threads[2];
} plan;

/* Bounds of the parallelogram of n x m threads. */
static void extent(const weft_weave *weave, int n, int m, double low[2], double high[2])
{
    for (int c = 0; c < 2; c++) {
        const double a = n * weave->step_px[0][c], b = m * weave->step_px[1][c];
        low[c] = fmin(fmin(0, a), fmin(b, a + b));
        high[c] = fmax(fmax(0, a), fmax(b, a + b));
    }
}

/* How far at most the threads lie off their lattice, pixels. */
static double farthest_off(const weft_weave *weave)
{
    double most = 0;
    for (int c = 0; c < 2; c++) {
        const weft_image *const shift = &weave->lie[c].shift;
        const double step = hypot(weave->step_px[c][0], weave->step_px[c][1]);
        for (size_t i = 0; shift->planes && i < weft_image_plane_size(shift); i++)
            most = fmax(most, step * fabs((double)shift->data[i]));
    }
    return most;
}

static weft_err make_plan(const weft_weave *weave, int w, int h, plan *p, weft_error *err)
{
    const double length[2] = {hypot(weave->step_px[0][0], weave->step_px[0][1]),
                              hypot(weave->step_px[1][0], weave->step_px[1][1])};
    const double room = 1 + farthest_off(weave);
    const double size[2] = {w - 2 * room, h - 2 * room};
    double low[2], high[2];
    int n[2];
    p->weave = weave;
    for (int c = 0; c < 2; c++) /* one repeat more than the tile, for the overlap */
        n[c] = (int)(size[c] / (length[c] * weave->threads[c]));
    do { /* a skewed tile needs more room than its sides */
        extent(weave, n[0] * weave->threads[0], n[1] * weave->threads[1], low, high);
        for (int c = 0; c < 2; c++)
            n[c] -= high[c] - low[c] > size[c];
        if (n[0] < 2 || n[1] < 2)
            return weft_fail(
                err, WEFT_ERR_NODATA,
                "the picture holds less than two repeats of %d x %d threads; scan a larger piece",
                weave->threads[0], weave->threads[1]);
    } while (high[0] - low[0] > size[0] || high[1] - low[1] > size[1]);
    for (int c = 0; c < 2; c++) {
        p->threads[c] = (n[c] - 1) * weave->threads[c];
        p->overlap[c] = (int)(weave->threads[c] * length[c]);
        p->origin[c] = room - low[c] + (size[c] - (high[c] - low[c])) / 2;
    }
    p->width = (int)lround(p->threads[0] * length[0]);
    p->height = (int)lround(p->threads[1] * length[1]);
    for (int c = 0; c < 2; c++) {
        p->across[c] = p->threads[0] * weave->step_px[0][c] / p->width;
        p->down[c] = p->threads[1] * weave->step_px[1][c] / p->height;
    }
    return WEFT_OK;
}

typedef struct straighten {
    const plan *plan;
    const weft_image *from;
    weft_image *to;
    bool normals;
} straighten;

/* Where a pixel of the tile lies in the picture. */
static void source_of(const plan *p, double x, double y, double at[2])
{
    const double even[2] = {p->origin[0] + x * p->across[0] + y * p->down[0],
                            p->origin[1] + x * p->across[1] + y * p->down[1]};
    weft_weave_place(p->weave, even, at);
}

static void straighten_rows(void *context, int band, int begin, int end)
{
    const straighten *const s = context;
    (void)band;
    for (int y = begin; y < end; y++) {
        double at[2], next[2];
        source_of(s->plan, 0, y, next);
        for (int x = 0; x < s->to->width; x++) {
            memcpy(at, next, sizeof at);
            source_of(s->plan, x + 1, y, next);
            for (int k = 0; k < s->to->planes; k++)
                weft_image_row(s->to, k, y)[x] = weft_image_sample(s->from, k, at[0], at[1]);
            if (!s->normals)
                continue;
            /* turned as the cloth is here; rows go down, y goes up in the maps */
            const double turn = hypot(next[0] - at[0], next[1] - at[1]);
            const double c = (next[0] - at[0]) / turn, d = -(next[1] - at[1]) / turn;
            float *const nx = &weft_image_row(s->to, 0, y)[x], *const ny = &weft_image_row(s->to, 1, y)[x];
            const double a = (double)*nx, b = (double)*ny;
            *nx = (float)(c * a + d * b);
            *ny = (float)(c * b - d * a);
        }
    }
}

static float slope(const weft_image *normal, int plane, size_t i)
{
    return weft_image_plane(normal, plane)[i] / fmaxf(weft_image_plane(normal, 2)[i], 0.05F);
}

/* How unlike two pixels are: slopes and albedo together. */
static double unlike(const weft_image *maps, int n, size_t a, size_t b)
{
    double sum = 0;
    for (int k = 0; k < 2; k++) {
        const double d = (double)(slope(&maps[0], k, a) - slope(&maps[0], k, b));
        sum += d * d;
    }
    for (int k = 0; n > 1 && k < maps[1].planes; k++) {
        const double d = (double)(weft_image_plane(&maps[1], k)[a] - weft_image_plane(&maps[1], k)[b]);
        sum += 4 * d * d;
    }
    return sum;
}

/* A line of the seam's band: pixel t across the band, s along it. */
static size_t index_of(const weft_image *image, bool across, int t, int s)
{
    return across ? (size_t)s * (size_t)image->width + (size_t)t
                  : (size_t)t * (size_t)image->width + (size_t)s;
}

/* The path of least difference along the band, by dynamic programming.  @param cut  [length] */
static weft_err find_cut(const weft_image *maps, int n, bool across, int period, int overlap, int length,
                         int *cut, weft_error *err)
{
    double *const cost = weft_alloc((size_t)overlap * (size_t)length, sizeof *cost, err);
    if (!cost)
        return WEFT_ERR_NOMEM;
    for (int s = 0; s < length; s++)
        for (int t = 0; t < overlap; t++) {
            double before = 0;
            for (int k = -1; s > 0 && k <= 1; k++)
                if (t + k >= 0 && t + k < overlap) {
                    const double one = cost[(size_t)(s - 1) * (size_t)overlap + (size_t)(t + k)];
                    before = k == -1 || t + k == 0 ? one : fmin(before, one);
                }
            cost[(size_t)s * (size_t)overlap + (size_t)t] =
                before +
                unlike(maps, n, index_of(&maps[0], across, t, s), index_of(&maps[0], across, t + period, s));
        }
    int t = overlap / 2;
    for (int k = FEATHER_PX; k < overlap - FEATHER_PX; k++)
        if (cost[(size_t)(length - 1) * (size_t)overlap + (size_t)k] <
            cost[(size_t)(length - 1) * (size_t)overlap + (size_t)t])
            t = k;
    for (int s = length - 1; s >= 0; s--) {
        cut[s] = t;
        int best = t;
        for (int k = -1; s > 0 && k <= 1; k++)
            if (t + k >= FEATHER_PX && t + k < overlap - FEATHER_PX &&
                cost[(size_t)(s - 1) * (size_t)overlap + (size_t)(t + k)] <
                    cost[(size_t)(s - 1) * (size_t)overlap + (size_t)best])
                best = t + k;
        t = best;
    }
    weft_free(cost);
    return WEFT_OK;
}

/* Before the cut what follows the tile's far edge, behind it the tile's own beginning. */
static void close_seam(weft_image *map, bool across, int period, int overlap, int length, const int *cut)
{
    for (int k = 0; k < map->planes; k++)
        for (int s = 0; s < length; s++)
            for (int t = 0; t < overlap; t++) {
                const float own = fminf(fmaxf(0.5F + (float)(t - cut[s]) / (2 * FEATHER_PX), 0), 1);
                float *const here = &weft_image_plane(map, k)[index_of(map, across, t, s)];
                const float next = weft_image_plane(map, k)[index_of(map, across, t + period, s)];
                *here = next + own * (*here - next);
            }
}

static weft_err close_one(weft_image *maps, int n, const plan *p, bool across, weft_error *err)
{
    const int length = across ? maps[0].height : p->width, overlap = p->overlap[across ? 0 : 1];
    const int period = across ? p->width : p->height;
    int *const cut = weft_alloc((size_t)length, sizeof *cut, err);
    weft_err status = cut ? find_cut(maps, n, across, period, overlap, length, cut, err) : WEFT_ERR_NOMEM;
    for (int k = 0; k < n && status == WEFT_OK; k++)
        close_seam(&maps[k], across, period, overlap, length, cut);
    weft_free(cut);
    return status;
}

static weft_err crop(const weft_image *from, int w, int h, weft_image *to, weft_error *err)
{
    WEFT_TRY(weft_image_init(to, w, h, from->planes, err));
    for (int k = 0; k < from->planes; k++)
        for (int y = 0; y < h; y++)
            memcpy(weft_image_row(to, k, y), weft_image_row(from, k, y), (size_t)w * sizeof(float));
    return WEFT_OK;
}

static void make_unit(weft_image *normal)
{
    const size_t n = weft_image_plane_size(normal);
    for (size_t i = 0; i < n; i++) {
        float *const v = normal->data + i;
        const float length = sqrtf(v[0] * v[0] + v[n] * v[n] + v[2 * n] * v[2 * n]);
        for (int c = 0; c < 3; c++)
            v[(size_t)c * n] = length > 0 ? v[(size_t)c * n] / length : (float)(c == 2);
    }
}

/* The mean step over the edge that closes, and the largest mean step between two lines inside: threads have
 * edges too, and the seam may lie on one. */
static void measure_steps(const weft_image *tiles, int n, bool across, double *over, double *inside)
{
    const int length = across ? tiles[0].height : tiles[0].width,
              count = across ? tiles[0].width : tiles[0].height;
    *inside = 0;
    for (int t = 0; t < count; t++) {
        double mean = 0;
        for (int s = 0; s < length; s++)
            mean += sqrt(unlike(tiles, n, index_of(&tiles[0], across, t, s),
                                index_of(&tiles[0], across, t + 1 < count ? t + 1 : 0, s))) /
                    length;
        if (t + 1 < count)
            *inside = fmax(*inside, mean);
        else
            *over = mean;
    }
}

/* Rms of the means of the repeats over the mean: blotches that the eye finds in every tile. */
static double measure_repetition(const weft_image *albedo, const plan *p)
{
    const int nx = albedo->width / p->overlap[0], ny = albedo->height / p->overlap[1];
    double sum = 0, squares = 0;
    if (nx < 2 || ny < 2)
        return 0;
    for (int j = 0; j < ny; j++)
        for (int i = 0; i < nx; i++) {
            double block = 0;
            const int x0 = i * albedo->width / nx, x1 = (i + 1) * albedo->width / nx;
            const int y0 = j * albedo->height / ny, y1 = (j + 1) * albedo->height / ny;
            for (int y = y0; y < y1; y++)
                for (int x = x0; x < x1; x++)
                    block += (double)weft_image_row(albedo, albedo->planes > 1, y)[x] /
                             ((double)(x1 - x0) * (y1 - y0));
            sum += block / (nx * ny);
            squares += block * block / (nx * ny);
        }
    return sum > 0 ? sqrt(fmax(squares - sum * sum, 0)) / sum : 0;
}

weft_err weft_weave_cut(const weft_image *const planes[], int n, const weft_weave *weave, weft_image tiles[],
                        weft_seam *seam, weft_error *err)
{
    enum { MOST = 8 };
    plan p;
    weft_image wide[MOST] = {{0}};
    weft_err status = n < 1 || n > MOST ? weft_fail(err, WEFT_ERR_RANGE, "1 to %d maps are cut at once", MOST)
                                        : make_plan(weave, planes[0]->width, planes[0]->height, &p, err);
    for (int k = 0; k < n && status == WEFT_OK; k++) {
        status = weft_image_init(&wide[k], p.width + p.overlap[0], p.height + p.overlap[1], planes[k]->planes,
                                 err);
        straighten s = {&p, planes[k], &wide[k], k == 0};
        if (status == WEFT_OK)
            weft_parallel_rows(wide[k].height, straighten_rows, &s);
    }
    if (status == WEFT_OK)
        status = close_one(wide, n, &p, true, err);
    if (status == WEFT_OK)
        status = close_one(wide, n, &p, false, err);
    for (int k = 0; k < n && status == WEFT_OK; k++)
        status = crop(&wide[k], p.width, p.height, &tiles[k], err);
    if (status == WEFT_OK) {
        make_unit(&tiles[0]);
        measure_steps(tiles, n, true, &seam->across[0], &seam->inside[0]);
        measure_steps(tiles, n, false, &seam->across[1], &seam->inside[1]);
        seam->repetition = n > 1 ? measure_repetition(&tiles[1], &p) : 0;
        memcpy(seam->threads, p.threads, sizeof seam->threads);
    }
    for (int k = 0; k < MOST; k++)
        weft_image_fini(&wide[k]);
    return status;
}
