/*
 * Refusals that libmicrohttpd has no callback for: what it finds wrong by itself (a request line, a header, a
 * Content-Length or a chunk that cannot be read, too long an address, a foreign version of HTTP) it answers
 * with a page in HTML, and 0.9.75 sends the header of some of these answers twice.  Clients shall see one
 * form of error.  The library queues its own answers by the public MHD_queue_response(), which it calls as
 * any other program does, through the dynamic linker: the function of that name here, in the program, comes
 * first and gets those answers before they are sent.  Should a later library be built so that it does not,
 * its pages are HTML again, and test_every_refusal_is_json (daemon_guard) says so.
 */
#include "host/daemon/http_private.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

typedef enum MHD_Result queue_fn(struct MHD_Connection *mhd, unsigned status, struct MHD_Response *response);

/* Never called before main(): dlsym() needs no lock of ours, there is one thread. */
static queue_fn *library_queue(void)
{
    static queue_fn *found;
    if (!found)
        *(void **)&found = dlsym(RTLD_NEXT, "MHD_queue_response");
    return found;
}

enum MHD_Result weft_http_queue(struct MHD_Connection *mhd, unsigned status, struct MHD_Response *response)
{
    queue_fn *const queue = library_queue();
    return queue ? queue(mhd, status, response) : MHD_NO;
}

void weft_http_turn_away(weft_http_connection *c, unsigned status, const char *code, const char *message)
{
    char *const body = weft_reply_text(status, code, message);
    char text[1024];
    c->waiting_s = 0;
    if (body && !c->listener->tls) {
        const int n = snprintf(text, sizeof text,
                               "HTTP/1.1 %u %s\r\nContent-Type: application/json\r\nContent-Length: %zu\r\n"
                               "Connection: close\r\n\r\n%s",
                               status, MHD_get_reason_phrase_for(status), strlen(body), body);
        (void)!send(c->fd, text, (size_t)n, MSG_DONTWAIT | MSG_NOSIGNAL);
    }
    free(body);
    (void)shutdown(c->fd, SHUT_RDWR); /* libmicrohttpd closes it when it notices */
}

typedef struct refusal {
    unsigned status;
    const char *code, *message;
} refusal;

static const refusal *find_refusal(unsigned status)
{
    static const refusal table[] = {
        {413, "body_too_large", "the length of the body cannot be"},
        {414, "uri_too_long", "the address is too long"},
        {431, "headers_too_large", "the headers, or the values in the address, are too large"},
        {500, "internal", "the HTTP server failed"},
        {505, "http_version", "wanted HTTP/1.0 or HTTP/1.1"},
        {400, "bad_http",
         "this is no HTTP request: request line, a header, Content-Length or a chunk is wrong"},
    };
    const refusal *row = table;
    while (row->status != 400 && row->status != status)
        row++;
    return row;
}

/* Under TLS the answer has to go through the library. */
static enum MHD_Result replace(struct MHD_Connection *mhd, unsigned status, const refusal *r)
{
    char *const text = weft_reply_text(status, r->code, r->message);
    struct MHD_Response *const response =
        text ? MHD_create_response_from_buffer(strlen(text), text, MHD_RESPMEM_MUST_FREE) : NULL;
    if (!response)
        return MHD_NO;
    MHD_add_response_header(response, "Content-Type", "application/json");
    const enum MHD_Result result = weft_http_queue(mhd, status, response);
    MHD_destroy_response(response);
    return result;
}

/* In the library's place, for the library: see above.  What it has queued goes to a socket that is shut; to
 * fail here would make it free the connection under its own feet. */
_MHD_EXTERN enum MHD_Result MHD_queue_response(struct MHD_Connection *mhd, unsigned int status,
                                               struct MHD_Response *response)
{
    const union MHD_ConnectionInfo *const info =
        MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    weft_http_connection *const c = info ? info->socket_context : NULL;
    const refusal *const r = find_refusal(status);
    const bool twice = MHD_lookup_connection_value(mhd, MHD_HEADER_KIND, "Content-Length") != NULL;
    if (c && c->listener->tls && !twice)
        return replace(mhd, status, r);
    if (c)
        weft_http_turn_away(c, status, r->code, r->message);
    return weft_http_queue(mhd, status, response);
}
