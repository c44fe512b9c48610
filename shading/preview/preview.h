/**
 * Looks at solved maps under a movable light, in software: arrays in, a linear picture out.
 *
 * World frame as everywhere: +X right in the picture, +Y up, +Z to the viewer; map row 0 is the top row.
 * Normal maps are X right, Y up, Z out.  Light is linear BT.709.  A white Lambertian card that faces the
 * light reads 1 at exposure 0 (irradiance pi), so albedos can be read off; nothing is tone mapped.
 *
 * Maps of one size: every sample is shaded before it is averaged, for an averaged normal map would look
 * smoother than the cloth.  There is at least one sample a texel and four a pixel, weighted by a tent two
 * pixels wide, which keeps weaves near the pixel pitch from beating.
 *
 * Maps with chains of mips (shading/bake/mips.h), whose roughness answers for the normals that were averaged,
 * are looked up at the size of the sample's footprint: four samples a pixel, or one.
 */
#ifndef WEFT_SHADING_PREVIEW_PREVIEW_H
#define WEFT_SHADING_PREVIEW_PREVIEW_H

#include "core/error.h"
#include "core/image.h"
#include "shading/brdf/brdf.h"
#include "shading/lighting/environment_map.h"
#include "shading/lighting/environment_table.h"
#include "shading/preview/preview_texture.h"

#include <stdbool.h>

typedef enum weft_preview_shape {
    WEFT_PREVIEW_PLANE,    /* the map as it lies, whole, aspect kept */
    WEFT_PREVIEW_SPHERE,   /* the map wrapped on a ball from the pole that faces the viewer, equidistant along
                              meridians; repeats mirrored */
    WEFT_PREVIEW_CYLINDER, /* wrapped round an upright roll, true to length; repeats mirrored */
    WEFT_PREVIEW_DRAPE,    /* hung in folds that deepen downwards, true to length across them; each fold keeps
                              the light from the next */
} weft_preview_shape;

typedef enum weft_preview_light_kind {
    WEFT_PREVIEW_DISTANT,
    WEFT_PREVIEW_POINT,
    WEFT_PREVIEW_BALL, /* a sphere of even radiance around position_mm */
    WEFT_PREVIEW_TUBE, /* from position_mm to end_mm, as strong at every place */
} weft_preview_light_kind;

/** How balls and tubes are summed. */
typedef enum weft_preview_area {
    WEFT_PREVIEW_POINTS,         /* WEFT_PREVIEW_AREA_POINTS points of it, each shaded: any model, right */
    WEFT_PREVIEW_REPRESENTATIVE, /* one point for the highlight, its middle for the matte part (S-UE4-16,
                                    S-UE4-17): models with albedo and alpha, or alpha alone */
} weft_preview_area;

#define WEFT_PREVIEW_AREA_POINTS 24
#define WEFT_PREVIEW_MAX_LIGHTS  16

typedef struct weft_preview_light {
    weft_preview_light_kind kind;
    weft_preview_area area;
    double direction[3];   /* distant: unit, towards the light */
    double position_mm[3]; /* in the world of the plane, or from the middle of the other shapes; the light
                              gives the irradiance below at the origin and falls with the square of the
                              distance */
    double end_mm[3];      /* tube */
    double radius_mm;      /* ball; less than the distance of everything it shines on */
    double irradiance[3];  /* of a surface that faces the light, linear RGB; pi makes a white card read 1 */
} weft_preview_light;

/**
 * Light from all round.  Its zenith is +Z over the plane (the cloth lies on the ground) and +Y for the other
 * shapes, whose background is then the middle of the panorama.
 *
 * GGX models are lit by the split sum; the others by 32 directions of the cosine hemisphere with the
 * light in three bands: right for wide lobes, too soft for mirrors.
 */
typedef struct weft_preview_surroundings {
    const weft_environment_map *map; /* NULL: none */
    const weft_environment_table *table;
    double scale; /* on all of its light */
} weft_preview_surroundings;

