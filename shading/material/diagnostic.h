/**
 * What is wrong in a text that a person wrote: file, line, column, the line itself and a caret under it.
 *
 *     coat.radattr:12:26: error: there is no material 'bumpymaterial'; did you mean 'bumpy_material'?
 *      12 | :bumpy_material_red := ( bumpymaterial
 *         |                          ^~~~~~~~~~~~~
 */
#ifndef WEFT_SHADING_MATERIAL_DIAGNOSTIC_H
#define WEFT_SHADING_MATERIAL_DIAGNOSTIC_H

#include "core/arena.h"

#include <stdbool.h>
#include <stdio.h>

/** A text as it was read; lives as long as what points into it. */
typedef struct weft_source {
    const char *path; /* as the user named it */
    const char *text; /* UTF-8, ends with NUL */
    size_t n;
} weft_source;

/** A stretch of a source. */
typedef struct weft_place {
    const weft_source *source; /* NULL: nowhere (a built-in default) */
    size_t begin, length;      /* bytes */
} weft_place;

typedef enum weft_severity { WEFT_SEVERITY_WARNING, WEFT_SEVERITY_ERROR } weft_severity;

typedef struct weft_diagnostic {
    weft_severity severity;
    weft_place place;
    const char *text;
    struct weft_diagnostic *next;
} weft_diagnostic;

/** All that was found, in the order it was found; the texts live in `arena`. */
typedef struct weft_diagnostics {
    weft_arena *arena;
    weft_diagnostic *first, *last;
    int n_errors, n_warnings;
} weft_diagnostics;

/** Notes one.  Without memory it is only counted. */
void weft_diagnose(weft_diagnostics *d, weft_severity severity, weft_place place, const char *format, ...)
    WEFT_PRINTF(4, 5);

/** Line and column of a place, both from 1; columns count characters, not bytes. */
void weft_place_position(weft_place place, int *line, int *column);

/** Prints one with its line and caret, or all. */
void weft_diagnostic_print(const weft_diagnostic *diagnostic, FILE *out);
void weft_diagnostics_print(const weft_diagnostics *d, FILE *out);

/** WEFT_OK without errors, else WEFT_ERR_FORMAT with the first as one line ("and 3 more"). */
weft_err weft_diagnostics_status(const weft_diagnostics *d, weft_error *err);

#endif
