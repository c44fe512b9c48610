#include "core/colour.h"
#include "core/mem.h"
#include "host/set/compare.h"

#include <math.h>
#include <stdlib.h>

static const double degrees = 57.29577951308232;
const double weft_flaw_reach_mm[WEFT_N_FLAWS] = {0.5, 2, 0.5};

static int ascending(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static double percentile(const float *sorted, size_t n, double part)
{
    const size_t rank = (size_t)ceil(part * (double)n);
    return (double)sorted[rank > 0 ? rank - 1 : 0];
}

weft_spread weft_spread_of(float *values, size_t n)
{
    double sum = 0, squares = 0;
    if (n == 0)
        return (weft_spread){0};
    qsort(values, n, sizeof *values, ascending);
    for (size_t i = 0; i < n; i++) {
        sum += (double)values[i];
        squares += (double)values[i] * (double)values[i];
    }
    const double count = (double)n;
    return (weft_spread){.n = n,
                         .mean = sum / count,
                         .median = percentile(values, n, 0.5),
                         .p95 = percentile(values, n, 0.95),
                         .p99 = percentile(values, n, 0.99),
                         .max = (double)values[n - 1],
                         .rms = sqrt(squares / count)};
}

/* ---- laying maps over each other ---- */

typedef struct overlap {
    int offset[2];        /* A's (0, 0) in B */
    int begin[2], end[2]; /* in A's pixels */
    const weft_maps *a, *b;
    const weft_mask *mask;
} overlap;

static weft_err whole_pixels(double exact, double scale, int *pixels, weft_error *err)
{
    const double off = fabs(exact - round(exact));
    if (!(fabs(exact) < 1e6) || off > 0.02)
        return weft_fail(
            err, WEFT_ERR_MISMATCH,
            "the grids are off by %.3g pixels of %.4g mm, not a whole number (make both with the "
            "same grid; nothing is resampled here)",
            exact, scale);
    *pixels = (int)lround(exact);
    return WEFT_OK;
}

static weft_err lay_over(const weft_maps *a, const weft_maps *b, overlap *o, weft_error *err)
{
    const int size_a[2] = {a->width, a->height}, size_b[2] = {b->width, b->height};
    if (a->geometry == WEFT_GEOMETRY_PLANE && b->geometry == WEFT_GEOMETRY_PLANE) {
        if (fabs(a->mm_per_px / b->mm_per_px - 1) > 1e-4)
            return weft_fail(
                err, WEFT_ERR_MISMATCH,
                "one map has %.5g mm a pixel, the other %.5g (make both with the same --mm-per-px)",
                a->mm_per_px, b->mm_per_px);
        const double scale = a->mm_per_px;
        WEFT_TRY(whole_pixels((a->origin_mm[0] - b->origin_mm[0]) / scale, scale, &o->offset[0], err));
        WEFT_TRY(whole_pixels((b->origin_mm[1] - a->origin_mm[1]) / scale, scale, &o->offset[1], err));
    } else if (size_a[0] != size_b[0] || size_a[1] != size_b[1])
        return weft_fail(err, WEFT_ERR_MISMATCH,
                         "one map has %d x %d pixels, the other %d x %d, and they are not both plane maps "
                         "(make both with the same --geometry)",
                         a->width, a->height, b->width, b->height);
    for (int i = 0; i < 2; i++) {
        o->begin[i] = o->offset[i] < 0 ? -o->offset[i] : 0;
        o->end[i] = size_b[i] - o->offset[i] < size_a[i] ? size_b[i] - o->offset[i] : size_a[i];
        if (o->end[i] <= o->begin[i])
            return weft_fail(err, WEFT_ERR_NODATA, "the maps do not overlap");
    }
    return WEFT_OK;
}

static bool answered(const weft_maps *m, size_t at)
{
    return !m->mask.data || m->mask.data[at];
}

/* Which of the two has an answer at A's pixel (x, y): bit 0 A, bit 1 B; 0 too where the mask is 0. */
static int who(const overlap *o, int x, int y, size_t *at_a, size_t *at_b)
{
    *at_a = (size_t)y * (size_t)o->a->width + (size_t)x;
    *at_b = (size_t)(y + o->offset[1]) * (size_t)o->b->width + (size_t)(x + o->offset[0]);
    if (o->mask && !o->mask->data[*at_a])
        return 0;
    return (answered(o->a, *at_a) ? 1 : 0) | (answered(o->b, *at_b) ? 2 : 0);
}

static weft_vec3 vec_at(const weft_image *image, size_t at)
{
    return (weft_vec3){(double)weft_image_plane(image, 0)[at], (double)weft_image_plane(image, 1)[at],
                       (double)weft_image_plane(image, 2)[at]};
}

static bool finite_vec(weft_vec3 v)
{
    return isfinite(v.x) && isfinite(v.y) && isfinite(v.z);
}

static void compare_normals(const overlap *o, float *values, weft_maps_difference *d)
{
    weft_vec3 sum_a = {0, 0, 0}, sum_b = {0, 0, 0};
    size_t n = 0, at_a, at_b;
    for (int y = o->begin[1]; y < o->end[1]; y++)
        for (int x = o->begin[0]; x < o->end[0]; x++) {
            const int has = who(o, x, y, &at_a, &at_b);
            const weft_vec3 a = vec_at(&o->a->normal, at_a), b = vec_at(&o->b->normal, at_b);
            const bool ok_a = (has & 1) && finite_vec(a) && weft_length(a) > 0;
            const bool ok_b = (has & 2) && finite_vec(b) && weft_length(b) > 0;
            d->only_a += ok_a && !ok_b;
            d->only_b += ok_b && !ok_a;
            if (!ok_a || !ok_b)
                continue;
            values[n++] = (float)(weft_angle_between(a, b) * degrees);
            sum_a = weft_add(sum_a, weft_normalise(a));
            sum_b = weft_add(sum_b, weft_normalise(b));
        }
    d->normal_deg = weft_spread_of(values, n);
    d->mean_normal_deg[0] = (atan2(sum_a.x, sum_a.z) - atan2(sum_b.x, sum_b.z)) * degrees;
    d->mean_normal_deg[1] = (atan2(sum_a.y, sum_a.z) - atan2(sum_b.y, sum_b.z)) * degrees;
}

static double delta_e(weft_vec3 a, weft_vec3 b)
{
    double lab_a[3], lab_b[3];
    weft_srgb_to_lab((const double[3]){a.x, a.y, a.z}, lab_a);
    weft_srgb_to_lab((const double[3]){b.x, b.y, b.z}, lab_b);
    return weft_delta_e_2000(lab_a, lab_b);
}

static void compare_albedos(const overlap *o, float *values, float *ratios, weft_maps_difference *d)
{
    size_t n = 0, n_ratios = 0, at_a, at_b;
    for (int y = o->begin[1]; y < o->end[1]; y++)
        for (int x = o->begin[0]; x < o->end[0]; x++) {
            if (who(o, x, y, &at_a, &at_b) != 3)
                continue;
            const weft_vec3 a = vec_at(&o->a->albedo, at_a), b = vec_at(&o->b->albedo, at_b);
            if (!finite_vec(a) || !finite_vec(b))
                continue;
            values[n++] = (float)delta_e(a, b);
            const double ya = weft_luminance(a.x, a.y, a.z), yb = weft_luminance(b.x, b.y, b.z);
            if (yb > 0)
                ratios[n_ratios++] = (float)fabs(ya / yb - 1);
        }
    d->delta_e = weft_spread_of(values, n);
    d->luminance = weft_spread_of(ratios, n_ratios);
    d->albedo_is_camera_rgb = !o->a->albedo_is_srgb || !o->b->albedo_is_srgb;
}

static void compare_alphas(const overlap *o, float *values, weft_maps_difference *d)
{
    size_t n = 0, both = 0, at_a, at_b;
    for (int y = o->begin[1]; y < o->end[1]; y++)
        for (int x = o->begin[0]; x < o->end[0]; x++) {
            if (who(o, x, y, &at_a, &at_b) != 3)
                continue;
            const float a = o->a->alpha.data[at_a], b = o->b->alpha.data[at_b];
            both++;
            d->cover[0] += (double)a;
            d->cover[1] += (double)b;
            if (a < 1 || b < 1)
                values[n++] = fabsf(a - b);
        }
    d->alpha = weft_spread_of(values, n);
    for (int k = 0; k < 2 && both; k++)
        d->cover[k] /= (double)both;
}

/* Whether `flaw` is flagged within `reach` pixels of (x, y). */
static bool flagged_near(const weft_mask *flags, int x, int y, int reach, unsigned flaw)
{
    for (int j = y - reach < 0 ? 0 : y - reach; j <= y + reach && j < flags->height; j++)
        for (int i = x - reach < 0 ? 0 : x - reach; i <= x + reach && i < flags->width; i++)
            if (flags->data[(size_t)j * (size_t)flags->width + (size_t)i] & flaw)
                return true;
    return false;
}

static weft_flaw_match match_flaw(const overlap *o, int k)
{
    const weft_mask *const a = &o->a->flaws, *const b = &o->b->flaws;
    const unsigned flaw = 1U << k;
    const int reach = (int)fmax(1, round(weft_flaw_reach_mm[k] / o->a->mm_per_px));
    weft_flaw_match m = {0};
    size_t at_a, at_b;
    for (int y = o->begin[1]; y < o->end[1]; y++)
        for (int x = o->begin[0]; x < o->end[0]; x++) {
            if (who(o, x, y, &at_a, &at_b) != 3)
                continue;
            if (a->data[at_a] & flaw) {
                m.a++;
                m.hits += flagged_near(b, x + o->offset[0], y + o->offset[1], reach, flaw);
            }
            if (b->data[at_b] & flaw) {
                m.b++;
                m.found += flagged_near(a, x, y, reach, flaw);
            }
        }
    return m;
}

weft_err weft_compare_maps(const weft_maps *a, const weft_maps *b, const weft_mask *mask,
                           weft_maps_difference *difference, weft_error *err)
{
    weft_maps_difference d = {.has_normal = a->normal.planes == 3 && b->normal.planes == 3,
                              .has_albedo = a->albedo.planes == 3 && b->albedo.planes == 3};
    d.has_alpha = a->alpha.planes && b->alpha.planes;
    d.has_flaws = a->flaws.data && b->flaws.data && a->geometry == WEFT_GEOMETRY_PLANE;
    overlap o = {.a = a, .b = b, .mask = mask};
    if (!d.has_normal && !d.has_albedo)
        return weft_fail(err, WEFT_ERR_NODATA, "the maps have neither normals nor albedo in common");
    if (mask && (mask->width != a->width || mask->height != a->height))
        return weft_fail(err, WEFT_ERR_MISMATCH, "the mask has %d x %d pixels, the first map %d x %d",
                         mask->width, mask->height, a->width, a->height);
    WEFT_TRY(lay_over(a, b, &o, err));
    const size_t room = (size_t)(o.end[0] - o.begin[0]) * (size_t)(o.end[1] - o.begin[1]);
    float *const values = weft_alloc(2 * room, sizeof *values, err);
    if (!values)
        return WEFT_ERR_NOMEM;
    for (int i = 0; i < 2; i++)
        d.offset_px[i] = o.offset[i];
    if (d.has_normal)
        compare_normals(&o, values, &d);
    if (d.has_albedo)
        compare_albedos(&o, values, values + room, &d);
    if (d.has_alpha)
        compare_alphas(&o, values, &d);
    for (int k = 0; k < WEFT_N_FLAWS && d.has_flaws; k++)
        d.flaws[k] = match_flaw(&o, k);
    weft_free(values);
    if (d.normal_deg.n == 0 && d.delta_e.n == 0)
        return weft_fail(err, WEFT_ERR_NODATA, "there is no pixel where both maps have an answer");
    *difference = d;
    return WEFT_OK;
}

/* ---- pictures ---- */

static weft_vec3 colour_at(const weft_image *image, size_t at)
{
    const int g = image->planes == 3 ? 1 : 0, b = image->planes == 3 ? 2 : 0;
    weft_vec3 v = {(double)weft_image_plane(image, 0)[at], (double)weft_image_plane(image, g)[at],
                   (double)weft_image_plane(image, b)[at]};
    v.x = isnan(v.x) ? 0 : v.x;
    v.y = isnan(v.y) ? 0 : v.y;
    v.z = isnan(v.z) ? 0 : v.z;
    return v;
}

static double code(double linear)
{
    return weft_srgb_encode(fmin(fmax(linear, 0), 1));
}

weft_err weft_compare_pictures(const weft_image *a, const weft_image *b, const weft_mask *mask,
                               weft_picture_difference *difference, weft_error *err)
{
    if (a->width != b->width || a->height != b->height)
        return weft_fail(err, WEFT_ERR_MISMATCH, "one picture has %d x %d pixels, the other %d x %d",
                         a->width, a->height, b->width, b->height);
    if (mask && (mask->width != a->width || mask->height != a->height))
        return weft_fail(err, WEFT_ERR_MISMATCH, "the mask has %d x %d pixels, the pictures %d x %d",
                         mask->width, mask->height, a->width, a->height);
    const size_t pixels = weft_image_plane_size(a);
    float *const values = weft_alloc(pixels, sizeof *values, err);
    if (!values)
        return WEFT_ERR_NOMEM;
    weft_picture_difference d = {0};
    double code_squares = 0, squares = 0;
    size_t n = 0;
    for (size_t i = 0; i < pixels; i++) {
        if (mask && !mask->data[i])
            continue;
        const weft_vec3 p = colour_at(a, i), q = colour_at(b, i), e = weft_sub(p, q);
        const double c[3] = {code(p.x) - code(q.x), code(p.y) - code(q.y), code(p.z) - code(q.z)};
        values[n++] = (float)delta_e(p, q);
        code_squares += c[0] * c[0] + c[1] * c[1] + c[2] * c[2];
        squares += weft_dot(e, e);
        d.max = fmax(d.max, fmax(fabs(e.x), fmax(fabs(e.y), fabs(e.z))));
    }
    d.delta_e = weft_spread_of(values, n);
    weft_free(values);
    if (n == 0)
        return weft_fail(err, WEFT_ERR_NODATA, "the mask leaves no pixel");
    d.rms = sqrt(squares / (3 * (double)n));
    d.psnr_db = code_squares > 0 ? -10 * log10(code_squares / (3 * (double)n)) : (double)INFINITY;
    *difference = d;
    return WEFT_OK;
}
