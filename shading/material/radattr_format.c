#include "shading/material/radattr.h"

#include <string.h>

enum { INDENT = 4, WIDTH = 100 };

static void indent(FILE *out, int level)
{
    fprintf(out, "%*s", level * INDENT, "");
}

/* Every line of a comment at the indentation of what it stands before. */
static void print_comment(FILE *out, const char *comment, int level)
{
    for (const char *line = comment; line && *line;) {
        const size_t n = strcspn(line, "\n"), blanks = strspn(line, " \t");
        if (blanks < n) {
            indent(out, level);
            fprintf(out, "%.*s", (int)(n - blanks), line + blanks);
        }
        fputc('\n', out);
        if (line[n] == '\n' && line[n + 1] == '\0') /* an empty line behind the last */
            fputc('\n', out);
        line += n + (line[n] == '\n');
    }
}

static void print_before(FILE *out, const weft_rad_comments *comments, int level)
{
    if (comments->blank_before)
        fputc('\n', out);
    print_comment(out, comments->before, level);
}

static void print_after(FILE *out, const weft_rad_comments *comments, int level)
{
    const char *const after = comments->after;
    const size_t n = after ? strcspn(after, "\n") : 0;
    if (n > 0)
        fprintf(out, "  %.*s", (int)n, after);
    fputc('\n', out);
    if (after && after[n] == '\n')
        print_comment(out, after + n + 1, level);
}

static bool has_comments(const weft_rad_comments *c)
{
    return c->before || c->after;
}

static size_t inline_length(const weft_rad_value *value);

/* Length of "( base :a = 1 )"; more than a line when it cannot be on one. */
static size_t inline_record_length(const weft_rad_record *record)
{
    size_t n = 4 + (record->base ? strlen(record->base) + 1 : 0);
    if (record->last_comment)
        return WIDTH;
    for (const weft_rad_member *m = record->members; m && n < WIDTH; m = m->next) {
        if (has_comments(&m->comments) || m->value->kind == WEFT_RAD_RECORD)
            return WIDTH;
        n += strlen(m->name) + 5 + inline_length(m->value);
    }
    return n;
}

static size_t inline_list_length(const weft_rad_value *list)
{
    size_t n = 2;
    if (list->record.last_comment)
        return WIDTH;
    for (const weft_rad_value *item = list->items; item && n < WIDTH; item = item->next) {
        if (has_comments(&item->comments) || item->kind == WEFT_RAD_RECORD)
            return WIDTH;
        n += inline_length(item) + 2;
    }
    return n;
}

static size_t inline_length(const weft_rad_value *value)
{
    switch (value->kind) {
    case WEFT_RAD_FLAG:
        return 5;
    case WEFT_RAD_TEXT:
        return strlen(value->text) + 2;
    case WEFT_RAD_LIST:
        return inline_list_length(value);
    case WEFT_RAD_RECORD:
        return inline_record_length(&value->record);
    case WEFT_RAD_NUMBER:
    case WEFT_RAD_COLOUR:
    case WEFT_RAD_NAME:
        break;
    }
    return strlen(value->text);
}

static void print_value(FILE *out, const weft_rad_value *value, int level, size_t column);

static void print_record(FILE *out, const weft_rad_record *record, int level, size_t column)
{
    fprintf(out, "(%s%s", record->base ? " " : "", record->base ? record->base : "");
    if (column + inline_record_length(record) < WIDTH) {
        for (const weft_rad_member *m = record->members; m; m = m->next) {
            fprintf(out, " :%s = ", m->name);
            print_value(out, m->value, level, 0);
        }
        fputs(" )", out);
        return;
    }
    fputc('\n', out);
    for (const weft_rad_member *m = record->members; m; m = m->next) {
        print_before(out, &m->comments, level + 1);
        indent(out, level + 1);
        fprintf(out, ":%s = ", m->name);
        print_value(out, m->value, level + 1, (size_t)(level + 1) * INDENT + strlen(m->name) + 4);
        print_after(out, &m->comments, level + 1);
    }
    print_comment(out, record->last_comment, level + 1);
    indent(out, level);
    fputc(')', out);
}

static void print_list(FILE *out, const weft_rad_value *list, int level, size_t column)
{
    fputc('[', out);
    if (column + inline_list_length(list) < WIDTH) {
        for (const weft_rad_value *item = list->items; item; item = item->next) {
            print_value(out, item, level, 0);
            fputs(item->next ? ", " : "", out);
        }
        fputc(']', out);
        return;
    }
    fputc('\n', out);
    for (const weft_rad_value *item = list->items; item; item = item->next) {
        print_before(out, &item->comments, level + 1);
        indent(out, level + 1);
        print_value(out, item, level + 1, (size_t)(level + 1) * INDENT);
        print_after(out, &item->comments, level + 1);
    }
    print_comment(out, list->record.last_comment, level + 1);
    indent(out, level);
    fputc(']', out);
}

static void print_value(FILE *out, const weft_rad_value *value, int level, size_t column)
{
    switch (value->kind) {
    case WEFT_RAD_FLAG:
        fputs(value->flag ? "true" : "false", out);
        break;
    case WEFT_RAD_TEXT:
        fprintf(out, "\"%s\"", value->text);
        break;
    case WEFT_RAD_LIST:
        print_list(out, value, level, column);
        break;
    case WEFT_RAD_RECORD:
        print_record(out, &value->record, level, column);
        break;
    case WEFT_RAD_NUMBER:
    case WEFT_RAD_COLOUR:
    case WEFT_RAD_NAME:
        fputs(value->text, out);
        break;
    }
}

void weft_rad_format(const weft_rad_file *file, FILE *out)
{
    for (const weft_rad_item *item = file->items; item; item = item->next) {
        weft_rad_comments comments = item->comments;
        /* Materials stand apart; includes stand as they were. */
        comments.blank_before = item != file->items && (!item->is_include || comments.blank_before);
        print_before(out, &comments, 0);
        if (item->is_include) {
            fprintf(out, "include %c%s%c", item->from_library ? '<' : '"', item->name,
                    item->from_library ? '>' : '"');
        } else {
            fprintf(out, ":%s := ", item->name);
            /* never on one line: a definition is read by its properties */
            print_record(out, &item->record, 0,
                         item->record.members || item->record.last_comment ? WIDTH : 0);
        }
        print_after(out, &comments, 0);
    }
    print_comment(out, file->last_comment, 0);
}
