/**
 * A text that grows: pages, plots, tables for people.
 *
 * Failures stick: after the first one nothing is appended any more, and weft_text_buffer_status() says so at
 * the end, so that writers need not check every line.
 */
#ifndef WEFT_CORE_TEXT_BUFFER_H
#define WEFT_CORE_TEXT_BUFFER_H

#include "core/error.h"

#include <stddef.h>
#include <stdint.h>

typedef struct weft_text_buffer {
    char *text; /* ends with NUL; NULL as long as it is empty */
    size_t n;   /* bytes without the NUL */
    size_t capacity;
    weft_error failure; /* the first one */
} weft_text_buffer;

/** `{0}` is an empty buffer; this frees it. */
void weft_text_buffer_fini(weft_text_buffer *buffer);

/** Appends formatted text. */
void weft_text_add(weft_text_buffer *buffer, const char *format, ...) WEFT_PRINTF(2, 3);

/** Appends `n` bytes as they are. */
void weft_text_add_bytes(weft_text_buffer *buffer, const char *bytes, size_t n);

/** Appends the low `bytes` bytes of a number, the lowest first: little endian, as binary files have it. */
void weft_text_add_le(weft_text_buffer *buffer, uint64_t value, int bytes);

/** Appends text for XML and HTML: < > & " ' become entities, control characters blanks; what is not UTF-8
 * becomes U+FFFD byte by byte.  NULL adds nothing. */
void weft_text_add_escaped(weft_text_buffer *buffer, const char *text);

/** Appends bytes as base64 (RFC 4648, with padding). */
void weft_text_add_base64(weft_text_buffer *buffer, const void *bytes, size_t n);

/** @return WEFT_OK, or the first failure, copied to `err`. */
weft_err weft_text_buffer_status(const weft_text_buffer *buffer, weft_error *err);

#endif
