#include "host/cli/brdf_eval.h"
#include "host/cli/brdf_plot.h"
#include "host/cli/command.h"

#include "core/csv.h"
#include "core/file.h"
#include "core/mem.h"
#include "shading/brdf/merl.h"
#include "shading/brdf/specular_doubt.h"
#include "shading/vectors/vectors_tables.h"

#include <math.h>
#include <string.h>

typedef struct brdf_args {
    const char *eval, *plot, *merl;
    weft_texts params;
    bool furnace, reciprocity;
} brdf_args;

static const weft_field fields[] = {
    {.key = "eval",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(brdf_args, eval),
     .unit = "FILE.csv",
     .help = "print the rows of a table with the value at each appended"},
    {.key = "plot",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(brdf_args, plot),
     .unit = "FILE",
     .help = "draw it: NAME.svg lobes in the plane of incidence, NAME.png or .exr a slice over half angles"},
    {.key = "merl",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(brdf_args, merl),
     .unit = "FILE.binary",
     .help = "write it as a table of the MERL database's form: 90 x 90 x 180 cells, 35 MB"},
    {.key = "furnace",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(brdf_args, furnace),
     .help = "the share of an even white room's light that comes back, at eight views"},
    {.key = "reciprocity",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(brdf_args, reciprocity),
     .help = "how much the value changes when light and view change places"},
    {.key = "param",
     .short_opt = 'p',
     .type = WEFT_FIELD_TEXTS,
     .offset = offsetof(brdf_args, params),
     .unit = "NAME=VALUE",
     .help = "a parameter that the table does not give, also as r,g,b; may be given several times"},
    {0},
};

static void print_model(const weft_invocation *inv, const weft_brdf *brdf)
{
    fprintf(inv->out, "%s: %s\n  %s\n  %s%s%s\n", brdf->name, brdf->summary, brdf->source,
            brdf->flags & WEFT_BRDF_RECIPROCAL ? "reciprocal" : "not reciprocal",
            brdf->flags & WEFT_BRDF_PASSIVE ? ", conserves energy" : ", can gain energy",
            brdf->flags & WEFT_BRDF_ANISOTROPIC ? ", anisotropic" : "");
    for (const weft_brdf_param *p = brdf->params; p->name; p++)
        fprintf(inv->out, "  %-12s %s%g to %g%s%s (default %g)  %s\n", p->name,
                p->components == 3 ? "colour, " : "", p->min, p->max, p->unit[0] ? " " : "", p->unit, p->def,
                p->help);
}

static json_t *model_json(const weft_brdf *brdf)
{
    json_t *const params = json_array();
    for (const weft_brdf_param *p = brdf->params; p->name; p++)
        json_array_append_new(params, json_pack("{s:s, s:i, s:f, s:f, s:f, s:s, s:s}", "name", p->name,
                                                "components", p->components, "min", p->min, "max", p->max,
                                                "default", p->def, "unit", p->unit, "help", p->help));
    return json_pack("{s:s, s:s, s:s, s:b, s:b, s:b, s:o}", "name", brdf->name, "summary", brdf->summary,
                     "source", brdf->source, "reciprocal", brdf->flags & WEFT_BRDF_RECIPROCAL, "passive",
                     brdf->flags & WEFT_BRDF_PASSIVE, "anisotropic", brdf->flags & WEFT_BRDF_ANISOTROPIC,
                     "parameters", params);
}

static weft_err list_models(const weft_invocation *inv, const weft_brdf *only, weft_error *err)
{
    const weft_brdf *const one[] = {only, NULL};
    json_t *const models = json_array();
    for (const weft_brdf *const *b = only ? one : weft_brdfs; *b; b++) {
        if (inv->json)
            json_array_append_new(models, model_json(*b));
        else
            print_model(inv, *b);
        if (!inv->json && b[1])
            fputc('\n', inv->out);
    }
    if (inv->json)
        return weft_print_json(inv, json_pack("{s:o}", "models", models), err);
    json_decref(models);
    return WEFT_OK;
}

static void print_cell(FILE *out, const char *cell)
{
    if (!strpbrk(cell, ",\"\r\n")) {
        fputs(cell, out);
        return;
    }
    fputc('"', out);
    for (const char *p = cell; *p; p++) {
        if (*p == '"')
            fputc('"', out);
        fputc(*p, out);
    }
    fputc('"', out);
}

