#include "host/daemon/http_private.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum MHD_Result weft_reply(weft_http_request *request, unsigned status, struct MHD_Response *response,
                           const char *type)
{
    if (!response)
        return MHD_NO; /* no memory: the connection is closed */
    if (type)
        MHD_add_response_header(response, "Content-Type", type);
    MHD_add_response_header(response, "Cache-Control", "no-store");
    MHD_add_response_header(response, "X-Content-Type-Options", "nosniff");
    const enum MHD_Result result = weft_http_queue(request->mhd, status, response);
    MHD_destroy_response(response);
    request->answered = true;
    return result;
}

enum MHD_Result weft_reply_json(weft_http_request *request, unsigned status, json_t *value)
{
    char *const text = value ? json_dumps(value, JSON_COMPACT | JSON_REAL_PRECISION(9)) : NULL;
    json_decref(value);
    if (!text)
        return MHD_NO;
    return weft_reply(request, status,
                      MHD_create_response_from_buffer(strlen(text), text, MHD_RESPMEM_MUST_FREE),
                      "application/json");
}

static json_t *problem_to_json(unsigned status, const char *code, const char *message)
{
    return json_pack("{s:{s:i, s:s, s:s}}", "error", "status", (int)status, "code", code, "message", message);
}

char *weft_reply_text(unsigned status, const char *code, const char *message)
{
    json_t *const value = problem_to_json(status, code, message);
    char *const text = value ? json_dumps(value, JSON_COMPACT) : NULL;
    json_decref(value);
    return text;
}

enum MHD_Result weft_reply_problem(weft_http_request *request, unsigned status, const char *code,
                                   const char *format, ...)
{
    char message[1200];
    va_list args;
    va_start(args, format);
    vsnprintf(message, sizeof message, format, args);
    va_end(args);
    json_t *value = problem_to_json(status, code, message);
    if (!value) /* a text that was cut inside a letter */
        value = problem_to_json(status, code, "the message cannot be shown");
    return weft_reply_json(request, status, value);
}

enum MHD_Result weft_reply_error(weft_http_request *request, weft_err status, const weft_error *error)
{
    static const struct {
        weft_err err;
        unsigned status;
        const char *code;
    } table[] = {
        {WEFT_ERR_FORMAT, 400, "bad_json"}, {WEFT_ERR_USAGE, 422, "bad_request"},
        {WEFT_ERR_RANGE, 403, "forbidden"}, {WEFT_ERR_MISSING, 404, "not_found"},
        {WEFT_ERR_EXISTS, 409, "conflict"}, {WEFT_ERR_IO, 507, "storage"},
    };
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++)
        if (table[i].err == status)
            return weft_reply_problem(request, table[i].status, table[i].code, "%s", error->text);
    return weft_reply_problem(request, 500, "internal", "%s", error->text);
}
