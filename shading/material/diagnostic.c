#include "shading/material/diagnostic.h"

#include <string.h>

void weft_diagnose(weft_diagnostics *d, weft_severity severity, weft_place place, const char *format, ...)
{
    *(severity == WEFT_SEVERITY_ERROR ? &d->n_errors : &d->n_warnings) += 1;
    char text[768];
    va_list list;
    va_start(list, format);
    (void)vsnprintf(text, sizeof text, format, list);
    va_end(list);
    weft_diagnostic *const one = weft_arena_alloc(d->arena, sizeof *one, NULL);
    char *const kept = weft_arena_text(d->arena, text, strlen(text), NULL);
    if (!one || !kept)
        return;
    *one = (weft_diagnostic){.severity = severity, .place = place, .text = kept};
    *(d->last ? &d->last->next : &d->first) = one;
    d->last = one;
}

static bool is_continuation(char byte)
{
    return ((unsigned char)byte & 0xc0) == 0x80;
}

static const char *line_start(weft_place place)
{
    const char *const text = place.source->text;
    const char *at = text + place.begin;
    while (at > text && at[-1] != '\n')
        at--;
    return at;
}

void weft_place_position(weft_place place, int *line, int *column)
{
    *line = *column = 1;
    if (!place.source)
        return;
    for (const char *p = place.source->text; p < place.source->text + place.begin; p++)
        *line += *p == '\n';
    for (const char *p = line_start(place); p < place.source->text + place.begin; p++)
        *column += !is_continuation(*p);
}

/* The caret line repeats the tabs of the text above it, so that it stands right for any tab width. */
static void print_caret(weft_place place, const char *start, const char *end, FILE *out)
{
    const char *const begin = place.source->text + place.begin;
    for (const char *p = start; p < begin; p++)
        if (!is_continuation(*p))
            fputc(*p == '\t' ? '\t' : ' ', out);
    fputc('^', out);
    for (const char *p = begin + 1; p < begin + place.length && p < end; p++)
        if (!is_continuation(*p))
            fputc('~', out);
    fputc('\n', out);
}

void weft_diagnostic_print(const weft_diagnostic *diagnostic, FILE *out)
{
    const char *const word = diagnostic->severity == WEFT_SEVERITY_ERROR ? "error" : "warning";
    const weft_place place = diagnostic->place;
    if (!place.source) {
        fprintf(out, "%s: %s\n", word, diagnostic->text);
        return;
    }
    int line, column;
    weft_place_position(place, &line, &column);
    fprintf(out, "%s:%d:%d: %s: %s\n", place.source->path, line, column, word, diagnostic->text);
    const char *const start = line_start(place), *const end = start + strcspn(start, "\r\n");
    const int width = fprintf(out, " %d", line);
    fprintf(out, " | %.*s\n%*s | ", (int)(end - start), start, width, "");
    print_caret(place, start, end, out);
}

void weft_diagnostics_print(const weft_diagnostics *d, FILE *out)
{
    for (const weft_diagnostic *one = d->first; one; one = one->next)
        weft_diagnostic_print(one, out);
}

weft_err weft_diagnostics_status(const weft_diagnostics *d, weft_error *err)
{
    if (d->n_errors == 0)
        return WEFT_OK;
    const weft_diagnostic *one = d->first;
    while (one && one->severity != WEFT_SEVERITY_ERROR)
        one = one->next;
    if (!one)
        return weft_fail(err, WEFT_ERR_NOMEM, "out of memory");
    char more[40] = "";
    if (d->n_errors > 1)
        (void)snprintf(more, sizeof more, " (and %d more)", d->n_errors - 1);
    if (!one->place.source)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s%s", one->text, more);
    int line, column;
    weft_place_position(one->place, &line, &column);
    return weft_fail(err, WEFT_ERR_FORMAT, "%s:%d:%d: %s%s", one->place.source->path, line, column, one->text,
                     more);
}
