/* From the first header to the route: everything that a request is refused for. */
#include "host/daemon/http_private.h"

#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/text.h"
#include "host/daemon/token.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* The longest body that is heard to its end only to be refused. */
#define SWALLOWED (16L << 20)

/* ---- names and values ---- */

static int hex_digit(char c)
{
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
}

char *weft_http_decode(const char *text, bool plus_is_blank)
{
    size_t n = 0;
    char *const out = weft_alloc(strlen(text) + 1, 1, NULL);
    if (!out)
        return NULL;
    for (const char *p = text; *p; p++) {
        int c = (unsigned char)*p;
        if (c == '%') {
            const int high = hex_digit(p[1]), low = high < 0 ? -1 : hex_digit(p[2]);
            if (low < 0)
                goto bad;
            c = high * 16 + low;
            p += 2;
        } else if (c == '+' && plus_is_blank) {
            c = ' ';
        }
        if (c < 0x20 || c == 0x7f)
            goto bad;
        out[n++] = (char)c;
    }
    out[n] = '\0';
    if (weft_text_is_utf8(out, n))
        return out;
bad:
    weft_free(out);
    return NULL;
}

char *weft_http_query(const weft_http_request *request, const char *key, bool *present)
{
    const char *const value = MHD_lookup_connection_value(request->mhd, MHD_GET_ARGUMENT_KIND, key);
    *present = value != NULL;
    return value ? weft_http_decode(value, true) : NULL;
}

bool weft_http_query_int(weft_http_request *request, const char *key, int min, int max, int *value,
                         enum MHD_Result *result)
{
    bool present;
    int number;
    char *const text = weft_http_query(request, key, &present);
    const bool good = text && weft_text_to_int(text, &number) && number >= min && number <= max;
    weft_free(text);
    if (good)
        *value = number;
    else if (present)
        *result = weft_reply_problem(request, 400, "bad_query", "%s: wanted a whole number from %d to %d",
                                     key, min, max);
    return good || !present;
}

/* ---- checks of the headers ---- */

typedef struct header_sum {
    int n;
    size_t bytes;
    int n_hosts, n_lengths, n_encodings;
} header_sum;

static enum MHD_Result add_header(void *context, enum MHD_ValueKind kind, const char *key, const char *value)
{
    header_sum *const sum = context;
    (void)kind;
    sum->n++;
    sum->bytes += strlen(key) + (value ? strlen(value) : 0) + 4;
    sum->n_hosts += strcasecmp(key, "Host") == 0;
    sum->n_lengths += strcasecmp(key, "Content-Length") == 0;
    sum->n_encodings += strcasecmp(key, "Transfer-Encoding") == 0;
    return MHD_YES;
}

/* "name:port", "[::1]:8080", "name" */
static bool split_host(const char *text, char name[256], int *port)
{
    const char *const bracket = text[0] == '[' ? strchr(text, ']') : NULL;
    const char *const colon =
        text[0] == '[' ? (bracket && bracket[1] == ':' ? bracket + 1 : NULL) : strchr(text, ':');
    const size_t n = colon ? (size_t)(colon - text) : strlen(text);
    if (n == 0 || n >= 256 || (text[0] == '[' && (!bracket || (!colon && bracket[1] != '\0'))))
        return false;
    memcpy(name, text, n);
    name[n] = '\0';
    *port = -1;
    return !colon || (weft_text_to_int(colon + 1, port) && *port > 0 && *port < 65536);
}

/* A page of somebody else's, or a name that somebody else's server gives our address, must not reach us. */
static bool is_our_host(const weft_http_connection *c, const char *text)
{
    static const char *const usual[] = {"localhost", "127.0.0.1", "[::1]", NULL};
    const weft_http_listener *const l = c->listener;
    char name[256];
    int port;
    if (!text || !split_host(text, name, &port))
        return false;
    if (l->tcp && port != (l->port) && !(port == -1 && l->port == (l->tls ? 443 : 80)))
        return false;
    for (const char *const *u = usual; *u; u++)
        if (strcasecmp(name, *u) == 0)
            return true;
    if (!l->tcp)
        return strcasecmp(name, "weftd") == 0;
    for (const char *const *h = l->server->house.hosts; h && *h; h++)
        if (strcasecmp(name, *h) == 0)
            return true;
    return strcasecmp(name, l->address) == 0;
}