/* Prints the table with `n` columns behind it; values is [n][rows], NULL: the header. */
static weft_err print_table(FILE *out, const weft_csv *csv, int n, char (*names)[80], const double *values,
                            weft_error *err)
{
    for (int row = -1; row < csv->rows; row++) {
        for (int c = 0; c < csv->columns; c++) {
            print_cell(out, row < 0 ? csv->names[c] : weft_csv_cell(csv, row, c));
            fputc(',', out);
        }
        for (int k = 0; k < n; k++) {
            if (row < 0)
                fputs(names[k], out);
            else
                fprintf(out, "%.17g", values[(size_t)k * (size_t)csv->rows + (size_t)row]);
            fputc(k + 1 < n ? ',' : '\n', out);
        }
    }
    if (fflush(out) != 0 || ferror(out))
        return weft_fail_errno(err, WEFT_ERR_IO, "the result cannot be written");
    return WEFT_OK;
}

/* A function that is asked outside its domain answers NaN: that is no row to print. */
static weft_err check_finite(const double *values, int rows, int n, const char *path, weft_error *err)
{
    for (int row = 0; row < rows; row++)
        for (int k = 0; k < n; k++)
            if (!isfinite(values[(size_t)k * (size_t)rows + (size_t)row]))
                return weft_fail(err, WEFT_ERR_FORMAT,
                                 "%s: row %d: there is no value; is an input out of range?", path, row + 1);
    return WEFT_OK;
}

static weft_err eval_function(const weft_invocation *inv, const weft_vectors_model *model,
                              const weft_csv *csv, const char *path, weft_error *err)
{
    char names[WEFT_VECTORS_MAX_COLUMNS][80], word[64];
    double *values = NULL;
    int n;
    WEFT_TRY(weft_vectors_eval(model, csv, path, &n, &values, err));
    for (int k = 0; k < n; k++) {
        weft_vectors_word(model->outputs, k, word);
        snprintf(names[k], sizeof names[k], n == 1 ? "value" : "value_%s", word);
    }
    weft_err status = check_finite(values, csv->rows, n, path, err);
    if (status == WEFT_OK)
        status = print_table(inv->out, csv, n, names, values, err);
    weft_free(values);
    return status;
}

static weft_err eval_model(const weft_invocation *inv, const weft_brdf *brdf, const weft_texts *params,
                           const weft_csv *csv, const char *path, weft_error *err)
{
    char one[1][80] = {"value"}, three[3][80] = {"value_r", "value_g", "value_b"};
    double constant[WEFT_BRDF_MAX_PLANES], *values = NULL;
    bool rgb;
    weft_brdf_defaults(brdf, constant);
    for (int i = 0; i < params->n; i++)
        WEFT_TRY(weft_brdf_set(brdf, params->values[i], constant, err));
    WEFT_TRY(weft_brdf_eval_table(brdf, constant, csv, path, &rgb, &values, err));
    const weft_err status = print_table(inv->out, csv, rgb ? 3 : 1, rgb ? three : one, values, err);
    weft_free(values);
    return status;
}

/* Furnace and reciprocity: as text or JSON. */
static weft_err print_proofs(const weft_invocation *inv, const brdf_args *a, const weft_brdf *brdf,
                             const double *values, weft_error *err)
{
    enum { PAIRS = 20000 };
    double albedo[WEFT_FURNACE_VIEWS][3] = {{0}};
    const double change = a->reciprocity ? weft_brdf_reciprocity(brdf, values, PAIRS) : 0;
    if (a->furnace)
        weft_brdf_furnace(brdf, values, albedo);
    if (inv->json) {
        json_t *const rows = json_array();
        for (int i = 0; i < WEFT_FURNACE_VIEWS && a->furnace; i++)
            json_array_append_new(rows, json_pack("{s:f, s:[f, f, f]}", "nv", weft_furnace_nv[i], "albedo",
                                                  albedo[i][0], albedo[i][1], albedo[i][2]));
        json_t *const o = json_pack("{s:s, s:o}", "model", brdf->name, "furnace", rows);
        if (a->reciprocity)
            json_object_set_new(o, "largest_change", json_real(change));
        return weft_print_json(inv, o, err);
    }
    for (int i = -1; i < WEFT_FURNACE_VIEWS && a->furnace; i++)
        if (i < 0)
            fprintf(inv->out, "%6s  %-9s %-9s %-9s  (directional albedo)\n", "n.v", "red", "green", "blue");
        else
            fprintf(inv->out, "%6g  %.7f %.7f %.7f\n", weft_furnace_nv[i], albedo[i][0], albedo[i][1],
                    albedo[i][2]);
    if (a->reciprocity)
        fprintf(inv->out, "%s: light and view changed places change f by %.2g of itself at most (%d pairs)\n",
                brdf->name, change, PAIRS);
    return WEFT_OK;
}

