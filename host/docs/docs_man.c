#include "host/docs/docs_man.h"

#include "core/file.h"
#include "core/mem.h"
#include "core/version.h"
#include "host/camera/camera.h"
#include "host/cli/command.h"
#include "host/client/job_kinds.h"
#include "host/daemon/daemon.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

const char *const weft_docs_rules[] = {
    "Results go to stdout, everything else to stderr.",
    "Exit status: 0 done, 1 it failed (one line says what, which file, what to do), 2 wrong usage, 130 "
    "cancelled.",
    "Nothing is overwritten without `--force`.",
    NULL,
};

void weft_docs_value(const weft_field *field, char text[160])
{
    text[0] = '\0';
    if (field->type == WEFT_FIELD_CHOICE) {
        snprintf(text, 160, "%s", field->choices);
    } else if (field->type != WEFT_FIELD_FLAG) {
        snprintf(text, 160, "%s", field->unit ? field->unit : field->type == WEFT_FIELD_SIZE ? "WxH" : "");
        if (field->min != 0 || field->max != 0)
            snprintf(text + strlen(text), 160 - strlen(text), "%s%g to %g", text[0] ? ", " : "", field->min,
                     field->max);
    }
}

/* ---- letters ---- */

/* Whether a minus begins an option or a number, and is not the hyphen of a word. */
static bool is_minus(const char *begin, const char *p)
{
    return p == begin || strchr(" (\"[|,=-", p[-1]) != NULL;
}

/* One line of text, so that no letter of it is a command. */
static void put_text(FILE *out, const char *text, size_t n)
{
    if (n > 0 && (text[0] == '.' || text[0] == '\''))
        fputs("\\&", out);
    for (const char *p = text; p < text + n; p++) {
        if (*p == '\\')
            fputs("\\e", out);
        else if (*p == '~')
            fputs("\\(ti", out);
        else if (*p == '^')
            fputs("\\(ha", out);
        else if (*p == '-' && is_minus(text, p))
            fputs("\\-", out);
        else if (*p != '`')
            fputc(*p, out);
    }
}

/* An argument of a macro: one word, whatever it holds. */
static void put_word(FILE *out, const char *text)
{
    fputs(" \"\\&", out);
    for (const char *p = text; *p; p++)
        fputs(*p == '"' ? "\\(dq" : *p == '\\' ? "\\e" : (char[]){*p, '\0'}, out);
    fputc('"', out);
}

/* As it stands, to be copied into a terminal. */
static void put_code(FILE *out, const char *text)
{
    fputs(".Bd -literal -offset indent\n", out);
    if (text[0] == '.' || text[0] == '\'')
        fputs("\\&", out);
    for (const char *p = text; *p; p++)
        fputs(*p == '\\'   ? "\\e"
              : *p == '~'  ? "\\(ti"
              : *p == '^'  ? "\\(ha"
              : *p == '-'  ? "\\-"
              : *p == '\'' ? "\\(aq"
              : *p == '`'  ? "\\(ga"
                           : (char[]){*p, '\0'},
              out);
    fputs("\n.Ed\n", out);
}

/* Whether a line is of a table, set with blanks. */
static bool is_of_table(const char *line, size_t n)
{
    for (size_t i = 0; i + 2 < n; i++)
        if (line[i] == ' ' && line[i + 1] == ' ' && line[i + 2] == ' ')
            return true;
    return n > 0 && line[0] == ' ';
}

/* Running text: a line for each sentence, as the formatters like it; tables stay as they are. */
static void put_paragraphs(FILE *out, const char *text)
{
    bool table = false;
    while (*text) {
        const size_t n = strcspn(text, "\n");
        const bool is_table = is_of_table(text, n);
        if (is_table != table)
            fputs(is_table ? ".Bd -unfilled -offset indent\n" : ".Ed\n.Pp\n", out);
        table = is_table;
        for (const char *p = text, *const end = text + n; p < end && n > 0;) {
            const char *stop = p;
            while (stop < end && !(stop[0] == '.' && stop + 2 < end && stop[1] == ' ' && stop[2] == ' '))
                stop++;
            stop += stop < end;
            put_text(out, p, (size_t)(stop - p));
            fputc('\n', out);
            p = stop + (stop < end ? strspn(stop, " ") : 0);
        }
        text += n + (text[n] == '\n');
    }
    if (table)
        fputs(".Ed\n", out);
}

