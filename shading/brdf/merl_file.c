#include "core/file.h"
#include "core/mem.h"
#include "core/parallel.h"
#include "shading/brdf/half_vector.h"
#include "shading/brdf/merl.h"

#include <stdint.h>
#include <string.h>

enum {
    HEADER_BYTES = 3 * sizeof(int32_t),
    N_CELLS = WEFT_MERL_THETA_H * WEFT_MERL_THETA_D * WEFT_MERL_PHI_D
};

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the file is little-endian");

const double weft_merl_scale[3] = {1.0 / 1500, 1.15 / 1500, 1.66 / 1500};

/* ---- reading ---- */

static weft_err read_header(const char *path, const char *bytes, size_t n, int size[3], weft_error *err)
{
    int32_t header[3] = {0};
    if (n >= HEADER_BYTES)
        memcpy(header, bytes, HEADER_BYTES);
    for (int k = 0; k < 3; k++) {
        if (header[k] < 1 || header[k] > WEFT_MERL_MAX_SIDE)
            return weft_fail(
                err, WEFT_ERR_FORMAT,
                "%s: its header counts %d x %d x %d cells, which no MERL table has (%d x %d x %d)", path,
                header[0], header[1], header[2], WEFT_MERL_THETA_H, WEFT_MERL_THETA_D, WEFT_MERL_PHI_D);
        size[k] = header[k];
    }
    const size_t cells = weft_merl_cells(size), wanted = HEADER_BYTES + 3 * sizeof(double) * cells;
    if (cells > WEFT_MERL_MAX_CELLS)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: its header counts %zu cells, more than %d", path, cells,
                         WEFT_MERL_MAX_CELLS);
    if (n != wanted)
        return weft_fail(err, WEFT_ERR_FORMAT,
                         "%s: a table of %d x %d x %d cells has %zu bytes, this file %zu; copy it again",
                         path, size[0], size[1], size[2], wanted, n);
    return WEFT_OK;
}

static weft_err read_colour(const char *path, const char *bytes, int colour, weft_merl *merl, bool *any,
                            weft_error *err)
{
    static const char *const colours[] = {"red", "green", "blue"};
    const size_t cells = weft_merl_cells(merl->size), row = (size_t)merl->size[2];
    double *const to = merl->value[colour];
    memcpy(to, bytes + HEADER_BYTES + sizeof(double) * cells * (size_t)colour, sizeof(double) * cells);
    for (size_t i = 0; i < cells; i++) {
        to[i] *= weft_merl_scale[colour];
        if (!isfinite(to[i]))
            return weft_fail(err, WEFT_ERR_FORMAT,
                             "%s: %s of cell %zu, %zu, %zu (theta_h, theta_d, phi_d) is no number", path,
                             colours[colour], i / row / (size_t)merl->size[1],
                             i / row % (size_t)merl->size[1], i % row);
        *any |= to[i] >= 0;
    }
    return WEFT_OK;
}

static weft_err read_bytes(const char *path, const char *bytes, size_t n, weft_merl *merl, weft_error *err)
{
    bool any = false;
    WEFT_TRY(read_header(path, bytes, n, merl->size, err));
    if (!(merl->name = weft_strdup(weft_path_name(path), err)))
        return WEFT_ERR_NOMEM;
    for (int c = 0; c < 3; c++) {
        if (!(merl->value[c] = weft_alloc(weft_merl_cells(merl->size), sizeof(double), err)))
            return WEFT_ERR_NOMEM;
        WEFT_TRY(read_colour(path, bytes, c, merl, &any, err));
    }
    return any ? WEFT_OK
               : weft_fail(err, WEFT_ERR_FORMAT, "%s: all its cells are marked as not measured", path);
}

weft_err weft_merl_read(const char *path, weft_merl **merl, weft_error *err)
{
    const size_t limit = HEADER_BYTES + 3 * sizeof(double) * (size_t)WEFT_MERL_MAX_CELLS;
    char *bytes = NULL;
    size_t n = 0;
    WEFT_TRY(weft_file_read(path, limit, &bytes, &n, err));
    weft_merl *const new = weft_alloc(1, sizeof *new, err);
    const weft_err status = new ? read_bytes(path, bytes, n, new, err) : WEFT_ERR_NOMEM;
    weft_free(bytes);
    if (status != WEFT_OK) {
        weft_merl_destroy(new);
        return status;
    }
    weft_merl_make_model(new);
    *merl = new;
    return WEFT_OK;
}

/* ---- writing ---- */

typedef struct fill_job {
    const weft_brdf *brdf;
    const double *values;
    double *to; /* [3][N_CELLS], scaled */
} fill_job;