static bool is_our_origin(const weft_http_connection *c, const char *origin)
{
    const char *const scheme = c->listener->tls ? "https://" : "http://";
    return strncasecmp(origin, scheme, strlen(scheme)) == 0 && is_our_host(c, origin + strlen(scheme));
}

static bool has_token(const weft_http_request *r)
{
    static const char bearer[] = "Bearer ";
    const char *const header = MHD_lookup_connection_value(r->mhd, MHD_HEADER_KIND, "Authorization");
    const char *const token = r->server->house.token;
    return header && token && strncasecmp(header, bearer, strlen(bearer)) == 0 &&
           weft_token_equal(header + strlen(bearer), token);
}

static enum MHD_Result refuse_stranger(weft_http_request *r)
{
    struct MHD_Response *response;
    char *const text =
        weft_reply_text(401, "no_token", "the token is missing or wrong: Authorization: Bearer TOKEN");
    if (!text)
        return MHD_NO;
    response = MHD_create_response_from_buffer(strlen(text), text, MHD_RESPMEM_MUST_FREE);
    if (response)
        MHD_add_response_header(response, "WWW-Authenticate", "Bearer realm=\"weftd\"");
    return weft_reply(r, 401, response, "application/json");
}

static const char *header_of(const weft_http_request *r, const char *key)
{
    return MHD_lookup_connection_value(r->mhd, MHD_HEADER_KIND, key);
}

/* true: it may go on; false: it has been answered with *result. */
static bool check_client(weft_http_request *r, enum MHD_Result *result)
{
    header_sum sum = {0};
    MHD_get_connection_values(r->mhd, MHD_HEADER_KIND, add_header, &sum);
    const char *const origin = header_of(r, "Origin");
    if (sum.n > WEFT_HTTP_HEADERS || sum.bytes > WEFT_HTTP_HEADER_BYTES)
        *result =
            weft_reply_problem(r, 431, "headers_too_large", "%d headers of %zu bytes: at most %d of %d bytes",
                               sum.n, sum.bytes, WEFT_HTTP_HEADERS, WEFT_HTTP_HEADER_BYTES);
    else if (sum.n_hosts != 1 || !is_our_host(r->connection, header_of(r, "Host")))
        *result = weft_reply_problem(r, 421, "foreign_host", "this is not the host that was asked for");
    else if (origin && !is_our_origin(r->connection, origin))
        *result = weft_reply_problem(r, 403, "foreign_origin", "pages of other hosts may not use this one");
    else if (r->connection->listener->tcp && !has_token(r))
        *result = refuse_stranger(r);
    else
        return true;
    return false;
}

static enum MHD_Result refuse_size(weft_http_request *r)
{
    return weft_reply_problem(r, 413, "body_too_large", "a body has at most %d bytes", WEFT_JOB_REQUEST_MAX);
}

static bool check_body(weft_http_request *r, enum MHD_Result *result)
{
    static const char json[] = "application/json";
    const char *const type = header_of(r, "Content-Type");
    if (r->too_large)
        *result = refuse_size(r);
    else if (r->route->body && (!type || strncasecmp(type, json, strlen(json)) != 0 ||
                                (type[strlen(json)] && !strchr("; ", type[strlen(json)]))))
        *result = weft_reply_problem(r, 415, "not_json", "Content-Type: %s is wanted", json);
    else
        return true;
    return false;
}

static enum MHD_Result refuse_method(weft_http_request *r, const char *allowed)
{
    char message[100];
    snprintf(message, sizeof message, "the path has only %s", allowed);
    char *const text = weft_reply_text(405, "method_not_allowed", message);
    struct MHD_Response *const response =
        text ? MHD_create_response_from_buffer(strlen(text), text, MHD_RESPMEM_MUST_FREE) : NULL;
    if (response)
        MHD_add_response_header(response, "Allow", allowed);
    return weft_reply(r, 405, response, "application/json");
}

