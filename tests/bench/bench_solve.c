/*
 * Nanoseconds per pixel of the solver with ten near lights on one core, against
 *   - reading the same bytes from memory once and writing the results (what it could not beat), and
 *   - LAPACKE_dgelsd in double on the same systems, pixel by pixel (the singular value decomposition that
 *     the paper asks for).
 * Everything is measured in turn in the same process, minimum of the rounds.
 */
#include "core/mem.h"
#include "host/solve/solve_row.h"
#include "tests/host/dome.h"

#include <lapacke.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

enum { WIDTH = 1232, HEIGHT = 816, N = 10, ROUNDS = 7, LAPACK_PIXELS = 20000 };

typedef struct work {
    weft_calibration cal;
    weft_incidence incidence;
    float *in[N][3]; /* [HEIGHT][WIDTH]; a mosaic uses [0] alone */
    uint8_t *clipped[N];
    float *out[9];
    uint8_t *valid, *lights, *quality;
} work;

static work w;

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static float *plane(void)
{
    return weft_alloc((size_t)WIDTH * HEIGHT, sizeof(float), NULL);
}

static void make_work(void)
{
    dome_init(&w.cal, WIDTH, HEIGHT);
    for (int j = 0; j < N; j++) {
        w.clipped[j] = weft_alloc((size_t)WIDTH * HEIGHT, 1, NULL);
        for (int c = 0; c < 3; c++) {
            w.in[j][c] = plane();
            for (int i = 0; i < WIDTH * HEIGHT; i++)
                w.in[j][c][i] = (float)(3 + sin(0.01 * i + j + c));
        }
    }
    for (int i = 0; i < 9; i++)
        w.out[i] = plane();
    w.valid = weft_alloc((size_t)WIDTH * HEIGHT, 1, NULL);
    w.lights = weft_alloc((size_t)WIDTH * HEIGHT, 1, NULL);
    w.quality = weft_alloc((size_t)WIDTH * HEIGHT, 1, NULL);
}

static double solve_ns(weft_cfa cfa)
{
    const weft_solve_plan plan = {&w.incidence, &weft_method_lsq, WIDTH, cfa, 0, NULL, false};
    const double begin = now_s();
    for (int v = 0; v < HEIGHT; v++) {
        const size_t at = (size_t)v * WIDTH;
        weft_solve_row_in in[N];
        for (int j = 0; j < N; j++)
            for (int c = 0; c < 3; c++)
                in[j] = (weft_solve_row_in){
                    {w.in[j][0] + at, w.in[j][cfa ? 0 : 1] + at, w.in[j][cfa ? 0 : 2] + at},
                    w.clipped[j] + at,
                    0.01F,
                    1e6F,
                    1e-6F,
                    1e-4F};
        const weft_solve_row_out out = {.normal = {w.out[0] + at, w.out[1] + at, w.out[2] + at},
                                        .albedo = {w.out[3] + at, w.out[4] + at, w.out[5] + at},
                                        .residual = w.out[6] + at,
                                        .confidence = w.out[7] + at,
                                        .angle = w.out[8] + at,
                                        .lights = w.lights + at,
                                        .quality = w.quality + at,
                                        .valid = w.valid + at};
        weft_solve_row(&plan, v, in, &out);
    }
    return (now_s() - begin) * 1e9 / (WIDTH * HEIGHT);
}

/* The same planes, read (summed, so that nothing can be left out) and written. */
static double memory_ns(int channels)
{
    static volatile float sink;
    float sum[16] = {0};
    const double begin = now_s();
    for (int v = 0; v < HEIGHT; v++) {
        const size_t at = (size_t)v * WIDTH;
        for (int j = 0; j < N; j++) {
            for (int c = 0; c < channels; c++)
                for (int u = 0; u + 16 <= WIDTH; u += 16)
                    for (int k = 0; k < 16; k++)
                        sum[k] += w.in[j][c][at + (size_t)(u + k)];
            for (int u = 0; u + 64 <= WIDTH; u += 64) {
                uint64_t bytes[8];
                memcpy(bytes, w.clipped[j] + at + u, 64);
                sum[0] += (float)(bytes[0] | bytes[3] | bytes[7]);
            }
        }
        for (int i = 0; i < 5 + channels; i++)
            memset(w.out[i] + at, v & 63, WIDTH * sizeof(float));
        memset(w.valid + at, 255, WIDTH);
    }
    for (int k = 0; k < 16; k++)
        sink = sum[k];
    (void)sink;
    return (now_s() - begin) * 1e9 / (WIDTH * HEIGHT);
}

static double lapack_ns(void)
{
    double rows[N * 3];
    for (int j = 0; j < N; j++) {
        const weft_vec3 l = weft_normalise(w.cal.lights[j].position);
        const double v[3] = {l.x, l.y, l.z};
        memcpy(rows + 3 * j, v, sizeof v);
    }
    const double begin = now_s();
    for (int i = 0; i < LAPACK_PIXELS; i++) {
        double a[N * 3], b[N], singular[3];
        int rank;
        memcpy(a, rows, sizeof a);
        for (int j = 0; j < N; j++)
            b[j] = (double)w.in[j][1][i];
        if (LAPACKE_dgelsd(LAPACK_ROW_MAJOR, N, 3, 1, a, 3, b, 1, singular, 0, &rank) != 0)
            return NAN;
    }
    return (now_s() - begin) * 1e9 / LAPACK_PIXELS;
}

int main(void)
{
    double sites = INFINITY, rgb = INFINITY, move_sites = INFINITY, move_rgb = INFINITY, lapack = INFINITY;
    make_work();
    if (weft_incidence_init(&w.incidence, &w.cal, WIDTH, HEIGHT, (weft_pixel_scale){1, 0}, 0, NULL) !=
        WEFT_OK)
        return 1;
    for (int round = 0; round < ROUNDS; round++) {
        sites = fmin(sites, solve_ns(WEFT_CFA_RGGB));
        move_sites = fmin(move_sites, memory_ns(1));
        rgb = fmin(rgb, solve_ns(WEFT_CFA_NONE));
        move_rgb = fmin(move_rgb, memory_ns(3));
        lapack = fmin(lapack, lapack_ns());
    }
    printf("%-34s %8s %10s %10s %8s\n", "ten near lights, one core", "ns/px", "bytes ns", "ratio", "dgelsd");
    printf("%-34s %8.1f %10.1f %10.2f %7.0fx\n", "lsq, mosaic site by site", sites, move_sites,
           sites / move_sites, lapack / sites);
    printf("%-34s %8.1f %10.1f %10.2f %7.0fx\n", "lsq, RGB pictures", rgb, move_rgb, rgb / move_rgb,
           lapack / rgb);
    printf("%-34s %8.1f\n", "LAPACKE_dgelsd, grey alone", lapack);
    return 0;
}
