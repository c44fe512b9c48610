#include "host/cli/chart_session.h"

#include "calibration/calibration_report.h"
#include "calibration/charts/chart_light.h"
#include "calibration/charts/chart_overlay.h"
#include "core/file.h"
#include "core/formats/png_file.h"
#include "core/json.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void weft_chart_session_fini(weft_chart_session *session)
{
    weft_free(session->readings);
    weft_plate_fini(&session->sum);
    weft_plate_fini(&session->ambient);
    weft_calibration_fini(&session->cal);
    weft_set_fini(&session->set);
    *session = (weft_chart_session){0};
}

weft_err weft_chart_options_check(const weft_invocation *inv, const weft_chart_options *options,
                                  weft_error *err)
{
    if (options->corners.n != 0 && options->corners.n != 8)
        return weft_fail(err, WEFT_ERR_USAGE, "--corners wants 8 numbers (u,v of four corners), got %d",
                         options->corners.n);
    if (options->overlay)
        WEFT_TRY(weft_file_refuse_existing(options->overlay, inv->force, err));
    if (options->patches)
        WEFT_TRY(weft_file_refuse_existing(options->patches, inv->force, err));
    if (options->overlay && !weft_path_has_suffix(options->overlay, ".png"))
        return weft_fail(err, WEFT_ERR_USAGE, "--overlay %s: its name must end in .png", options->overlay);
    return WEFT_OK;
}

static weft_err load_light(weft_chart_session *s, int light, weft_plate *plate, weft_error *err)
{
    return weft_plate_load_light(&s->set, light, s->has_ambient ? &s->ambient : NULL, plate, err);
}

/* Adds a plate to the sum; the first one becomes it. */
static void add_plate(weft_plate *sum, weft_plate *plate)
{
    if (!sum->image.data) {
        *sum = *plate;
        *plate = (weft_plate){0};
        return;
    }
    const size_t n = weft_image_plane_size(&sum->image);
    for (size_t i = 0; i < n * (size_t)sum->image.planes; i++)
        sum->image.data[i] += plate->image.data[i];
    for (size_t i = 0; i < n; i++)
        sum->clipped.data[i] |= plate->clipped.data[i];
}

static weft_err sum_lights(weft_chart_session *s, weft_progress *progress, weft_error *err)
{
    for (int light = 0; light < s->n_lights; light++) {
        weft_plate plate = {0};
        WEFT_TRY(load_light(s, light, &plate, err));
        add_plate(&s->sum, &plate);
        weft_plate_fini(&plate);
        WEFT_TRY(weft_progress_step(progress, 1, err));
    }
    return WEFT_OK;
}

static weft_err find_chart(weft_chart_session *s, const weft_chart_options *options, weft_error *err)
{
    const weft_chart_picture picture = {&s->sum.image, s->sum.cfa, &s->sum.clipped};
    if (options->corners.n == 0)
        return weft_chart_locate(s->chart, &picture, &s->pose, err);
    double corners[4][2];
    memcpy(corners, options->corners.values, sizeof corners);
    return weft_chart_place(s->chart, &picture, (const double(*)[2])corners, &s->pose, err);
}

static weft_err read_lights(weft_chart_session *s, weft_progress *progress, weft_error *err)
{
    s->readings = weft_alloc((size_t)s->n_lights, sizeof *s->readings, err);
    if (!s->readings)
        return WEFT_ERR_NOMEM;
    for (int light = 0; light < s->n_lights; light++) {
        weft_plate plate = {0};
        WEFT_TRY(load_light(s, light, &plate, err));
        const weft_chart_picture picture = {&plate.image, plate.cfa, &plate.clipped};
        const weft_err status = weft_chart_measure(s->chart, &picture, &s->pose, s->readings[light], err);
        weft_plate_fini(&plate);
        if (status != WEFT_OK)
            return weft_prefix(err, status, "light %d", light);
        WEFT_TRY(weft_progress_step(progress, 1, err));
    }
    return WEFT_OK;
}

