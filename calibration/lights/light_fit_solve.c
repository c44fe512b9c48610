#include "calibration/lights/light_fit_internal.h"
#include "core/mem.h"

#include <assert.h>
#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TUKEY        4.685 /* 95 % efficient on Gaussian noise */
#define LM_STEPS     60
#define MEDIAN_CELLS 2000 /* enough for a median */
/* How far a vignetting is off the lens's axis: as a slope over a radius of the frame, of the value. */
#define SLOPE_SIGMA 0.01
#define GEOMETRY    6 /* p, e, m: the parameters that all channels share */
/* What smooth errors of the model (lobe, sheet) can add up to over a whole plate, of the value: without it
 * the many cells would claim a precision which outweighs every prior. */
#define MODEL_ERROR 1e-4

static void common_terms(fit_place place, double terms[FIT_COMMON])
{
    const double rho2 = place.x * place.x + place.y * place.y;
    terms[0] = rho2;
    terms[1] = rho2 * rho2;
    terms[2] = rho2 * rho2 * rho2;
    terms[3] = place.x;
    terms[4] = place.y;
}

double fit_common_log(const fit_shared *shared, fit_place place)
{
    double terms[FIT_COMMON], sum = 0;
    common_terms(place, terms);
    for (int k = 0; k < FIT_COMMON; k++)
        sum += shared->v[k] * terms[k];
    return sum;
}

/* The pieces of the lamp's model at x, in mm: d = x to lamp, b = spot to lamp. */
typedef struct lamp_at {
    weft_vec3 d, b;
    double r2, b2, db; /* d.d, b.b, d.b */
    double off_axis;   /* log of the cosine between them */
} lamp_at;

static lamp_at look_at(const fit_lamp *lamp, weft_vec3 x)
{
    const weft_vec3 p = {lamp->p[0], lamp->p[1], lamp->p[2]}, m = {lamp->m[0], lamp->m[1], 0};
    lamp_at at = {.d = weft_sub(p, x), .b = weft_sub(p, m)};
    at.r2 = weft_dot(at.d, at.d);
    at.b2 = weft_dot(at.b, at.b);
    at.db = weft_dot(at.d, at.b);
    at.off_axis = log(at.db / sqrt(at.r2 * at.b2)); /* NaN from 90 degrees on */
    return at;
}

static double log_at(const fit_lamp *lamp, const lamp_at *at)
{
    /* mm^-2 to m^-2; NaN for a lamp below the sheet */
    return log(at->d.z * 1e6 / (at->r2 * sqrt(at->r2))) + lamp->e * at->off_axis;
}

double fit_lamp_log(const fit_lamp *lamp, weft_vec3 x)
{
    const lamp_at at = look_at(lamp, x);
    return log_at(lamp, &at);
}

/* Derivatives by p, e and m. */
static void gradient_at(const fit_lamp *lamp, const lamp_at *at, double g[GEOMETRY])
{
    const double *const d = &at->d.x, *const b = &at->b.x;
    for (int k = 0; k < 3; k++)
        g[k] = -3 * d[k] / at->r2 + lamp->e * ((b[k] + d[k]) / at->db - d[k] / at->r2 - b[k] / at->b2);
    g[2] += 1 / at->d.z;
    g[3] = at->off_axis;
    for (int k = 0; k < 2; k++)
        g[4 + k] = lamp->e * (b[k] / at->b2 - d[k] / at->db);
}

double fit_residual(const fit_problem *f, int light, int channel, int cell)
{
    const fit_lamp *const lamp = &f->lamps[light];
    return (double)f->y[fit_plane(f, light, channel) + (size_t)cell] - lamp->log_phi[channel] -
           fit_lamp_log(lamp, f->x[cell]) - fit_common_log(&f->shared, f->place[cell]) - f->common[cell];
}

/* One run of the normal equations: n unknowns, the lamps of the scope one after the other, the shared last.
 */
typedef struct normal {
    fit_scope scope;
    int n;
    double *h;      /* [n][n] */
    double *factor; /* [n][n] damped copy, its Cholesky factor, or its inverse */
    double *g;      /* [n] minus the gradient */
    double *step;   /* [n] */
    float *robust;  /* [scope.n][3][cells] Tukey's weight times the cell's over the noise's variance */
    float *scratch; /* [cells] */
} normal;

