/* weft calibrate lights: where the lights are and what they do, from a white sheet. */
#include "host/cli/command.h"

#include "calibration/calibration_report.h"
#include "calibration/lights/ball_lights.h"
#include "calibration/lights/light_fit.h"
#include "calibration/lights/white_sheet_file.h"
#include "core/csv.h"
#include "core/file.h"
#include "core/json.h"
#include "core/log.h"
#include "core/progress.h"
#include "host/set/plate.h"

#include <math.h>
#include <string.h>

typedef struct lights_args {
    const char *output, *guess, *positions, *balls;
    double ball_radius_mm, reflectance, sigma_mm, height_mm;
    weft_size grid;
} lights_args;

static const weft_field fields[] = {
    {.key = "output",
     .short_opt = 'o',
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(lights_args, output),
     .unit = "CAL",
     .required = true,
     .help = "calibration to add to; it must have the camera and its pose"},
    {.key = "guess",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(lights_args, guess),
     .unit = "FILE",
     .help =
         "rough positions: CSV with x_mm,y_mm,z_mm a light, or a calibration; else they are searched for"},
    {.key = "positions",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(lights_args, positions),
     .unit = "FILE",
     .help = "measured positions, in the same form: the fit weighs them by --positions-sigma"},
    {.key = "positions-sigma",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(lights_args, sigma_mm),
     .unit = "mm",
     .min = 0.01,
     .max = 1000,
     .def = "3",
     .help = "how far each coordinate of --positions may be off (standard deviation)"},
    {.key = "balls",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(lights_args, balls),
     .unit = "SET",
     .help = "glossy dark balls on the table under every light: their glints give the rough positions"},
    {.key = "ball-radius",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(lights_args, ball_radius_mm),
     .unit = "mm",
     .min = 0.5,
     .max = 500,
     .def = "12",
     .help = "of the balls"},
    {.key = "sheet-height",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(lights_args, height_mm),
     .unit = "mm",
     .min = -100,
     .max = 100,
     .def = "0",
     .help = "of the sheet's surface over the plane of --board-on-table"},
    {.key = "reflectance",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(lights_args, reflectance),
     .unit = "part",
     .min = 0.05,
     .max = 1,
     .def = "0.99",
     .help = "diffuse reflectance of the sheet"},
    {.key = "grid",
     .type = WEFT_FIELD_SIZE,
     .offset = offsetof(lights_args, grid),
     .unit = "CxR",
     .def = "33x22",
     .help = "nodes of the grid of gains"},
    {0},
};

static weft_err guess_from_calibration(const char *path, weft_light_fit_options *options, weft_error *err)
{
    weft_calibration cal;
    WEFT_TRY(weft_calibration_load(path, &cal, err));
    weft_err status = weft_calibration_require(&cal, WEFT_CALIBRATION_LIGHTS, path, err);
    options->n_guess = cal.n_lights;
    for (int l = 0; l < cal.n_lights && status == WEFT_OK; l++) {
        options->guess[l] = cal.lights[l].position;
        if (cal.lights[l].distant)
            status = weft_fail(err, WEFT_ERR_MISMATCH, "%s: light %d is a distant one, it has no position",
                               path, l);
    }
    weft_calibration_fini(&cal);
    return status;
}

static weft_err guess_from_csv(const char *path, weft_light_fit_options *options, weft_error *err)
{
    static const char *const names[] = {"x_mm", "y_mm", "z_mm"};
    weft_csv csv;
    WEFT_TRY(weft_csv_read(path, &csv, err));
    weft_err status = WEFT_OK;
    if (csv.rows < 1 || csv.rows > WEFT_LIGHTS_MAX)
        status = weft_fail(err, WEFT_ERR_RANGE, "%s: has %d rows, wanted one a light", path, csv.rows);
    for (int l = 0; l < csv.rows && status == WEFT_OK; l++) {
        double p[3];
        for (int k = 0; k < 3 && status == WEFT_OK; k++) {
            const int column = weft_csv_column(&csv, names[k]);
            status = column < 0 ? weft_fail(err, WEFT_ERR_FORMAT, "%s: has no column \"%s\"", path, names[k])
                                : weft_csv_number(&csv, l, column, path, &p[k], err);
        }
        if (status == WEFT_OK)
            options->guess[l] = (weft_vec3){p[0], p[1], p[2]};
    }
    options->n_guess = csv.rows;
    weft_csv_fini(&csv);
    return status;
}

