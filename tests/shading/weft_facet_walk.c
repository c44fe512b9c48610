/* weft-facet-walk: the simulation behind Call of Duty: WWII's diffuse model, and how far its fit is from it.
 */
#include "core/fields.h"
#include "core/file.h"
#include "core/mem.h"
#include "core/parallel.h"
#include "core/text.h"
#include "shading/bake/gloss.h"
#include "shading/brdf/brdf.h"
#include "shading/brdf/facet_walk.h"
#include "shading/brdf/half_vector.h"
#include "shading/brdf/merl.h"
#include "shading/brdf/multiscatter.h"
#include "shading/brdf/sampling.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>

enum { MAX_GLOSSES = 32, MAX_GRID = 64, ENDLESS = 100000, ALBEDO_VIEWS = 1024, ALBEDO_WALKS = 64 };

typedef struct walk_args {
    const char *gloss, *merl;
    int grid, walks, seed, coat;
    double f0;
    bool help, force;
} walk_args;

static const weft_field fields[] = {
    {.key = "gloss",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(walk_args, gloss),
     .unit = "G,G,...",
     .def = "0,0.2353,0.4706,0.7059,0.9412",
     .help = "0..1 each; those of the deck's spheres are 0, 60, 120, 180 and 240 of 255"},
    {.key = "grid",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(walk_args, grid),
     .min = 2,
     .max = MAX_GRID,
     .def = "16",
     .help = "cells along each of the three angles"},
    {.key = "walks",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(walk_args, walks),
     .min = 1,
     .max = 1e8,
     .def = "2000",
     .help = "at each cell, in each direction"},
    {.key = "seed",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(walk_args, seed),
     .min = 0,
     .max = 1e9,
     .def = "1",
     .help = "the same seed gives the same table on any number of cores"},
    {.key = "coat",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(walk_args, coat),
     .choices = "bare|first|each|both",
     .def = "first",
     .help =
         "where Fresnel takes light: nowhere, at the first facet, entering each, entering and leaving each"},
    {.key = "f0",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(walk_args, f0),
     .min = 0,
     .max = 1,
     .def = "0.04",
     .help = "reflectance of the coat at normal incidence"},
    {.key = "merl",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(walk_args, merl),
     .unit = "FILE.binary",
     .help = "write the table of the (one) gloss"},
    {.key = "force", .type = WEFT_FIELD_FLAG, .offset = offsetof(walk_args, force), .help = "overwrite it"},
    {.key = "help",
     .short_opt = 'h',
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(walk_args, help),
     .help = "print this"},
    {0},
};

/* One table under way. */
typedef struct job {
    const walk_args *args;
    weft_facet_surface surface;
    weft_merl *table;
} job;

/* Both directions at each cell; f depends on |cos phi_d|, so half the azimuths are walked. */
static void fill_rows(void *context, int band, int row_begin, int row_end)
{
    const job *const j = context;
    const int *const size = j->table->size;
    (void)band;
    for (int row = row_begin; row < row_end; row++)
        for (int p = 0; p < (size[2] + 1) / 2; p++) {
            const int cell[3] = {row / size[1], row % size[1], p};
            const size_t first = (size_t)row * (size_t)size[2], index = first + (size_t)p;
            const uint64_t seed = (uint64_t)j->args->seed << 32 | index;
            double light[3], view[3];
            if (!weft_merl_cell(size, cell, light, view))
                continue;
            const double f = 0.5 * (weft_facet_walk(&j->surface, light, view, j->args->walks, 2 * seed) +
                                    weft_facet_walk(&j->surface, view, light, j->args->walks, 2 * seed + 1));
            for (int c = 0; c < 3; c++)
                j->table->value[c][index] = j->table->value[c][first + (size_t)(size[2] - 1 - p)] = f;
        }
}

/* How far a function is from the table: pi |f - table|. */
typedef struct distance {
    double sum, worst, mean_table;
    int n, at[3];
} distance;

static void compare_cell(const job *j, const int cell[3], double f, distance *d)
{
    const int *const size = j->table->size;
    const size_t index = ((size_t)cell[0] * (size_t)size[1] + (size_t)cell[1]) * (size_t)size[2];
    const double walked = j->table->value[0][index + (size_t)cell[2]], off = WEFT_PI * fabs(f - walked);
    d->n++;
    d->sum += off;
    d->mean_table += WEFT_PI * walked;
    if (off > d->worst) {
        d->worst = off;
        memcpy(d->at, cell, sizeof d->at);
    }
}

typedef double curve_fn(double nl, double nv, double nh, double lh, double gloss);

static double fit(double nl, double nv, double nh, double lh, double gloss)
{
    const weft_multiscatter m = weft_multiscatter_of(nl, nv, nh, lh, gloss);
    return weft_multiscatter_f(&m);
}

static double slice_at_gloss_0(double nl, double nv, double nh, double lh, double gloss)
{
    (void)nl, (void)nv, (void)gloss;
    return weft_multiscatter_slice(nh, lh);
}

static double flat(double nl, double nv, double nh, double lh, double gloss)
{
    (void)nl, (void)nv, (void)nh, (void)lh, (void)gloss;
    return 1 / WEFT_PI;
}

