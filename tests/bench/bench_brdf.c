/*
 * Evaluations of each reflectance model a second on one core, against moving the same bytes through memory.
 *
 * The directions and parameters of a run (128) stay in the cache, as in the preview; the baseline is memcpy
 * of as many bytes as the model reads and writes, from arrays far larger than the caches; and beside it one
 * pass over the same run that only normalises half vectors and takes their cosine.
 */
#include "core/clones.h"
#include "core/mem.h"
#include "shading/brdf/brdf.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

enum { RUN = 128, REPEAT = 20000, ROUNDS = 5 };
#define COPY_BYTES ((size_t)256 << 20)

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Bytes moved a second: what is read and what is written both count. */
static double copy_rate(void)
{
    char *const from = weft_alloc(COPY_BYTES, 1, NULL), *const to = weft_alloc(COPY_BYTES, 1, NULL);
    double best = 0;
    for (int i = 0; from && to && i < ROUNDS; i++) {
        memset(from, i, COPY_BYTES);
        const double begin = now_s();
        memcpy(to, from, COPY_BYTES);
        const double rate = 2 * (double)COPY_BYTES / (now_s() - begin);
        best = to[i] == i && rate > best ? rate : best;
    }
    weft_free(from);
    weft_free(to);
    return best;
}

/* The baseline of all shading: half vectors of the same arrays made unit, and their cosine to the normal. */
WEFT_CLONES
static void normalise_and_dot(double light[3][RUN], double view[3][RUN], double cosine[RUN])
{
    WEFT_INDEPENDENT
    for (int i = 0; i < RUN; i++) {
        const double x = light[0][i] + view[0][i], y = light[1][i] + view[1][i], z = light[2][i] + view[2][i];
        cosine[i] = z / sqrt(x * x + y * y + z * z);
    }
}

static double baseline_rate(void)
{
    static double light[3][RUN], view[3][RUN], cosine[RUN];
    double best = 0, sum = 0;
    for (int i = 0; i < RUN; i++) {
        light[2][i] = 1;
        view[0][i] = 0.6;
        view[2][i] = 0.8;
    }
    for (int round = 0; round < ROUNDS; round++) {
        const double begin = now_s();
        for (int i = 0; i < 10 * REPEAT; i++) {
            light[0][i % RUN] += 1e-9;
            normalise_and_dot(light, view, cosine);
            sum += cosine[i % RUN];
        }
        const double rate = 10.0 * RUN * REPEAT / (now_s() - begin);
        best = rate > best ? rate : best;
    }
    return sum > 0 ? best : 0;
}

static double evaluation_rate(const weft_brdf *brdf)
{
    static double light[3][RUN], view[3][RUN], params[WEFT_BRDF_MAX_PLANES][RUN], value[3][RUN];
    weft_brdf_batch batch = {
        .n = RUN, .light = {light[0], light[1], light[2]}, .view = {view[0], view[1], view[2]}};
    double *const out[3] = {value[0], value[1], value[2]};
    double defaults[WEFT_BRDF_MAX_PLANES], best = 0;
    weft_brdf_defaults(brdf, defaults);
    for (int i = 0; i < RUN; i++) {
        double l[3], v[3];
        weft_brdf_direction(0.1 + 0.9 * i / RUN, 0.3 * i, l);
        weft_brdf_direction(1 - 0.9 * i / RUN, 0.7 * i, v);
        for (int c = 0; c < 3; c++) {
            light[c][i] = l[c];
            view[c][i] = v[c];
        }
        for (int k = 0; k < weft_brdf_n_planes(brdf); k++)
            params[k][i] = defaults[k];
    }
    for (int k = 0; k < weft_brdf_n_planes(brdf); k++)
        batch.param[k] = params[k];
    for (int round = 0; round < ROUNDS; round++) {
        const double begin = now_s();
        for (int i = 0; i < REPEAT; i++)
            brdf->eval(&batch, out);
        const double rate = (double)RUN * REPEAT / (now_s() - begin);
        best = rate > best ? rate : best;
    }
    return best;
}

int main(void)
{
    const double copied = copy_rate(), baseline = baseline_rate();
    printf("memcpy: %.1f GB/s read and written\n", copied * 1e-9);
    printf("normalise and dot: %.2f ns each\n", 1e9 / baseline);
    printf("%-20s %10s %8s %14s %s\n", "model", "million/s", "ns each", "of normalise",
           "of memcpy of the same bytes");
    for (const weft_brdf *const *b = weft_brdfs; *b; b++) {
        const double rate = evaluation_rate(*b), bytes = 8.0 * (6 + weft_brdf_n_planes(*b) + 3);
        printf("%-20s %10.1f %8.2f %14.1f %.2f\n", (*b)->name, rate * 1e-6, 1e9 / rate, baseline / rate,
               copied / bytes / rate);
    }
    return 0;
}