static weft_err make_options(const lights_args *args, weft_light_fit_options *options, weft_error *err)
{
    *options = weft_light_fit_defaults;
    options->reflectance = args->reflectance;
    options->grid_columns = args->grid.width;
    options->grid_rows = args->grid.height;
    if (options->grid_columns < 4 || options->grid_rows < 4 || options->grid_columns > 512 ||
        options->grid_rows > 512)
        return weft_fail(err, WEFT_ERR_USAGE, "--grid %dx%d: wanted 4 to 512 nodes each way",
                         args->grid.width, args->grid.height);
    options->sheet_height_mm = args->height_mm;
    if (!!args->guess + !!args->positions + !!args->balls > 1)
        return weft_fail(err, WEFT_ERR_USAGE, "--guess, --positions and --balls: give one of them");
    const char *const file = args->positions ? args->positions : args->guess;
    if (!file)
        return WEFT_OK;
    options->guess_sigma_mm = args->positions ? args->sigma_mm : 0;
    return weft_folder_exists(file) ? guess_from_calibration(file, options, err)
                                    : guess_from_csv(file, options, err);
}

static weft_err load_balls(const weft_set *set, weft_ball_pictures *pictures, weft_error *err)
{
    weft_plate ambient = {0};
    bool has_ambient = false;
    WEFT_TRY(weft_ball_pictures_init(pictures, set->width, set->height, weft_set_n_lights(set), err));
    weft_err status = weft_plate_load_ambient(set, &ambient, &has_ambient, err);
    for (int light = 0; light < pictures->n_lights && status == WEFT_OK; light++) {
        weft_plate plate;
        status = weft_plate_load_light(set, light, has_ambient ? &ambient : NULL, &plate, err);
        if (status != WEFT_OK)
            break;
        status = weft_ball_pictures_add(pictures, light, &plate.image, err);
        weft_plate_fini(&plate);
    }
    weft_plate_fini(&ambient);
    return status;
}

/* Positions by the glints in balls: where the fit begins, and where each light is expected.  Their errors, of
 * the glints' shape and the balls' radius, are alike for all lights, so as a prior they would outweigh the
 * sheet. */
static weft_err guess_from_balls(const lights_args *args, const weft_calibration *cal,
                                 weft_light_fit_options *options, weft_error *err)
{
    weft_ball_pictures pictures = {0};
    weft_ball_lights found;
    weft_set set;
    WEFT_TRY(weft_set_load(args->balls, &set, err));
    weft_err status = weft_set_require_lights(&set, err);
    if (status == WEFT_OK)
        status = weft_calibration_require_size(cal, set.width, set.height, args->output, err);
    if (status == WEFT_OK)
        status = load_balls(&set, &pictures, err);
    if (status == WEFT_OK) {
        status = weft_ball_lights_find(&cal->camera, &pictures, args->ball_radius_mm, &found, err);
        if (status != WEFT_OK)
            weft_prefix(err, status, "%s", set.folder);
    }
    if (status == WEFT_OK) {
        options->n_guess = pictures.n_lights;
        memcpy(options->guess, found.position, sizeof found.position);
        weft_note("%d balls: the lights' mirrored rays miss each other by %.2f mm", found.n_balls,
                  found.miss_mean_mm);
        for (int l = 0; l < pictures.n_lights; l++)
            weft_explain("light %d by the balls: %.1f %.1f %.1f mm", l, found.position[l].x,
                         found.position[l].y, found.position[l].z);
    }
    weft_ball_pictures_fini(&pictures);
    weft_set_fini(&set);
    return status;
}

