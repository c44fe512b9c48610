/** The list of pictures and light directions that a foreign set comes down to; between the files of import.
 */
#ifndef WEFT_HOST_SET_IMPORT_LIST_H
#define WEFT_HOST_SET_IMPORT_LIST_H

#include "calibration/calibration.h"

typedef struct weft_import_item {
    char *path; /* of the picture, as it can be opened */
    weft_vec3 direction;
    double intensity[3];
} weft_import_item;

typedef struct weft_import_list {
    const char *kind;
    bool has_directions;
    int n;
    weft_import_item *items; /* room for WEFT_LIGHTS_MAX */
    char *mask;              /* path, or NULL */
} weft_import_list;

weft_err weft_import_list_init(weft_import_list *list, const char *kind, weft_error *err);
void weft_import_list_fini(weft_import_list *list);

/** Adds a picture (copied).  @return WEFT_ERR_RANGE past WEFT_LIGHTS_MAX lights, WEFT_ERR_FORMAT for a path
 *  that is no UTF-8 (set.json could not hold it). */
weft_err weft_import_list_add(weft_import_list *list, const char *path, weft_vec3 direction,
                              const double intensity[3], weft_error *err);

/** Takes mask.png of `folder` when it is there. */
weft_err weft_import_find_mask(weft_import_list *list, const char *folder, weft_error *err);

/** Reads an RTI light-position file into an uninitialised list, as the two below do. */
weft_err weft_import_read_lp(const char *path, weft_import_list *list, weft_error *err);
/** Reads a folder with light_directions.txt. */
weft_err weft_import_read_directions(const char *folder, weft_import_list *list, weft_error *err);
/** Reads a folder of raws, in the order of their names. */
weft_err weft_import_read_raws(const char *folder, weft_import_list *list, weft_error *err);

/** Names in `folder` for which `wanted` holds, in natural order (img9 before img10); free each and the
 *  array with weft_free(). */
weft_err weft_import_list_names(const char *folder, bool (*wanted)(const char *name), char ***names, int *n,
                                weft_error *err);

/**
 * Rms misfit of a Lambertian surface under the list's lights, relative to the rms of the light, over a
 * sample of the pixels: as linear, and as sRGB codes.  It falls when the pictures are read as what they are.
 */
weft_err weft_import_measure_misfit(const weft_import_list *list, double *linear, double *srgb,
                                    weft_error *err);

#endif
