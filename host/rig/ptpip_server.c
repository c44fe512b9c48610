#include "host/rig/ptpip_server.h"

#include "core/mem.h"
#include "host/rig/ptp_pack.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

/* Packets (CIPA DC-005, table 6). */
enum {
    INIT_COMMAND = 1,
    INIT_COMMAND_ACK = 2,
    INIT_EVENT = 3,
    INIT_EVENT_ACK = 4,
    INIT_FAIL = 5,
    REQUEST = 6,
    RESPONSE = 7,
    START_DATA = 9,
    DATA = 10,
    END_DATA = 12,
    PING = 13,
    PONG = 14,
};

enum {
    HEADER = 8, /* length, type */
    MAX_PACKET = PTP_MAX_DATA_IN + 64,
    CHUNK = 128 * 1024,
    CLIENT_TIMEOUT_S = 10,
    REASON_BUSY = 2,
    DATA_FROM_CLIENT = 2,
};

struct ptpip_server {
    char address[64];
    char name[32];
    int port;
    ptp_answer_fn *answer;
    void *context;
    pthread_t thread;
    int wake; /* eventfd */
    atomic_bool stop, plugged, obeyed;
    int listener, command, event; /* -1: closed */
    uint8_t packet[MAX_PACKET];
    uint8_t data_in[PTP_MAX_DATA_IN];
    uint8_t chunk[HEADER + 4 + CHUNK];
};

/* ------------------------------------------------------------------------------------------ packets */

static bool read_all(int fd, uint8_t *bytes, size_t n)
{
    while (n > 0) {
        const ssize_t got = recv(fd, bytes, n, 0);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0)
            return false;
        bytes += got;
        n -= (size_t)got;
    }
    return true;
}

static bool write_all(int fd, const uint8_t *bytes, size_t n)
{
    while (n > 0) {
        const ssize_t sent = send(fd, bytes, n, MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR)
            continue;
        if (sent <= 0)
            return false;
        bytes += sent;
        n -= (size_t)sent;
    }
    return true;
}

/* One packet into s->packet without its header.  False: the line is broken, or this is no PTP/IP. */
static bool read_packet(ptpip_server *s, int fd, uint32_t *type, size_t *n)
{
    uint8_t header[HEADER];
    if (!read_all(fd, header, sizeof header))
        return false;
    const uint64_t length = ptp_get(header, 4);
    *type = (uint32_t)ptp_get(header + 4, 4);
    if (length < HEADER || length - HEADER > sizeof s->packet)
        return false;
    *n = (size_t)length - HEADER;
    memset(s->packet, 0, 64);
    return read_all(fd, s->packet, *n);
}

static ptp_writer begin_packet(uint8_t *bytes, size_t size, uint32_t type)
{
    ptp_writer w = {.bytes = bytes, .size = size};
    ptp_put(&w, 0, 4);
    ptp_put(&w, type, 4);
    return w;
}

static bool send_packet(int fd, ptp_writer *w)
{
    const size_t length = w->used;
    w->used = 0;
    ptp_put(w, length, 4);
    return write_all(fd, w->bytes, length);
}

/* ------------------------------------------------------------------------------------------ connections */

static void close_fd(int *fd)
{
    if (*fd >= 0)
        close(*fd);
    *fd = -1;
}

static void hang_up(ptpip_server *s)
{
    const bool was_there = s->command >= 0;
    close_fd(&s->command);
    close_fd(&s->event);
    if (was_there)
        s->answer(s->context, NULL, NULL);
}

static bool start_listening(ptpip_server *s)
{
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons((uint16_t)s->port)};
    socklen_t size = sizeof at;
    const int one = 1;
    if (inet_pton(AF_INET, s->address, &at.sin_addr) != 1)
        return false;
    s->listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (s->listener < 0)
        return false;
    setsockopt(s->listener, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one);
    if (bind(s->listener, (const struct sockaddr *)&at, sizeof at) != 0 || listen(s->listener, 4) != 0 ||
        getsockname(s->listener, (struct sockaddr *)&at, &size) != 0) {
        close_fd(&s->listener);
        return false;
    }
    s->port = ntohs(at.sin_port);
    return true;
}

