#include "firmware/protocol.h"

#include <string.h>

/* Every payload fits, with the status byte of a reply. */
#define WEFT_PAYLOAD_BEGIN(name, NAME)                                                                       \
    _Static_assert(WEFT_##NAME##_BYTES + 1 <= WEFT_PAYLOAD_MAX, #name " is too long for a frame");
#include "firmware/protocol.def"

_Static_assert(WEFT_FRAME_PLAIN_MAX <= 254, "one COBS block must do, see weft_frame_encode()");

uint16_t weft_crc16(const uint8_t *bytes, size_t n)
{
    uint16_t crc = 0xffff;
    for (size_t i = 0; i < n; i++) {
        uint8_t x = (uint8_t)(bytes[i] ^ crc);
        x = (uint8_t)(x ^ x << 4);
        crc = (uint16_t)(crc >> 8 ^ (uint16_t)x << 8 ^ (uint16_t)x << 3 ^ x >> 4);
    }
    return (uint16_t)~crc;
}

size_t weft_cobs_encode(const uint8_t *plain, size_t n, uint8_t *coded)
{
    size_t out = 1, block = 0; /* `block`: where the code of the current block goes */
    uint8_t code = 1;
    for (size_t i = 0; i < n; i++) {
        if (code == 0xff) { /* full: only now, so that no empty block follows the last full one */
            coded[block] = code;
            block = out++;
            code = 1;
        }
        if (plain[i]) {
            coded[out++] = plain[i];
            code++;
        } else {
            coded[block] = code;
            block = out++;
            code = 1;
        }
    }
    coded[block] = code;
    return out;
}

size_t weft_cobs_decode(const uint8_t *coded, size_t n, uint8_t *plain)
{
    size_t out = 0;
    if (n == 0)
        return SIZE_MAX;
    for (size_t i = 0; i < n;) {
        const uint8_t code = coded[i++];
        if (code == 0 || (size_t)(code - 1) > n - i)
            return SIZE_MAX;
        for (uint8_t k = 1; k < code; k++) {
            if (coded[i] == 0)
                return SIZE_MAX;
            plain[out++] = coded[i++];
        }
        if (code != 0xff && i < n)
            plain[out++] = 0;
    }
    return out;
}

uint8_t weft_frame_encode(const weft_frame *frame, uint8_t *wire)
{
    uint8_t plain[WEFT_FRAME_PLAIN_MAX];
    plain[0] = (uint8_t)(frame->version << 4 | frame->type);
    plain[1] = frame->seq;
    plain[2] = frame->command;
    plain[3] = frame->n;
    memcpy(plain + WEFT_FRAME_HEAD, frame->payload, frame->n);
    const uint8_t n = (uint8_t)(WEFT_FRAME_HEAD + frame->n);
    const uint16_t crc = weft_crc16(plain, n);
    plain[n] = (uint8_t)crc;
    plain[n + 1] = (uint8_t)(crc >> 8);
    uint8_t length = (uint8_t)weft_cobs_encode(plain, (size_t)n + 2, wire);
    wire[length++] = 0;
    return length;
}

weft_frame_result weft_frame_decode(const uint8_t *wire, size_t n, weft_frame *frame)
{
    uint8_t plain[WEFT_FRAME_PLAIN_MAX + 1];
    if (n > sizeof plain)
        return WEFT_FRAME_BAD_CODING;
    const size_t length = weft_cobs_decode(wire, n, plain);
    if (length == SIZE_MAX || length < WEFT_FRAME_HEAD + 2 || length > WEFT_FRAME_PLAIN_MAX)
        return WEFT_FRAME_BAD_CODING;
    const uint8_t payload = (uint8_t)(length - WEFT_FRAME_HEAD - 2);
    frame->version = plain[0] >> 4;
    frame->type = plain[0] & 0x0f;
    frame->seq = plain[1];
    frame->command = plain[2];
    frame->n = payload;
    memcpy(frame->payload, plain + WEFT_FRAME_HEAD, payload);
    frame->crc = (uint16_t)(plain[length - 2] | (uint16_t)plain[length - 1] << 8);
    /* A right CRC over a wrong length byte is a sender's mistake, and as little to be believed. */
    return frame->crc == weft_crc16(plain, length - 2) && plain[3] == payload ? WEFT_FRAME_GOOD
                                                                              : WEFT_FRAME_BAD_CRC;
}

static uint8_t *put(uint8_t *bytes, uint32_t value, uint8_t n)
{
    for (uint8_t i = 0; i < n; i++, value >>= 8)
        *bytes++ = (uint8_t)value;
    return bytes;
}

#define WEFT_PAYLOAD_BEGIN(name, NAME)                                                                       \
    void weft_##name##_encode(const weft_##name *value, uint8_t *bytes)                                      \
    {
#define WEFT_U8(field, text)       bytes = put(bytes, value->field, 1);
#define WEFT_U16(field, text)      bytes = put(bytes, value->field, 2);
#define WEFT_U32(field, text)      bytes = put(bytes, value->field, 4);
#define WEFT_BYTES(field, n, text) memcpy(bytes, value->field, n), bytes += (n);
#define WEFT_PAYLOAD_END(name, NAME)                                                                         \
    (void)value;                                                                                             \
    (void)bytes;                                                                                             \
    }
#include "firmware/protocol.def"

/* What is left to decode; past its end every field reads as 0. */
typedef struct reader {
    const uint8_t *bytes;
    uint8_t n;
} reader;

static uint8_t take_byte(reader *from)
{
    if (from->n == 0)
        return 0;
    from->n--;
    return *from->bytes++;
}

static uint32_t take(reader *from, uint8_t n)
{
    uint32_t value = 0;
    for (uint8_t i = 0; i < n; i++)
        value |= (uint32_t)take_byte(from) << (8 * i);
    return value;
}

#define WEFT_PAYLOAD_BEGIN(name, NAME)                                                                       \
    void weft_##name##_decode(const uint8_t *bytes, uint8_t n, weft_##name *value)                           \
    {                                                                                                        \
        reader from = {bytes, n};
#define WEFT_U8(field, text)  value->field = (uint8_t)take(&from, 1);
#define WEFT_U16(field, text) value->field = (uint16_t)take(&from, 2);
#define WEFT_U32(field, text) value->field = take(&from, 4);
#define WEFT_BYTES(field, count, text)                                                                       \
    for (uint8_t i = 0; i < (count); i++)                                                                    \
        value->field[i] = take_byte(&from);
#define WEFT_PAYLOAD_END(name, NAME)                                                                         \
    value->end_[0] = 0;                                                                                      \
    (void)from;                                                                                              \
    }
#include "firmware/protocol.def"

const char *weft_protocol_command_name(uint8_t opcode)
{
    switch (opcode) {
#define WEFT_COMMAND(number, NAME, name, text)                                                               \
    case number:                                                                                             \
        return #NAME;
#include "firmware/protocol.def"
    default:
        return "unknown";
    }
}

#define NAME_CASE(number, NAME, text)                                                                        \
    case number:                                                                                             \
        return #NAME;
#define TEXT_CASE(number, NAME, text)                                                                        \
    case number:                                                                                             \
        return text;

const char *weft_protocol_status_name(uint8_t status)
{
    switch (status) {
#define WEFT_STATUS NAME_CASE
#include "firmware/protocol.def"
    default:
        return "unknown";
    }
}

const char *weft_protocol_status_text(uint8_t status)
{
    switch (status) {
#define WEFT_STATUS TEXT_CASE
#include "firmware/protocol.def"
    default:
        return "unknown";
    }
}

const char *weft_protocol_state_name(uint8_t state)
{
    switch (state) {
#define WEFT_STATE NAME_CASE
#include "firmware/protocol.def"
    default:
        return "unknown";
    }
}

const char *weft_protocol_cause_name(uint8_t cause)
{
    switch (cause) {
#define WEFT_CAUSE NAME_CASE
#include "firmware/protocol.def"
    default:
        return "unknown";
    }
}

const char *weft_protocol_cause_text(uint8_t cause)
{
    switch (cause) {
#define WEFT_CAUSE TEXT_CASE
#include "firmware/protocol.def"
    default:
        return "unknown";
    }
}

const char *weft_protocol_reset_name(uint8_t cause)
{
    switch (cause) {
#define WEFT_RESET NAME_CASE
#include "firmware/protocol.def"
    default:
        return "unknown";
    }
}

const char *weft_protocol_reset_text(uint8_t cause)
{
    switch (cause) {
#define WEFT_RESET TEXT_CASE
#include "firmware/protocol.def"
    default:
        return "unknown";
    }
}

const char *weft_protocol_settings_name(uint8_t number)
{
    switch (number) {
#define WEFT_SETTINGS NAME_CASE
#include "firmware/protocol.def"
    default:
        return "unknown";
    }
}

const char *weft_protocol_fault_name(uint8_t number)
{
    switch (number) {
#define WEFT_FAULT NAME_CASE
#include "firmware/protocol.def"
    default:
        return "unknown";
    }
}

const char *weft_protocol_fault_text(uint8_t number)
{
    switch (number) {
#define WEFT_FAULT TEXT_CASE
#include "firmware/protocol.def"
    default:
        return "unknown";
    }
}
