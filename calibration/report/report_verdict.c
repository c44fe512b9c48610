/* What is good, what is to be done again and how: the limits of docs/calibration.md as code. */
#include "calibration/calibration_report.h"
#include "calibration/report/report_parts.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

const char *weft_grade_name(weft_grade grade)
{
    static const char *const names[] = {"good", "fair", "redo", "absent"};
    return names[grade];
}

static void add(weft_verdict *v, weft_grade grade, const char *part, const char *remedy, const char *format,
                ...) WEFT_PRINTF(5, 6);
static void add(weft_verdict *v, weft_grade grade, const char *part, const char *remedy, const char *format,
                ...)
{
    if (v->n >= WEFT_FINDINGS_MAX)
        return;
    weft_finding *const f = &v->findings[v->n++];
    va_list args;
    va_start(args, format);
    vsnprintf(f->text, sizeof f->text, format, args);
    va_end(args);
    snprintf(f->remedy, sizeof f->remedy, "%s", grade == WEFT_GRADE_GOOD || !remedy ? "" : remedy);
    f->grade = grade;
    f->part = part;
    if (grade > v->worst)
        v->worst = grade;
}

/* Below `good` it is good, below `fair` fair. */
static weft_grade grade_of(double value, double good, double fair)
{
    return value <= good ? WEFT_GRADE_GOOD : value <= fair ? WEFT_GRADE_FAIR : WEFT_GRADE_REDO;
}

static void judge_views(const json_t *lens, weft_verdict *v)
{
    const json_t *const views = json_object_get(lens, "views");
    char names[200] = "";
    int dropped = 0;
    for (size_t i = 0; i < json_array_size(views); i++) {
        const json_t *const view = json_array_get(views, i);
        if (!json_is_false(json_object_get(view, "used")))
            continue;
        const size_t n = strlen(names);
        const char *const why = weft_report_text(view, "left_out");
        snprintf(names + n, sizeof names - n, "%s%s%s%s%s", dropped++ ? ", " : "",
                 weft_report_text(view, "image"), why[0] ? " (" : "", why, why[0] ? ")" : "");
    }
    if (dropped)
        add(v, WEFT_GRADE_FAIR, "lens",
            "Look at these pictures: blur, a reflection or another board; take them again.",
            "%d of %zu pictures were left out: %s.", dropped, json_array_size(views), names);
}

static void judge_lens(const weft_calibration *cal, weft_verdict *v)
{
    const json_t *const lens = weft_calibration_get_report(cal, "lens");
    if (!cal->has_camera) {
        add(v, WEFT_GRADE_ABSENT, "lens", "weft calibrate lens board-*.set -o CAL --board-on-table table.set",
            "There is no camera.");
        return;
    }
    const double rms = cal->camera.rms_px, held_out = weft_report_number(lens, "held_out_px");
    add(v, grade_of(rms, 0.25, 0.5), "lens",
        "Sharper pictures of a flat board, and the right --board; the worst views stand in the table below.",
        "The corners are %.3f px off the lens model.", rms);
    if (!isnan(held_out) && held_out > 0)
        add(v, grade_of(held_out, fmax(0.25, 1.3 * rms), fmax(0.5, 2 * rms)), "lens",
            "More pictures, the board tilted by 20 to 40 degrees in different directions; glue it to glass.",
            "A picture that took no part in the fit is predicted to %.3f px.", held_out);
    const double coverage = weft_report_number(lens, "coverage");
    if (!isnan(coverage))
        add(v, grade_of(1 - coverage, 0.4, 0.65), "lens",
            "Take pictures with the board in the empty parts of the frame: what no board reached is "
            "extrapolated.",
            "Boards reached %.0f %% of the frame.", 100 * coverage);
    const double sigma = weft_report_number(json_object_get(lens, "sigma"), "fx") / cal->camera.fx;
    if (!isnan(sigma))
        add(v, grade_of(sigma, 0.001, 0.01), "lens", "Tilt the board more: only tilt tells the focal length.",
            "The focal length is known to %.3f %%.", 100 * sigma);
    judge_views(lens, v);
    const double bend = fabs(weft_report_number(lens, "board_bend_mm"));
    if (json_is_true(json_object_get(lens, "board_bent")))
        add(v, grade_of(bend, 0.3, 1.5), "lens", "Glue the board to glass or aluminium.",
            "The board is bent by %.2f mm; this is taken into account.", bend);
    if (!cal->camera.has_pose)
        add(v, WEFT_GRADE_ABSENT, "pose", "weft calibrate lens --board-on-table table.set -o CAL",
            "The camera's place over the table is not known.");
    const double pose = weft_report_number(weft_calibration_get_report(cal, "pose"), "rms_px");
    if (cal->camera.has_pose && !isnan(pose))
        add(v, grade_of(pose, 0.3, 0.6), "pose",
            "The board must lie flat on the table, and the camera must be focused as for the lens.",
            "The board on the table is placed to %.3f px.", pose);
}

