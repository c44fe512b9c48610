#include "host/cli/brdf_eval.h"

#include "core/mem.h"

#include <math.h>
#include <string.h>

/* What a column stands for. */
typedef enum role { ROLE_NONE, ROLE_DIRECTION, ROLE_PARAM } role;

/* The words for directions; a table uses the first six or some of the others. */
enum { LX, LY, LZ, VX, VY, VZ, NL, NV, PHI, PHI_L, PHI_V, N_DIRECTION_WORDS };
static const char *const direction_words[N_DIRECTION_WORDS] = {"lx", "ly", "lz",  "vx",    "vy",   "vz",
                                                               "nl", "nv", "phi", "phi_l", "phi_v"};

typedef struct table {
    const weft_brdf *brdf;
    const weft_csv *csv;
    const char *path;
    int direction[N_DIRECTION_WORDS];                   /* column, -1 when absent */
    int param[WEFT_BRDF_MAX_PLANES];                    /* column of each plane, -1: constant */
    const weft_brdf_param *owner[WEFT_BRDF_MAX_PLANES]; /* the row that a plane belongs to */
} table;

/* The plane of "f0_g"; -1 when the name is no channel of a colour. */
static int channel_plane(const weft_brdf *brdf, const char *name)
{
    const size_t n = strlen(name);
    char stem[64];
    if (n < 3 || n >= sizeof stem || name[n - 2] != '_')
        return -1;
    const char *const channel = strchr("rgb", name[n - 1]);
    memcpy(stem, name, n - 2);
    stem[n - 2] = '\0';
    int plane;
    const weft_brdf_param *const param = weft_brdf_find_param(brdf, stem, &plane);
    return param && param->components == 3 && channel ? plane + (int)(channel - "rgb") : -1;
}

static bool is_left_alone(const char *name)
{
    return strncmp(name, "out_", 4) == 0 || strcmp(name, "tag") == 0 || strcmp(name, "note") == 0;
}

/* Where a column's numbers go: the first of `n` places; NULL when its name is unknown. */
static int *places_of(table *t, const char *name, int *n)
{
    *n = 1;
    for (int k = 0; k < N_DIRECTION_WORDS; k++)
        if (strcmp(name, direction_words[k]) == 0)
            return &t->direction[k];
    int plane;
    const weft_brdf_param *const param = weft_brdf_find_param(t->brdf, name, &plane);
    if (param) {
        *n = param->components;
        return &t->param[plane];
    }
    plane = channel_plane(t->brdf, name);
    return plane >= 0 ? &t->param[plane] : NULL;
}

static weft_err assign_column(table *t, int column, weft_error *err)
{
    const char *const name = t->csv->names[column];
    int n;
    if (is_left_alone(name))
        return WEFT_OK;
    int *const places = places_of(t, name, &n);
    if (!places)
        return weft_fail(err, WEFT_ERR_FORMAT,
                         "%s: column %s is neither a direction (nl nv phi, or lx ly lz vx vy vz) nor a "
                         "parameter of %s",
                         t->path, name, t->brdf->name);
    for (int c = 0; c < n; c++) {
        if (places[c] >= 0)
            return weft_fail(err, WEFT_ERR_FORMAT, "%s: columns %s and %s give the same thing; leave one out",
                             t->path, t->csv->names[places[c]], name);
        places[c] = column;
    }
    return WEFT_OK;
}

static weft_err assign_columns(table *t, weft_error *err)
{
    int plane = 0;
    for (int k = 0; k < N_DIRECTION_WORDS; k++)
        t->direction[k] = -1;
    for (int k = 0; k < WEFT_BRDF_MAX_PLANES; k++)
        t->param[k] = -1;
    for (const weft_brdf_param *p = t->brdf->params; p->name; p++)
        for (int c = 0; c < p->components; c++)
            t->owner[plane++] = p;
    for (int column = 0; column < t->csv->columns; column++)
        WEFT_TRY(assign_column(t, column, err));
    bool vectors = false, angles = false;
    for (int k = 0; k < N_DIRECTION_WORDS; k++)
        *(k < NL ? &vectors : &angles) |= t->direction[k] >= 0;
    if (vectors && angles)
        return weft_fail(err, WEFT_ERR_FORMAT,
                         "%s: directions are vectors (lx ly lz vx vy vz) or angles (nl nv phi), not both",
                         t->path);
    for (int k = vectors ? LX : NL; k < (vectors ? NL : PHI); k++)
        if (t->direction[k] < 0)
            return weft_fail(err, WEFT_ERR_FORMAT, "%s: there is no column %s", t->path, direction_words[k]);
    return WEFT_OK;
}

