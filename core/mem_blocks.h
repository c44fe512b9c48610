/** The large blocks of mem.c under a limit (mem_limit.h): for mem.c alone. */
#ifndef WEFT_CORE_MEM_BLOCKS_H
#define WEFT_CORE_MEM_BLOCKS_H

#include "core/error.h"

#include <stdbool.h>
#include <stddef.h>

/** Where a block of `bytes` is to be. */
typedef enum weft_mem_place { WEFT_MEM_UNTRACKED, WEFT_MEM_HEAP, WEFT_MEM_FILE } weft_mem_place;

/** Decides; WEFT_MEM_HEAP has been counted already. */
weft_mem_place weft_mem_choose_place(size_t bytes);

/** Notes a counted block, or takes the counting back when `block` is NULL. */
void weft_mem_note_heap(void *block, size_t bytes);

/** A zeroed block in a file; NULL with `err` filled. */
void *weft_mem_file_alloc(size_t bytes, weft_error *err);

/** Forgets a block.  @return true when it was in a file, and is gone; false: it is the heap's */
bool weft_mem_forget(void *block);

/** The size of a known block, 0 of others. */
size_t weft_mem_known_bytes(const void *block);

#endif