static void judge_lamps(const weft_calibration *cal, weft_verdict *v)
{
    double worst = 0, sigma = 0;
    int off = 0, unsure = 0;
    for (int l = 0; l < cal->n_lights; l++) {
        if (cal->lights[l].residual > worst) {
            worst = cal->lights[l].residual;
            off = l;
        }
        if (cal->lights[l].position_sigma_mm > sigma) {
            sigma = cal->lights[l].position_sigma_mm;
            unsure = l;
        }
    }
    if (worst > 0)
        add(v, grade_of(worst, 0.004, 0.01), "lights",
            "Look at its map below: a spot is dust or print, a step a fold or a shadow, a slope a sheet that "
            "does not "
            "lie flat. Mend the sheet and take the set again.",
            "The model and its grid miss the sheet by %.2f %% at most (light %d).", 100 * worst, off);
    if (sigma > 0)
        add(v, grade_of(sigma, 8, 20), "lights",
            "A larger sheet in a closer frame tells more; measured positions as --guess help the lamp above "
            "the middle.",
            "The worst known position is that of light %d: +- %.1f mm.", unsure, sigma);
}

/* How the sheet lay: its larger bow and tilt, of those that stand out from their uncertainty. */
static void judge_sheet(const json_t *sheet, weft_verdict *v)
{
    static const char *const bows[2] = {"bow_mm", "bow_sigma_mm"}, *const tilts[2] = {"tilt_rad",
                                                                                      "tilt_sigma_rad"};
    double bow = 0, tilt = 0, unsure = 0;
    for (size_t i = 0; i < 2; i++) {
        unsure = fmax(unsure, weft_report_item(json_object_get(sheet, bows[1]), i));
        const double b = fabs(weft_report_item(json_object_get(sheet, bows[0]), i));
        const double t = fabs(weft_report_item(json_object_get(sheet, tilts[0]), i));
        if (b > 3 * weft_report_item(json_object_get(sheet, bows[1]), i))
            bow = fmax(bow, b);
        if (t > 3 * weft_report_item(json_object_get(sheet, tilts[1]), i))
            tilt = fmax(tilt, t);
    }
    if (!sheet)
        return;
    add(v, grade_of(bow, 0.2, 1), "lights", "Stretch the sheet over a flat plate, or glue it to one.",
        bow > 0 ? "The sheet was bowed by %.2f mm."
                : "The sheet was flat, as far as can be told (+- %.2f mm).",
        bow > 0 ? bow : unsure);
    if (tilt > 0)
        add(v, grade_of(tilt, 0.003, 0.009), "lights",
            "The sheet must lie where the board lay: on the plate.",
            "The sheet was tilted by %.2f degrees against the board on the table.", tilt * (180 / M_PI));
}

static void judge_lights(const weft_calibration *cal, weft_verdict *v)
{
    const json_t *const lights = weft_calibration_get_report(cal, "lights");
    const json_t *const settled = json_object_get(lights, "settled");
    if (!cal->has_lights) {
        add(v, WEFT_GRADE_ABSENT, "lights", "weft calibrate lights white.set -o CAL", "There are no lights.");
        return;
    }
    if (json_is_boolean(settled))
        add(v, json_is_true(settled) ? WEFT_GRADE_GOOD : WEFT_GRADE_REDO, "lights",
            "The sheet is probably uneven or glossy, or something shades it: mend it and take the set again.",
            json_is_true(settled) ? "The fit of the %d lights settled after %zu rounds."
                                  : "The fit of the %d lights had not settled after %zu rounds.",
            cal->n_lights, json_array_size(json_object_get(lights, "rounds")));
    judge_lamps(cal, v);
    judge_sheet(json_object_get(lights, "sheet"), v);
}

static void judge_linearity(const weft_calibration *cal, weft_verdict *v)
{
    const json_t *const report = weft_calibration_get_report(cal, "linearity");
    const json_t *const series = json_object_get(report, "series");
    if (!cal->has_linearity) {
        add(v, WEFT_GRADE_ABSENT, "linearity", "weft calibrate linearity munsell.set -o CAL",
            "Nobody has checked that the sensor is linear.");
        return;
    }
    add(v, grade_of(cal->linearity.max_deviation, 0.05, 0.1), "linearity",
        "Matte greys, no glints, no stray light; switch off the camera's gamma and corrections.",
        "The greys lie within %.1f %% of a straight line, from %.3f to %.3f of the range.",
        100 * cal->linearity.max_deviation, cal->linearity.range[0], cal->linearity.range[1]);
    const double bend = weft_report_number(series, "max_deviation");
    if (!isnan(bend))
        add(v, grade_of(bend, 0.005, 0.01), "linearity",
            "Switch off the camera's gamma and automatic corrections.",
            "The exposure series bends by %.2f %% of the range.", 100 * bend);
    else
        add(v, WEFT_GRADE_FAIR, "linearity",
            "weft capture munsell.set --bracket 3 tells far more than any chart.",
            "There was no exposure series.");
}

