#include "shading/vectors/vectors_single.h"

#include "core/text.h"
#include "core/vectors.h"
#include "shading/brdf/brdf.h"

#include <math.h>

const weft_vectors_single weft_vectors_singles[] = {
    {"blog_disney", "disney",
     "r g b subsurface metallic specular specularTint roughness anisotropic sheen sheenTint clearcoat "
     "clearcoatGloss",
     "nl phi_l nv phi_v", "r g b"},
    {"cloth_brdf", "cloth", "cdiff cdiff cdiff f0 f0 f0 alpha 4", "nl 0 nv phi", "f"},
    {"cod_msdiffuse", "lambert-multiscatter", "1 1 1 gloss", "nl 0 nv phi", "fr"},
    {"fc3_brdf", "blinn-phong", "f0 f0 f0 gloss", "nl 0 nv phi", "f"},
    {"ord_beckmann", "beckmann", "f0 f0 f0 m", "nl 0 nv phi", "f"},
    {"ord_diffuse", "lambert-balanced", "1 1 1 f0 f0 f0", "nl 0 nv phi", "balanced"},
    {"ord_diffuse", "lambert-coupled", "1 1 1 f0 f0 f0", "nl 0 nv phi", "coupled"},
    {"ord_ggx_aniso", "ggx-anisotropic", "f0 f0 f0 alpha anisotropy", "nl phi_l nv phi_v", "f"},
    {"ord_ggx_spec", "ggx-specular", "f0 f0 f0 alpha", "nl 0 nv phi", "f"},
    {"ue4_brdf", "unreal", "f0 f0 f0 1 roughness 1", "nl 0 nv phi", "f"},
    {0},
};

/* Word `index` of `words` in a row: the number itself, or the cell of that column. */
static weft_err value_of(const char *words, int index, const weft_csv *csv, int row, const char *path,
                         double *value, weft_error *err)
{
    char word[64];
    weft_vectors_word(words, index, word);
    const char *const end = weft_text_scan_double(word, value);
    if (end && *end == '\0')
        return WEFT_OK;
    const int column = weft_csv_column(csv, word);
    if (column < 0)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: there is no column %s", path, word);
    return weft_csv_number(csv, row, column, path, value, err);
}

/* The arguments of one row as they are, rounded, and rounded as double again. */
typedef struct arguments {
    double light[3], view[3], param[WEFT_BRDF_MAX_PLANES];
} arguments;

static weft_err read_row(const weft_vectors_single *single, const weft_brdf *brdf, const weft_csv *csv,
                         int row, const char *path, arguments *a, weft_error *err)
{
    double angles[4];
    for (int k = 0; k < weft_brdf_n_planes(brdf); k++)
        WEFT_TRY(value_of(single->planes, k, csv, row, path, &a->param[k], err));
    for (int k = 0; k < 4; k++)
        WEFT_TRY(value_of(single->angles, k, csv, row, path, &angles[k], err));
    weft_brdf_direction(angles[0], angles[1], a->light);
    weft_brdf_direction(angles[2], angles[3], a->view);
    return WEFT_OK;
}

/* Rounds one argument in place. */
static float rounded(double *value)
{
    volatile float through_memory = (float)*value; /* gcc 12 drops the rounding of pairs otherwise */
    *value = (double)through_memory;
    return through_memory;
}

/* Evaluates at rounded arguments in both precisions. */
static void eval_rounded(const weft_brdf *brdf, arguments *a, float single[3], double precise[3])
{
    float light[3], view[3], param[WEFT_BRDF_MAX_PLANES];
    float *const out[3] = {&single[0], &single[1], &single[2]};
    weft_brdf_batch_f32 batch = {.n = 1};
    for (int c = 0; c < 3; c++) {
        light[c] = rounded(&a->light[c]);
        view[c] = rounded(&a->view[c]);
        batch.light[c] = &light[c];
        batch.view[c] = &view[c];
    }
    for (int k = 0; k < weft_brdf_n_planes(brdf); k++) {
        param[k] = rounded(&a->param[k]);
        batch.param[k] = &param[k];
    }
    brdf->eval_f32(&batch, out);
    weft_brdf_eval_one(brdf, a->param, a->light, a->view, precise);
}

static double relative(double got, double want)
{
    return fabs(want) > WEFT_VECTORS_SINGLE_ATOL ? fabs(got - want) / fabs(want) : 0;
}

static void compare(double got, double precise, double want, int row, weft_vectors_single_result *result)
{
    const double allowed =
        WEFT_VECTORS_SINGLE_ATOL + WEFT_VECTORS_SINGLE_RTOL * fabs(want) + fabs(precise - want);
    const double share = isfinite(got) ? fabs(got - want) / allowed : (double)INFINITY;
    result->table_rel = fmax(result->table_rel, relative(got, want));
    result->kernel_rel = fmax(result->kernel_rel, relative(got, precise));
    if (!(share <= result->worst_share)) {
        result->worst_share = share;
        result->worst_row = row + 1;
        result->worst_got = got;
        result->worst_want = want;
    }
}

weft_err weft_vectors_single_run(const weft_vectors_single *single, const weft_csv *csv, const char *path,
                                 weft_vectors_single_result *result, weft_error *err)
{
    const weft_brdf *brdf;
    weft_vectors_single_result made = {0};
    WEFT_TRY(weft_brdf_find(single->brdf, &brdf, err));
    for (int row = 0; row < csv->rows; row++) {
        arguments a;
        float got[3];
        double precise[3];
        char word[64], name[72];
        WEFT_TRY(read_row(single, brdf, csv, row, path, &a, err));
        eval_rounded(brdf, &a, got, precise);
        for (int c = 0; c < 3 && weft_vectors_word(single->outputs, c, word); c++) {
            double want;
            snprintf(name, sizeof name, "out_%s", word);
            WEFT_TRY(value_of(name, 0, csv, row, path, &want, err));
            compare((double)got[c], precise[c], want, row, &made);
        }
    }
    *result = made;
    return WEFT_OK;
}