static weft_err add_light(const weft_set *set, int light, const weft_plate *ambient, weft_white_sheet *sheet,
                          weft_error *err)
{
    weft_plate plate;
    WEFT_TRY(weft_plate_load_light(set, light, ambient, &plate, err));
    const weft_err status = weft_white_sheet_add(sheet, light, &plate.image, plate.cfa, &plate.clipped, err);
    weft_plate_fini(&plate);
    return status == WEFT_OK ? WEFT_OK : weft_prefix(err, status, "%s", set->folder);
}

static weft_err load_sheet(const weft_set *set, weft_white_sheet *sheet, weft_error *err)
{
    weft_plate ambient = {0};
    bool has_ambient = false;
    weft_progress progress = {0};
    const int n = weft_set_n_lights(set);
    WEFT_TRY(weft_white_sheet_init(sheet, set->width, set->height, n, err));
    weft_err status = weft_plate_load_ambient(set, &ambient, &has_ambient, err);
    if (status == WEFT_OK) {
        if (!has_ambient)
            weft_warn("%s: has no ambient frame; light of the room is taken for the lamps'", set->folder);
        weft_progress_begin(&progress, "reading the white sheet", "lights", n);
    }
    for (int light = 0; light < n && status == WEFT_OK; light++) {
        status = add_light(set, light, has_ambient ? &ambient : NULL, sheet, err);
        if (status == WEFT_OK)
            status = weft_progress_step(&progress, 1, err);
    }
    weft_progress_end(&progress);
    weft_plate_fini(&ambient);
    if (status != WEFT_OK)
        weft_white_sheet_fini(sheet);
    return status;
}

static json_t *sigma_json(const weft_light_sigma *s)
{
    return json_pack("{s:o, s:f, s:f, s:o, s:f}", "position_mm", weft_json_numbers(s->position_mm, 3),
                     "aim_rad", s->aim_rad, "exponent", s->exponent, "intensity",
                     weft_json_numbers(s->intensity, 3), "irradiance", s->irradiance);
}

static json_t *sheet_json(const weft_light_sheet *s)
{
    return json_pack("{s:o, s:o, s:o, s:o, s:b}", "bow_mm", weft_json_numbers(s->bow_mm, 2), "bow_sigma_mm",
                     weft_json_numbers(s->bow_sigma_mm, 2), "tilt_rad", weft_json_numbers(s->tilt_rad, 2),
                     "tilt_sigma_rad", weft_json_numbers(s->tilt_sigma_rad, 2), "bow_used", (int)s->bow_used);
}

static json_t *positions_json(const weft_light_fit_options *options)
{
    json_t *const positions = json_array();
    for (int l = 0; l < options->n_guess; l++)
        json_array_append_new(positions, weft_json_numbers(&options->guess[l].x, 3));
    return positions;
}

