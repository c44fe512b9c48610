#include "shading/brdf/merl.h"

#include "core/file.h"
#include "core/mem.h"
#include "shading/brdf/half_vector.h"
#include "shading/brdf/sampling.h"

static const weft_brdf_param no_params[] = {{0}};

void weft_merl_directions(double theta_h, double theta_d, double phi_d, double light[3], double view[3])
{
    const double sh = sin(theta_h), ch = cos(theta_h), across = sin(theta_d) * sin(phi_d);
    const double along = sin(theta_d) * cos(phi_d), up = cos(theta_d);
    /* (along, across, up) about h, turned by theta_h about Y; the view is on the other side of h */
    light[0] = ch * along + sh * up;
    light[1] = across;
    light[2] = ch * up - sh * along;
    view[0] = sh * up - ch * along;
    view[1] = -across;
    view[2] = ch * up + sh * along;
}

void weft_merl_angles(const double light[3], const double view[3], double *theta_h, double *theta_d,
                      double *phi_d)
{
    double h[3], d[3], length2 = 0;
    for (int c = 0; c < 3; c++) {
        h[c] = light[c] + view[c];
        d[c] = light[c] - view[c];
        length2 += h[c] * h[c];
    }
    const double aside = sqrt(h[0] * h[0] + h[1] * h[1]);
    *theta_h = length2 > 0 ? atan2(aside, h[2]) : 0;
    *theta_d = atan2(sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), sqrt(length2));
    /* d = l - v is across h: its parts in the plane of n and h, and beside it */
    const double x = aside > 0 ? h[0] / aside : 1, y = aside > 0 ? h[1] / aside : 0;
    const double along = cos(*theta_h) * (x * d[0] + y * d[1]) - sin(*theta_h) * d[2];
    const double across = x * d[1] - y * d[0];
    const double phi = atan2(across, along);
    *phi_d = phi < 0 ? phi + WEFT_PI : phi >= WEFT_PI ? 0 : phi;
}

/* The two cells around a coordinate that counts middles of cells, and the weight of the second. */
static double around(double at, int size, bool wraps, int cell[2])
{
    const double below = floor(at);
    cell[0] = (int)below;
    cell[1] = cell[0] + 1;
    for (int k = 0; k < 2; k++) {
        if (wraps)
            cell[k] = (cell[k] % size + size) % size;
        else
            cell[k] = cell[k] < 0 ? 0 : cell[k] > size - 1 ? size - 1 : cell[k];
    }
    return at - below;
}

static void look_up(const weft_merl *merl, const double light[3], const double view[3], double value[3])
{
    double angle[3], weight[3], sum[3] = {0}, total[3] = {0};
    int cell[3][2];
    weft_merl_angles(light, view, &angle[0], &angle[1], &angle[2]);
    const double quarter = 2 / WEFT_PI, root = sqrt(weft_max(angle[0], 0) * quarter);
    const double at[3] = {merl->size[0] * root, merl->size[1] * angle[1] * quarter,
                          merl->size[2] * angle[2] * quarter / 2};
    for (int k = 0; k < 3; k++)
        weight[k] = around(at[k] - 0.5, merl->size[k], k == 2, cell[k]);
    for (int corner = 0; corner < 8; corner++) {
        double w = 1;
        size_t index = 0;
        for (int k = 0; k < 3; k++) {
            const int second = corner >> k & 1;
            w *= second ? weight[k] : 1 - weight[k];
            index = index * (size_t)merl->size[k] + (size_t)cell[k][second];
        }
        for (int c = 0; c < 3; c++) {
            const double f = merl->value[c][index];
            sum[c] += f >= 0 ? w * f : 0;
            total[c] += f >= 0 ? w : 0;
        }
    }
    for (int c = 0; c < 3; c++)
        value[c] = total[c] > 0 ? sum[c] / total[c] : 0;
}

static void value_at(const weft_merl *merl, const double light[3], double view[3], double f[3])
{
    f[0] = f[1] = f[2] = 0;
    if (view[2] < WEFT_MIN_NV) { /* the limit of a grazing view: the table has nothing below it */
        const double side = sqrt(view[0] * view[0] + view[1] * view[1]), flat = sqrt(1 - 1e-8);
        view[0] = side > 0 ? view[0] / side * flat : flat;
        view[1] = side > 0 ? view[1] / side * flat : 0;
        view[2] = WEFT_MIN_NV;
    }
    if (light[2] > 0)
        look_up(merl, light, view, f);
}

static void eval(const weft_brdf_batch *b, double *const value[3])
{
    for (int i = 0; i < b->n; i++) {
        const double light[3] = {b->light[0][i], b->light[1][i], b->light[2][i]};
        double view[3] = {b->view[0][i], b->view[1][i], b->view[2][i]}, f[3];
        value_at(b->data, light, view, f);
        for (int c = 0; c < 3; c++)
            value[c][i] = f[c];
    }
}

/* A look-up gains nothing from single precision; only the arrays have it. */
static void eval_f32(const weft_brdf_batch_f32 *b, float *const value[3])
{
    for (int i = 0; i < b->n; i++) {
        double light[3], view[3], f[3];
        for (int c = 0; c < 3; c++) {
            light[c] = (double)b->light[c][i];
            view[c] = (double)b->view[c][i];
        }
        value_at(b->data, light, view, f);
        for (int c = 0; c < 3; c++)
            value[c][i] = (float)f[c];
    }
}

static void make_model(weft_merl *merl)
{
    merl->brdf = (weft_brdf){
        .name = merl->name,
        .summary = "a table over half and difference angles (MERL)",
        .source = "Matusik et al. 2003; Rusinkiewicz 1998",
        .flags = WEFT_BRDF_RECIPROCAL,
        .params = no_params,
        .data = merl,
        .eval = eval,
        .eval_f32 = eval_f32,
        .sample = weft_brdf_sample_cosine,
        .pdf = weft_brdf_pdf_cosine,
    };
}

weft_err weft_merl_create(const int size[3], const char *name, weft_merl **merl, weft_error *err)
{
    weft_merl *const new = weft_alloc(1, sizeof *new, err);
    const size_t cells = weft_merl_cells(size);
    bool made = new && (new->name = weft_strdup(name, err));
    for (int k = 0; k < 3 && made; k++) {
        new->size[k] = size[k];
        new->value[k] = weft_alloc(cells, sizeof(double), err);
        made = new->value[k] != NULL;
        for (size_t i = 0; i < cells && made; i++)
            new->value[k][i] = -1;
    }
    if (!made) {
        weft_merl_destroy(new);
        return WEFT_ERR_NOMEM;
    }
    make_model(new);
    *merl = new;
    return WEFT_OK;
}

void weft_merl_destroy(weft_merl *merl)
{
    if (!merl)
        return;
    for (int c = 0; c < 3; c++)
        weft_free(merl->value[c]);
    weft_free(merl->name);
    weft_free(merl);
}

weft_err weft_brdf_open(const char *name, weft_merl **loaded, const weft_brdf **brdf, weft_error *err)
{
    *loaded = NULL;
    if (!weft_path_has_suffix(name, ".binary"))
        return weft_brdf_find(name, brdf, err);
    WEFT_TRY(weft_merl_read(name, loaded, err));
    *brdf = &(*loaded)->brdf;
    return WEFT_OK;
}
