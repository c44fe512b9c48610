/**
 * Reading zip archives of the narrow kind that U3MA 1.1 is (zip_file.h writes them), from anybody.
 *
 * An archive is believed only where everything in it agrees: entries follow each other without gap or
 * overlap from the first byte, the directory repeats every local header, names are relative and unique, and
 * nothing unpacks to more than it says.  What other writers add without harm (file attributes, extra fields,
 * names not marked as UTF-8) is a remark, not a refusal: U3MA lets readers accept such legacy archives.
 */
#ifndef WEFT_CORE_FORMATS_ZIP_READ_H
#define WEFT_CORE_FORMATS_ZIP_READ_H

#include "core/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct weft_zip weft_zip;

/**
 * Reads an archive's directory and checks it; contents are unpacked and checked one by one later.
 *
 * @param limit  bytes that all entries together may unpack to, and that the file may have
 * @return WEFT_ERR_FORMAT naming the file, the entry and what is wrong: no zip, cut short, zip64, encrypted,
 *         split, with a comment or bytes before or behind, overlapping, two entries of one name, a name that
 *         leads out of its folder ("../x", "/x", "C:x", "a\b"); WEFT_ERR_RANGE beyond `limit`, or when more
 * is promised than deflate can pack (a zip bomb); WEFT_ERR_IO; WEFT_ERR_NOMEM
 */
weft_err weft_zip_open(const char *path, uint64_t limit, weft_zip **zip, weft_error *err);
void weft_zip_close(weft_zip *zip);

int weft_zip_count(const weft_zip *zip);
/** The name of an entry; it ends with '/' for a folder. */
const char *weft_zip_name(const weft_zip *zip, int index);
/** The entry of a name, or -1. */
int weft_zip_find(const weft_zip *zip, const char *name);
/** The first thing that a strict archive would not have, as a sentence; NULL: it is strict. */
const char *weft_zip_remark(const weft_zip *zip);

/** Unpacks an entry and checks its length and CRC; adds a NUL behind; free with weft_free(). */
weft_err weft_zip_unpack(const weft_zip *zip, int index, char **bytes, size_t *n, weft_error *err);

/** Whether a name is relative, stays in its folder and can be one on every system: parts between '/' that are
 * neither empty nor "." nor ".." nor hold control characters or any of <>:"\|?*; valid UTF-8. */
bool weft_zip_name_is_safe(const char *name);

#endif
