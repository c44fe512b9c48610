#include "core/text_buffer.h"

#include "core/mem.h"
#include "core/text.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

void weft_text_buffer_fini(weft_text_buffer *buffer)
{
    weft_free(buffer->text);
    *buffer = (weft_text_buffer){0};
}

/* Room for `more` bytes and the NUL; NULL after a failure. */
static char *reserve(weft_text_buffer *b, size_t more)
{
    if (b->failure.code != WEFT_OK)
        return NULL;
    if (b->n + more + 1 > b->capacity) {
        const size_t capacity = 2 * (b->n + more) + 256;
        char *const text = weft_realloc(b->text, capacity, 1, &b->failure);
        if (!text)
            return NULL;
        b->text = text;
        b->capacity = capacity;
    }
    return b->text + b->n;
}

void weft_text_add_bytes(weft_text_buffer *buffer, const char *bytes, size_t n)
{
    char *const to = reserve(buffer, n);
    if (!to)
        return;
    if (n > 0)
        memcpy(to, bytes, n);
    to[n] = '\0';
    buffer->n += n;
}

void weft_text_add(weft_text_buffer *buffer, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    const int n = vsnprintf(NULL, 0, format, args);
    va_end(args);
    char *const to = n >= 0 ? reserve(buffer, (size_t)n) : NULL;
    if (!to)
        return;
    va_start(args, format);
    vsnprintf(to, (size_t)n + 1, format, args);
    va_end(args);
    buffer->n += (size_t)n;
}

/* Bytes of the UTF-8 character at `text`, 0 when it is none. */
static size_t character_length(const char *text)
{
    const unsigned char lead = (unsigned char)text[0];
    const size_t n = lead < 0x80 ? 1 : lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : lead >= 0xc0 ? 2 : 0;
    for (size_t i = 1; i < n; i++)
        if (text[i] == '\0')
            return 0;
    return n > 0 && weft_text_is_utf8(text, n) ? n : 0;
}

void weft_text_add_le(weft_text_buffer *buffer, uint64_t value, int bytes)
{
    for (int k = 0; k < bytes; k++) {
        const char byte = (char)(value >> (8 * k) & 0xff);
        weft_text_add_bytes(buffer, &byte, 1);
    }
}

void weft_text_add_escaped(weft_text_buffer *buffer, const char *text)
{
    while (text && *text) {
        const size_t n = character_length(text);
        switch (*text) {
        case '<':
            weft_text_add(buffer, "&lt;");
            break;
        case '>':
            weft_text_add(buffer, "&gt;");
            break;
        case '&':
            weft_text_add(buffer, "&amp;");
            break;
        case '"':
            weft_text_add(buffer, "&quot;");
            break;
        case '\'':
            weft_text_add(buffer, "&#39;");
            break;
        default:
            if (n == 0)
                weft_text_add(buffer, "\xef\xbf\xbd");
            else if (n == 1 && (unsigned char)*text < ' ')
                weft_text_add(buffer, " ");
            else
                weft_text_add_bytes(buffer, text, n);
        }
        text += n ? n : 1;
    }
}

void weft_text_add_base64(weft_text_buffer *buffer, const void *bytes, size_t n)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const uint8_t *const in = bytes;
    const size_t length = (n + 2) / 3 * 4;
    char *to = reserve(buffer, length);
    if (!to)
        return;
    for (size_t i = 0; i < n; i += 3, to += 4) {
        const unsigned b1 = i + 1 < n ? in[i + 1] : 0, b2 = i + 2 < n ? in[i + 2] : 0;
        const unsigned word = (unsigned)in[i] << 16 | b1 << 8 | b2;
        to[0] = digits[word >> 18];
        to[1] = digits[word >> 12 & 63];
        to[2] = i + 1 < n ? digits[word >> 6 & 63] : '=';
        to[3] = i + 2 < n ? digits[word & 63] : '=';
    }
    *to = '\0';
    buffer->n += length;
}

weft_err weft_text_buffer_status(const weft_text_buffer *buffer, weft_error *err)
{
    if (buffer->failure.code != WEFT_OK && err)
        *err = buffer->failure;
    return buffer->failure.code;
}