/* What is said about the files that were written. */
static weft_err print_files(const weft_invocation *inv, const brdf_args *a, const weft_brdf *brdf,
                            weft_error *err)
{
    if (inv->json)
        return weft_print_json(
            inv, json_pack("{s:s, s:s*, s:s*}", "model", brdf->name, "plot", a->plot, "merl", a->merl), err);
    if (a->plot)
        fprintf(inv->out, "%s: %s\n", a->plot, brdf->name);
    if (a->merl)
        fprintf(inv->out, "%s: %s\n", a->merl, brdf->name);
    return WEFT_OK;
}

/* --plot, --merl, --furnace, --reciprocity. */
static weft_err examine(const weft_invocation *inv, const brdf_args *a, const weft_brdf *brdf,
                        weft_error *err)
{
    double values[WEFT_BRDF_MAX_PLANES];
    weft_brdf_defaults(brdf, values);
    for (int i = 0; i < a->params.n; i++)
        WEFT_TRY(weft_brdf_set(brdf, a->params.values[i], values, err));
    weft_specular_warn(brdf, values, NULL);
    if (a->plot)
        WEFT_TRY(weft_file_refuse_existing(a->plot, inv->force, err));
    if (a->merl && !weft_path_has_suffix(a->merl, ".binary"))
        return weft_fail(err, WEFT_ERR_USAGE, "--merl wants NAME.binary, not %s", a->merl);
    if (a->merl)
        WEFT_TRY(weft_file_refuse_existing(a->merl, inv->force, err));
    if (a->plot)
        WEFT_TRY(weft_brdf_plot(brdf, values, a->plot, err));
    if (a->merl)
        WEFT_TRY(weft_merl_write(a->merl, brdf, values, err));
    return a->furnace || a->reciprocity ? print_proofs(inv, a, brdf, values, err)
                                        : print_files(inv, a, brdf, err);
}

static weft_err eval(const weft_invocation *inv, const brdf_args *a, const weft_vectors_model *function,
                     const weft_brdf *brdf, weft_error *err)
{
    weft_csv csv;
    if (inv->json)
        return weft_fail(err, WEFT_ERR_USAGE, "--eval prints a table; it has no --json");
    if (function && a->params.n)
        return weft_fail(err, WEFT_ERR_USAGE, "%s takes all its inputs from the table, no --param",
                         inv->operands[0]);
    WEFT_TRY(weft_csv_read(a->eval, &csv, err));
    const weft_err status = function ? eval_function(inv, function, &csv, a->eval, err)
                                     : eval_model(inv, brdf, &a->params, &csv, a->eval, err);
    weft_csv_fini(&csv);
    return status;
}

static weft_err run(const weft_invocation *inv, const void *args, weft_error *err)
{
    const brdf_args *const a = args;
    const char *const name = inv->n_operands ? inv->operands[0] : NULL;
    const bool examines = a->plot || a->merl || a->furnace || a->reciprocity;
    if (examines && (!name || a->eval))
        return weft_fail(err, WEFT_ERR_USAGE,
                         "--plot, --merl, --furnace and --reciprocity want the NAME of a model%s",
                         a->eval ? ", and no --eval" : "");
    if (a->eval && !name)
        return weft_fail(err, WEFT_ERR_USAGE, "--eval wants the NAME of a model too");
    const weft_vectors_model *const function = a->eval ? weft_vectors_find(name) : NULL;
    const weft_brdf *brdf = NULL;
    weft_merl *loaded = NULL;
    if (name && !function)
        WEFT_TRY(weft_brdf_open(name, &loaded, &brdf, err));
    const weft_err status = a->eval    ? eval(inv, a, function, brdf, err)
                            : examines ? examine(inv, a, brdf, err)
                                       : list_models(inv, brdf, err);
    weft_merl_destroy(loaded);
    return status;
}

const weft_command weft_cmd_brdf = {
    .name = "brdf",
    .summary = "list the reflectance models with their parameters, evaluate, plot and prove them",
    .operands = "[NAME]",
    .min_operands = 0,
    .max_operands = 1,
    .args_size = sizeof(brdf_args),
    .fields = fields,
    .details = "The table of --eval names its columns in the first line: nl, nv (cosines of light and view) "
               "and phi\n"
               "(azimuth between them, rad; 0 without it), or lx ly lz vx vy vz (unit vectors, z is the "
               "normal), and\n"
               "parameters by name, a colour also as name_r, name_g, name_b.  Columns out_*, tag and note "
               "are passed\n"
               "through.  The value (1/sr, without the cosine) is appended with 17 digits.  NAME may also be "
               "that of a\n"
               "table of reference values, such as ord_ggx_terms or cloth_albedo, or a file NAME.binary of "
               "measured\n"
               "reflectance in the form of the MERL database, as --merl writes it.",
    .example = "weft brdf ggx --eval angles.csv --param alpha=0.3 --param f0=0.04",
    .run = run,
};
