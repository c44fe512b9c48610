/*
 * Cloth that shades itself and shines: shadows are left out, and where what remains contradicts a matte
 * surface by more than noise, the largest group of lights that agree is searched for among all triples.
 *
 * Truncated least squares: the normal is the one with the least sum of min(r^2 / sigma^2, 9) over the lights.
 * (Torr and Zisserman, "MLESAC", CVIU 78, 2000, call it MSAC; every triple is tried, so nothing is random.)
 * It needs no number of lights to keep: on a steep flank three or four of ten are lit, on a matte crown all.
 */
#include "host/solve/cloth_lobe.h"
#include "host/solve/normal_equations.h"

/* Squares beyond three sigma count no more. */
static const float cut2 = 9.0F;
/* A triple whose directions span less volume than this says little; more keeps the smallest singular value
 * above WEFT_SOLVE_MIN_SINGULAR. */
static const float least_volume = 0.08F;
/* Triples tried with many lights; all of 12 lights are 220. */
enum { MOST_TRIPLES = 220 };

/* ---- least squares with weights, and the answers ---- */

WEFT_INLINE void solve_weighted(const weft_solve_samples *s, const weft_lane_weights *weights,
                                weft_lane_sums *t, weft_lane_normals *scaled, weft_solve_answers *a)
{
    weft_sums_add_up(s, weights, t);
#pragma omp simd
    for (int k = 0; k < WEFT_LANES; k++)
        weft_lane_solve(t, k, scaled, a);
}

WEFT_INLINE void judge(const weft_solve_samples *s, const weft_lane_weights *weights, const weft_lane_sums *t,
                       const weft_lane_normals *scaled, const weft_lane_misfits *m,
                       const float dropped[WEFT_LANES], const float mark[WEFT_LANES], weft_solve_answers *a)
{
    for (int c = 0; c < s->n_channels; c++)
        weft_lane_albedo(s, weights, c, scaled, a);
#pragma omp simd
    for (int k = 0; k < WEFT_LANES; k++) {
        weft_lane_judge(t, scaled, m, k, a);
        a->quality[k] = weft_lane_quality(s, scaled, k) |
                        (dropped[k] > 0 ? (uint32_t)WEFT_QUALITY_SHADOWED : 0U) |
                        (mark[k] > 0 ? (uint32_t)WEFT_QUALITY_NOT_LAMBERTIAN : 0U);
    }
}

static WEFT_CLONES void judge_glossy(const weft_solve_samples *restrict matte,
                                     const weft_lane_weights *restrict kept,
                                     weft_solve_answers *restrict answers)
{
    float nothing[WEFT_LANES] = {0}, mark[WEFT_LANES], all[WEFT_LANES] = {0};
    weft_lane_sums t;
    weft_lane_normals scaled;
    weft_lane_misfits m;
    solve_weighted(matte, kept, &t, &scaled, answers);
    weft_lane_measure(matte, kept, &scaled, &m);
    for (int j = 0; j < matte->n_lights; j++)
        for (int k = 0; k < WEFT_LANES; k++)
            all[k] += matte->at[j].weight[k];
    for (int k = 0; k < WEFT_LANES; k++) {
        mark[k] = t.n[k] + matte->dark[k] < all[k] ? 1.0F : weft_lane_contradicts(&t, &m, k);
        answers->search[k] = 0;
    }
    judge(matte, kept, &t, &scaled, &m, nothing, mark, answers);
}

/* With a known lobe: the mirror light is taken off first (cloth_lobe.h). */
static void solve_glossy(const weft_solve_samples *samples, weft_solve_answers *answers)
{
    _Alignas(64) weft_lane_weights kept[WEFT_LIGHTS_MAX];
    weft_solve_samples matte;
    float cost[WEFT_LANES];
    weft_gloss_solve(samples, &matte, kept, cost);
    judge_glossy(&matte, kept, answers);
}

