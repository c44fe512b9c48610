/** How two map folders, pictures or calibrations differ. */
#ifndef WEFT_HOST_SET_COMPARE_H
#define WEFT_HOST_SET_COMPARE_H

#include "calibration/calibration.h"
#include "host/set/maps.h"

/** Figures of a distribution of errors; all 0 when `n` is 0. */
typedef struct weft_spread {
    size_t n;
    double mean, median, p95, p99, max, rms;
} weft_spread;

/** Sorts `values` (no NaN) and takes its figures; percentiles are the nearest rank. */
weft_spread weft_spread_of(float *values, size_t n);

/** Flags of A against those of B, which are taken for the truth. */
typedef struct weft_flaw_match {
    size_t a, b;  /* pixels flagged */
    size_t hits;  /* of A's those that have one of B's within reach */
    size_t found; /* of B's those that have one of A's */
} weft_flaw_match;

/** Flags of tears and lint may be half a millimetre off, those of creases two: a line has no width to agree
 * on. */
extern const double weft_flaw_reach_mm[WEFT_N_FLAWS];

typedef struct weft_maps_difference {
    bool has_normal, has_albedo, has_alpha, has_flaws;
    weft_spread normal_deg;              /* angle between the normals */
    weft_spread delta_e;                 /* CIEDE2000 between the albedos as linear sRGB under D65 */
    weft_spread luminance;               /* relative difference of the albedo's luminance, |a / b - 1| */
    weft_spread alpha;                   /* |a - b| where either is below 1 */
    double cover[2];                     /* mean alpha of A and of B */
    weft_flaw_match flaws[WEFT_N_FLAWS]; /* in the order of the bits; plane maps only */
    size_t only_a, only_b;     /* pixels with an answer in one alone (where both cover the sample) */
    int offset_px[2];          /* of A's pixel (0, 0) in B */
    double mean_normal_deg[2]; /* mean of A's normals against B's: turn about y and about x, degrees */
    bool albedo_is_camera_rgb; /* at least one albedo has no colour calibration: delta E means little */
} weft_maps_difference;

/**
 * Compares where both have an answer (and `mask`, which has A's size, is not 0; NULL: everywhere).
 *
 * Two plane maps of one scale are laid over each other by their origins, whatever their sizes.
 * @return WEFT_ERR_MISMATCH when the sizes differ (sensor maps), the scales differ, or the grids are off by
 *         a fraction of a pixel (nothing is resampled: that would blur what is to be measured);
 *         WEFT_ERR_NODATA when they have no pixel in common
 */
weft_err weft_compare_maps(const weft_maps *a, const weft_maps *b, const weft_mask *mask,
                           weft_maps_difference *difference, weft_error *err);

typedef struct weft_picture_difference {
    weft_spread delta_e; /* CIEDE2000 */
    double psnr_db;      /* of the sRGB codes 0..1, all channels; INFINITY when they are the same */
    double rms, max;     /* of the linear values */
} weft_picture_difference;

/** Compares two pictures of linear sRGB light (grey is R = G = B) of one size; NaN counts as 0. */
weft_err weft_compare_pictures(const weft_image *a, const weft_image *b, const weft_mask *mask,
                               weft_picture_difference *difference, weft_error *err);

typedef struct weft_calibration_difference {
    bool has_lights, has_distant, has_camera, has_pose, has_colour;
    int n_lights;
    double position_mm[3];         /* mean, max, and its light; near lights */
    double direction_deg[2];       /* mean, max; of distant lights, or of the near ones from the origin */
    double intensity_ratio_mean;   /* A / B over lights and channels */
    double intensity_ratio_spread; /* standard deviation of the ratio over its mean */
    double irradiance_ratio_mean, irradiance_ratio_spread; /* the same of what a patch at the origin gets */
    double exponent_max;
    double focal_ratio, principal_px, centre_mm, view_deg; /* fx A / fx B; distances */
    double projection_px[2]; /* mean, max distance of the pixels of a 9 x 9 grid of the plane z = 0 in view */
    double matrix_max;       /* largest difference of the colour matrices' elements */
} weft_calibration_difference;

/** Compares what both have.  @return WEFT_ERR_MISMATCH for different numbers of lights or frame sizes. */
weft_err weft_compare_calibrations(const weft_calibration *a, const weft_calibration *b,
                                   weft_calibration_difference *difference, weft_error *err);

#endif
