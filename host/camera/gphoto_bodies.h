/**
 * What the makers of still cameras call their settings in libgphoto2, and what a body must be set to so that
 * its frames can be measured.  One row per body or maker; no code elsewhere asks which camera it is.
 */
#ifndef WEFT_HOST_CAMERA_GPHOTO_BODIES_H
#define WEFT_HOST_CAMERA_GPHOTO_BODIES_H

#include <stdbool.h>
#include <stddef.h>

enum { GPHOTO_MAX_SETTINGS = 14 };

/** A setting that is made, or refused when the body does not take it.  A body without it is fine. */
typedef struct gphoto_setting {
    const char *name;   /* libgphoto2's: "imagequality" */
    const char *values; /* what will do, best first: "NEF (Raw)|RAW" */
    const char *remedy; /* what the photographer can do when the computer cannot */
    bool wish;          /* not refused when it cannot be set */
} gphoto_setting;

typedef struct gphoto_body {
    const char *vendor, *model; /* beginnings of what the body says of itself; "" fits every one */
    const char *shutter, *iso;  /* names of the settings; several with | between: the first there is */
    double base_iso;            /* ISO that is gain 1 */
    gphoto_setting settings[GPHOTO_MAX_SETTINGS]; /* in this order; a NULL name ends them */
} gphoto_body;

/** The first row that fits; never NULL. */
const gphoto_body *gphoto_body_find(const char *vendor, const char *model);

/** Seconds of a shutter speed as libgphoto2 writes it: "1/30", "10/25", "0.0333s", "1.3", "2", "0\"8".
 *  @return false for "Bulb", "Time", "Auto" and all else */
bool gphoto_parse_shutter(const char *text, double *seconds);

/** The text among `n` that comes nearest to `seconds` (by ratio), or -1 when none is a time. */
int gphoto_nearest_shutter(const char *const *texts, int n, double seconds, double *achieved_s);

/** The text among `n` whose number comes nearest to `iso`, or -1. */
int gphoto_nearest_iso(const char *const *texts, int n, double iso, double *achieved);

/** The index among `n` texts of the first of "a|b|c" that is there, or -1. */
int gphoto_find_value(const char *const *texts, int n, const char *values);

/** Copies the k-th of "a|b|c"; false when there are not so many. */
bool gphoto_split(const char *values, int k, char *one, size_t size);

#endif
