/* Least squares over every usable sample, 16 pixels at a time. */
#include "host/solve/normal_equations.h"

static WEFT_CLONES void solve_lsq(const weft_solve_samples *restrict samples,
                                  weft_solve_answers *restrict answers)
{
    weft_lane_sums t;
    weft_lane_normals scaled;
    weft_lane_misfits m;
    weft_sums_add_up(samples, NULL, &t);
#pragma omp simd
    for (int k = 0; k < WEFT_LANES; k++)
        weft_lane_solve(&t, k, &scaled, answers);
    weft_lane_albedos(samples, NULL, &t, &scaled, answers);
    weft_lane_measure(samples, NULL, &scaled, &m);
#pragma omp simd
    for (int k = 0; k < WEFT_LANES; k++) {
        weft_lane_judge(&t, &scaled, &m, k, answers);
        answers->quality[k] =
            weft_lane_quality(samples, &scaled, k) |
            (weft_lane_contradicts(&t, &m, k) > 0 ? (uint32_t)WEFT_QUALITY_NOT_LAMBERTIAN : 0U);
        answers->search[k] = 0;
    }
}

const weft_solve_method weft_method_lsq = {
    .name = "lsq", .summary = "least squares over every usable sample", .solve = solve_lsq};
