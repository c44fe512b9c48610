#include "host/capture/frame_name.h"

#include "core/text.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#define SEPARATORS "-_.+"
#define OTHERS     "=,@"

typedef enum field { SET, KIND, LIGHT, BRACKET, EXPOSURE, INDEX, DATE, TIME, N_FIELDS } field;

static const char *const field_names[N_FIELDS] = {"set",      "kind",  "light", "bracket",
                                                  "exposure", "index", "date",  "time"};

static bool is_separator(char c)
{
    return c && strchr(SEPARATORS, c);
}

/* Not what a shell, a URL or another system's disk gives a meaning. */
static bool is_safe(char c)
{
    return isalnum((unsigned char)c) || is_separator(c) || (c && strchr(OTHERS, c)) ||
           (unsigned char)c >= 0x80;
}

/* @return the field at `text`, which begins with '{'; N_FIELDS when there is none of that name */
static field field_at(const char *text, size_t *length)
{
    const size_t n = strcspn(text, "}");
    *length = n + (text[n] == '}');
    for (int i = 0; i < N_FIELDS; i++)
        if (text[n] == '}' && strlen(field_names[i]) == n - 1 && memcmp(field_names[i], text + 1, n - 1) == 0)
            return (field)i;
    return N_FIELDS;
}

weft_err weft_frame_name_check(const char *template, weft_error *err)
{
    size_t length;
    if (!weft_text_is_utf8(template, strlen(template)))
        return weft_fail(err, WEFT_ERR_USAGE, "--file-name: is not UTF-8");
    if (*template == '-' || *template == '.' || *template == '\0')
        return weft_fail(err, WEFT_ERR_USAGE,
                         "--file-name \"%s\": begin with a letter, a digit or a field as {kind}", template);
    for (const char *p = template; *p; p += length) {
        length = 1;
        if (*p == '{' && field_at(p, &length) == N_FIELDS)
            return weft_fail(err, WEFT_ERR_USAGE,
                             "--file-name \"%s\": there is no field %.*s; there are {set}, {kind}, {light}, "
                             "{bracket}, {exposure}, {index}, {date} and {time}",
                             template, (int)length, p);
        if (*p == '/' || *p == '\\')
            return weft_fail(err, WEFT_ERR_USAGE,
                             "--file-name \"%s\": the frames of a set lie in one folder; leave out the '%c'",
                             template, *p);
        if (*p != '{' && !is_safe(*p))
            return weft_fail(
                err, WEFT_ERR_USAGE,
                "--file-name \"%s\": only letters, digits, - _ . + = , @ and fields as {light} can "
                "be in a file's name that is good on every disk",
                template);
    }
    return WEFT_OK;
}

/* What a field says of a frame; empty when the frame has none. */
static void write_field(field which, const weft_frame_facts *f, char *text, size_t size)
{
    text[0] = '\0';
    switch (which) {
    case SET:
        snprintf(text, size, "%s", f->set);
        for (char *p = text; *p; p++)
            *p = is_safe(*p) ? *p : '-';
        if (*text == '-' || *text == '.')
            *text = '_';
        break;
    case KIND:
        snprintf(text, size, "%s", weft_frame_role_name(f->role));
        break;
    case LIGHT:
        if (f->light >= 0)
            snprintf(text, size, "%02d", f->light);
        break;
    case BRACKET:
        if (f->bracket >= 0)
            snprintf(text, size, "b%d", f->bracket);
        break;
    case EXPOSURE:
        snprintf(text, size, "%.4gs", f->exposure_s);
        break;
    case INDEX:
        snprintf(text, size, "%03d", f->index);
        break;
    case DATE:
        snprintf(text, size, "%.10s", f->created);
        break;
    case TIME:
        if (strlen(f->created) >= 19)
            snprintf(text, size, "%.2s%.2s%.2s", f->created + 11, f->created + 14, f->created + 17);
        break;
    case N_FIELDS:
        break;
    }
}

static bool ends_with(const char *text, size_t n, const char *suffix)
{
    const size_t m = strlen(suffix);
    return n > m && strncasecmp(text + n - m, suffix, m) == 0;
}

weft_err weft_frame_name_make(const char *template, const weft_frame_facts *facts, const char *suffix,
                              char file[WEFT_FRAME_NAME_SIZE], weft_error *err)
{
    char name[2 * WEFT_FRAME_NAME_SIZE] = "", text[WEFT_FRAME_NAME_SIZE];
    size_t n = 0, length;
    for (const char *p = template; *p; p += length) {
        length = 1;
        snprintf(text, sizeof text, "%c", *p);
        if (*p == '{')
            write_field(field_at(p, &length), facts, text, sizeof text);
        if (!text[0] && n > 0 && is_separator(name[n - 1]))
            name[--n] = '\0';
        else if (!text[0] && n == 0 && is_separator(p[length]))
            length++;
        if (n + strlen(text) + strlen(suffix) >= WEFT_FRAME_NAME_SIZE)
            return weft_fail(err, WEFT_ERR_USAGE,
                             "--file-name \"%s\": the names would have more than %d letters; shorten it",
                             template, WEFT_FRAME_NAME_SIZE - 1);
        snprintf(name + n, sizeof name - n, "%s", text);
        n += strlen(text);
    }
    if (ends_with(name, n, suffix))
        name[n -= strlen(suffix)] = '\0';
    if (n == 0 || name[0] == '.' || name[0] == '-')
        return weft_fail(err, WEFT_ERR_USAGE,
                         "--file-name \"%s\": nothing is left of it for the %s frame; add {kind}", template,
                         weft_frame_role_name(facts->role));
    snprintf(file, WEFT_FRAME_NAME_SIZE, "%.*s%s", (int)n, name, suffix);
    return WEFT_OK;
}

bool weft_frame_name_equal(const char *a, const char *b)
{
    return strcasecmp(a, b) == 0;
}
