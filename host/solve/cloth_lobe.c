#include "host/solve/cloth_lobe.h"

#include "host/solve/normal_equations.h"

#include <float.h>
#include <string.h>

enum { LANES = WEFT_SOLVE_LANES, ROUNDS = 6, LAST_ROUNDS = 2 };

static const float cut2 = 9.0F;

/* ---- the lobe of a block ---- */

/* What of each light does not change with the normal. */
typedef struct lamp_lanes {
    float half[3][LANES], fresnel[LANES], sigma2[LANES];
} lamp_lanes;

typedef struct lane_vectors {
    float x[LANES], y[LANES], z[LANES];
} lane_vectors;

WEFT_INLINE void halve(const weft_solve_samples *s, lamp_lanes *lamps)
{
    for (int j = 0; j < s->n_lights; j++)
#pragma omp simd
        for (int k = 0; k < LANES; k++) {
            const float lx = s->at[j].light[0][k], ly = s->at[j].light[1][k], lz = s->at[j].light[2][k];
            const float x = lx + s->view[0][k], y = ly + s->view[1][k], z = lz + s->view[2][k];
            const float over = 1 / sqrtf(x * x + y * y + z * z);
            const float c = 1 - over * (lx * x + ly * y + lz * z), c2 = c * c;
            lamps[j].half[0][k] = x * over;
            lamps[j].half[1][k] = y * over;
            lamps[j].half[2][k] = z * over;
            lamps[j].fresnel[k] = 1 + 19 * c2 * c2 * c; /* (F0 + (1 - F0) c^5) / F0 with F0 = 0.05 */
        }
}

/* The normal's frame along a fibre: what the lobe needs of it. */
typedef struct lane_frames {
    float nx[LANES], ny[LANES], nz[LANES];
    float tn[LANES];   /* fibre . normal */
    float over[LANES]; /* 1 / (length of the fibre's part in the surface)^2 */
    float nv[LANES], eye_masking[LANES];
} lane_frames;

WEFT_INLINE void frame(const weft_solve_samples *s, const weft_gloss *g, int fibre, const lane_vectors *n,
                       lane_frames *f)
{
    const float tx = g->fibre[fibre][0], ty = g->fibre[fibre][1];
    const float alpha2 = g->alpha_along * g->alpha_across;
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const float along = tx * n->x[k] + ty * n->y[k], rest = 1 - along * along;
        const float facing = n->x[k] * s->view[0][k] + n->y[k] * s->view[1][k] + n->z[k] * s->view[2][k];
        const float nv = facing > 0.05F ? facing : 0.05F;
        f->nx[k] = n->x[k];
        f->ny[k] = n->y[k];
        f->nz[k] = n->z[k];
        f->tn[k] = along;
        f->over[k] = 1 / (rest > 0.01F ? rest : 0.01F);
        f->nv[k] = nv;
        f->eye_masking[k] = sqrtf(alpha2 + (1 - alpha2) * nv * nv);
    }
}

/* Mirror light of lamp j for the frames' normals. */
WEFT_INLINE void mirror(const weft_solve_samples *s, const weft_gloss *g, int fibre, const lamp_lanes *lamps,
                        int j, const lane_frames *f, float to[LANES])
{
    const float tx = g->fibre[fibre][0], ty = g->fibre[fibre][1];
    const float alpha2 = g->alpha_along * g->alpha_across;
    const float along2 = 1 / (g->alpha_along * g->alpha_along),
                across2 = 1 / (g->alpha_across * g->alpha_across);
    const float scale = 0.5F * g->strength / alpha2;
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const float hx = lamps[j].half[0][k], hy = lamps[j].half[1][k], hz = lamps[j].half[2][k];
        const float facing = f->nx[k] * s->at[j].light[0][k] + f->ny[k] * s->at[j].light[1][k] +
                             f->nz[k] * s->at[j].light[2][k];
        const float nl = facing > 0 ? facing : 0.0F;
        const float hn = f->nx[k] * hx + f->ny[k] * hy + f->nz[k] * hz;
        const float ht = tx * hx + ty * hy - f->tn[k] * hn, ht2 = ht * ht * f->over[k];
        const float hb2 = 1 - hn * hn - ht2;
        const float lobe = ht2 * along2 + (hb2 > 0 ? hb2 : 0.0F) * across2 + hn * hn;
        const float lamp_masking = sqrtf(alpha2 + (1 - alpha2) * nl * nl);
        to[k] = scale * lamps[j].fresnel[k] * nl /
                (lobe * lobe * (nl * f->eye_masking[k] + f->nv[k] * lamp_masking));
    }
}

