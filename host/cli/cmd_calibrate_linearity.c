#include "host/cli/chart_session.h"
#include "host/cli/command.h"
#include "host/cli/sensor_report.h"

#include "calibration/calibration_report.h"
#include "calibration/charts/linearity.h"
#include "core/json.h"
#include "core/log.h"
#include "core/mem.h"

#include <math.h>
#include <string.h>

typedef struct linearity_args {
    weft_chart_options chart;
} linearity_args;

static const weft_field fields[] = {WEFT_CHART_FIELDS(linearity_args, chart), {0}};

/* What was judged: one frame per light against the nominal greys, and each light's exposure series. */
typedef struct judgement {
    weft_chart_readings *greys;       /* [light] of the frame below, ambient subtracted */
    int *frame;                       /* [light] */
    double *full_scale;               /* [light] */
    weft_grey_fit *fits;              /* [light] */
    weft_grey_irradiance *irradiance; /* [light] */
    weft_chart_light_source source;
    weft_linearity linearity; /* from the greys */
    int n_series;             /* lights with at least 3 exposures */
    weft_exposure_fit series; /* the worst of them */
    int series_light;
} judgement;

static void judgement_fini(judgement *j)
{
    weft_free(j->greys);
    weft_free(j->frame);
    weft_free(j->full_scale);
    weft_free(j->fits);
    weft_free(j->irradiance);
}

static weft_err judgement_init(judgement *j, int n_lights, weft_error *err)
{
    const size_t n = (size_t)n_lights;
    *j = (judgement){.greys = weft_alloc(n, sizeof *j->greys, err),
                     .frame = weft_alloc(n, sizeof *j->frame, err),
                     .full_scale = weft_alloc(n, sizeof *j->full_scale, err),
                     .fits = weft_alloc(n, sizeof *j->fits, err),
                     .irradiance = weft_alloc(n, sizeof *j->irradiance, err)};
    return j->greys && j->frame && j->full_scale && j->fits && j->irradiance ? WEFT_OK : WEFT_ERR_NOMEM;
}

static double frame_scale(const weft_set_frame *frame)
{
    return frame->exposure_s * frame->gain;
}

/* Patches a frame shows within the sensor's range. */
static int count_usable(const weft_chart *chart, const weft_patch_reading *readings, double scale)
{
    int n = 0;
    for (int p = 0; p < chart->columns * chart->rows; p++) {
        bool good = !(readings[p].clipped > 0);
        for (int s = 0; s < WEFT_SITES; s++)
            good &= readings[p].mean[s] * scale > WEFT_GREY_RANGE_MIN &&
                    readings[p].mean[s] * scale < WEFT_GREY_RANGE_MAX;
        n += good;
    }
    return n;
}

static void subtract(const weft_chart *chart, weft_patch_reading *readings, const weft_patch_reading *ambient)
{
    for (int p = 0; p < chart->columns * chart->rows; p++)
        for (int s = 0; s < WEFT_SITES; s++)
            readings[p].mean[s] -= ambient[p].mean[s];
}

/* Reads the frames of one light: the one with most usable patches for the greys, all for the series. */
static weft_err read_light(const weft_chart_session *session, int light, const weft_patch_reading *ambient,
                           judgement *j, weft_error *err)
{
    const weft_set *const set = &session->set;
    int n = 0, best = -1;
    weft_err status = WEFT_OK;
    weft_chart_readings *const frames = weft_alloc((size_t)set->n_frames, sizeof *frames, err);
    weft_exposure *const exposures = weft_alloc((size_t)set->n_frames, sizeof *exposures, err);
    if (!frames || !exposures)
        status = WEFT_ERR_NOMEM;
    for (int f = 0; f < set->n_frames && status == WEFT_OK; f++) {
        if (set->frames[f].role != WEFT_ROLE_LIGHT || set->frames[f].light != light)
            continue;
        status = weft_chart_session_read_frame(session, f, frames[n], err);
        if (status != WEFT_OK)
            break;
        exposures[n] = (weft_exposure){frame_scale(&set->frames[f]), frames[n]};
        const int usable = count_usable(session->chart, frames[n], exposures[n].exposure);
        if (usable > best) {
            best = usable;
            j->frame[light] = f;
            j->full_scale[light] = exposures[n].exposure;
            memcpy(j->greys[light], frames[n], sizeof *frames);
        }
        n++;
    }
    weft_exposure_fit series;
    if (status == WEFT_OK && n >= 3 &&
        weft_linearity_from_series(session->chart, exposures, n, &series, NULL) == WEFT_OK) {
        if (j->n_series++ == 0 || series.max_deviation > j->series.max_deviation) {
            j->series = series;
            j->series_light = light;
        }
    }
    if (status == WEFT_OK && ambient)
        subtract(session->chart, j->greys[light], ambient);
    weft_free(frames);
    weft_free(exposures);
    return status;
}

