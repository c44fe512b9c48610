/**
 * A subcommand of `weft`: one file each (cmd_NAME.c), listed in commands.c.
 *
 * The frame parses, prints --help, sets the log level, runs and turns a failure into one line and the
 * exit status; `run` gets a filled struct and parses nothing.
 */
#ifndef WEFT_HOST_CLI_COMMAND_H
#define WEFT_HOST_CLI_COMMAND_H

#include "core/error.h"
#include "core/fields.h"

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

/** What every command gets besides its own options. */
typedef struct weft_invocation {
    const char *const *operands;
    int n_operands;
    bool json;  /* --json: results as one JSON object by weft_print_json() */
    bool force; /* --force: existing outputs may be replaced */
    FILE *out;  /* results */
} weft_invocation;

typedef struct weft_command {
    const char *name;               /* "capture", "calibrate lens" */
    const char *summary;            /* one line, lower case, no full stop */
    const char *operands;           /* "SET...", "INPUT", "" */
    int min_operands, max_operands; /* max -1: any number */
    size_t args_size;
    const weft_field *fields; /* ends with {0}; NULL: none */
    const char *details;      /* more for --help: units, files, what it needs first; NULL */
    const char *example;      /* "weft capture twill.set --exposure 0.04" */
    weft_err (*run)(const weft_invocation *inv, const void *args, weft_error *err);
    bool (*stays_here)(const void *args); /* true: not for a daemon, although the command is; NULL: never */
} weft_command;

/** The options that every command has; ends with {0}. */
extern const weft_field weft_common_fields[];

/** All commands, in the order of the help; ends with NULL. */
extern const weft_command *const weft_commands[];

/** Prints one JSON object and a newline on inv->out and releases it; NULL is an out-of-memory error. */
weft_err weft_print_json(const weft_invocation *inv, json_t *object, weft_error *err);

/** The whole program: parse argv, run, report.  @return the exit status. */
int weft_cli_main(int argc, char **argv);

#endif
