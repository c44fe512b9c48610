#include "calibration/charts/homography.h"

#include "calibration/charts/robust.h"

#include <assert.h>
#include <lapacke.h>
#include <math.h>
#include <string.h>

enum { UNKNOWNS = 8, ITERATIONS = 12 };

bool weft_homography_apply(const weft_mat3 *h, double x, double y, double *u, double *v)
{
    const weft_vec3 p = weft_mat3_apply(h, (weft_vec3){x, y, 1});
    if (!(p.z > 0))
        return false;
    *u = p.x / p.z;
    *v = p.y / p.z;
    return true;
}

/* From the unit square (0,0) (1,0) (1,1) (0,1) to four points (Heckbert 1989, section 2.2.3). */
static bool from_unit_square(const double p[4][2], weft_mat3 *h)
{
    const double dx1 = p[1][0] - p[2][0], dx2 = p[3][0] - p[2][0];
    const double dy1 = p[1][1] - p[2][1], dy2 = p[3][1] - p[2][1];
    const double sx = p[0][0] - p[1][0] + p[2][0] - p[3][0], sy = p[0][1] - p[1][1] + p[2][1] - p[3][1];
    const double det = dx1 * dy2 - dx2 * dy1;
    const double scale = fabs(dx1) + fabs(dx2) + fabs(dy1) + fabs(dy2);
    if (!(fabs(det) > 1e-9 * scale * scale))
        return false;
    const double g = (sx * dy2 - dx2 * sy) / det, k = (dx1 * sy - sx * dy1) / det;
    *h = (weft_mat3){{p[1][0] - p[0][0] + g * p[1][0], p[3][0] - p[0][0] + k * p[3][0], p[0][0],
                      p[1][1] - p[0][1] + g * p[1][1], p[3][1] - p[0][1] + k * p[3][1], p[0][1], g, k, 1}};
    return true;
}

bool weft_homography_from_corners(const double from[4][2], const double to[4][2], weft_mat3 *h)
{
    weft_mat3 a, b, a_inverse;
    if (!from_unit_square(from, &a) || !from_unit_square(to, &b) || !weft_mat3_invert(&a, &a_inverse))
        return false;
    weft_mat3 map = weft_mat3_multiply(&b, &a_inverse);
    const double w = map.m[8];
    for (int i = 0; i < 9; i++)
        map.m[i] /= w;
    for (int i = 0; i < 9; i++)
        if (!isfinite(map.m[i]))
            return false;
    *h = map;
    return true;
}

/* Coordinates of order 1 make the normal equations well conditioned: (x - cx) / s for plane and picture. */
typedef struct frame2 {
    double cx, cy, s;
} frame2;

static void make_frames(const weft_homography_sight *sights, int n, frame2 *plane, frame2 *picture)
{
    double sum[4] = {0}, square[2] = {0};
    for (int i = 0; i < n; i++) {
        sum[0] += sights[i].x / n;
        sum[1] += sights[i].y / n;
        sum[2] += sights[i].u / n;
        sum[3] += sights[i].v / n;
    }
    for (int i = 0; i < n; i++) {
        square[0] += (pow(sights[i].x - sum[0], 2) + pow(sights[i].y - sum[1], 2)) / n;
        square[1] += (pow(sights[i].u - sum[2], 2) + pow(sights[i].v - sum[3], 2)) / n;
    }
    *plane = (frame2){sum[0], sum[1], square[0] > 0 ? sqrt(square[0]) : 1};
    *picture = (frame2){sum[2], sum[3], square[1] > 0 ? sqrt(square[1]) : 1};
}

static weft_mat3 frame_matrix(const frame2 *f)
{
    return (weft_mat3){{1 / f->s, 0, -f->cx / f->s, 0, 1 / f->s, -f->cy / f->s, 0, 0, 1}};
}

static weft_mat3 frame_inverse(const frame2 *f)
{
    return (weft_mat3){{f->s, 0, f->cx, 0, f->s, f->cy, 0, 0, 1}};
}

/* Residual of a sight in normalised units and, when asked, its derivatives. */
static double residual(const weft_homography_sight *s, const weft_mat3 *h, const frame2 *plane,
                       const frame2 *picture, double row[UNKNOWNS])
{
    const double x = (s->x - plane->cx) / plane->s, y = (s->y - plane->cy) / plane->s;
    const double u = (s->u - picture->cx) / picture->s, v = (s->v - picture->cy) / picture->s;
    const double *const m = h->m;
    const double w = m[6] * x + m[7] * y + m[8], iw = fabs(w) > 1e-9 ? 1 / w : 1e9;
    const double pu = (m[0] * x + m[1] * y + m[2]) * iw, pv = (m[3] * x + m[4] * y + m[5]) * iw;
    if (row) {
        const double along = -(s->nu * pu + s->nv * pv) * iw;
        const double a[UNKNOWNS] = {s->nu * x * iw, s->nu * y * iw, s->nu * iw, s->nv * x * iw,
                                    s->nv * y * iw, s->nv * iw,     along * x,  along * y};
        memcpy(row, a, sizeof a);
    }
    return s->nu * (pu - u) + s->nv * (pv - v);
}