static weft_err fit_lights(const weft_chart_session *session, const weft_chart_options *options,
                           const weft_patch_reading *const *readings, judgement *j, weft_error *err)
{
    WEFT_TRY(weft_chart_session_light(session, options, readings, &j->source, j->irradiance, err));
    for (int light = 0; light < session->n_lights; light++) {
        const bool known = j->source != WEFT_CHART_LIGHT_FITTED;
        const weft_grey_light grey = {
            readings[light], known ? (const double(*)[3])j->irradiance[light] : NULL, j->full_scale[light]};
        const weft_err status = weft_grey_fit_light(session->chart, &grey, &j->fits[light], err);
        if (status != WEFT_OK)
            return weft_prefix(err, status, "%s: light %d", session->set.folder, light);
    }
    return WEFT_OK;
}

static weft_err judge(const weft_chart_session *session, const weft_chart_options *options, judgement *j,
                      weft_error *err)
{
    weft_patch_reading ambient[WEFT_CHART_MAX_PATCHES];
    const weft_patch_reading *readings[WEFT_LIGHTS_MAX];
    if (session->has_ambient) {
        const weft_chart_picture picture = {&session->ambient.image, session->ambient.cfa, NULL};
        WEFT_TRY(weft_chart_measure(session->chart, &picture, &session->pose, ambient, err));
    }
    for (int light = 0; light < session->n_lights; light++) {
        WEFT_TRY(read_light(session, light, session->has_ambient ? ambient : NULL, j, err));
        readings[light] = j->greys[light];
    }
    WEFT_TRY(fit_lights(session, options, readings, j, err));
    if (j->n_series && j->series.max_deviation > WEFT_LINEARITY_SERIES_MAX)
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "%s: the sensor is not linear: the exposure series of light %d bends by %.2f %% of the range at "
            "%.2f (%.0f %% allowed); switch off gamma and automatic corrections of the camera",
            session->set.folder, j->series_light, 100 * j->series.max_deviation, j->series.worst_at,
            100 * WEFT_LINEARITY_SERIES_MAX);
    const weft_err status = weft_linearity_from_greys(session->chart, j->fits, readings, j->full_scale,
                                                      session->n_lights, &j->linearity, err);
    return status == WEFT_OK ? WEFT_OK : weft_prefix(err, status, "%s", session->set.folder);
}

/* Every grey: its reflectance, and the mean deviation from the straight line over the lights that see it. */
static json_t *greys_json(const weft_chart_session *session, const judgement *j)
{
    const weft_chart *const chart = session->chart;
    json_t *const greys = json_array();
    for (int p = 0; p < chart->columns * chart->rows; p++) {
        double sum[WEFT_SITES] = {0};
        int n = 0;
        for (int light = 0; light < session->n_lights; light++) {
            n += j->fits[light].usable[p];
            for (int s = 0; s < WEFT_SITES && j->fits[light].usable[p]; s++)
                sum[s] += j->fits[light].deviation[p][s];
        }
        for (int s = 0; s < WEFT_SITES; s++)
            sum[s] /= n > 0 ? n : 1;
        if (n > 0)
            json_array_append_new(greys,
                                  json_pack("{s:s, s:f, s:o}", "name", chart->patches[p].name, "reflectance",
                                            weft_munsell_reflectance(chart->patches[p].munsell_value),
                                            "deviation", weft_json_numbers(sum, WEFT_SITES)));
    }
    return greys;
}

static json_t *report(const weft_chart_session *session, const weft_chart_options *options,
                      const judgement *j)
{
    json_t *const r = weft_chart_session_report(session, options);
    json_t *const lights = json_array();
    for (int light = 0; light < session->n_lights; light++) {
        const weft_grey_fit *const f = &j->fits[light];
        json_array_append_new(lights, json_pack("{s:i, s:i, s:f, s:s, s:o, s:o, s:f}", "light", light,
                                                "patches", f->n_usable, "max_deviation", f->max_deviation,
                                                "worst_patch", session->chart->patches[f->worst_patch].name,
                                                "slopes_per_s", weft_json_numbers(f->slope, WEFT_SITES),
                                                "range", weft_json_numbers(f->range, 2), "exposure_s",
                                                session->set.frames[j->frame[light]].exposure_s));
    }
    json_object_set_new(r, "range", weft_json_numbers(session->cal.linearity.range, 2));
    json_object_set_new(r, "max_deviation", json_real(session->cal.linearity.max_deviation));
    json_object_set_new(r, "illumination", json_string(weft_chart_light_source_name(j->source)));
    json_object_set_new(r, "lights", lights);
    json_object_set_new(r, "greys", greys_json(session, j));
    json_object_set_new(r, "greys_max_deviation", json_real(j->linearity.max_deviation));
    if (j->n_series)
        json_object_set_new(r, "series",
                            json_pack("{s:i, s:f, s:f, s:o, s:o}", "lights", j->n_series, "max_deviation",
                                      j->series.max_deviation, "worst_at", j->series.worst_at, "range",
                                      weft_json_numbers(j->series.range, 2), "offsets",
                                      weft_json_numbers(j->series.offset, WEFT_SITES)));
    return r;
}

