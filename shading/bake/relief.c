#include "shading/bake/relief.h"

#include "core/mem.h"
#include "core/parallel.h"
#include "shading/bake/horizon.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { MAX_TAPS = 64 };

weft_relief_options weft_relief_defaults(double mm_per_px)
{
    return (weft_relief_options){.mm_per_px = mm_per_px, .reach_mm = 2, .slices = 8};
}

/* -- occlusion ---------------------------------------------------------------------------------------- */

/* A step of a search: where, and how far that is. */
typedef struct tap {
    int x, y; /* whole texels before (fx, fy) */
    float fx, fy;
    float distance; /* texels */
} tap;

typedef struct search {
    const weft_image *height, *normal;
    const weft_relief_options *options;
    weft_image *occlusion, *cone;
    tap *taps; /* [2 * slices][MAX_TAPS]: slice s ahead, then back */
    int n_taps;
    float scale; /* texels per mm */
} search;

static int fold(int i, int n, bool periodic)
{
    if (!periodic)
        return i < 0 ? 0 : i >= n ? n - 1 : i;
    const int r = i % n;
    return r < 0 ? r + n : r;
}

/* Steps that grow by a fifth: near things hide most, and far relief is seen small. */
static int plan_taps(const search *s, tap *taps)
{
    const double reach = fmax(1, s->options->reach_mm / s->options->mm_per_px);
    int n = 0;
    for (double t = 1; n < MAX_TAPS && (n == 0 || t <= reach); t += fmax(0.5, 0.2 * t), n++)
        for (int side = 0; side < 2 * s->options->slices; side++) {
            const double phi = PI * (side % s->options->slices + 0.5) / s->options->slices;
            const double x = t * cos(phi) * (side < s->options->slices ? 1 : -1);
            const double y = -t * sin(phi) * (side < s->options->slices ? 1 : -1); /* rows go down */
            taps[side * MAX_TAPS + n] =
                (tap){(int)floor(x), (int)floor(y), (float)(x - floor(x)), (float)(y - floor(y)), (float)t};
        }
    return n;
}

/* The steepest rise (height over distance) on one side; open sides fall for ever. */
static float horizon(const search *s, const tap *taps, int x, int y, bool inside)
{
    const weft_image *const h = s->height;
    const float here = weft_image_row(h, 0, y)[x];
    const bool periodic = s->options->periodic;
    float steepest = -1e9F;
    for (int k = 0; k < s->n_taps; k++) {
        const tap *const t = &taps[k];
        int xa = x + t->x, ya = y + t->y, xb = xa + 1, yb = ya + 1;
        if (!inside) {
            if (!periodic && (xa < 0 || ya < 0 || xb >= h->width || yb >= h->height))
                break; /* nothing is known out there: it hides nothing */
            xa = fold(xa, h->width, periodic);
            xb = fold(xb, h->width, periodic);
            ya = fold(ya, h->height, periodic);
            yb = fold(yb, h->height, periodic);
        }
        const float *const a = weft_image_row(h, 0, ya), *const b = weft_image_row(h, 0, yb);
        const float top = a[xa] + t->fx * (a[xb] - a[xa]), bottom = b[xa] + t->fx * (b[xb] - b[xa]);
        const float rise = (top + t->fy * (bottom - top) - here) / t->distance;
        steepest = rise > steepest ? rise : steepest;
    }
    return steepest * s->scale;
}

static void normal_at(const search *s, int x, int y, double n[3])
{
    if (s->normal) {
        for (int c = 0; c < 3; c++)
            n[c] = (double)weft_image_row(s->normal, c, y)[x];
        return;
    }
    const weft_image *const h = s->height;
    const bool periodic = s->options->periodic;
    const int l = fold(x - 1, h->width, periodic), r = fold(x + 1, h->width, periodic);
    const int u = fold(y - 1, h->height, periodic), d = fold(y + 1, h->height, periodic);
    const double across = periodic ? 2 : r - l, down = periodic ? 2 : d - u;
    const double dx =
        across > 0 ? (double)(weft_image_row(h, 0, y)[r] - weft_image_row(h, 0, y)[l]) / across : 0;
    const double dy = down > 0 ? (double)(weft_image_row(h, 0, d)[x] - weft_image_row(h, 0, u)[x]) / down : 0;
    const double a = -dx * (double)s->scale, b = dy * (double)s->scale, length = sqrt(a * a + b * b + 1);
    n[0] = a / length;
    n[1] = b / length;
    n[2] = 1 / length;
}

