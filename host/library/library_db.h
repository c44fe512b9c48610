/**
 * The database of a library: LIBRARY/.weft/library.db, SQLite in WAL mode.
 *
 * It holds the queue of jobs (job_store.h) and the catalogue (catalogue.h).  Several programs may have it
 * open; each waits up to five seconds for another's transaction.  A committed change of a job is on the disk
 * before the call returns.  A file that is damaged is set aside and a fresh one is begun: the catalogue is
 * made again from what lies in the library.
 *
 * One thread per handle.
 */
#ifndef WEFT_HOST_LIBRARY_LIBRARY_DB_H
#define WEFT_HOST_LIBRARY_LIBRARY_DB_H

#include "core/error.h"

#include <sqlite3.h>
#include <stdbool.h>
#include <stdint.h>

/** Beside it: the database, the lock of the daemon, its token. */
#define WEFT_LIBRARY_HIDDEN ".weft"

typedef struct weft_library_db {
    sqlite3 *sql;
    char *root;   /* absolute path of the library, without symbolic links */
    char *path;   /* of the database */
    bool renewed; /* a damaged one was set aside: the catalogue must be made again */
} weft_library_db;

/** Opens the database of the library `folder`, which must exist; creates it when it is not there yet.
 *  @return WEFT_ERR_MISSING without such a folder, WEFT_ERR_IO when it cannot be written (with the remedy),
 *          WEFT_ERR_VERSION for one of a newer Weft */
weft_err weft_library_db_open(const char *folder, weft_library_db **db, weft_error *err);
/** NULL is fine. */
void weft_library_db_close(weft_library_db *db);

/** Runs statements without results. */
weft_err weft_library_db_exec(weft_library_db *db, const char *sql, weft_error *err);

/**
 * Runs one statement with values for its question marks.
 *
 * @param types  a letter per value: 's' const char * (NULL is NULL), 'i' int64_t, 'd' double
 */
weft_err weft_library_db_run(weft_library_db *db, weft_error *err, const char *sql, const char *types, ...);

/** As weft_library_db_run() for a statement with rows: step through them with weft_library_db_next(). */
weft_err weft_library_db_query(weft_library_db *db, sqlite3_stmt **rows, weft_error *err, const char *sql,
                               const char *types, ...);

/** The next row; *more is false behind the last one or after a failure, and then `rows` is gone (NULL). */
weft_err weft_library_db_next(weft_library_db *db, sqlite3_stmt **rows, bool *more, weft_error *err);

/** Text of a column, "" for NULL; lives until the next row. */
const char *weft_library_db_text(sqlite3_stmt *rows, int column);

/** The only number that a query gives. */
weft_err weft_library_db_number(weft_library_db *db, int64_t *number, weft_error *err, const char *sql);

#endif
