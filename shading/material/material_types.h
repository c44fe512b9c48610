/**
 * The built-in types of materials and their properties: one table that gives names, kinds, ranges, units,
 * defaults and the help text; docs/materials.md prints it.
 *
 * Numbers are in the units of docs/conventions.md.  specular_roughness is alpha, as in the source
 * (S-CNV-04): the width of the distribution, not its square root.
 */
#ifndef WEFT_SHADING_MATERIAL_MATERIAL_TYPES_H
#define WEFT_SHADING_MATERIAL_MATERIAL_TYPES_H

/** The reflectance models that materials have; a property may belong to several. */
enum {
    WEFT_MATERIAL_OPAQUE = 1,      /* isotropic GGX over Lambert */
    WEFT_MATERIAL_ANISOTROPIC = 2, /* anisotropic GGX over Lambert */
    WEFT_MATERIAL_CLOTH = 4,       /* two-tone cloth */
    WEFT_MATERIAL_ANY = 7,
};

typedef struct weft_material_type {
    const char *name; /* "opaquematerial" */
    unsigned model;   /* one of the bits above */
    const char *brdf; /* the model of shading/brdf that previews it */
    const char *summary;
} weft_material_type;

/** Ends with {0}. */
extern const weft_material_type weft_material_types[];

typedef enum weft_property_type {
    WEFT_PROPERTY_FLAG,    /* true or false */
    WEFT_PROPERTY_NUMBER,  /* min..max */
    WEFT_PROPERTY_COLOUR,  /* a record (:r :g :b) in linear BT.709, [r, g, b], one number for grey, or #rrggbb
                            */
    WEFT_PROPERTY_TEXT,    /* a text */
    WEFT_PROPERTY_CHOICE,  /* one of "a|b|c", as a name or a text */
    WEFT_PROPERTY_NUMBERS, /* a list of numbers, each min..max */
    WEFT_PROPERTY_RECORD,  /* a record of `members` */
    WEFT_PROPERTY_LAYERS,  /* a list of records based on materials: `members` beside overrides of the material
                            */
} weft_property_type;

/** A row; tables end with {0}. */
typedef struct weft_property {
    const char *name;
    weft_property_type type;
    double min, max; /* of numbers and colours */
    const char *choices;
    const char *unit; /* "" or NULL: none */
    const char *def;  /* as it would be written in a file; NULL: absent */
    const char *help; /* one line, lower case, no full stop */
    const struct weft_property *members;
    unsigned models;   /* WEFT_MATERIAL_...; 0: any */
    const char *alias; /* another spelling, of the source; NULL: none */
} weft_property;

extern const weft_property weft_material_properties[];

/** The type of a name, or NULL. */
const weft_material_type *weft_material_type_find(const char *name);

/** The row of a name or alias in a table, or NULL. */
const weft_property *weft_property_find(const weft_property *table, const char *name);

/** The row whose name is nearest to a misspelt one, or NULL when none is near.
 *  @param model  only rows of these models */
const weft_property *weft_property_nearest(const weft_property *table, unsigned model, const char *name);

/** "true or false", "a number", ...: for messages. */
const char *weft_property_type_name(weft_property_type type);

#endif