/* Column of a direction word at a row; 0 when the table has none. */
static weft_err direction_cell(const table *t, int row, int word, double *value, weft_error *err)
{
    *value = 0;
    if (t->direction[word] < 0)
        return WEFT_OK;
    return weft_csv_number(t->csv, row, t->direction[word], t->path, value, err);
}

static weft_err read_vector(const table *t, int row, int first_word, double d[3], weft_error *err)
{
    for (int c = 0; c < 3; c++)
        WEFT_TRY(direction_cell(t, row, first_word + c, &d[c], err));
    const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    if (!(fabs(length - 1) < 1e-6))
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: row %d: %s is %g long, wanted a unit vector", t->path,
                         row + 1, first_word == LX ? "lx ly lz" : "vx vy vz", length);
    return WEFT_OK;
}

static weft_err read_angles(const table *t, int row, int cosine_word, double phi, double d[3],
                            weft_error *err)
{
    double cosine;
    WEFT_TRY(direction_cell(t, row, cosine_word, &cosine, err));
    if (!(fabs(cosine) <= 1))
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: row %d: %s is %g, wanted a cosine from -1 to 1", t->path,
                         row + 1, direction_words[cosine_word], cosine);
    weft_brdf_direction(cosine, phi, d);
    return WEFT_OK;
}

static weft_err read_directions(const table *t, int row, double l[3], double v[3], weft_error *err)
{
    double phi, phi_l, phi_v;
    if (t->direction[LX] >= 0) {
        WEFT_TRY(read_vector(t, row, LX, l, err));
        return read_vector(t, row, VX, v, err);
    }
    WEFT_TRY(direction_cell(t, row, PHI, &phi, err));
    WEFT_TRY(direction_cell(t, row, PHI_L, &phi_l, err));
    WEFT_TRY(direction_cell(t, row, PHI_V, &phi_v, err));
    WEFT_TRY(read_angles(t, row, NL, phi_l, l, err));
    return read_angles(t, row, NV, phi_v + phi, v, err);
}

static weft_err read_params(const table *t, int row, double values[WEFT_BRDF_MAX_PLANES], bool *rgb,
                            weft_error *err)
{
    for (int k = 0; k < weft_brdf_n_planes(t->brdf); k++) {
        if (t->param[k] < 0)
            continue;
        WEFT_TRY(weft_csv_number(t->csv, row, t->param[k], t->path, &values[k], err));
        if (weft_brdf_check_value(t->brdf, t->owner[k], values[k], err) != WEFT_OK)
            return weft_prefix(err, WEFT_ERR_FORMAT, "%s: row %d", t->path, row + 1);
    }
    for (int k = 0; k + 1 < weft_brdf_n_planes(t->brdf); k++)
        *rgb |= t->owner[k] == t->owner[k + 1] && values[k] != values[k + 1];
    return WEFT_OK;
}

weft_err weft_brdf_eval_table(const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES],
                              const weft_csv *csv, const char *path, bool *rgb, double **value,
                              weft_error *err)
{
    table t = {.brdf = brdf, .csv = csv, .path = path};
    WEFT_TRY(assign_columns(&t, err));
    const size_t rows = (size_t)csv->rows;
    double *const out = weft_alloc(3 * rows, sizeof *out, err);
    weft_err status = out ? WEFT_OK : WEFT_ERR_NOMEM;
    bool differs = false;
    for (int row = 0; row < csv->rows && status == WEFT_OK; row++) {
        double l[3], v[3], f[3], at_row[WEFT_BRDF_MAX_PLANES];
        memcpy(at_row, values, sizeof at_row);
        status = read_directions(&t, row, l, v, err);
        if (status == WEFT_OK)
            status = read_params(&t, row, at_row, &differs, err);
        if (status != WEFT_OK)
            break;
        weft_brdf_eval_one(brdf, at_row, l, v, f);
        for (size_t c = 0; c < 3; c++)
            out[c * rows + (size_t)row] = f[c];
    }
    if (status != WEFT_OK) {
        weft_free(out);
        return status;
    }
    *rgb = differs;
    *value = out;
    return WEFT_OK;
}
