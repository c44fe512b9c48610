/**
 * Least squares of one normal per lane by normal equations, S-ORD-17 (The Order: 1886, equations 24 to 30):
 * what the methods are made of.  Everything inline, so that each method's copy is built for its CPU level.
 *
 * The lights are the outer loop and the lanes the inner one: GCC turns the inner loop into straight vector
 * code.  No lane looks at another one.
 */
#ifndef WEFT_HOST_SOLVE_NORMAL_EQUATIONS_H
#define WEFT_HOST_SOLVE_NORMAL_EQUATIONS_H

#include "core/clones.h"
#include "host/solve/samples.h"

#include <math.h>

enum { WEFT_LANES = WEFT_SOLVE_LANES };

/** Sums over the lights: A = L^T W L, b = L^T W I' of the grey, and how many samples were used. */
typedef struct weft_lane_sums {
    float xx[WEFT_LANES], xy[WEFT_LANES], xz[WEFT_LANES], yy[WEFT_LANES], yz[WEFT_LANES], zz[WEFT_LANES];
    float bx[WEFT_LANES], by[WEFT_LANES], bz[WEFT_LANES];
    float n[WEFT_LANES];
} weft_lane_sums;

/** The weights of light j: of `weights`, or of the samples, 1 or 0, when that is NULL. */
WEFT_INLINE const float *weft_weights_of(const weft_solve_samples *s, const weft_lane_weights *weights, int j)
{
    return weights ? weights[j].at : s->at[j].weight;
}

WEFT_INLINE void weft_sums_add_up(const weft_solve_samples *s, const weft_lane_weights *weights,
                                  weft_lane_sums *restrict to)
{
    weft_lane_sums t = {0};
    for (int j = 0; j < s->n_lights; j++) {
        const float *const weight = weft_weights_of(s, weights, j);
#pragma omp simd
        for (int k = 0; k < WEFT_LANES; k++) {
            const float w = weight[k], grey = s->at[j].grey[k];
            const float lx = s->at[j].light[0][k], ly = s->at[j].light[1][k], lz = s->at[j].light[2][k];
            const float x = w * lx, y = w * ly, z = w * lz;
            t.n[k] += w > 0 ? 1.0F : 0.0F;
            t.xx[k] += x * lx, t.xy[k] += x * ly, t.xz[k] += x * lz;
            t.yy[k] += y * ly, t.yz[k] += y * lz, t.zz[k] += z * lz;
            t.bx[k] += grey * x, t.by[k] += grey * y, t.bz[k] += grey * z;
        }
    }
    *to = t;
}

typedef struct weft_vec3f {
    float x, y, z;
} weft_vec3f;

/** The matrix of one pixel, and its number of samples. */
typedef struct weft_sums {
    float xx, xy, xz, yy, yz, zz, n;
} weft_sums;

WEFT_INLINE weft_sums weft_sums_of_lane(const weft_lane_sums *from, int k)
{
    return (weft_sums){from->xx[k], from->xy[k], from->xz[k], from->yy[k],
                       from->yz[k], from->zz[k], from->n[k]};
}

/** Whether every eigenvalue of A exceeds `least`: A - least is positive definite (pivots of its Cholesky). */
WEFT_INLINE float weft_sums_determined(const weft_sums *t, float least)
{
    const float xx = t->xx - least, yy = t->yy - least, zz = t->zz - least;
    const float p1 = xx * yy - t->xy * t->xy;
    const float det = xx * (yy * zz - t->yz * t->yz) - t->xy * (t->xy * zz - t->yz * t->xz) +
                      t->xz * (t->xy * t->yz - yy * t->xz);
    return (xx > 0) & (p1 > 0) & (det > 0) ? 1.0F : 0.0F;
}

/** Factors of A = G D G^T, G unit lower triangular. */
typedef struct weft_factors {
    float g10, g20, g21, d0, d1, d2; /* d: reciprocals of the diagonal of D */
} weft_factors;

