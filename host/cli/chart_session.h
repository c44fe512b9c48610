/**
 * What the commands that photograph a chart share: their options, finding the chart in a set, reading its
 * patches under every light.
 */
#ifndef WEFT_HOST_CLI_CHART_SESSION_H
#define WEFT_HOST_CLI_CHART_SESSION_H

#include "calibration/calibration.h"
#include "calibration/charts/chart_find.h"
#include "calibration/charts/chart_measure.h"
#include "calibration/charts/grey_illumination.h"
#include "core/fields.h"
#include "host/cli/command.h"
#include "host/set/plate.h"

typedef struct weft_chart_options {
    const char *output;   /* the calibration */
    weft_numbers corners; /* 8 numbers or none */
    const char *overlay;  /* PNG, or NULL */
    const char *patches;  /* CSV, or NULL */
    double height_mm;
} weft_chart_options;

#define WEFT_CHART_OPTION(args_type, member, field)                                                          \
    (offsetof(args_type, member) + offsetof(weft_chart_options, field))

/** The rows of a command's table for a weft_chart_options member. */
#define WEFT_CHART_FIELDS(args_type, member)                                                                 \
    {                                                                                                        \
        .key = "output",                                                                                     \
        .short_opt = 'o',                                                                                    \
        .type = WEFT_FIELD_TEXT,                                                                             \
        .offset = WEFT_CHART_OPTION(args_type, member, output),                                              \
        .unit = "CAL",                                                                                       \
        .required = true,                                                                                    \
        .help = "the calibration to add to (NAME.cal; made when it is not there)",                           \
    },                                                                                                       \
        {                                                                                                    \
            .key = "corners",                                                                                \
            .type = WEFT_FIELD_F64S,                                                                         \
            .offset = WEFT_CHART_OPTION(args_type, member, corners),                                         \
            .unit = "U,V,...",                                                                               \
            .help = "where the chart is, when it is not found: the frame's four outer corners in pixels, "   \
                    "clockwise from the first patch",                                                        \
        },                                                                                                   \
        {                                                                                                    \
            .key = "overlay",                                                                                \
            .type = WEFT_FIELD_TEXT,                                                                         \
            .offset = WEFT_CHART_OPTION(args_type, member, overlay),                                         \
            .unit = "FILE.png",                                                                              \
            .help = "draw the patches that were found into the photograph",                                  \
        },                                                                                                   \
        {                                                                                                    \
            .key = "patches",                                                                                \
            .type = WEFT_FIELD_TEXT,                                                                         \
            .offset = WEFT_CHART_OPTION(args_type, member, patches),                                         \
            .unit = "FILE.csv",                                                                              \
            .help = "write every patch's raw values under every light",                                      \
        },                                                                                                   \
    {                                                                                                        \
        .key = "height", .type = WEFT_FIELD_F64, .offset = WEFT_CHART_OPTION(args_type, member, height_mm),  \
        .unit = "mm", .min = -50, .max = 50, .def = "0",                                                     \
        .help = "height of the chart's surface over the sample plane"                                        \
    }

/** Refuses corners that are not eight numbers, and outputs that are there without --force. */
weft_err weft_chart_options_check(const weft_invocation *inv, const weft_chart_options *options,
                                  weft_error *err);

typedef weft_patch_reading weft_chart_readings[WEFT_CHART_MAX_PATCHES];

typedef struct weft_chart_session {
    const weft_chart *chart;
    weft_set set;
    weft_calibration cal;
    int n_lights;
    weft_plate ambient;
    bool has_ambient;
    weft_plate sum; /* of all lights; clipped where any light clips */
    weft_chart_pose pose;
    weft_chart_readings *readings; /* [light], ambient subtracted, 1/s at gain 1 */
} weft_chart_session;

/**
 * Opens the set and the calibration (an empty one when it is not there), finds the chart in the sum of all
 * lights and reads its patches under each.  Outputs that exist are refused without --force.
 *
 * @param needs  parts of the calibration that must be there (weft_calibration_part)
 */
weft_err weft_chart_session_open(const weft_invocation *inv, const weft_chart_options *options,
                                 const char *chart, const char *edition, unsigned needs,
                                 weft_chart_session *session, weft_error *err);
void weft_chart_session_fini(weft_chart_session *session);

/** Where the knowledge of the light on the patches comes from. */
typedef enum weft_chart_light_source {
    WEFT_CHART_LIGHT_MODELLED, /* the calibration's lights and camera pose */
    WEFT_CHART_LIGHT_COMMON,   /* from the chart, lamps from all sides (grey_illumination.h) */
    WEFT_CHART_LIGHT_FITTED,   /* from the chart, an affine fit per lamp: too few lamps for better */
} weft_chart_light_source;

/** @return "modelled", "common", "fitted" */
const char *weft_chart_light_source_name(weft_chart_light_source source);

/**
 * Relative light on the patches of a grey chart under each lamp, by the best knowledge there is.
 *
 * @param readings    [light] what is to be divided
 * @param irradiance  [light]; left alone for WEFT_CHART_LIGHT_FITTED
 */
weft_err weft_chart_session_light(const weft_chart_session *session, const weft_chart_options *options,
                                  const weft_patch_reading *const *readings, weft_chart_light_source *source,
                                  weft_grey_irradiance *irradiance, weft_error *err);

/** Readings of one frame, as weft_plate_load_frame() gives it. */
weft_err weft_chart_session_read_frame(const weft_chart_session *session, int frame,
                                       weft_patch_reading *readings, weft_error *err);

/** Where from, with what: begins the report of a step. */
json_t *weft_chart_session_report(const weft_chart_session *session, const weft_chart_options *options);

/** Writes --overlay and --patches, then the calibration.  @param left_out  [patch] or NULL */
weft_err weft_chart_session_save(const weft_chart_session *session, const weft_chart_options *options,
                                 const unsigned char *left_out, weft_error *err);

#endif