static void judge_white(const weft_calibration *cal, weft_verdict *v)
{
    const json_t *const report = weft_calibration_get_report(cal, "white");
    const json_t *const lights = json_object_get(report, "lights");
    double worst = 0;
    if (!report) {
        if (!cal->has_lights)
            add(v, WEFT_GRADE_ABSENT, "white", "weft calibrate lights white.set -o CAL",
                "White is not balanced.");
        else
            add(v, WEFT_GRADE_GOOD, "white", NULL,
                "White is balanced by the sheet, light by light; no grey chart has checked it.");
        return;
    }
    for (size_t i = 0; i < json_array_size(lights); i++)
        worst = fmax(worst, weft_report_number(json_array_get(lights, i), "difference_from_sheet"));
    add(v, grade_of(worst, 0.02, 0.04), "white",
        "Chips are off neutral by up to 2 %; above, the sheet or the chart is tinted or aged.",
        "White by the chart and by the sheet differ by %.2f %% at most.", 100 * worst);
}

static void judge_patches(const json_t *report, weft_verdict *v)
{
    const json_t *const patches = json_object_get(report, "patches");
    char names[240] = "";
    int out = 0;
    for (size_t i = 0; i < json_array_size(patches); i++) {
        const json_t *const patch = json_array_get(patches, i);
        const char *const why = weft_report_text(patch, "excluded");
        const size_t n = strlen(names);
        if (why[0])
            snprintf(names + n, sizeof names - n, "%s%s (%s)", out++ ? ", " : "",
                     weft_report_text(patch, "name"), why);
    }
    if (out)
        add(v, WEFT_GRADE_FAIR, "colour", "Dust the chart off, and mind exposure and glints.",
            "%d of %zu patches were left out: %s.", out, json_array_size(patches), names);
}

static void judge_colour(const weft_calibration *cal, weft_verdict *v)
{
    const json_t *const report = weft_calibration_get_report(cal, "colour");
    if (!cal->has_colour) {
        add(v, WEFT_GRADE_ABSENT, "colour", "weft calibrate colour macbeth.set -o CAL",
            "Camera colours are not turned into sRGB.");
        return;
    }
    const weft_colour_part *const c = &cal->colour;
    add(v, grade_of(c->delta_e_held_out_mean, 1.5, 3), "colour",
        "Is it this edition of the chart (--edition), are the lights calibrated as they stand, is the chart "
        "clean and "
        "flat? A lamp without red cannot do better.",
        "A colour that took no part in the fit is off by %.2f CIEDE2000 in the mean (%s).",
        c->delta_e_held_out_mean, weft_colour_method_name(c->model.method));
    if (c->delta_e_held_out_mean > 1.8 * c->delta_e_mean && c->delta_e_held_out_mean > 0.3)
        add(v, WEFT_GRADE_FAIR, "colour",
            "The method has too many terms for this chart: use --method matrix.",
            "Colours of the fit are off by %.2f only: it fits the patches better than the camera.",
            c->delta_e_mean);
    judge_patches(report, v);
}

/* A step that stands on another one and is older than it. */
static void judge_age(const weft_calibration *cal, const char *step, const char *before, const char *command,
                      weft_verdict *v)
{
    const char *const mine = weft_report_text(weft_calibration_get_report(cal, step), "created");
    const char *const theirs = weft_report_text(weft_calibration_get_report(cal, before), "created");
    if (mine[0] && theirs[0] && strcmp(mine, theirs) < 0)
        add(v, WEFT_GRADE_REDO, step, command, "It is of %s and stands on the %s, made anew at %s.", mine,
            before, theirs);
}

void weft_report_judge(const weft_calibration *cal, weft_verdict *verdict)
{
    *verdict = (weft_verdict){0};
    judge_lens(cal, verdict);
    judge_lights(cal, verdict);
    judge_age(cal, "lights", "lens", "weft calibrate lights white.set -o CAL --force", verdict);
    judge_age(cal, "lights", "pose", "weft calibrate lights white.set -o CAL --force", verdict);
    judge_linearity(cal, verdict);
    judge_white(cal, verdict);
    judge_colour(cal, verdict);
    judge_age(cal, "colour", "lights", "weft calibrate colour macbeth.set -o CAL --force", verdict);
}
