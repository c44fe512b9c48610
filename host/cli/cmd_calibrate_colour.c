#include "host/cli/chart_session.h"
#include "host/cli/colour_apply.h"
#include "host/cli/command.h"

#include "calibration/calibration_colour.h"
#include "calibration/calibration_report.h"
#include "calibration/charts/chart_light.h"
#include "calibration/charts/patch_colour.h"
#include "core/json.h"
#include "core/log.h"
#include "core/mem.h"

#include <string.h>

typedef struct colour_args {
    weft_chart_options chart;
    const char *name, *edition;
    int method;
    weft_texts exclude;
    weft_apply_options apply;
} colour_args;

static const weft_field fields[] = {
    {.key = "chart",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(colour_args, name),
     .unit = "NAME",
     .def = "macbeth",
     .help = "kind of chart"},
    {.key = "edition",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(colour_args, edition),
     .unit = "NAME",
     .def = "ohta1997",
     .help = "whose reference colours: ohta1997, before2014, after2014 (when your chart was made)"},
    {.key = "method",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(colour_args, method),
     .choices = "matrix|root-polynomial|sequence",
     .def = "matrix",
     .help = "3x3; root-polynomial of degree 2; or affine, cubic, affine in xyY"},
    {.key = "exclude",
     .type = WEFT_FIELD_TEXTS,
     .offset = offsetof(colour_args, exclude),
     .unit = "PATCH",
     .help = "leave a patch out, by name or number from 1; may be given several times"},
    WEFT_CHART_FIELDS(colour_args, chart),
    WEFT_APPLY_FIELDS(colour_args, apply),
    {0},
};

/* Held-out colour difference above which something is likely wrong with chart, edition or lights. */
static const double doubtful_delta_e = 3;

static weft_err collect(const weft_chart_session *session, const weft_chart_options *options,
                        weft_patch_colour *colours, weft_error *err)
{
    const size_t n = (size_t)session->n_lights;
    weft_patch_light *const lights = weft_alloc(n, sizeof *lights, err);
    weft_err status = lights ? WEFT_OK : WEFT_ERR_NOMEM;
    for (int l = 0; l < session->n_lights && status == WEFT_OK; l++) {
        lights[l].readings = session->readings[l];
        status = weft_chart_irradiance(&session->cal, l, session->chart, &session->pose, options->height_mm,
                                       lights[l].irradiance, err);
        for (int p = 0; p < WEFT_CHART_MAX_PATCHES; p++)
            for (int c = 0; c < 3; c++)
                lights[l].irradiance[p][c] *= session->cal.lights[l].intensity[c];
    }
    if (status == WEFT_OK)
        weft_patch_colours(session->chart, lights, session->n_lights, colours);
    weft_free(lights);
    return status;
}

static json_t *report(const weft_chart_session *session, const weft_chart_options *options,
                      const weft_patch_colour *colours, const weft_colour_fit *fit)
{
    json_t *const r = weft_chart_session_report(session, options);
    json_t *const patches = json_array();
    for (int p = 0; p < session->chart->columns * session->chart->rows; p++) {
        const weft_patch_colour *const c = &colours[p];
        json_t *const one = json_pack(
            "{s:s, s:o, s:o, s:f, s:f, s:f, s:i, s:f}", "name", session->chart->patches[p].name, "camera",
            weft_json_numbers(c->camera, 3), "reference",
            weft_json_numbers(session->chart->patches[p].linear_srgb, 3), "before", fit->before[p], "trained",
            fit->trained[p], "held_out", fit->held_out[p], "lights", c->n_lights, "spread", c->spread);
        if (one && c->excluded)
            json_object_set_new(one, "excluded", json_string(c->excluded));
        json_array_append_new(patches, one);
    }
    json_object_set_new(r, "method", json_string(weft_colour_method_name(fit->model.method)));
    json_object_update_new(r, json_pack("{s:i, s:i, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:o}", "patches_used",
                                        fit->n_used, "rank", fit->rank, "condition", fit->condition,
                                        "before_mean", fit->before_mean, "before_max", fit->before_max,
                                        "trained_mean", fit->trained_mean, "trained_max", fit->trained_max,
                                        "held_out_mean", fit->held_out_mean, "held_out_max",
                                        fit->held_out_max, "patches", patches));
    json_object_set_new(r, "terms", json_integer(fit->n_terms));
    return r;
}

static weft_err print(const weft_invocation *inv, const weft_chart_session *session,
                      const weft_patch_colour *colours, const weft_colour_fit *fit, weft_error *err)
{
    if (inv->json) {
        json_t *const r = json_deep_copy(weft_calibration_get_report(&session->cal, "colour"));
        json_object_set_new(r, "colour", weft_calibration_colour_to_json(&session->cal.colour));
        return weft_print_json(inv, r, err);
    }
    const int n = session->chart->columns * session->chart->rows;
    fprintf(inv->out, "%s %s: %d of %d patches, %s, condition %.1f\n", session->chart->name,
            session->chart->edition, fit->n_used, n, weft_colour_method_name(fit->model.method),
            fit->condition);
    for (int p = 0; p < n; p++)
        if (colours[p].excluded)
            fprintf(inv->out, "left out: %s (%s)\n", session->chart->patches[p].name, colours[p].excluded);
    fprintf(inv->out,
            "CIEDE2000     mean    max\n"
            "before        %5.2f  %5.2f\n"
            "trained       %5.2f  %5.2f\n"
            "held out      %5.2f  %5.2f\n",
            fit->before_mean, fit->before_max, fit->trained_mean, fit->trained_max, fit->held_out_mean,
            fit->held_out_max);
    for (int i = 0; i < 9; i++)
        fprintf(inv->out, "%9.5f%c", fit->model.matrix.m[i], i % 3 == 2 ? '\n' : ' ');
    if (fit->model.method == WEFT_COLOUR_SEQUENCE && !fit->model.sequence.has_cubic)
        fprintf(inv->out, "the cubic was not monotone over the patches: only the affine map is used\n");
    return WEFT_OK;
}

