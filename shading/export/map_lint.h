/** What is wrong with anybody's maps: checks of single pictures, each with a figure and a remedy. */
#ifndef WEFT_SHADING_EXPORT_MAP_LINT_H
#define WEFT_SHADING_EXPORT_MAP_LINT_H

#include "shading/export/map_read.h"

typedef enum weft_lint_level { WEFT_LINT_GOOD, WEFT_LINT_NOTE, WEFT_LINT_WRONG } weft_lint_level;

/** One finding; called once for each check, good ones too. */
typedef void weft_lint_fn(void *context, weft_lint_level level, const char *check, const char *text);

typedef struct weft_lint {
    weft_lint_fn *fn;
    void *context;
} weft_lint;

/**
 * Normals (3 planes, decoded to -1..1): unit length within the step of 8 bits (zero is a hole), none behind
 * the surface, and whether green grows upwards: slopes of a surface have no curl, so the sign with the
 * smaller curl is the right one; a map that tells nothing (ratio under 1.2) is said so.
 */
void weft_lint_normal(const weft_lint *lint, const weft_image *normal);

/**
 * Albedo (1 or 3 planes, linear): measured charts lie between 3 % (black patch) and 90 % (white patch); what
 * is outside is light or shadow left in the picture, or a wrong transfer curve; 0 is a hole.
 */
void weft_lint_albedo(const weft_lint *lint, const weft_image *albedo);

/**
 * F0 (1 or 3 planes, linear): dielectrics are grey and between 0.017 and 0.067; above 0.2 is a metal, and
 * nothing lies between (brdf/specular_doubt.h).
 */
void weft_lint_specular(const weft_lint *lint, const weft_image *f0);

/** Albedo beside F0 of the same size: where F0 is a metal's there is no diffuse light above 0.2. */
void weft_lint_specular_pair(const weft_lint *lint, const weft_image *albedo, const weft_image *f0);

/** The size of a set: sides that are powers of two. */
void weft_lint_size(const weft_lint *lint, int width, int height);

/** Any picture: finite; whether it repeats (the step over its edges against 1.1 times the largest inside). */
void weft_lint_picture(const weft_lint *lint, const weft_image *image);

/**
 * A chain of mips: down to 1 x 1, and the mean colour of every level that of the picture (2 %): light is
 * averaged, not its codes.  Roughness grows towards the small levels; one that falls by more than 2 % has
 * forgotten the normals.
 */
void weft_lint_mips(const weft_lint *lint, const weft_map *map);

/** Roughness, occlusion, height: not the same number in all levels; channels alike where there are three. */
void weft_lint_scalar(const weft_lint *lint, const weft_map *map);

#endif
