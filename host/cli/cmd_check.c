/* weft check: figures about a scan that need no ground truth. */
#include "host/cli/command.h"

#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/mem.h"
#include "host/set/compare.h"
#include "host/solve/relight.h"

#include <math.h>

typedef struct check_args {
    const char *calibration, *method, *repeat, *map;
    bool flat;
    double thickness_mm;
} check_args;

static const weft_field fields[] = {
    {.key = "calibration",
     .short_opt = 'c',
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(check_args, calibration),
     .unit = "CAL",
     .required = true,
     .help = "calibration of the scanner that took the set"},
    {.key = "method",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(check_args, method),
     .unit = "NAME",
     .def = "robust",
     .help = "how a pixel's samples become a normal; a wrong name lists them"},
    {.key = "flat",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(check_args, flat),
     .help = "the set shows a flat sheet on the table: say how flat it comes out"},
    {.key = "repeat",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(check_args, repeat),
     .unit = "SET",
     .help = "another set of the same sample, not moved: say how the two scans differ"},
    {.key = "map",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(check_args, map),
     .unit = "FILE.exr",
     .help = "write the relighting error of every pixel, relative to its brightest sample"},
    {.key = "thickness",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(check_args, thickness_mm),
     .unit = "mm",
     .min = -50,
     .max = 100,
     .def = "0",
     .help = "height of the sample's surface over the sheet that was calibrated with"},
    {0},
};

/* ---- relighting ---- */

static void print_relight(FILE *out, const weft_relight *r)
{
    fprintf(out, "each light from the others, %zu px\n", r->pixels);
    fprintf(out, "%5s %12s %12s %9s\n", "light", "rms, full", "rms, its", "bias");
    for (int j = 0; j < r->n; j++)
        fprintf(out, "%5d %10.3f %% %10.3f %% %7.3f %%\n", j, 100 * r->rms[j], 100 * r->relative[j],
                100 * r->bias[j]);
    fprintf(out, "%5s %10.3f %% %10.3f %%\n", "all", 100 * r->rms_all, 100 * r->relative_all);
}

static json_t *relight_json(const weft_relight *r)
{
    json_t *const lights = json_array();
    for (int j = 0; j < r->n; j++)
        json_array_append_new(lights, json_pack("{s:f, s:f, s:f}", "rms_full_scale", r->rms[j],
                                                "rms_relative", r->relative[j], "bias", r->bias[j]));
    return json_pack("{s:I, s:f, s:f, s:o}", "pixels", (json_int_t)r->pixels, "rms_full_scale", r->rms_all,
                     "rms_relative", r->relative_all, "lights", lights);
}

static weft_err check_relight(const weft_invocation *inv, const check_args *args, const weft_set *set,
                              const weft_calibration *cal, const weft_solve_options *options, json_t *report,
                              weft_error *err)
{
    static const char *const names[] = {"Y"};
    weft_relight r;
    WEFT_TRY(weft_relight_set(set, cal, args->calibration, options, &r, err));
    weft_err status = args->map ? weft_exr_write(args->map, &r.map, names, WEFT_EXR_HALF, err) : WEFT_OK;
    json_object_set_new(report, "relighting", relight_json(&r));
    if (status == WEFT_OK && !inv->json)
        print_relight(inv->out, &r);
    weft_relight_fini(&r);
    return status;
}

/* ---- flatness ---- */

enum { CELLS = 20 };

typedef struct flatness {
    double rms_deg;      /* of every pixel's normal against the table's */
    double rms_cell_deg; /* of the mean normals of 20 x 20 cells: the bend, without noise */
    double max_cell_deg;
    double turn_deg[2]; /* mean normal about y and x */
} flatness;

static double angle_deg(const double n[3])
{
    return atan2(hypot(n[0], n[1]), n[2]) * 57.29577951308232;
}

static flatness measure_flatness(const weft_maps *m)
{
    double cell[CELLS][CELLS][3] = {{{0}}}, mean[3] = {0}, squares = 0, cell_squares = 0;
    size_t n = 0;
    int n_cells = 0;
    flatness f = {0};
    for (int v = 0; v < m->height; v++)
        for (int u = 0; u < m->width; u++) {
            double x[3];
            if (!m->mask.data[(size_t)v * (size_t)m->width + (size_t)u])
                continue;
            for (int c = 0; c < 3; c++) {
                x[c] = (double)weft_image_row(&m->normal, c, v)[u];
                cell[v * CELLS / m->height][u * CELLS / m->width][c] += x[c];
                mean[c] += x[c];
            }
            squares += pow(angle_deg(x), 2);
            n++;
        }
    for (int i = 0; i < CELLS * CELLS; i++) {
        const double *const x = cell[i / CELLS][i % CELLS];
        if (x[0] == 0 && x[1] == 0 && x[2] == 0)
            continue;
        cell_squares += pow(angle_deg(x), 2);
        f.max_cell_deg = fmax(f.max_cell_deg, angle_deg(x));
        n_cells++;
    }
    f.rms_deg = sqrt(squares / (double)(n ? n : 1));
    f.rms_cell_deg = sqrt(cell_squares / (n_cells ? n_cells : 1));
    f.turn_deg[0] = atan2(mean[0], mean[2]) * 57.29577951308232;
    f.turn_deg[1] = -atan2(mean[1], mean[2]) * 57.29577951308232;
    return f;
}

