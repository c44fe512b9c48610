/**
 * What lies in a library: sets, calibrations, maps, materials and pictures, with what can be said of each
 * without reading its pixels.
 *
 * The catalogue is a table of the library's database (library_db.h).  It knows nothing that the files do not
 * say, so it can be made again at any time; a file that cannot be read is an item with a problem, not an
 * error.
 */
#ifndef WEFT_HOST_LIBRARY_CATALOGUE_H
#define WEFT_HOST_LIBRARY_CATALOGUE_H

#include "core/progress.h"
#include "host/library/library_db.h"

#include <jansson.h>
#include <stdint.h>

/** @return "set", "calibration", "maps", "material", "picture" one after the other; NULL behind the last */
const char *weft_catalogue_kind(int i);

/** What was done by weft_catalogue_reindex(). */
typedef struct weft_catalogue_report {
    int n_items, n_read, n_removed, n_problems; /* read: new or changed */
} weft_catalogue_report;

/** Looks at every folder of the library (not at hidden ones, and not behind symbolic links).
 *  @param all  reads also what has not changed */
weft_err weft_catalogue_reindex(weft_library_db *db, bool all, weft_progress *progress,
                                weft_catalogue_report *report, weft_error *err);

/** Looks at one path, absolute or relative to the library: enters it, or takes it out when it is gone.
 *  *known says whether it is an item now.  Paths outside the library are none. */
weft_err weft_catalogue_index(weft_library_db *db, const char *path, bool *known, weft_error *err);

/** Hears of an item, by the path that was given or the path of what lies in it. */
typedef void weft_catalogue_found_fn(void *context, const char *path);

/** weft_catalogue_index() of what a program has made: of the path, or, where that is a folder without being
 *  an item itself (maps of many sets), of what lies in it. */
weft_err weft_catalogue_index_works(weft_library_db *db, const char *path, weft_catalogue_found_fn *found,
                                    void *context, weft_error *err);

/** What is asked for; NULL and 0 are "any". */
typedef struct weft_catalogue_query {
    const char *kind;
    const char *const *words; /* each must occur in path, name or info, whatever its case */
    int n_words;              /* at most 16 */
    int limit, offset;        /* limit 0: all */
} weft_catalogue_query;

/** The items as a list of {"path","kind","name","created","bytes","problem","info"}, newest first;
 *  json_decref() it. */
weft_err weft_catalogue_find(weft_library_db *db, const weft_catalogue_query *query, json_t **items,
                             weft_error *err);

/** One item by its path relative to the library.  @return WEFT_ERR_MISSING */
weft_err weft_catalogue_get(weft_library_db *db, const char *path, json_t **item, weft_error *err);

#endif
