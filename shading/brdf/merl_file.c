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

weft_err weft_merl_read(const char *path, weft_merl **merl, weft_error *err)
{
    const size_t limit = HEADER_BYTES + 3 * sizeof(double) * (size_t)WEFT_MERL_MAX_CELLS;
    char *bytes = NULL;
    size_t n = 0;
    int size[3];
    bool any = false;
    weft_merl *new = NULL;
    WEFT_TRY(weft_file_read(path, limit, &bytes, &n, err));
    weft_err status = read_header(path, bytes, n, size, err);
    if (status == WEFT_OK)
        status = weft_merl_create(size, weft_path_name(path), &new, err);
    for (int c = 0; c < 3 && status == WEFT_OK; c++)
        status = read_colour(path, bytes, c, new, &any, err);
    if (status == WEFT_OK && !any)
        status = weft_fail(err, WEFT_ERR_FORMAT, "%s: all its cells are marked as not measured", path);
    weft_free(bytes);
    if (status == WEFT_OK)
        *merl = new;
    else
        weft_merl_destroy(new);
    return status;
}

/* ---- writing ---- */

weft_err weft_merl_save(const char *path, const weft_merl *merl, weft_error *err)
{
    const int32_t header[3] = {merl->size[0], merl->size[1], merl->size[2]};
    const size_t cells = weft_merl_cells(merl->size), n = HEADER_BYTES + 3 * sizeof(double) * cells;
    char *const bytes = weft_alloc(n, 1, err);
    if (!bytes)
        return WEFT_ERR_NOMEM;
    char *to = bytes + HEADER_BYTES;
    memcpy(bytes, header, HEADER_BYTES);
    for (int c = 0; c < 3; c++)
        for (size_t i = 0; i < cells; i++, to += sizeof(double)) {
            const double f = merl->value[c][i], stored = f >= 0 ? f / weft_merl_scale[c] : -1;
            memcpy(to, &stored, sizeof stored);
        }
    const weft_err status = weft_file_write(path, bytes, n, err);
    weft_free(bytes);
    return status;
}

/* `t` of weft_merl_cell(): 0 is the middle, 1 the corner; the half vector lies over azimuth `turn_rad`. */
static void directions_in(const int size[3], const int cell[3], double t, double turn_rad, double light[3],
                          double view[3])
{
    const double back = 0.5 * (1 - t), across = 2 * cell[2] + 1 < size[2] ? 1 - back : back;
    const double root = (cell[0] + back) / size[0], quarter = WEFT_PI / 2;
    weft_merl_directions(quarter * root * root, quarter * (cell[1] + back) / size[1],
                         WEFT_PI * (cell[2] + across) / size[2], light, view);
    double *const both[] = {light, view};
    for (int k = 0; k < 2; k++) {
        const double x = both[k][0], y = both[k][1];
        both[k][0] = x * cos(turn_rad) - y * sin(turn_rad);
        both[k][1] = x * sin(turn_rad) + y * cos(turn_rad);
    }
}

bool weft_merl_cell(const int size[3], const int cell[3], double light[3], double view[3])
{
    for (int k = 0; k <= 8; k++) {
        directions_in(size, cell, 0.999 * k / 8, 0, light, view);
        if (light[2] > 0 && view[2] > 0)
            return true;
    }
    return false;
}

typedef struct fill_job {
    const weft_brdf *brdf;
    const double *values;
    weft_merl *to;
} fill_job;

static void fill_rows(void *context, int band, int row_begin, int row_end)
{
    const fill_job *const job = context;
    weft_merl *const to = job->to;
    (void)band;
    for (int row = row_begin; row < row_end; row++)
        for (int p = 0; p < to->size[2]; p++) {
            const int cell[3] = {row / to->size[1], row % to->size[1], p};
            double light[3], view[3], f[3];
            if (!weft_merl_cell(to->size, cell, light, view))
                continue;
            weft_brdf_eval_one(job->brdf, job->values, light, view, f);
            for (int c = 0; c < 3; c++)
                to->value[c][(size_t)row * (size_t)to->size[2] + (size_t)p] = f[c];
        }
}

static const int database_size[3] = {WEFT_MERL_THETA_H, WEFT_MERL_THETA_D, WEFT_MERL_PHI_D};

/* Whether the value stays when the surface is turned under light and view. */
static weft_err check_isotropic(const weft_brdf *brdf, const double *values, weft_error *err)
{
    enum { STEP = 9 };
    int cell[3];
    for (cell[0] = 0; cell[0] < WEFT_MERL_THETA_H; cell[0] += STEP)
        for (cell[1] = 0; cell[1] < WEFT_MERL_THETA_D; cell[1] += STEP)
            for (cell[2] = 0; cell[2] < WEFT_MERL_PHI_D; cell[2] += STEP) {
                double light[3], view[3], f[2];
                for (int k = 0; k < 2; k++) {
                    double rgb[3];
                    directions_in(database_size, cell, 0, k ? 0.7 : 0, light, view);
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
    weft_merl *merl;
    if (brdf->flags & WEFT_BRDF_ANISOTROPIC)
        WEFT_TRY(check_isotropic(brdf, values, err));
    WEFT_TRY(weft_merl_create(database_size, brdf->name, &merl, err));
    weft_parallel_rows(merl->size[0] * merl->size[1], fill_rows, &(fill_job){brdf, values, merl});
    const weft_err status = weft_merl_save(path, merl, err);
    weft_merl_destroy(merl);
    return status;
}
