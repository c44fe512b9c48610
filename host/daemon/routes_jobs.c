/* Jobs and their events. */
#include "host/client/job_kinds.h"
#include "host/daemon/http_watch.h"

#include "core/mem.h"
#include "core/text.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

enum { LIST_LIMIT = 100, LOG_LIMIT = 2000 };

typedef struct job_list {
    const weft_queue *queue;
    json_t *jobs;
} job_list;

static weft_err add_to_list(void *context, weft_job *job, weft_error *err)
{
    job_list *const list = context;
    json_t *const described = weft_queue_describe(list->queue, job);
    return json_array_append_new(list->jobs, described) == 0
               ? WEFT_OK
               : weft_fail(err, WEFT_ERR_NOMEM, "out of memory for jobs");
}

enum MHD_Result weft_route_jobs_list(weft_http_request *r)
{
    enum MHD_Result result = MHD_NO;
    weft_error error = {0};
    weft_job_state state = WEFT_JOB_QUEUED;
    int limit = LIST_LIMIT, before = 0;
    bool by_state;
    char *const name = weft_http_query(r, "state", &by_state);
    const bool known = !by_state || (name && weft_job_state_from_name(name, &state));
    weft_free(name);
    if (!known)
        return weft_reply_problem(r, 400, "bad_query",
                                  "state: wanted queued, running, done, failed or cancelled");
    if (!weft_http_query_int(r, "limit", 1, 1000, &limit, &result) ||
        !weft_http_query_int(r, "before", 1, INT32_MAX, &before, &result))
        return result;
    job_list list = {.queue = r->server->house.queue, .jobs = json_array()};
    const weft_err status = weft_job_store_visit(r->server->house.db, by_state ? &state : NULL, before, limit,
                                                 add_to_list, &list, &error);
    if (status != WEFT_OK) {
        json_decref(list.jobs);
        return weft_reply_error(r, status, &error);
    }
    return weft_reply_json(r, 200, json_pack("{s:o}", "jobs", list.jobs));
}

static enum MHD_Result reply_job(weft_http_request *r, unsigned status, int64_t id)
{
    weft_error error = {0};
    weft_job job;
    const weft_err got = weft_job_store_get(r->server->house.db, id, &job, &error);
    if (got != WEFT_OK)
        return weft_reply_error(r, got, &error);
    json_t *const value = weft_queue_describe(r->server->house.queue, &job);
    weft_job_fini(&job);
    return weft_reply_json(r, status, value);
}

enum MHD_Result weft_route_job_get(weft_http_request *r)
{
    return reply_job(r, 200, r->id);
}

enum MHD_Result weft_route_jobs_add(weft_http_request *r)
{
    const weft_http_house *const house = &r->server->house;
    const weft_job_rights rights = {.root = house->db->root,
                                    .own_user = r->connection->own_user,
                                    .rig = house->rig,
                                    .port = house->port,
                                    .camera = house->camera,
                                    .owner = r->connection->owner};
    weft_error error = {0};
    weft_job job = {0};
    weft_err status = weft_job_request_parse(r->body ? r->body : "", r->n_body, &rights, &job, &error);
    if (status == WEFT_OK)
        status = weft_queue_add(house->queue, &job, weft_job_request_holds(job.request), &error);
    const int64_t id = job.id;
    weft_job_fini(&job);
    return status == WEFT_OK ? reply_job(r, 201, id) : weft_reply_error(r, status, &error);
}

enum MHD_Result weft_route_job_remove(weft_http_request *r)
{
    weft_error error = {0};
    weft_job job;
    weft_err status = weft_job_store_get(r->server->house.db, r->id, &job, &error);
    if (status != WEFT_OK)
        return weft_reply_error(r, status, &error);
    const bool ended = job.state != WEFT_JOB_QUEUED && job.state != WEFT_JOB_RUNNING;
    weft_job_fini(&job);
    if (!ended)
        return weft_reply_problem(r, 409, "conflict", "job %" PRId64 " has not ended; cancel it first",
                                  r->id);
    status = weft_job_store_remove(r->server->house.db, r->id, &error);
    return status == WEFT_OK ? weft_reply_json(r, 200, json_pack("{s:I}", "removed", (json_int_t)r->id))
                             : weft_reply_error(r, status, &error);
}

