/** Text to numbers, the only place where it is done: '.' is the decimal point whatever the locale. */
#ifndef WEFT_CORE_TEXT_H
#define WEFT_CORE_TEXT_H

#include <stdbool.h>
#include <stddef.h>

/** Parses the whole text (surrounding blanks allowed) as one finite number; false when it is not. */
bool weft_text_to_double(const char *text, double *value);

/** Parses a number at the start of `text`.  @return what follows it, or NULL when there is none. */
const char *weft_text_scan_double(const char *text, double *value);

/** Parses the whole text as a whole number in decimal; false when it is none or does not fit. */
bool weft_text_to_int(const char *text, int *value);

/** Whether `n` bytes are valid UTF-8 without NUL. */
bool weft_text_is_utf8(const char *bytes, size_t n);

#endif
