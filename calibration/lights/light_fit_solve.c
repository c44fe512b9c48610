#include "calibration/lights/light_fit_internal.h"
#include "core/clones.h"
#include "core/mem.h"

#include <assert.h>
#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TUKEY        4.685 /* 95 % efficient on Gaussian noise */
#define LM_STEPS     60
#define MEDIAN_CELLS 2000 /* enough for a median */
#define GATHERED     8
#define COARSE_CELLS 700
#define MANY_LIGHTS  24 /* with more, only every so manieth cell goes into the equations */
/* How a sheet may lie, when that is left open: wide enough to weigh nothing against the data. */
#define TILT_SIGMA 0.2 /* slope */
#define BOW_SIGMA  10  /* mm over the field's radius */

/* One run of the normal equations: n unknowns, the lamps of the scope one after the other, the shared last.
 */
typedef struct normal {
    fit_scope scope;
    int n, step;    /* unknowns; every step-th cell */
    double *h;      /* [n][n] lower triangle */
    double *factor; /* [n][n] damped copy, its Cholesky factor, or its inverse */
    double *g;      /* [n] minus the gradient */
    double *move;   /* [n] */
    double *sum;    /* [n] of one cell and channel: weight times derivative over the lights */
    double *sums;   /* [GATHERED][n] of the cells that gather, over the roots of their weights */
    int n_sums;
    double *by_lamp;  /* [scope.n][FIT_GEOMETRY] of one cell */
    double *by_shape; /* [scope.n][FIT_SHAPE] */
    double *aim;      /* [scope.n] mm: how far from the middle a lamp may point */
    float *robust;    /* [scope.n][3][cells] Tukey's weight times the cell's over the variance */
    float *scratch;   /* [cells] */
} normal;

static void normal_fini(normal *q)
{
    weft_free(q->h);
    weft_free(q->factor);
    weft_free(q->g);
    weft_free(q->move);
    weft_free(q->sum);
    weft_free(q->sums);
    weft_free(q->by_lamp);
    weft_free(q->by_shape);
    weft_free(q->aim);
    weft_free(q->robust);
    weft_free(q->scratch);
}

/* Every so manieth cell is enough for all runs but the last. */
static int thinned(const fit_problem *f)
{
    return f->n_cells > COARSE_CELLS ? f->n_cells / COARSE_CELLS : 1;
}

static weft_err normal_init(normal *q, const fit_problem *f, fit_scope scope, weft_error *err)
{
    *q = (normal){.scope = scope, .n = scope.n * FIT_LAMP + FIT_SHARED};
    q->step = (scope.n + MANY_LIGHTS - 1) / MANY_LIGHTS;
    const size_t n = (size_t)q->n, cells = (size_t)f->n_cells, lamps = (size_t)scope.n;
    if (!(q->h = weft_alloc(n * n, sizeof(double), err)) ||
        !(q->factor = weft_alloc(n * n, sizeof(double), err)) ||
        !(q->g = weft_alloc(n, sizeof(double), err)) || !(q->move = weft_alloc(n, sizeof(double), err)) ||
        !(q->sum = weft_alloc(n, sizeof(double), err)) ||
        !(q->sums = weft_alloc(GATHERED * n, sizeof(double), err)) ||
        !(q->by_lamp = weft_alloc(lamps * FIT_GEOMETRY, sizeof(double), err)) ||
        !(q->by_shape = weft_alloc(lamps * FIT_SHAPE, sizeof(double), err)) ||
        !(q->aim = weft_alloc(lamps, sizeof(double), err)) ||
        !(q->robust = weft_alloc(cells * 3 * lamps, sizeof(float), err)) ||
        !(q->scratch = weft_alloc(cells, sizeof(float), err)))
        return WEFT_ERR_NOMEM;
    return WEFT_OK;
}

static float *robust_of(const normal *q, const fit_problem *f, int l, int channel)
{
    return q->robust + (size_t)(3 * l + channel) * (size_t)f->n_cells;
}

