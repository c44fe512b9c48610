#include "host/library/catalogue.h"

#include "core/file.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/text.h"
#include "host/library/catalogue_item.h"

#include <dirent.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { MAX_DEPTH = 16, MAX_WORDS = 16 };
/* Others (the daemon) wait while this one writes: so long, and then it is their turn. */
#define TRANSACTION_S 0.05

const char *weft_catalogue_kind(int i)
{
    static const char *const names[] = {"set", "calibration", "maps", "material", "picture"};
    return i >= 0 && i < 5 ? names[i] : NULL;
}

/* ---- entering ---- */

static weft_err store(weft_library_db *db, const char *relative, const weft_catalogue_item *item,
                      int64_t seen, weft_error *err)
{
    char *const info = json_dumps(item->info, JSON_COMPACT | JSON_REAL_PRECISION(9));
    const weft_err status =
        info ? weft_library_db_run(db, err, "INSERT OR REPLACE INTO items VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                                   "sssssissi", relative, item->kind, item->name, item->created, item->stamp,
                                   item->bytes, item->problem[0] ? item->problem : NULL, info, seen)
             : weft_fail(err, WEFT_ERR_NOMEM, "out of memory for %s", relative);
    free(info);
    return status;
}

/* The path below the library, NULL when it is not below. */
static const char *relative_of(const weft_library_db *db, const char *path)
{
    const size_t n = strlen(db->root);
    if (path[0] != '/')
        return path;
    return strncmp(path, db->root, n) == 0 && path[n] == '/' ? path + n + 1 : NULL;
}

weft_err weft_catalogue_index(weft_library_db *db, const char *path, bool *known, weft_error *err)
{
    weft_catalogue_item item;
    const char *const relative = relative_of(db, path);
    *known = false;
    if (!relative || !weft_text_is_utf8(relative, strlen(relative)))
        return WEFT_OK;
    char *const absolute = weft_path_join(db->root, relative, err);
    if (!absolute)
        return WEFT_ERR_NOMEM;
    const char *const kind = weft_catalogue_item_kind(absolute, weft_folder_exists(absolute));
    weft_err status = WEFT_ERR_MISSING;
    if (kind)
        status = weft_catalogue_item_read(absolute, kind, &item, err);
    weft_free(absolute);
    if (status == WEFT_ERR_MISSING)
        return weft_library_db_run(db, err, "DELETE FROM items WHERE path = ?", "s", relative);
    WEFT_TRY(status);
    status = store(db, relative, &item, -1, err);
    weft_catalogue_item_fini(&item);
    *known = status == WEFT_OK;
    return status;
}

weft_err weft_catalogue_index_works(weft_library_db *db, const char *path, weft_catalogue_found_fn *found,
                                    void *context, weft_error *err)
{
    bool known;
    const struct dirent *entry;
    weft_err status = weft_catalogue_index(db, path, &known, err);
    if (status == WEFT_OK && known)
        found(context, path);
    if (status != WEFT_OK || known || !relative_of(db, path))
        return status;
    DIR *const entries = opendir(path);
    while (entries && status == WEFT_OK && (entry = readdir(entries)) != NULL) {
        if (entry->d_name[0] == '.')
            continue;
        char *const inside = weft_path_join(path, entry->d_name, err);
        status = inside ? weft_catalogue_index(db, inside, &known, err) : WEFT_ERR_NOMEM;
        if (status == WEFT_OK && known)
            found(context, inside);
        weft_free(inside);
    }
    if (entries)
        closedir(entries);
    return status;
}

/* ---- going through all ---- */

typedef struct walk {
    weft_library_db *db;
    bool all;
    int64_t round; /* marks what is still there */
    bool writing;  /* in a transaction, since: */
    double since_s;
    weft_progress *progress;
    weft_catalogue_report *report;
} walk;

static weft_err begin_writing(walk *w, weft_error *err)
{
    if (w->writing)
        return WEFT_OK;
    WEFT_TRY(weft_library_db_exec(w->db, "BEGIN IMMEDIATE", err));
    w->writing = true;
    w->since_s = weft_clock_s();
    return WEFT_OK;
}

static weft_err end_writing(walk *w, weft_error *err)
{
    if (!w->writing)
        return WEFT_OK;
    w->writing = false;
    return weft_library_db_exec(w->db, "COMMIT", err);
}