static void normal_fini(normal *q)
{
    weft_free(q->h);
    weft_free(q->factor);
    weft_free(q->g);
    weft_free(q->step);
    weft_free(q->robust);
    weft_free(q->scratch);
}

static weft_err normal_init(normal *q, const fit_problem *f, fit_scope scope, weft_error *err)
{
    *q = (normal){.scope = scope, .n = scope.n * FIT_LAMP + FIT_SHARED};
    const size_t n = (size_t)q->n, cells = (size_t)f->n_cells;
    if (!(q->h = weft_alloc(n * n, sizeof(double), err)) ||
        !(q->factor = weft_alloc(n * n, sizeof(double), err)) ||
        !(q->g = weft_alloc(n, sizeof(double), err)) || !(q->step = weft_alloc(n, sizeof(double), err)) ||
        !(q->robust = weft_alloc(cells * 3 * (size_t)scope.n, sizeof(float), err)) ||
        !(q->scratch = weft_alloc(cells, sizeof(float), err)))
        return WEFT_ERR_NOMEM;
    return WEFT_OK;
}

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
    return fmax(1.4826 * (double)q->scratch[n / 2], 1e-7);
}

static void weigh(fit_problem *f, normal *q)
{
    for (int l = 0; l < q->scope.n; l++)
        for (int c = 0; c < 3; c++) {
            const int light = q->scope.first + l;
            const double noise = noise_of(f, q, light, c);
            f->noise[light][c] = noise;
            const double variance = noise * noise + f->n_cells * MODEL_ERROR * MODEL_ERROR;
            const float *const w = f->weight + fit_plane(f, light, c);
            float *const out = q->robust + (size_t)(3 * l + c) * (size_t)f->n_cells;
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

static double prior_aim_mm(const fit_problem *f, const fit_lamp *lamp)
{
    const weft_vec3 p = {lamp->p[0], lamp->p[1], lamp->p[2]};
    return weft_length(p) * f->options->aim_sigma_rad;
}

/* What the priors cost; `aim` [scope.n] is how far from the middle a lamp may point. */
static double prior_cost(const fit_problem *f, const normal *q, const double *aim)
{
    const double se = f->options->exponent_sigma, e0 = f->shared.e0;
    double cost = (e0 - 1) * (e0 - 1);
    for (int k = FIT_RADIAL; k < FIT_COMMON; k++)
        cost += f->shared.v[k] * f->shared.v[k] / (SLOPE_SIGMA * SLOPE_SIGMA);
    for (int l = 0; l < q->scope.n; l++) {
        const fit_lamp *const lamp = &f->lamps[q->scope.first + l];
        cost += (lamp->e - e0) * (lamp->e - e0) / (se * se) +
                (lamp->m[0] * lamp->m[0] + lamp->m[1] * lamp->m[1]) / (aim[l] * aim[l]);
    }
    return cost;
}

static double cost_of(const fit_problem *f, const normal *q, const double *aim)
{
    double cost = prior_cost(f, q, aim);
    for (int l = 0; l < q->scope.n; l++)
        for (int i = 0; i < f->n_cells; i++) {
            const fit_lamp *const lamp = &f->lamps[q->scope.first + l];
            const double model =
                fit_lamp_log(lamp, f->x[i]) + fit_common_log(&f->shared, f->place[i]) + f->common[i];
            for (int c = 0; c < 3; c++) {
                const double w = (double)q->robust[(size_t)(3 * l + c) * (size_t)f->n_cells + (size_t)i];
                if (!(w > 0))
                    continue;
                const double r =
                    (double)f->y[fit_plane(f, q->scope.first + l, c) + (size_t)i] - lamp->log_phi[c] - model;
                cost += w * r * r; /* NaN where the lamp cannot light the cell: such a step is refused */
            }
        }
    return cost;
}

/* Adds one cell: `j` holds the derivatives by the geometry and the vignetting, at unknowns `at`. */
static void add_cell(normal *q, const int *at, const double *j, int n_j, int phi, const double w[3],
                     const double r[3])
{
    double sum = 0, rest = 0;
    for (int c = 0; c < 3; c++) {
        const size_t p = (size_t)phi + (size_t)c;
        q->h[p * (size_t)q->n + p] += w[c];
        q->g[p] += w[c] * r[c];
        for (int k = 0; k < n_j;
             k++) /* lower triangle: the shared unknowns come after phi, the lamp's before */
            if (at[k] < phi)
                q->h[p * (size_t)q->n + (size_t)at[k]] += w[c] * j[k];
            else
                q->h[(size_t)at[k] * (size_t)q->n + p] += w[c] * j[k];
        sum += w[c];
        rest += w[c] * r[c];
    }
    for (int k = 0; k < n_j; k++) {
        q->g[at[k]] += rest * j[k];
        for (int m = 0; m <= k; m++)
            q->h[(size_t)at[k] * (size_t)q->n + (size_t)at[m]] += sum * j[k] * j[m];
    }
}

static void add_light(const fit_problem *f, normal *q, int l)
{
    const int light = q->scope.first + l, base = l * FIT_LAMP, shared = q->scope.n * FIT_LAMP;
    const fit_lamp *const lamp = &f->lamps[light];
    int at[GEOMETRY + FIT_COMMON];
    for (int k = 0; k < GEOMETRY; k++)
        at[k] = base + k;
    for (int k = 0; k < FIT_COMMON; k++)
        at[GEOMETRY + k] = shared + k;
    for (int i = 0; i < f->n_cells; i++) {
        double j[GEOMETRY + FIT_COMMON], w[3], r[3];
        const lamp_at here = look_at(lamp, f->x[i]);
        const double model = log_at(lamp, &here) + fit_common_log(&f->shared, f->place[i]) + f->common[i];
        gradient_at(lamp, &here, j);
        common_terms(f->place[i], j + GEOMETRY);
        for (int c = 0; c < 3; c++) {
            w[c] = (double)q->robust[(size_t)(3 * l + c) * (size_t)f->n_cells + (size_t)i];
            r[c] = w[c] > 0 ? (double)f->y[fit_plane(f, light, c) + (size_t)i] - lamp->log_phi[c] - model : 0;
        }
        add_cell(q, at, j, q->scope.shared_free ? GEOMETRY + FIT_COMMON : GEOMETRY, base + GEOMETRY, w, r);
    }
}

static void add_diagonal(normal *q, int at, double precision, double residual)
{
    q->h[(size_t)at * (size_t)q->n + (size_t)at] += precision;
    q->g[at] += precision * residual;
}

static void add_priors(const fit_problem *f, normal *q, const double *aim)
{
    const int shared = q->scope.n * FIT_LAMP, e0 = shared + FIT_COMMON;
    const double precision = 1 / (f->options->exponent_sigma * f->options->exponent_sigma);
    for (int l = 0; l < q->scope.n; l++) {
        const fit_lamp *const lamp = &f->lamps[q->scope.first + l];
        const int e = l * FIT_LAMP + 3;
        add_diagonal(q, e, precision, f->shared.e0 - lamp->e);
        if (q->scope.shared_free) {
            add_diagonal(q, e0, precision, lamp->e - f->shared.e0);
            q->h[(size_t)e0 * (size_t)q->n + (size_t)e] -= precision;
        }
        for (int k = 0; k < 2; k++)
            add_diagonal(q, e + 1 + k, 1 / (aim[l] * aim[l]), -lamp->m[k]);
    }
    add_diagonal(q, e0, 1, 1 - f->shared.e0);
    for (int k = FIT_RADIAL; k < FIT_COMMON; k++)
        add_diagonal(q, shared + k, 1 / (SLOPE_SIGMA * SLOPE_SIGMA), -f->shared.v[k]);
    for (int k = 0; k < FIT_SHARED && !q->scope.shared_free; k++) {
        const size_t at = (size_t)shared + (size_t)k;
        q->h[at * (size_t)q->n + at] = 1; /* held: its step is 0 */
        q->g[at] = 0;
    }
}

static void build(const fit_problem *f, normal *q, const double *aim)
{
    memset(q->h, 0, (size_t)q->n * (size_t)q->n * sizeof *q->h);
    memset(q->g, 0, (size_t)q->n * sizeof *q->g);
    for (int l = 0; l < q->scope.n; l++)
        add_light(f, q, l);
    add_priors(f, q, aim);
}

/* Solves the damped equations; false when they are singular. */
static bool solve_step(normal *q, double damping)
{
    const size_t n = (size_t)q->n;
    memcpy(q->factor, q->h, n * n * sizeof *q->h);
    memcpy(q->step, q->g, n * sizeof *q->g);
    for (size_t i = 0; i < n; i++)
        q->factor[i * n + i] *= 1 + damping;
    return LAPACKE_dpotrf(LAPACK_ROW_MAJOR, 'L', q->n, q->factor, q->n) == 0 &&
           LAPACKE_dpotrs(LAPACK_ROW_MAJOR, 'L', q->n, 1, q->factor, q->n, q->step, 1) == 0;
}

/* Takes the step; @return the largest move of a light, mm. */
static double take_step(fit_problem *f, const normal *q)
{
    double moved = 0;
    for (int l = 0; l < q->scope.n; l++) {
        double *const lamp = f->lamps[q->scope.first + l].p; /* the numbers lie one after the other */
        const double *const s = q->step + (size_t)l * FIT_LAMP;
        moved = fmax(moved, sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]));
        for (int k = 0; k < FIT_LAMP; k++)
            lamp[k] += s[k];
    }
    const double *const s = q->step + (size_t)q->scope.n * FIT_LAMP;
    for (int k = 0; k < FIT_COMMON; k++)
        f->shared.v[k] += s[k];
    f->shared.e0 += s[FIT_COMMON];
    return moved;
}