/* ---- weights ---- */

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Robust standard deviation of the weighted residuals of a light and channel, by the median. */
static double noise_of(const fit_problem *f, normal *q, int light, int channel)
{
    const float *const w = f->weight + fit_plane(f, light, channel);
    const int step = f->n_cells / MEDIAN_CELLS + 1;
    int n = 0;
    for (int i = 0; i < f->n_cells; i += step)
        if (w[i] > 0) {
            const double r = fabs(fit_residual(f, light, channel, i)) * sqrt((double)w[i]);
            q->scratch[n++] = (float)fmin(r, 1e6);
        }
    if (n == 0)
        return 1;
    qsort(q->scratch, (size_t)n, sizeof *q->scratch, compare_floats);
    /* The mean over the lights has been taken out of the residuals, and a share of their noise with it. */
    const double share = q->scope.common_free ? sqrt((double)q->scope.n / (q->scope.n - 1)) : 1;
    return fmax(1.4826 * share * (double)q->scratch[n / 2], 1e-7);
}

static void weigh(fit_problem *f, normal *q)
{
    for (int l = 0; l < q->scope.n; l++)
        for (int c = 0; c < 3; c++) {
            const int light = q->scope.first + l;
            const double noise = noise_of(f, q, light, c);
            f->noise[light][c] = noise;
            const double variance = noise * noise + f->model_variance;
            const float *const w = f->weight + fit_plane(f, light, c);
            float *const out = robust_of(q, f, l, c);
            for (int i = 0; i < f->n_cells; i++) {
                out[i] = 0;
                if (!(w[i] > 0))
                    continue;
                const double t = fit_residual(f, light, c, i) * sqrt((double)w[i]) / (TUKEY * noise);
                const double s = 1 - t * t;
                out[i] = (float)(t * t < 1 ? s * s * (double)w[i] / variance : 0);
            }
        }
}

/* S of every cell and channel: what the lights see in common. */
static void update_common(fit_problem *f, const normal *q)
{
    for (int i = 0; i < f->n_cells && q->scope.common_free; i++)
        for (int c = 0; c < 3; c++) {
            double sum = 0, weight = 0;
            for (int l = 0; l < q->scope.n; l++) {
                const double w = (double)robust_of(q, f, l, c)[i];
                if (w > 0) {
                    sum += w * fit_ratio(f, q->scope.first + l, c, i);
                    weight += w;
                }
            }
            if (weight > 0)
                f->common[(size_t)c * (size_t)f->n_cells + (size_t)i] = sum / weight;
        }
}

/* The S of the lamps as they are, all cells taken in: the former one may belong to another sheet. */
static void begin_common(fit_problem *f, const normal *q)
{
    const size_t cells = (size_t)f->n_cells;
    for (int l = 0; l < q->scope.n; l++)
        memcpy(robust_of(q, f, l, 0), f->weight + fit_plane(f, q->scope.first + l, 0),
               3 * cells * sizeof(float));
    update_common(f, q);
}

/* ---- the cost ---- */

static void set_aims(const fit_problem *f, normal *q)
{
    for (int l = 0; l < q->scope.n; l++) {
        const double *const p = f->lamps[q->scope.first + l].p;
        q->aim[l] = weft_length((weft_vec3){p[0], p[1], p[2]}) * f->options->aim_sigma_rad;
    }
}

/* Precision of the prior of a term of the sheet's shape. */
static double shape_precision(const fit_problem *f, const normal *q, int term)
{
    const double bow = q->scope.bow_free ? BOW_SIGMA : fmax(f->options->flatness_mm, 1e-6);
    const double sigma = term < FIT_TILT ? TILT_SIGMA * f->field_mm : bow;
    return 1 / (sigma * sigma);
}

static double guess_precision(const fit_problem *f)
{
    const double sigma = f->options->guess_sigma_mm;
    return f->options->n_guess && sigma > 0 ? 1 / (sigma * sigma) : 0;
}