static void print_noise(const weft_invocation *inv, const json_t *noise)
{
    size_t site;
    const json_t *c;
    json_array_foreach((json_t *)noise, site, c) /* does not change it: Jansson's macro lacks the const */
    {
        const json_t *const saturation = json_object_get(c, "saturation_dn");
        fprintf(inv->out, "%-6s black %.1f DN, %.3f +- %.3f e/DN, read noise %.1f e, fixed pattern %.2f %%, ",
                weft_site_names[site], json_number_value(json_object_get(c, "black_dn")),
                json_number_value(json_object_get(c, "gain_e_per_dn")),
                json_number_value(json_object_get(c, "gain_sigma")),
                json_number_value(json_object_get(c, "read_noise_e")),
                100 * json_number_value(json_object_get(c, "fixed_pattern")));
        if (json_is_null(saturation))
            fputs("saturation not reached\n", inv->out);
        else
            fprintf(inv->out, "saturates at %.0f DN\n", json_number_value(saturation));
    }
}

static weft_err print(const weft_invocation *inv, const weft_chart_session *session, const judgement *j,
                      weft_error *err)
{
    const weft_linearity *const l = &session->cal.linearity;
    if (inv->json)
        return weft_print_json(inv, json_deep_copy(weft_calibration_get_report(&session->cal, "linearity")),
                               err);
    fprintf(inv->out, "linear from %.3f to %.3f of the range\n", l->range[0], l->range[1]);
    fprintf(inv->out, "greys: off by %.2f %% at most (%d lights, illumination %s)\n",
            100 * j->linearity.max_deviation, session->n_lights, weft_chart_light_source_name(j->source));
    if (j->n_series)
        fprintf(inv->out, "exposure series: off by %.3f %% of the range at most (%d lights)\n",
                100 * j->series.max_deviation, j->n_series);
    print_noise(inv, json_object_get(weft_calibration_get_report(&session->cal, "linearity"), "noise"));
    return WEFT_OK;
}

static weft_err run(const weft_invocation *inv, const void *vargs, weft_error *err)
{
    const linearity_args *const args = vargs;
    weft_chart_session session;
    judgement j = {0};
    WEFT_TRY(weft_chart_session_open(inv, &args->chart, "munsell", NULL, 0, &session, err));
    weft_err status = WEFT_OK;
    if (session.cal.has_linearity && !inv->force)
        status = weft_fail(err, WEFT_ERR_EXISTS, "%s has a linearity already: --force replaces it",
                           args->chart.output);
    if (status == WEFT_OK)
        status = judgement_init(&j, session.n_lights, err);
    if (status == WEFT_OK)
        status = judge(&session, &args->chart, &j, err);
    if (status == WEFT_OK) {
        session.cal.linearity = j.linearity;
        if (j.n_series) {
            session.cal.linearity.max_deviation = j.series.max_deviation;
            session.cal.linearity.range[0] = fmax(fmin(j.linearity.range[0], j.series.range[0]), 0);
        }
        session.cal.has_linearity = true;
        json_t *noise = NULL, *const told = report(&session, &args->chart, &j);
        status = weft_sensor_report(&session.set, j.n_series ? j.series.offset : NULL, &noise, err);
        if (noise) {
            json_object_set_new(told, "noise", noise);
            json_object_set_new(told, "noise_gain", json_real(session.set.frames[0].gain));
        }
        if (status == WEFT_OK)
            status = weft_calibration_set_report(&session.cal, "linearity", told, err);
        else
            json_decref(told);
    }
    if (status == WEFT_OK)
        status = weft_chart_session_save(&session, &args->chart, NULL, err);
    if (status == WEFT_OK)
        status = print(inv, &session, &j, err);
    judgement_fini(&j);
    weft_chart_session_fini(&session);
    return status;
}

const weft_command weft_cmd_calibrate_linearity = {
    .name = "calibrate linearity",
    .summary = "a Munsell chart: is the sensor linear, and over which range",
    .operands = "SET",
    .min_operands = 1,
    .max_operands = 1,
    .args_size = sizeof(linearity_args),
    .fields = fields,
    .details =
        "The set shows the matte Munsell neutrals (6 x 2, N9.5 to N2), found by themselves, under each "
        "light.\n"
        "Every patch must answer as its nominal reflectance says (5 %, below N4 10 %).  With a bracket of "
        "three\n"
        "exposures or more (weft capture --bracket 3) the exposure series is judged as well: 1 % of the "
        "range.\n"
        "When the calibration has lights and the camera's pose, their light is divided out; else what the "
        "lamps have\n"
        "in common is taken for nearly even (4 lamps or more, from all sides).",
    .example = "weft calibrate linearity munsell.set -o scanner.cal",
    .run = run,
};