static void minimise(fit_problem *f, normal *q)
{
    double aim[WEFT_LIGHTS_MAX] = {0}, damping = 1e-3;
    fit_lamp lamps[WEFT_LIGHTS_MAX];
    for (int l = 0; l < q->scope.n; l++)
        aim[l] = prior_aim_mm(f, &f->lamps[q->scope.first + l]);
    double cost = cost_of(f, q, aim);
    for (int step = 0; step < LM_STEPS; step++) {
        build(f, q, aim);
        for (;;) {
            memcpy(lamps, f->lamps, sizeof lamps);
            const fit_shared shared = f->shared;
            const double moved = solve_step(q, damping) ? take_step(f, q) : HUGE_VAL;
            const double now = isfinite(moved) ? cost_of(f, q, aim) : HUGE_VAL;
            if (now <= cost) {
                const bool done = moved < 1e-5 || cost - now < 1e-9 * cost;
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

static void find_sigmas(fit_problem *f, normal *q)
{
    double aim[WEFT_LIGHTS_MAX] = {0};
    for (int l = 0; l < q->scope.n; l++)
        aim[l] = prior_aim_mm(f, &f->lamps[q->scope.first + l]);
    build(f, q, aim);
    const bool known = solve_step(q, 0) && LAPACKE_dpotri(LAPACK_ROW_MAJOR, 'L', q->n, q->factor, q->n) == 0;
    for (int l = 0; l < q->scope.n; l++) {
        double sum = 0;
        for (int k = 0; k < 3; k++)
            sum += q->factor[(size_t)(l * FIT_LAMP + k) * (size_t)(q->n + 1)];
        f->position_sigma[q->scope.first + l] = known ? sqrt(sum) : 0;
    }
}

weft_err fit_solve(fit_problem *f, fit_scope scope, weft_error *err)
{
    normal q;
    assert(scope.first >= 0 && scope.first + scope.n <= f->n_lights);
    weft_err status = normal_init(&q, f, scope, err);
    for (int run = 0; run < scope.runs && status == WEFT_OK; run++) {
        weigh(f, &q);
        minimise(f, &q);
    }
    if (status == WEFT_OK)
        find_sigmas(f, &q);
    normal_fini(&q);
    return status;
}
