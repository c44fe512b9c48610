/**
 * A U3M material (vizoogmbh/u3m, versions 1.0 and 1.1) as Weft understands it.
 *
 * Of a document the visible side (front, else back, else side) is read; all else stays in `document`, which
 * is never changed: physics, metadata and the `custom` sections of others are not ours to look into.
 *
 *     colour   = mode(linear(sRGB picture), linear(factor)), or linear(constant)
 *     scalar   = offset + factor mean(R, G, B), or constant
 *     normal   = 2 v - 1 with x and y times scale, of unit length again; +Y up
 *     albedo   = colour (1 - metalness);  F0 = 0.08 specular (1 - metalness) + colour metalness
 *     alpha_t  = r^2/sqrt(1 - 0.9 a);  alpha_b = r^2 sqrt(1 - 0.9 a)         (Disney 2012)
 *
 * Displacement has no unit in U3M and is read only where Weft wrote it (in mm); clear coat, sheen of others,
 * subsurface and transmission have no place in Weft's materials: they are kept, not shown.
 */
#ifndef WEFT_SHADING_U3M_U3M_DOCUMENT_H
#define WEFT_SHADING_U3M_U3M_DOCUMENT_H

#include "shading/bake/baked.h"
#include "shading/u3m/u3m_files.h"

typedef struct weft_u3m {
    char *path;
    weft_u3m_files *files;
    json_t *document;      /* as it was read */
    const char *name;      /* of the material */
    const char *side_name; /* "front", "back" or "side" */
    const json_t *side;
    bool is_1_0;                     /* lengths in cm, dpi one number, rotation in degrees */
    const json_t *ours;              /* custom.weft, when Weft wrote the document; else NULL */
    double size_mm[2];               /* of its first picture; 0 without any */
    double thickness_mm, weight_gsm; /* of its physics; 0: not said */
} weft_u3m;

/** Opens and checks: version, the side, every parameter that is read, each picture there (but not yet read).
 * @return as weft_u3m_files_open(); WEFT_ERR_VERSION; WEFT_ERR_FORMAT and WEFT_ERR_MISSING naming the
 * parameter; WEFT_ERR_UNSUPPORTED for a material of physics alone */
weft_err weft_u3m_open(const char *path, weft_u3m **u3m, weft_error *err);
void weft_u3m_close(weft_u3m *u3m);

/** Reads all pictures that weft_u3m_bake() will: the size of the largest, 0 x 0 without any.
 *  @return WEFT_ERR_FORMAT naming a picture that cannot be read */
weft_err weft_u3m_measure(const weft_u3m *u3m, int *width, int *height, weft_error *err);

/** The built-in type that holds the material: clothmaterial, anisotropicmaterial or opaquematerial. */
const char *weft_u3m_type(const weft_u3m *u3m);

/** Whether the document says something of a quantity. */
bool weft_u3m_has(const weft_u3m *u3m, weft_baked_kind kind);

/**
 * The material's quantities as level 0 of maps of w x h texels over size_mm, or constants.
 * @param baked  initialised here
 */
weft_err weft_u3m_bake(const weft_u3m *u3m, int w, int h, const double size_mm[2], weft_baked *baked,
                       weft_error *err);

#endif
