/* weft solve: normals and albedo of captured sets. */
#include "host/cli/command.h"
#include "host/cli/solve_explain.h"

#include "core/file.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/mem_limit.h"
#include "core/progress.h"
#include "host/solve/albedo_gamut.h"
#include "host/solve/alpha.h"
#include "host/solve/finish.h"
#include "host/solve/flaws.h"
#include "host/solve/solve.h"

#include <string.h>

typedef struct solve_args {
    const char *calibration, *output, *method, *explain_plot;
    weft_numbers explain;
    double flatten_mm, ground;
    int height;
    bool flaws;
    int geometry, resolution, gloss, bounce;
    double mm_per_px, thickness_mm, shadow, memory_gib;
} solve_args;

enum { GEOMETRY_AUTO, GEOMETRY_PLANE, GEOMETRY_SENSOR };
enum { RESOLUTION_FULL, RESOLUTION_HALF, RESOLUTION_LINEAR };
enum { MODEL_AUTO, MODEL_OFF };

static const weft_field fields[] = {
    {.key = "calibration",
     .short_opt = 'c',
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(solve_args, calibration),
     .unit = "CAL",
     .required = true,
     .help = "calibration of the scanner that took the sets"},
    {.key = "output",
     .short_opt = 'o',
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(solve_args, output),
     .unit = "DIR",
     .help = "maps folder to write; with several sets the folder for NAME.maps of each"},
    {.key = "method",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(solve_args, method),
     .unit = "NAME",
     .def = "robust",
     .help = "how a pixel's samples become a normal; a wrong name lists them"},
    {.key = "geometry",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(solve_args, geometry),
     .choices = "auto|plane|sensor",
     .def = "auto",
     .help = "plane: regular grid on the sample; sensor: pixel for pixel; auto: plane with a camera"},
    {.key = "resolution",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(solve_args, resolution),
     .choices = "full|half|linear",
     .def = "full",
     .help = "full: every photosite by its own colour; half: a pixel per 2x2 cell; linear: colour pictures "
             "of the frames first, for comparison"},
    {.key = "gloss",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(solve_args, gloss),
     .choices = "auto|off",
     .def = "auto",
     .help = "auto: the robust method looks for the cloth's mirror light; off: every cloth is matte"},
    {.key = "bounce",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(solve_args, bounce),
     .choices = "auto|off",
     .def = "auto",
     .help = "auto: the robust method takes off the light from yarn to yarn; off: it stays"},
    {.key = "mm-per-px",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(solve_args, mm_per_px),
     .unit = "mm",
     .min = 0,
     .max = 100,
     .def = "0",
     .help = "pixel of the plane; 0: as the sensor's in the middle"},
    {.key = "thickness",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(solve_args, thickness_mm),
     .unit = "mm",
     .min = -50,
     .max = 100,
     .def = "0",
     .help = "height of the sample's surface over the sheet that was calibrated with"},
    {.key = "memory",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(solve_args, memory_gib),
     .unit = "GiB",
     .min = 0.01,
     .max = 4096,
     .def = "2",
     .help = "memory that may be used; what does not fit is kept in a file in $TMPDIR or /var/tmp meanwhile"},
    {.key = "shadow",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(solve_args, shadow),
     .unit = "part",
     .min = 0,
     .max = 0.9,
     .def = "0",
     .help = "leave out samples below this part of the pixel's brightest one"},
    {.key = "height",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(solve_args, height),
     .choices = "off|poisson|relax",
     .def = "off",
     .help =
         "also write height.exr in mm: poisson, weighted by confidence; relax: as if the picture repeated, "
         "by relaxation, for comparison (minutes)"},
    {.key = "flatten",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(solve_args, flatten_mm),
     .unit = "mm",
     .min = 0,
     .max = 10000,
     .def = "0",
     .help = "take bends longer than this off the normals, for detail maps; 0: leave them"},
    {.key = "ground",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(solve_args, ground),
     .unit = "part",
     .min = 0,
     .max = 0.25,
     .def = "0",
     .help =
         "also write alpha.exr, the holes of lace: the sample lies on a ground of this reflectance, 0.02 for "
         "black velvet; 0: no holes"},
    {.key = "flaws",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(solve_args, flaws),
     .help = "also write flaws.png: creases, lint, and with --ground tears"},
    {.key = "explain",
     .type = WEFT_FIELD_F64S,
     .offset = offsetof(solve_args, explain),
     .unit = "X,Y",
     .help = "write no maps but say what was seen at this pixel of theirs, and what became of each sample"},
    {.key = "explain-plot",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(solve_args, explain_plot),
     .unit = "FILE.svg",
     .help = "with --explain: draw it"},
    {0},
};

/* NAME of NAME.set: the last component of the folder without its suffix, on the heap. */
static char *name_of(const char *folder, weft_error *err)
{
    size_t end = strlen(folder);
    while (end > 1 && folder[end - 1] == '/')
        end--;
    size_t begin = end;
    while (begin > 0 && folder[begin - 1] != '/')
        begin--;
    if (end - begin > 4 && strncmp(folder + end - 4, ".set", 4) == 0)
        end -= 4;
    return weft_asprintf(err, "%.*s", (int)(end - begin), folder + begin);
}

