/**
 * Woven and ribbed fabric: a periodic tile of height, colour and fibre direction, laid on the table with a
 * gentle distortion so that no two repeats are alike.
 *
 * Tile coordinates are millimetres along the yarns: x across the warp (warp yarns run along y), y across
 * the weft.  The mean height of a tile is 0.
 */
#ifndef WEFT_HOST_RIG_FABRIC_H
#define WEFT_HOST_RIG_FABRIC_H

#include "core/error.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

/** Texels a side, a power of two. */
#define WEFT_CLOTH_TEXELS 2048
/** Side of a tile: whole numbers of all yarn pitches used. */
#define WEFT_CLOTH_PERIOD_MM 38.4
#define WEFT_CLOTH_MAX_DYES  8
/** How deep the ground lies under the yarns' middle where one sees through the holes, mm. */
#define WEFT_CLOTH_GROUND_MM 0.45
#define WEFT_CLOTH_MAX_SETT  48

/** One texel: 16 bytes, so that a sample loads four of them and no more. */
typedef struct weft_fabric_texel {
    float height;           /* mm */
    float slope_x, slope_y; /* dh/dx, dh/dy */
    uint8_t dye;            /* index into weft_weave.dyes */
    uint8_t strength;       /* reflectance factor 0.75 + strength / 510 */
    uint8_t openness;       /* share of the sky seen, 0..255 */
    uint8_t fibre;          /* direction of the fibres on the surface, tile frame: angle from +x, pi / 256 */
} weft_fabric_texel;

/** How the surface of the fibres mirrors: GGX, narrow along the fibre, wide across. */
typedef struct weft_fabric_gloss {
    float f0;       /* Fresnel reflectance at normal incidence; 0: none */
    float coverage; /* share of the surface that mirrors (the rest is fuzz) */
    float alpha_along, alpha_across;
} weft_fabric_gloss;

/** What makes a fabric. */
typedef struct weft_weave {
    const char *name, *summary;
    bool wales;           /* corduroy: a cut pile in ribs along the warp; the draft is not used */
    int n_draft;          /* the draft repeats after n x n crossings */
    const char *draft[8]; /* row by row along the warp: 'X' warp over weft */
    double warp_pitch_mm, weft_pitch_mm;
    double cover; /* width of the yarns over their pitch; 0: they touch; else there are holes between them */
    double warp_bulge_mm, weft_bulge_mm;   /* sagitta of the yarn's lenticular section */
    double warp_crimp_mm, weft_crimp_mm;   /* how far the yarn's axis swings from the middle */
    double ply_mm, ply_relief_mm;          /* spacing and amplitude of the ribs of a twisted yarn */
    double ply_angle_deg;                  /* of the ribs against the yarn's axis */
    const char *dyes[WEFT_CLOTH_MAX_DYES]; /* names of spectra, ends with NULL */
    const char *warp_sett, *weft_sett;     /* colours of successive yarns as digits, repeated */
    weft_fabric_gloss gloss;
} weft_weave;

/** All fabrics; ends with a row whose name is NULL. */
extern const weft_weave weft_weaves[];

typedef struct weft_fabric {
    const weft_weave *weave;
    weft_fabric_texel *texels; /* [WEFT_CLOTH_TEXELS][WEFT_CLOTH_TEXELS], row = y */
    float *height;             /* the same heights alone: what a shadow ray walks over */
    float lowest_mm, highest_mm;
    float steepest;                        /* largest |slope| */
    double dye_share[WEFT_CLOTH_MAX_DYES]; /* of the surface, times mean strength */
    float fibre[256][2];                   /* unit vector of each fibre direction, tile frame */
    float turn_cos, turn_sin;              /* the fabric lies on the table turned by this */
    float wave[3][2][2];                   /* distortion: [term][component][0 amplitude mm, 1 phase] */
    float wave_k[3][2];                    /* wave vectors, rad/mm */
} weft_fabric;

/** Number of dyes; the "dye" of that number is the ground seen through the holes. */
int weft_weave_n_dyes(const weft_weave *weave);

/** Weaves the tile.  Takes about half a second on two cores. */
weft_err weft_fabric_init(weft_fabric *cloth, const weft_weave *weave, uint64_t seed, weft_error *err);
void weft_fabric_fini(weft_fabric *cloth);

/** How the fabric lies around a point of the table: tile = at + jacobian (p - p0), relief times gain. */
typedef struct weft_fabric_patch {
    float x0, y0;
    float at[2];
    float jacobian[4]; /* d(tile x, tile y) / d(x, y), row by row */
    float gain, gain_dx, gain_dy;
    float strength;
} weft_fabric_patch;

/** Holds within about a millimetre of (x, y): the distortion is linearised there. */
weft_fabric_patch weft_fabric_patch_at(const weft_fabric *cloth, float x, float y);

/** A point of the surface. */
typedef struct weft_fabric_point {
    float tile_x, tile_y;   /* mm */
    float height;           /* mm over the table, gain included */
    float slope_x, slope_y; /* in the world's x, y */
    float strength, openness;
    float fibre_x, fibre_y; /* unit, in the world's x, y */
    int dye;
} weft_fabric_point;

/** The surface where a ray meets it that crosses z = 0 at (x, y) and moves (dx, dy) per millimetre upwards.
 *  |d| times the steepest slope must be below 1 (the camera looks from above), so there is one meeting. */
void weft_fabric_meet(const weft_fabric *cloth, const weft_fabric_patch *patch, float x, float y, float dx,
                      float dy, weft_fabric_point *point);

/** Lamps are worked on side by side, as many as a wide vector holds. */
#define WEFT_CLOTH_LANES 16

/**
 * Which lamps a point of the surface sees: marches a ray to each over the tile, all side by side, by steps
 * that the steepest slope allows.
 *
 * @param lx, ly, lz  unit vectors to the lamps, lz > 0
 * @param visible     in: 0 where it need not be known, else 1; out: 0 where the fabric is between
 */
void weft_fabric_see(const weft_fabric *cloth, const weft_fabric_patch *patch, const weft_fabric_point *point,
                     const float lx[WEFT_CLOTH_LANES], const float ly[WEFT_CLOTH_LANES],
                     const float lz[WEFT_CLOTH_LANES], float visible[WEFT_CLOTH_LANES]);

#endif