/* One weighted Gauss-Newton step; false when the normal equations are singular. */
static bool step(const weft_homography_sight *sights, int n, const double *weight, const frame2 *plane,
                 const frame2 *picture, weft_mat3 *h, double *length)
{
    double a[UNKNOWNS * UNKNOWNS] = {0}, b[UNKNOWNS] = {0}, row[UNKNOWNS];
    for (int i = 0; i < n; i++) {
        if (weight[i] <= 0)
            continue;
        const double r = residual(&sights[i], h, plane, picture, row);
        for (int j = 0; j < UNKNOWNS; j++) {
            b[j] -= weight[i] * r * row[j];
            for (int k = 0; k < UNKNOWNS; k++)
                a[UNKNOWNS * j + k] += weight[i] * row[j] * row[k];
        }
    }
    double trace = 0;
    for (int j = 0; j < UNKNOWNS; j++)
        trace += a[UNKNOWNS * j + j];
    for (int j = 0; j < UNKNOWNS; j++)
        a[UNKNOWNS * j + j] += 1e-12 * trace;
    if (!(trace > 0) || LAPACKE_dposv(LAPACK_ROW_MAJOR, 'L', UNKNOWNS, 1, a, UNKNOWNS, b, 1) != 0)
        return false;
    *length = 0;
    for (int j = 0; j < UNKNOWNS; j++) {
        if (!isfinite(b[j]))
            return false;
        h->m[j] += b[j];
        *length = fmax(*length, fabs(b[j]));
    }
    return true;
}

/* Tukey's biweight; with a floor on the scale, so that a perfect fit does not throw good sights away. */
static void reweight(const weft_homography_sight *sights, int n, const frame2 *plane, const frame2 *picture,
                     const weft_mat3 *h, double *weight, double *magnitude)
{
    for (int i = 0; i < n; i++)
        weight[i] = magnitude[i] = fabs(residual(&sights[i], h, plane, picture, NULL));
    const double sigma = fmax(1.4826 * weft_median(magnitude, n), 1e-3 / picture->s);
    for (int i = 0; i < n; i++) {
        const double t = weight[i] / (4.7 * sigma);
        weight[i] = t < 1 ? (1 - t * t) * (1 - t * t) : 0;
    }
}

weft_err weft_homography_refine(const weft_homography_sight *sights, int n, bool robust, double *scratch,
                                weft_mat3 *h, double *rms, weft_error *err)
{
    if (n < UNKNOWNS)
        return weft_fail(err, WEFT_ERR_NODATA, "%d measured positions do not determine a plane (8 do)", n);
    frame2 plane, picture;
    make_frames(sights, n, &plane, &picture);
    const weft_mat3 to_unit = frame_matrix(&picture), from_unit = frame_inverse(&plane);
    weft_mat3 map = weft_mat3_multiply(&to_unit, h);
    map = weft_mat3_multiply(&map, &from_unit);
    for (int i = 0; i < 9; i++)
        map.m[i] /= map.m[8];

    double *const weight = scratch, *const magnitude = scratch + n;
    for (int i = 0; i < n; i++)
        weight[i] = 1;
    double length = 1;
    for (int i = 0; i < ITERATIONS && length > 1e-12; i++) {
        if (robust && i > 0)
            reweight(sights, n, &plane, &picture, &map, weight, magnitude);
        if (!step(sights, n, weight, &plane, &picture, &map, &length))
            return weft_fail(err, WEFT_ERR_NODATA, "the measured positions do not determine a plane");
    }
    double sum = 0, total = 0;
    for (int i = 0; i < n; i++) {
        const double r = residual(&sights[i], &map, &plane, &picture, NULL);
        sum += weight[i] * r * r;
        total += weight[i];
    }
    *rms = total > 0 ? picture.s * sqrt(sum / total) : 0;
    const weft_mat3 from_pixel = frame_inverse(&picture), to_plane = frame_matrix(&plane);
    map = weft_mat3_multiply(&from_pixel, &map);
    map = weft_mat3_multiply(&map, &to_plane);
    for (int i = 0; i < 9; i++)
        h->m[i] = map.m[i] / map.m[8];
    return WEFT_OK;
}