/** Unit vector to a light at `azimuth_deg` from +X (90 is +Y) and `elevation_deg` above the plane. */
void weft_preview_direction(double azimuth_deg, double elevation_deg, double direction[3]);

/** One plane of a picture as the values of one plane of parameters. */
typedef struct weft_preview_map {
    const weft_image *image; /* NULL: the constant */
    int plane;
    int levels; /* image[0..levels-1] is its chain of mips, each half of the one before; 0 counts as 1 */
} weft_preview_map;

/** How maps with chains of mips are looked up. */
typedef enum weft_preview_filter {
    WEFT_PREVIEW_SAMPLES,     /* not at all: level 0, all of it shaded */
    WEFT_PREVIEW_TRILINEAR,   /* as wide as the longer axis of the footprint: blurs where the surface leans */
    WEFT_PREVIEW_ANISOTROPIC, /* as wide as the shorter one, up to max_taps times along the longer */
} weft_preview_filter;

/** "samples|trilinear|anisotropic", in the order of the enum. */
extern const char weft_preview_filter_names[];

#define WEFT_PREVIEW_MAX_TAPS 16

/** What is looked at.  Pictures are borrowed. */
typedef struct weft_preview_surface {
    int width, height;        /* of every map */
    double mm_per_px;         /* 0: unknown (no point lights then) */
    double origin_mm[2];      /* world x, y of the centre of pixel (0, 0); for point lights over the plane */
    const weft_image *normal; /* [3]; NULL: flat.  Need not be unit length; (0,0,0) counts as (0,0,1) */
    const weft_image *height_mm;         /* 1 plane; NULL: unknown */
    int normal_levels;                   /* of its chain of mips; 0 counts as 1 */
    const weft_preview_texture *texture; /* the maps packed, for the filters; NULL: each picture packs them */
    const weft_mask *mask;               /* 0 shows the background; NULL: all of it is the sample */
    const weft_brdf *brdf;
    double params[WEFT_BRDF_MAX_PLANES];         /* constants, see weft_brdf_defaults() */
    weft_preview_map maps[WEFT_BRDF_MAX_PLANES]; /* override the constants; clamped to their ranges */
} weft_preview_surface;

/** Uses `image` (1 plane, or as many as the parameter has) for a parameter of surface->brdf.
 *  @return WEFT_ERR_USAGE when the model has none of that name, WEFT_ERR_MISMATCH for a wrong size. */
weft_err weft_preview_set_map(weft_preview_surface *surface, const char *param, const weft_image *image,
                              weft_error *err);

/** A rectangle of map pixels. */
typedef struct weft_preview_crop {
    int x, y, width, height;
} weft_preview_crop;

/** The part of the surface that is shown by default: the box around the mask, or all of it.
 *  @return WEFT_ERR_NODATA when the mask is empty */
weft_err weft_preview_whole(const weft_preview_surface *surface, weft_preview_crop *crop, weft_error *err);

/** How the folds of the drape keep the light from each other. */
typedef enum weft_preview_folds {
    WEFT_PREVIEW_FOLDS_FORMULA, /* each sample marches over their formula: right, no voxels */
    WEFT_PREVIEW_FOLDS_MARCHED, /* a grid of voxels, looked at a few times (S-BLG-10) */
    WEFT_PREVIEW_FOLDS_WALKED,  /* the same grid, no voxel left out */
} weft_preview_folds;

/** Which looks are dithered and then blurred. */
typedef enum weft_preview_blur {
    WEFT_PREVIEW_BLUR_COARSE, /* where a look could miss something, or sees a point of a large lamp */
    WEFT_PREVIEW_BLUR_ALWAYS,
    WEFT_PREVIEW_BLUR_NEVER,
} weft_preview_blur;

struct weft_preview_history;