static double prior_cost(const fit_problem *f, const normal *q)
{
    const double se = f->options->exponent_sigma, e0 = f->shared.e0;
    double cost = (e0 - 1) * (e0 - 1);
    for (int k = 0; k < FIT_SHAPE; k++)
        cost += f->shared.shape[k] * f->shared.shape[k] * shape_precision(f, q, k);
    for (int l = 0; l < q->scope.n; l++) {
        const fit_lamp *const lamp = &f->lamps[q->scope.first + l];
        cost += (lamp->e - e0) * (lamp->e - e0) / (se * se) +
                (lamp->m[0] * lamp->m[0] + lamp->m[1] * lamp->m[1]) / (q->aim[l] * q->aim[l]);
        for (int k = 0; k < 3; k++) {
            const double off = (&f->options->guess[q->scope.first + l].x)[k] - lamp->p[k];
            cost += guess_precision(f) * off * off;
        }
    }
    return cost;
}

/* The squares around what the lights have in common, or around the S that is given. */
static double cost_of(const fit_problem *f, const normal *q)
{
    double cost = prior_cost(f, q);
    for (int i = 0; i < f->n_cells; i += q->step) {
        double w1[3] = {0}, wr[3] = {0}, wrr[3] = {0};
        const fit_surface s = fit_surface_at(f, i);
        for (int l = 0; l < q->scope.n; l++) {
            const int light = q->scope.first + l;
            const double model = fit_lamp_log(&f->lamps[light], &s);
            for (int c = 0; c < 3; c++) {
                const double w = (double)robust_of(q, f, l, c)[i];
                if (!(w > 0))
                    continue;
                const double r = (double)f->y[fit_plane(f, light, c) + (size_t)i] -
                                 f->lamps[light].log_phi[c] - model -
                                 f->common[(size_t)c * (size_t)f->n_cells + (size_t)i];
                w1[c] += w;
                wr[c] += w * r;
                wrr[c] += w * r * r; /* NaN where the lamp cannot light the cell: such a step is refused */
            }
        }
        for (int c = 0; c < 3; c++)
            cost += q->scope.common_free && w1[c] > 0 ? wrr[c] - wr[c] * wr[c] / w1[c] : wrr[c];
    }
    return cost;
}

/* ---- the equations ---- */

/* One light and channel at a cell: its own block, and its part of the sums over the lights. */
static void add_own(normal *q, int l, int channel, double w, double r)
{
    const size_t n = (size_t)q->n, base = (size_t)l * FIT_LAMP, shape = n - FIT_SHAPE;
    const size_t phi = base + FIT_GEOMETRY + (size_t)channel;
    const double *const a = q->by_lamp + (size_t)l * FIT_GEOMETRY, *const b =
                                                                       q->by_shape + (size_t)l * FIT_SHAPE;
    for (size_t j = 0; j < FIT_GEOMETRY; j++) {
        for (size_t k = 0; k <= j; k++)
            q->h[(base + j) * n + base + k] += w * a[j] * a[k];
        q->h[phi * n + base + j] += w * a[j];
        q->g[base + j] += w * r * a[j];
        q->sum[base + j] = w * a[j];
    }
    q->h[phi * n + phi] += w;
    q->g[phi] += w * r;
    q->sum[phi] = w;
    for (size_t j = 0; j < FIT_SHAPE; j++) {
        double *const row = q->h + (shape + j) * n;
        for (size_t k = 0; k <= j; k++)
            row[shape + k] += w * b[j] * b[k];
        for (size_t k = 0; k < FIT_GEOMETRY; k++)
            row[base + k] += w * b[j] * a[k];
        row[phi] += w * b[j];
        q->g[shape + j] += w * r * b[j];
        q->sum[shape + j] += w * b[j];
    }
}

