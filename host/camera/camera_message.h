/**
 * What a program and its camera helpers say to each other.
 *
 * One message is one packet of a SOCK_SEQPACKET socket pair, so it comes whole or not at all.  Both ends are
 * of one build: the helper's first message says so, and a packet is the struct itself as far as it is used.
 * Neither end trusts the other: every length, text, number and descriptor is looked at before it is used.
 *
 *     helper -> program   HELLO
 *     program -> helper   LIST | OPEN | CONFIGURE | EXPOSE | CLOSE, answered by the same call and number
 *     helper -> program   ARMED, before the answer to EXPOSE, when the frame waits for a pulse on a wire
 *     program -> helper   CANCEL, while EXPOSE is under way; the answer comes all the same
 *
 * A frame's samples, and behind them the camera's own file where it has one, travel beside the answer to
 * EXPOSE as a memfd that is sealed against every change.
 */
#ifndef WEFT_HOST_CAMERA_MESSAGE_H
#define WEFT_HOST_CAMERA_MESSAGE_H

#include "host/camera/camera.h"

#include <stddef.h>
#include <stdint.h>

/** Which build a helper is of. */
#define WEFT_CAMERA_MESSAGE_VERSION 1
/** The descriptor at which a helper finds its end of the socket pair. */
#define WEFT_CAMERA_HELPER_FD 3

enum { WEFT_CAMERA_MESSAGE_MAX_FOUND = 32 };

/** Refused above this: raw files of the largest backs have 400 MB. */
#define WEFT_CAMERA_MAX_FILE ((size_t)1 << 29)

typedef enum weft_camera_call {
    WEFT_CALL_HELLO,
    WEFT_CALL_LIST,
    WEFT_CALL_OPEN,
    WEFT_CALL_CONFIGURE,
    WEFT_CALL_EXPOSE,
    WEFT_CALL_CLOSE,
    WEFT_CALL_CANCEL,
    WEFT_CALL_ARMED,
    WEFT_N_CALLS,
} weft_camera_call;

typedef struct weft_camera_hello {
    uint32_t version, message_size;
    char build[32], backend[16];
} weft_camera_hello;

typedef struct weft_camera_message {
    uint32_t call;   /* weft_camera_call */
    uint32_t number; /* of the request; its answer has the same */
    int32_t status;  /* of an answer: weft_err; on failure the body is `error` */
    union {
        weft_camera_hello hello;
        char address[128];           /* OPEN */
        weft_camera_settings wanted; /* CONFIGURE */
        double deadline_s;           /* EXPOSE */
        weft_camera_state state;     /* answer to OPEN and CONFIGURE */
        weft_captured_frame frame;   /* answer to EXPOSE; its pointers mean nothing */
        weft_error error;            /* any answer that is a failure */
        struct {                     /* answer to LIST */
            int32_t n;
            weft_camera_found found[WEFT_CAMERA_MESSAGE_MAX_FOUND];
        } list;
    } body;
} weft_camera_message;

/** What came of waiting for a message. */
typedef enum weft_camera_receipt {
    WEFT_RECEIPT_MESSAGE,
    WEFT_RECEIPT_NOTHING, /* not within the time */
    WEFT_RECEIPT_GONE,    /* the other end was closed: its process has ended */
    WEFT_RECEIPT_GARBAGE, /* a packet that is no message of this build */
} weft_camera_receipt;

/** @return "LIST", ...; "?" for a number that is none */
const char *weft_camera_call_name(uint32_t call);

/** Bytes of a message that uses so much of its body. */
#define WEFT_CAMERA_MESSAGE_SIZE(used) (offsetof(weft_camera_message, body) + (used))

/** Sends header and `body_size` bytes of the body, and a descriptor unless fd is -1.  Never waits and never
 *  raises SIGPIPE.  @return false when the other end is gone or does not read */
bool weft_camera_message_send(int socket, const weft_camera_message *message, size_t body_size, int fd);

/**
 * Waits at most timeout_ms for a message and makes its texts end.
 *
 * @param fd  gets the descriptor that came with it, or -1; it is the caller's
 */
weft_camera_receipt weft_camera_message_receive(int socket, int timeout_ms, weft_camera_message *message,
                                                int *fd);

/** A memfd with these bytes and then those, sealed; -1 with errno when there is none. */
int weft_camera_sealed_memory(const void *bytes, size_t n, const void *more, size_t n_more);

/** Whether fd is memory of exactly n bytes that nobody can change any more. */
bool weft_camera_is_sealed_memory(int fd, size_t n);

#endif