/* Over the slice at phi_d = 90 degrees, or over all cells with both cosines above 0.1. */
static distance compare(const job *j, double gloss, curve_fn *curve, bool slice)
{
    const int *const size = j->table->size;
    distance d = {0};
    int cell[3];
    for (cell[0] = 0; cell[0] < size[0]; cell[0]++)
        for (cell[1] = 0; cell[1] < size[1]; cell[1]++)
            for (cell[2] = slice ? size[2] / 2 : 0; cell[2] <= size[2] / 2; cell[2]++) {
                double l[3], v[3];
                if (!weft_merl_cell(size, cell, l, v) || (!slice && fmin(l[2], v[2]) < 0.1))
                    continue;
                const weft_half h = weft_half_of(l[0], l[1], l[2], v[0], v[1], v[2]);
                compare_cell(j, cell, curve(h.nl, h.nv, h.nh, h.lh, gloss), &d);
            }
    d.sum /= d.n;
    d.mean_table /= d.n;
    return d;
}

static void print_row(const job *j, double gloss, const char *what, curve_fn *curve)
{
    const distance slice = compare(j, gloss, curve, true), all = compare(j, gloss, curve, false);
    const double root = (slice.at[0] + 0.5) / j->table->size[0];
    printf("%6.4f  %-14s  %6.3f  %6.3f  %6.3f at %2.0f, %2.0f deg   %6.3f  %6.3f  %6.3f\n", gloss, what,
           slice.mean_table, slice.sum, slice.worst, 90 * root * root,
           90 * (slice.at[1] + 0.5) / j->table->size[1], all.mean_table, all.sum, all.worst);
}

static weft_err simulate(const walk_args *args, double gloss, weft_error *err)
{
    /* an odd count has a cell whose middle is phi_d = 90 degrees */
    const int size[3] = {args->grid, args->grid, args->grid | 1};
    job j = {.args = args,
             .surface = {weft_gloss_alpha(gloss), args->f0, (weft_facet_coat)args->coat, ENDLESS}};
    WEFT_TRY(weft_merl_create(size, "walks", &j.table, err));
    weft_parallel_rows(size[0] * size[1], fill_rows, &j);
    print_row(&j, gloss, "fit", fit);
    if (gloss <= 0)
        print_row(&j, gloss, "fit, gloss 0", slice_at_gloss_0);
    print_row(&j, gloss, "Lambert", flat);
    fflush(stdout);
    const weft_err status = args->merl ? weft_merl_save(args->merl, j.table, err) : WEFT_OK;
    weft_merl_destroy(j.table);
    return status;
}

static weft_err run(const walk_args *args, weft_error *err)
{
    double gloss[MAX_GLOSSES];
    int n = 0;
    for (const char *p = args->gloss; p && *p; p += *p == ',') {
        if (n == MAX_GLOSSES || !(p = weft_text_scan_double(p, &gloss[n])) || gloss[n] < 0 || gloss[n] > 1)
            return weft_fail(err, WEFT_ERR_USAGE, "--gloss %s: wanted up to %d numbers 0..1 with commas",
                             args->gloss, MAX_GLOSSES);
        n++;
    }
    if (args->merl && n != 1)
        return weft_fail(err, WEFT_ERR_USAGE, "--merl wants one --gloss");
    if (args->merl)
        WEFT_TRY(weft_file_refuse_existing(args->merl, args->force, err));
    printf("pi f of walks (F0 %g) and how far others are from it: mean, mean |difference|, largest\n",
           args->f0);
    printf(" gloss  against         over the slice (largest at theta_h, theta_d)   cosines above 0.1\n");
    for (int i = 0; i < n; i++)
        WEFT_TRY(simulate(args, gloss[i], err));
    return WEFT_OK;
}

int main(int argc, char **argv)
{
    const weft_field *const tables[] = {fields};
    walk_args args = {0};
    void *const structs[] = {&args};
    weft_error error = {0};
    const char **const operands = weft_alloc((size_t)argc, sizeof *operands, &error);
    int n_operands = 0;
    weft_fields_set_defaults(fields, &args);
    weft_err status = operands ? weft_fields_parse_argv(tables, structs, 1, argc - 1, argv + 1, operands,
                                                        &n_operands, &error)
                               : WEFT_ERR_NOMEM;
    if (status == WEFT_OK && n_operands)
        status = weft_fail(&error, WEFT_ERR_USAGE, "%s: it takes options only; see --help", operands[0]);
    if (status == WEFT_OK && args.help) {
        printf("usage: weft-facet-walk [OPTION]...\n\nLight walking on rough surfaces of matte facets (Heitz "
               "et al. 2016) against the diffuse\nmodel of Call of Duty: WWII that was fitted to it.\n\n");
        weft_fields_print_help(fields, stdout);
    } else if (status == WEFT_OK) {
        status = run(&args, &error);
    }
    if (status != WEFT_OK)
        fprintf(stderr, "weft-facet-walk: %s\n", error.text);
    weft_free(operands);
    return weft_err_exit_status(status);
}
