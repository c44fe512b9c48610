#include "shading/preview/voxel_grid.h"

#include "core/mem.h"

#include <math.h>

weft_err weft_voxels_init(weft_voxels *voxels, const double low[3], const double high[3], int n_longest,
                          weft_error *err)
{
    weft_voxels made = {0};
    double longest = 0;
    size_t cells = 1;
    for (int c = 0; c < 3; c++)
        longest = fmax(longest, high[c] - low[c]);
    if (n_longest < 8 || n_longest > 1024 || !(longest > 0) || !isfinite(longest))
        return weft_fail(err, WEFT_ERR_RANGE, "a grid of %d cells a side; wanted 8 to 1024", n_longest);
    made.side = longest / n_longest;
    for (int c = 0; c < 3; c++) {
        made.n[c] = (int)ceil((high[c] - low[c]) / made.side - 1e-9) + 2;
        made.low[c] = 0.5 * (low[c] + high[c] - made.n[c] * made.side);
        cells *= (size_t)made.n[c];
    }
    made.bits = weft_alloc((cells + 31) / 32, sizeof *made.bits, err);
    if (!made.bits)
        return WEFT_ERR_NOMEM;
    *voxels = made;
    return WEFT_OK;
}

void weft_voxels_fini(weft_voxels *voxels)
{
    weft_free(voxels->bits);
    *voxels = (weft_voxels){0};
}

static size_t cell_index(const weft_voxels *v, const int cell[3])
{
    return ((size_t)cell[2] * (size_t)v->n[1] + (size_t)cell[1]) * (size_t)v->n[0] + (size_t)cell[0];
}

static bool cell_full(const weft_voxels *v, const int cell[3])
{
    const size_t at = cell_index(v, cell);
    return v->bits[at / 32] >> (at % 32) & 1;
}

static bool inside(const weft_voxels *v, const int cell[3])
{
    return cell[0] >= 0 && cell[0] < v->n[0] && cell[1] >= 0 && cell[1] < v->n[1] && cell[2] >= 0 &&
           cell[2] < v->n[2];
}

static void cell_of(const weft_voxels *v, const double point[3], int cell[3])
{
    for (int c = 0; c < 3; c++)
        cell[c] = (int)floor((point[c] - v->low[c]) / v->side);
}

bool weft_voxels_full(const weft_voxels *voxels, const double point[3])
{
    int cell[3];
    cell_of(voxels, point, cell);
    return inside(voxels, cell) && cell_full(voxels, cell);
}

/* ---- filling ---- */

/* Whether the axis parts the triangle (about the cell's middle) from a cube of half side `half`. */
static bool parted(const double axis[3], double t[3][3], double half)
{
    double low = INFINITY, high = -INFINITY;
    const double reach = half * (fabs(axis[0]) + fabs(axis[1]) + fabs(axis[2]));
    for (int k = 0; k < 3; k++) {
        const double p = axis[0] * t[k][0] + axis[1] * t[k][1] + axis[2] * t[k][2];
        low = fmin(low, p);
        high = fmax(high, p);
    }
    return low > reach || high < -reach;
}

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static bool touches(double t[3][3], double half)
{
    double edges[3][3], axis[3];
    for (int k = 0; k < 3; k++)
        for (int c = 0; c < 3; c++)
            edges[k][c] = t[(k + 1) % 3][c] - t[k][c];
    for (int c = 0; c < 3; c++) {
        const double unit[3] = {c == 0, c == 1, c == 2};
        if (parted(unit, t, half))
            return false;
        for (int k = 0; k < 3; k++) {
            cross(unit, edges[k], axis);
            if (parted(axis, t, half))
                return false;
        }
    }
    cross(edges[0], edges[1], axis);
    return !parted(axis, t, half);
}

