/*
 * weft-docs cli|errors: writes docs/cli.md and docs/errors.md from the tables of the program.
 * A test compares them, so the documents cannot become stale.
 * weft-docs man DIR DATE: the manual pages; the build does that, into build/man.
 */
#include "host/cli/command.h"
#include "host/docs/docs_man.h"

#include <stdio.h>
#include <string.h>

static void print_rows(const weft_field *fields)
{
    fputs("\n| option | value | default | does |\n| --- | --- | --- | --- |\n", stdout);
    for (const weft_field *f = fields; f && f->key; f++) {
        char value[160], cell[320];
        size_t n = 0;
        weft_docs_value(f, value);
        for (const char *c = value; *c; c++) { /* a bar would end the cell */
            if (*c == '|')
                cell[n++] = '\\';
            cell[n++] = *c;
        }
        cell[n] = '\0';
        printf("| `--%s`", f->key);
        if (f->short_opt)
            printf(" `-%c`", f->short_opt);
        printf(" | %s | %s | %s%s |\n", cell, f->def ? f->def : "", f->help, f->required ? " (needed)" : "");
    }
}

static void print_cli(void)
{
    fputs("# The command line\n\n"
          "Written by `build/bin/weft-docs cli`; do not edit.\n\n",
          stdout);
    for (const char *const *rule = weft_docs_rules; *rule; rule++)
        printf("%s\n", *rule);
    fputs("\nEvery command has these options:\n", stdout);
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
    weft_error error = {0};
    if (argc == 2 && strcmp(argv[1], "cli") == 0)
        print_cli();
    else if (argc == 2 && strcmp(argv[1], "errors") == 0)
        print_errors();
    else if (argc == 4 && strcmp(argv[1], "man") == 0) {
        if (weft_docs_write_man(argv[2], argv[3], &error) != WEFT_OK) {
            fprintf(stderr, "weft-docs: %s\n", error.text);
            return 1;
        }
    } else {
        fputs("usage: weft-docs cli|errors|man DIR DATE\n", stderr);
        return 2;
    }
    return 0;
}