/* Light and view at a place in cell (h, d, p), half vector over azimuth `turn_rad`.  `t` 0 is the middle, 1
 * the corner farthest above the horizon: the smallest angles of the cell, phi_d next to 90 degrees. */
static void cell_directions(int h, int d, int p, double t, double turn_rad, double light[3], double view[3])
{
    const double back = 0.5 * (1 - t), across = p < WEFT_MERL_PHI_D / 2 ? 1 - back : back;
    const double root = (h + back) / WEFT_MERL_THETA_H, quarter = WEFT_PI / 2;
    weft_merl_directions(quarter * root * root, quarter * (d + back) / WEFT_MERL_THETA_D,
                         WEFT_PI * (p + across) / WEFT_MERL_PHI_D, light, view);
    double *const both[] = {light, view};
    for (int k = 0; k < 2; k++) {
        const double x = both[k][0], y = both[k][1];
        both[k][0] = x * cos(turn_rad) - y * sin(turn_rad);
        both[k][1] = x * sin(turn_rad) + y * cos(turn_rad);
    }
}

/* The place of a cell that stands for it: the middle, or the first above the horizon on the way to its
 * highest corner.  False where all of it is below. */
static bool choose_directions(int h, int d, int p, double light[3], double view[3])
{
    for (int k = 0; k <= 8; k++) {
        cell_directions(h, d, p, 0.999 * k / 8, 0, light, view);
        if (light[2] > 0 && view[2] > 0)
            return true;
    }
    return false;
}

static void fill_rows(void *context, int band, int row_begin, int row_end)
{
    const fill_job *const job = context;
    (void)band;
    for (int row = row_begin; row < row_end; row++)
        for (int p = 0; p < WEFT_MERL_PHI_D; p++) {
            double light[3], view[3], f[3];
            const size_t index = (size_t)row * WEFT_MERL_PHI_D + (size_t)p;
            const bool above =
                choose_directions(row / WEFT_MERL_THETA_D, row % WEFT_MERL_THETA_D, p, light, view);
            if (above)
                weft_brdf_eval_one(job->brdf, job->values, light, view, f);
            for (int c = 0; c < 3; c++)
                job->to[(size_t)c * N_CELLS + index] = above ? f[c] / weft_merl_scale[c] : -1;
        }
}

/* Whether the value stays when the surface is turned under light and view. */
static weft_err check_isotropic(const weft_brdf *brdf, const double *values, weft_error *err)
{
    enum { STEP = 9 };
    for (int h = 0; h < WEFT_MERL_THETA_H; h += STEP)
        for (int d = 0; d < WEFT_MERL_THETA_D; d += STEP)
            for (int p = 0; p < WEFT_MERL_PHI_D; p += STEP) {
                double light[3], view[3], f[2];
                for (int k = 0; k < 2; k++) {
                    double rgb[3];
                    cell_directions(h, d, p, 0, k ? 0.7 : 0, light, view);
                    weft_brdf_eval_one(brdf, values, light, view, rgb);
                    f[k] = rgb[1];
                }
                if (fabs(f[0] - f[1]) > 1e-6 * (f[0] + f[1]))
                    return weft_fail(err, WEFT_ERR_USAGE,
                                     "%s is anisotropic at these parameters: a MERL table has no place for "
                                     "that; set its anisotropy to 0",
                                     brdf->name);
            }
    return WEFT_OK;
}

weft_err weft_merl_write(const char *path, const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES],
                         weft_error *err)
{
    static const int32_t header[3] = {WEFT_MERL_THETA_H, WEFT_MERL_THETA_D, WEFT_MERL_PHI_D};
    const size_t n = HEADER_BYTES + 3 * sizeof(double) * (size_t)N_CELLS;
    if (brdf->flags & WEFT_BRDF_ANISOTROPIC)
        WEFT_TRY(check_isotropic(brdf, values, err));
    char *const bytes = weft_alloc(n, 1, err);
    double *const cells = weft_alloc(3 * (size_t)N_CELLS, sizeof(double), err);
    weft_err status = bytes && cells ? WEFT_OK : WEFT_ERR_NOMEM;
    if (status == WEFT_OK) {
        weft_parallel_rows(WEFT_MERL_THETA_H * WEFT_MERL_THETA_D, fill_rows,
                           &(fill_job){brdf, values, cells});
        memcpy(bytes, header, HEADER_BYTES);
        memcpy(bytes + HEADER_BYTES, cells, n - HEADER_BYTES);
        status = weft_file_write(path, bytes, n, err);
    }
    weft_free(cells);
    weft_free(bytes);
    return status;
}