/* Takes the S of the cells that have gathered out of the equations (Schur's complement): minus the products
 * of their sums, each divided by the root of its weight.  Eight at a time, so that h is read and written once
 * for them: this is most of the fit's time. */
WEFT_CLONES static void flush_sums(normal *q)
{
    const int n = q->n;
    const double *const v = q->sums;
    for (int j = 0; j < n; j++) {
        const double a0 = v[j], a1 = v[n + j], a2 = v[2 * n + j], a3 = v[3 * n + j];
        const double a4 = v[4 * n + j], a5 = v[5 * n + j], a6 = v[6 * n + j], a7 = v[7 * n + j];
        double *const restrict row = q->h + (size_t)j * (size_t)n;
        for (int k = 0; k <= j; k++)
            row[k] -= (a0 * v[k] + a1 * v[n + k]) + (a2 * v[2 * n + k] + a3 * v[3 * n + k]) +
                      ((a4 * v[4 * n + k] + a5 * v[5 * n + k]) + (a6 * v[6 * n + k] + a7 * v[7 * n + k]));
    }
    memset(q->sums, 0, GATHERED * (size_t)n * sizeof *q->sums);
    q->n_sums = 0;
}

static void eliminate_common(normal *q, double weight, double residual)
{
    const double scale = 1 / sqrt(weight), part = residual / weight;
    double *const to = q->sums + (size_t)q->n_sums * (size_t)q->n;
    for (int j = 0; j < q->n; j++) {
        to[j] = scale * q->sum[j];
        q->g[j] -= part * q->sum[j];
    }
    if (++q->n_sums == GATHERED)
        flush_sums(q);
}

static void add_cell(const fit_problem *f, normal *q, int cell)
{
    double r[WEFT_LIGHTS_MAX] = {0};
    const fit_surface s = fit_surface_at(f, cell);
    for (int l = 0; l < q->scope.n; l++)
        r[l] = fit_lamp_gradient(f, &f->lamps[q->scope.first + l], cell, &s,
                                 q->by_lamp + (size_t)l * FIT_GEOMETRY, q->by_shape + (size_t)l * FIT_SHAPE);
    for (int c = 0; c < 3; c++) {
        double weight = 0, residual = 0;
        memset(q->sum, 0, (size_t)q->n * sizeof *q->sum);
        for (int l = 0; l < q->scope.n; l++) {
            const int light = q->scope.first + l;
            const double w = (double)robust_of(q, f, l, c)[cell];
            if (!(w > 0))
                continue;
            const double rest = (double)f->y[fit_plane(f, light, c) + (size_t)cell] -
                                f->lamps[light].log_phi[c] - r[l] -
                                f->common[(size_t)c * (size_t)f->n_cells + (size_t)cell];
            add_own(q, l, c, w, rest);
            weight += w;
            residual += w * rest;
        }
        if (q->scope.common_free && weight > 0)
            eliminate_common(q, weight, residual);
    }
}

static void add_diagonal(normal *q, int at, double precision, double residual)
{
    q->h[(size_t)at * (size_t)(q->n + 1)] += precision;
    q->g[at] += precision * residual;
}

static void hold(normal *q, int at)
{
    for (int k = 0; k < q->n; k++)
        q->h[k <= at ? (size_t)at * (size_t)q->n + (size_t)k : (size_t)k * (size_t)q->n + (size_t)at] = 0;
    q->h[(size_t)at * (size_t)(q->n + 1)] = 1; /* its step is 0 */
    q->g[at] = 0;
}

