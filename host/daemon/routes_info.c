/* What the daemon is and what it can do. */
#include "host/daemon/http_private.h"

#include "core/embedded.h"
#include "core/progress.h"
#include "core/version.h"
#include "host/cli/command.h"

#include <string.h>
#include <unistd.h>

extern const weft_embedded weft_daemon_files[];

enum MHD_Result weft_route_info(weft_http_request *r)
{
    const weft_http_server *const s = r->server;
    return weft_reply_json(r, 200,
                           json_pack("{s:s, s:s, s:i, s:s, s:i, s:f, s:i, s:i}", "name", "weftd", "version",
                                     WEFT_VERSION, "api", 1, "library", s->house.db->root, "pid",
                                     (int)getpid(), "uptime_s", weft_clock_s() - s->started_s, "running",
                                     weft_queue_running(s->house.queue), "connections", s->n_connections));
}

enum MHD_Result weft_route_openapi(weft_http_request *r)
{
    const weft_embedded *const file = weft_embedded_find(weft_daemon_files, "openapi.json");
    return weft_reply(
        r, 200,
        MHD_create_response_from_buffer(file->size, (void *)(uintptr_t)file->bytes, MHD_RESPMEM_PERSISTENT),
        "application/json");
}

/* The names of a choice, "a|b|c", as a list. */
static json_t *choices_of(const weft_field *field)
{
    json_t *const list = json_array();
    for (const char *p = field->choices; p && *p;) {
        const size_t n = strcspn(p, "|");
        json_array_append_new(list, json_stringn(p, n));
        p += n + (p[n] == '|');
    }
    return list;
}

static json_t *describe_option(const weft_field *field)
{
    static const char *const types[] = {"flag",   "integer", "number",  "text",
                                        "choice", "size",    "numbers", "texts"};
    json_t *const o = json_pack("{s:s, s:s, s:s, s:b}", "key", field->key, "type", types[field->type], "help",
                                field->help, "required", field->required);
    if (field->unit)
        json_object_set_new(o, "unit", json_string(field->unit));
    if (field->def)
        json_object_set_new(o, "default", json_string(field->def));
    if (field->choices)
        json_object_set_new(o, "choices", choices_of(field));
    if (field->min != 0 || field->max != 0)
        json_object_set_new(o, "range", json_pack("[f, f]", field->min, field->max));
    return o;
}

enum MHD_Result weft_route_commands(weft_http_request *r)
{
    json_t *const list = json_array();
    for (const weft_command *const *c = weft_commands; *c; c++) {
        const weft_job_kind *const kind = weft_job_kind_find((*c)->name);
        if (!kind)
            continue;
        json_t *const options = json_array();
        for (const weft_field *f = (*c)->fields; f && f->key; f++)
            if (!weft_job_kind_lists(kind->never, f->key))
                json_array_append_new(options, describe_option(f));
        json_array_append_new(list, json_pack("{s:s, s:s, s:s, s:s, s:b, s:o}", "command", (*c)->name,
                                              "summary", (*c)->summary, "operands", (*c)->operands, "class",
                                              kind->hardware ? "hardware" : "cpu", "resumes", kind->resumes,
                                              "options", options));
    }
    return weft_reply_json(r, 200, json_pack("{s:o}", "commands", list));
}
