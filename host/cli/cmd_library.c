/* weft library list, show, find, reindex: what lies in a library. */
#include "host/cli/command.h"
#include "host/library/catalogue.h"

#include "core/mem.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct library_args {
    const char *library;
    int kind, limit;
    bool all;
} library_args;

enum { KIND_ANY };

#define LIBRARY_FIELD                                                                                        \
    {                                                                                                        \
        .key = "library", .short_opt = 'l', .type = WEFT_FIELD_TEXT,                                         \
        .offset = offsetof(library_args, library), .unit = "DIR",                                            \
        .help = "the library (else $WEFT_LIBRARY, else the current folder)"                                  \
    }
#define LIST_FIELDS                                                                                          \
    LIBRARY_FIELD,                                                                                           \
        {                                                                                                    \
            .key = "kind",                                                                                   \
            .short_opt = 'k',                                                                                \
            .type = WEFT_FIELD_CHOICE,                                                                       \
            .offset = offsetof(library_args, kind),                                                          \
            .choices = "any|set|calibration|maps|material|picture",                                          \
            .def = "any",                                                                                    \
            .help = "only these",                                                                            \
        },                                                                                                   \
    {                                                                                                        \
        .key = "limit", .short_opt = 'n', .type = WEFT_FIELD_INT, .offset = offsetof(library_args, limit),   \
        .min = 0, .max = 1000000, .def = "0", .help = "at most so many, the newest first; 0: all"            \
    }

static const weft_field list_fields[] = {LIST_FIELDS, {0}};
static const weft_field show_fields[] = {LIBRARY_FIELD, {0}};
static const weft_field reindex_fields[] = {
    LIBRARY_FIELD,
    {.key = "all",
     .short_opt = 'a',
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(library_args, all),
     .help = "read again also what has not changed"},
    {0},
};

static weft_err open_library(const library_args *args, weft_library_db **db, weft_error *err)
{
    const char *const named = args->library ? args->library : getenv("WEFT_LIBRARY");
    weft_progress progress = {0};
    weft_catalogue_report report;
    WEFT_TRY(weft_library_db_open(named && named[0] ? named : ".", db, err));
    if (!(*db)->renewed)
        return WEFT_OK;
    const weft_err status = weft_catalogue_reindex(*db, true, &progress, &report, err);
    if (status != WEFT_OK)
        weft_library_db_close(*db);
    return status;
}

static void print_items(const json_t *items, FILE *out)
{
    size_t i;
    const json_t *item;
    json_array_foreach(items, i, item)
    {
        const char *const problem = json_string_value(json_object_get(item, "problem"));
        fprintf(out, "%-12s %s %9.1f MB  %s%s%s\n", json_string_value(json_object_get(item, "kind")),
                json_string_value(json_object_get(item, "created")),
                1e-6 * json_number_value(json_object_get(item, "bytes")),
                json_string_value(json_object_get(item, "path")), problem ? ": " : "",
                problem ? problem : "");
    }
}

static weft_err list(const weft_invocation *inv, const library_args *a, const char *const *words, int n_words,
                     weft_error *err)
{
    weft_library_db *db = NULL;
    json_t *items = NULL;
    const weft_catalogue_query query = {.kind = a->kind == KIND_ANY ? NULL : weft_catalogue_kind(a->kind - 1),
                                        .words = words,
                                        .n_words = n_words,
                                        .limit = a->limit};
    WEFT_TRY(open_library(a, &db, err));
    const weft_err status = weft_catalogue_find(db, &query, &items, err);
    weft_library_db_close(db);
    WEFT_TRY(status);
    if (inv->json)
        return weft_print_json(inv, json_pack("{s:o}", "items", items), err);
    print_items(items, inv->out);
    json_decref(items);
    return WEFT_OK;
}

static weft_err run_list(const weft_invocation *inv, const void *args, weft_error *err)
{
    return list(inv, args, NULL, 0, err);
}

static weft_err run_find(const weft_invocation *inv, const void *args, weft_error *err)
{
    return list(inv, args, inv->operands, inv->n_operands, err);
}

static weft_err run_show(const weft_invocation *inv, const void *args, weft_error *err)
{
    weft_library_db *db = NULL;
    json_t *item = NULL;
    WEFT_TRY(open_library(args, &db, err));
    const weft_err status = weft_catalogue_get(db, inv->operands[0], &item, err);
    weft_library_db_close(db);
    WEFT_TRY(status);
    if (inv->json)
        return weft_print_json(inv, item, err);
    const int failed =
        json_dumpf(item, inv->out, JSON_INDENT(2) | JSON_REAL_PRECISION(9)) || fputc('\n', inv->out) == EOF;
    json_decref(item);
    return failed ? weft_fail_errno(err, WEFT_ERR_IO, "the result cannot be written") : WEFT_OK;
}

static weft_err run_reindex(const weft_invocation *inv, const void *args, weft_error *err)
{
    const library_args *const a = args;
    weft_library_db *db = NULL;
    weft_progress progress = {0};
    weft_catalogue_report report;
    WEFT_TRY(open_library(a, &db, err));
    const weft_err status = weft_catalogue_reindex(db, a->all, &progress, &report, err);
    weft_library_db_close(db);
    WEFT_TRY(status);
    if (inv->json)
        return weft_print_json(inv,
                               json_pack("{s:i, s:i, s:i, s:i}", "items", report.n_items, "read",
                                         report.n_read, "removed", report.n_removed, "problems",
                                         report.n_problems),
                               err);
    fprintf(inv->out, "%d items, %d read, %d removed, %d with a problem\n", report.n_items, report.n_read,
            report.n_removed, report.n_problems);
    return WEFT_OK;
}

#define WHAT_IT_IS                                                                                           \
    "The catalogue is kept in DIR/.weft/library.db, beside the queue of weftd, and can be made again from "  \
    "the\n"                                                                                                  \
    "files at any time: weft library reindex.  weftd enters what its jobs make."

const weft_command weft_cmd_library_list = {
    .name = "library list",
    .summary = "sets, calibrations, maps and pictures of a library",
    .operands = "",
    .args_size = sizeof(library_args),
    .fields = list_fields,
    .details = WHAT_IT_IS,
    .example = "weft library list --kind set --library ~/scans",
    .run = run_list,
};

const weft_command weft_cmd_library_show = {
    .name = "library show",
    .summary = "all that is known of one thing in a library",
    .operands = "PATH",
    .min_operands = 1,
    .max_operands = 1,
    .args_size = sizeof(library_args),
    .fields = show_fields,
    .details = "PATH is relative to the library, as weft library list prints it.",
    .example = "weft library show tweed/07.set --library ~/scans",
    .run = run_show,
};

const weft_command weft_cmd_library_find = {
    .name = "library find",
    .summary = "what has all these words in its path, name or data",
    .operands = "WORD...",
    .min_operands = 1,
    .max_operands = 16,
    .args_size = sizeof(library_args),
    .fields = list_fields,
    .details = "Whatever their case.  " WHAT_IT_IS,
    .example = "weft library find tweed complete --library ~/scans",
    .run = run_find,
};

const weft_command weft_cmd_library_reindex = {
    .name = "library reindex",
    .summary = "look through a library again",
    .operands = "",
    .args_size = sizeof(library_args),
    .fields = reindex_fields,
    .details = "Hidden folders and symbolic links are not followed.  " WHAT_IT_IS,
    .example = "weft library reindex --library ~/scans",
    .run = run_reindex,
};