WEFT_INLINE weft_factors weft_sums_factorise(const weft_sums *t, float valid)
{
    const float guard = 1 - valid; /* keeps the divisions finite in lanes whose answer is thrown away */
    weft_factors f;
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

WEFT_INLINE weft_vec3f weft_factors_substitute(const weft_factors *f, weft_vec3f b)
{
    const float y1 = b.y - f->g10 * b.x, y2 = b.z - f->g20 * b.x - f->g21 * y1;
    weft_vec3f v;
    v.z = y2 * f->d2;
    v.y = y1 * f->d1 - f->g21 * v.z;
    v.x = b.x * f->d0 - f->g10 * v.y - f->g20 * v.z;
    return v;
}

/** Sum of the variances of the two directions across n, for unit noise: tr C - n^T C n with C = A^-1. */
WEFT_INLINE float weft_factors_spread(const weft_factors *f, weft_vec3f n)
{
    const float c = f->g10 * f->g21 - f->g20; /* G^-1 = [1; -g10 1; c -g21 1], C = G^-T D^-1 G^-1 */
    const float trace = f->d0 + f->d1 * (1 + f->g10 * f->g10) + f->d2 * (1 + f->g21 * f->g21 + c * c);
    const float m1 = n.y - f->g10 * n.x, m2 = n.z - f->g21 * n.y + c * n.x;
    return trace - (f->d0 * n.x * n.x + f->d1 * m1 * m1 + f->d2 * m2 * m2);
}

/** The scaled normal k n, and what its judgement needs. */
typedef struct weft_lane_normals {
    float x[WEFT_LANES], y[WEFT_LANES], z[WEFT_LANES];
    float spread[WEFT_LANES];  /* variance of the direction for unit noise */
    float gain[WEFT_LANES];    /* 1 / sum (n.l)^2 */
    float amplify[WEFT_LANES]; /* sqrt(spread) times the length: noise gain of the lights alone */
} weft_lane_normals;

/** Solves one lane; fills normal and valid of the answers. */
WEFT_INLINE void weft_lane_solve(const weft_lane_sums *all, int k, weft_lane_normals *scaled,
                                 weft_solve_answers *a)
{
    const float least = WEFT_SOLVE_MIN_SINGULAR * WEFT_SOLVE_MIN_SINGULAR;
    const weft_sums t = weft_sums_of_lane(all, k);
    const float valid = t.n > 2.5F ? weft_sums_determined(&t, least) : 0;
    const weft_factors f = weft_sums_factorise(&t, valid);
    const weft_vec3f b = {all->bx[k], all->by[k], all->bz[k]};
    const weft_vec3f v = weft_factors_substitute(&f, b);
    const float length = sqrtf(v.x * v.x + v.y * v.y + v.z * v.z);
    const float lit = length >= WEFT_SOLVE_BLACK ? valid : 0.0F;
    const float over = 1 / (lit > 0 ? length : 1.0F);
    const weft_vec3f n = {lit * v.x * over, lit * v.y * over, lit * v.z * over + (valid - lit)};

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
    const float spread = weft_factors_spread(&f, n);
    scaled->spread[k] = lit * spread * over * over;
    scaled->amplify[k] = valid * sqrtf(spread > 0 ? spread : 0);
}

/** Albedo with the normal held fixed: sum I' (n.l) / sum (n.l)^2 over the weights. */
WEFT_INLINE void weft_lane_albedo(const weft_solve_samples *s, const weft_lane_weights *weights, int c,
                                  const weft_lane_normals *scaled, weft_solve_answers *a)
{
    float sum[WEFT_LANES] = {0};
    for (int j = 0; j < s->n_lights; j++) {
        const float *const weight = weft_weights_of(s, weights, j);
#pragma omp simd
        for (int k = 0; k < WEFT_LANES; k++)
            sum[k] += weight[k] * s->at[j].value[c][k] *
                      (a->normal[0][k] * s->at[j].light[0][k] + a->normal[1][k] * s->at[j].light[1][k] +
                       a->normal[2][k] * s->at[j].light[2][k]);
    }
    for (int k = 0; k < WEFT_LANES; k++)
        a->albedo[c][k] = scaled->gain[k] * sum[k];
}

/** The same of all channels.  A site of a mosaic has one colour, which is its grey: the sum of I' (n.l) over
 *  the lights is then n.b, which is there already. */
WEFT_INLINE void weft_lane_albedos(const weft_solve_samples *s, const weft_lane_weights *weights,
                                   const weft_lane_sums *t, const weft_lane_normals *scaled,
                                   weft_solve_answers *a)
{
    if (s->n_channels == 1) {
#pragma omp simd
        for (int k = 0; k < WEFT_LANES; k++)
            a->albedo[0][k] = scaled->gain[k] * (a->normal[0][k] * t->bx[k] + a->normal[1][k] * t->by[k] +
                                                 a->normal[2][k] * t->bz[k]);
        return;
    }
    for (int c = 0; c < s->n_channels; c++)
        weft_lane_albedo(s, weights, c, scaled, a);
}

/** How well the samples fit that have a weight. */
typedef struct weft_lane_misfits {
    float squares[WEFT_LANES];   /* sum w (I' - fit)^2 */
    float brightest[WEFT_LANES]; /* largest fit */
    float variance[WEFT_LANES];  /* sum w^2 (the camera's variance): over n that of a row, as the answer feels
                                    it */
} weft_lane_misfits;

WEFT_INLINE void weft_lane_measure(const weft_solve_samples *s, const weft_lane_weights *weights,
                                   const weft_lane_normals *scaled, weft_lane_misfits *to)
{
    weft_lane_misfits m = {0};
    for (int j = 0; j < s->n_lights; j++) {
        const float *const weight = weft_weights_of(s, weights, j);
#pragma omp simd
        for (int k = 0; k < WEFT_LANES; k++) {
            const float fit = scaled->x[k] * s->at[j].light[0][k] + scaled->y[k] * s->at[j].light[1][k] +
                              scaled->z[k] * s->at[j].light[2][k];
            const float d = s->at[j].grey[k] - fit, used = weight[k] > 0 ? fit : 0.0F;
            m.squares[k] += weight[k] * d * d;
            m.brightest[k] = used > m.brightest[k] ? used : m.brightest[k];
            m.variance[k] += weight[k] * weight[k] * s->at[j].variance[k];
        }
    }
    *to = m;
}

/** How many samples the camera's noise counts for, where it is known, beside the residuals. */
#define WEFT_SOLVE_KNOWN_NOISE 8.0F

/** Variance of a sample of a pixel whose residuals' squares sum to `squares` over n samples.
 *  @param noise  its variance by the camera's noise; 0: not known, then `prior` is taken */
WEFT_INLINE float weft_sample_variance(float squares, float noise, float prior, float n)
{
    const float weight = noise > 0 ? WEFT_SOLVE_KNOWN_NOISE : 2.0F, dof = n > 3 ? n - 3 : 0.0F;
    const float pooled = (squares + weight * (noise > 0 ? noise : prior)) / (dof + weight);
    /* chi^2 three sigma above its mean */
    const int more = noise > 0 && dof > 0 && squares > noise * (dof + 3 * sqrtf(2 * dof));
    return more ? squares / dof : pooled;
}

/**
 * Residual, confidence, expected error and number of lights of one lane (docs/solving.md).
 *
 * The expected error takes the variance of a sample from the camera's noise and the residuals together, the
 * noise counting as much as eight samples; from the residuals alone where they are larger than noise can make
 * them.  Where the noise is not known, 2 % of the brightest fit stand for it and count as two samples.
 */
WEFT_INLINE void weft_lane_judge(const weft_lane_sums *all, const weft_lane_normals *scaled,
                                 const weft_lane_misfits *m, int k, weft_solve_answers *a)
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

    const float expected2 =
        weft_sample_variance(m->squares[k], m->variance[k] / count, prior * prior, count) * scaled->spread[k];
    a->angle[k] = lit > 0 ? sqrtf(expected2 > 0 ? expected2 : 0.0F) : 0.0F;
    a->n_used[k] = a->valid[k] > 0 ? all->n[k] : 0.0F;
}

