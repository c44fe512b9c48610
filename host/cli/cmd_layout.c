/* weft layout: what a dome of lights will be worth, before it is built. */
#include "host/cli/command.h"

#include "core/file.h"
#include "core/json.h"
#include "core/plot/plot.h"
#include "host/solve/layout.h"

#include <math.h>
#include <string.h>

typedef struct layout_args {
    const char *plot;
    weft_numbers plate_mm;
    double albedo, tilt_deg, fill, full_well_e, read_e;
} layout_args;

static const weft_field fields[] = {
    {.key = "plate",
     .type = WEFT_FIELD_F64S,
     .offset = offsetof(layout_args, plate_mm),
     .unit = "W,H",
     .def = "154,102",
     .help = "width and height of what the camera sees, mm; the lights' origin is its middle"},
    {.key = "albedo",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(layout_args, albedo),
     .min = 0.001,
     .max = 1,
     .def = "0.5",
     .help = "reflectance of the cloth"},
    {.key = "tilt",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(layout_args, tilt_deg),
     .unit = "deg",
     .min = 0,
     .max = 85,
     .def = "0",
     .help = "lean of the surface; mean over eight directions of leaning"},
    {.key = "fill",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(layout_args, fill),
     .unit = "part",
     .min = 0.001,
     .max = 1,
     .def = "0.75",
     .help = "of the range that the brightest spot of a white sheet reaches"},
    {.key = "full-well",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(layout_args, full_well_e),
     .unit = "e",
     .min = 100,
     .max = 1e7,
     .def = "30000",
     .help = "electrons of a photosite at saturation"},
    {.key = "read-noise",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(layout_args, read_e),
     .unit = "e",
     .min = 0,
     .max = 10000,
     .def = "3",
     .help = "electrons rms"},
    {.key = "plot",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(layout_args, plot),
     .unit = "FILE.svg",
     .help = "draw the noise over the plate"},
    {0},
};

static void where(const weft_light *l, double *azimuth_deg, double *elevation_deg, double *distance_mm)
{
    const weft_vec3 p = l->distant ? l->direction : l->position;
    const double a = 57.29577951308232 * atan2(p.y, p.x);
    *azimuth_deg = a < 0 ? a + 360 : a;
    *elevation_deg = 57.29577951308232 * atan2(p.z, hypot(p.x, p.y));
    *distance_mm = l->distant ? (double)INFINITY : sqrt(weft_dot(p, p));
}

static void print_text(FILE *out, const weft_calibration *cal, const weft_layout *l)
{
    fprintf(out, "noise of the normals: mean %.3f degrees rms, middle %.3f, worst place %.3f", l->mean,
            l->middle, l->max);
    if (l->undetermined > 0)
        fprintf(out, "; %.1f %% of the plate without an answer", 100 * l->undetermined);
    fprintf(out, "\ngain of the directions %.2f, worst light %.2f times as bright at its dimmest spot\n",
            l->gain, l->evenness);
    fprintf(out, "%5s %8s %9s %9s %13s\n", "light", "azimuth", "elevation", "distance", "mean without");
    for (int j = 0; j < cal->n_lights; j++) {
        double azimuth, elevation, distance;
        where(&cal->lights[j], &azimuth, &elevation, &distance);
        fprintf(out, "%5d %8.1f %9.1f %6.0f mm ", j, azimuth, elevation, distance);
        if (isnan(l->without[j]))
            fprintf(out, "%13s\n", "no answer");
        else
            fprintf(out, "%9.3f deg\n", l->without[j]);
    }
}

static json_t *layout_json(const weft_calibration *cal, const weft_layout *l)
{
    json_t *const lights = json_array();
    for (int j = 0; j < cal->n_lights; j++) {
        double azimuth, elevation, distance;
        where(&cal->lights[j], &azimuth, &elevation, &distance);
        json_t *const light = json_pack("{s:f, s:f}", "azimuth_deg", azimuth, "elevation_deg", elevation);
        if (isfinite(distance))
            json_object_set_new(light, "distance_mm", json_real(distance));
        if (isfinite(l->without[j]))
            json_object_set_new(light, "mean_without_deg", json_real(l->without[j]));
        json_array_append_new(lights, light);
    }
    json_t *const object =
        json_pack("{s:f, s:f, s:f, s:f, s:o}", "mean_deg", l->mean, "worst_deg", l->max, "undetermined",
                  l->undetermined, "evenness", l->evenness, "lights", lights);
    if (object && isfinite(l->middle))
        json_object_set_new(object, "middle_deg", json_real(l->middle));
    if (object && isfinite(l->gain))
        json_object_set_new(object, "gain", json_real(l->gain));
    return object;
}

