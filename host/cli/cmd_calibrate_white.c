#include "host/cli/chart_session.h"
#include "host/cli/command.h"

#include "calibration/calibration_report.h"
#include "calibration/charts/white_balance.h"
#include "core/json.h"
#include "core/log.h"
#include "core/mem.h"

#include <math.h>
#include <string.h>

typedef struct white_args {
    weft_chart_options chart;
} white_args;

static const weft_field fields[] = {WEFT_CHART_FIELDS(white_args, chart), {0}};

typedef struct light_white {
    weft_grey_fit fit;
    weft_white_balance balance;
    double sheet_difference; /* largest relative difference of a gain from the white sheet's; NAN without
                                lights */
} light_white;

/* How far the gains are from those that the white sheet gave the lights. */
static double sheet_difference(const weft_light *light, const weft_white_balance *balance)
{
    double worst = 0;
    for (int c = 0; c < 3; c += 2)
        worst = fmax(worst, fabs(balance->gain[c] * light->intensity[c] / light->intensity[1] - 1));
    return worst;
}

static weft_err balance_lights(const weft_chart_session *session, const weft_chart_options *options,
                               weft_grey_irradiance *irradiance, weft_chart_light_source *source,
                               light_white *whites, weft_error *err)
{
    const weft_patch_reading *readings[WEFT_LIGHTS_MAX];
    for (int light = 0; light < session->n_lights; light++)
        readings[light] = session->readings[light];
    WEFT_TRY(weft_chart_session_light(session, options, readings, source, irradiance, err));
    for (int light = 0; light < session->n_lights; light++) {
        light_white *const w = &whites[light];
        const bool known = *source != WEFT_CHART_LIGHT_FITTED;
        /* How far up the range a merged bracket reaches is not one number: 0 leaves that to the clipping
         * mask. */
        const weft_grey_light grey = {readings[light], known ? (const double(*)[3])irradiance[light] : NULL,
                                      0};
        const weft_err status = weft_grey_fit_light(session->chart, &grey, &w->fit, err);
        if (status != WEFT_OK)
            return weft_prefix(err, status, "%s: light %d", session->set.folder, light);
        w->balance = weft_white_balance_from(&w->fit);
        w->sheet_difference = session->cal.has_lights
                                  ? sheet_difference(&session->cal.lights[light], &w->balance)
                                  : (double)NAN;
    }
    return WEFT_OK;
}

static json_t *report(const weft_chart_session *session, const weft_chart_options *options,
                      weft_chart_light_source source, const light_white *whites)
{
    json_t *const r = weft_chart_session_report(session, options);
    json_t *const lights = json_array();
    for (int light = 0; light < session->n_lights; light++) {
        const light_white *const w = &whites[light];
        json_t *const one = json_pack("{s:i, s:o, s:o, s:o, s:f, s:i}", "light", light, "white_balance",
                                      weft_json_numbers(w->balance.gain, 3), "site_gains",
                                      weft_json_numbers(w->balance.site_gain, WEFT_SITES), "slopes_per_s",
                                      weft_json_numbers(w->fit.slope, WEFT_SITES), "max_deviation",
                                      w->fit.max_deviation, "patches", w->fit.n_usable);
        if (one && !isnan(w->sheet_difference))
            json_object_set_new(one, "difference_from_sheet", json_real(w->sheet_difference));
        json_array_append_new(lights, one);
    }
    json_object_set_new(r, "illumination", json_string(weft_chart_light_source_name(source)));
    json_object_set_new(r, "lights", lights);
    return r;
}

static weft_err print(const weft_invocation *inv, const weft_chart_session *session,
                      const light_white *whites, weft_error *err)
{
    if (inv->json)
        return weft_print_json(inv, json_deep_copy(weft_calibration_get_report(&session->cal, "white")), err);
    fprintf(inv->out, "light  red     green   blue    greys off by%s\n",
            isnan(whites[0].sheet_difference) ? "" : "  off the white sheet by");
    for (int light = 0; light < session->n_lights; light++) {
        const light_white *const w = &whites[light];
        fprintf(inv->out, "%5d  %.4f  %.4f  %.4f  %6.2f %%", light, w->balance.gain[0], w->balance.gain[1],
                w->balance.gain[2], 100 * w->fit.max_deviation);
        if (!isnan(w->sheet_difference))
            fprintf(inv->out, "      %6.2f %%", 100 * w->sheet_difference);
        fputc('\n', inv->out);
    }
    return WEFT_OK;
}

static void keep_gains(const weft_chart_options *options, weft_calibration *cal, const light_white *whites)
{
    for (int light = 0; light < cal->n_lights && cal->has_lights; light++)
        memcpy(cal->lights[light].white_balance, whites[light].balance.gain,
               sizeof whites[light].balance.gain);
    if (!cal->has_lights)
        weft_note("%s has no lights yet: the white balance is kept in its report only; \"weft calibrate "
                  "lights\" makes "
                  "them, run \"weft calibrate white --force\" after it",
                  options->output);
}

static weft_err run(const weft_invocation *inv, const void *vargs, weft_error *err)
{
    const white_args *const args = vargs;
    weft_chart_session session;
    weft_chart_light_source source;
    WEFT_TRY(weft_chart_session_open(inv, &args->chart, "munsell", NULL, 0, &session, err));
    light_white *const whites = weft_alloc((size_t)session.n_lights, sizeof *whites, err);
    weft_grey_irradiance *const irradiance = weft_alloc((size_t)session.n_lights, sizeof *irradiance, err);
    weft_err status = whites && irradiance ? WEFT_OK : WEFT_ERR_NOMEM;
    if (status == WEFT_OK && weft_calibration_get_report(&session.cal, "white") && !inv->force)
        status = weft_fail(err, WEFT_ERR_EXISTS, "%s has a white balance already: --force replaces it",
                           args->chart.output);
    if (status == WEFT_OK)
        status = balance_lights(&session, &args->chart, irradiance, &source, whites, err);
    if (status == WEFT_OK) {
        keep_gains(&args->chart, &session.cal, whites);
        status = weft_calibration_set_report(&session.cal, "white",
                                             report(&session, &args->chart, source, whites), err);
    }
    if (status == WEFT_OK)
        status = weft_chart_session_save(&session, &args->chart, NULL, err);
    if (status == WEFT_OK)
        status = print(inv, &session, whites, err);
    weft_free(irradiance);
    weft_free(whites);
    weft_chart_session_fini(&session);
    return status;
}

const weft_command weft_cmd_calibrate_white = {
    .name = "calibrate white",
    .summary = "a Munsell chart: white balance of each light",
    .operands = "SET",
    .min_operands = 1,
    .max_operands = 1,
    .args_size = sizeof(white_args),
    .fields = fields,
    .details =
        "Gains per light that make the greys equal in red, green and blue; green is 1.  They go into the "
        "lights of\n"
        "the calibration; where it has none yet, into its report only.  The chips of a chart are off neutral "
        "by up\n"
        "to 2 %: where both are there, the difference from the white sheet (weft calibrate lights) is shown.",
    .example = "weft calibrate white munsell.set -o scanner.cal",
    .run = run,
};
