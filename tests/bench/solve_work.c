#include "tests/bench/solve_work.h"

#include "core/mem.h"
#include "core/parallel.h"
#include "host/solve/seams.h"
#include "host/solve/site_demosaic.h"
#include "tests/host/dome.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static const double pi = 3.14159265358979323846;

/* How a run goes. */
typedef struct run {
    work *w;
    weft_solve_plan plan;
} run;

double work_now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ---- a matte cloth under n lights ---- */

/* Lights beyond the dome's ten: a spiral over it. */
static void add_lights(weft_calibration *cal, int n)
{
    for (int j = 10; j < n; j++) {
        weft_light *const l = &cal->lights[j];
        const double up = (30 + 50.0 * (j - 10) / (n - 10)) * pi / 180, around = 2.4 * j;
        *l = cal->lights[j % 10];
        l->position = (weft_vec3){300 * cos(up) * cos(around), 300 * cos(up) * sin(around), 300 * sin(up)};
        l->axis = weft_normalise(weft_scale(l->position, -1));
    }
    cal->n_lights = n;
}

/* Waves with slopes to 22 degrees and one part in 200 of noise, so that nothing is a constant. */
static void fill_row(work *w, int v)
{
    for (int u = 0; u < w->width; u++) {
        double point[3];
        const double s = w->cal.camera.width / 154.0;
        point[0] = (u - 0.5 * w->width) / s;
        point[1] = (0.5 * w->height - v) / s;
        point[2] = 0;
        const double p = 0.28 * sin(3.9 * point[0]), q = 0.28 * cos(3.9 * point[1]);
        const double length = sqrt(p * p + q * q + 1), n[3] = {-p / length, -q / length, 1 / length};
        for (int j = 0; j < w->n; j++) {
            const double wobble = 1 + 0.005 * sin(12.9898 * u + 78.233 * v + 37.719 * j);
            w->in[j][(size_t)v * (size_t)w->width + (size_t)u] =
                (float)(wobble * dome_radiance(&w->cal.lights[j], 1, point, n, 0.5));
        }
    }
}

static void fill_rows(void *context, int band, int row_begin, int row_end)
{
    (void)band;
    for (int v = row_begin; v < row_end; v++)
        fill_row(context, v);
}

void work_init(work *w, int width, int height, int n)
{
    const size_t pixels = (size_t)width * (size_t)height;
    *w = (work){.width = width, .height = height, .n = n};
    dome_init(&w->cal, width, height);
    w->cal.camera.rotation = (weft_mat3){{1, 0, 0, 0, -1, 0, 0, 0, -1}};
    w->cal.camera.translation = (weft_vec3){0, 0, 600};
    memset(w->cal.camera.distortion, 0, sizeof w->cal.camera.distortion);
    w->cal.camera.cx = 0.5 * width;
    w->cal.camera.cy = 0.5 * height;
    if (n > 10)
        add_lights(&w->cal, n);
    w->cal.n_lights = n;
    for (int j = 0; j < n; j++) {
        memset(w->cal.lights[j].intensity, 0, sizeof w->cal.lights[j].intensity);
        for (int c = 0; c < 3; c++)
            w->cal.lights[j].intensity[c] = 1;
        w->in[j] = weft_alloc(pixels, sizeof(float), NULL);
        w->clipped[j] = weft_alloc(pixels, 1, NULL);
    }
    w->out[0] = weft_alloc(WORK_OUTPUTS * pixels, sizeof(float), NULL);
    w->sites = weft_alloc(pixels, sizeof(float), NULL);
    for (int i = 1; i < WORK_OUTPUTS; i++)
        w->out[i] = w->out[0] + (size_t)i * pixels;
    for (int i = 0; i < 3; i++)
        w->bytes[i] = weft_alloc(pixels, 1, NULL);
    weft_parallel_rows(height, fill_rows, w);
    if (weft_incidence_init(&w->incidence, &w->cal, width, height, (weft_pixel_scale){1, 0}, 0, NULL) !=
        WEFT_OK)
        exit(1);
}

void work_fini(work *w)
{
    for (int j = 0; j < w->n; j++) {
        weft_free(w->in[j]);
        weft_free(w->clipped[j]);
    }
    weft_free(w->out[0]);
    weft_free(w->sites);
    for (int i = 0; i < 3; i++)
        weft_free(w->bytes[i]);
    weft_incidence_fini(&w->incidence);
    weft_calibration_fini(&w->cal);
}

/* ---- what is timed ---- */