static void put_sentence(FILE *out, const char *text)
{
    put_text(out, text, strlen(text));
    fputc('\n', out);
}

/* ---- parts of a page ---- */

typedef struct page {
    FILE *out;
    char *text;
    size_t n;
} page;

static const char *const months[] = {"January", "February", "March",     "April",   "May",      "June",
                                     "July",    "August",   "September", "October", "November", "December"};

/* "weft calibrate lens" as the name of its page */
static void hyphenate(const char *words, char name[64], bool capitals)
{
    snprintf(name, 64, "%s", words);
    for (char *p = name; *p; p++)
        *p = (char)(*p == ' ' ? '-' : capitals ? toupper((unsigned char)*p) : *p);
}

static weft_err begin(page *p, const char *date, const char *program, int section, const char *summary,
                      weft_error *err)
{
    struct tm day = {0};
    char name[64], capitals[64];
    *p = (page){0};
    const char *const behind = strptime(date, "%Y-%m-%d", &day);
    if (!behind || *behind)
        return weft_fail(err, WEFT_ERR_USAGE, "%s: wanted a date as 2026-11-23", date);
    p->out = open_memstream(&p->text, &p->n);
    if (!p->out)
        return weft_fail(err, WEFT_ERR_NOMEM, "out of memory for a page");
    hyphenate(program, name, false);
    hyphenate(program, capitals, true);
    fprintf(p->out, ".\\\" Written by weft-docs man; do not edit.\n");
    fprintf(p->out, ".Dd %s %d, %d\n.Dt %s %d\n.Os Weft %s\n", months[day.tm_mon], day.tm_mday,
            day.tm_year + 1900, capitals, section, WEFT_VERSION);
    fprintf(p->out, ".Sh NAME\n.Nm %s\n.Nd ", name);
    put_sentence(p->out, summary);
    return WEFT_OK;
}

static weft_err end(page *p, const char *folder, const char *program, int section, weft_error *err)
{
    char name[64];
    hyphenate(program, name, false);
    char *const path = weft_asprintf(err, "%s/man%d/%s.%d", folder, section, name, section);
    const bool whole = fclose(p->out) == 0;
    weft_err status = !path    ? WEFT_ERR_NOMEM
                      : !whole ? weft_fail(err, WEFT_ERR_NOMEM, "out of memory for a page")
                               : weft_file_write(path, p->text, p->n, err);
    weft_free(path);
    free(p->text); /* open_memstream()'s */
    return status;
}

/* "(0 to 9; default: 3; needed)" */
static void put_limits(FILE *out, const weft_field *f)
{
    const char *lead = "(";
    if (f->min != 0 || f->max != 0) {
        fprintf(out, "%s%g to %g", lead, f->min, f->max);
        lead = "; ";
    }
    if (f->def) {
        fprintf(out, "%sdefault: ", lead);
        put_text(out, f->def, strlen(f->def));
        lead = "; ";
    }
    if (f->required) {
        fprintf(out, "%sneeded", lead);
        lead = "; ";
    }
    if (lead[0] == ';')
        fputs(")\n", out);
}

static void put_option(FILE *out, const weft_field *f)
{
    char value[160];
    weft_docs_value(f, value);
    fprintf(out, ".It Fl \\-%s", f->key);
    if (f->short_opt)
        fprintf(out, " , Fl %c", f->short_opt);
    if (f->type == WEFT_FIELD_CHOICE || f->type == WEFT_FIELD_SIZE || f->unit) {
        fputs(" Ar", out);
        put_word(out, f->type == WEFT_FIELD_CHOICE ? f->choices : f->unit ? f->unit : "WxH");
    } else if (f->type != WEFT_FIELD_FLAG) {
        fputs(" Ar N", out);
    }
    fputc('\n', out);
    put_sentence(out, f->help);
    put_limits(out, f);
}

