/** The lights of "weft preview" as the user writes them. */
#ifndef WEFT_HOST_CLI_PREVIEW_LIGHTS_H
#define WEFT_HOST_CLI_PREVIEW_LIGHTS_H

#include "core/fields.h"
#include "shading/preview/preview.h"

/** No lamp is farther: the squares of single precision end at 1e19. */
#define WEFT_PREVIEW_FARTHEST_MM 1e9

/**
 * Reads one lamp: "AZ,EL", "mm:X,Y,Z", "ball:X,Y,Z,RADIUS" or "tube:X,Y,Z,X,Y,Z" (mm), each optionally with
 * ",STRENGTH" behind (1: a white card at the origin that faces it reads 1).
 * @return WEFT_ERR_USAGE saying what was wanted
 */
weft_err weft_preview_lamp(const char *text, weft_preview_light *light, weft_error *err);

/** A panorama and the table that go with it, in memory. */
typedef struct weft_preview_around {
    weft_environment_map map;
    weft_environment_table table;
} weft_preview_around;

/** Reads a polarising filter: "R,G,B" (0..1), or several "HOUR:R,G,B" of which that of `hour` is found
 *  between the keys.  No texts: no filter.  @return WEFT_ERR_USAGE saying what was wanted */
weft_err weft_preview_polariser(const weft_texts *texts, double hour, double factor[3], weft_error *err);

/** Reads a panorama (EXR, or PNG/TIFF in sRGB), or paints the sky with the sun at {azimuth, elevation} in
 *  degrees, and makes surroundings of it.  One of `file` and `sky_deg` is given. */
weft_err weft_preview_around_init(weft_preview_around *around, const char *file, const weft_numbers *sky_deg,
                                  const weft_sky *sky, const weft_sky_filter *filter, weft_error *err);
void weft_preview_around_fini(weft_preview_around *around);

#endif
