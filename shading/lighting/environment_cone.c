#include "shading/lighting/environment_cone.h"

#include "core/parallel.h"
#include "shading/brdf/half_vector.h"
#include "shading/lighting/environment_rings.h"
#include "shading/lighting/table_cache.h"

#include <stdio.h>

enum {
    ALPHAS = WEFT_ENVIRONMENT_CONE_ALPHAS,
    VIEWS = WEFT_ENVIRONMENT_CONE_VIEWS,
    PLACES = WEFT_ENVIRONMENT_CONE_PLACES
};

/* The first node's alpha: below the least that is looked up, so that this lies between four nodes. */
#define FIRST_ALPHA 3e-4

static double fourth_root(double x)
{
    return sqrt(sqrt(x));
}

static double alpha_at(int row)
{
    const double first = fourth_root(FIRST_ALPHA), root = first + (1 - first) * row / (ALPHAS - 1);
    return row == ALPHAS - 1 ? 1 : root * root * root * root;
}

/* Place 0..1 of a view: halves that count the logarithms of n.v and of its sine, each from alpha on. */
static double view_place(double alpha, double nv)
{
    const double sine = sqrt((1 - nv) * (1 + nv));
    return 0.5 + 0.5 * log((nv + alpha) / (sine + alpha)) / log((1 + alpha) / alpha);
}

static double view_at(double alpha, double place)
{
    double below = 0, above = 1;
    if (place <= 0 || place >= 1)
        return place <= 0 ? 0 : 1;
    for (int i = 0; i < 60; i++) {
        const double nv = 0.5 * (below + above);
        *(view_place(alpha, nv) < place ? &below : &above) = nv;
    }
    return 0.5 * (below + above);
}

typedef struct fill_job {
    weft_environment_cone_table *table;
    weft_environment_lobe lobe;
} fill_job;

static void fill_rows(void *context, int band, int row_begin, int row_end)
{
    const fill_job *const job = context;
    (void)band;
    for (int node = row_begin; node < row_end; node++) {
        const int row = node / VIEWS, column = node % VIEWS;
        const double alpha = alpha_at(row), nv = view_at(alpha, column / (VIEWS - 1.0));
        weft_environment_share share[PLACES];
        weft_environment_rings(job->lobe, alpha, nv, PLACES, share);
        for (int k = 0; k < PLACES; k++) {
            job->table->share[row][column][k][0] = (float)share[k].scale;
            job->table->share[row][column][k][1] = (float)share[k].bias;
        }
    }
}

void weft_environment_cone_compute(weft_environment_cone_table *table, weft_environment_lobe lobe)
{
    weft_parallel_rows(ALPHAS * VIEWS, fill_rows, &(fill_job){table, lobe});
}

static void compute(void *table, int lobe)
{
    weft_environment_cone_compute(table, (weft_environment_lobe)lobe);
}

void weft_environment_cone_get(weft_environment_cone_table *table, weft_environment_lobe lobe)
{
    char key[128];
    snprintf(key, sizeof key, "environment brdf above cones, rings 1, nodes %d %d %d, lobe %d", ALPHAS, VIEWS,
             PLACES, (int)lobe);
    weft_table_cached(key, table, sizeof *table, compute, (int)lobe);
}

/* The first of the four nodes around a place 0..1, and the weights of the cubic through them. */
static int lagrange(double place, int n, double weight[4])
{
    const double at = (place > 0 ? (place < 1 ? place : 1) : 0) * (n - 1);
    int first = (int)at - 1;
    first = first < 0 ? 0 : first > n - 4 ? n - 4 : first;
    const double x = at - first; /* 0..3 */
    weight[0] = -(x - 1) * (x - 2) * (x - 3) / 6;
    weight[1] = x * (x - 2) * (x - 3) / 2;
    weight[2] = -x * (x - 1) * (x - 3) / 2;
    weight[3] = x * (x - 1) * (x - 2) / 6;
    return first;
}

weft_environment_share weft_environment_cone_at(const weft_environment_cone_table *table, double nv,
                                                double alpha, double cone_cosine)
{
    double down[4], across[4], deep[4], sum[2] = {0};
    if (cone_cosine >= 1)
        return (weft_environment_share){0, 0};
    nv = nv < WEFT_ENVIRONMENT_MIN_NV ? WEFT_ENVIRONMENT_MIN_NV : nv < 1 ? nv : 1;
    alpha = alpha < WEFT_ENVIRONMENT_CONE_MIN_ALPHA ? WEFT_ENVIRONMENT_CONE_MIN_ALPHA : alpha < 1 ? alpha : 1;
    const double first = fourth_root(FIRST_ALPHA);
    const int row = lagrange((fourth_root(alpha) - first) / (1 - first), ALPHAS, down);
    const int column = lagrange(view_place(alpha, nv), VIEWS, across);
    const int place =
        lagrange(weft_environment_ring_place(alpha, nv, weft_max(cone_cosine, 0)), PLACES, deep);
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++) {
            const double w = down[i] * across[j];
            for (int k = 0; k < 4; k++)
                for (int c = 0; c < 2; c++)
                    sum[c] += w * deep[k] * (double)table->share[row + i][column + j][place + k][c];
        }
    return (weft_environment_share){weft_max(sum[0], 0), weft_max(sum[1], 0)};
}