static void add_priors(const fit_problem *f, normal *q)
{
    const int e0 = q->scope.n * FIT_LAMP;
    const double precision = 1 / (f->options->exponent_sigma * f->options->exponent_sigma);
    for (int l = 0; l < q->scope.n; l++) {
        const fit_lamp *const lamp = &f->lamps[q->scope.first + l];
        const int e = l * FIT_LAMP + 3;
        add_diagonal(q, e, precision, f->shared.e0 - lamp->e);
        add_diagonal(q, e0, precision, lamp->e - f->shared.e0);
        q->h[(size_t)e0 * (size_t)q->n + (size_t)e] -= precision;
        for (int k = 0; k < 2; k++)
            add_diagonal(q, e + 1 + k, 1 / (q->aim[l] * q->aim[l]), -lamp->m[k]);
        for (int k = 0; k < 3; k++)
            add_diagonal(q, l * FIT_LAMP + k, guess_precision(f),
                         (&f->options->guess[q->scope.first + l].x)[k] - lamp->p[k]);
    }
    add_diagonal(q, e0, 1, 1 - f->shared.e0);
    for (int k = 0; k < FIT_SHAPE; k++)
        add_diagonal(q, e0 + 1 + k, shape_precision(f, q, k), -f->shared.shape[k]);
}

/* A free S and the Phi of all lights share a constant in each channel: the sum of their steps is kept at 0.
 */
static void keep_sum_of_phi(normal *q)
{
    const size_t n = (size_t)q->n;
    for (size_t c = 0; c < 3; c++) {
        const size_t first = FIT_GEOMETRY + c;
        const double stiff = q->h[first * (n + 1)] / q->scope.n;
        for (int l = 0; l < q->scope.n; l++)
            for (int m = 0; m <= l; m++)
                q->h[(first + (size_t)l * FIT_LAMP) * n + first + (size_t)m * FIT_LAMP] += stiff;
    }
}

static void build(const fit_problem *f, normal *q)
{
    const size_t n = (size_t)q->n;
    memset(q->h, 0, n * n * sizeof *q->h);
    memset(q->g, 0, n * sizeof *q->g);
    for (int i = 0; i < f->n_cells; i += q->step)
        add_cell(f, q, i);
    flush_sums(q);
    add_priors(f, q);
    if (q->scope.common_free)
        keep_sum_of_phi(q);
    else
        hold(q, q->n - FIT_SHARED);
    for (int k = 0; k < FIT_SHAPE; k++)
        if (k < FIT_TILT ? !q->scope.tilt_free : !q->scope.common_free)
            hold(q, q->n - FIT_SHAPE + k);
}

/* Solves the damped equations; false when they are singular. */
static bool solve_step(normal *q, double damping)
{
    const size_t n = (size_t)q->n;
    memcpy(q->factor, q->h, n * n * sizeof *q->h);
    memcpy(q->move, q->g, n * sizeof *q->g);
    for (size_t i = 0; i < n; i++)
        q->factor[i * n + i] *= 1 + damping;
    return LAPACKE_dpotrf(LAPACK_ROW_MAJOR, 'L', q->n, q->factor, q->n) == 0 &&
           LAPACKE_dpotrs(LAPACK_ROW_MAJOR, 'L', q->n, 1, q->factor, q->n, q->move, 1) == 0;
}

/* Takes the step; @return the largest move of a light, mm. */
static double take_step(fit_problem *f, const normal *q)
{
    double moved = 0;
    for (int l = 0; l < q->scope.n; l++) {
        double *const lamp = f->lamps[q->scope.first + l].p; /* the numbers lie one after the other */
        const double *const s = q->move + (size_t)l * FIT_LAMP;
        moved = fmax(moved, sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]));
        for (int k = 0; k < FIT_LAMP; k++)
            lamp[k] += s[k];
    }
    const double *const s = q->move + (size_t)q->scope.n * FIT_LAMP;
    f->shared.e0 += s[0];
    for (int k = 0; k < FIT_SHAPE; k++)
        f->shared.shape[k] += s[1 + k];
    return moved;
}