static json_t *report_json(const weft_set *set, const lights_args *args,
                           const weft_light_fit_options *options, const weft_calibration *cal,
                           const weft_light_fit_report *r)
{
    json_t *const rounds = json_array(), *const lights = json_array();
    for (int i = 0; i < r->n_rounds; i++)
        json_array_append_new(
            rounds, json_pack("{s:f, s:f}", "moved_mm", r->rounds[i].moved_mm, "rms", r->rounds[i].rms));
    for (int l = 0; l < cal->n_lights; l++)
        json_array_append_new(lights,
                              json_pack("{s:f, s:f, s:f, s:f, s:o}", "position_sigma_mm",
                                        cal->lights[l].position_sigma_mm, "residual", cal->lights[l].residual,
                                        "residual_without_grid", r->model_rms[l], "left_out", r->left_out[l],
                                        "sigma", sigma_json(&r->sigma[l])));
    json_t *const report = json_pack(
        "{s:s, s:f, s:b, s:o, s:f, s:o, s:o, s:o}", "set", set->folder, "reflectance", args->reflectance,
        "settled", (int)r->settled, "rounds", rounds, "mean_exponent", r->exponent, "vignetting",
        weft_json_numbers(r->vignetting, 3), "slope", weft_json_numbers(r->slope, 2), "lights", lights);
    if (report) {
        json_object_set_new(report, "model_error", json_real(r->model_error));
        json_object_set_new(report, "sheet", sheet_json(&r->sheet));
        json_object_set_new(report, "sheet_height_mm", json_real(args->height_mm));
    }
    if (report && args->balls) {
        json_object_set_new(report, "balls", json_string(args->balls));
        json_object_set_new(report, "positions_by_balls", positions_json(options));
    }
    if (report && args->guess)
        json_object_set_new(report, "guess", json_string(args->guess));
    if (report && args->positions) {
        json_object_set_new(report, "positions", json_string(args->positions));
        json_object_set_new(report, "positions_sigma_mm", json_real(args->sigma_mm));
    }
    return report;
}

static void print_sheet(const weft_invocation *inv, const weft_light_sheet *s)
{
    const double degrees = 57.29577951308232;
    if (!(s->bow_sigma_mm[0] > 0))
        return;
    fprintf(inv->out,
            "the sheet: bowed by %.3f +- %.3f mm across, %.3f +- %.3f mm up (%s); tilted by %.2f +- %.2f, "
            "%.2f +- %.2f degrees\n",
            s->bow_mm[0], s->bow_sigma_mm[0], s->bow_mm[1], s->bow_sigma_mm[1],
            s->bow_used ? "taken into account" : "not certain: taken as flat", s->tilt_rad[0] * degrees,
            s->tilt_sigma_rad[0] * degrees, s->tilt_rad[1] * degrees, s->tilt_sigma_rad[1] * degrees);
}

static weft_err print_result(const weft_invocation *inv, const lights_args *args, const weft_calibration *cal,
                             const weft_light_fit_report *r, weft_error *err)
{
    if (inv->json)
        return weft_print_json(inv,
                               json_pack("{s:s, s:i, s:O}", "calibration", args->output, "n_lights",
                                         cal->n_lights, "lights", weft_calibration_get_report(cal, "lights")),
                               err);
    fprintf(
        inv->out,
        "light      x        y        z  +- mm  exponent  intensity R, G, B       off by  without grid\n");
    for (int l = 0; l < cal->n_lights; l++) {
        const weft_light *const t = &cal->lights[l];
        fprintf(inv->out, "%5d %8.2f %8.2f %8.2f  %5.2f  %8.3f  %6.4f %6.4f %6.4f  %6.3f %%  %10.3f %%\n", l,
                t->position.x, t->position.y, t->position.z, t->position_sigma_mm, t->exponent,
                t->intensity[0], t->intensity[1], t->intensity[2], 100 * t->residual, 100 * r->model_rms[l]);
    }
    for (int i = 0; i < r->n_rounds; i++)
        fprintf(inv->out, "round %d: lights moved by %.3f mm at most, measured/model off by %.3f %% rms\n",
                i + 1, r->rounds[i].moved_mm, 100 * r->rounds[i].rms);
    fprintf(inv->out, "%s after %d rounds; what the model misses smoothly: %.3f %%\n",
            r->settled ? "settled" : "not settled", r->n_rounds, 100 * r->model_error);
    print_sheet(inv, &r->sheet);
    return WEFT_OK;
}

/* A white balance that was measured on a chart is not replaced by the sheet's. */
static void keep_measured_white(const weft_calibration *former, weft_calibration *cal)
{
    if (!weft_calibration_get_report(cal, "white") || former->n_lights != cal->n_lights)
        return;
    for (int l = 0; l < cal->n_lights; l++)
        memcpy(cal->lights[l].white_balance, former->lights[l].white_balance,
               sizeof cal->lights[l].white_balance);
}

