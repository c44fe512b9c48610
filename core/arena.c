#include "core/arena.h"

#include "core/mem.h"

#include <stdint.h>
#include <stdio.h>
#include <string.h>

enum { BLOCK_BYTES = 1 << 16 };

struct weft_arena_block {
    struct weft_arena_block *older;
    size_t used, size;
    _Alignas(max_align_t) char bytes[];
};

void *weft_arena_alloc(weft_arena *arena, size_t size, weft_error *err)
{
    const size_t step = _Alignof(max_align_t);
    struct weft_arena_block *block = arena->blocks;
    if (size > SIZE_MAX - step - sizeof *block) {
        weft_fail(err, WEFT_ERR_NOMEM, "out of memory: %zu bytes wanted", size);
        return NULL;
    }
    size = (size + step - 1) / step * step;
    if (!block || block->size - block->used < size) {
        const size_t room = size > BLOCK_BYTES ? size : BLOCK_BYTES;
        block = weft_alloc(1, sizeof *block + room, err);
        if (!block)
            return NULL;
        block->size = room;
        block->older = arena->blocks;
        arena->blocks = block;
    }
    void *const place = block->bytes + block->used;
    block->used += size;
    return place;
}

char *weft_arena_text(weft_arena *arena, const char *text, size_t n, weft_error *err)
{
    char *const copy = weft_arena_alloc(arena, n + 1, err);
    if (copy && n > 0)
        memcpy(copy, text, n);
    return copy;
}

char *weft_arena_printf(weft_arena *arena, weft_error *err, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    const int n = vsnprintf(NULL, 0, format, list);
    va_end(list);
    char *const text = n < 0 ? NULL : weft_arena_alloc(arena, (size_t)n + 1, err);
    if (text) {
        va_start(list, format);
        (void)vsnprintf(text, (size_t)n + 1, format, list);
        va_end(list);
    }
    return text;
}

void weft_arena_fini(weft_arena *arena)
{
    for (struct weft_arena_block *block = arena->blocks; block;) {
        struct weft_arena_block *const older = block->older;
        weft_free(block);
        block = older;
    }
    arena->blocks = NULL;
}