static void plot_lights(weft_plot *plot, const weft_calibration *cal, double reach)
{
    for (int j = 0; j < cal->n_lights; j++) {
        const weft_vec3 p = cal->lights[j].distant ? weft_scale(cal->lights[j].direction, 0.9 * reach)
                                                   : cal->lights[j].position;
        char words[16];
        snprintf(words, sizeof words, "%d", j);
        weft_plot_dot(plot, 1, 5, p.x, p.y, words);
        weft_plot_words(plot, p.x, p.y, 7, 4, words);
    }
}

static weft_err write_plot(const char *path, const weft_calibration *cal, const layout_args *args,
                           const weft_layout *l, weft_error *err)
{
    weft_text_buffer svg = {0};
    weft_plot plot;
    const double w = args->plate_mm.values[0] / 2, h = args->plate_mm.values[1] / 2;
    double reach = 1.1 * fmax(w, h), low = l->max;
    for (int j = 0; j < cal->n_lights; j++)
        if (!cal->lights[j].distant)
            reach =
                fmax(reach, 1.12 * fmax(fabs(cal->lights[j].position.x), fabs(cal->lights[j].position.y)));
    for (size_t i = 0; i < weft_image_plane_size(&l->map); i++)
        low = fmin(low, isfinite(l->map.data[i]) ? (double)l->map.data[i] : low);
    const weft_plot_spec spec = {.title = "Noise of the normals, lights from above",
                                 .width = 560,
                                 .height = 480,
                                 .x = {"x, mm", -reach, reach, false},
                                 .y = {"y, mm", -reach, reach, false},
                                 .same_scale = true,
                                 .colour_bar = true,
                                 .standalone = true};
    weft_plot_begin(&plot, &spec, &svg);
    weft_plot_heat(&plot, &l->map, 0, -w, h, w, -h, low, fmax(l->max, low + 1e-9), WEFT_MAP_VIRIDIS,
                   "degrees rms");
    plot_lights(&plot, cal, reach);
    weft_plot_end(&plot);
    weft_err status = weft_text_buffer_status(&svg, err);
    if (status == WEFT_OK)
        status = weft_file_write(path, svg.text, svg.n, err);
    weft_text_buffer_fini(&svg);
    return status;
}

/* A calibration, or a table. */
static weft_err load_lights(const char *path, weft_calibration *cal, weft_error *err)
{
    if (!weft_folder_exists(path))
        return weft_layout_read(path, cal, err);
    WEFT_TRY(weft_calibration_load(path, cal, err));
    const weft_err status = weft_calibration_require(cal, WEFT_CALIBRATION_LIGHTS, path, err);
    if (status != WEFT_OK)
        weft_calibration_fini(cal);
    return status;
}

static weft_err run_with(const weft_invocation *inv, const layout_args *args, const weft_calibration *cal,
                         weft_error *err)
{
    const double *const plate = args->plate_mm.values;
    const weft_layout_options options = {.plate_mm = {plate[0], plate[1]},
                                         .albedo = args->albedo,
                                         .tilt_deg = args->tilt_deg,
                                         .fill = args->fill,
                                         .full_well_e = args->full_well_e,
                                         .read_e = args->read_e};
    weft_layout layout;
    WEFT_TRY(weft_layout_predict(cal, &options, &layout, err));
    weft_err status = args->plot ? write_plot(args->plot, cal, args, &layout, err) : WEFT_OK;
    if (status == WEFT_OK && inv->json)
        status = weft_print_json(inv, layout_json(cal, &layout), err);
    else if (status == WEFT_OK)
        print_text(inv->out, cal, &layout);
    weft_layout_fini(&layout);
    return status;
}

static weft_err run(const weft_invocation *inv, const void *args_, weft_error *err)
{
    const layout_args *const args = args_;
    weft_calibration cal;
    if (args->plate_mm.n != 2 || !(args->plate_mm.values[0] >= 1) || !(args->plate_mm.values[1] >= 1) ||
        args->plate_mm.values[0] > 1e5 || args->plate_mm.values[1] > 1e5)
        return weft_fail(err, WEFT_ERR_USAGE, "--plate wants width and height in mm, as 154,102");
    if (args->plot)
        WEFT_TRY(weft_file_refuse_existing(args->plot, inv->force, err));
    WEFT_TRY(load_lights(inv->operands[0], &cal, err));
    const weft_err status = run_with(inv, args, &cal, err);
    weft_calibration_fini(&cal);
    return status;
}

const weft_command weft_cmd_layout = {
    .name = "layout",
    .summary = "predict the noise of the normals for a layout of lights",
    .operands = "LIGHTS",
    .min_operands = 1,
    .max_operands = 1,
    .args_size = sizeof(layout_args),
    .fields = fields,
    .details =
        "LIGHTS is a CSV table with the columns x_mm, y_mm, z_mm, and power and exponent (of the lobe) if\n"
        "they differ, or a calibration.  The camera's noise at one photosite is carried through the least\n"
        "squares, over the plate; \"mean without\" says what each light is worth (docs/solving.md).",
    .example = "weft layout lights.csv --plate 154,102 --plot noise.svg",
    .run = run,
};