/* The whole request is here. */
static enum MHD_Result judge(weft_http_request *r, const char *method)
{
    enum MHD_Result result = MHD_NO;
    char allowed[64];
    if (!check_client(r, &result))
        return result;
    r->path = weft_http_decode(r->url, false);
    if (!r->path)
        return weft_reply_problem(r, 400, "bad_path", "the path is not UTF-8, or holds control characters");
    r->route = weft_route_find(method, r->path, &r->tail, &r->id, allowed);
    if (!r->route && allowed[0])
        return refuse_method(r, allowed);
    if (!r->route)
        return weft_reply_problem(r, 404, "no_such_path",
                                  "there is no %.200s; GET /v1/openapi.json lists what is", r->path);
    return check_body(r, &result) ? r->route->answer(r) : result;
}

/* Where the body ends must be said once and so that everybody understands the same: a proxy in front of this
 * server would else see other requests than it does (RFC 9112, 6.1 and 6.3). */
static bool check_framing(weft_http_request *r, enum MHD_Result *result)
{
    header_sum sum = {0};
    MHD_get_connection_values(r->mhd, MHD_HEADER_KIND, add_header, &sum);
    const char *const encoding = header_of(r, "Transfer-Encoding");
    if (sum.n_lengths + sum.n_encodings > 1)
        *result = weft_reply_problem(r, 400, "bad_http", "the length of the body is said twice");
    else if (encoding && strcasecmp(encoding, "chunked") != 0)
        *result = weft_reply_problem(r, 501, "not_implemented", "Transfer-Encoding: only chunked is known");
    else
        return true;
    return false;
}

/* The headers are here.  Nothing is refused before the body has come too, so that a client that is still
 * sending hears why; but a body that would take long is not waited for. */
static enum MHD_Result begin_request(weft_http_request *r, const char *url)
{
    const char *const length = header_of(r, "Content-Length");
    const long n = length ? strlen(length) > 9 ? LONG_MAX : strtol(length, NULL, 10) : 0;
    enum MHD_Result refused;
    r->url = weft_strdup(url, NULL);
    if (!r->url)
        return MHD_NO;
    if (!check_framing(r, &refused))
        return refused;
    r->too_large = n > WEFT_JOB_REQUEST_MAX;
    return n > SWALLOWED ? refuse_size(r) : MHD_YES;
}

static enum MHD_Result take_body(weft_http_request *r, const char *bytes, size_t n)
{
    r->too_large |= n > WEFT_JOB_REQUEST_MAX - r->n_body; /* sent in chunks: only now can it be known */
    if (r->too_large)
        return MHD_YES; /* until its end, or that of its time */
    char *const grown = weft_realloc(r->body, r->n_body + n + 1, 1, NULL);
    if (!grown)
        return MHD_NO;
    memcpy(grown + r->n_body, bytes, n);
    r->body = grown;
    r->n_body += n;
    return MHD_YES;
}

static weft_http_connection *connection_of(struct MHD_Connection *mhd)
{
    const union MHD_ConnectionInfo *const info =
        MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    return info ? info->socket_context : NULL;
}

enum MHD_Result weft_http_handle(void *context, struct MHD_Connection *mhd, const char *url,
                                 const char *method, const char *version, const char *upload,
                                 size_t *n_upload, void **con_cls)
{
    const weft_http_listener *const listener = context;
    weft_http_request *r = *con_cls;
    (void)version;
    if (!r) {
        r = weft_alloc(1, sizeof *r, NULL);
        if (!r)
            return MHD_NO;
        *r = (weft_http_request){.server = listener->server, .connection = connection_of(mhd), .mhd = mhd};
        *con_cls = r;
        if (!r->connection)
            return MHD_NO;
        return begin_request(r, url);
    }
    if (*n_upload > 0) {
        const size_t n = *n_upload;
        *n_upload = 0;
        return r->answered ? MHD_YES : take_body(r, upload, n);
    }
    if (r->answered)
        return MHD_YES;
    r->connection->waiting_s = 0;
    return judge(r, method);
}

void weft_http_completed(void *context, struct MHD_Connection *mhd, void **con_cls,
                         enum MHD_RequestTerminationCode how)
{
    weft_http_request *const r = *con_cls;
    (void)context, (void)mhd, (void)how;
    if (!r)
        return;
    if (r->connection)
        r->connection->waiting_s = weft_clock_s(); /* the next request of this connection */
    weft_free(r->url);
    weft_free(r->path);
    weft_free(r->body);
    weft_free(r);
    *con_cls = NULL;
}