static void put_options(FILE *out, const weft_field *fields)
{
    fputs(".Bl -tag -width Ds\n", out);
    for (const weft_field *f = fields; f && f->key; f++)
        put_option(out, f);
    fputs(".El\n", out);
}

/* The rules, but that of the exit status, which has a section of its own. */
static void put_rules(FILE *out)
{
    for (const char *const *rule = weft_docs_rules; *rule; rule++)
        if (strncmp(*rule, "Exit status", 11) != 0)
            put_sentence(out, *rule);
}

static void put_exit_status(FILE *out)
{
    fputs(".Sh EXIT STATUS\n", out);
    for (const char *const *rule = weft_docs_rules; *rule; rule++)
        if (strncmp(*rule, "Exit status", 11) == 0)
            put_sentence(out, *rule + strlen("Exit status: "));
}

/* ---- pages ---- */

/* What the daemon has to do with a command. */
static bool put_daemon(FILE *out, const weft_command *command)
{
    const weft_job_kind *const kind = weft_job_kind_find(command->name);
    if (!kind)
        return false;
    fputs(kind->hardware ? ".Pp\nIt goes through\n.Xr weftd 8\nwhen its socket is there, which owns the "
                           "scanner, and else opens the devices itself.\n"
                         : ".Pp\nIt can be a job of\n.Xr weftd 8 .\n",
          out);
    return true;
}

static weft_err write_command(const char *folder, const char *date, const weft_command *command,
                              weft_error *err)
{
    page p;
    char program[64];
    snprintf(program, sizeof program, "weft %s", command->name);
    WEFT_TRY(begin(&p, date, program, 1, command->summary, err));
    fprintf(p.out, ".Sh SYNOPSIS\n.Nm %s\n", program);
    if (command->operands[0]) {
        fputs(".Ar", p.out);
        put_word(p.out, command->operands);
        fputc('\n', p.out);
    }
    fputs(".Op Ar OPTIONS\n.Sh DESCRIPTION\n", p.out);
    if (command->details)
        put_paragraphs(p.out, command->details);
    else
        fprintf(p.out, "%c%s.\n", toupper((unsigned char)command->summary[0]), command->summary + 1);
    const bool is_job = put_daemon(p.out, command);
    fputs(".Sh OPTIONS\n", p.out);
    if (command->fields && command->fields->key) {
        put_options(p.out, command->fields);
        fputs(".Pp\n", p.out);
    }
    fputs("Every command has these:\n", p.out);
    put_options(p.out, weft_common_fields);
    fputs(".Pp\n", p.out);
    put_rules(p.out);
    put_exit_status(p.out);
    fputs(".Sh EXAMPLES\n", p.out);
    put_code(p.out, command->example);
    fprintf(p.out, ".Sh SEE ALSO\n.Xr weft 1%s\n", is_job ? " ,\n.Xr weftd 8" : "");
    return end(&p, folder, program, 1, err);
}

static void put_environment(FILE *out)
{
    fputs(".Sh ENVIRONMENT\n.Bl -tag -width Ds\n"
          ".It Ev WEFT_SOCKET\nthe daemon's socket; none: use the devices directly\n"
          ".It Ev XDG_RUNTIME_DIR\nelse the socket is looked for in weft/weftd.sock there, for root in /run\n"
          ".It Ev WEFT_LIBRARY\nthe library of the library commands\n"
          ".It Ev OMP_NUM_THREADS\nhow many threads work; the results do not depend on it\n"
          ".El\n",
          out);
}

static void put_helpers(FILE *out)
{
    fputs(".Sh FILES\n.Bl -tag -width Ds\n", out);
    for (const weft_camera_kind *kind = weft_camera_kinds; kind->name; kind++) {
        fprintf(out, ".It Pa libexec/weft/weft-camera-%s\n", kind->name);
        put_sentence(out, kind->summary);
    }
    fputs(".It Pa /run/weft/weftd.sock\nthe socket of\n.Xr weftd 8\nas a service\n.El\n.Pp\n"
          "A camera is used through a helper process of its backend, so that a camera library that hangs or "
          "crashes can be ended.\n"
          "They are started by\n.Nm\nand\n.Xr weftd 8 ,\nnot by hand.\n",
          out);
}