/** Shadows that are looked for once a place, dithered and blurred (S-BLG-06).  {0}: none of them. */
typedef struct weft_preview_shadows {
    bool relief; /* surface->height_mm shadows itself */
    weft_preview_blur blur;
    int steps; /* of a ray through the relief; at least 1 with `relief` */
    weft_preview_folds folds;
    int voxels;      /* along the drape's width, 8..512 */
    int voxel_steps; /* of a marched ray; a quarter of the voxels is about one each */
    int phase;       /* of the dither, 0..15 */
    int accumulate;  /* looks at each place, with other dithers and places on the lamps: their mean; 0 is 1 */
    double disc_rad; /* of distant lamps, when there are several looks: 0.0047 is the sun's (S-BLG-07) */
    struct weft_preview_history *history; /* of a sequence of frames; NULL: each on its own */
} weft_preview_shadows;

/** Light in the air before the sample (preview_fog.h).  {0}: none. */
typedef struct weft_preview_fog {
    double depth; /* optical depth of the whole box; 0: no fog */
    double g;     /* of Henyey and Greenstein, -1..1: above 0 it glows around the lamps */
    int steps;    /* along a ray, 1..4096 */
    bool even;    /* the blog's mean over the steps, times depth: as bright near as far, takes nothing away */
    bool plain;   /* every pixel, without dither and blur: for comparing */
} weft_preview_fog;

/** How it is looked at.  weft_preview_view_defaults() fills it. */
typedef struct weft_preview_view {
    int width, height;
    weft_preview_shape shape;
    int n_lights;
    weft_preview_light lights[WEFT_PREVIEW_MAX_LIGHTS];
    weft_preview_surroundings surroundings;
    weft_preview_shadows shadows;
    weft_preview_fog fog;
    double ambient;         /* radiance of a white sky all round, answered as by a Lambertian of the albedo */
    double exposure_ev;     /* the picture is multiplied by 2^exposure_ev */
    double background;      /* linear grey, not exposed */
    double repeat;          /* sphere: how often the shorter side of the map fits half round; > 0 */
    weft_preview_crop crop; /* the part of the map that is shown; width 0: weft_preview_whole() */
    bool draft;             /* one sample a pixel, at its middle: for maps filtered to the pixels' size */
    weft_preview_filter filter; /* where all maps have chains and nothing is masked; else samples */
    int max_taps;               /* 1..WEFT_PREVIEW_MAX_TAPS */
    double turn_rad;            /* the sample turns under lamps and camera: a plane about the viewer's axis
                                   (anticlockwise), the others about the upright one (front to the right) */
    double fov_deg;             /* 0: orthographic; else the camera's field of view over the shorter side */
} weft_preview_view;

/** 512 x 512, plane, one light from the upper left at 45 degrees, ambient 0, background 0.18, repeat 1. */
weft_preview_view weft_preview_view_defaults(void);

/** Packs the maps for pictures like the view's; surface->texture may then point to it.  Leaves it empty where
 * the view does not filter the surface.  @return as weft_preview_render() */
weft_err weft_preview_pack(const weft_preview_surface *surface, const weft_preview_view *view,
                           weft_preview_texture *texture, weft_error *err);

/**
 * Renders the surface.
 *
 * @param picture  uninitialised; gets 3 planes, linear, not clamped above 1
 * @return WEFT_ERR_RANGE, WEFT_ERR_MISMATCH for maps of different sizes, WEFT_ERR_MISSING for a point light
 *         over a map of unknown scale or shadows of a relief without a height map, WEFT_ERR_NODATA for an
 * empty mask, WEFT_ERR_NOMEM, WEFT_ERR_CANCELLED
 */
weft_err weft_preview_render(const weft_preview_surface *surface, const weft_preview_view *view,
                             weft_image *picture, weft_error *err);

/** Looks for the shadows of a frame of a sequence for its history alone: as weft_preview_render() without the
 *  picture. */
weft_err weft_preview_remember(const weft_preview_surface *surface, const weft_preview_view *view,
                               weft_error *err);

#endif
