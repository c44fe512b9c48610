/** One colour per patch from many lights: what they agree on. */
#ifndef WEFT_CALIBRATION_CHARTS_PATCH_COLOUR_H
#define WEFT_CALIBRATION_CHARTS_PATCH_COLOUR_H

#include "calibration/calibration.h"
#include "calibration/charts/chart_measure.h"
#include "calibration/charts/colour_fit.h"
#include "core/fields.h"

/** Readings under one light, and the linear value that a white patch would have in each place. */
typedef struct weft_patch_light {
    const weft_patch_reading *readings;
    double irradiance[WEFT_CHART_MAX_PATCHES][3];
} weft_patch_light;

typedef struct weft_patch_colour {
    double camera[3];     /* reflectance in camera RGB, white balanced by the lights */
    double spread;        /* largest relative standard deviation between the lights that count */
    int n_lights;         /* that count: not clipped, no glint, no shadow */
    const char *excluded; /* why the patch is no good, NULL: it is; one of the texts below */
} weft_patch_colour;

extern const char *const weft_patch_clipped;  /* more than half of the lights clip in it */
extern const char *const weft_patch_unsteady; /* the lights disagree by more than 5 % */
extern const char *const weft_patch_dark;     /* nothing is seen */
extern const char *const weft_patch_stained;  /* dust, a scratch, a stain: not one colour */
extern const char *const weft_patch_by_hand;  /* the user said so */

/**
 * Divides every reading by its light and averages over the lights, leaving out clipped ones and those that
 * stand apart from the median (a glint under one light, a shadow under another).
 *
 * @param colours  [patch]
 */
void weft_patch_colours(const weft_chart *chart, const weft_patch_light *lights, int n_lights,
                        weft_patch_colour *colours);

/** Marks patches that the user named, by name (case ignored) or number from 1, as excluded by hand.
 *  @return WEFT_ERR_USAGE for a name that the chart does not have */
weft_err weft_patch_exclude(const weft_chart *chart, const weft_texts *names, weft_patch_colour *colours,
                            weft_error *err);

/** Samples for a fit.  @return WEFT_ERR_NODATA when more than a quarter of the patches is clipped */
weft_err weft_patch_samples(const weft_chart *chart, const weft_patch_colour *colours,
                            weft_colour_sample *samples, weft_error *err);

/** The colour part of a calibration: the model, how good it is, and the colours it was fitted to. */
void weft_patch_fill_part(const weft_chart *chart, const weft_patch_colour *colours,
                          const weft_colour_fit *fit, weft_colour_part *part);

#endif
