/** One thing of a library, described from its files. */
#ifndef WEFT_HOST_LIBRARY_CATALOGUE_ITEM_H
#define WEFT_HOST_LIBRARY_CATALOGUE_ITEM_H

#include "core/error.h"

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

typedef struct weft_catalogue_item {
    const char *kind; /* as weft_catalogue_kind() names it */
    char name[256];
    char created[32];
    char stamp[64];    /* changes when the file that says what it is does */
    int64_t bytes;     /* of the folder's own files, or the picture */
    char problem[512]; /* why it cannot be read; empty */
    json_t *info;
} weft_catalogue_item;

/** What kind of thing lies at `path`; NULL when it is none (then a folder may hold some). */
const char *weft_catalogue_item_kind(const char *path, bool is_folder);

/** Kind and stamp alone: enough to see that nothing has changed.  False when it is gone. */
bool weft_catalogue_item_stamp(const char *path, const char *kind, char stamp[64]);

/** Describes it; weft_catalogue_item_fini() it. */
weft_err weft_catalogue_item_read(const char *path, const char *kind, weft_catalogue_item *item,
                                  weft_error *err);
void weft_catalogue_item_fini(weft_catalogue_item *item);

#endif
