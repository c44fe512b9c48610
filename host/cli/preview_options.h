/** The options of "weft preview", and the view that they describe. */
#ifndef WEFT_HOST_CLI_PREVIEW_OPTIONS_H
#define WEFT_HOST_CLI_PREVIEW_OPTIONS_H

#include "core/fields.h"
#include "shading/preview/preview.h"

/** One member a row of weft_preview_fields, where its help is. */
typedef struct weft_preview_options {
    const char *output, *brdf, *match, *cal, *env, *columns;
    weft_texts params, lamps, polarise;
    weft_numbers light, light_mm, crop, sky;
    int shape, area, sky_model, tone, sweep, turntable, quality, shadow_steps, shadow_blur, folds, voxels,
        accumulate, fog_steps;
    bool draft, self_shadow, resume, temporal, fog_even, watch;
    const char *height_map;
    int filter, taps;
    weft_size size;
    double fog, fog_g, sun_disc_deg, hour, ambient_saturation, fps, exposure_ev, env_scale, ambient,
        background, repeat, fov_deg;
} weft_preview_options;

extern const weft_field weft_preview_fields[];

/** Whether many pictures are asked for. */
bool weft_preview_is_sequence(const weft_preview_options *options);

/** Refuses options that do not go together.
 *  @param input  whether there is an INPUT */
weft_err weft_preview_options_check(const weft_preview_options *options, bool input, weft_error *err);

/** Lights, crop, shape and all of the view that depends on neither the input nor the surroundings; its size
 *  stays. */
weft_err weft_preview_options_view(const weft_preview_options *options, weft_preview_view *view,
                                   weft_error *err);

#endif
