#include "core/mem.h"

#include "core/mem_blocks.h"

#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static atomic_long fail_after = -1;

void weft_mem_fail_after(long n)
{
    atomic_store(&fail_after, n);
}

static int must_fail(void)
{
    return atomic_load(&fail_after) >= 0 && atomic_fetch_sub(&fail_after, 1) == 0;
}

static weft_err no_memory(weft_error *err, size_t count, size_t size)
{
    return weft_fail(err, WEFT_ERR_NOMEM, "out of memory: %zu x %zu bytes", count, size);
}

void *weft_alloc(size_t count, size_t size, weft_error *err)
{
    size_t bytes;
    if (__builtin_mul_overflow(count, size, &bytes) || bytes > SIZE_MAX - 64 || must_fail()) {
        no_memory(err, count, size);
        return NULL;
    }
    bytes = (bytes + 64) / 64 * 64; /* never 0, and whole cache lines as aligned_alloc asks */
    const weft_mem_place place = weft_mem_choose_place(bytes);
    if (place == WEFT_MEM_FILE)
        return weft_mem_file_alloc(bytes, err);
    void *const block = aligned_alloc(64, bytes);
    if (place == WEFT_MEM_HEAP)
        weft_mem_note_heap(block, bytes);
    if (!block)
        no_memory(err, count, size);
    else
        memset(block, 0, bytes);
    return block;
}

/* A block that is counted, or in a file, is not realloc()'s. */
static void *move_known(void *block, size_t known, size_t count, size_t size, weft_error *err)
{
    void *const moved = weft_alloc(count, size, err);
    if (moved) {
        memcpy(moved, block, known < count * size ? known : count * size);
        weft_free(block);
    }
    return moved;
}

void *weft_realloc(void *block, size_t count, size_t size, weft_error *err)
{
    size_t bytes;
    void *grown = NULL;
    const size_t known = weft_mem_known_bytes(block);
    if (known)
        return move_known(block, known, count, size, err);
    if (!__builtin_mul_overflow(count, size, &bytes) && !must_fail())
        grown = realloc(block, bytes ? bytes : 1);
    if (!grown)
        no_memory(err, count, size);
    return grown;
}

char *weft_strdup(const char *text, weft_error *err)
{
    const size_t n = strlen(text) + 1;
    char *const copy = weft_alloc(n, 1, err);
    if (copy)
        memcpy(copy, text, n);
    return copy;
}

char *weft_asprintf(weft_error *err, const char *format, ...)
{
    va_list args, again;
    va_start(args, format);
    va_copy(again, args);
    const int n = vsnprintf(NULL, 0, format, args);
    va_end(args);
    char *const text = n < 0 ? NULL : weft_alloc((size_t)n + 1, 1, err);
    if (text)
        vsnprintf(text, (size_t)n + 1, format, again);
    va_end(again);
    return text;
}

void weft_free(void *block)
{
    if (!weft_mem_forget(block))
        free(block);
}
