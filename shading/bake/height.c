#include "shading/bake/height.h"

#include "core/mem.h"

#include <math.h>
#include <string.h>

enum { SWEEPS = 2, COARSEST_SWEEPS = 200, MAX_ROUNDS = 500, MAX_LEVELS = 32 };

double weft_height_slope(double n_across, double n_z)
{
    const double slope = n_z > 0.01 ? -n_across / n_z : -copysign(WEFT_HEIGHT_MAX_SLOPE, n_across);
    return fmin(fmax(slope, -WEFT_HEIGHT_MAX_SLOPE), WEFT_HEIGHT_MAX_SLOPE);
}

/* One size of grid: 4 h(x,y) - (sum of the neighbours) = rhs(x,y), wrapping around. */
typedef struct grid {
    int w, h;
    double *height, *rhs; /* [h][w] */
} grid;

static double neighbours(const grid *g, int x, int y)
{
    const double *const row = g->height + (size_t)y * (size_t)g->w;
    const double *const above = g->height + (size_t)(y > 0 ? y - 1 : g->h - 1) * (size_t)g->w;
    const double *const below = g->height + (size_t)(y + 1 < g->h ? y + 1 : 0) * (size_t)g->w;
    return row[x > 0 ? x - 1 : g->w - 1] + row[x + 1 < g->w ? x + 1 : 0] + above[x] + below[x];
}

/* Gauss-Seidel, forwards then backwards; plain Jacobi would leave a checkerboard as it is. */
static void relax(grid *g, int sweeps)
{
    const int n = g->w * g->h;
    for (int s = 0; s < sweeps; s++)
        for (int k = 0; k < 2 * n; k++) {
            const int i = k < n ? k : 2 * n - 1 - k;
            g->height[i] = 0.25 * (neighbours(g, i % g->w, i / g->w) + g->rhs[i]);
        }
}

static void subtract_mean(double *values, int n)
{
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += values[i];
    for (int i = 0; i < n; i++)
        values[i] -= sum / n;
}

/* What the fine grid leaves over, summed over blocks of 2 x 2: their means, times 4 for the doubled step. */
static void restrict_residual(const grid *fine, grid *coarse)
{
    memset(coarse->rhs, 0, (size_t)coarse->w * (size_t)coarse->h * sizeof *coarse->rhs);
    memset(coarse->height, 0, (size_t)coarse->w * (size_t)coarse->h * sizeof *coarse->height);
    for (int y = 0; y < fine->h; y++)
        for (int x = 0; x < fine->w; x++) {
            const size_t i = (size_t)y * (size_t)fine->w + (size_t)x;
            coarse->rhs[(size_t)(y / 2) * (size_t)coarse->w + (size_t)(x / 2)] +=
                fine->rhs[i] + neighbours(fine, x, y) - 4 * fine->height[i];
        }
}

/* Adds the coarse heights, bilinear between the middles of the blocks. */
static void prolongate(const grid *coarse, grid *fine)
{
    for (int y = 0; y < fine->h; y++)
        for (int x = 0; x < fine->w; x++) {
            const int cx = x / 2, cy = y / 2;
            const int nx = (cx + (x % 2 ? 1 : coarse->w - 1)) % coarse->w;
            const int ny = (cy + (y % 2 ? 1 : coarse->h - 1)) % coarse->h;
            const double *const row = coarse->height + (size_t)cy * (size_t)coarse->w;
            const double *const other = coarse->height + (size_t)ny * (size_t)coarse->w;
            fine->height[(size_t)y * (size_t)fine->w + (size_t)x] +=
                (9 * row[cx] + 3 * row[nx] + 3 * other[cx] + other[nx]) / 16;
        }
}

static void cycle(grid *levels, int n_levels)
{
    for (int k = 0; k + 1 < n_levels; k++) {
        relax(&levels[k], SWEEPS);
        restrict_residual(&levels[k], &levels[k + 1]);
    }
    relax(&levels[n_levels - 1], COARSEST_SWEEPS);
    for (int k = n_levels - 2; k >= 0; k--) {
        subtract_mean(levels[k + 1].height, levels[k + 1].w * levels[k + 1].h);
        prolongate(&levels[k + 1], &levels[k]);
        relax(&levels[k], SWEEPS);
    }
}

/* Halves while both sides are even.  Heights and right sides of all levels lie in `store`. */
static int plan_levels(int w, int h, grid levels[MAX_LEVELS], size_t *total)
{
    int n = 0;
    *total = 0;
    for (;; w /= 2, h /= 2) {
        levels[n++] = (grid){.w = w, .h = h};
        *total += 2 * (size_t)w * (size_t)h;
        if (w % 2 || h % 2 || w < 4 || h < 4 || n == MAX_LEVELS)
            return n;
    }
}

/* The divergence of the slopes: what flows in less what flows out. */
static void fill_rhs(grid *g, const double *dx, const double *dy)
{
    for (int y = 0; y < g->h; y++)
        for (int x = 0; x < g->w; x++) {
            const size_t row = (size_t)y * (size_t)g->w, i = row + (size_t)x;
            const size_t left = row + (size_t)(x > 0 ? x - 1 : g->w - 1);
            const size_t above = (size_t)(y > 0 ? y - 1 : g->h - 1) * (size_t)g->w + (size_t)x;
            g->rhs[i] = dx[left] - dx[i] + dy[above] - dy[i];
            g->height[i] = 0;
        }
    subtract_mean(g->rhs, g->w * g->h); /* 0 but for rounding; anything left would never settle */
}

weft_err weft_height_from_slopes(int w, int h, const double *dx, const double *dy, double tolerance,
                                 double *height, weft_error *err)
{
    grid levels[MAX_LEVELS];
    size_t total;
    const size_t n = (size_t)w * (size_t)h;
    for (size_t i = 0; i < n; i++)
        if (!isfinite(dx[i]) || !isfinite(dy[i]))
            return weft_fail(err, WEFT_ERR_FORMAT,
                             "the slope at x %zu, y %zu is not a number: normals must be finite",
                             i % (size_t)w, i / (size_t)w);
    const int n_levels = plan_levels(w, h, levels, &total);
    double *const store = weft_alloc(total, sizeof *store, err);
    if (!store)
        return WEFT_ERR_NOMEM;
    double *next = store;
    for (int k = 0; k < n_levels; k++) {
        levels[k].height = next;
        levels[k].rhs = next + (size_t)levels[k].w * (size_t)levels[k].h;
        next = levels[k].rhs + (size_t)levels[k].w * (size_t)levels[k].h;
    }
    fill_rhs(&levels[0], dx, dy);
    memset(height, 0, n * sizeof *height);
    for (int round = 0; round < MAX_ROUNDS; round++) {
        double change = 0;
        cycle(levels, n_levels);
        subtract_mean(levels[0].height, w * h);
        for (size_t i = 0; i < n; i++) {
            change = fmax(change, fabs(levels[0].height[i] - height[i]));
            height[i] = levels[0].height[i];
        }
        if (change <= tolerance)
            break;
    }
    weft_free(store);
    return WEFT_OK;
}
