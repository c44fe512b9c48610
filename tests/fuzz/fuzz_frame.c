/*
 * libFuzzer over the decoder of the serial line: what a host makes of any bytes from the port.  A frame that
 * it believes must be one that could have been sent: encoded again, it gives the same bytes.
 */
#include "firmware/protocol.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Every payload that a host decodes, from exactly the bytes that came. */
static void decode_payloads(const weft_frame *frame)
{
    uint8_t *const bytes = malloc(frame->n ? frame->n : 1u); /* so that reading beyond it is found */
    if (!bytes)
        return;
    memcpy(bytes, frame->payload, frame->n);
#define WEFT_PAYLOAD_BEGIN(name, NAME)                                                                       \
    {                                                                                                        \
        weft_##name value;                                                                                   \
        weft_##name##_decode(bytes, frame->n, &value);                                                       \
    }
#include "firmware/protocol.def"
    free(bytes);
}

static void take_frame(const uint8_t *wire, size_t n)
{
    weft_frame frame;
    uint8_t again[WEFT_FRAME_WIRE_MAX];
    if (weft_frame_decode(wire, n, &frame) != WEFT_FRAME_GOOD)
        return;
    decode_payloads(&frame);
    const size_t length = weft_frame_encode(&frame, again);
    if (length != n + 1 || memcmp(again, wire, n) != 0)
        abort();
}

/* The input as it comes from the line, and as the inside of a frame with its CRC made right. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    size_t begin = 0;
    for (size_t i = 0; i < size; i++)
        if (data[i] == 0) {
            take_frame(data + begin, i - begin);
            begin = i + 1;
        }
    weft_frame frame = {.n = (uint8_t)(size > 3 ? size - 3 : 0)};
    if (size >= 3 && size - 3 <= WEFT_PAYLOAD_MAX) {
        frame.version = data[0] >> 4;
        frame.type = data[0] & 15;
        frame.seq = data[1];
        frame.command = data[2];
        memcpy(frame.payload, data + 3, frame.n);
        uint8_t wire[WEFT_FRAME_WIRE_MAX];
        take_frame(wire, weft_frame_encode(&frame, wire) - 1u);
    }
    return 0;
}