/* ---- one pixel a lane: Gauss-Newton ---- */

typedef struct lane_system {
    float xx[LANES], xy[LANES], xz[LANES], yy[LANES], yz[LANES], zz[LANES];
    float bx[LANES], by[LANES], bz[LANES];
} lane_system;

/* Two directions across the normal, and the normals a little towards them. */
typedef struct lane_tilts {
    lane_vectors e[2], tilted[2];
} lane_tilts;

static const float tilt = 0.01F; /* radians */

WEFT_INLINE void direction_of(const lane_vectors *b, lane_vectors *n, float length[LANES])
{
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const float l = sqrtf(b->x[k] * b->x[k] + b->y[k] * b->y[k] + b->z[k] * b->z[k]);
        const float over = 1 / (l > 1e-9F ? l : 1.0F);
        length[k] = l > 1e-9F ? l : 1e-9F;
        n->x[k] = b->x[k] * over;
        n->y[k] = b->y[k] * over;
        n->z[k] = l > 1e-9F ? b->z[k] * over : 1.0F;
    }
}

WEFT_INLINE void make_tilts(const lane_vectors *n, lane_tilts *t)
{
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        /* Duff et al. 2017: a frame without a square root; n_z > -1 here as lights are above */
        const float nx = n->x[k], ny = n->y[k], nz = n->z[k] > -0.9F ? n->z[k] : -0.9F;
        const float a = -1 / (1 + nz), b = nx * ny * a;
        t->e[0].x[k] = 1 + nx * nx * a, t->e[0].y[k] = b, t->e[0].z[k] = -nx;
        t->e[1].x[k] = b, t->e[1].y[k] = 1 + ny * ny * a, t->e[1].z[k] = -ny;
        for (int i = 0; i < 2; i++) {
            t->tilted[i].x[k] = nx + tilt * t->e[i].x[k];
            t->tilted[i].y[k] = ny + tilt * t->e[i].y[k];
            t->tilted[i].z[k] = nz + tilt * t->e[i].z[k];
        }
    }
}

/* Normal equations of the step at b, and the cost of b. */
WEFT_INLINE void linearise(const weft_solve_samples *s, const weft_gloss *g, int fibre,
                           const lamp_lanes *lamps, const weft_lane_weights *weights, const lane_vectors *b,
                           lane_system *to)
{
    lane_vectors n;
    lane_tilts t;
    lane_frames f[3];
    float length[LANES], m[3][LANES];
    lane_system a = {0};
    direction_of(b, &n, length);
    make_tilts(&n, &t);
    frame(s, g, fibre, &n, &f[0]);
    frame(s, g, fibre, &t.tilted[0], &f[1]);
    frame(s, g, fibre, &t.tilted[1], &f[2]);
    for (int j = 0; j < s->n_lights; j++) {
        for (int i = 0; i < 3; i++)
            mirror(s, g, fibre, lamps, j, &f[i], m[i]);
#pragma omp simd
        for (int k = 0; k < LANES; k++) {
            const float w = weights[j].at[k], per = 1 / (tilt * length[k]);
            const float d1 = (m[1][k] - m[0][k]) * per, d2 = (m[2][k] - m[0][k]) * per;
            const float lx = s->at[j].light[0][k], ly = s->at[j].light[1][k], lz = s->at[j].light[2][k];
            const float x = lx + d1 * t.e[0].x[k] + d2 * t.e[1].x[k],
                        y = ly + d1 * t.e[0].y[k] + d2 * t.e[1].y[k],
                        z = lz + d1 * t.e[0].z[k] + d2 * t.e[1].z[k];
            const float r = w * (s->at[j].grey[k] - m[0][k] - lx * b->x[k] - ly * b->y[k] - lz * b->z[k]);
            a.xx[k] += w * x * x, a.xy[k] += w * x * y, a.xz[k] += w * x * z;
            a.yy[k] += w * y * y, a.yz[k] += w * y * z, a.zz[k] += w * z * z;
            a.bx[k] += r * x, a.by[k] += r * y, a.bz[k] += r * z;
        }
    }
    *to = a;
}