static weft_err keep_sheet(const char *folder, const weft_white_sheet *sheet, weft_error *err)
{
    WEFT_TRY(weft_folder_create(folder, err));
    return weft_white_sheet_save(folder, sheet, err);
}

static weft_err fit(const weft_invocation *inv, const lights_args *args, const weft_set *set,
                    weft_calibration *cal, weft_error *err)
{
    weft_light_fit_options options;
    weft_light_fit_report report;
    weft_white_sheet sheet;
    WEFT_TRY(make_options(args, &options, err));
    if (args->balls)
        WEFT_TRY(guess_from_balls(args, cal, &options, err));
    WEFT_TRY(load_sheet(set, &sheet, err));
    const weft_calibration former = *cal; /* its numbers; what it points to is not used */
    weft_err status = weft_light_fit(&cal->camera, &sheet, &options, cal, &report, err);
    if (status ==
        WEFT_OK) /* beside the calibration, for its report; first, so that none is of older lights */
        status = keep_sheet(args->output, &sheet, err);
    weft_white_sheet_fini(&sheet);
    if (status != WEFT_OK)
        return weft_prefix(err, status, "%s", set->folder);
    keep_measured_white(&former, cal);
    if (report.sheet.bow_used)
        weft_warn(
            "%s: the sheet is not flat: its middle stands %.2f mm over the left and right edge, %.2f mm over "
            "the "
            "upper and lower; this is taken into account, but a flat sheet makes the lights more certain",
            set->folder, report.sheet.bow_mm[0], report.sheet.bow_mm[1]);
    if (!report.settled)
        weft_warn("the lights still moved by %.2f mm in the last round; the sheet may be uneven",
                  report.rounds[report.n_rounds - 1].moved_mm);
    WEFT_TRY(weft_calibration_set_report(cal, "lights", report_json(set, args, &options, cal, &report), err));
    WEFT_TRY(weft_calibration_save(args->output, cal, err));
    return print_result(inv, args, cal, &report, err);
}

static weft_err check(const weft_invocation *inv, const lights_args *args, const weft_set *set,
                      const weft_calibration *cal, weft_error *err)
{
    WEFT_TRY(
        weft_calibration_require(cal, WEFT_CALIBRATION_CAMERA | WEFT_CALIBRATION_POSE, args->output, err));
    if (cal->has_lights && !inv->force)
        return weft_fail(err, WEFT_ERR_EXISTS, "%s: has lights already; --force replaces them", args->output);
    WEFT_TRY(weft_set_require_lights(set, err));
    return weft_calibration_require_size(cal, set->width, set->height, args->output, err);
}

static weft_err run_lights(const weft_invocation *inv, const void *vargs, weft_error *err)
{
    const lights_args *const args = vargs;
    weft_calibration cal;
    weft_set set;
    WEFT_TRY(weft_calibration_open(args->output, &cal, err));
    weft_err status = weft_set_load(inv->operands[0], &set, err);
    if (status == WEFT_OK) {
        status = check(inv, args, &set, &cal, err);
        if (status == WEFT_OK)
            status = fit(inv, args, &set, &cal, err);
        weft_set_fini(&set);
    }
    weft_calibration_fini(&cal);
    return status;
}

const weft_command weft_cmd_calibrate_lights = {
    .name = "calibrate lights",
    .summary = "a white sheet: position, intensity and fall-off of each light",
    .operands = "SET",
    .min_operands = 1,
    .max_operands = 1,
    .args_size = sizeof(lights_args),
    .fields = fields,
    .details =
        "SET shows a flat matte white sheet that fills the frame, once under every light, nothing "
        "saturated.\n"
        "All lights are fitted together with the camera's vignetting, to convergence; what a light's model "
        "still\n"
        "misses goes into a smooth grid of gains beside calibration.json.  docs/calibration.md explains.",
    .example = "weft calibrate lights white.set -o scanner.cal",
    .run = run_lights,
};