/** The bits that any method sets. */
WEFT_INLINE uint32_t weft_lane_quality(const weft_solve_samples *s, const weft_lane_normals *scaled, int k)
{
    return (s->clipped[k] > 0 ? (uint32_t)WEFT_QUALITY_CLIPPED : 0U) |
           (s->dark[k] > 0 ? (uint32_t)WEFT_QUALITY_SHADOWED : 0U) |
           (scaled->amplify[k] > WEFT_SOLVE_ILL_CONDITIONED ? (uint32_t)WEFT_QUALITY_ILL_CONDITIONED : 0U);
}

/** Whether the residuals are larger than noise and tolerance explain: chi^2 per degree of freedom above 1
 *  with sigma^2 = noise + (2 % of the brightest fit)^2. */
WEFT_INLINE float weft_lane_contradicts(const weft_lane_sums *all, const weft_lane_misfits *m, int k)
{
    const float n = all->n[k] > 3 ? all->n[k] : 4;
    const float tolerance = WEFT_SOLVE_MISFIT * m->brightest[k];
    return all->n[k] > 3 && m->squares[k] > (n - 3) * (m->variance[k] / n + tolerance * tolerance) ? 1.0F
                                                                                                   : 0.0F;
}

/** The brightest used sample of each lane. */
WEFT_INLINE void weft_lane_peak(const weft_solve_samples *s, float peak[WEFT_LANES])
{
    for (int k = 0; k < WEFT_LANES; k++)
        peak[k] = 0;
    for (int j = 0; j < s->n_lights; j++)
#pragma omp simd
        for (int k = 0; k < WEFT_LANES; k++)
            peak[k] = s->at[j].grey[k] > peak[k] ? s->at[j].grey[k] : peak[k];
}

