/* Least squares by normal equations, S-ORD-17 (The Order: 1886, equations 24 to 30), 16 pixels at a time. */
#include "host/solve/samples.h"

#include "core/clones.h"

#include <math.h>

enum { LANES = WEFT_SOLVE_LANES };

/* Sums over the lights: A = L^T L, b = L^T I' of the grey, and how many samples were used. */
typedef struct lane_sums {
    float xx[LANES], xy[LANES], xz[LANES], yy[LANES], yz[LANES], zz[LANES];
    float bx[LANES], by[LANES], bz[LANES];
    float n[LANES];
} lane_sums;

/* The lights outside, the lanes inside: GCC turns the inner loop into straight vector code. */
WEFT_INLINE void add_up(const weft_solve_samples *s, lane_sums *restrict to)
{
    lane_sums t = {0};
    for (int j = 0; j < s->n_lights; j++)
#pragma omp simd
        for (int k = 0; k < LANES; k++) {
            const float w = s->at[j].weight[k], grey = s->at[j].grey[k];
            const float x = w * s->at[j].light[0][k], y = w * s->at[j].light[1][k],
                        z = w * s->at[j].light[2][k];
            t.n[k] += w;
            t.xx[k] += x * x, t.xy[k] += x * y, t.xz[k] += x * z;
            t.yy[k] += y * y, t.yz[k] += y * z, t.zz[k] += z * z;
            t.bx[k] += grey * x, t.by[k] += grey * y, t.bz[k] += grey * z;
        }
    *to = t;
}

typedef struct vec {
    float x, y, z;
} vec;

/* The matrix of one pixel, and its number of samples. */
typedef struct sums {
    float xx, xy, xz, yy, yz, zz, n;
} sums;

WEFT_INLINE sums fetch(const lane_sums *from, int k)
{
    return (sums){from->xx[k], from->xy[k], from->xz[k], from->yy[k], from->yz[k], from->zz[k], from->n[k]};
}

/* Whether every eigenvalue of A exceeds `least`: A - least is positive definite (pivots of its Cholesky). */
WEFT_INLINE float determined(const sums *t, float least)
{
    const float xx = t->xx - least, yy = t->yy - least, zz = t->zz - least;
    const float p1 = xx * yy - t->xy * t->xy;
    const float det = xx * (yy * zz - t->yz * t->yz) - t->xy * (t->xy * zz - t->yz * t->xz) +
                      t->xz * (t->xy * t->yz - yy * t->xz);
    return (xx > 0) & (p1 > 0) & (det > 0) ? 1.0F : 0.0F;
}

/* Factors of A = G D G^T, G unit lower triangular. */
typedef struct factors {
    float g10, g20, g21, d0, d1, d2; /* d: reciprocals of the diagonal of D */
} factors;

WEFT_INLINE factors factorise(const sums *t, float valid)
{
    const float guard = 1 - valid; /* keeps the divisions finite in lanes whose answer is thrown away */
    factors f;
    f.d0 = 1 / (t->xx + guard);
    f.g10 = t->xy * f.d0;
    f.g20 = t->xz * f.d0;
    const float yy = t->yy - f.g10 * t->xy, yz = t->yz - f.g20 * t->xy;
    f.d1 = valid > 0 ? 1 / yy : 1;
    f.g21 = yz * f.d1;
    const float zz = t->zz - f.g20 * t->xz - f.g21 * yz;
    f.d2 = valid > 0 ? 1 / zz : 1;
    return f;
}

WEFT_INLINE vec substitute(const factors *f, vec b)
{
    const float y1 = b.y - f->g10 * b.x, y2 = b.z - f->g20 * b.x - f->g21 * y1;
    vec v;
    v.z = y2 * f->d2;
    v.y = y1 * f->d1 - f->g21 * v.z;
    v.x = b.x * f->d0 - f->g10 * v.y - f->g20 * v.z;
    return v;
}

/* Sum of the variances of the two directions across n, for unit noise: tr C - n^T C n with C = A^-1. */
WEFT_INLINE float spread_across(const factors *f, vec n)
{
    const float c = f->g10 * f->g21 - f->g20; /* G^-1 = [1; -g10 1; c -g21 1], C = G^-T D^-1 G^-1 */
    const float trace = f->d0 + f->d1 * (1 + f->g10 * f->g10) + f->d2 * (1 + f->g21 * f->g21 + c * c);
    const float m1 = n.y - f->g10 * n.x, m2 = n.z - f->g21 * n.y + c * n.x;
    return trace - (f->d0 * n.x * n.x + f->d1 * m1 * m1 + f->d2 * m2 * m2);
}

/* The scaled normal k n, the variance of its direction for unit noise, and 1 / sum (n.l)^2. */
typedef struct lane_normals {
    float x[LANES], y[LANES], z[LANES], spread[LANES], gain[LANES];
} lane_normals;

