/**
 * All heap use of Weft.  Sizes are checked for overflow, failures name what did not fit, and a test can
 * make the n-th allocation fail.
 */
#ifndef WEFT_CORE_MEM_H
#define WEFT_CORE_MEM_H

#include "core/error.h"

#include <stddef.h>

/** `count` zeroed elements of `size` bytes, aligned to 64 bytes; free with weft_free().
 *  @return NULL (with `err` filled) when there is no memory or the product overflows;
 *          a valid pointer when count is 0. */
void *weft_alloc(size_t count, size_t size, weft_error *err);

/** As realloc for `count` elements of `size` bytes, not zeroed; on NULL the old block stands. */
void *weft_realloc(void *block, size_t count, size_t size, weft_error *err);

/** A copy of a string. */
char *weft_strdup(const char *text, weft_error *err);

/** A formatted string on the heap. */
char *weft_asprintf(weft_error *err, const char *format, ...) WEFT_PRINTF(2, 3);

/** free(); NULL is fine. */
void weft_free(void *block);

/** Tests only: the allocation after `n` more successful ones fails once; negative switches off. */
void weft_mem_fail_after(long n);

#endif
