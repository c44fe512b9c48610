#include "firmware/fw_link.h"

#include "firmware/fw_board.h"
#include "firmware/fw_command.h"
#include "firmware/fw_config.h"
#include "firmware/fw_safety.h"
#include "firmware/protocol.h"

#include <string.h>

/* Written at `head`, read at `tail`; empty when equal; each index has one writer. */
static struct {
    uint8_t bytes[FW_RX_RING];
    volatile uint8_t head;  /* the receive interrupt */
    volatile uint8_t tail;  /* the loop */
    volatile uint8_t panic; /* the receive interrupt: `head` behind the last panic */
} rx;

static struct {
    uint8_t bytes[FW_TX_RING];
    volatile uint8_t head; /* the loop */
    volatile uint8_t tail; /* the transmit interrupt */
} tx;

static volatile uint16_t overruns; /* the receive interrupt */
static uint8_t zeros;              /* the receive interrupt */

/* The frame that is being collected. */
static struct {
    uint8_t bytes[WEFT_FRAME_WIRE_MAX];
    uint8_t n;
    bool too_long;
    bool after_return; /* the text line before ended with '\r': a '\n' belongs to it */
} frame;

/* The last command and its answer: a repeated command is answered, not run. */
static struct {
    uint8_t reply[WEFT_FRAME_WIRE_MAX];
    uint8_t n; /* 0: none yet */
    uint8_t seq;
    uint16_t crc;
} last;

static uint32_t frames;
static uint16_t crc_errors;
static uint8_t event_seq;

void fw_link_init(void)
{
    rx.head = rx.tail = rx.panic = 0;
    tx.head = tx.tail = 0;
    overruns = 0;
    zeros = 0;
    frame.n = 0;
    frame.too_long = frame.after_return = false;
    last.n = 0;
    frames = 0;
    crc_errors = 0;
    event_seq = 0;
}

/* -- interrupts ----------------------------------------------------------------------------------------- */

static void count_overrun(void)
{
    if (overruns != UINT16_MAX)
        overruns++;
}

void fw_link_on_byte(uint8_t byte, bool damaged)
{
    const uint8_t next = (uint8_t)(rx.head + 1) & (FW_RX_RING - 1);
    if (damaged)
        count_overrun();
    if (next == rx.tail) {
        count_overrun();
    } else {
        rx.bytes[rx.head] = byte;
        rx.head = next;
    }
    zeros = byte == 0 ? (uint8_t)(zeros + 1) : 0;
    if (zeros == WEFT_PANIC_ZEROS) {
        zeros = 0;
        rx.panic = rx.head;
        fw_safety_panic();
    }
}

bool fw_link_next_byte(uint8_t *byte)
{
    if (tx.tail == tx.head)
        return false;
    *byte = tx.bytes[tx.tail];
    tx.tail = (uint8_t)(tx.tail + 1) & (FW_TX_RING - 1);
    return true;
}

/* -- the loop ------------------------------------------------------------------------------------------- */

/* All or nothing: half a frame would cost the next one too. */
static void send(const uint8_t *bytes, uint8_t n)
{
    const uint8_t used = (uint8_t)(tx.head - tx.tail) & (FW_TX_RING - 1);
    if (n > FW_TX_RING - 1 - used)
        return;
    uint8_t head = tx.head;
    for (uint8_t i = 0; i < n; i++) {
        tx.bytes[head] = bytes[i];
        head = (uint8_t)(head + 1) & (FW_TX_RING - 1);
    }
    tx.head = head;
    fw_board_send();
}

bool fw_link_has_room(uint8_t n)
{
    const uint8_t used = (uint8_t)(tx.head - tx.tail) & (FW_TX_RING - 1);
    return n + (WEFT_FRAME_WIRE_MAX - WEFT_PAYLOAD_MAX) <= FW_TX_RING - 1 - used;
}

void fw_link_send_event(uint8_t number, const uint8_t *payload, uint8_t n)
{
    uint8_t wire[WEFT_FRAME_WIRE_MAX];
    weft_frame event = {.version = WEFT_PROTOCOL_MAJOR,
                        .type = WEFT_FRAME_EVENT,
                        .seq = event_seq++,
                        .command = number,
                        .n = n};
    memcpy(event.payload, payload, n);
    send(wire, weft_frame_encode(&event, wire));
}