static weft_err fit_colours(const weft_chart_session *session, const weft_patch_colour *colours,
                            weft_colour_method method, weft_colour_fit *fit, weft_error *err)
{
    weft_colour_sample samples[WEFT_CHART_MAX_PATCHES];
    const int n = session->chart->columns * session->chart->rows;
    weft_err status = weft_patch_samples(session->chart, colours, samples, err);
    if (status == WEFT_OK)
        status = weft_colour_fit_patches(samples, n, method, fit, err);
    return status == WEFT_OK ? WEFT_OK : weft_prefix(err, status, "%s", session->set.folder);
}

static weft_err apply(const weft_invocation *inv, const colour_args *args, weft_error *err)
{
    const weft_apply_chart chart = {args->name,
                                    args->edition,
                                    args->chart.output,
                                    args->chart.overlay,
                                    &args->chart.corners,
                                    &args->exclude,
                                    (weft_colour_method)args->method};
    WEFT_TRY(weft_chart_options_check(inv, &args->chart, err));
    return weft_colour_apply(inv, &args->apply, &chart, err);
}

static weft_err run(const weft_invocation *inv, const void *vargs, weft_error *err)
{
    const colour_args *const args = vargs;
    if (args->apply.apply)
        return apply(inv, args, err);
    if (inv->n_operands != 1)
        return weft_fail(err, WEFT_ERR_USAGE, "one set is wanted, not %d (--apply takes many photographs)",
                         inv->n_operands);
    weft_chart_session session;
    weft_patch_colour colours[WEFT_CHART_MAX_PATCHES] = {0};
    weft_colour_fit fit;
    WEFT_TRY(weft_chart_session_open(
        inv, &args->chart, args->name, args->edition,
        WEFT_CALIBRATION_CAMERA | WEFT_CALIBRATION_POSE | WEFT_CALIBRATION_LIGHTS, &session, err));
    weft_err status = WEFT_OK;
    if (session.cal.has_colour && !inv->force)
        status = weft_fail(err, WEFT_ERR_EXISTS, "%s has a colour matrix already: --force replaces it",
                           args->chart.output);
    if (status == WEFT_OK)
        status = collect(&session, &args->chart, colours, err);
    if (status == WEFT_OK)
        status = weft_patch_exclude(session.chart, &args->exclude, colours, err);
    if (status == WEFT_OK)
        status = fit_colours(&session, colours, (weft_colour_method)args->method, &fit, err);
    if (status == WEFT_OK) {
        if (fit.held_out_mean > doubtful_delta_e)
            weft_warn("patches that took no part are off by %.1f CIEDE2000 in the mean (1 to 2 is usual): is "
                      "it this "
                      "edition of the chart, and are the lights calibrated as they stand?",
                      fit.held_out_mean);
        weft_patch_fill_part(session.chart, colours, &fit, &session.cal.colour);
        session.cal.has_colour = true;
        status = weft_calibration_set_report(&session.cal, "colour",
                                             report(&session, &args->chart, colours, &fit), err);
    }
    if (status == WEFT_OK) {
        unsigned char left_out[WEFT_CHART_MAX_PATCHES] = {0};
        for (int p = 0; p < WEFT_CHART_MAX_PATCHES; p++)
            left_out[p] = colours[p].excluded != NULL;
        status = weft_chart_session_save(&session, &args->chart, left_out, err);
    }
    if (status == WEFT_OK)
        status = print(inv, &session, colours, &fit, err);
    weft_chart_session_fini(&session);
    return status;
}

const weft_command weft_cmd_calibrate_colour = {
    .name = "calibrate colour",
    .summary = "a Macbeth chart, found by itself: from camera RGB to linear sRGB",
    .operands = "SET | --apply PHOTO...",
    .min_operands = 1,
    .max_operands = -1,
    .args_size = sizeof(colour_args),
    .fields = fields,
    .details =
        "Needs the camera's pose and the lights (weft calibrate lens, lights): each photograph is "
        "divided by the light\n"
        "that its lamp puts on the chart, which also balances white.  The report gives "
        "CIEDE2000\nbefore, of the patches trained on, and of patches held out: believe the last.  Patches "
        "that are clipped,\ndusty, too dark or unlike under different lights are left out and named.\n"
        "With --apply it needs neither scanner nor calibration: a photograph of the chart (--chart-photo) "
        "corrects any\nnumber of others under the same light into the folder of --output.  What is done is "
        "not "
        "done again; one that\nfails is named, and the rest goes on.",
    .example = "weft calibrate colour macbeth.set -o scanner.cal --overlay found.png",
    .run = run,
};
