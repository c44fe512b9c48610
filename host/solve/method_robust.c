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
/* Triples tried of more than FEW_LIGHTS lights; all of 12 lights are as many. */
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

/* Where lights were left out, what the others say may be of the same kind: they may miss Lambert's law by the
 * 2 % that are allowed, the more so the fewer are left to contradict each other.  The factor is fitted to the
 * virtual scanner's fabrics (docs/solving.md). */
WEFT_INLINE void doubt(const weft_lane_sums *t, const weft_lane_normals *scaled, const weft_lane_misfits *m,
                       float n_lights, int k, weft_solve_answers *a)
{
    const float spare = t->n[k] > 3.5F ? t->n[k] - 3 : 0.5F, fewer = n_lights / spare - 1;
    const float tolerance = WEFT_SOLVE_MISFIT * m->brightest[k] * (fewer > 0 ? fewer : 0.0F);
    const float doubt2 = tolerance * tolerance * scaled->spread[k];
    a->angle[k] = sqrtf(a->angle[k] * a->angle[k] + (doubt2 > 0 ? doubt2 : 0.0F));
}

WEFT_INLINE void judge(const weft_solve_samples *s, const weft_lane_weights *weights, const weft_lane_sums *t,
                       const weft_lane_normals *scaled, const weft_lane_misfits *m,
                       const float dropped[WEFT_LANES], const float mark[WEFT_LANES], weft_solve_answers *a)
{
    weft_lane_albedos(s, weights, t, scaled, a);
#pragma omp simd
    for (int k = 0; k < WEFT_LANES; k++) {
        weft_lane_judge(t, scaled, m, k, a);
        if (dropped[k] + mark[k] > 0)
            doubt(t, scaled, m, (float)s->n_lights, k, a);
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

typedef struct lane_vectors {
    float x[WEFT_LANES], y[WEFT_LANES], z[WEFT_LANES];
} lane_vectors;

/* Up to this many lights every triple is tried, and the cross products of all pairs are kept. */
enum { FEW_LIGHTS = 12, FEW_PAIRS = FEW_LIGHTS * (FEW_LIGHTS - 1) / 2 };

/* Light and sample over sigma; 0 for what is left out. */
typedef struct scaled_light {
    lane_vectors light;
    float grey[WEFT_LANES], weight[WEFT_LANES];
} scaled_light;

/* 1 / sigma^2 of every sample; 0 for what is left out. */
WEFT_INLINE void weigh(const weft_solve_samples *s, const weft_lane_weights *weights,
                       const float peak[WEFT_LANES], weft_lane_weights *inverse, scaled_light *scaled)
{
    for (int j = 0; j < s->n_lights; j++)
#pragma omp simd
        for (int k = 0; k < WEFT_LANES; k++) {
            const float tolerance = WEFT_SOLVE_MISFIT * peak[k];
            const float variance = s->at[j].variance[k] + tolerance * tolerance;
            const float over2 = weights[j].at[k] / (variance > 0 ? variance : 1.0F), over = sqrtf(over2);
            inverse[j].at[k] = over2;
            scaled[j].weight[k] = weights[j].at[k];
            scaled[j].grey[k] = over * s->at[j].grey[k];
            scaled[j].light.x[k] = over * s->at[j].light[0][k];
            scaled[j].light.y[k] = over * s->at[j].light[1][k];
            scaled[j].light.z[k] = over * s->at[j].light[2][k];
        }
}

WEFT_INLINE void cross(const weft_solve_light *a, const weft_solve_light *b, lane_vectors *to)
{
#pragma omp simd
    for (int k = 0; k < WEFT_LANES; k++) {
        to->x[k] = a->light[1][k] * b->light[2][k] - a->light[2][k] * b->light[1][k];
        to->y[k] = a->light[2][k] * b->light[0][k] - a->light[0][k] * b->light[2][k];
        to->z[k] = a->light[0][k] * b->light[1][k] - a->light[1][k] * b->light[0][k];
    }
}

/* Three lights and the cross products of their pairs. */
typedef struct triple {
    int i, j, l;
    const lane_vectors *ij, *il, *jl;
} triple;

/* The scaled normal that three lights agree on, by Cramer's rule; cost infinite where there is none. */
WEFT_INLINE void agree(const weft_solve_samples *s, const scaled_light *scaled, const triple *t,
                       candidates *to)
{
    const weft_solve_light *const a = &s->at[t->i], *const b = &s->at[t->j], *const c = &s->at[t->l];
#pragma omp simd
    for (int k = 0; k < WEFT_LANES; k++) {
        const float volume =
            t->ij->x[k] * c->light[0][k] + t->ij->y[k] * c->light[1][k] + t->ij->z[k] * c->light[2][k];
        const float used = scaled[t->i].weight[k] * scaled[t->j].weight[k] * scaled[t->l].weight[k];
        const int fit = (fabsf(volume) > least_volume) & (used > 0);
        const float over = 1 / (fit ? volume : 1.0F);
        to->x[k] = over * (a->grey[k] * t->jl->x[k] - b->grey[k] * t->il->x[k] + c->grey[k] * t->ij->x[k]);
        to->y[k] = over * (a->grey[k] * t->jl->y[k] - b->grey[k] * t->il->y[k] + c->grey[k] * t->ij->y[k]);
        to->z[k] = over * (a->grey[k] * t->jl->z[k] - b->grey[k] * t->il->z[k] + c->grey[k] * t->ij->z[k]);
        to->cost[k] = fit ? 0.0F : INFINITY;
    }
}

/* Adds what the lights of `first` to `last` do not agree with. */
WEFT_INLINE void add_cost(const scaled_light *scaled, int first, int last, candidates *v)
{
    for (int m = first; m < last; m++)
#pragma omp simd
        for (int k = 0; k < WEFT_LANES; k++) {
            const float d =
                scaled[m].grey[k] - (v->x[k] * scaled[m].light.x[k] + v->y[k] * scaled[m].light.y[k] +
                                     v->z[k] * scaled[m].light.z[k]);
            const float q = d * d;
            v->cost[k] += q < cut2 ? q : cut2;
        }
}

WEFT_INLINE void try_triple(const weft_solve_samples *s, const scaled_light *scaled, const triple *t,
                            candidates *best)
{
    candidates v;
    agree(s, scaled, t, &v);
    add_cost(scaled, 0, t->i, &v); /* its own three lights it fits */
    add_cost(scaled, t->i + 1, t->j, &v);
    add_cost(scaled, t->j + 1, t->l, &v);
    add_cost(scaled, t->l + 1, s->n_lights, &v);
#pragma omp simd
    for (int k = 0; k < WEFT_LANES; k++) {
        const int better = v.cost[k] < best->cost[k];
        best->cost[k] = better ? v.cost[k] : best->cost[k];
        best->x[k] = better ? v.x[k] : best->x[k];
        best->y[k] = better ? v.y[k] : best->y[k];
        best->z[k] = better ? v.z[k] : best->z[k];
    }
}

/* Where the pair (i, j), i < j, of n lights is kept. */
static inline int pair_of(int i, int j, int n)
{
    return i * n - i * (i + 1) / 2 + j - i - 1;
}

WEFT_INLINE void try_all(const weft_solve_samples *s, const scaled_light *scaled, candidates *best)
{
    _Alignas(64) lane_vectors pairs[FEW_PAIRS];
    const int n = s->n_lights;
    for (int i = 0; i < n; i++)
        for (int j = i + 1; j < n; j++)
            cross(&s->at[i], &s->at[j], &pairs[pair_of(i, j, n)]);
    for (int i = 0; i < n; i++)
        for (int j = i + 1; j < n; j++)
            for (int l = j + 1; l < n; l++) {
                const triple t = {
                    i, j, l, &pairs[pair_of(i, j, n)], &pairs[pair_of(i, l, n)], &pairs[pair_of(j, l, n)]};
                try_triple(s, scaled, &t, best);
            }
}

/* Of many lights' triples every so many, in the order (0, 1, 2), (0, 1, 3), ..., of which only the ones that
 * are tried are come by: the triples that begin with i, or with i and j, are stepped over together. */
WEFT_INLINE void try_some(const weft_solve_samples *s, const scaled_light *scaled, candidates *best)
{
    const long n = s->n_lights, all = n * (n - 1) * (n - 2) / 6;
    long i = 0, j = 1, of_i = 0, of_j = 0; /* the numbers of the first triples with i, and with i and j */
    for (long tried = 0; tried < MOST_TRIPLES; tried++) {
        const long number = (2 * tried + 1) * all / (2L * MOST_TRIPLES);
        while (number >= of_i + (n - 1 - i) * (n - 2 - i) / 2) {
            of_i += (n - 1 - i) * (n - 2 - i) / 2;
            i++;
            of_j = of_i;
            j = i + 1;
        }
        while (number >= of_j + n - 1 - j) {
            of_j += n - 1 - j;
            j++;
        }
        const int l = (int)(j + 1 + number - of_j);
        lane_vectors ij, il, jl;
        cross(&s->at[i], &s->at[j], &ij);
        cross(&s->at[i], &s->at[l], &il);
        cross(&s->at[j], &s->at[l], &jl);
        const triple t = {(int)i, (int)j, l, &ij, &il, &jl};
        try_triple(s, scaled, &t, best);
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
    _Alignas(64) scaled_light scaled_lights[WEFT_LIGHTS_MAX];
    float peak[WEFT_LANES], dropped[WEFT_LANES], mark[WEFT_LANES];
    candidates best = {0};
    weft_lane_sums t;
    weft_lane_normals scaled;
    weft_lane_misfits m;
    weft_lane_peak(samples, peak);
    weft_lane_leave_shadows(samples, lit, dropped);
    weigh(samples, lit, peak, inverse, scaled_lights);
    for (int k = 0; k < WEFT_LANES; k++) {
        best.cost[k] = INFINITY;
        mark[k] = 1;
        answers->search[k] = 0;
    }
    if (samples->n_lights <= FEW_LIGHTS)
        try_all(samples, scaled_lights, &best);
    else
        try_some(samples, scaled_lights, &best);
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
