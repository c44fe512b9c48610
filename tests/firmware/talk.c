#include "tests/firmware/talk.h"

#include "tests/support/support.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

weft_controller_sim *sim;
static uint8_t seq;

const char *elf_path(const char *name)
{
    static char path[1024];
    const char *const build = getenv("WEFT_TEST_BUILD");
    snprintf(path, sizeof path, "%s/%s", build ? build : "build", name);
    return path;
}

int power_on(void **state)
{
    (void)state;
    weft_error error = {0};
    if (weft_controller_sim_create_stepped(elf_path("firmware/weft-firmware.elf"), &sim, &error) != WEFT_OK) {
        print_error("%s\n", error.text);
        return 1;
    }
    weft_controller_sim_run(sim, 3000);
    return 0;
}

int power_off(void **state)
{
    (void)state;
    weft_controller_sim_destroy(sim);
    sim = NULL;
    return 0;
}

/* -- talking -------------------------------------------------------------------------------------------- */

uint8_t request(uint8_t *wire, uint8_t number, uint8_t command, const void *payload, uint8_t n)
{
    weft_frame f = {.version = WEFT_PROTOCOL_MAJOR, .seq = number, .command = command, .n = n};
    memcpy(f.payload, payload, n);
    return weft_frame_encode(&f, wire);
}

/* The next frame that comes within `ms`; false when none does. */
bool next_frame(weft_frame *f, int ms)
{
    uint8_t wire[WEFT_FRAME_WIRE_MAX];
    size_t n = 0;
    for (int i = 0; i < ms * 40; i++) {
        while (n < sizeof wire && weft_controller_sim_receive(sim, wire + n, 1) == 1)
            if (wire[n++] == 0) {
                assert_int_equal(weft_frame_decode(wire, n - 1, f), WEFT_FRAME_GOOD);
                return true;
            }
        weft_controller_sim_run(sim, 25);
    }
    return false;
}

/* Sends a command and gives the status of its reply, with the reply's payload in `reply`. */
int ask(uint8_t command, const void *payload, uint8_t n, weft_frame *reply)
{
    uint8_t wire[WEFT_FRAME_WIRE_MAX];
    weft_frame f;
    const uint8_t length = request(wire, ++seq, command, payload, n);
    weft_controller_sim_send(sim, wire, length);
    do
        assert_true(next_frame(reply ? reply : &f, 300));
    while ((reply ? reply : &f)->type == WEFT_FRAME_EVENT);
    if (!reply)
        reply = &f;
    assert_int_equal(reply->type, WEFT_FRAME_REPLY);
    assert_int_equal(reply->seq, seq);
    assert_int_equal(reply->command, command);
    return reply->payload[0];
}

int hello(weft_hello_reply *out)
{
    const weft_hello_request h = {.proto_major = 1, .salt = 0x1234567};
    uint8_t bytes[WEFT_HELLO_REQUEST_BYTES];
    weft_frame reply;
    weft_hello_request_encode(&h, bytes);
    const int status = ask(WEFT_CMD_HELLO, bytes, sizeof bytes, &reply);
    if (out)
        weft_hello_reply_decode(reply.payload + 1, (uint8_t)(reply.n - 1), out);
    return status;
}

int lease(uint16_t ms)
{
    const weft_lease_request l = {.lease_ms = ms};
    uint8_t bytes[WEFT_LEASE_REQUEST_BYTES];
    weft_lease_request_encode(&l, bytes);
    return ask(WEFT_CMD_LEASE, bytes, sizeof bytes, NULL);
}

uint8_t light_request(uint8_t *bytes, uint16_t mask, uint16_t level, uint16_t max_on_ms)
{
    const weft_light_request l = {.mask = mask, .level = level, .max_on_ms = max_on_ms};
    weft_light_request_encode(&l, bytes);
    return WEFT_LIGHT_REQUEST_BYTES;
}

int light(uint16_t mask, uint16_t level, uint16_t max_on_ms)
{
    uint8_t bytes[WEFT_LIGHT_REQUEST_BYTES];
    return ask(WEFT_CMD_LIGHT, bytes, light_request(bytes, mask, level, max_on_ms), NULL);
}

weft_status_reply status(void)
{
    weft_frame reply;
    weft_status_reply s;
    assert_int_equal(ask(WEFT_CMD_STATUS, "", 0, &reply), WEFT_STATUS_OK);
    weft_status_reply_decode(reply.payload + 1, (uint8_t)(reply.n - 1), &s);
    return s;
}

void take_lease(uint16_t ms)
{
    assert_int_equal(hello(NULL), WEFT_STATUS_OK);
    assert_int_equal(lease(ms), WEFT_STATUS_OK);
}

uint32_t lights(void)
{
    return weft_controller_sim_lights(sim, NULL);
}

double now_ms(void)
{
    return 1e3 * weft_controller_sim_time_s(sim);
}

/* When the lights went off, in ms of simulated time. */
double off_at_ms(void)
{
    double dark_s;
    weft_controller_sim_lights(sim, &dark_s);
    return now_ms() - 1e3 * dark_s;
}