/* Whether the catalogue has it as it is now; then it is only marked. */
static weft_err is_unchanged(walk *w, const char *relative, const char *kind, const char *stamp, bool *same,
                             weft_error *err)
{
    sqlite3_stmt *rows;
    WEFT_TRY(weft_library_db_query(w->db, &rows, err,
                                   "SELECT problem FROM items WHERE path = ? AND kind = ? AND stamp = ?",
                                   "sss", relative, kind, stamp));
    WEFT_TRY(weft_library_db_next(w->db, &rows, same, err));
    if (!*same)
        return WEFT_OK;
    w->report->n_problems += sqlite3_column_type(rows, 0) != SQLITE_NULL;
    sqlite3_finalize(rows);
    WEFT_TRY(begin_writing(w, err));
    return weft_library_db_run(w->db, err, "UPDATE items SET seen = ? WHERE path = ?", "is", w->round,
                               relative);
}

static weft_err enter(walk *w, const char *absolute, const char *relative, const char *kind, weft_error *err)
{
    weft_catalogue_item item;
    char stamp[64];
    bool same = false;
    if (!weft_catalogue_item_stamp(absolute, kind, stamp))
        return WEFT_OK; /* gone meanwhile */
    if (!w->all)
        WEFT_TRY(is_unchanged(w, relative, kind, stamp, &same, err));
    w->report->n_items++;
    if (!same) {
        const weft_err read = weft_catalogue_item_read(absolute, kind, &item, err);
        if (read == WEFT_ERR_MISSING)
            return WEFT_OK;
        WEFT_TRY(read);
        weft_err status = begin_writing(w, err);
        if (status == WEFT_OK)
            status = store(w->db, relative, &item, w->round, err);
        w->report->n_read++;
        w->report->n_problems += item.problem[0] != '\0';
        weft_catalogue_item_fini(&item);
        WEFT_TRY(status);
    }
    if (w->writing && weft_clock_s() - w->since_s > TRANSACTION_S)
        WEFT_TRY(end_writing(w, err));
    return weft_progress_step(w->progress, 1, err);
}

static weft_err walk_folder(walk *w, const char *folder, int depth, weft_error *err);

static weft_err look_at(walk *w, const char *folder, const char *name, int depth, weft_error *err)
{
    struct stat s;
    if (name[0] == '.' || !weft_text_is_utf8(name, strlen(name)))
        return WEFT_OK;
    char *const path = weft_path_join(folder, name, err);
    if (!path)
        return WEFT_ERR_NOMEM;
    weft_err status = WEFT_OK;
    if (lstat(path, &s) == 0 && (S_ISDIR(s.st_mode) || S_ISREG(s.st_mode))) {
        const char *const kind = weft_catalogue_item_kind(path, S_ISDIR(s.st_mode));
        if (kind)
            status = enter(w, path, path + strlen(w->db->root) + 1, kind, err);
        else if (S_ISDIR(s.st_mode) && depth < MAX_DEPTH)
            status = walk_folder(w, path, depth + 1, err);
    }
    weft_free(path);
    return status;
}

static weft_err walk_folder(walk *w, const char *folder, int depth, weft_error *err)
{
    DIR *const entries = opendir(folder);
    const struct dirent *entry;
    weft_err status = WEFT_OK;
    if (!entries) {
        weft_warn("%s: cannot be read and is left out", folder);
        return WEFT_OK;
    }
    while (status == WEFT_OK && (entry = readdir(entries)) != NULL)
        status = look_at(w, folder, entry->d_name, depth, err);
    closedir(entries);
    return status;
}

weft_err weft_catalogue_reindex(weft_library_db *db, bool all, weft_progress *progress,
                                weft_catalogue_report *report, weft_error *err)
{
    walk w = {.db = db, .all = all, .progress = progress, .report = report};
    int64_t before = 0, after = 0;
    *report = (weft_catalogue_report){0};
    weft_progress_begin(progress, "indexing", "items", 0);
    WEFT_TRY(weft_library_db_number(db, &w.round, err, "SELECT coalesce(max(seen), 0) + 1 FROM items"));
    /* What another program enters from here on was not there to be seen, and stays. */
    WEFT_TRY(weft_library_db_exec(db, "UPDATE items SET seen = 0 WHERE seen = -1", err));
    weft_err status = walk_folder(&w, db->root, 0, err);
    if (status == WEFT_OK)
        status = begin_writing(&w, err);
    if (status == WEFT_OK)
        status = weft_library_db_number(db, &before, err, "SELECT count(*) FROM items");
    if (status == WEFT_OK)
        status =
            weft_library_db_run(db, err, "DELETE FROM items WHERE seen <> ? AND seen <> -1", "i", w.round);
    if (status == WEFT_OK)
        status = weft_library_db_number(db, &after, err, "SELECT count(*) FROM items");
    const weft_err ended = end_writing(&w, status == WEFT_OK ? err : NULL); /* what was read stays read */
    status = status == WEFT_OK ? ended : status;
    if (status != WEFT_OK)
        sqlite3_exec(db->sql, "ROLLBACK", NULL, NULL, NULL);
    report->n_removed = (int)(before - after);
    weft_progress_end(progress);
    return status;
}

