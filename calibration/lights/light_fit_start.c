#include "calibration/lights/light_fit_internal.h"

#include <math.h>

#define COARSE_CELLS 300 /* that the search looks at */
#define N_BEST       3   /* candidates that are refined */

/* Directions and distances of the search.  A lamp in the plane of the sheet or beyond the last distance is
 * reached by the refinement. */
static const double elevations_deg[] = {8, 15, 25, 35, 45, 55, 65, 75, 84, 89.9},
                    distances[] = {1.3, 1.9, 2.8, 4.2, 6.3, 9.5}; /* of the field's radius */
#define N_ELEVATIONS (int)(sizeof elevations_deg / sizeof *elevations_deg)
#define N_AZIMUTHS   24
#define N_DISTANCES  (int)(sizeof distances / sizeof *distances)
#define PI           3.14159265358979323846

/* Every k-th cell of the problem, k by chance alike in both directions. */
static weft_err thin_out(const fit_problem *f, fit_problem *coarse, weft_error *err)
{
    const size_t step = f->n_cells > COARSE_CELLS ? (size_t)(f->n_cells / COARSE_CELLS) : 1;
    const size_t n = ((size_t)f->n_cells + step - 1) / step;
    WEFT_TRY(fit_problem_init(coarse, f->n_lights, (int)n, err));
    coarse->options = f->options;
    coarse->field_mm = f->field_mm;
    for (size_t i = 0; i < n; i++) {
        coarse->cell[i] = f->cell[i * step];
        coarse->place[i] = f->place[i * step];
        for (size_t c = 0; c < 3; c++)
            coarse->common[c * n + i] = f->common[c * (size_t)f->n_cells + i * step];
        for (int l = 0; l < f->n_lights; l++)
            for (int c = 0; c < 3; c++) {
                coarse->y[fit_plane(coarse, l, c) + i] = f->y[fit_plane(f, l, c) + i * step];
                coarse->weight[fit_plane(coarse, l, c) + i] = f->weight[fit_plane(f, l, c) + i * step];
            }
    }
    return WEFT_OK;
}

/* Sets log Phi to the weighted mean; @return the green channel's weighted variance, infinite when the lamp
 * does not reach a cell. */
static double level(const fit_problem *f, int light, fit_lamp *lamp)
{
    double sw[3] = {0}, sr[3] = {0}, srr = 0;
    for (int i = 0; i < f->n_cells; i++) {
        const fit_surface at = fit_surface_at(f, i);
        const double model = fit_lamp_log(lamp, &at);
        if (isnan(model))
            return HUGE_VAL;
        for (int c = 0; c < 3; c++) {
            const size_t plane = fit_plane(f, light, c) + (size_t)i;
            const double w = (double)f->weight[plane];
            if (!(w > 0))
                continue;
            const double r =
                (double)f->y[plane] - model - f->common[(size_t)c * (size_t)f->n_cells + (size_t)i];
            sw[c] += w;
            sr[c] += w * r;
            if (c == 1)
                srr += w * r * r;
        }
    }
    for (int c = 0; c < 3; c++)
        lamp->log_phi[c] = sw[c] > 0 ? sr[c] / sw[c] : 0;
    return sw[1] > 0 ? srr / sw[1] - lamp->log_phi[1] * lamp->log_phi[1] : 0;
}

typedef struct candidate {
    fit_lamp lamp;
    double cost;
} candidate;

static void keep_best(candidate best[N_BEST], candidate one)
{
    for (int i = 0; i < N_BEST; i++)
        if (one.cost < best[i].cost) {
            const candidate pushed = best[i];
            best[i] = one;
            one = pushed;
        }
}

static void search(const fit_problem *f, int light, candidate best[N_BEST])
{
    for (int i = 0; i < N_BEST; i++)
        best[i] = (candidate){.cost = HUGE_VAL};
    for (int d = 0; d < N_DISTANCES; d++)
        for (int e = 0; e < N_ELEVATIONS; e++)
            for (int k = 0; k < N_AZIMUTHS; k++) {
                const double r = distances[d] * f->field_mm, el = elevations_deg[e] * PI / 180,
                             a = k * 2 * PI / N_AZIMUTHS;
                candidate one = {
                    .lamp = {.p = {r * cos(el) * cos(a), r * cos(el) * sin(a), r * sin(el)}, .e = 1}};
                one.cost = level(f, light, &one.lamp);
                keep_best(best, one);
            }
}

/* Refines the candidates of a light on the coarse cells and leaves the best in place. */
static weft_err refine(fit_problem *coarse, int light, candidate best[N_BEST], weft_error *err)
{
    candidate winner = {.cost = HUGE_VAL};
    for (int i = 0; i < N_BEST && isfinite(best[i].cost); i++) {
        coarse->lamps[light] = best[i].lamp;
        WEFT_TRY(fit_solve(coarse, (fit_scope){.first = light, .n = 1, .runs = 2}, err));
        candidate one = {.lamp = coarse->lamps[light]};
        one.cost = level(coarse, light, &one.lamp);
        if (one.cost < winner.cost)
            winner = one;
    }
    if (!isfinite(winner.cost))
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "light %d: no position explains its picture of the sheet; give a rough one with --guess", light);
    coarse->lamps[light] = winner.lamp;
    return WEFT_OK;
}

static weft_err start_light(fit_problem *coarse, int light, weft_error *err)
{
    candidate best[N_BEST];
    if (coarse->options->n_guess == 0) {
        search(coarse, light, best);
        return refine(coarse, light, best, err);
    }
    const weft_vec3 p = coarse->options->guess[light];
    for (int i = 0; i < N_BEST; i++)
        best[i] = (candidate){.cost = HUGE_VAL};
    best[0].lamp = (fit_lamp){.p = {p.x, p.y, p.z}, .e = 1};
    best[0].cost = level(coarse, light, &best[0].lamp);
    if (!isfinite(best[0].cost))
        return weft_fail(
            err, WEFT_ERR_RANGE,
            "light %d: the guess (%g, %g, %g) mm cannot light the whole sheet; z is up from the table", light,
            p.x, p.y, p.z);
    return refine(coarse, light, best, err);
}

weft_err fit_start(fit_problem *f, weft_error *err)
{
    fit_problem coarse = {0};
    weft_err status = thin_out(f, &coarse, err);
    for (int light = 0; light < f->n_lights && status == WEFT_OK; light++) {
        coarse.shared = (fit_shared){.e0 = 1};
        status = start_light(&coarse, light, err);
        f->lamps[light] = coarse.lamps[light];
    }
    f->shared = (fit_shared){.e0 = 1};
    fit_problem_fini(&coarse);
    return status;
}
