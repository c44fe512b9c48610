/**
 * The wire between host and light controller; compiled into both sides.
 *
 * A frame on the line is
 *
 *     COBS( version:4 | type:4, seq, command, n, payload[n], crc_low, crc_high ) 0x00
 *
 * so a zero byte is a frame's end and nothing else.  COBS: Cheshire and Baker, "Consistent overhead byte
 * stuffing", IEEE/ACM Trans. Networking 7(2), 1999.  CRC: the 16-bit FCS of HDLC (RFC 1662, section C.2;
 * CRC-16/X-25 in Koopman's and Cook's catalogues: reflected 0x1021, start 0xffff, inverted at the end).
 * Fields are little-endian.  What may be said is in protocol.def, how in docs/protocol.md.
 *
 * No heap, no errno, no libc beyond memcpy; safe from any thread.
 */
#ifndef WEFT_FIRMWARE_PROTOCOL_H
#define WEFT_FIRMWARE_PROTOCOL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifndef WEFT_PROTOCOL_MAJOR   /* a test builds firmware of another version */
#define WEFT_PROTOCOL_MAJOR 1 /* in every frame: the other side refuses another one */
#endif
#define WEFT_PROTOCOL_MINOR 1 /* appended fields and commands only */
#define WEFT_PROTOCOL_MAGIC 0x54464557ul

#define WEFT_PAYLOAD_MAX     48
#define WEFT_FRAME_HEAD      4
#define WEFT_FRAME_PLAIN_MAX (WEFT_FRAME_HEAD + WEFT_PAYLOAD_MAX + 2)
/** Longest frame on the line: COBS adds one byte to up to 254, and the delimiter ends it. */
#define WEFT_FRAME_WIRE_MAX (WEFT_FRAME_PLAIN_MAX + 2)
/** Consecutive delimiters that turn everything off at once. */
#define WEFT_PANIC_ZEROS 3

typedef enum weft_frame_type {
    WEFT_FRAME_REQUEST = 0,
    WEFT_FRAME_REPLY = 1,
    WEFT_FRAME_EVENT = 2
} weft_frame_type;

enum {
#define WEFT_COMMAND(opcode, NAME, name, text) WEFT_CMD_##NAME = (opcode),
#define WEFT_EVENT(number, NAME, name, text)   WEFT_EVENT_##NAME = (number),
#define WEFT_STATUS(number, NAME, text)        WEFT_STATUS_##NAME = (number),
#define WEFT_STATE(number, NAME, text)         WEFT_STATE_##NAME = (number),
#define WEFT_CAUSE(number, NAME, text)         WEFT_CAUSE_##NAME = (number),
#define WEFT_RESET(number, NAME, text)         WEFT_RESET_##NAME = (number),
#define WEFT_SETTINGS(number, NAME, text)      WEFT_SETTINGS_##NAME = (number),
#define WEFT_FAULT(number, NAME, text)         WEFT_FAULT_##NAME = (number),
#define WEFT_STEP(bit, NAME, text)             WEFT_STEP_##NAME = 1 << (bit),
#define WEFT_HOLD(number, NAME, text)          WEFT_HOLD_##NAME = (number),
#define WEFT_KEY(number, NAME, text)           WEFT_KEY_##NAME = (number),
#define WEFT_CAPABILITY(bit, NAME, text)       WEFT_CAPABILITY_##NAME = 1 << (bit),
#include "firmware/protocol.def"
};

/* typedef struct weft_hello_request { uint8_t proto_major; ... } weft_hello_request; and so on */
#define WEFT_PAYLOAD_BEGIN(name, NAME) typedef struct weft_##name {
#define WEFT_U8(field, text)           uint8_t field;
#define WEFT_U16(field, text)          uint16_t field;
#define WEFT_U32(field, text)          uint32_t field;
#define WEFT_BYTES(field, n, text)     uint8_t field[n];
#define WEFT_PAYLOAD_END(name, NAME)                                                                         \
    uint8_t end_[1]; /* C has no empty structs */                                                            \
    }                                                                                                        \
    weft_##name;
