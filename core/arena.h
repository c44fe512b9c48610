/** Many small things that live and die together: a syntax tree, a catalogue, the scratch of one stage. */
#ifndef WEFT_CORE_ARENA_H
#define WEFT_CORE_ARENA_H

#include "core/error.h"

#include <stddef.h>

typedef struct weft_arena {
    struct weft_arena_block *blocks; /* newest first */
} weft_arena;

/** `size` zeroed bytes, aligned for any type; freed with the arena.  `{0}` is an empty arena.
 *  @return NULL (with `err` filled) without memory. */
void *weft_arena_alloc(weft_arena *arena, size_t size, weft_error *err);

/** The first `n` bytes of `text` and a NUL. */
char *weft_arena_text(weft_arena *arena, const char *text, size_t n, weft_error *err);

/** A formatted string. */
char *weft_arena_printf(weft_arena *arena, weft_error *err, const char *format, ...) WEFT_PRINTF(3, 4);

/** Frees everything that came from it. */
void weft_arena_fini(weft_arena *arena);

#endif
