/*
 * weft-docs cli|errors: writes docs/cli.md and docs/errors.md from the tables of the program.
 * A test compares them, so the documents cannot become stale.
 */
#include "host/cli/command.h"

#include <stdio.h>
#include <string.h>

static void print_rows(const weft_field *fields)
{
    fputs("\n| option | value | default | does |\n| --- | --- | --- | --- |\n", stdout);
    for (const weft_field *f = fields; f && f->key; f++) {
        char value[160] = "";
        if (f->type == WEFT_FIELD_CHOICE) {
            size_t n = 0;
            for (const char *c = f->choices; *c && n + 2 < sizeof value; c++) { /* a bar would end the cell */
                if (*c == '|')
                    value[n++] = '\\';
                value[n++] = *c;
            }
            value[n] = '\0';
        } else if (f->type != WEFT_FIELD_FLAG) {
            snprintf(value, sizeof value, "%s", f->unit ? f->unit : f->type == WEFT_FIELD_SIZE ? "WxH" : "");
            if (f->min != 0 || f->max != 0)
                snprintf(value + strlen(value), sizeof value - strlen(value), "%s%g to %g",
                         value[0] ? ", " : "", f->min, f->max);
        }
        printf("| `--%s`", f->key);
        if (f->short_opt)
            printf(" `-%c`", f->short_opt);
        printf(" | %s | %s | %s%s |\n", value, f->def ? f->def : "", f->help, f->required ? " (needed)" : "");
    }
}

static void print_cli(void)
{
    fputs("# The command line\n\n"
          "Written by `build/bin/weft-docs cli`; do not edit.\n\n"
          "Results go to stdout, everything else to stderr.\n"
          "Exit status: 0 done, 1 it failed (one line says what, which file, what to do), 2 wrong usage, 130 "
          "cancelled.\n"
          "Nothing is overwritten without `--force`.\n\n"
          "Every command has these options:\n",
          stdout);
    print_rows(weft_common_fields);
    for (const weft_command *const *c = weft_commands; *c; c++) {
        printf("\n## weft %s\n\n%s.\n\n    weft %s%s%s%s\n", (*c)->name, (*c)->summary, (*c)->name,
               (*c)->operands[0] ? " " : "", (*c)->operands, (*c)->fields ? " [OPTIONS]" : "");
        if ((*c)->details)
            printf("\n%s\n", (*c)->details);
        if ((*c)->fields && (*c)->fields->key)
            print_rows((*c)->fields);
        printf("\nExample:\n\n    %s\n", (*c)->example);
    }
}

static void print_errors(void)
{
    fputs("# Errors\n\n"
          "Written by `build/bin/weft-docs errors`; do not edit.\n\n"
          "A failing command prints one line and exits with the status of its kind.\n\n"
          "| kind | exit status | meaning |\n| --- | --- | --- |\n",
          stdout);
#define X(name, status, text) printf("| %s | %d | %s |\n", #name, status, text);
    WEFT_ERROR_LIST(X)
#undef X
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "cli") == 0)
        print_cli();
    else if (argc == 2 && strcmp(argv[1], "errors") == 0)
        print_errors();
    else {
        fputs("usage: weft-docs cli|errors\n", stderr);
        return 2;
    }
    return 0;
}