static weft_err output_path(const weft_invocation *inv, const solve_args *args, int i, char **path,
                            weft_error *err)
{
    if (inv->n_operands == 1) {
        *path = weft_strdup(args->output, err);
        return *path ? WEFT_OK : WEFT_ERR_NOMEM;
    }
    char *const name = name_of(inv->operands[i], err);
    *path = name ? weft_asprintf(err, "%s/%s.maps", args->output, name) : NULL;
    weft_free(name);
    return *path ? WEFT_OK : WEFT_ERR_NOMEM;
}

/* Two sets of one name would write the same folder. */
static weft_err refuse_same_names(const weft_invocation *inv, const solve_args *args, int i, const char *path,
                                  weft_error *err)
{
    for (int j = 0; j < i; j++) {
        char *other = NULL;
        WEFT_TRY(output_path(inv, args, j, &other, err));
        const bool same = strcmp(path, other) == 0;
        weft_free(other);
        if (same)
            return weft_fail(err, WEFT_ERR_EXISTS, "two sets are called %.*s (solve them one by one)",
                             (int)strlen(weft_path_name(path)) - 5, weft_path_name(path));
    }
    return WEFT_OK;
}

/* Everything that can be known to be wrong before the first set is worked on. */
static weft_err check_all(const weft_invocation *inv, const solve_args *args, const weft_calibration *cal,
                          const weft_solve_options *options, weft_error *err)
{
    for (int i = 0; i < inv->n_operands; i++) {
        weft_set set;
        char *path = NULL;
        WEFT_TRY(output_path(inv, args, i, &path, err));
        weft_err status = weft_file_refuse_existing(path, inv->force, err);
        if (status == WEFT_OK && inv->n_operands == 1)
            status = weft_file_require_parent(path, err);
        if (status == WEFT_OK)
            status = refuse_same_names(inv, args, i, path, err);
        weft_free(path);
        WEFT_TRY(status);
        WEFT_TRY(weft_set_load(inv->operands[i], &set, err));
        status = weft_solve_check(&set, cal, args->calibration, options, err);
        weft_set_fini(&set);
        WEFT_TRY(status);
    }
    return WEFT_OK;
}

static json_t *summary_of(const char *set, const char *path, const weft_maps *maps, double seconds)
{
    return json_pack("{s:s, s:s, s:s, s:i, s:i, s:f, s:[f,f], s:b, s:f, s:O}", "set", set, "maps", path,
                     "geometry", maps->geometry == WEFT_GEOMETRY_PLANE ? "plane" : "sensor", "width",
                     maps->width, "height", maps->height, "mm_per_px", maps->mm_per_px, "origin_mm",
                     maps->origin_mm[0], maps->origin_mm[1], "albedo_is_srgb", maps->albedo_is_srgb,
                     "seconds", seconds, "info", maps->info);
}

static void print_flaws(const weft_invocation *inv, const char *path, json_t *flaws)
{
    const char *name, *between = "";
    json_t *found;
    if (!flaws)
        return;
    fprintf(inv->out, "%s:", path);
    json_object_foreach(flaws, name, found)
    {
        fprintf(inv->out, "%s %s %d (%.1f mm2)", between, name,
                (int)json_integer_value(json_object_get(found, "n")),
                json_number_value(json_object_get(found, "area_mm2")));
        between = ",";
    }
    fprintf(inv->out, "\n");
}

static void print_summary(const weft_invocation *inv, const char *path, const weft_maps *maps, double seconds)
{
    const json_t *const result = json_object_get(maps->info, "result");
    const double answered = json_number_value(json_object_get(result, "answered_px"));
    fprintf(inv->out, "%s: %d x %d px", path, maps->width, maps->height);
    if (maps->geometry == WEFT_GEOMETRY_PLANE)
        fprintf(inv->out, " of %.4g mm", maps->mm_per_px);
    fprintf(inv->out, ", %.1f %% with an answer, residual %.2f %%, confidence %.3f, %.1f s\n",
            100 * answered / ((double)maps->width * maps->height),
            100 * json_number_value(json_object_get(result, "residual_mean")),
            json_number_value(json_object_get(result, "confidence_mean")), seconds);
    print_flaws(inv, path, json_object_get(result, "flaws"));
    char words[256];
    weft_albedo_gamut_words(maps, words, sizeof words);
    if (words[0])
        fprintf(inv->out, "%s: %s\n", path, words);
}

/* Before the bends are taken off: a crease is one. */
static weft_err look_for_flaws(const solve_args *args, weft_maps *maps, weft_error *err)
{
    if (args->ground > 0) {
        WEFT_TRY(weft_maps_find_alpha(maps, args->ground, err));
        json_object_set_new(json_object_get(maps->info, "options"), "ground", json_real(args->ground));
    }
    return args->flaws ? weft_maps_find_flaws(maps, NULL, err) : WEFT_OK;
}

