#include "firmware/fw_safety.h"

#include "firmware/fw_board.h"
#include "firmware/fw_config.h"
#include "firmware/fw_light.h"
#include "firmware/fw_link.h"
#include "firmware/fw_sequence.h"
#include "firmware/protocol.h"

static struct {
    uint32_t nonce;
    uint16_t lease_ms; /* 0: none */
    uint16_t heard_ms; /* when the last valid frame came */
    uint8_t cause;     /* WEFT_CAUSE_NONE unless latched */
    bool hello;        /* since the start or SAFE */
} safety;

/* Written by the receive interrupt (true) and by fw_safety_poll() (false). */
static volatile bool panicked;

void fw_safety_init(void)
{
    safety.nonce = 0;
    safety.lease_ms = 0;
    safety.cause = WEFT_CAUSE_NONE;
    safety.hello = false;
    panicked = false;
}

void fw_safety_host_lives(void)
{
    safety.heard_ms = fw_board_ms();
}

uint32_t fw_safety_hello(uint32_t salt)
{
    safety.hello = true;
    if (safety.nonce == 0)
        safety.nonce = (salt ^ fw_board_ticks()) | 1u;
    return safety.nonce;
}

uint32_t fw_safety_boot_nonce(void)
{
    return safety.nonce;
}

static void latch(uint8_t cause)
{
    fw_sequence_stop();
    fw_sequence_forgive();
    fw_light_off();
    safety.lease_ms = 0;
    safety.hello = false;
    safety.cause = cause;
}

static void tell(void)
{
    const weft_safe_event event = {.cause = safety.cause, .tick = fw_light_off_tick()};
    uint8_t payload[WEFT_SAFE_EVENT_BYTES];
    weft_safe_event_encode(&event, payload);
    fw_link_send_event(WEFT_EVENT_SAFE, payload, sizeof payload);
}

uint8_t fw_safety_lease(uint16_t ms, uint16_t *granted_ms)
{
    *granted_ms = 0;
    if (ms == 0) {
        latch(WEFT_CAUSE_RELEASED);
        return WEFT_STATUS_OK;
    }
    if (!safety.hello)
        return WEFT_STATUS_SAFE_LATCHED;
    if (ms < FW_LEASE_MIN_MS)
        ms = FW_LEASE_MIN_MS;
    if (ms > FW_LEASE_MAX_MS)
        ms = FW_LEASE_MAX_MS;
    safety.lease_ms = ms;
    safety.cause = WEFT_CAUSE_NONE;
    *granted_ms = ms;
    return WEFT_STATUS_OK;
}

uint8_t fw_safety_allows_light(void)
{
    if (safety.cause != WEFT_CAUSE_NONE)
        return WEFT_STATUS_SAFE_LATCHED;
    return safety.lease_ms ? WEFT_STATUS_OK : WEFT_STATUS_NOT_LEASED;
}

void fw_safety_panic(void)
{
    fw_light_dark();
    panicked = true;
}

bool fw_safety_panicked(void)
{
    return panicked;
}

/* On the board's own LED, out of the way of photographs: dark as soon as a host holds a lease, a short
 * flash a second before that, four a second when SAFE. */
static void show_state(void)
{
    const uint16_t ms = fw_board_ms();
    switch (fw_safety_state()) {
    case WEFT_STATE_BOOT:
        fw_board_status_led((ms & 1023u) < 64u);
        break;
    case WEFT_STATE_SAFE:
        fw_board_status_led((ms & 255u) < 64u);
        break;
    default:
        fw_board_status_led(false);
    }
}

void fw_safety_poll(void)
{
    if (panicked) {
        fw_link_discard(); /* what was said before the panic no longer counts */
        latch(WEFT_CAUSE_PANIC);
        panicked = false;
        tell();
    } else if (safety.lease_ms && fw_safety_lease_left_ms() == 0) {
        latch(WEFT_CAUSE_LEASE_EXPIRED);
        tell();
    }
    show_state();
}

uint8_t fw_safety_state(void)
{
    if (safety.cause != WEFT_CAUSE_NONE)
        return WEFT_STATE_SAFE;
    if (safety.lease_ms == 0)
        return WEFT_STATE_BOOT;
    if (fw_sequence_is_running())
        return WEFT_STATE_RUNNING;
    if (fw_light_mask())
        return WEFT_STATE_LIT;
    return fw_sequence_has_failed() ? WEFT_STATE_FAULT : WEFT_STATE_IDLE;
}

uint8_t fw_safety_cause(void)
{
    return safety.cause;
}

uint16_t fw_safety_lease_left_ms(void)
{
    const uint16_t silent_ms = (uint16_t)(fw_board_ms() - safety.heard_ms);
    return silent_ms < safety.lease_ms ? (uint16_t)(safety.lease_ms - silent_ms) : 0;
}
