#include "host/library/library_db.h"

#include "core/file.h"
#include "core/log.h"
#include "core/mem.h"

#include <errno.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define SCHEMA_VERSION  1
#define BUSY_TIMEOUT_MS 5000

/* Times are text (docs/conventions.md).  Of an item `stamp` says whether its file has changed. */
static const char schema[] =
    "CREATE TABLE meta (key TEXT PRIMARY KEY, value INTEGER NOT NULL);"
    "CREATE TABLE jobs ("
    " id INTEGER PRIMARY KEY AUTOINCREMENT, command TEXT NOT NULL, request TEXT NOT NULL, words TEXT NOT "
    "NULL,"
    " reads TEXT NOT NULL, writes TEXT NOT NULL, class TEXT NOT NULL, owner TEXT NOT NULL, state TEXT NOT "
    "NULL,"
    " created TEXT NOT NULL, started TEXT, finished TEXT, attempt INTEGER NOT NULL DEFAULT 0,"
    " fresh INTEGER NOT NULL DEFAULT 0, pid INTEGER NOT NULL DEFAULT 0, pid_start INTEGER NOT NULL DEFAULT 0,"
    " exit_status INTEGER, error TEXT, result TEXT);"
    "CREATE INDEX jobs_by_state ON jobs (state, id);"
    "CREATE TABLE log (job INTEGER NOT NULL REFERENCES jobs (id) ON DELETE CASCADE, line INTEGER NOT NULL,"
    " time TEXT NOT NULL, stream TEXT NOT NULL, text TEXT NOT NULL, PRIMARY KEY (job, line)) WITHOUT ROWID;"
    "CREATE TABLE items ("
    " path TEXT PRIMARY KEY, kind TEXT NOT NULL, name TEXT NOT NULL, created TEXT NOT NULL, stamp TEXT NOT "
    "NULL,"
    " bytes INTEGER NOT NULL, problem TEXT, info TEXT NOT NULL, seen INTEGER NOT NULL);"
    "CREATE INDEX items_by_kind ON items (kind, created);";

static weft_err sql_failed(const weft_library_db *db, weft_error *err)
{
    const int code = sqlite3_errcode(db->sql);
    const char *const remedy = code == SQLITE_FULL ? "; make room on the disk"
                               : code == SQLITE_READONLY || code == SQLITE_CANTOPEN
                                   ? "; let this user write the library's folder .weft"
                               : code == SQLITE_BUSY ? "; another program keeps it busy, try again"
                                                     : "";
    return weft_fail(err, code == SQLITE_NOMEM ? WEFT_ERR_NOMEM : WEFT_ERR_IO, "%s: %s%s", db->path,
                     sqlite3_errmsg(db->sql), remedy);
}

weft_err weft_library_db_exec(weft_library_db *db, const char *sql, weft_error *err)
{
    return sqlite3_exec(db->sql, sql, NULL, NULL, NULL) == SQLITE_OK ? WEFT_OK : sql_failed(db, err);
}

static int bind_values(sqlite3_stmt *statement, const char *types, va_list values)
{
    int code = SQLITE_OK;
    for (int i = 0; types[i] && code == SQLITE_OK; i++) {
        const char *text;
        switch (types[i]) {
        case 's':
            text = va_arg(values, const char *);
            code = sqlite3_bind_text(statement, i + 1, text, -1, SQLITE_TRANSIENT);
            break;
        case 'i':
            code = sqlite3_bind_int64(statement, i + 1, va_arg(values, int64_t));
            break;
        default:
            code = sqlite3_bind_double(statement, i + 1, va_arg(values, double));
        }
    }
    return code;
}

static weft_err prepare(weft_library_db *db, sqlite3_stmt **statement, weft_error *err, const char *sql,
                        const char *types, va_list values)
{
    *statement = NULL;
    if (sqlite3_prepare_v2(db->sql, sql, -1, statement, NULL) != SQLITE_OK ||
        bind_values(*statement, types, values) != SQLITE_OK) {
        const weft_err status = sql_failed(db, err);
        sqlite3_finalize(*statement);
        *statement = NULL;
        return status;
    }
    return WEFT_OK;
}

weft_err weft_library_db_query(weft_library_db *db, sqlite3_stmt **rows, weft_error *err, const char *sql,
                               const char *types, ...)
{
    va_list values;
    va_start(values, types);
    const weft_err status = prepare(db, rows, err, sql, types, values);
    va_end(values);
    return status;
}

weft_err weft_library_db_next(weft_library_db *db, sqlite3_stmt **rows, bool *more, weft_error *err)
{
    const int code = sqlite3_step(*rows);
    weft_err status = WEFT_OK;
    *more = code == SQLITE_ROW;
    if (code == SQLITE_ROW)
        return WEFT_OK;
    if (code != SQLITE_DONE)
        status = sql_failed(db, err);
    sqlite3_finalize(*rows);
    *rows = NULL;
    return status;
}

weft_err weft_library_db_run(weft_library_db *db, weft_error *err, const char *sql, const char *types, ...)
{
    sqlite3_stmt *statement;
    bool more;
    va_list values;
    va_start(values, types);
    weft_err status = prepare(db, &statement, err, sql, types, values);
    va_end(values);
    while (status == WEFT_OK && statement)
        status = weft_library_db_next(db, &statement, &more, err);
    return status;
}

const char *weft_library_db_text(sqlite3_stmt *rows, int column)
{
    const unsigned char *const text = sqlite3_column_text(rows, column);
    return text ? (const char *)text : "";
}

