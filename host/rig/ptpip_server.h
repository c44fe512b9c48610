/**
 * PTP over TCP/IP (CIPA DC-005-2005), the camera's side: one client, whose requests are answered one by one.
 *
 * A second client is refused while the first is there.  An own thread does everything; it calls `answer`.
 */
#ifndef WEFT_HOST_RIG_PTPIP_SERVER_H
#define WEFT_HOST_RIG_PTPIP_SERVER_H

#include "core/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { PTP_MAX_PARAMS = 5, PTP_MAX_DATA_IN = 65536 };

typedef struct ptp_request {
    uint16_t code;
    int n_params;
    uint32_t params[PTP_MAX_PARAMS]; /* 0 where none was sent */
    const uint8_t *data;             /* sent by the client, n_data bytes */
    size_t n_data;
} ptp_request;

typedef struct ptp_reply {
    uint16_t code;
    int n_params;
    uint32_t params[PTP_MAX_PARAMS];
    const uint8_t *data; /* sent before the code when not NULL; must live until the next request */
    size_t n_data;
    bool cut; /* the line breaks after cut_after bytes of data */
    size_t cut_after;
    bool unplug; /* and stays broken: ptpip_server_plug() mends it */
} ptp_reply;

/** Answers one request, from the server's thread.  A NULL request says that the client is gone. */
typedef void ptp_answer_fn(void *context, const ptp_request *request, ptp_reply *reply);

typedef struct ptpip_server ptpip_server;

/** Listens at `port` of `address`, or at any free port when that is taken.
 *  @return WEFT_ERR_DEVICE when the address is not of this machine */
weft_err ptpip_server_create(const char *address, int port, const char *name, ptp_answer_fn *answer,
                             void *context, ptpip_server **server, weft_error *err);
void ptpip_server_destroy(ptpip_server *server);

int ptpip_server_port(const ptpip_server *server);

/** The cable: false breaks the line at once and refuses every connection.  From any thread; returns when it
 *  is so. */
void ptpip_server_plug(ptpip_server *server, bool plugged);
bool ptpip_server_is_plugged(const ptpip_server *server);

#endif