/* Integral of cos(t - gamma) |sin t| (sin t, cos t) from 0 to h: the open direction within the slice. */
static void add_direction(double h, double gamma, double sum[2])
{
    const double s = sin(h), c = cos(h);
    const double s3 = s * s * s / 3, c3 = c * c * c / 3;
    const double along = cos(gamma) * s3 + sin(gamma) * (c3 - c + 2.0 / 3);
    const double up = cos(gamma) * (1.0 / 3 - c3) + sin(gamma) * s3;
    /* from h to 0 where h < 0, and |sin t| = -sin t there: both signs turn, and cancel */
    sum[0] += along;
    sum[1] += up;
}

static void occlude(const search *s, int x, int y, bool inside)
{
    double n[3], visible = 0, open[3] = {0, 0, 0};
    const int slices = s->options->slices;
    normal_at(s, x, y, n);
    for (int k = 0; k < slices; k++) {
        const double phi = PI * (k + 0.5) / slices, dx = cos(phi), dy = sin(phi);
        const double along = n[0] * dx + n[1] * dy, share = hypot(along, n[2]), gamma = atan2(along, n[2]);
        const weft_horizon_arc arc = weft_horizon_clamp(
            (weft_horizon_arc){
                atan((double)horizon(s, s->taps + (size_t)(slices + k) * MAX_TAPS, x, y, inside)) - PI / 2,
                PI / 2 - atan((double)horizon(s, s->taps + (size_t)k * MAX_TAPS, x, y, inside))},
            gamma);
        if (arc.h1_rad >= arc.h2_rad)
            continue; /* a pit whose sides meet above the normal's hemisphere */
        visible += share * weft_horizon_visibility(arc, gamma);
        double in_slice[2] = {0, 0};
        add_direction(arc.h1_rad, gamma, in_slice);
        add_direction(arc.h2_rad, gamma, in_slice);
        open[0] += share * in_slice[0] * dx;
        open[1] += share * in_slice[0] * dy;
        open[2] += share * in_slice[1];
    }
    visible = fmin(fmax(visible / slices, 0), 1);
    weft_image_row(s->occlusion, 0, y)[x] = (float)visible;
    if (!s->cone)
        return;
    const double length = sqrt(open[0] * open[0] + open[1] * open[1] + open[2] * open[2]);
    for (int c = 0; c < 3; c++)
        weft_image_row(s->cone, c, y)[x] = (float)(length > 0 ? open[c] / length : n[c]);
    weft_image_row(s->cone, 3, y)[x] = (float)sqrt(1 - visible);
}

static void occlusion_rows(void *context, int band, int begin, int end)
{
    const search *const s = context;
    const int w = s->height->width, h = s->height->height;
    const int margin = s->n_taps ? (int)ceilf(s->taps[s->n_taps - 1].distance) + 1 : 1;
    (void)band;
    for (int y = begin; y < end; y++)
        for (int x = 0; x < w; x++)
            occlude(s, x, y, x >= margin && y >= margin && x + margin < w && y + margin < h);
}

weft_err weft_relief_occlusion(const weft_image *height, const weft_image *normal,
                               const weft_relief_options *options, weft_image *occlusion, weft_image *cone,
                               weft_error *err)
{
    search s = {.height = height,
                .normal = normal,
                .options = options,
                .occlusion = occlusion,
                .cone = cone,
                .scale = (float)(1 / options->mm_per_px)};
    WEFT_TRY(weft_image_init(occlusion, height->width, height->height, 1, err));
    weft_err status = cone ? weft_image_init(cone, height->width, height->height, 4, err) : WEFT_OK;
    if (status == WEFT_OK &&
        !(s.taps = weft_alloc((size_t)options->slices * 2 * MAX_TAPS, sizeof *s.taps, err))) {
        status = WEFT_ERR_NOMEM;
        if (cone)
            weft_image_fini(cone);
    }
    if (status != WEFT_OK) {
        weft_image_fini(occlusion);
        return status;
    }
    s.n_taps = plan_taps(&s, s.taps);
    status = weft_parallel_rows_progress(height->height, occlusion_rows, &s, "occlusion", err);
    if (status != WEFT_OK) {
        weft_image_fini(occlusion);
        if (cone)
            weft_image_fini(cone);
    }
    weft_free(s.taps);
    return status;
}

/* -- curvature ---------------------------------------------------------------------------------------- */

typedef struct curvature_job {
    const weft_image *normal;
    double per_mm;
    bool periodic;
    weft_image *out;
} curvature_job;

static double slope(const weft_image *normal, int plane, int x, int y)
{
    const double z = (double)weft_image_row(normal, 2, y)[x];
    return (double)weft_image_row(normal, plane, y)[x] / fmax(z, 0.01);
}