static void report_flatness(const weft_invocation *inv, const weft_maps *maps, json_t *report)
{
    const flatness f = measure_flatness(maps);
    json_object_set_new(report, "flatness",
                        json_pack("{s:f, s:f, s:f, s:[f,f]}", "rms_deg", f.rms_deg, "rms_cell_deg",
                                  f.rms_cell_deg, "max_cell_deg", f.max_cell_deg, "turn_deg", f.turn_deg[0],
                                  f.turn_deg[1]));
    if (!inv->json)
        fprintf(inv->out,
                "flatness         %.4f deg rms, of 20 x 20 cells %.4f deg rms, %.4f at most, turned %.4f "
                "about y, "
                "%.4f about x\n",
                f.rms_deg, f.rms_cell_deg, f.max_cell_deg, f.turn_deg[0], f.turn_deg[1]);
}

/* ---- repeated scans ---- */

static weft_err report_repeat(const weft_invocation *inv, const weft_maps *a, const weft_maps *b,
                              json_t *report, weft_error *err)
{
    weft_maps_difference d;
    WEFT_TRY(weft_compare_maps(a, b, NULL, &d, err));
    json_object_set_new(report, "repeat",
                        json_pack("{s:I, s:f, s:f, s:f, s:f, s:f, s:f}", "pixels", (json_int_t)d.normal_deg.n,
                                  "normal_deg_mean", d.normal_deg.mean, "normal_deg_median",
                                  d.normal_deg.median, "normal_deg_p95", d.normal_deg.p95,
                                  "albedo_delta_e_mean", d.delta_e.mean, "turn_about_y_deg",
                                  d.mean_normal_deg[0], "turn_about_x_deg", d.mean_normal_deg[1]));
    if (!inv->json)
        fprintf(inv->out,
                "repeated scan    normal mean %.4f median %.4f p95 %.4f deg, turned %.4f about y, %.4f about "
                "x deg, "
                "albedo dE2000 mean %.4f\n",
                d.normal_deg.mean, d.normal_deg.median, d.normal_deg.p95, d.mean_normal_deg[0],
                d.mean_normal_deg[1], d.delta_e.mean);
    return WEFT_OK;
}

static weft_err solve_repeat(const check_args *args, const weft_calibration *cal,
                             const weft_solve_options *options, weft_maps *maps, weft_error *err)
{
    weft_set set;
    WEFT_TRY(weft_set_load(args->repeat, &set, err));
    const weft_err status = weft_solve_set(&set, cal, args->calibration, options, maps, err);
    weft_set_fini(&set);
    return status;
}

static weft_err check_maps(const weft_invocation *inv, const check_args *args, const weft_set *set,
                           const weft_calibration *cal, const weft_solve_options *options, json_t *report,
                           weft_error *err)
{
    weft_maps maps = {0}, again = {0};
    weft_err status = weft_solve_set(set, cal, args->calibration, options, &maps, err);
    if (status == WEFT_OK && args->flat)
        report_flatness(inv, &maps, report);
    if (status == WEFT_OK && args->repeat) {
        status = solve_repeat(args, cal, options, &again, err);
        if (status == WEFT_OK)
            status = report_repeat(inv, &maps, &again, report, err);
    }
    weft_maps_fini(&maps);
    weft_maps_fini(&again);
    return status;
}

/* What can be known to be wrong before minutes of work. */
static weft_err check_arguments(const weft_invocation *inv, const check_args *args,
                                const weft_calibration *cal, const weft_solve_options *options,
                                weft_error *err)
{
    weft_set again;
    if (args->map) {
        WEFT_TRY(weft_file_refuse_existing(args->map, inv->force, err));
        WEFT_TRY(weft_file_require_parent(args->map, err));
    }
    if (!args->repeat)
        return WEFT_OK;
    WEFT_TRY(weft_set_load(args->repeat, &again, err));
    const weft_err status = weft_solve_check(&again, cal, args->calibration, options, err);
    weft_set_fini(&again);
    return status;
}

static weft_err check_set(const weft_invocation *inv, const check_args *args, const weft_set *set,
                          const weft_calibration *cal, weft_error *err)
{
    weft_solve_options options = {.sensor_geometry = true, .height_mm = args->thickness_mm};
    WEFT_TRY(weft_solve_find_method(args->method, &options.method, err));
    WEFT_TRY(check_arguments(inv, args, cal, &options, err));
    json_t *const report = json_pack("{s:s, s:s, s:s}", "set", set->folder, "calibration", args->calibration,
                                     "method", args->method);
    weft_err status = check_relight(inv, args, set, cal, &options, report, err);
    if (status == WEFT_OK && (args->flat || args->repeat))
        status = check_maps(inv, args, set, cal, &options, report, err);
    if (status == WEFT_OK && inv->json)
        return weft_print_json(inv, report, err);
    json_decref(report);
    return status;
}

static weft_err run(const weft_invocation *inv, const void *args_, weft_error *err)
{
    const check_args *const args = args_;
    weft_calibration cal;
    weft_set set = {0};
    WEFT_TRY(weft_calibration_load(args->calibration, &cal, err));
    weft_err status = weft_set_load(inv->operands[0], &set, err);
    if (status == WEFT_OK)
        status = check_set(inv, args, &set, &cal, err);
    weft_set_fini(&set);
    weft_calibration_fini(&cal);
    return status;
}

const weft_command weft_cmd_check = {
    .name = "check",
    .summary = "figures about a scan that need no ground truth",
    .operands = "SET",
    .min_operands = 1,
    .max_operands = 1,
    .args_size = sizeof(check_args),
    .fields = fields,
    .details = "Predicts each light's picture from all the others and says how far it is off, per light:\n"
               "rms in parts of full scale and of the light's own signal, and the mean difference, which\n"
               "is what a wrong intensity shows.  With --flat the flatness of a sheet, with --repeat the\n"
               "difference of two scans of one sample.",
    .example = "weft check twill.set -c scanner.cal --repeat twill-again.set",
    .run = run,
};
