/*
 * Cloth that shades itself and shines: shadows are left out, and where what remains contradicts a matte
 * surface by more than noise, the largest group of lights that agree is searched for among all triples.
 *
 * Truncated least squares: the normal is the one with the least sum of min(r^2 / sigma^2, 9) over the lights.
 * (Torr and Zisserman, "MLESAC", CVIU 78, 2000, call it MSAC; every triple is tried, so nothing is random.)
 * It needs no number of lights to keep: on a steep flank three or four of ten are lit, on a matte crown all.
 *
 * The least squares of whatever is kept weights each sample by its noise (weft_lane_weigh()).
 */
#include "host/solve/cloth_lobe.h"
#include "host/solve/normal_equations.h"
#include "host/solve/triples.h"

/* ---- least squares with weights, and the answers ---- */

/* What the weights say is used, each sample by its noise.
 * @param misfit  what the surface may miss Lambert's law by, of the brightest */
WEFT_INLINE void solve_weighted(const weft_solve_samples *s, float misfit, weft_lane_weights *weights,
                                weft_lane_sums *t, weft_lane_normals *scaled, weft_solve_answers *a)
{
    weft_lane_weigh(s, misfit, weights);
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
                                     weft_lane_weights *restrict kept, weft_solve_answers *restrict answers)
{
    float nothing[WEFT_LANES] = {0}, mark[WEFT_LANES], all[WEFT_LANES] = {0};
    weft_lane_sums t;
    weft_lane_normals scaled;
    weft_lane_misfits m;
    solve_weighted(matte, WEFT_SOLVE_USUAL_MISFIT, kept, &t, &scaled, answers);
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
    solve_weighted(samples, WEFT_SOLVE_USUAL_MISFIT, weights, &t, &scaled, answers);
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

/* 1 / sigma^2 of every sample, 0 for what is left out; and the lights as the search wants them. */
WEFT_INLINE void weigh(const weft_solve_samples *s, const weft_lane_weights *weights,
                       const float peak[WEFT_LANES], weft_lane_weights *inverse, weft_triple_light *lights)
{
    for (int j = 0; j < s->n_lights; j++)
#pragma omp simd
        for (int k = 0; k < WEFT_LANES; k++) {
            const float tolerance = WEFT_SOLVE_MISFIT * peak[k], used = weights[j].at[k];
            const float variance = s->at[j].variance[k] + tolerance * tolerance;
            const float over2 = used / (variance > 0 ? variance : 1.0F), over = sqrtf(over2);
            const float x = s->at[j].light[0][k], y = s->at[j].light[1][k], z = s->at[j].light[2][k];
            inverse[j].at[k] = over2;
            lights[j].light.x[k] = used > 0 ? x : 0.0F;
            lights[j].light.y[k] = used > 0 ? y : 0.0F;
            lights[j].light.z[k] = used > 0 ? z : 0.0F;
            lights[j].grey[k] = s->at[j].grey[k];
            lights[j].scaled.x[k] = used > 0 ? over * x : 0.0F;
            lights[j].scaled.y[k] = used > 0 ? over * y : 0.0F;
            lights[j].scaled.z[k] = used > 0 ? over * z : 0.0F;
            lights[j].scaled_grey[k] = over * s->at[j].grey[k];
            lights[j].over[k] = over;
        }
}

/* Samples within three sigma of the best candidate; all that were not dark where there is none, or where
 * they would not determine a normal. */
WEFT_INLINE void keep_agreeing(const weft_solve_samples *s, const weft_lane_weights *inverse,
                               const weft_triple_best *best, const weft_lane_weights *lit,
                               weft_lane_weights *kept)
{
    for (int j = 0; j < s->n_lights; j++)
#pragma omp simd
        for (int k = 0; k < WEFT_LANES; k++) {
            const float d = s->at[j].grey[k] - (best->normal.x[k] * s->at[j].light[0][k] +
                                                best->normal.y[k] * s->at[j].light[1][k] +
                                                best->normal.z[k] * s->at[j].light[2][k]);
            const int agrees = (d * d * inverse[j].at[k] < WEFT_TRIPLE_CUT2) & (lit[j].at[k] > 0);
            kept[j].at[k] = best->cost[k] < WEFT_TRIPLE_NONE ? (agrees ? 1.0F : 0.0F) : lit[j].at[k];
        }
}

static WEFT_CLONES void search_robust(const weft_solve_samples *restrict samples,
                                      weft_solve_answers *restrict answers)
{
    _Alignas(64) weft_lane_weights lit[WEFT_LIGHTS_MAX], inverse[WEFT_LIGHTS_MAX], kept[WEFT_LIGHTS_MAX];
    _Alignas(64) weft_triple_light lights[WEFT_LIGHTS_MAX];
    float peak[WEFT_LANES], dropped[WEFT_LANES], mark[WEFT_LANES];
    weft_triple_best best;
    weft_lane_sums t;
    weft_lane_normals scaled;
    weft_lane_misfits m;
    weft_lane_peak(samples, peak);
    weft_lane_leave_shadows(samples, lit, dropped);
    weigh(samples, lit, peak, inverse, lights);
    weft_triples_search(lights, samples->n_lights, &best);
    for (int k = 0; k < WEFT_LANES; k++) {
        mark[k] = 1;
        answers->search[k] = 0;
    }
    keep_agreeing(samples, inverse, &best, lit, kept);
    solve_weighted(samples, WEFT_SOLVE_MISFIT, kept, &t, &scaled, answers);
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
