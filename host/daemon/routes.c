/* The table of routes, and finding one.  host/daemon/openapi.json describes the same; a test compares them.
 */
#include "host/daemon/http_private.h"

#include "core/text.h"

#include <stdio.h>
#include <string.h>

/* clang-format off */
const weft_route weft_routes[] = {
    {"GET",    "/v1",                  "getInfo",        weft_route_info,            false},
    {"GET",    "/v1/openapi.json",     "getDescription", weft_route_openapi,         false},
    {"GET",    "/v1/commands",         "listCommands",   weft_route_commands,        false},
    {"GET",    "/v1/jobs",             "listJobs",       weft_route_jobs_list,       false},
    {"POST",   "/v1/jobs",             "addJob",         weft_route_jobs_add,        true},
    {"GET",    "/v1/jobs/{id}",        "getJob",         weft_route_job_get,         false},
    {"DELETE", "/v1/jobs/{id}",        "removeJob",      weft_route_job_remove,      false},
    {"GET",    "/v1/jobs/{id}/log",    "getJobLog",      weft_route_job_log,         false},
    {"POST",   "/v1/jobs/{id}/cancel", "cancelJob",      weft_route_job_cancel,      false},
    {"POST",   "/v1/jobs/{id}/resume", "resumeJob",      weft_route_job_resume,      false},
    {"GET",    "/v1/events",           "watchEvents",    weft_route_events,          false},
    {"GET",    "/v1/live",             "getLive",        weft_route_live,            false},
    {"GET",    "/v1/live.jpg",         "getLivePicture", weft_route_live_picture,    false},
    {"GET",    "/v1/live.mjpg",        "watchLive",      weft_route_live_stream,     false},
    {"GET",    "/v1/library",          "listLibrary",    weft_route_library_list,    false},
    {"GET",    "/v1/library/{path}",   "getItem",        weft_route_library_item,    false},
    {"GET",    "/v1/files/{path}",     "getFile",        weft_route_file,            false},
    {0},
};
/* clang-format on */

/* Whether the path is of the pattern. */
static bool matches(const char *pattern, const char *path, const char **tail, int64_t *id)
{
    while (*pattern && *pattern != '{') {
        if (*pattern++ != *path++)
            return false;
    }
    if (!*pattern)
        return *path == '\0';
    *tail = path;
    if (strcmp(pattern, "{path}") == 0)
        return *path != '\0';
    const size_t n = strcspn(path, "/"), digits = strspn(path, "0123456789");
    char text[12];
    int number;
    if (n == 0 || n != digits || n >= sizeof text || (path[0] == '0' && n > 1))
        return false;
    memcpy(text, path, n);
    text[n] = '\0';
    if (!weft_text_to_int(text, &number) || strcmp(strchr(pattern, '}') + 1, path + n) != 0)
        return false;
    *id = number;
    return true;
}

const weft_route *weft_route_find(const char *method, const char *path, const char **tail, int64_t *id,
                                  char allowed[64])
{
    const char *const wanted = strcmp(method, "HEAD") == 0 ? "GET" : method;
    size_t used = 0;
    allowed[0] = '\0';
    for (const weft_route *route = weft_routes; route->method; route++) {
        if (!matches(route->path, path, tail, id))
            continue;
        if (strcmp(route->method, wanted) == 0)
            return route;
        used += (size_t)snprintf(allowed + used, 64 - used, "%s%s", used ? ", " : "",
                                 strcmp(route->method, "GET") == 0 ? "GET, HEAD" : route->method);
    }
    return NULL;
}
