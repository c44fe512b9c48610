/**
 * Captured sets: `NAME.set/set.json` and its frames (docs/formats.md).
 */
#ifndef WEFT_HOST_SET_SET_H
#define WEFT_HOST_SET_SET_H

#include "core/error.h"
#include "core/formats/raster.h"
#include "core/formats/tiff_file.h"
#include "core/image.h"
#include "host/set/noise.h"

#include <jansson.h>
#include <stdbool.h>

#define WEFT_SET_VERSION 1

typedef enum weft_frame_role {
    WEFT_ROLE_LIGHT,
    WEFT_ROLE_AMBIENT,
    WEFT_ROLE_DARK,
    WEFT_ROLE_ALL
} weft_frame_role;

/** @return "light", "ambient", "dark", "all" */
const char *weft_frame_role_name(weft_frame_role role);

typedef struct weft_set_frame {
    char *file; /* relative to the set's folder, or absolute */
    weft_frame_role role;
    int light;         /* for WEFT_ROLE_LIGHT, else -1 */
    double exposure_s; /* > 0 */
    double gain;       /* > 0, analogue, linear */
    char sha256[65];   /* empty when not recorded */
    json_t *capture;   /* what the engine recorded (ticks, retries, statistics); NULL when nothing */
} weft_set_frame;

typedef struct weft_set {
    char *folder; /* where set.json is */
    char *name;
    char created[32];
    char camera_backend[32], camera_model[64], camera_serial[64];
    int width, height;
    weft_cfa cfa;    /* WEFT_CFA_NONE: RGB or grey pictures */
    double black[4]; /* DN per site of the 2x2 cell; used for mosaics in PNG and TIFF, checked for raws */
    double white;
    weft_noise noise;       /* of a single frame at noise_gain */
    double noise_gain;      /* 0: the noise was not measured */
    weft_transfer transfer; /* of 8-bit pictures */
    char *mask_file;        /* NULL when none */
    bool complete;          /* "state" */
    int n_frames;
    weft_set_frame *frames;
    json_t *other; /* keys this program does not know; written back; may be NULL */
} weft_set;

/** An empty set for `folder` (copied). */
weft_err weft_set_init(weft_set *set, const char *folder, weft_error *err);
void weft_set_fini(weft_set *set);

/** Reads `folder/set.json` (a path to set.json itself works too).  Files are not opened yet. */
weft_err weft_set_load(const char *folder, weft_set *set, weft_error *err);
/** Writes set.json into set->folder, whole or not at all. */
weft_err weft_set_save(const weft_set *set, weft_error *err);

/** Exposure times gain, s: what a frame's linear values were divided by. */
double weft_set_frame_time(const weft_set_frame *frame);
/** Of how many frames the file is the mean, >= 1. */
int weft_set_frame_mean_of(const weft_set_frame *frame);

/** What set.json says of a frame, and of the sensor; a new reference, NULL without memory or for a name that
 *  is not UTF-8. */
json_t *weft_set_frame_to_json(const weft_set_frame *frame);
json_t *weft_set_sensor_to_json(const weft_set *set);

/** Adds a frame (its `file` copied, its `capture` reference taken over). */
weft_err weft_set_add_frame(weft_set *set, const weft_set_frame *frame, weft_error *err);

/** Number of lights: highest light index + 1. */
int weft_set_n_lights(const weft_set *set);

/** @return WEFT_ERR_MISSING naming the light and the remedy (weft capture --resume) unless each light
 *  0..n-1 has a frame and the set is complete. */
weft_err weft_set_require_lights(const weft_set *set, weft_error *err);

/** Path of a frame's file on the heap. */
char *weft_set_frame_path(const weft_set *set, int frame, weft_error *err);

#endif