static WEFT_CLONES void solve_matte(const weft_solve_samples *restrict samples,
                                    weft_solve_answers *restrict answers)
{
    _Alignas(64) weft_lane_weights weights[WEFT_LIGHTS_MAX];
    float dropped[WEFT_LANES];
    weft_lane_sums t;
    weft_lane_normals scaled;
    weft_lane_misfits m;
    weft_lane_leave_shadows(samples, weights, dropped);
    solve_weighted(samples, weights, &t, &scaled, answers);
    weft_lane_measure(samples, weights, &scaled, &m);
#pragma omp simd
    for (int k = 0; k < WEFT_LANES; k++)
        answers->search[k] = answers->valid[k] * weft_lane_contradicts(&t, &m, k);
    judge(samples, weights, &t, &scaled, &m, dropped, answers->search, answers);
}

static void solve_robust(const weft_solve_samples *restrict samples, weft_solve_answers *restrict answers)
{
    if (samples->gloss)
        solve_glossy(samples, answers);
    else
        solve_matte(samples, answers);
}

/* ---- the search ---- */

typedef struct candidates {
    float x[WEFT_LANES], y[WEFT_LANES], z[WEFT_LANES], cost[WEFT_LANES];
} candidates;

/* 1 / sigma^2 of every sample; 0 for what is left out. */
WEFT_INLINE void weigh(const weft_solve_samples *s, const weft_lane_weights *weights,
                       const float peak[WEFT_LANES], weft_lane_weights *inverse)
{
    for (int j = 0; j < s->n_lights; j++)
#pragma omp simd
        for (int k = 0; k < WEFT_LANES; k++) {
            const float tolerance = WEFT_SOLVE_MISFIT * peak[k];
            const float variance = s->at[j].variance[k] + tolerance * tolerance;
            inverse[j].at[k] = weights[j].at[k] / (variance > 0 ? variance : 1.0F);
        }
}

typedef struct lane_vectors {
    float x[WEFT_LANES], y[WEFT_LANES], z[WEFT_LANES];
} lane_vectors;

WEFT_INLINE void cross(const weft_solve_light *a, const weft_solve_light *b, lane_vectors *to)
{
#pragma omp simd
    for (int k = 0; k < WEFT_LANES; k++) {
        to->x[k] = a->light[1][k] * b->light[2][k] - a->light[2][k] * b->light[1][k];
        to->y[k] = a->light[2][k] * b->light[0][k] - a->light[0][k] * b->light[2][k];
        to->z[k] = a->light[0][k] * b->light[1][k] - a->light[1][k] * b->light[0][k];
    }
}

/* Tries the scaled normal that three lights agree on: Cramer's rule with the cross product of the first two,
 * which the third light's triples share. */
WEFT_INLINE void try_triple(const weft_solve_samples *s, const weft_lane_weights *inverse, int i, int j,
                            int l, const lane_vectors *ij, candidates *best)
{
    const weft_solve_light *const a = &s->at[i], *const b = &s->at[j], *const c = &s->at[l];
    lane_vectors bc, ca, v;
    float cost[WEFT_LANES];
    cross(b, c, &bc);
    cross(c, a, &ca);
#pragma omp simd
    for (int k = 0; k < WEFT_LANES; k++) {
        const float volume =
            ij->x[k] * c->light[0][k] + ij->y[k] * c->light[1][k] + ij->z[k] * c->light[2][k];
        const float used = inverse[i].at[k] * inverse[j].at[k] * inverse[l].at[k];
        const int fit = (fabsf(volume) > least_volume) & (used > 0);
        const float over = 1 / (fit ? volume : 1.0F);
        v.x[k] = over * (a->grey[k] * bc.x[k] + b->grey[k] * ca.x[k] + c->grey[k] * ij->x[k]);
        v.y[k] = over * (a->grey[k] * bc.y[k] + b->grey[k] * ca.y[k] + c->grey[k] * ij->y[k]);
        v.z[k] = over * (a->grey[k] * bc.z[k] + b->grey[k] * ca.z[k] + c->grey[k] * ij->z[k]);
        cost[k] = fit ? 0.0F : INFINITY;
    }
    for (int m = 0; m < s->n_lights; m++)
#pragma omp simd
        for (int k = 0; k < WEFT_LANES; k++) {
            const float d =
                s->at[m].grey[k] - (v.x[k] * s->at[m].light[0][k] + v.y[k] * s->at[m].light[1][k] +
                                    v.z[k] * s->at[m].light[2][k]);
            const float q = d * d * inverse[m].at[k];
            cost[k] += q < cut2 ? q : cut2;
        }
#pragma omp simd
    for (int k = 0; k < WEFT_LANES; k++) {
        const int better = cost[k] < best->cost[k];
        best->cost[k] = better ? cost[k] : best->cost[k];
        best->x[k] = better ? v.x[k] : best->x[k];
        best->y[k] = better ? v.y[k] : best->y[k];
        best->z[k] = better ? v.z[k] : best->z[k];
    }
}

