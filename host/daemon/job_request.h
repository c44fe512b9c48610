/**
 * What a client asks for, from the bytes of its request to a job that can be queued.
 *
 *     {"command": "solve", "operands": ["twill.set"],
 *      "options": {"calibration": "scanner.cal", "output": "twill.maps", "half": true}}
 *
 * The options are those of the command line, under the names of `weft COMMAND --help`; the tables of the
 * commands are what they are checked against.
 */
#ifndef WEFT_HOST_DAEMON_JOB_REQUEST_H
#define WEFT_HOST_DAEMON_JOB_REQUEST_H

#include "host/client/job_kinds.h"
#include "host/library/job_store.h"

/** What the one who asks may do. */
typedef struct weft_job_rights {
    const char *root;                /* of the library, absolute */
    bool own_user;                   /* on the socket, and the daemon's own user: any path, any device */
    const char *rig, *port, *camera; /* the devices that the daemon was started for; NULL: none named */
    const char *owner;               /* "uid 1000" */
} weft_job_rights;

/** Longest body that is looked at. */
#define WEFT_JOB_REQUEST_MAX 65536

/**
 * Reads and checks a request.  Nothing is looked at outside the bytes, the tables and the names of the
 * library.
 *
 * @param bytes  UTF-8 text of `n` bytes, not ended by NUL
 * @param job    gets command, request, words, reads, writes, hardware and owner; weft_job_fini() it
 * @return WEFT_ERR_FORMAT when it is no such JSON, WEFT_ERR_USAGE for a command, option or operand that is
 *         wrong, WEFT_ERR_RANGE for a path that leads out of the library or a device that is not the client's
 */
weft_err weft_job_request_parse(const char *bytes, size_t n, const weft_job_rights *rights, weft_job *job,
                                weft_error *err);

/** Whether a request says so: {"hold": true}. */
bool weft_job_request_holds(const json_t *request);

/** Whether a request wants to wait for that job: {"after": [12]}. */
bool weft_job_request_is_after(const json_t *request, int64_t id);

#endif
