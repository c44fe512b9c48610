/** weft calibrate colour --apply: the colours of plain photographs, many at a time. */
#ifndef WEFT_HOST_CLI_COLOUR_APPLY_H
#define WEFT_HOST_CLI_COLOUR_APPLY_H

#include "calibration/charts/chart.h"
#include "calibration/colour_model.h"
#include "core/fields.h"
#include "host/cli/command.h"

typedef struct weft_apply_options {
    bool apply;
    const char *chart_photo, *cal, *flat;
    int format, encoding, bits, input; /* indices of the choices below */
} weft_apply_options;

#define WEFT_APPLY_OPTION(args_type, member, field)                                                          \
    (offsetof(args_type, member) + offsetof(weft_apply_options, field))

/** The rows of a command's table for a weft_apply_options member. */
#define WEFT_APPLY_FIELDS(args_type, member)                                                                 \
    {                                                                                                        \
        .key = "apply",                                                                                      \
        .type = WEFT_FIELD_FLAG,                                                                             \
        .offset = WEFT_APPLY_OPTION(args_type, member, apply),                                               \
        .help = "correct plain photographs (raw, TIFF, PNG, EXR) instead; --output is then a folder",        \
    },                                                                                                       \
        {                                                                                                    \
            .key = "chart-photo",                                                                            \
            .type = WEFT_FIELD_TEXT,                                                                         \
            .offset = WEFT_APPLY_OPTION(args_type, member, chart_photo),                                     \
            .unit = "FILE",                                                                                  \
            .help = "with --apply: a photograph of the chart under the same light",                          \
        },                                                                                                   \
        {                                                                                                    \
            .key = "cal",                                                                                    \
            .short_opt = 'c',                                                                                \
            .type = WEFT_FIELD_TEXT,                                                                         \
            .offset = WEFT_APPLY_OPTION(args_type, member, cal),                                             \
            .unit = "CAL",                                                                                   \
            .help = "with --apply: colours of a scanner's calibration, all its lights on",                   \
        },                                                                                                   \
        {                                                                                                    \
            .key = "flat",                                                                                   \
            .type = WEFT_FIELD_TEXT,                                                                         \
            .offset = WEFT_APPLY_OPTION(args_type, member, flat),                                            \
            .unit = "FILE",                                                                                  \
            .help =                                                                                          \
                "with --apply: a photograph of a blank sheet under the same light; all are divided by it",   \
        },                                                                                                   \
        {                                                                                                    \
            .key = "format",                                                                                 \
            .type = WEFT_FIELD_CHOICE,                                                                       \
            .offset = WEFT_APPLY_OPTION(args_type, member, format),                                          \
            .choices = "tiff|png|exr",                                                                       \
            .def = "tiff",                                                                                   \
            .help = "with --apply: of the corrected pictures; EXR is linear half float",                     \
        },                                                                                                   \
        {                                                                                                    \
            .key = "encoding",                                                                               \
            .type = WEFT_FIELD_CHOICE,                                                                       \
            .offset = WEFT_APPLY_OPTION(args_type, member, encoding),                                        \
            .choices = "srgb|linear",                                                                        \
            .def = "srgb",                                                                                   \
            .help = "with --apply: of TIFF and PNG; the ICC profile in them says which",                     \
        },                                                                                                   \
        {                                                                                                    \
            .key = "bits",                                                                                   \
            .type = WEFT_FIELD_CHOICE,                                                                       \
            .offset = WEFT_APPLY_OPTION(args_type, member, bits),                                            \
            .choices = "16|8",                                                                               \
            .def = "16",                                                                                     \
            .help = "with --apply: of TIFF and PNG",                                                         \
        },                                                                                                   \
    {                                                                                                        \
        .key = "input", .type = WEFT_FIELD_CHOICE, .offset = WEFT_APPLY_OPTION(args_type, member, input),    \
        .choices = "auto|linear|srgb", .def = "auto",                                                        \
        .help = "with --apply: what TIFF and PNG photographs hold; auto: 16 bit linear, 8 bit sRGB"          \
    }

/** What the chart options of the command say. */
typedef struct weft_apply_chart {
    const char *name, *edition, *output, *overlay;
    const weft_numbers *corners;
    const weft_texts *exclude;
    weft_colour_method method;
} weft_apply_chart;

/**
 * Corrects the operands one after the other into the folder chart->output, and keeps what was done in its
 * corrected.json: a second run leaves alone what is done.  A photograph that fails is named, and the rest
 * goes on.
 *
 * @return WEFT_ERR_NODATA at the end when a photograph failed; WEFT_ERR_EXISTS when the folder is of another
 * correction
 */
weft_err weft_colour_apply(const weft_invocation *inv, const weft_apply_options *options,
                           const weft_apply_chart *chart, weft_error *err);

#endif