/* Turns the request in `f` into a reply that only says `status`. */
static void send_refusal(weft_frame *f, uint8_t status)
{
    uint8_t wire[WEFT_FRAME_WIRE_MAX];
    f->version = WEFT_PROTOCOL_MAJOR;
    f->type = WEFT_FRAME_REPLY;
    f->n = 1;
    f->payload[0] = status;
    send(wire, weft_frame_encode(f, wire));
}

static void count_bad_frame(void)
{
    if (crc_errors != UINT16_MAX)
        crc_errors++;
}

static void answer(weft_frame *f)
{
    fw_safety_host_lives();
    frames++;
    if (last.n == 0 || f->seq != last.seq || f->crc != last.crc) {
        last.seq = f->seq;
        last.crc = f->crc;
        fw_command_run(f);
        last.n = weft_frame_encode(f, last.reply);
    }
    send(last.reply, last.n);
}

static void take_frame(void)
{
    weft_frame f;
    switch (frame.too_long ? WEFT_FRAME_BAD_CODING : weft_frame_decode(frame.bytes, frame.n, &f)) {
    case WEFT_FRAME_BAD_CODING:
        count_bad_frame();
        break;
    case WEFT_FRAME_BAD_CRC:
        count_bad_frame();
        send_refusal(&f, WEFT_STATUS_BAD_CRC);
        break;
    case WEFT_FRAME_GOOD:
        if (f.type != WEFT_FRAME_REQUEST)
            count_bad_frame(); /* an echo of our own words, say */
        else if (f.version != WEFT_PROTOCOL_MAJOR)
            send_refusal(&f, WEFT_STATUS_BAD_VERSION);
        else
            answer(&f);
        break;
    }
}

static void introduce_myself(void)
{
    static const char text[] = "Weft light controller " FW_VERSION_TEXT " (" FW_GIT_ID
                               "), protocol " FW_PROTOCOL_TEXT ", up to 10 lights\r\n";
    send((const uint8_t *)text, sizeof text - 1);
}

/* No frame begins like text: the first byte of a frame is a COBS code, at most WEFT_FRAME_WIRE_MAX - 1,
 * and '?' and all letters are above that.  So a person's line, or a modem probe's "AT", ends at its line
 * end and does not spoil the frame after it. */
_Static_assert('?' > WEFT_FRAME_WIRE_MAX, "a frame could begin with '?'");

static bool is_text(void)
{
    return frame.n > 0 && frame.bytes[0] > WEFT_FRAME_WIRE_MAX;
}

/* @return whether it ended a frame or a line */
static bool take_byte(uint8_t byte)
{
    const bool rest_of_line_end = byte == '\n' && frame.after_return;
    frame.after_return = byte == '\r' && is_text();
    if (rest_of_line_end)
        return false;
    if (byte == 0) {
        if (frame.n > 0)
            take_frame();
    } else if ((byte == '\n' || byte == '\r') && is_text()) {
        if (frame.n == 1 && frame.bytes[0] == '?')
            introduce_myself();
    } else {
        if (frame.n < sizeof frame.bytes)
            frame.bytes[frame.n++] = byte;
        else
            frame.too_long = true;
        return false;
    }
    frame.n = 0;
    frame.too_long = false;
    return true;
}

bool fw_link_has_bytes(void)
{
    return rx.tail != rx.head;
}

void fw_link_poll(void)
{
    /* One frame at a time, and no more bytes than the ring holds: a flood must not keep the loop from the
     * lamps' time limits and the watchdog. */
    for (uint8_t i = 0; i < FW_RX_RING; i++) {
        fw_safety_poll(); /* a panic or the end of the lease comes before the command behind it */
        if (!fw_link_has_bytes())
            break;
        const uint8_t byte = rx.bytes[rx.tail];
        rx.tail = (uint8_t)(rx.tail + 1) & (FW_RX_RING - 1);
        if (take_byte(byte))
            break;
    }
}

void fw_link_discard(void)
{
    const uint8_t was = fw_board_lock();
    rx.tail = rx.panic;
    fw_board_unlock(was);
    frame.n = 0;
    frame.too_long = false;
}

uint32_t fw_link_frames(void)
{
    return frames;
}

uint16_t fw_link_crc_errors(void)
{
    return crc_errors;
}

uint16_t fw_link_overruns(void)
{
    const uint8_t was = fw_board_lock();
    const uint16_t n = overruns;
    fw_board_unlock(was);
    return n;
}
