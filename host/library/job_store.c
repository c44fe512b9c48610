#include "host/library/job_store.h"

#include "core/file.h"
#include "core/mem.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const state_names[] = {"queued", "running", "done", "failed", "cancelled"};

const char *weft_job_state_name(weft_job_state state)
{
    return state_names[state];
}

bool weft_job_state_from_name(const char *name, weft_job_state *state)
{
    for (int i = 0; i <= WEFT_JOB_CANCELLED; i++)
        if (strcmp(state_names[i], name) == 0) {
            *state = (weft_job_state)i;
            return true;
        }
    return false;
}

void weft_job_fini(weft_job *job)
{
    weft_free(job->command);
    weft_free(job->owner);
    weft_free(job->error);
    json_decref(job->request);
    json_decref(job->words);
    json_decref(job->reads);
    json_decref(job->writes);
    json_decref(job->result);
    *job = (weft_job){0};
}

/* A JSON value as text, NULL for none; free(). */
static char *to_text(const json_t *value)
{
    return value ? json_dumps(value, JSON_COMPACT | JSON_ENCODE_ANY | JSON_REAL_PRECISION(17)) : NULL;
}

weft_err weft_job_store_add(weft_library_db *db, weft_job *job, weft_error *err)
{
    char *const request = to_text(job->request), *const words = to_text(job->words);
    char *const reads = to_text(job->reads), *const writes = to_text(job->writes);
    weft_err status = WEFT_OK;
    weft_time_now_iso(job->created);
    if (!request || !words || !reads || !writes)
        status = weft_fail(err, WEFT_ERR_NOMEM, "out of memory for the job");
    else
        status = weft_library_db_run(
            db, err,
            "INSERT INTO jobs (command, request, words, reads, writes, class, owner, state, "
            "created) VALUES (?, ?, ?, ?, ?, ?, ?, 'queued', ?)",
            "ssssssss", job->command, request, words, reads, writes, job->hardware ? "hardware" : "cpu",
            job->owner, job->created);
    free(request);
    free(words);
    free(reads);
    free(writes);
    WEFT_TRY(status);
    job->id = sqlite3_last_insert_rowid(db->sql);
    job->state = WEFT_JOB_QUEUED;
    job->exit_status = -1;
    return WEFT_OK;
}

#define COLUMNS                                                                                              \
    "id, command, request, words, reads, writes, class, owner, state, created, started, finished, attempt, " \
    "fresh, pid, pid_start, exit_status, error, result"

static json_t *json_of(sqlite3_stmt *rows, int column)
{
    return json_loads(weft_library_db_text(rows, column), JSON_DECODE_ANY, NULL);
}

static weft_err read_row(sqlite3_stmt *rows, weft_job *job, weft_error *err)
{
    *job = (weft_job){
        .id = sqlite3_column_int64(rows, 0),
        .command = weft_strdup(weft_library_db_text(rows, 1), err),
        .request = json_of(rows, 2),
        .words = json_of(rows, 3),
        .reads = json_of(rows, 4),
        .writes = json_of(rows, 5),
        .hardware = strcmp(weft_library_db_text(rows, 6), "hardware") == 0,
        .owner = weft_strdup(weft_library_db_text(rows, 7), err),
        .attempt = sqlite3_column_int(rows, 12),
        .fresh = sqlite3_column_int(rows, 13) != 0,
        .pid = sqlite3_column_int64(rows, 14),
        .pid_start = sqlite3_column_int64(rows, 15),
        .exit_status = sqlite3_column_type(rows, 16) == SQLITE_NULL ? -1 : sqlite3_column_int(rows, 16),
        .error = sqlite3_column_type(rows, 17) == SQLITE_NULL
                     ? NULL
                     : weft_strdup(weft_library_db_text(rows, 17), err),
        .result = sqlite3_column_type(rows, 18) == SQLITE_NULL ? NULL : json_of(rows, 18),
    };
    snprintf(job->created, sizeof job->created, "%s", weft_library_db_text(rows, 9));
    snprintf(job->started, sizeof job->started, "%s", weft_library_db_text(rows, 10));
    snprintf(job->finished, sizeof job->finished, "%s", weft_library_db_text(rows, 11));
    if (!job->command || !job->owner || !json_is_object(job->request) || !json_is_array(job->words) ||
        !json_is_array(job->reads) || !json_is_array(job->writes) ||
        !weft_job_state_from_name(weft_library_db_text(rows, 8), &job->state)) {
        const int64_t id = job->id;
        weft_job_fini(job);
        return weft_fail(err, WEFT_ERR_FORMAT, "job %" PRId64 " is damaged in the database", id);
    }
    return WEFT_OK;
}

weft_err weft_job_store_get(weft_library_db *db, int64_t id, weft_job *job, weft_error *err)
{
    sqlite3_stmt *rows;
    bool more;
    WEFT_TRY(weft_library_db_query(db, &rows, err, "SELECT " COLUMNS " FROM jobs WHERE id = ?", "i", id));
    WEFT_TRY(weft_library_db_next(db, &rows, &more, err));
    if (!more)
        return weft_fail(err, WEFT_ERR_MISSING, "there is no job %" PRId64, id);
    const weft_err status = read_row(rows, job, err);
    sqlite3_finalize(rows);
    return status;
}

typedef weft_err visit_fn(void *context, weft_job *job, weft_error *err);

static weft_err visit_rows(weft_library_db *db, sqlite3_stmt *rows, visit_fn *visit, void *context,
                           weft_error *err)
{
    for (;;) {
        weft_job job;
        bool more;
        WEFT_TRY(weft_library_db_next(db, &rows, &more, err));
        if (!more)
            return WEFT_OK;
        weft_err status = read_row(rows, &job, err);
        if (status == WEFT_OK) {
            status = visit(context, &job, err);
            weft_job_fini(&job);
        }
        if (status != WEFT_OK) {
            sqlite3_finalize(rows);
            return status;
        }
    }
}