static void curvature_rows(void *context, int band, int begin, int end)
{
    const curvature_job *const job = context;
    const weft_image *const n = job->normal;
    (void)band;
    for (int y = begin; y < end; y++)
        for (int x = 0; x < n->width; x++) {
            const int l = fold(x - 1, n->width, job->periodic), r = fold(x + 1, n->width, job->periodic);
            const int u = fold(y - 1, n->height, job->periodic), d = fold(y + 1, n->height, job->periodic);
            const double across = job->periodic ? 2 : fmax(r - l, 1),
                         down = job->periodic ? 2 : fmax(d - u, 1);
            const double divergence = (slope(n, 0, r, y) - slope(n, 0, l, y)) / across +
                                      (slope(n, 1, x, u) - slope(n, 1, x, d)) / down;
            weft_image_row(job->out, 0, y)[x] = (float)(0.5 * divergence * job->per_mm);
        }
}

weft_err weft_relief_curvature(const weft_image *normal, double mm_per_px, bool periodic,
                               weft_image *curvature, weft_error *err)
{
    WEFT_TRY(weft_image_init(curvature, normal->width, normal->height, 1, err));
    curvature_job job = {normal, 1 / mm_per_px, periodic, curvature};
    weft_parallel_rows(normal->height, curvature_rows, &job);
    return WEFT_OK;
}

/* -- cavity ------------------------------------------------------------------------------------------- */

typedef struct blur_job {
    const weft_image *from;
    weft_image *to;
    const float *kernel; /* [2 * radius + 1] */
    int radius;
    bool periodic, down;
} blur_job;

static void blur_rows(void *context, int band, int begin, int end)
{
    const blur_job *const job = context;
    const int w = job->from->width, h = job->from->height;
    (void)band;
    for (int y = begin; y < end; y++) {
        float *const out = weft_image_row(job->to, 0, y);
        if (job->down) {
            memset(out, 0, (size_t)w * sizeof *out);
            for (int k = -job->radius; k <= job->radius; k++) {
                const float *const row = weft_image_row(job->from, 0, fold(y + k, h, job->periodic));
                const float weight = job->kernel[k + job->radius];
                for (int x = 0; x < w; x++)
                    out[x] += weight * row[x];
            }
            continue;
        }
        const float *const row = weft_image_row(job->from, 0, y);
        for (int x = 0; x < w; x++) {
            float sum = 0;
            if (x >= job->radius && x + job->radius < w)
                for (int k = -job->radius; k <= job->radius; k++)
                    sum += job->kernel[k + job->radius] * row[x + k];
            else
                for (int k = -job->radius; k <= job->radius; k++)
                    sum += job->kernel[k + job->radius] * row[fold(x + k, w, job->periodic)];
            out[x] = sum;
        }
    }
}

weft_err weft_relief_blur(const weft_image *plane, double sigma_px, bool periodic, weft_image *out,
                          weft_error *err)
{
    const int radius = (int)ceil(3 * sigma_px);
    float *const kernel = weft_alloc(2 * (size_t)radius + 1, sizeof *kernel, err);
    weft_image half = {0};
    weft_err status = kernel ? weft_image_init(&half, plane->width, plane->height, 1, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = weft_image_init(out, plane->width, plane->height, 1, err);
    if (status == WEFT_OK) {
        double sum = 0;
        for (int k = -radius; k <= radius; k++)
            sum += exp(-0.5 * k * k / (sigma_px * sigma_px));
        for (int k = -radius; k <= radius; k++)
            kernel[k + radius] = (float)(exp(-0.5 * k * k / (sigma_px * sigma_px)) / sum);
        blur_job job = {plane, &half, kernel, radius, periodic, false};
        weft_parallel_rows(plane->height, blur_rows, &job);
        job = (blur_job){&half, out, kernel, radius, periodic, true};
        weft_parallel_rows(plane->height, blur_rows, &job);
    }
    weft_image_fini(&half);
    weft_free(kernel);
    return status;
}

weft_err weft_relief_cavity(const weft_image *height, double mm_per_px, double radius_mm, bool periodic,
                            weft_image *cavity, weft_error *err)
{
    WEFT_TRY(weft_relief_blur(height, fmax(radius_mm / mm_per_px, 0.5), periodic, cavity, err));
    const size_t n = weft_image_plane_size(height);
    double squares = 0;
    for (size_t i = 0; i < n; i++) {
        cavity->data[i] = height->data[i] - cavity->data[i];
        squares += (double)cavity->data[i] * (double)cavity->data[i];
    }
    const double sigma = sqrt(squares / (double)n);
    const float scale = sigma > 0 ? (float)(0.5 / (2.5 * sigma)) : 0;
    for (size_t i = 0; i < n; i++)
        cavity->data[i] = fminf(fmaxf(0.5F + scale * cavity->data[i], 0), 1);
    return WEFT_OK;
}
