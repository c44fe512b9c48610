/** Tables of numbers that take a while to compute, kept in the user's cache folder. */
#ifndef WEFT_SHADING_LIGHTING_TABLE_CACHE_H
#define WEFT_SHADING_LIGHTING_TABLE_CACHE_H

#include <stddef.h>

/**
 * Fills `table` from $XDG_CACHE_HOME/weft, else ~/.cache/weft, or by `compute`, whose result is kept there.
 *
 * @param key   says all that the numbers depend on; the file's name is its SHA-256.  The file ends with the
 *              SHA-256 of the numbers, and one that does not fit is computed anew.
 * @param what  passed to `compute`
 * A folder that cannot be written costs the computation each time, nothing else.
 */
void weft_table_cached(const char *key, void *table, size_t bytes, void (*compute)(void *table, int what),
                       int what);

#endif