weft_err weft_job_store_visit(weft_library_db *db, const weft_job_state *state, int64_t before, int limit,
                              visit_fn *visit, void *context, weft_error *err)
{
    sqlite3_stmt *rows;
    WEFT_TRY(weft_library_db_query(db, &rows, err,
                                   "SELECT " COLUMNS " FROM jobs WHERE (?1 IS NULL OR state = ?1) AND "
                                   "(?2 = 0 OR id < ?2) ORDER BY id DESC LIMIT ?3",
                                   "sii", state ? state_names[*state] : NULL, before, (int64_t)limit));
    return visit_rows(db, rows, visit, context, err);
}

weft_err weft_job_store_visit_queued(weft_library_db *db, int limit, visit_fn *visit, void *context,
                                     weft_error *err)
{
    sqlite3_stmt *rows;
    WEFT_TRY(weft_library_db_query(db, &rows, err,
                                   "SELECT " COLUMNS " FROM jobs WHERE state = 'queued' ORDER BY id LIMIT ?",
                                   "i", (int64_t)limit));
    return visit_rows(db, rows, visit, context, err);
}

weft_err weft_job_store_started(weft_library_db *db, int64_t id, int64_t pid, int64_t pid_start, bool fresh,
                                weft_error *err)
{
    char now[32];
    weft_time_now_iso(now);
    return weft_library_db_run(db, err,
                               "UPDATE jobs SET state = 'running', started = ?, finished = NULL, "
                               "fresh = CASE attempt WHEN 0 THEN ? ELSE fresh END, attempt = attempt + 1, "
                               "pid = ?, pid_start = ?, exit_status = NULL, error = NULL, result = NULL "
                               "WHERE id = ?",
                               "siiii", now, (int64_t)fresh, pid, pid_start, id);
}

weft_err weft_job_store_finished(weft_library_db *db, int64_t id, weft_job_state state, int exit_status,
                                 const char *error, const json_t *result, weft_error *err)
{
    char now[32];
    char *const text = to_text(result);
    weft_time_now_iso(now);
    const weft_err status = weft_library_db_run(
        db, err,
        "UPDATE jobs SET state = ?, finished = ?, pid = 0, pid_start = 0, "
        "exit_status = CASE WHEN ?3 < 0 THEN NULL ELSE ?3 END, error = ?, result = ? WHERE id = ?",
        "ssissi", state_names[state], now, (int64_t)exit_status, error, text, id);
    free(text);
    return status;
}

weft_err weft_job_store_requeue(weft_library_db *db, int64_t id, weft_error *err)
{
    return weft_library_db_run(db, err,
                               "UPDATE jobs SET state = 'queued', finished = NULL, pid = 0, pid_start = 0, "
                               "exit_status = NULL, error = NULL, result = NULL WHERE id = ?",
                               "i", id);
}

weft_err weft_job_store_remove(weft_library_db *db, int64_t id, weft_error *err)
{
    return weft_library_db_run(
        db, err, "DELETE FROM jobs WHERE id = ? AND state NOT IN ('queued', 'running')", "i", id);
}

weft_err weft_job_store_trim(weft_library_db *db, int keep, weft_error *err)
{
    return weft_library_db_run(
        db, err,
        "DELETE FROM jobs WHERE id IN (SELECT id FROM jobs WHERE state NOT IN ('queued', "
        "'running') ORDER BY id DESC LIMIT -1 OFFSET ?)",
        "i", (int64_t)keep);
}

weft_err weft_job_store_log(weft_library_db *db, int64_t id, int line, const char *stream, const char *text,
                            weft_error *err)
{
    char now[32];
    weft_time_now_iso(now);
    return weft_library_db_run(db, err, "INSERT INTO log VALUES (?, ?, ?, ?, ?)", "iisss", id, (int64_t)line,
                               now, stream, text);
}

weft_err weft_job_store_read_log(weft_library_db *db, int64_t id, int from, int limit, json_t **lines,
                                 weft_error *err)
{
    sqlite3_stmt *rows;
    bool more;
    json_t *const list = json_array();
    weft_err status = weft_library_db_query(
        db, &rows, err,
        "SELECT line, time, stream, text FROM log WHERE job = ? AND line >= ? ORDER BY line LIMIT ?", "iii",
        id, (int64_t)from, (int64_t)limit);
    while (status == WEFT_OK) {
        status = weft_library_db_next(db, &rows, &more, err);
        if (status != WEFT_OK || !more)
            break;
        json_array_append_new(list, json_pack("{s:i, s:s, s:s, s:s}", "line", sqlite3_column_int(rows, 0),
                                              "time", weft_library_db_text(rows, 1), "stream",
                                              weft_library_db_text(rows, 2), "text",
                                              weft_library_db_text(rows, 3)));
    }
    if (status != WEFT_OK) {
        json_decref(list);
        return status;
    }
    *lines = list;
    return WEFT_OK;
}

weft_err weft_job_store_log_end(weft_library_db *db, int64_t id, int *line, weft_error *err)
{
    sqlite3_stmt *rows;
    bool more;
    WEFT_TRY(weft_library_db_query(db, &rows, err, "SELECT coalesce(max(line) + 1, 0) FROM log WHERE job = ?",
                                   "i", id));
    WEFT_TRY(weft_library_db_next(db, &rows, &more, err));
    *line = more ? sqlite3_column_int(rows, 0) : 0;
    sqlite3_finalize(rows);
    return WEFT_OK;
}