static weft_err write_overview(const char *folder, const char *date, weft_error *err)
{
    page p;
    WEFT_TRY(begin(&p, date, "weft", 1, "an open-source textile scanner", err));
    fputs(".Sh SYNOPSIS\n.Nm\n.Ar COMMAND\n.Op Ar OPTIONS\n.Ar ...\n.Sh DESCRIPTION\n"
          "Lights, captures, calibrates, solves and shows textiles.\n",
          p.out);
    put_rules(p.out);
    fputs(".Fl \\-help\nexplains a command, and each has a page of its own:\n.Bl -tag -width Ds\n", p.out);
    for (const weft_command *const *c = weft_commands; *c; c++) {
        char name[64], program[64];
        snprintf(program, sizeof program, "weft %s", (*c)->name);
        hyphenate(program, name, false);
        fprintf(p.out, ".It Xr %s 1\n", name);
        put_sentence(p.out, (*c)->summary);
    }
    fputs(".El\n.Sh OPTIONS\nEvery command has these:\n", p.out);
    put_options(p.out, weft_common_fields);
    put_environment(p.out);
    put_helpers(p.out);
    put_exit_status(p.out);
    fputs(".Sh SEE ALSO\n.Xr weftd 8\n", p.out);
    return end(&p, folder, "weft", 1, err);
}

static weft_err write_daemon(const char *folder, const char *date, weft_error *err)
{
    page p;
    WEFT_TRY(begin(&p, date, "weftd", 8, weft_daemon_summary, err));
    fputs(".Sh SYNOPSIS\n.Nm\n.Fl \\-library Ar DIR\n.Op Ar OPTIONS\n.Sh DESCRIPTION\n", p.out);
    put_paragraphs(p.out, weft_daemon_details);
    fputs(".Sh OPTIONS\n", p.out);
    put_options(p.out, weft_daemon_fields);
    fputs(".Sh FILES\n.Bl -tag -width Ds\n"
          ".It Pa weftd.service , weftd.socket\n"
          "units of systemd: the daemon as the user weft with the library\n.Pa /var/lib/weft\n"
          "and the socket\n.Pa /run/weft/weftd.sock\nfor the group weft; started at the first connection\n"
          ".It Pa DIR/.weft/library.db\nthe queue of jobs and the catalogue of the library (SQLite)\n"
          ".It Pa DIR/.weft/token\nthe token that clients over TCP show\n"
          ".It Pa libexec/weft/weft-camera-*\nthe camera helpers, see\n.Xr weft 1\n.El\n",
          p.out);
    fputs(".Sh EXIT STATUS\n0 when it was asked to end, 1 when it cannot serve, 2 for wrong usage.\n"
          ".Sh EXAMPLES\n",
          p.out);
    put_code(p.out, weft_daemon_example);
    fputs("As a service, for the members of the group weft:\n", p.out);
    put_code(p.out, "systemctl enable --now weftd.socket weftd.service");
    fputs(".Sh SEE ALSO\n.Xr systemctl 1 ,\n.Xr weft 1\n", p.out);
    return end(&p, folder, "weftd", 8, err);
}

weft_err weft_docs_write_man(const char *folder, const char *date, weft_error *err)
{
    for (int section = 1; section <= 8; section += 7) {
        char *const path = weft_asprintf(err, "%s/man%d", folder, section);
        const weft_err status = path ? weft_folder_create(path, err) : WEFT_ERR_NOMEM;
        weft_free(path);
        WEFT_TRY(status);
    }
    WEFT_TRY(write_overview(folder, date, err));
    WEFT_TRY(write_daemon(folder, date, err));
    for (const weft_command *const *c = weft_commands; *c; c++)
        WEFT_TRY(write_command(folder, date, *c, err));
    return WEFT_OK;
}
