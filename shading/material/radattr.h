/**
 * The text form of materials: definitions that inherit (S-ORD-25).
 *
 *     include "cotton.radattr"
 *
 *     // the red child keeps all that it does not set
 *     :bumpy_material_red := ( bumpy_material
 *         :albedo_tint_color = ( :r = 1.0 :g = 0.0 :b = 0.0 )
 *     )
 *
 *     file    = { include | def }            include = "include" ( string | "<" name ">" )
 *     def     = ":" ident ":=" "(" basename { member } ")"
 *     member  = ":" ident "=" value
 *     value   = "true" | "false" | number | string | colour | list | record | reference
 *     record  = "(" [ basename ] { member } ")"
 *     list    = "[" { value [ "," ] } "]"
 *     colour  = "#" six hex digits, sRGB
 *     comment = "//" to the end of the line, or between slash-star and star-slash
 *
 * Beyond the seed's example: comments, includes, lists and colours in hex.  This is the syntax alone: what
 * names mean is in asset.h.  The tree points into the source text and an arena and lives as long as both.
 */
#ifndef WEFT_SHADING_MATERIAL_RADATTR_H
#define WEFT_SHADING_MATERIAL_RADATTR_H

#include "shading/material/diagnostic.h"

#include <stdbool.h>

/** Records and lists nest at most this deep. */
#define WEFT_RAD_MAX_DEPTH 64

typedef enum weft_rad_kind {
    WEFT_RAD_FLAG,
    WEFT_RAD_NUMBER,
    WEFT_RAD_TEXT,
    WEFT_RAD_COLOUR,
    WEFT_RAD_NAME, /* a reference or a choice */
    WEFT_RAD_LIST,
    WEFT_RAD_RECORD,
} weft_rad_kind;

/** Comments around an item, as written; the formatter puts them back. */
typedef struct weft_rad_comments {
    const char *before; /* whole lines in front, joined by '\n', with empty lines between; NULL: none */
    const char *after;  /* behind it on the same line */
    bool blank_before;  /* an empty line stood in front */
} weft_rad_comments;

typedef struct weft_rad_value weft_rad_value;

typedef struct weft_rad_member {
    const char *name;
    weft_place place; /* of the name */
    weft_rad_value *value;
    const char *set_by; /* in a resolved asset: the asset whose text set it; else NULL */
    weft_rad_comments comments;
    struct weft_rad_member *next;
} weft_rad_member;

typedef struct weft_rad_record {
    const char *base; /* NULL: none */
    weft_place base_place;
    weft_rad_member *members;
    const char *last_comment; /* in front of the closing parenthesis */
} weft_rad_record;

struct weft_rad_value {
    weft_rad_kind kind;
    weft_place place;
    bool flag;
    double number;
    double colour[3]; /* linear BT.709 */
    const char *text; /* of TEXT and NAME; of NUMBER and COLOUR as it was spelt */
    weft_rad_record record;
    weft_rad_value *items;      /* of LIST */
    weft_rad_value *next;       /* the next item */
    weft_rad_comments comments; /* of an item */
};

/** A definition or an include, in the order of the file. */
typedef struct weft_rad_item {
    bool is_include, from_library; /* include "..." or include <...> */
    const char *name;              /* of the asset, or of the included file */
    weft_place place;              /* of the name */
    weft_rad_record record;
    weft_rad_comments comments;
    struct weft_rad_item *next;
} weft_rad_item;

typedef struct weft_rad_file {
    const weft_source *source;
    weft_rad_item *items;
    const char *last_comment;
} weft_rad_file;

/**
 * Parses a text.  At the first mistake of syntax one error is noted and the rest is not read.
 * @return NULL after an error or without memory.
 */
weft_rad_file *weft_rad_parse(const weft_source *source, weft_arena *arena, weft_diagnostics *diagnostics);

/** Writes the file in the one way it is written: four spaces a level, a record of plain values on one line
 *  where it fits in 100 columns, numbers as they were spelt, comments kept.  Formatting twice changes
 *  nothing, and the text parses to the same tree. */
void weft_rad_format(const weft_rad_file *file, FILE *out);

/** The member of a name, or NULL. */
weft_rad_member *weft_rad_find(const weft_rad_record *record, const char *name);

/** "a number", "a record", ...: for messages. */
const char *weft_rad_kind_name(weft_rad_kind kind);

#endif
