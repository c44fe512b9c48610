/* The lobe of a cloth from blocks of its samples: a coarse lattice, then a simplex. */
#include "host/solve/cloth_lobe.h"

#include <math.h>

enum { LANES = WEFT_SOLVE_LANES, N_UNKNOWNS = 4, STEPS = 120 };

typedef struct lobe_fit {
    weft_solve_samples *const *blocks;
    int n;
} lobe_fit;

/* Unknowns: log strength, log of either alpha, angle of the fibre. */
static weft_gloss lobe_of(const double x[N_UNKNOWNS])
{
    const double along = fmin(fmax(exp(x[1]), 0.05), 1.5), across = fmin(fmax(exp(x[2]), 0.05), 1.5);
    const float c = (float)cos(x[3]), s = (float)sin(x[3]);
    return (weft_gloss){(float)fmin(exp(x[0]), 1), (float)along, (float)across, {{c, s}, {-s, c}}};
}

/* Mean cost of a lane that has light. */
static double cost_of(const lobe_fit *fit, const weft_gloss *gloss)
{
    static _Thread_local weft_solve_samples matte;
    static _Thread_local weft_lane_weights kept[WEFT_LIGHTS_MAX];
    double sum = 0, n = 0;
    for (int i = 0; i < fit->n; i++) {
        float cost[LANES];
        fit->blocks[i]->gloss = gloss;
        weft_gloss_solve(fit->blocks[i], &matte, kept, cost);
        for (int k = 0; k < LANES; k++) {
            const bool dark = !(fit->blocks[i]->at[0].weight[k] > 0) || !isfinite(cost[k]);
            sum += dark ? 0 : (double)cost[k];
            n += dark ? 0 : fit->blocks[i]->n_lights;
        }
        fit->blocks[i]->gloss = NULL;
    }
    return n > 0 ? sum / n : 0;
}

typedef struct corner {
    double x[N_UNKNOWNS], cost;
} corner;

static void measure_corner(const lobe_fit *fit, corner *c)
{
    const weft_gloss gloss = lobe_of(c->x);
    c->cost = cost_of(fit, &gloss);
}

/* The best of a coarse lattice. */
static corner look_around(const lobe_fit *fit)
{
    static const double strengths[2] = {0.015, 0.06}, alphas[2] = {0.15, 0.4};
    corner best = {.cost = INFINITY};
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            for (int k = 0; k < 4; k++) {
                corner c = {
                    .x = {log(strengths[i]), log(0.7 * alphas[j]), log(1.4 * alphas[j]), k * 0.3926990817}};
                measure_corner(fit, &c);
                if (c.cost < best.cost)
                    best = c;
            }
    return best;
}

static void sort_corners(corner c[N_UNKNOWNS + 1])
{
    for (int i = 1; i <= N_UNKNOWNS; i++)
        for (int j = i; j > 0 && c[j].cost < c[j - 1].cost; j--) {
            const corner t = c[j];
            c[j] = c[j - 1];
            c[j - 1] = t;
        }
}

/* A corner on the line from the worst one through the middle of the others. */
static corner reflect(const lobe_fit *fit, const corner c[N_UNKNOWNS + 1], double by)
{
    corner to = {.cost = 0};
    for (int i = 0; i < N_UNKNOWNS; i++) {
        double middle = 0;
        for (int j = 0; j < N_UNKNOWNS; j++)
            middle += c[j].x[i] / N_UNKNOWNS;
        to.x[i] = middle + by * (middle - c[N_UNKNOWNS].x[i]);
    }
    measure_corner(fit, &to);
    return to;
}

/* Nelder and Mead 1965: no derivatives, four unknowns, a cost that is smooth where it counts. */
static corner descend(const lobe_fit *fit, corner from)
{
    static const double spans[N_UNKNOWNS] = {0.3, 0.3, 0.3, 0.15};
    corner c[N_UNKNOWNS + 1];
    for (int i = 0; i <= N_UNKNOWNS; i++) {
        c[i] = from;
        if (i > 0) {
            c[i].x[i - 1] += spans[i - 1];
            measure_corner(fit, &c[i]);
        }
    }
    for (int step_number = 0; step_number < STEPS; step_number++) {
        sort_corners(c);
        corner *const worst = &c[N_UNKNOWNS];
        if (worst->cost - c[0].cost < 1e-4 * c[0].cost)
            break;
        const corner over = reflect(fit, c, 1);
        if (over.cost < c[0].cost) {
            const corner further = reflect(fit, c, 2);
            *worst = further.cost < over.cost ? further : over;
        } else if (over.cost < c[N_UNKNOWNS - 1].cost) {
            *worst = over;
        } else {
            const corner inside = reflect(fit, c, over.cost < worst->cost ? 0.5 : -0.5);
            if (inside.cost < fmin(worst->cost, over.cost)) {
                *worst = inside;
                continue;
            }
            for (int i = 1; i <= N_UNKNOWNS; i++) {
                for (int j = 0; j < N_UNKNOWNS; j++)
                    c[i].x[j] = 0.5 * (c[0].x[j] + c[i].x[j]);
                measure_corner(fit, &c[i]);
            }
        }
    }
    sort_corners(c);
    return c[0];
}

weft_gloss_report weft_gloss_fit(weft_solve_samples *const *blocks, int n, weft_gloss *gloss)
{
    const lobe_fit fit = {blocks, n};
    const weft_gloss none = {0, 1, 1, {{1, 0}, {0, 1}}};
    weft_gloss_report report = {.n_pixels = n * LANES};
    report.matte = report.glossy = cost_of(&fit, &none);
    /* within the tolerance on average: nothing to explain */
    if (!(report.matte > 0.5))
        return report;
    const corner best = descend(&fit, look_around(&fit));
    report.glossy = best.cost;
    report.found = best.cost < 0.5 * report.matte;
    if (report.found)
        *gloss = lobe_of(best.x);
    return report;
}