static bool welcome_command(ptpip_server *s, int fd)
{
    uint8_t bytes[128];
    ptp_writer w;
    if (s->command >= 0) {
        w = begin_packet(bytes, sizeof bytes, INIT_FAIL);
        ptp_put(&w, REASON_BUSY, 4);
        send_packet(fd, &w);
        return false;
    }
    w = begin_packet(bytes, sizeof bytes, INIT_COMMAND_ACK);
    ptp_put(&w, 1, 4); /* connection number */
    ptp_put(&w, UINT64_C(0x74666557), 8);
    ptp_put(&w, 1, 8);
    for (const char *c = s->name; *c; c++)
        ptp_put(&w, (uint8_t)*c, 2);
    ptp_put(&w, 0, 2);
    ptp_put(&w, 0x00010000, 4); /* version 1.0 */
    s->command = fd;
    return send_packet(fd, &w);
}

static bool welcome_event(ptpip_server *s, int fd)
{
    uint8_t bytes[HEADER];
    ptp_writer w = begin_packet(bytes, sizeof bytes, INIT_EVENT_ACK);
    if (s->command < 0 || s->event >= 0)
        return false;
    s->event = fd;
    return send_packet(fd, &w);
}

/* The first packet says whether it is the command or the event connection. */
static void greet(ptpip_server *s)
{
    const struct timeval timeout = {.tv_sec = CLIENT_TIMEOUT_S};
    const int one = 1;
    uint32_t type;
    size_t n;
    const int fd = accept4(s->listener, NULL, NULL, SOCK_CLOEXEC);
    if (fd < 0)
        return;
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
    setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &timeout, sizeof timeout);
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
    bool kept = false;
    if (read_packet(s, fd, &type, &n))
        kept = type == INIT_COMMAND ? welcome_command(s, fd) : type == INIT_EVENT && welcome_event(s, fd);
    if (!kept && fd != s->command && fd != s->event)
        close(fd);
}

/* ------------------------------------------------------------------------------------------ transactions */

static bool read_data_phase(ptpip_server *s, ptp_request *request)
{
    for (;;) {
        uint32_t type;
        size_t n;
        if (!read_packet(s, s->command, &type, &n))
            return false;
        if (type == START_DATA)
            continue;
        if ((type != DATA && type != END_DATA) || n < 4 || n - 4 > sizeof s->data_in - request->n_data)
            return false;
        memcpy(s->data_in + request->n_data, s->packet + 4, n - 4);
        request->n_data += n - 4;
        if (type == END_DATA)
            break;
    }
    request->data = s->data_in;
    return true;
}

static bool send_data(ptpip_server *s, uint32_t transaction, const ptp_reply *reply)
{
    const size_t n = reply->cut && reply->cut_after < reply->n_data ? reply->cut_after : reply->n_data;
    ptp_writer w = begin_packet(s->chunk, sizeof s->chunk, START_DATA);
    ptp_put(&w, transaction, 4);
    ptp_put(&w, reply->n_data, 8);
    if (!send_packet(s->command, &w))
        return false;
    for (size_t sent = 0; sent < n || (sent == 0 && reply->n_data == 0);) {
        const size_t now = n - sent < CHUNK ? n - sent : CHUNK;
        w = begin_packet(s->chunk, sizeof s->chunk, sent + now == reply->n_data ? END_DATA : DATA);
        ptp_put(&w, transaction, 4);
        memcpy(s->chunk + w.used, reply->data + sent, now);
        w.used += now;
        if (!send_packet(s->command, &w))
            return false;
        sent += now;
        if (reply->n_data == 0)
            break;
    }
    return true;
}

static bool send_response(ptpip_server *s, uint32_t transaction, const ptp_reply *reply)
{
    uint8_t bytes[HEADER + 6 + 4 * PTP_MAX_PARAMS];
    ptp_writer w = begin_packet(bytes, sizeof bytes, RESPONSE);
    ptp_put(&w, reply->code, 2);
    ptp_put(&w, transaction, 4);
    for (int i = 0; i < reply->n_params; i++)
        ptp_put(&w, reply->params[i], 4);
    return send_packet(s->command, &w);
}