enum MHD_Result weft_route_job_log(weft_http_request *r)
{
    enum MHD_Result result = MHD_NO;
    weft_error error = {0};
    weft_job job;
    json_t *lines = NULL;
    int from = 0;
    if (!weft_http_query_int(r, "from", 0, INT32_MAX, &from, &result))
        return result;
    weft_err status = weft_job_store_get(r->server->house.db, r->id, &job, &error);
    if (status == WEFT_OK) {
        weft_job_fini(&job);
        status = weft_job_store_read_log(r->server->house.db, r->id, from, LOG_LIMIT, &lines, &error);
    }
    return status == WEFT_OK ? weft_reply_json(r, 200, json_pack("{s:o}", "lines", lines))
                             : weft_reply_error(r, status, &error);
}

enum MHD_Result weft_route_job_cancel(weft_http_request *r)
{
    weft_error error = {0};
    const weft_err status = weft_queue_cancel(r->server->house.queue, r->id, &error);
    return status == WEFT_OK ? reply_job(r, 202, r->id) : weft_reply_error(r, status, &error);
}

enum MHD_Result weft_route_job_resume(weft_http_request *r)
{
    weft_error error = {0};
    const weft_err status = weft_queue_resume(r->server->house.queue, r->id, &error);
    return status == WEFT_OK ? reply_job(r, 202, r->id) : weft_reply_error(r, status, &error);
}

/* ---- events ---- */

/* Puts an event behind the text; false without memory. */
static bool append(weft_http_request *r, char **text, const char *type, json_t *data)
{
    weft_events *const events = r->server->house.events;
    char *const event = weft_events_format(events, type, weft_events_end(events) - 1, data, NULL);
    char *const longer = event ? weft_asprintf(NULL, "%s%s", *text ? *text : "", event) : NULL;
    weft_free(event);
    weft_free(*text);
    *text = longer;
    return longer != NULL;
}

/* What has been of a job before the events begin: its lines from `from` on, its state. */
static weft_err tell_past(weft_http_request *r, int64_t id, int from, char **text, weft_error *err)
{
    weft_job job;
    json_t *lines = NULL, *line;
    size_t i;
    WEFT_TRY(weft_job_store_get(r->server->house.db, id, &job, err));
    json_t *const described = weft_queue_describe(r->server->house.queue, &job);
    weft_job_fini(&job);
    weft_err status = weft_job_store_read_log(r->server->house.db, id, from, LOG_LIMIT, &lines, err);
    json_array_foreach(lines, i, line) if (status == WEFT_OK)
    {
        json_object_set_new(line, "job", json_integer(id));
        json_object_del(line, "time");
        if (!append(r, text, "job.log", json_incref(line)))
            status = weft_fail(err, WEFT_ERR_NOMEM, "out of memory for the log");
    }
    json_decref(lines);
    if (status == WEFT_OK && !append(r, text, "job.state", json_incref(described)))
        status = weft_fail(err, WEFT_ERR_NOMEM, "out of memory for the job");
    json_decref(described);
    return status;
}

/* The jobs that have not ended. */
static weft_err tell_snapshot(weft_http_request *r, char **text, weft_error *err)
{
    static const weft_job_state states[] = {WEFT_JOB_RUNNING, WEFT_JOB_QUEUED};
    job_list list = {.queue = r->server->house.queue, .jobs = json_array()};
    weft_err status = WEFT_OK;
    for (int i = 0; i < 2 && status == WEFT_OK; i++)
        status = weft_job_store_visit(r->server->house.db, &states[i], 0, 1000, add_to_list, &list, err);
    if (status != WEFT_OK)
        json_decref(list.jobs);
    else if (!append(r, text, "snapshot", json_pack("{s:o}", "jobs", list.jobs)))
        status = weft_fail(err, WEFT_ERR_NOMEM, "out of memory for the jobs");
    return status;
}

enum MHD_Result weft_route_events(weft_http_request *r)
{
    enum MHD_Result result = MHD_NO;
    weft_error error = {0};
    int job = 0, from = 0, hold = 0;
    const char *const last = MHD_lookup_connection_value(r->mhd, MHD_HEADER_KIND, "Last-Event-ID");
    weft_watch_options options = {.next = weft_events_end(r->server->house.events)};
    if (!weft_http_query_int(r, "job", 1, INT32_MAX, &job, &result) ||
        !weft_http_query_int(r, "log", 0, INT32_MAX, &from, &result) ||
        !weft_http_query_int(r, "hold", 0, 1, &hold, &result))
        return result;
    options.job = job;
    options.hold = hold && job;
    weft_err status = WEFT_OK;
    if (!last || !weft_events_find(r->server->house.events, last, &options.next)) {
        options.next = weft_events_end(r->server->house.events);
        status =
            job ? tell_past(r, job, from, &options.first, &error) : tell_snapshot(r, &options.first, &error);
    }
    if (status != WEFT_OK) {
        weft_free(options.first);
        return weft_reply_error(r, status, &error);
    }
    return weft_watch_events(r, &options);
}
