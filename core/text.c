#include "core/text.h"

#include <ctype.h>
#include <errno.h>
#include <limits.h>
#include <locale.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

/* strtod_l with a "C" locale made once: setlocale() elsewhere must not turn "0.5" into "0". */
static locale_t c_locale(void)
{
    static locale_t made;
    if (!made)
        made = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    return made;
}

const char *weft_text_scan_double(const char *text, double *value)
{
    char *end;
    const double number = strtod_l(text, &end, c_locale());
    if (end == text || !isfinite(number))
        return NULL;
    *value = number;
    return end;
}

static bool is_blank_to_end(const char *text)
{
    while (isspace((unsigned char)*text))
        text++;
    return *text == '\0';
}

bool weft_text_to_double(const char *text, double *value)
{
    double number;
    const char *const end = weft_text_scan_double(text, &number);
    if (!end || !is_blank_to_end(end))
        return false;
    *value = number;
    return true;
}

bool weft_text_to_int(const char *text, int *value)
{
    char *end;
    errno = 0;
    const long number = strtol(text, &end, 10);
    if (end == text || !is_blank_to_end(end) || errno || number < INT_MIN || number > INT_MAX)
        return false;
    *value = (int)number;
    return true;
}

bool weft_text_is_utf8(const char *bytes, size_t n)
{
    const uint8_t *const s = (const uint8_t *)bytes;
    for (size_t i = 0; i < n;) {
        const uint8_t c = s[i];
        const int more = c < 0x80             ? 0
                         : (c & 0xe0) == 0xc0 ? 1
                         : (c & 0xf0) == 0xe0 ? 2
                         : (c & 0xf8) == 0xf0 ? 3
                                              : -1;
        static const uint32_t smallest[4] = {1, 0x80, 0x800, 0x10000};
        if (more < 0 || n - i <= (size_t)more)
            return false;
        uint32_t code = more == 0 ? c : c & (0x3fu >> more);
        for (int k = 1; k <= more; k++) {
            if ((s[i + (size_t)k] & 0xc0) != 0x80)
                return false;
            code = code << 6 | (s[i + (size_t)k] & 0x3fu);
        }
        if (code < smallest[more] || code > 0x10ffff || (code >= 0xd800 && code < 0xe000))
            return false;
        i += (size_t)more + 1;
    }
    return true;
}