typedef struct lane_misfits {
    float squares[LANES], brightest[LANES];
} lane_misfits;

WEFT_INLINE void measure(const weft_solve_samples *s, const lane_normals *scaled, lane_misfits *to)
{
    lane_misfits m = {0};
    for (int j = 0; j < s->n_lights; j++)
#pragma omp simd
        for (int k = 0; k < LANES; k++) {
            const float fit = scaled->x[k] * s->at[j].light[0][k] + scaled->y[k] * s->at[j].light[1][k] +
                              scaled->z[k] * s->at[j].light[2][k];
            const float d = s->at[j].weight[k] * (s->at[j].grey[k] - fit), used = s->at[j].weight[k] * fit;
            m.squares[k] += d * d;
            m.brightest[k] = used > m.brightest[k] ? used : m.brightest[k];
        }
    *to = m;
}

WEFT_INLINE void solve_lane(const lane_sums *all, int k, lane_normals *scaled, weft_solve_answers *a)
{
    const float least = WEFT_SOLVE_MIN_SINGULAR * WEFT_SOLVE_MIN_SINGULAR;
    const sums t = fetch(all, k);
    const float valid = t.n > 2.5F ? determined(&t, least) : 0;
    const factors f = factorise(&t, valid);
    const vec b = {all->bx[k], all->by[k], all->bz[k]};
    const vec v = substitute(&f, b);
    const float length = sqrtf(v.x * v.x + v.y * v.y + v.z * v.z);
    const float lit = length >= WEFT_SOLVE_BLACK ? valid : 0.0F;
    const float over = 1 / (lit > 0 ? length : 1.0F);
    const vec n = {lit * v.x * over, lit * v.y * over, lit * v.z * over + (valid - lit)};

    const float cosines = t.xx * n.x * n.x + t.yy * n.y * n.y + t.zz * n.z * n.z +
                          2 * (t.xy * n.x * n.y + t.xz * n.x * n.z + t.yz * n.y * n.z);
    scaled->gain[k] = lit / (lit > 0 ? cosines : 1.0F);
    a->normal[0][k] = n.x;
    a->normal[1][k] = n.y;
    a->normal[2][k] = n.z;
    a->valid[k] = valid;
    scaled->x[k] = lit * v.x;
    scaled->y[k] = lit * v.y;
    scaled->z[k] = lit * v.z;
    scaled->spread[k] = lit * spread_across(&f, n) * over * over;
}

/* Albedo with the normal held fixed: sum I' (n.l) / sum (n.l)^2.  Unused samples are 0 already. */
WEFT_INLINE void find_albedo(const weft_solve_samples *s, int c, const lane_normals *scaled,
                             weft_solve_answers *a)
{
    float sum[LANES] = {0};
    for (int j = 0; j < s->n_lights; j++)
#pragma omp simd
        for (int k = 0; k < LANES; k++)
            sum[k] += s->at[j].value[c][k] *
                      (a->normal[0][k] * s->at[j].light[0][k] + a->normal[1][k] * s->at[j].light[1][k] +
                       a->normal[2][k] * s->at[j].light[2][k]);
    for (int k = 0; k < LANES; k++)
        a->albedo[c][k] = scaled->gain[k] * sum[k];
}

WEFT_INLINE void judge_lane(const lane_sums *all, const lane_normals *scaled, const lane_misfits *m, int k,
                            weft_solve_answers *a)
{
    const float lit = m->brightest[k] > WEFT_SOLVE_BLACK ? a->valid[k] : 0.0F;
    const float peak = lit > 0 ? m->brightest[k] : 1.0F;
    const float prior = WEFT_SOLVE_PRIOR_MISFIT * peak;
    const float count = a->valid[k] > 0 ? all->n[k] : 3.0F;
    const float variance = (m->squares[k] + prior * prior) / (count - 2);
    const float angle2 = variance * scaled->spread[k];
    const float half2 = WEFT_SOLVE_HALF_CONFIDENCE * WEFT_SOLVE_HALF_CONFIDENCE;
    a->residual[k] = lit * sqrtf(m->squares[k] / count) / peak;
    a->confidence[k] = lit * half2 / (half2 + (angle2 > 0 ? angle2 : 0.0F));
}

WEFT_CLONES void weft_solve_lsq(const weft_solve_samples *restrict samples,
                                weft_solve_answers *restrict answers)
{
    lane_sums t;
    lane_normals scaled;
    lane_misfits m;
    add_up(samples, &t);
#pragma omp simd
    for (int k = 0; k < LANES; k++)
        solve_lane(&t, k, &scaled, answers);
    for (int c = 0; c < samples->n_channels; c++)
        find_albedo(samples, c, &scaled, answers);
    measure(samples, &scaled, &m);
#pragma omp simd
    for (int k = 0; k < LANES; k++)
        judge_lane(&t, &scaled, &m, k, answers);
}