static weft_err solve_one(const weft_invocation *inv, const solve_args *args, int i,
                          const weft_calibration *cal, const weft_solve_options *options, json_t *summaries,
                          weft_error *err)
{
    weft_set set = {0};
    weft_maps maps = {0};
    char *path = NULL;
    const double begun = weft_clock_s();
    weft_err status = output_path(inv, args, i, &path, err);
    if (status == WEFT_OK)
        status = weft_set_load(inv->operands[i], &set, err);
    if (status == WEFT_OK)
        status = weft_solve_set(&set, cal, args->calibration, options, &maps, err);
    if (status == WEFT_OK)
        status = look_for_flaws(args, &maps, err);
    if (status == WEFT_OK && args->flatten_mm > 0) {
        status = weft_maps_flatten(&maps, args->flatten_mm, err);
        json_object_set_new(json_object_get(maps.info, "options"), "flatten_mm", json_real(args->flatten_mm));
    }
    if (status == WEFT_OK)
        status = weft_maps_integrate(&maps, (weft_height_how)args->height, err);
    if (status == WEFT_OK)
        status = weft_maps_save(path, &maps, inv->force, err);
    if (status == WEFT_OK) {
        const double seconds = weft_clock_s() - begun;
        weft_explain("memory: %.0f MiB at most", weft_mem_peak() / 1048576);
        json_array_append_new(summaries, summary_of(inv->operands[i], path, &maps, seconds));
        if (!inv->json)
            print_summary(inv, path, &maps, seconds);
    }
    weft_maps_fini(&maps);
    weft_set_fini(&set);
    weft_free(path);
    return status;
}

static weft_err run_with(const weft_invocation *inv, const solve_args *args, const weft_calibration *cal,
                         weft_error *err)
{
    weft_solve_options options = {.sensor_geometry = args->geometry == GEOMETRY_SENSOR,
                                  .plane_geometry = args->geometry == GEOMETRY_PLANE,
                                  .half = args->resolution == RESOLUTION_HALF,
                                  .linear = args->resolution == RESOLUTION_LINEAR,
                                  .matte = args->gloss == MODEL_OFF,
                                  .no_bounce = args->bounce == MODEL_OFF,
                                  .memory_bytes = args->memory_gib * 1073741824.0,
                                  .mm_per_px = args->mm_per_px,
                                  .height_mm = args->thickness_mm,
                                  .shadow = args->shadow};
    weft_mem_set_limit(options.memory_bytes);
    WEFT_TRY(weft_solve_find_method(args->method, &options.method, err));
    const char *const needs_plane = args->flaws            ? "--flaws"
                                    : args->ground > 0     ? "--ground"
                                    : args->flatten_mm > 0 ? "--flatten"
                                    : args->height         ? "--height"
                                                           : NULL;
    if (needs_plane && options.sensor_geometry)
        return weft_fail(err, WEFT_ERR_USAGE, "%s is for maps of the plane, not for --geometry sensor",
                         needs_plane);
    if (args->explain_plot && args->explain.n == 0)
        return weft_fail(err, WEFT_ERR_USAGE, "--explain-plot needs the pixel: --explain X,Y");
    if (args->explain.n > 0 && inv->n_operands > 1)
        return weft_fail(err, WEFT_ERR_USAGE, "--explain is for one set");
    if (args->explain.n > 0)
        return weft_print_explanation(inv, inv->operands[0], cal, args->calibration, &options, &args->explain,
                                      args->explain_plot, err);
    WEFT_TRY(check_all(inv, args, cal, &options, err));
    if (inv->n_operands > 1)
        WEFT_TRY(weft_folder_create(args->output, err));
    json_t *const summaries = json_array();
    weft_err status = WEFT_OK;
    for (int i = 0; i < inv->n_operands && status == WEFT_OK; i++)
        status = solve_one(inv, args, i, cal, &options, summaries, err);
    if (status == WEFT_OK && inv->json)
        return weft_print_json(inv, json_pack("{s:o}", "solved", summaries), err);
    json_decref(summaries);
    return status;
}

static weft_err run(const weft_invocation *inv, const void *args_, weft_error *err)
{
    const solve_args *const args = args_;
    weft_calibration cal;
    if (!args->output && args->explain.n == 0)
        return weft_fail(err, WEFT_ERR_USAGE, "--output is missing");
    WEFT_TRY(weft_calibration_load(args->calibration, &cal, err));
    const weft_err status = run_with(inv, args, &cal, err);
    weft_calibration_fini(&cal);
    return status;
}

const weft_command weft_cmd_solve = {
    .name = "solve",
    .summary = "normals and albedo of captured sets",
    .operands = "SET...",
    .min_operands = 1,
    .max_operands = -1,
    .args_size = sizeof(solve_args),
    .fields = fields,
    .details = "Finds normal and albedo of each pixel from what each light did to it (docs/solving.md).\n"
               "Needs a set with all lights and a calibration with lights, and for near lights the\n"
               "camera and its pose.  Writes normal, albedo, residual, confidence,\n"
               "uncertainty, lights used, quality and mask.",
    .example = "weft solve twill.set -c scanner.cal -o twill.maps",
    .run = run,
};
