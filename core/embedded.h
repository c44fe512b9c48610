/** Files that were compiled into the program by cmake/embed.cmake. */
#ifndef WEFT_CORE_EMBEDDED_H
#define WEFT_CORE_EMBEDDED_H

#include <stddef.h>
#include <string.h>

/** One file.  A table of them ends with an entry whose name is NULL. */
typedef struct weft_embedded {
    const char *name;           /* the file's own name, without folder */
    const unsigned char *bytes; /* `size` bytes and a NUL behind them */
    size_t size;
} weft_embedded;

/** The file of a name, or NULL. */
static inline const weft_embedded *weft_embedded_find(const weft_embedded *table, const char *name)
{
    for (; table->name; table++)
        if (strcmp(table->name, name) == 0)
            return table;
    return NULL;
}

#endif
