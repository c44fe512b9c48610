/**
 * A baked material in memory: what the baker makes, the preview lights and the exporters write.
 *
 * Every quantity is a map with its whole chain of mips, or one constant.  Values are physical and linear
 * (docs/conventions.md); codes, packing and flipped channels belong to the exporters alone.
 */
#ifndef WEFT_SHADING_BAKE_BAKED_H
#define WEFT_SHADING_BAKE_BAKED_H

#include "core/image.h"
#include "shading/material/material_types.h"

#include <jansson.h>
#include <stdbool.h>

/** Levels of a chain: 1 + floor(log2(32768)). */
#define WEFT_BAKED_MAX_MIPS 16

typedef enum weft_baked_kind {
    WEFT_BAKED_ALBEDO,        /* 3: diffuse reflectance, linear BT.709, 0..1 */
    WEFT_BAKED_SPECULAR,      /* 3: reflectance at normal incidence F0, linear BT.709, 0..1 */
    WEFT_BAKED_ROUGHNESS,     /* 1: alpha along the tangent, 0..1; filtered in the mips */
    WEFT_BAKED_ANISOTROPY,    /* 1: s in alpha_b = alpha (1 - s), 0..1 */
    WEFT_BAKED_TANGENT,       /* 2: unit vector, x right, y up: the direction of the threads */
    WEFT_BAKED_NORMAL,        /* 3: unit, x right, y up, z out */
    WEFT_BAKED_NORMAL_LENGTH, /* 1: of the mean of the level-0 normals in the footprint, 0..1 */
    WEFT_BAKED_HEIGHT,        /* 1: mm, mean 0 */
    WEFT_BAKED_OCCLUSION,     /* 1: ambient visibility, 1 open */
    WEFT_BAKED_BENT_CONE,     /* 4: unit mean unoccluded direction x y z, and cos of the cone's half angle */
    WEFT_BAKED_CAVITY,        /* 1: 0 in the deepest groove, 0.5 level, 1 on a ridge */
    WEFT_BAKED_CURVATURE,     /* 1: mean curvature in 1/mm, positive on ridges */
    WEFT_BAKED_OPACITY,       /* 1: 0..1 */
    WEFT_BAKED_CLOTH,         /* 1: weight of the cloth lobe against GGX, 0..1 */
    WEFT_BAKED_FRONT_TINT,    /* 3: of the cloth lobe */
    WEFT_BAKED_RIM_TINT,      /* 3 */
    WEFT_BAKED_RIM_AMPLITUDE, /* 1: 0..4 */
    WEFT_BAKED_DETAIL_ALBEDO, /* 3: albedo divided by its base (its low frequencies), about 1 */
    WEFT_BAKED_DETAIL_NORMAL, /* 3: unit normal with the base's slopes taken out */
    /* of the cloth part where `two_lobes`, as the rows without "cloth" are then of the GGX part */
    WEFT_BAKED_CLOTH_ALBEDO,    /* 3 */
    WEFT_BAKED_CLOTH_SPECULAR,  /* 3 */
    WEFT_BAKED_CLOTH_ROUGHNESS, /* 1 */
    WEFT_BAKED_COUNT
} weft_baked_kind;

typedef struct weft_baked_row {
    const char *name; /* "albedo": file stem and key */
    int planes;
    float def[4]; /* the constant when nothing sets it */
    const char *unit;
    const char *channels[4]; /* names of the EXR channels */
    const char *help;
} weft_baked_row;

/** [WEFT_BAKED_COUNT] */
extern const weft_baked_row weft_baked_rows[];

typedef struct weft_baked_map {
    int n_mips;                           /* 0: the constant holds everywhere */
    float constant[4];                    /* always set: of a map, its mean */
    weft_image mips[WEFT_BAKED_MAX_MIPS]; /* level l is max(1, w >> l) x max(1, h >> l) */
} weft_baked_map;

typedef struct weft_baked {
    char *name;                      /* of the material */
    const weft_material_type *type;  /* decides the reflectance model */
    int width, height;               /* of level 0 of all maps, pixels */
    double size_mm[2];               /* across and up; 0: unknown */
    double thickness_mm, weight_gsm; /* of the cloth; 0: unknown */
    bool periodic;                   /* the right edge continues at the left, the top at the bottom */
    bool enable_diffuse, enable_specular;
    bool two_lobes; /* GGX and cloth side by side, each with parameters of its own (S-ORD-26); else those of
                       the one lobe are in the rows without "cloth" */
    weft_baked_map maps[WEFT_BAKED_COUNT];
    char *u3m;          /* path of the U3M that it is made from; NULL: from none */
    json_t *provenance; /* inputs with hashes, options, version: goes into reports; may be NULL */
} weft_baked;

/** An empty material of constants.  @return WEFT_ERR_NOMEM */
weft_err weft_baked_init(weft_baked *baked, const char *name, const weft_material_type *type,
                         weft_error *err);
/** Frees everything; `{0}` is fine. */
void weft_baked_fini(weft_baked *baked);

/** A copy of the constants and of level 0 of the maps.  @param to  initialised here */
weft_err weft_baked_copy(const weft_baked *from, weft_baked *to, weft_error *err);

/** Number of levels of a w x h map, down to 1 x 1. */
int weft_baked_levels(int width, int height);

/** Gives a map its level 0, zeroed (the other levels are the baker's); the first sets width and height.
 *  @return WEFT_ERR_MISMATCH when the size is another than that of the maps there are; WEFT_ERR_NOMEM */
weft_err weft_baked_add(weft_baked *baked, weft_baked_kind kind, int width, int height, weft_error *err);

/** The row of the cloth lobe that answers to one of albedo, specular, roughness; the kind itself for others
 * and where there is one lobe. */
weft_baked_kind weft_baked_of_cloth(const weft_baked *baked, weft_baked_kind kind);

/** The reflectance model that shows the material. */
const char *weft_baked_brdf(const weft_baked *baked);

/** The kind of a name ("albedo"), or WEFT_BAKED_COUNT. */
weft_baked_kind weft_baked_find(const char *name);

#endif