/* s->packet: data phase (4), code (2), transaction (4), parameters. */
static bool serve_request(ptpip_server *s, size_t n)
{
    ptp_request request = {0};
    ptp_reply reply = {0};
    if (n < 10)
        return false;
    const bool has_data = ptp_get(s->packet, 4) == DATA_FROM_CLIENT;
    const uint32_t transaction = (uint32_t)ptp_get(s->packet + 6, 4);
    request.code = (uint16_t)ptp_get(s->packet + 4, 2);
    request.n_params = n - 10 > (size_t)4 * PTP_MAX_PARAMS ? PTP_MAX_PARAMS : (int)(n - 10) / 4;
    for (int i = 0; i < request.n_params; i++)
        request.params[i] = (uint32_t)ptp_get(s->packet + 10 + 4 * (size_t)i, 4);
    if (has_data && !read_data_phase(s, &request))
        return false;
    s->answer(s->context, &request, &reply);
    if (reply.data && !send_data(s, transaction, &reply))
        return false;
    if (reply.unplug)
        atomic_store(&s->plugged, false);
    return !reply.cut && send_response(s, transaction, &reply);
}

static bool serve_command(ptpip_server *s)
{
    uint32_t type;
    size_t n;
    return read_packet(s, s->command, &type, &n) && type == REQUEST && serve_request(s, n);
}

static bool serve_event(ptpip_server *s)
{
    uint8_t bytes[HEADER];
    uint32_t type;
    size_t n;
    if (!read_packet(s, s->event, &type, &n))
        return false;
    ptp_writer w = begin_packet(bytes, sizeof bytes, PONG);
    return type != PING || send_packet(s->event, &w);
}

/* ------------------------------------------------------------------------------------------ thread */

static void obey_cable(ptpip_server *s)
{
    if (!atomic_load(&s->plugged)) {
        hang_up(s);
        close_fd(&s->listener);
    } else if (s->listener < 0) {
        start_listening(s);
    }
    atomic_store(&s->obeyed, true);
}

static void *serve(void *context)
{
    ptpip_server *const s = context;
    while (!atomic_load(&s->stop)) {
        struct pollfd fds[] = {{.fd = s->wake, .events = POLLIN},
                               {.fd = s->listener, .events = POLLIN},
                               {.fd = s->command, .events = POLLIN},
                               {.fd = s->event, .events = POLLIN}};
        if (poll(fds, sizeof fds / sizeof fds[0], -1) < 0)
            continue;
        uint64_t count;
        if (fds[0].revents && read(s->wake, &count, sizeof count) < 0)
            continue;
        if ((fds[2].revents && !serve_command(s)) || (fds[3].revents && s->event >= 0 && !serve_event(s)))
            hang_up(s);
        if (fds[1].revents)
            greet(s);
        obey_cable(s);
    }
    hang_up(s);
    close_fd(&s->listener);
    return NULL;
}

static void wake(ptpip_server *s)
{
    const uint64_t one = 1;
    while (write(s->wake, &one, sizeof one) < 0 && errno == EINTR)
        ;
}

weft_err ptpip_server_create(const char *address, int port, const char *name, ptp_answer_fn *answer,
                             void *context, ptpip_server **server, weft_error *err)
{
    ptpip_server *const s = weft_alloc(1, sizeof *s, err);
    if (!s)
        return WEFT_ERR_NOMEM;
    strncpy(s->address, address, sizeof s->address - 1);
    strncpy(s->name, name, sizeof s->name - 1);
    s->port = port;
    s->answer = answer;
    s->context = context;
    s->listener = s->command = s->event = -1;
    atomic_init(&s->plugged, true);
    s->wake = eventfd(0, EFD_CLOEXEC);
    bool listens = start_listening(s);
    if (!listens) {
        s->port = 0;
        listens = start_listening(s);
    }
    if (s->wake < 0 || !listens || pthread_create(&s->thread, NULL, serve, s) != 0) {
        close_fd(&s->listener);
        close_fd(&s->wake);
        weft_free(s);
        return weft_fail_errno(
            err, WEFT_ERR_DEVICE,
            "the PTP camera cannot listen at %s; give --address an address of this machine", address);
    }
    *server = s;
    return WEFT_OK;
}

void ptpip_server_destroy(ptpip_server *s)
{
    if (!s)
        return;
    atomic_store(&s->stop, true);
    wake(s);
    pthread_join(s->thread, NULL);
    close_fd(&s->wake);
    weft_free(s);
}

int ptpip_server_port(const ptpip_server *s)
{
    return s->port;
}

void ptpip_server_plug(ptpip_server *s, bool plugged)
{
    atomic_store(&s->plugged, plugged);
    atomic_store(&s->obeyed, false);
    wake(s);
    for (int i = 0; i < 1000 && !atomic_load(&s->obeyed); i++)
        usleep(5000);
}

bool ptpip_server_is_plugged(const ptpip_server *s)
{
    return atomic_load(&s->plugged);
}