/* A step of Gauss-Newton, at most half the length of b; a little damped, so that the matrix has an inverse.
 */
WEFT_INLINE void step(const lane_system *a, lane_vectors *b)
{
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const float damp = 1e-3F * (a->xx[k] + a->yy[k] + a->zz[k]) + 1e-9F;
        const weft_sums t = {a->xx[k] + damp, a->xy[k],        a->xz[k], a->yy[k] + damp,
                             a->yz[k],        a->zz[k] + damp, 4};
        const weft_factors f = weft_sums_factorise(&t, 1);
        const weft_vec3f d = weft_factors_substitute(&f, (weft_vec3f){a->bx[k], a->by[k], a->bz[k]});
        const float d2 = d.x * d.x + d.y * d.y + d.z * d.z;
        const float l2 = 0.25F * (b->x[k] * b->x[k] + b->y[k] * b->y[k] + b->z[k] * b->z[k]) + 1e-12F;
        const float part = d2 > l2 ? sqrtf(l2 / d2) : 1.0F;
        b->x[k] += part * d.x;
        b->y[k] += part * d.y;
        b->z[k] += part * d.z;
    }
}

/* What b leaves unexplained, and the mirror light it comes with. */
WEFT_INLINE void evaluate(const weft_solve_samples *s, const weft_gloss *g, int fibre,
                          const lamp_lanes *lamps, const weft_lane_weights *weights, const lane_vectors *b,
                          float cost[LANES], weft_lane_weights *light)
{
    lane_vectors n;
    lane_frames f;
    float length[LANES];
    direction_of(b, &n, length);
    frame(s, g, fibre, &n, &f);
    for (int k = 0; k < LANES; k++)
        cost[k] = 0;
    for (int j = 0; j < s->n_lights; j++) {
        mirror(s, g, fibre, lamps, j, &f, light[j].at);
#pragma omp simd
        for (int k = 0; k < LANES; k++) {
            const float r = s->at[j].grey[k] - light[j].at[k] - s->at[j].light[0][k] * b->x[k] -
                            s->at[j].light[1][k] * b->y[k] - s->at[j].light[2][k] * b->z[k];
            const float q = r * r / lamps[j].sigma2[k];
            cost[k] += weights[j].at[k] * (q < cut2 ? q : cut2);
        }
    }
}

/* Least squares without the lobe: where the iterations begin. */
WEFT_INLINE void start(const weft_solve_samples *s, const weft_lane_weights *weights, lane_vectors *b)
{
    weft_lane_sums t;
    weft_sums_add_up(s, weights, &t);
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const float damp = 1e-4F * (t.xx[k] + t.yy[k] + t.zz[k]) + 1e-9F;
        const weft_sums a = {t.xx[k] + damp, t.xy[k], t.xz[k], t.yy[k] + damp, t.yz[k], t.zz[k] + damp, 4};
        const weft_factors f = weft_sums_factorise(&a, 1);
        const weft_vec3f v = weft_factors_substitute(&f, (weft_vec3f){t.bx[k], t.by[k], t.bz[k]});
        b->x[k] = v.x, b->y[k] = v.y, b->z[k] = v.z;
    }
}

WEFT_INLINE void find_sigmas(const weft_solve_samples *s, lamp_lanes *lamps)
{
    float peak[LANES];
    weft_lane_peak(s, peak);
    for (int j = 0; j < s->n_lights; j++)
#pragma omp simd
        for (int k = 0; k < LANES; k++) {
            const float tolerance = WEFT_SOLVE_MISFIT * peak[k];
            const float sigma2 = s->at[j].variance[k] + tolerance * tolerance;
            lamps[j].sigma2[k] = sigma2 > 0 ? sigma2 : 1.0F;
        }
}

/* Solutions of the lanes. */
typedef struct lane_best {
    lane_vectors b;
    float cost[LANES];
    weft_lane_weights light[WEFT_LIGHTS_MAX];
} lane_best;