/* All triples of up to 12 lights; of more, every so many in a fixed order. */
WEFT_INLINE void try_triples(const weft_solve_samples *s, const weft_lane_weights *inverse, candidates *best)
{
    const long n = s->n_lights, all = n * (n - 1) * (n - 2) / 6;
    const long tried = all < MOST_TRIPLES ? all : MOST_TRIPLES;
    long step = 0;
    for (int i = 0; i < n; i++)
        for (int j = i + 1; j < n; j++) {
            lane_vectors ij;
            bool crossed = false;
            for (int l = j + 1; l < n; l++) {
                step += tried;
                if (step < all)
                    continue;
                step -= all;
                if (!crossed)
                    cross(&s->at[i], &s->at[j], &ij);
                crossed = true;
                try_triple(s, inverse, i, j, l, &ij, best);
            }
        }
}

/* Samples within three sigma of the best candidate; all that were not dark where there is none, or where
 * they would not determine a normal. */
WEFT_INLINE void keep_agreeing(const weft_solve_samples *s, const weft_lane_weights *inverse,
                               const candidates *best, const weft_lane_weights *lit, weft_lane_weights *kept)
{
    for (int j = 0; j < s->n_lights; j++)
#pragma omp simd
        for (int k = 0; k < WEFT_LANES; k++) {
            const float d =
                s->at[j].grey[k] - (best->x[k] * s->at[j].light[0][k] + best->y[k] * s->at[j].light[1][k] +
                                    best->z[k] * s->at[j].light[2][k]);
            const int agrees = (d * d * inverse[j].at[k] < cut2) & (lit[j].at[k] > 0);
            kept[j].at[k] = best->cost[k] < INFINITY ? (agrees ? 1.0F : 0.0F) : lit[j].at[k];
        }
}

static WEFT_CLONES void search_robust(const weft_solve_samples *restrict samples,
                                      weft_solve_answers *restrict answers)
{
    _Alignas(64) weft_lane_weights lit[WEFT_LIGHTS_MAX], inverse[WEFT_LIGHTS_MAX], kept[WEFT_LIGHTS_MAX];
    float peak[WEFT_LANES], dropped[WEFT_LANES], mark[WEFT_LANES];
    candidates best = {0};
    weft_lane_sums t;
    weft_lane_normals scaled;
    weft_lane_misfits m;
    weft_lane_peak(samples, peak);
    weft_lane_leave_shadows(samples, lit, dropped);
    weigh(samples, lit, peak, inverse);
    for (int k = 0; k < WEFT_LANES; k++) {
        best.cost[k] = INFINITY;
        mark[k] = 1;
        answers->search[k] = 0;
    }
    try_triples(samples, inverse, &best);
    keep_agreeing(samples, inverse, &best, lit, kept);
    solve_weighted(samples, kept, &t, &scaled, answers);
    weft_lane_measure(samples, kept, &scaled, &m);
    judge(samples, kept, &t, &scaled, &m, dropped, mark, answers);
}

const weft_solve_method weft_method_robust = {
    .name = "robust",
    .summary = "shadows left out; where gloss or a cast shadow remains, the lights that agree",
    .solve = solve_robust,
    .search = search_robust,
    .takes_gloss = true,
    .takes_bounce = true};