static weft_err measure(weft_chart_session *s, const weft_chart_options *options, weft_error *err)
{
    weft_progress progress;
    weft_progress_begin(&progress, "reading the chart", "lights", 2L * s->n_lights);
    weft_err status = weft_plate_load_ambient(&s->set, &s->ambient, &s->has_ambient, err);
    if (status == WEFT_OK)
        status = sum_lights(s, &progress, err);
    if (status == WEFT_OK) {
        status = find_chart(s, options, err);
        if (status != WEFT_OK)
            weft_prefix(err, status, "%s", s->set.folder);
    }
    if (status == WEFT_OK)
        status = read_lights(s, &progress, err);
    weft_progress_end(&progress);
    return status;
}

weft_err weft_chart_session_open(const weft_invocation *inv, const weft_chart_options *options,
                                 const char *chart, const char *edition, unsigned needs,
                                 weft_chart_session *session, weft_error *err)
{
    weft_chart_session s = {0};
    WEFT_TRY(weft_chart_options_check(inv, options, err));
    WEFT_TRY(weft_chart_find(chart, edition, &s.chart, err));
    weft_err status = weft_calibration_open(options->output, &s.cal, err);
    if (status == WEFT_OK)
        status = weft_calibration_require(&s.cal, needs, options->output, err);
    if (status == WEFT_OK)
        status = weft_set_load(inv->operands[0], &s.set, err);
    if (status == WEFT_OK)
        status = weft_set_require_lights(&s.set, err);
    if (status == WEFT_OK && s.cal.has_camera)
        status = weft_calibration_require_size(&s.cal, s.set.width, s.set.height, options->output, err);
    if (status == WEFT_OK) {
        s.n_lights = weft_set_n_lights(&s.set);
        if (s.cal.has_lights && s.cal.n_lights != s.n_lights)
            status =
                weft_fail(err, WEFT_ERR_MISMATCH, "%s has %d lights, %s %d: they are not of the same scanner",
                          inv->operands[0], s.n_lights, options->output, s.cal.n_lights);
    }
    if (status == WEFT_OK && s.n_lights > WEFT_LIGHTS_MAX)
        status = weft_fail(err, WEFT_ERR_RANGE, "%s: %d lights, at most %d are possible", inv->operands[0],
                           s.n_lights, WEFT_LIGHTS_MAX);
    if (status == WEFT_OK)
        status = measure(&s, options, err);
    if (status != WEFT_OK) {
        weft_chart_session_fini(&s);
        return status;
    }
    weft_explain("the chart was found at (%.1f, %.1f) (%.1f, %.1f) (%.1f, %.1f) (%.1f, %.1f); %d edges "
                 "within %.2f px; "
                 "its colours explain %.3f (any other way round %.3f)",
                 s.pose.corners[0][0], s.pose.corners[0][1], s.pose.corners[1][0], s.pose.corners[1][1],
                 s.pose.corners[2][0], s.pose.corners[2][1], s.pose.corners[3][0], s.pose.corners[3][1],
                 s.pose.n_edges, s.pose.edge_rms_px, s.pose.score, s.pose.runner_up);
    *session = s;
    return WEFT_OK;
}

const char *weft_chart_light_source_name(weft_chart_light_source source)
{
    static const char *const names[] = {"modelled", "common", "fitted"};
    return names[source];
}

weft_err weft_chart_session_light(const weft_chart_session *session, const weft_chart_options *options,
                                  const weft_patch_reading *const *readings, weft_chart_light_source *source,
                                  weft_grey_irradiance *irradiance, weft_error *err)
{
    const weft_calibration *const cal = &session->cal;
    if (cal->has_lights && cal->has_camera && cal->camera.has_pose) {
        *source = WEFT_CHART_LIGHT_MODELLED;
        for (int light = 0; light < session->n_lights; light++)
            WEFT_TRY(weft_chart_irradiance(cal, light, session->chart, &session->pose, options->height_mm,
                                           irradiance[light], err));
    } else if (session->n_lights >= WEFT_GREY_LIGHTS_MIN) {
        *source = WEFT_CHART_LIGHT_COMMON;
        weft_grey_illumination(session->chart, readings, session->n_lights, irradiance);
    } else {
        *source = WEFT_CHART_LIGHT_FITTED;
        weft_warn("%d lights are too few to tell their gradient from a bend of the sensor: calibrate the "
                  "lights first "
                  "(weft calibrate lights) for a better judgement",
                  session->n_lights);
    }
    return WEFT_OK;
}

