/**
 * Options declared once: one row serves the command line, --help, the documents and completion.
 *
 * A table of rows describes a struct; defaults are text and go through the same parser as user input.
 */
#ifndef WEFT_CORE_FIELDS_H
#define WEFT_CORE_FIELDS_H

#include "core/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

typedef enum weft_field_type {
    WEFT_FIELD_FLAG,   /* bool: --force */
    WEFT_FIELD_INT,    /* int */
    WEFT_FIELD_F64,    /* double */
    WEFT_FIELD_TEXT,   /* const char *, NULL when not given and without default */
    WEFT_FIELD_CHOICE, /* int, index into `choices` ("lsq|robust") */
    WEFT_FIELD_SIZE,   /* weft_size, "1232x816"; {0,0} when not given */
    WEFT_FIELD_F64S,   /* weft_numbers, "1,2.5,-3" */
    WEFT_FIELD_TEXTS,  /* weft_texts, may be given several times: --param a=1 --param b=2 */
} weft_field_type;

typedef struct weft_size {
    int width, height;
} weft_size;

#define WEFT_NUMBERS_MAX 32

typedef struct weft_numbers {
    int n; /* 0 when not given */
    double values[WEFT_NUMBERS_MAX];
} weft_numbers;

#define WEFT_TEXTS_MAX 32

typedef struct weft_texts {
    int n; /* 0 when not given */
    const char *values[WEFT_TEXTS_MAX];
} weft_texts;

/** A row; the table ends with {0}. */
typedef struct weft_field {
    const char *key; /* "exposure" is --exposure */
    char short_opt;  /* 'e' is -e, 0 for none */
    weft_field_type type;
    size_t offset;       /* offsetof(struct, member) */
    const char *unit;    /* "s", "mm", or the word for the value ("FILE", "NAME"); shown in help */
    double min, max;     /* of numbers; both 0: any */
    const char *choices; /* "a|b|c" */
    const char *def;     /* default as text; NULL: zero, absent */
    bool required;       /* must be given */
    const char *help;    /* one line, lower case, no full stop */
} weft_field;

/** Fills the struct with the defaults. */
void weft_fields_set_defaults(const weft_field *fields, void *args);

/** Parses one value as the row says.  @return WEFT_ERR_USAGE saying what was wanted. */
weft_err weft_field_parse(const weft_field *field, const char *text, void *args, weft_error *err);

/**
 * Parses a command line: options of several tables (each with its struct) and operands, in any order;
 * "--" ends the options; "--key=value" and "--key value", "-kvalue" and "-k value".
 *
 * @param tables, args  `n_tables` tables and the structs they fill (defaults already set)
 * @param argv          `argc` words without program and command name
 * @param operands      gets the words that are no options; room for `argc`
 * @return WEFT_ERR_USAGE naming the word that is wrong, with the nearest option when one is close
 */
weft_err weft_fields_parse_argv(const weft_field *const *tables, void *const *args, int n_tables, int argc,
                                char *const *argv, const char **operands, int *n_operands, weft_error *err);

/** One option of a command line, or an operand (`field` is NULL).  `text` is "" for a flag. */
typedef weft_err weft_fields_visit_fn(void *context, const weft_field *field, const char *text,
                                      weft_error *err);

/** Goes over a command line as weft_fields_parse_argv() does, in its order, without taking anything in. */
weft_err weft_fields_visit_argv(const weft_field *const *tables, int n_tables, int argc, char *const *argv,
                                weft_fields_visit_fn *visit, void *context, weft_error *err);

/** Prints the rows as the option part of a help text. */
void weft_fields_print_help(const weft_field *fields, FILE *out);

/** Edit distance of two words (insert, delete, change, swap), for "did you mean". */
int weft_text_distance(const char *a, const char *b);

#endif