#include "firmware/protocol.def"

/* WEFT_HELLO_REQUEST_BYTES and so on: bytes on the wire, the status byte of a reply not counted */
/* NOLINTBEGIN(bugprone-macro-parentheses): summands */
enum {
#define WEFT_PAYLOAD_BEGIN(name, NAME) WEFT_##NAME##_BYTES = 0
#define WEFT_U8(field, text)           +1
#define WEFT_U16(field, text)          +2
#define WEFT_U32(field, text)          +4
#define WEFT_BYTES(field, n, text)     +(n)
#define WEFT_PAYLOAD_END(name, NAME)   ,
#include "firmware/protocol.def"
};
/* NOLINTEND(bugprone-macro-parentheses) */

/* void weft_hello_request_encode(const weft_hello_request *value, uint8_t bytes[WEFT_HELLO_REQUEST_BYTES]);
 * void weft_hello_request_decode(const uint8_t *bytes, uint8_t n, weft_hello_request *value);
 * Decoding fewer bytes than there are fields leaves the rest 0: an older minor version sent them. */
#define WEFT_PAYLOAD_BEGIN(name, NAME)                                                                       \
    void weft_##name##_encode(const weft_##name *value, uint8_t *bytes);                                     \
    void weft_##name##_decode(const uint8_t *bytes, uint8_t n, weft_##name *value);
#include "firmware/protocol.def"

typedef struct weft_frame {
    uint8_t version; /* 0..15, WEFT_PROTOCOL_MAJOR of the sender */
    uint8_t type;    /* weft_frame_type */
    uint8_t seq;     /* chosen by the host, repeated in the reply; events count their own */
    uint8_t command;
    uint8_t n; /* bytes of payload, 0..WEFT_PAYLOAD_MAX */
    uint8_t payload[WEFT_PAYLOAD_MAX];
    uint16_t crc; /* as received */
} weft_frame;

typedef enum weft_frame_result {
    WEFT_FRAME_GOOD,
    WEFT_FRAME_BAD_CODING, /* no COBS, or too short or long for a frame */
    WEFT_FRAME_BAD_CRC     /* header and payload are filled in, but not to be believed */
} weft_frame_result;

/** Writes the frame with its delimiter.  n, version and type must be in range.
 *  @return bytes written, at most WEFT_FRAME_WIRE_MAX */
uint8_t weft_frame_encode(const weft_frame *frame, uint8_t *wire);

/** Reads what stood before a delimiter (the delimiter not included), any n. */
weft_frame_result weft_frame_decode(const uint8_t *wire, size_t n, weft_frame *frame);

/** @return bytes written to `coded`: at most n + 1 + n / 254, none of them 0. */
size_t weft_cobs_encode(const uint8_t *plain, size_t n, uint8_t *coded);
/** Decodes n bytes; `plain` has room for n and may be `coded`.  @return bytes written, or SIZE_MAX when
 *  the input is no COBS (a zero byte in it, a block that is cut, nothing at all). */
size_t weft_cobs_decode(const uint8_t *coded, size_t n, uint8_t *plain);

/** CRC-16/X-25 of n bytes; of "123456789" it is 0x906e. */
uint16_t weft_crc16(const uint8_t *bytes, size_t n);

/** Names and sentences of the numbers, for people; "unknown" for the ones not in protocol.def. */
const char *weft_protocol_command_name(uint8_t opcode);
const char *weft_protocol_status_name(uint8_t status);
const char *weft_protocol_status_text(uint8_t status);
const char *weft_protocol_state_name(uint8_t state);
const char *weft_protocol_cause_name(uint8_t cause);
const char *weft_protocol_cause_text(uint8_t cause);
const char *weft_protocol_settings_name(uint8_t number);
const char *weft_protocol_fault_name(uint8_t number);
const char *weft_protocol_fault_text(uint8_t number);
const char *weft_protocol_reset_name(uint8_t cause);
const char *weft_protocol_reset_text(uint8_t cause);

#endif