weft_err weft_chart_session_read_frame(const weft_chart_session *session, int frame,
                                       weft_patch_reading *readings, weft_error *err)
{
    weft_plate plate;
    WEFT_TRY(weft_plate_load_frame(&session->set, frame, &plate, err));
    const weft_chart_picture picture = {&plate.image, plate.cfa, &plate.clipped};
    const weft_err status = weft_chart_measure(session->chart, &picture, &session->pose, readings, err);
    weft_plate_fini(&plate);
    return status;
}

json_t *weft_chart_session_report(const weft_chart_session *session, const weft_chart_options *options)
{
    const weft_chart_pose *const pose = &session->pose;
    double corners[8];
    memcpy(corners, pose->corners, sizeof corners);
    return json_pack("{s:s, s:s, s:s, s:s, s:o, s:s, s:i, s:f, s:f, s:b}", "set",
                     session->set.name ? session->set.name : "", "captured", session->set.created, "chart",
                     session->chart->name, "edition", session->chart->edition, "corners_px",
                     weft_json_numbers(corners, 8), "corners_by", options->corners.n ? "hand" : "itself",
                     "edges", pose->n_edges, "edge_rms_px", pose->edge_rms_px, "score", pose->score,
                     "ambient_subtracted", session->has_ambient);
}

static weft_err write_overlay(const weft_chart_session *s, const char *path, const unsigned char *left_out,
                              weft_error *err)
{
    const weft_chart_picture picture = {&s->sum.image, s->sum.cfa, NULL};
    weft_raster raster = {0};
    weft_err status = weft_chart_overlay(s->chart, &picture, &s->pose, left_out, &raster, err);
    if (status == WEFT_OK)
        status = weft_png_write(path, &raster, err);
    weft_raster_fini(&raster);
    return status;
}

static void write_reading(FILE *out, int light, int patch, const char *name, const weft_patch_reading *r)
{
    fprintf(out, "%d,%d,%s,%.2f,%.2f", light, patch + 1, name, r->u, r->v);
    for (int site = 0; site < WEFT_SITES; site++)
        fprintf(out, ",%.9g,%.9g,%d", r->mean[site], r->std_dev[site], r->n[site]);
    fprintf(out, ",%.6f,%.6f\n", r->clipped, r->outliers);
}

static weft_err write_patches(const weft_chart_session *s, const char *path, weft_error *err)
{
    char *text = NULL;
    size_t size = 0;
    FILE *const out = open_memstream(&text, &size);
    if (!out)
        return weft_fail(err, WEFT_ERR_NOMEM, "%s: no memory for its text", path);
    fputs("light,patch,name,u_px,v_px", out);
    for (int site = 0; site < WEFT_SITES; site++)
        fprintf(out, ",%s_mean_per_s,%s_std_dev_per_s,%s_pixels", weft_site_names[site],
                weft_site_names[site], weft_site_names[site]);
    fputs(",clipped_share,outlier_share\n", out);
    for (int light = 0; light < s->n_lights; light++)
        for (int p = 0; p < s->chart->columns * s->chart->rows; p++)
            write_reading(out, light, p, s->chart->patches[p].name, &s->readings[light][p]);
    const bool written = fclose(out) == 0;
    const weft_err status = written ? weft_file_write(path, text, size, err)
                                    : weft_fail(err, WEFT_ERR_NOMEM, "%s: no memory for its text", path);
    free(text);
    return status;
}

weft_err weft_chart_session_save(const weft_chart_session *session, const weft_chart_options *options,
                                 const unsigned char *left_out, weft_error *err)
{
    if (options->overlay)
        WEFT_TRY(write_overlay(session, options->overlay, left_out, err));
    if (options->patches)
        WEFT_TRY(write_patches(session, options->patches, err));
    return weft_calibration_save(options->output, &session->cal, err);
}