weft_err weft_library_db_number(weft_library_db *db, int64_t *number, weft_error *err, const char *sql)
{
    sqlite3_stmt *rows;
    bool more;
    WEFT_TRY(weft_library_db_query(db, &rows, err, sql, ""));
    WEFT_TRY(weft_library_db_next(db, &rows, &more, err));
    *number = more ? sqlite3_column_int64(rows, 0) : 0;
    sqlite3_finalize(rows);
    return WEFT_OK;
}

/* ---- opening ---- */

static weft_err create_schema(weft_library_db *db, weft_error *err)
{
    int64_t version = 0;
    char text[64];
    WEFT_TRY(weft_library_db_exec(db, "BEGIN IMMEDIATE", err)); /* two programs may be the first at once */
    weft_err status = weft_library_db_number(db, &version, err, "PRAGMA user_version");
    if (status == WEFT_OK && version == 0) {
        status = weft_library_db_exec(db, schema, err);
        snprintf(text, sizeof text, "PRAGMA user_version = %d", SCHEMA_VERSION);
        if (status == WEFT_OK)
            status = weft_library_db_exec(db, text, err);
    } else if (status == WEFT_OK && version > SCHEMA_VERSION) {
        status = weft_fail(err, WEFT_ERR_VERSION,
                           "%s: version %d is newer than this program knows (%d); update Weft", db->path,
                           (int)version, SCHEMA_VERSION);
    }
    if (status != WEFT_OK) {
        sqlite3_exec(db->sql, "ROLLBACK", NULL, NULL, NULL);
        return status;
    }
    return weft_library_db_exec(db, "COMMIT", err);
}

static bool is_damaged(sqlite3 *sql)
{
    const int code = sqlite3_errcode(sql);
    return code == SQLITE_CORRUPT || code == SQLITE_NOTADB;
}

/* Reads every page; *damaged when the file is no sound database. */
static weft_err check_sound(weft_library_db *db, bool *damaged, weft_error *err)
{
    sqlite3_stmt *rows;
    bool more = false;
    weft_err status = weft_library_db_query(db, &rows, err, "PRAGMA quick_check(1)", "");
    if (status == WEFT_OK)
        status = weft_library_db_next(db, &rows, &more, err);
    *damaged = is_damaged(db->sql);
    if (status != WEFT_OK)
        return *damaged ? WEFT_OK : status;
    *damaged = more && strcmp(weft_library_db_text(rows, 0), "ok") != 0;
    sqlite3_finalize(rows);
    return WEFT_OK;
}

static weft_err open_file(weft_library_db *db, weft_error *err)
{
    if (sqlite3_open_v2(db->path, &db->sql, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, NULL) != SQLITE_OK)
        return sql_failed(db, err);
    sqlite3_busy_timeout(db->sql, BUSY_TIMEOUT_MS);
    return WEFT_OK;
}

static weft_err configure(weft_library_db *db, weft_error *err)
{
    WEFT_TRY(weft_library_db_exec(
        db, "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON", err));
    return create_schema(db, err);
}

/* A damaged database goes out of the way under a name that says so, with its journal. */
static weft_err set_aside(weft_library_db *db, weft_error *err)
{
    static const char *const parts[] = {"", "-wal", "-shm"};
    char now[32];
    weft_time_now_iso(now);
    sqlite3_close(db->sql);
    db->sql = NULL;
    for (int i = 0; i < 3; i++) {
        char *const from = weft_asprintf(err, "%s%s", db->path, parts[i]);
        char *const to = weft_asprintf(err, "%s.damaged-%s%s", db->path, now, parts[i]);
        const bool failed = from && to && rename(from, to) != 0 && errno != ENOENT;
        weft_free(from);
        weft_free(to);
        if (failed)
            return weft_fail_errno(err, WEFT_ERR_IO, "%s: is damaged and cannot be set aside", db->path);
    }
    weft_warn(
        "%s: was damaged and is now %s.damaged-%s; the catalogue is made again, the queue of jobs is lost",
        db->path, weft_path_name(db->path), now);
    db->renewed = true;
    return open_file(db, err);
}

static weft_err open_in(weft_library_db *db, const char *folder, weft_error *err)
{
    char resolved[PATH_MAX];
    bool damaged = false;
    if (!realpath(folder, resolved) || !weft_folder_exists(resolved))
        return weft_fail(err, WEFT_ERR_MISSING,
                         "%s: there is no such folder; make it, it will be the library", folder);
    db->root = weft_strdup(resolved, err);
    char *const hidden = db->root ? weft_path_join(db->root, WEFT_LIBRARY_HIDDEN, err) : NULL;
    db->path = hidden ? weft_path_join(hidden, "library.db", err) : NULL;
    weft_err status = db->path ? WEFT_OK : WEFT_ERR_NOMEM;
    if (status == WEFT_OK && mkdir(hidden, 0770) != 0 && errno != EEXIST)
        status =
            weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be made; let this user write the library", hidden);
    weft_free(hidden);
    if (status == WEFT_OK)
        status = open_file(db, err);
    if (status == WEFT_OK)
        status = check_sound(db, &damaged, err);
    if (status == WEFT_OK && damaged)
        status = set_aside(db, err);
    return status == WEFT_OK ? configure(db, err) : status;
}

weft_err weft_library_db_open(const char *folder, weft_library_db **db, weft_error *err)
{
    weft_library_db *const new = weft_alloc(1, sizeof *new, err);
    if (!new)
        return WEFT_ERR_NOMEM;
    const weft_err status = open_in(new, folder, err);
    if (status != WEFT_OK) {
        weft_library_db_close(new);
        return status;
    }
    *db = new;
    return WEFT_OK;
}

void weft_library_db_close(weft_library_db *db)
{
    if (!db)
        return;
    sqlite3_close(db->sql);
    weft_free(db->root);
    weft_free(db->path);
    weft_free(db);
}
