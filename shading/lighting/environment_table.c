#include "shading/lighting/environment_table.h"

#include "core/parallel.h"
#include "shading/brdf/half_vector.h"
#include "shading/lighting/environment_rings.h"
#include "shading/lighting/table_cache.h"

#include <stdio.h>

enum { N = WEFT_ENVIRONMENT_TABLE_SIZE, RINGS = 32 };

/* The first node's n.v: below the least that is looked up, so that this lies inside the cubics' reach. */
#define FIRST_NV 3e-4

/* n.v at a node's place 0..1, and back. */
static double nv_at(double place)
{
    const double first = sqrt(sqrt(FIRST_NV)), root = first + (1 - first) * place;
    return root * root * root * root;
}

static double place_of_nv(double nv)
{
    const double first = sqrt(sqrt(FIRST_NV));
    return (sqrt(sqrt(nv)) - first) / (1 - first);
}

typedef struct fill_job {
    weft_environment_table *table;
    weft_environment_lobe lobe;
} fill_job;

static void fill_rows(void *context, int band, int row_begin, int row_end)
{
    const fill_job *const job = context;
    (void)band;
    /* bands have 16 rows: the rows of a node are the other axis, so that all cores have work */
    for (int node = row_begin; node < row_end; node++) {
        const int row = node / N, column = node % N;
        const double r = row / (N - 1.0), alpha = r * r * r * r;
        const double nv = nv_at(column / (N - 1.0)), grazing = pow(1 - nv, 5);
        weft_environment_share share[RINGS] = {{1 - grazing, grazing}};
        if (row > 0)
            weft_environment_rings(job->lobe, alpha, nv, RINGS, share);
        job->table->share[0][row][column] = (float)share[0].scale;
        job->table->share[1][row][column] = (float)share[0].bias;
    }
}

void weft_environment_table_compute(weft_environment_table *table, weft_environment_lobe lobe)
{
    weft_parallel_rows(N * N, fill_rows, &(fill_job){table, lobe});
}

static void compute(void *table, int lobe)
{
    weft_environment_table_compute(table, (weft_environment_lobe)lobe);
}

void weft_environment_table_get(weft_environment_table *table, weft_environment_lobe lobe)
{
    char key[128];
    snprintf(key, sizeof key, "environment brdf, rings 1, nodes %d, lobe %d", N, (int)lobe);
    weft_table_cached(key, table, sizeof *table, compute, (int)lobe);
}

/* ---- look-up ---- */

/* First of four nodes around t (0..1) and their Catmull-Rom weights; beyond the ends nodes repeat. */
static void cubic(double t, int node[4], double weight[4])
{
    const double at = (t < 0 ? 0 : t > 1 ? 1 : t) * (N - 1);
    const int first = at < N - 1 ? (int)at : N - 2;
    const double x = at - first, x2 = x * x, x3 = x2 * x;
    weight[0] = 0.5 * (-x3 + 2 * x2 - x);
    weight[1] = 0.5 * (3 * x3 - 5 * x2 + 2);
    weight[2] = 0.5 * (-3 * x3 + 4 * x2 + x);
    weight[3] = 0.5 * (x3 - x2);
    for (int k = 0; k < 4; k++) {
        const int i = first - 1 + k;
        node[k] = i < 0 ? 0 : i > N - 1 ? N - 1 : i;
    }
    if (first == 0) { /* carried on straight: node -1 = 2 node 0 - node 1 */
        weight[1] += 2 * weight[0];
        weight[2] -= weight[0];
        weight[0] = 0;
    }
    if (first == N - 2) {
        weight[2] += 2 * weight[3];
        weight[1] -= weight[3];
        weight[3] = 0;
    }
}

weft_environment_share weft_environment_table_at(const weft_environment_table *table, double nv, double alpha)
{
    int row[4], column[4];
    double down[4], across[4], sum[2] = {0};
    cubic(sqrt(sqrt(weft_max(alpha, 0))), row, down);
    cubic(place_of_nv(weft_max(nv, WEFT_ENVIRONMENT_MIN_NV)), column, across);
    for (int k = 0; k < 2; k++)
        for (int j = 0; j < 4; j++)
            for (int i = 0; i < 4; i++)
                sum[k] += down[j] * across[i] * (double)table->share[k][row[j]][column[i]];
    return (weft_environment_share){weft_max(sum[0], 0), weft_max(sum[1], 0)};
}
