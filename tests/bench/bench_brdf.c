/*
 * Nanoseconds a shaded sample on one core, for each reflectance model in single precision (what pictures are
 * made with) and in double (the reference).
 *
 * Baseline: one pass over the same arrays that makes half vectors unit and takes their cosine to the normal,
 * in the same precision.  The directions and parameters of a run (128) stay in the cache, as in the preview;
 * beside it stands memcpy of as many bytes as the model reads and writes, from arrays far larger than the
 * caches.
 */
#include "core/clones.h"
#include "core/mem.h"
#include "core/progress.h"
#include "shading/brdf/brdf.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { RUN = 128, REPEAT = 5000, ROUNDS = 9 };
#define COPY_BYTES ((size_t)64 << 20)

/* Bytes moved a second: what is read and what is written both count. */
static double copy_rate(void)
{
    char *const from = weft_alloc(COPY_BYTES, 1, NULL), *const to = weft_alloc(COPY_BYTES, 1, NULL);
    double best = 0;
    for (int i = 0; from && to && i < ROUNDS; i++) {
        memset(from, i, COPY_BYTES);
        const double begin = weft_clock_s();
        memcpy(to, from, COPY_BYTES);
        const double rate = 2 * (double)COPY_BYTES / (weft_clock_s() - begin);
        best = to[i] == i && rate > best ? rate : best;
    }
    weft_free(from);
    weft_free(to);
    return best;
}

/* One run in both precisions. */
static double light[3][RUN], view[3][RUN], params[WEFT_BRDF_MAX_PLANES][RUN], value[3][RUN];
static float light_f32[3][RUN], view_f32[3][RUN], params_f32[WEFT_BRDF_MAX_PLANES][RUN], value_f32[3][RUN];

static void set_directions(void)
{
    for (int i = 0; i < RUN; i++) {
        double l[3], v[3];
        weft_brdf_direction(0.1 + 0.9 * i / RUN, 0.3 * i, l);
        weft_brdf_direction(1 - 0.9 * i / RUN, 0.7 * i, v);
        for (int c = 0; c < 3; c++) {
            light_f32[c][i] = (float)(light[c][i] = l[c]);
            view_f32[c][i] = (float)(view[c][i] = v[c]);
        }
    }
}

WEFT_CLONES
static void normalise_and_dot(void)
{
    WEFT_INDEPENDENT
    for (int i = 0; i < RUN; i++) {
        const double x = light[0][i] + view[0][i], y = light[1][i] + view[1][i], z = light[2][i] + view[2][i];
        value[0][i] = z / sqrt(x * x + y * y + z * z);
    }
}

WEFT_CLONES
static void normalise_and_dot_f32(void)
{
    WEFT_INDEPENDENT
    for (int i = 0; i < RUN; i++) {
        const float x = light_f32[0][i] + view_f32[0][i], y = light_f32[1][i] + view_f32[1][i];
        const float z = light_f32[2][i] + view_f32[2][i];
        value_f32[0][i] = z / sqrtf(x * x + y * y + z * z);
    }
}

static void pass(const weft_brdf *brdf, int precise)
{
    weft_brdf_batch batch = {
        .n = RUN, .light = {light[0], light[1], light[2]}, .view = {view[0], view[1], view[2]}};
    weft_brdf_batch_f32 batch_f32 = {.n = RUN,
                                     .light = {light_f32[0], light_f32[1], light_f32[2]},
                                     .view = {view_f32[0], view_f32[1], view_f32[2]}};
    double *const out[3] = {value[0], value[1], value[2]};
    float *const out_f32[3] = {value_f32[0], value_f32[1], value_f32[2]};
    for (int k = 0; k < WEFT_BRDF_MAX_PLANES; k++) {
        batch.param[k] = params[k];
        batch_f32.param[k] = params_f32[k];
    }
    for (int i = 0; i < REPEAT; i++)
        if (!brdf && precise)
            normalise_and_dot();
        else if (!brdf)
            normalise_and_dot_f32();
        else if (precise)
            brdf->eval(&batch, out);
        else
            brdf->eval_f32(&batch_f32, out_f32);
}

/* Seconds a sample, the quickest of the rounds; no model: the baseline. */
static double cost_of(const weft_brdf *brdf, int precise)
{
    double defaults[WEFT_BRDF_MAX_PLANES] = {0}, best = 1;
    if (brdf)
        weft_brdf_defaults(brdf, defaults);
    for (int k = 0; k < WEFT_BRDF_MAX_PLANES; k++)
        for (int i = 0; i < RUN; i++)
            params_f32[k][i] = (float)(params[k][i] = defaults[k]);
    for (int round = 0; round < ROUNDS; round++) {
        const double begin = weft_clock_s();
        pass(brdf, precise);
        const double cost = (weft_clock_s() - begin) / ((double)RUN * REPEAT);
        best = cost < best ? cost : best;
    }
    return best;
}

int main(void)
{
    set_directions();
    const double copied = copy_rate(), base_f32 = cost_of(NULL, 0), base = cost_of(NULL, 1);
    printf("memcpy: %.1f GB/s read and written\n", copied * 1e-9);
    printf("normalise and dot: %.2f ns a sample in single precision, %.2f ns in double\n", base_f32 * 1e9,
           base * 1e9);
    printf("%-21s %6s %13s %17s %10s %13s\n", "model", "ns", "of normalise", "of memcpy, same", "ns double",
           "of normalise");
    for (const weft_brdf *const *b = weft_brdfs; *b; b++) {
        const double single = cost_of(*b, 0), precise = cost_of(*b, 1);
        const double bytes = 4.0 * (6 + weft_brdf_n_planes(*b) + 3);
        printf("%-21s %6.2f %13.1f %17.2f %10.2f %13.1f\n", (*b)->name, single * 1e9, single / base_f32,
               single * copied / bytes, precise * 1e9, precise / base);
    }
    return 0;
}