WEFT_INLINE void take_better(int n_lights, const lane_best *other, lane_best *best)
{
    float better[LANES];
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        better[k] = other->cost[k] < best->cost[k] ? 1.0F : 0.0F;
        best->b.x[k] = better[k] > 0 ? other->b.x[k] : best->b.x[k];
        best->b.y[k] = better[k] > 0 ? other->b.y[k] : best->b.y[k];
        best->b.z[k] = better[k] > 0 ? other->b.z[k] : best->b.z[k];
        best->cost[k] = better[k] > 0 ? other->cost[k] : best->cost[k];
    }
    for (int j = 0; j < n_lights; j++)
#pragma omp simd
        for (int k = 0; k < LANES; k++)
            best->light[j].at[k] = better[k] > 0 ? other->light[j].at[k] : best->light[j].at[k];
}

/* Either fibre direction from b, with the weights; the better one of each lane. */
WEFT_INLINE void solve_directions(const weft_solve_samples *s, const weft_gloss *g, const lamp_lanes *lamps,
                                  const weft_lane_weights *weights, const lane_vectors *from, int rounds,
                                  lane_best *best)
{
    for (int k = 0; k < LANES; k++)
        best->cost[k] = FLT_MAX;
    for (int fibre = 0; fibre < 2; fibre++) {
        lane_best now;
        lane_system a;
        now.b = *from;
        for (int round = 0; round < rounds; round++) {
            linearise(s, g, fibre, lamps, weights, &now.b, &a);
            step(&a, &now.b);
        }
        evaluate(s, g, fibre, lamps, weights, &now.b, now.cost, now.light);
        take_better(s->n_lights, &now, best);
    }
}

/* Leaves out what is beyond three sigma where at least four samples stay. */
WEFT_INLINE void trim(const weft_solve_samples *s, const lamp_lanes *lamps, const weft_lane_weights *lit,
                      const lane_best *best, weft_lane_weights *kept)
{
    float n[LANES] = {0};
    for (int j = 0; j < s->n_lights; j++)
#pragma omp simd
        for (int k = 0; k < LANES; k++) {
            const float r = s->at[j].grey[k] - best->light[j].at[k] - s->at[j].light[0][k] * best->b.x[k] -
                            s->at[j].light[1][k] * best->b.y[k] - s->at[j].light[2][k] * best->b.z[k];
            kept[j].at[k] = r * r < cut2 * lamps[j].sigma2[k] ? lit[j].at[k] : 0.0F;
            n[k] += kept[j].at[k];
        }
    for (int j = 0; j < s->n_lights; j++)
#pragma omp simd
        for (int k = 0; k < LANES; k++)
            kept[j].at[k] = n[k] > 3.5F ? kept[j].at[k] : lit[j].at[k];
}

WEFT_CLONES void weft_gloss_solve(const weft_solve_samples *restrict s, weft_solve_samples *restrict matte,
                                  weft_lane_weights *restrict kept, float cost[WEFT_SOLVE_LANES])
{
    _Alignas(64) lamp_lanes lamps[WEFT_LIGHTS_MAX];
    _Alignas(64) weft_lane_weights lit[WEFT_LIGHTS_MAX];
    float dropped[LANES];
    lane_best best;
    lane_vectors b;
    halve(s, lamps);
    find_sigmas(s, lamps);
    weft_lane_leave_shadows(s, lit, dropped);
    start(s, lit, &b);
    solve_directions(s, s->gloss, lamps, lit, &b, ROUNDS, &best);
    for (int k = 0; k < LANES; k++)
        cost[k] = best.cost[k];
    trim(s, lamps, lit, &best, kept);
    b = best.b;
    solve_directions(s, s->gloss, lamps, kept, &b, LAST_ROUNDS, &best);
    matte->n_lights = s->n_lights;
    matte->n_channels = s->n_channels;
    memcpy(matte->clipped, s->clipped, sizeof matte->clipped);
    for (int k = 0; k < LANES; k++)
        matte->dark[k] = s->dark[k] + dropped[k];
    for (int j = 0; j < s->n_lights; j++) {
        matte->at[j] = s->at[j];
        for (int c = 0; c < s->n_channels; c++) {
#pragma omp simd
            for (int k = 0; k < LANES; k++)
                matte->at[j].value[c][k] -= matte->at[j].weight[k] * best.light[j].at[k];
        }
#pragma omp simd
        for (int k = 0; k < LANES; k++)
            matte->at[j].grey[k] -= matte->at[j].weight[k] * best.light[j].at[k];
    }
}
