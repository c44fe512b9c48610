#include "core/error.h"

#include "core/text.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>

/* Names in brackets are functions even where error.h makes macros of them for the analyzer. */
static const struct {
    const char *name, *text;
    int exit_status;
} codes[] = {
#define X(name, status, text) {#name, text, status},
    WEFT_ERROR_LIST(X)
#undef X
};

enum { N_CODES = sizeof codes / sizeof codes[0] };

/* Names out of damaged files must not break the promise of one line of UTF-8: what is no letter becomes '?'.
 */
static void make_one_line(char *text)
{
    while (*text) {
        size_t n = 1;
        while (n < 4 && text[n] && !weft_text_is_utf8(text, n))
            n++;
        if ((unsigned char)*text < ' ' || *text == 0x7f || !weft_text_is_utf8(text, n)) {
            *text = '?';
            n = 1;
        }
        text += n;
    }
}

weft_err(weft_fail)(weft_error *err, weft_err code, const char *format, ...)
{
    assert(code != WEFT_OK);
    if (err) {
        va_list args;
        va_start(args, format);
        err->code = code;
        vsnprintf(err->text, sizeof err->text, format, args);
        va_end(args);
        make_one_line(err->text);
    }
    return code;
}

weft_err(weft_fail_errno)(weft_error *err, weft_err code, const char *format, ...)
{
    const int number = errno;
    assert(code != WEFT_OK);
    if (err) {
        va_list args;
        va_start(args, format);
        err->code = code;
        vsnprintf(err->text, sizeof err->text, format, args);
        va_end(args);
        const size_t used = strlen(err->text);
        snprintf(err->text + used, sizeof err->text - used, ": %s", strerror(number));
        make_one_line(err->text);
    }
    return code;
}

weft_err(weft_prefix)(weft_error *err, weft_err code, const char *format, ...)
{
    if (!err)
        return code;
    char was[sizeof err->text];
    memcpy(was, err->text, sizeof was);
    va_list args;
    va_start(args, format);
    vsnprintf(err->text, sizeof err->text, format, args);
    va_end(args);
    const size_t used = strlen(err->text);
    snprintf(err->text + used, sizeof err->text - used, ": %s", was);
    make_one_line(err->text);
    return code;
}

const char *weft_err_name(weft_err code)
{
    return (unsigned)code < N_CODES ? codes[code].name : "UNKNOWN";
}

const char *weft_err_text(weft_err code)
{
    return (unsigned)code < N_CODES ? codes[code].text : "unknown error";
}

int weft_err_exit_status(weft_err code)
{
    return (unsigned)code < N_CODES ? codes[code].exit_status : 1;
}