/* ---- asking ---- */

static json_t *item_to_json(sqlite3_stmt *rows)
{
    json_t *const info = json_loads(weft_library_db_text(rows, 6), 0, NULL);
    return json_pack("{s:s, s:s, s:s, s:s, s:I, s:o, s:o}", "path", weft_library_db_text(rows, 0), "kind",
                     weft_library_db_text(rows, 1), "name", weft_library_db_text(rows, 2), "created",
                     weft_library_db_text(rows, 3), "bytes", (json_int_t)sqlite3_column_int64(rows, 4),
                     "problem",
                     sqlite3_column_type(rows, 5) == SQLITE_NULL ? json_null()
                                                                 : json_string(weft_library_db_text(rows, 5)),
                     "info", info ? info : json_object());
}

#define COLUMNS "path, kind, name, created, bytes, problem, info"

/* Adds the words of the query to a statement: each is compared as it stands, without wildcards. */
static weft_err bind_words(weft_library_db *db, sqlite3_stmt *rows, const weft_catalogue_query *query,
                           weft_error *err)
{
    for (int i = 0; i < query->n_words; i++)
        if (sqlite3_bind_text(rows, 4 + i, query->words[i], -1, SQLITE_TRANSIENT) != SQLITE_OK)
            return weft_fail(err, WEFT_ERR_NOMEM, "%s: out of memory for a search", db->path);
    return WEFT_OK;
}

weft_err weft_catalogue_find(weft_library_db *db, const weft_catalogue_query *query, json_t **items,
                             weft_error *err)
{
    char sql[2048];
    sqlite3_stmt *rows;
    bool more = true;
    if (query->n_words > MAX_WORDS)
        return weft_fail(err, WEFT_ERR_USAGE, "more than %d words to search for", MAX_WORDS);
    int n = snprintf(sql, sizeof sql, "SELECT " COLUMNS " FROM items WHERE (?1 IS NULL OR kind = ?1)");
    for (int i = 0; i < query->n_words; i++)
        n += snprintf(sql + n, sizeof sql - (size_t)n,
                      " AND instr(lower(path || ' ' || name || ' ' || info), lower(?%d))", 4 + i);
    snprintf(sql + n, sizeof sql - (size_t)n, " ORDER BY created DESC, path LIMIT ?2 OFFSET ?3");
    WEFT_TRY(weft_library_db_query(db, &rows, err, sql, "sii", query->kind,
                                   (int64_t)(query->limit > 0 ? query->limit : -1), (int64_t)query->offset));
    weft_err status = bind_words(db, rows, query, err);
    json_t *const list = json_array();
    while (status == WEFT_OK && more) {
        status = weft_library_db_next(db, &rows, &more, err);
        if (status == WEFT_OK && more && json_array_append_new(list, item_to_json(rows)) != 0)
            status = weft_fail(err, WEFT_ERR_NOMEM, "out of memory for the items");
    }
    sqlite3_finalize(rows);
    if (status != WEFT_OK) {
        json_decref(list);
        return status;
    }
    *items = list;
    return WEFT_OK;
}

weft_err weft_catalogue_get(weft_library_db *db, const char *path, json_t **item, weft_error *err)
{
    sqlite3_stmt *rows;
    bool more;
    const char *const relative = relative_of(db, path);
    size_t n = relative ? strlen(relative) : 0;
    while (n > 0 && relative[n - 1] == '/')
        n--;
    char *const key = weft_asprintf(err, "%.*s", (int)n, relative ? relative : "");
    if (!key)
        return WEFT_ERR_NOMEM;
    weft_err status =
        weft_library_db_query(db, &rows, err, "SELECT " COLUMNS " FROM items WHERE path = ?", "s", key);
    weft_free(key);
    WEFT_TRY(status);
    WEFT_TRY(weft_library_db_next(db, &rows, &more, err));
    if (!more)
        return weft_fail(err, WEFT_ERR_MISSING,
                         "the library has no \"%s\"; \"weft library reindex\" looks again", path);
    *item = item_to_json(rows);
    sqlite3_finalize(rows);
    return *item ? WEFT_OK : weft_fail(err, WEFT_ERR_NOMEM, "out of memory for the item");
}