void weft_voxels_add_triangle(weft_voxels *voxels, const double a[3], const double b[3], const double c[3])
{
    int first[3], last[3], cell[3];
    for (int k = 0; k < 3; k++) {
        const double low = fmin(a[k], fmin(b[k], c[k])), high = fmax(a[k], fmax(b[k], c[k]));
        first[k] = (int)fmax(0, floor((low - voxels->low[k]) / voxels->side));
        last[k] = (int)fmin(voxels->n[k] - 1, floor((high - voxels->low[k]) / voxels->side));
    }
    for (cell[2] = first[2]; cell[2] <= last[2]; cell[2]++)
        for (cell[1] = first[1]; cell[1] <= last[1]; cell[1]++)
            for (cell[0] = first[0]; cell[0] <= last[0]; cell[0]++) {
                double t[3][3];
                for (int k = 0; k < 3; k++) {
                    const double middle = voxels->low[k] + (cell[k] + 0.5) * voxels->side;
                    t[0][k] = a[k] - middle;
                    t[1][k] = b[k] - middle;
                    t[2][k] = c[k] - middle;
                }
                const size_t at = cell_index(voxels, cell);
                if (touches(t, 0.5 * voxels->side))
                    voxels->bits[at / 32] |= 1u << (at % 32);
            }
}

/* ---- rays ---- */

/* Start off the surface, and how far the ray is worth following. */
static double start(const weft_voxels *v, const weft_voxel_ray *ray, double from[3])
{
    double end = ray->reach;
    for (int c = 0; c < 3; c++)
        from[c] = ray->from[c] + WEFT_VOXEL_OFFSET * v->side * ray->normal[c];
    for (int c = 0; c < 3; c++) { /* where the grid ends */
        const double wall = ray->to[c] > 0 ? v->low[c] + v->n[c] * v->side : v->low[c];
        if (fabs(ray->to[c]) > 1e-12)
            end = fmin(end, (wall - from[c]) / ray->to[c]);
    }
    return end;
}

double weft_voxels_step(const weft_voxels *voxels, const weft_voxel_ray *ray, int steps)
{
    double from[3];
    return start(voxels, ray, from) / (steps * voxels->side);
}

bool weft_voxels_lit_marched(const weft_voxels *voxels, const weft_voxel_ray *ray, int steps, double dither)
{
    double from[3];
    const double end = start(voxels, ray, from);
    for (int k = 0; k < steps && end > 0; k++) {
        const double t = end * (k + dither) / steps;
        const double at[3] = {from[0] + t * ray->to[0], from[1] + t * ray->to[1], from[2] + t * ray->to[2]};
        if (weft_voxels_full(voxels, at))
            return false;
    }
    return true;
}

/* Brings a ray that starts outside to the grid's wall; false when it passes by. */
static bool enter(const weft_voxels *v, const weft_voxel_ray *ray, double from[3], double *t)
{
    double in = 0, out = INFINITY;
    for (int c = 0; c < 3; c++) {
        const double high = v->low[c] + v->n[c] * v->side;
        if (fabs(ray->to[c]) < 1e-12) {
            if (from[c] < v->low[c] || from[c] >= high)
                return false;
            continue;
        }
        const double a = (v->low[c] - from[c]) / ray->to[c], b = (high - from[c]) / ray->to[c];
        in = fmax(in, fmin(a, b));
        out = fmin(out, fmax(a, b));
    }
    *t = in;
    return in < out;
}

bool weft_voxels_lit_walked(const weft_voxels *voxels, const weft_voxel_ray *ray)
{
    double from[3], t = 0, next[3], apart[3];
    int cell[3], step[3];
    const double end = start(voxels, ray, from);
    if (!enter(voxels, ray, from, &t))
        return true;
    for (int c = 0; c < 3; c++) {
        const double at = (from[c] + (t + 1e-9 * voxels->side) * ray->to[c] - voxels->low[c]) / voxels->side;
        cell[c] = (int)floor(at);
        step[c] = ray->to[c] > 0 ? 1 : -1;
        const double rate = fabs(ray->to[c]) / voxels->side;
        apart[c] = rate > 1e-12 ? 1 / rate : HUGE_VAL;
        next[c] = rate > 1e-12 ? t + (ray->to[c] > 0 ? cell[c] + 1 - at : at - cell[c]) / rate : HUGE_VAL;
    }
    while (t < end && inside(voxels, cell)) {
        if (cell_full(voxels, cell))
            return false;
        const int c = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : next[1] < next[2] ? 1 : 2;
        t = next[c];
        next[c] += apart[c];
        cell[c] += step[c];
    }
    return true;
}
