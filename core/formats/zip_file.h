/**
 * Zip archives of the narrow kind that U3MA 1.1 is: no zip64, no encryption, no data descriptors, no extra
 * fields, comments or attributes, names in UTF-8, stored or deflated, times in UTC, nothing before or behind.
 */
#ifndef WEFT_CORE_FORMATS_ZIP_FILE_H
#define WEFT_CORE_FORMATS_ZIP_FILE_H

#include "core/error.h"

#include <stddef.h>
#include <time.h>

/** A file to put in; the bytes are borrowed. */
typedef struct weft_zip_entry {
    const char *name; /* relative, with '/', no ".." */
    const void *bytes;
    size_t n;
} weft_zip_entry;

/**
 * Writes an archive, whole or not at all.
 * @param when  of all entries (1980 to 2107)
 * @return WEFT_ERR_RANGE for more than 65535 entries or 4 GiB; WEFT_ERR_IO, WEFT_ERR_NOMEM
 */
weft_err weft_zip_write(const char *path, const weft_zip_entry *entries, int n_entries, time_t when,
                        weft_error *err);

#endif