static void minimise(fit_problem *f, normal *q)
{
    double damping = 1e-5;
    fit_lamp lamps[WEFT_LIGHTS_MAX];
    set_aims(f, q);
    double cost = cost_of(f, q);
    for (int step = 0; step < LM_STEPS; step++) {
        build(f, q);
        for (;;) {
            memcpy(lamps, f->lamps, sizeof lamps);
            const fit_shared shared = f->shared;
            const double moved = solve_step(q, damping) ? take_step(f, q) : HUGE_VAL;
            const double now = isfinite(moved) ? cost_of(f, q) : HUGE_VAL;
            if (now <= cost) {
                const bool done = moved < 1e-3 || cost - now < 1e-7 * cost;
                cost = now;
                damping = fmax(damping / 10, 1e-12);
                if (done)
                    return;
                break;
            }
            memcpy(f->lamps, lamps, sizeof lamps);
            f->shared = shared;
            damping *= 10;
            if (moved < 1e-6 || damping > 1e12)
                return; /* as good as it gets */
        }
    }
}

/* Of what the middle of the plate gets: the gradient there against the covariance of the lamp. */
static double middle_sigma(const fit_problem *f, const normal *q, int l)
{
    double by[FIT_LAMP] = {0}, by_shape[FIT_SHAPE], sum = 0;
    const fit_surface middle = fit_surface_at(f, f->middle);
    (void)fit_lamp_gradient(f, &f->lamps[q->scope.first + l], f->middle, &middle, by, by_shape);
    by[FIT_GEOMETRY + 1] = 1;
    for (size_t j = 0; j < FIT_LAMP; j++)
        for (size_t k = 0; k < FIT_LAMP; k++) {
            const size_t row = (size_t)l * FIT_LAMP + (j > k ? j : k),
                         column = (size_t)l * FIT_LAMP + (j > k ? k : j);
            sum += by[j] * by[k] * q->factor[row * (size_t)q->n + column];
        }
    return sqrt(fmax(sum, 0) * q->step);
}

static weft_err find_sigmas(fit_problem *f, normal *q, weft_error *err)
{
    const size_t n = (size_t)q->n;
    set_aims(f, q);
    build(f, q);
    if (!solve_step(q, 0) || LAPACKE_dpotri(LAPACK_ROW_MAJOR, 'L', q->n, q->factor, q->n) != 0)
        return weft_fail(err, WEFT_ERR_NODATA,
                         "the sheet leaves the lights open: the equations are singular");
    for (int l = 0; l < q->scope.n; l++) {
        const int light = q->scope.first + l;
        double *const sigma = f->sigma[light].p, sum = 0;
        for (size_t k = 0; k < FIT_LAMP; k++) {
            const double variance = q->factor[((size_t)l * FIT_LAMP + k) * (n + 1)] * q->step;
            sigma[k] = sqrt(variance);
            sum += k < 3 ? variance : 0;
        }
        f->position_sigma[light] = sqrt(sum);
        f->irradiance_sigma[light] = middle_sigma(f, q, l);
    }
    const size_t e0 = (size_t)q->scope.n * FIT_LAMP;
    f->shared_sigma.e0 = sqrt(q->factor[e0 * (n + 1)] * q->step);
    for (size_t k = 0; k < FIT_SHAPE; k++)
        f->shared_sigma.shape[k] = sqrt(q->factor[(e0 + 1 + k) * (n + 1)] * q->step);
    return WEFT_OK;
}

weft_err fit_solve(fit_problem *f, fit_scope scope, weft_error *err)
{
    normal q;
    assert(scope.first >= 0 && scope.first + scope.n <= f->n_lights);
    weft_err status = normal_init(&q, f, scope, err);
    if (status == WEFT_OK)
        begin_common(f, &q);
    const int last_step = q.step;
    for (int run = 0; run < scope.runs && status == WEFT_OK; run++) {
        q.step = run + 1 < scope.runs && thinned(f) > last_step ? thinned(f) : last_step;
        weigh(f, &q);
        minimise(f, &q);
        update_common(f, &q);
    }
    if (status == WEFT_OK && scope.sigmas)
        status = find_sigmas(f, &q, err);
    normal_fini(&q);
    return status;
}