static void solve_rows(void *context, int band, int row_begin, int row_end)
{
    const run *const r = context;
    work *const w = r->w;
    (void)band;
    for (int v = row_begin; v < row_end; v++) {
        const size_t at = (size_t)v * (size_t)w->width;
        weft_solve_row_in in[WEFT_LIGHTS_MAX];
        for (int j = 0; j < w->n; j++)
            in[j] = (weft_solve_row_in){.rgb = {w->in[j] + at, w->in[j] + at, w->in[j] + at},
                                        .clipped = w->clipped[j] + at,
                                        .least = 1e-4F,
                                        .most = 1e6F,
                                        .read = 1e-8F,
                                        .shot = 1e-6F};
        const weft_solve_row_out out = {.normal = {w->out[0] + at, w->out[1] + at, w->out[2] + at},
                                        .albedo = {w->out[3] + at, w->out[4] + at, w->out[5] + at},
                                        .residual = w->out[6] + at,
                                        .confidence = w->out[7] + at,
                                        .angle = w->out[8] + at,
                                        .lights = w->bytes[0] + at,
                                        .quality = w->bytes[1] + at,
                                        .valid = w->bytes[2] + at};
        weft_solve_row(&r->plan, v, in, &out);
    }
}

double work_solve_ns(work *w, const weft_solve_method *method, const weft_gloss *gloss, bool search_all)
{
    run r = {w,
             {.incidence = &w->incidence,
              .method = method,
              .width = w->width,
              .cfa = WEFT_CFA_RGGB,
              .gloss = gloss,
              .search_all = search_all}};
    const double begin = work_now_s();
    weft_parallel_rows(w->height, solve_rows, &r);
    return (work_now_s() - begin) * 1e9 / ((double)w->width * w->height);
}

static float sink[4096];

/* The same planes read (summed, so that nothing can be left out) and written, band by band. */
static void move_rows(void *context, int band, int row_begin, int row_end)
{
    const run *const r = context;
    work *const w = r->w;
    float sum[16] = {0};
    for (int v = row_begin; v < row_end; v++) {
        const size_t at = (size_t)v * (size_t)w->width;
        for (int j = 0; j < w->n; j++) {
            for (int u = 0; u + 16 <= w->width; u += 16)
                for (int k = 0; k < 16; k++)
                    sum[k] += w->in[j][at + (size_t)(u + k)];
            for (int u = 0; u + 64 <= w->width; u += 64) {
                uint64_t words[8];
                memcpy(words, w->clipped[j] + at + u, 64);
                sum[0] += (float)(words[0] | words[1] | words[2] | words[3] | words[4] | words[5] | words[6] |
                                  words[7]);
            }
        }
        for (int i = 0; i < WORK_OUTPUTS; i++)
            memset(w->out[i] + at, v & 63, (size_t)w->width * sizeof(float));
        for (int i = 0; i < 3; i++)
            memset(w->bytes[i] + at, v, (size_t)w->width);
    }
    for (int k = 0; k < 16; k++)
        sink[band % 4096] += sum[k];
}

double work_move_ns(work *w)
{
    run r = {.w = w};
    const double begin = work_now_s();
    weft_parallel_rows(w->height, move_rows, &r);
    return (work_now_s() - begin) * 1e9 / ((double)w->width * w->height);
}

double work_demosaic_ns(work *w)
{
    const size_t pixels = (size_t)w->width * (size_t)w->height;
    weft_image mosaic = {w->width, w->height, 1, w->sites}, rgb = {w->width, w->height, 3, w->out[3]};
    const double begin = work_now_s();
    memcpy(mosaic.data, rgb.data, pixels * sizeof(float));
    weft_site_demosaic_into(&mosaic, WEFT_CFA_RGGB, &rgb, NULL, NULL);
    return (work_now_s() - begin) * 1e9 / (double)pixels;
}

double work_seams_ns(work *w)
{
    const size_t pixels = (size_t)w->width * (size_t)w->height;
    weft_maps maps = {.width = w->width,
                      .height = w->height,
                      .normal = {w->width, w->height, 3, w->out[0]},
                      .albedo = {w->width, w->height, 3, w->out[3]},
                      .uncertainty = {w->width, w->height, 1, w->out[8]},
                      .mask = {w->width, w->height, w->bytes[2]}};
    const double begin = work_now_s();
    weft_seams_doubt(&maps);
    return (work_now_s() - begin) * 1e9 / (double)pixels;
}

void work_take_less(double *least, double value)
{
    *least = isnan(*least) || value < *least ? value : *least;
}
