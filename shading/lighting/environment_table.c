#include "shading/lighting/environment_table.h"

#include "core/file.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/parallel.h"
#include "core/sha256.h"
#include "shading/brdf/albedo.h"
#include "shading/brdf/half_vector.h"

#include <stdlib.h>
#include <string.h>

enum { N = WEFT_ENVIRONMENT_TABLE_SIZE };

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
        const double r = row / (N - 1.0), c = column / (N - 1.0), alpha = r * r * r;
        const double nv = weft_max(c * c * c, WEFT_ENVIRONMENT_MIN_NV), grazing = pow(1 - nv, 5);
        const weft_environment_share share = row == 0 ? (weft_environment_share){1 - grazing, grazing}
                                                      : weft_environment_brdf_quick(job->lobe, alpha, nv);
        job->table->share[0][row][column] = (float)share.scale;
        job->table->share[1][row][column] = (float)share.bias;
    }
}

void weft_environment_table_compute(weft_environment_table *table, weft_environment_lobe lobe)
{
    weft_parallel_rows(N * N, fill_rows, &(fill_job){table, lobe});
}

/* ---- cache ---- */

static void hash_of(const void *bytes, size_t n, char hex[65])
{
    weft_sha256 hash;
    weft_sha256_init(&hash);
    weft_sha256_update(&hash, bytes, n);
    weft_sha256_final_hex(&hash, hex);
}

/* NULL where there is no place for it. */
static char *cache_path(weft_environment_lobe lobe)
{
    const char *const cache = getenv("XDG_CACHE_HOME"), *const home = getenv("HOME");
    char key[128], hex[65];
    if (!(cache && cache[0]) && !(home && home[0]))
        return NULL;
    snprintf(key, sizeof key, "environment brdf, quadrature 1, nodes %d, lobe %d, floats of %zu bytes", N,
             (int)lobe, sizeof(float));
    hash_of(key, strlen(key), hex);
    return cache && cache[0] ? weft_asprintf(NULL, "%s/weft/%s.table", cache, hex)
                             : weft_asprintf(NULL, "%s/.cache/weft/%s.table", home, hex);
}

static bool read_cached(const char *path, weft_environment_table *table)
{
    char *bytes = NULL, hex[65];
    size_t n = 0;
    if (!weft_file_exists(path) || weft_file_read(path, sizeof *table + 65, &bytes, &n, NULL) != WEFT_OK)
        return false;
    bool good = n == sizeof *table + 64;
    if (good) {
        hash_of(bytes, sizeof *table, hex);
        good = memcmp(bytes + sizeof *table, hex, 64) == 0;
    }
    if (good)
        memcpy(table, bytes, sizeof *table);
    weft_free(bytes);
    return good;
}

static void write_cached(const char *path, const weft_environment_table *table)
{
    char bytes[sizeof *table + 65];
    char *const folder = weft_path_folder(path, NULL);
    memcpy(bytes, table, sizeof *table);
    hash_of(table, sizeof *table, bytes + sizeof *table);
    if (!folder || weft_folder_create(folder, NULL) != WEFT_OK ||
        weft_file_write(path, bytes, sizeof bytes - 1, NULL) != WEFT_OK)
        weft_explain("%s: the table cannot be kept there; it is computed again next time", path);
    weft_free(folder);
}

void weft_environment_table_get(weft_environment_table *table, weft_environment_lobe lobe)
{
    char *const path = cache_path(lobe);
    if (!path || !read_cached(path, table)) {
        weft_environment_table_compute(table, lobe);
        if (path)
            write_cached(path, table);
    }
    weft_free(path);
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
    cubic(cbrt(weft_max(alpha, 0)), row, down);
    cubic(cbrt(weft_max(nv, WEFT_ENVIRONMENT_MIN_NV)), column, across);
    for (int k = 0; k < 2; k++)
        for (int j = 0; j < 4; j++)
            for (int i = 0; i < 4; i++)
                sum[k] += down[j] * across[i] * (double)table->share[k][row[j]][column[i]];
    return (weft_environment_share){weft_max(sum[0], 0), weft_max(sum[1], 0)};
}