/**
 * Weights without what is darker than WEFT_SOLVE_SHADOW of the brightest, unless fewer than four samples
 * would be left to contradict each other: then all stay.
 *
 * @param weights  [n_lights]
 * @param dropped  how many samples were left out
 */
WEFT_INLINE void weft_lane_leave_shadows(const weft_solve_samples *s, weft_lane_weights *weights,
                                         float dropped[WEFT_LANES])
{
    float peak[WEFT_LANES], lit[WEFT_LANES] = {0}, all[WEFT_LANES] = {0};
    weft_lane_peak(s, peak);
    for (int j = 0; j < s->n_lights; j++)
#pragma omp simd
        for (int k = 0; k < WEFT_LANES; k++) {
            const float w = s->at[j].grey[k] >= WEFT_SOLVE_SHADOW * peak[k] ? s->at[j].weight[k] : 0.0F;
            weights[j].at[k] = w;
            lit[k] += w;
            all[k] += s->at[j].weight[k];
        }
    for (int j = 0; j < s->n_lights; j++) {
#pragma omp simd
        for (int k = 0; k < WEFT_LANES; k++)
            weights[j].at[k] = lit[k] > 3.5F ? weights[j].at[k] : s->at[j].weight[k];
    }
#pragma omp simd
    for (int k = 0; k < WEFT_LANES; k++)
        dropped[k] = lit[k] > 3.5F ? all[k] - lit[k] : 0.0F;
}

/**
 * Gives what is used the weight of its noise, 1 / (variance + (misfit of the brightest used)^2): the lamps
 * are not equally bright, and a surface not equally steep to them, so one sample is worth more than another.
 * What cloth misses Lambert's law by counts as noise too, or a few samples would count for all.
 *
 * The weights of a pixel have the mean 1, and a weighted row has the same variance whatever the light, so
 * that what is said of the matrix and the residuals of plain least squares holds.
 *
 * @param misfit   of the brightest used sample
 * @param weights  [n_lights]  in: 1 or 0
 */
WEFT_INLINE void weft_lane_weigh(const weft_solve_samples *s, float misfit, weft_lane_weights *weights)
{
    float peak[WEFT_LANES], sum[WEFT_LANES] = {0}, n[WEFT_LANES] = {0};
    for (int k = 0; k < WEFT_LANES; k++)
        peak[k] = 0;
    for (int j = 0; j < s->n_lights; j++)
#pragma omp simd
        for (int k = 0; k < WEFT_LANES; k++) {
            const float grey = weights[j].at[k] * s->at[j].grey[k];
            peak[k] = grey > peak[k] ? grey : peak[k];
        }
    for (int j = 0; j < s->n_lights; j++) {
#pragma omp simd
        for (int k = 0; k < WEFT_LANES; k++) {
            const float used = weights[j].at[k], tolerance = misfit * peak[k];
            const float variance = s->at[j].variance[k] + tolerance * tolerance;
            const float w = variance > 0 ? used / variance : used;
            weights[j].at[k] = w;
            sum[k] += w;
            n[k] += used;
        }
    }
#pragma omp simd
    for (int k = 0; k < WEFT_LANES; k++)
        sum[k] = n[k] > 0 ? n[k] / sum[k] : 1.0F;
    for (int j = 0; j < s->n_lights; j++) {
#pragma omp simd
        for (int k = 0; k < WEFT_LANES; k++)
            weights[j].at[k] *= sum[k];
    }
}

#endif
