/* The real firmware on a simulated ATmega328P, stepped: what goes in on the line, what the lights do. */
#include "tests/firmware/talk.h"
#include "tests/support/support.h"

#include <stdio.h>
#include <string.h>

/* -- tests ---------------------------------------------------------------------------------------------- */

static void test_starts_dark_at_the_right_rate(void **state)
{
    (void)state;
    weft_controller_sim_counters c;
    weft_controller_sim_get_counters(sim, &c);
    assert_near(c.bits_per_s, 500000, 0.5);
    assert_int_equal(lights(), 0);
    weft_hello_reply h;
    assert_int_equal(hello(&h), WEFT_STATUS_OK);
    assert_int_equal(h.magic, WEFT_PROTOCOL_MAGIC);
    assert_int_equal(h.n_lights, 10);
    assert_int_equal(h.level_max, 256);
    assert_int_equal(h.tick_hz, 250000);
    assert_int_equal(h.reset_cause, WEFT_RESET_POWER_ON);
    assert_int_not_equal(h.boot_nonce, 0);
    assert_int_equal(status().state, WEFT_STATE_BOOT);
    assert_int_equal(light(1, 256, 100), WEFT_STATUS_NOT_LEASED);
    assert_int_equal(lights(), 0);
}

static void test_answers_a_person(void **state)
{
    (void)state;
    char text[256] = "";
    weft_controller_sim_send(sim, (const uint8_t *)"AT\r\n?\r\n", 7);
    weft_controller_sim_run(sim, 5000);
    const size_t n = weft_controller_sim_receive(sim, (uint8_t *)text, sizeof text - 1);
    assert_non_null(strstr(text, "Weft light controller 1.1.0"));
    assert_non_null(strstr(text, "protocol 1.1"));
    assert_string_equal(text + n - 2, "\r\n");
    assert_ptr_equal(strstr(text, "Weft"), text);
    assert_int_equal(hello(NULL), WEFT_STATUS_OK); /* and is still in step with frames */
    assert_int_equal(status().crc_errors, 0);
}

static void test_clock_counts_in_step(void **state)
{
    (void)state;
    const double before_first_ms = now_ms();
    const uint32_t first = status().ticks;
    const double after_first_ms = now_ms();
    weft_controller_sim_run(sim, 60e6);
    const double before_second_ms = now_ms();
    const uint32_t second = status().ticks;
    const double after_second_ms = now_ms(), ticked_ms = (second - first) / 250.0;
    assert_true(ticked_ms >= before_second_ms - after_first_ms - 0.004);
    assert_true(ticked_ms <= after_second_ms - before_first_ms + 0.004);
}

/* A set of lights and a level reach exactly the pins they should, for exactly the time. */
static void test_every_light_and_level_exactly(void **state)
{
    (void)state;
    static const uint16_t levels[] = {1, 2, 77, 128, 200, 255, 256};
    double fraction[WEFT_SIM_N_LIGHTS];
    take_lease(5000);
    for (int i = 0; i < WEFT_SIM_N_LIGHTS; i++)
        for (size_t k = 0; k < sizeof levels / sizeof levels[0]; k++) {
            assert_int_equal(light((uint16_t)(1u << i), levels[k], 2000), WEFT_STATUS_OK);
            assert_true(weft_controller_sim_expose(sim, 10000, fraction));
            for (int j = 0; j < WEFT_SIM_N_LIGHTS; j++)
                assert_near(fraction[j], i == j ? levels[k] / 256.0 : 0, 1e-12);
        }
    assert_int_equal(light(0x3ff, 256, 2000), WEFT_STATUS_OK);
    assert_true(weft_controller_sim_expose(sim, 1000, fraction));
    for (int j = 0; j < WEFT_SIM_N_LIGHTS; j++)
        assert_near(fraction[j], 1, 0);
}

/* An exposure during which a light goes off sees the part that was lit. */
static void test_part_of_an_exposure(void **state)
{
    (void)state;
    double fraction[WEFT_SIM_N_LIGHTS];
    take_lease(5000);
    assert_int_equal(light(1 << 3, 128, 50), WEFT_STATUS_OK);
    const double begin_ms = now_ms();
    assert_true(weft_controller_sim_expose(sim, 100000, fraction));
    assert_near(now_ms() - begin_ms, 100, 0.001);
    assert_near(fraction[3], 0.5 * (off_at_ms() - begin_ms) / 100, 1e-6);
    assert_true(fraction[3] > 0.24 && fraction[3] <= 0.25);
}

static void test_two_lights_are_never_on_together(void **state)
{
    (void)state;
    weft_controller_sim_counters c;
    take_lease(5000);
    for (int i = 0; i < 200; i++) {
        assert_int_equal(light((uint16_t)(1u << (i * 7 + i / 10) % 10), i % 3 ? 256 : 100, 2000),
                         WEFT_STATUS_OK);
        assert_int_equal(__builtin_popcount(lights()), 1);
    }
    weft_controller_sim_get_counters(sim, &c);
    assert_int_equal(c.most_lights, 1);
    assert_int_equal(light(0x3, 256, 2000), WEFT_STATUS_OK);
    weft_controller_sim_get_counters(sim, &c);
    assert_int_equal(c.most_lights, 2); /* the counter can count */
}

static void test_the_same_light_again_does_not_blink(void **state)
{
    (void)state;
    double fraction[WEFT_SIM_N_LIGHTS], dark_s;
    take_lease(5000);
    assert_int_equal(light(1, 100, 30), WEFT_STATUS_OK);
    const double begin_ms = now_ms();
    for (int i = 0; i < 10; i++) {
        uint8_t wire[WEFT_FRAME_WIRE_MAX], bytes[WEFT_LIGHT_REQUEST_BYTES];
        weft_frame reply;
        const uint8_t n =
            request(wire, (uint8_t)(100 + i), WEFT_CMD_LIGHT, bytes, light_request(bytes, 1, 100, 30));
        weft_controller_sim_send(sim, wire, n); /* is heard during the exposure */
        assert_true(weft_controller_sim_expose(sim, 20000, fraction));
        assert_near(fraction[0], 100 / 256.0, 1e-12);
        assert_true(next_frame(&reply, 1));
        assert_int_equal(reply.payload[0], WEFT_STATUS_OK);
    }
    assert_true(now_ms() - begin_ms > 200);
    assert_int_equal(weft_controller_sim_lights(sim, &dark_s), 1);
    assert_near(dark_s, 0, 0);
}

static void test_max_on_ends_a_light(void **state)
{
    (void)state;
    take_lease(5000);
    static const uint16_t times_ms[] = {1, 2, 50, 777, 2000};
    for (size_t i = 0; i < sizeof times_ms / sizeof times_ms[0]; i++) {
        uint8_t wire[WEFT_FRAME_WIRE_MAX], bytes[WEFT_LIGHT_REQUEST_BYTES];
        double fraction[WEFT_SIM_N_LIGHTS];
        weft_frame reply;
        const uint8_t n = request(wire, (uint8_t)(100 + i), WEFT_CMD_LIGHT, bytes,
                                  light_request(bytes, 1 << 9, 256, times_ms[i]));
        weft_controller_sim_send(sim, wire, n);
        assert_true(weft_controller_sim_expose(sim, 3000000, fraction)); /* the whole light is in it */
        const double lit_ms = 3000 * fraction[9];
        assert_true(lit_ms <= times_ms[i] + 0.05 && lit_ms >= times_ms[i] - 1.05);
        assert_true(next_frame(&reply, 1));
        assert_int_equal(status().state, WEFT_STATE_IDLE);
        assert_int_equal(status().max_on_offs, (int)i + 1);
    }
    assert_int_equal(light(1, 256, 2001), WEFT_STATUS_LIMIT);
    assert_int_equal(light(1, 256, 0), WEFT_STATUS_BAD_ARG);
    assert_int_equal(light(1, 257, 10), WEFT_STATUS_BAD_ARG);
    assert_int_equal(light(1 << 10, 256, 10), WEFT_STATUS_BAD_ARG);
    assert_int_equal(lights(), 0);
}

static void test_lease_expires_into_safe(void **state)
{
    (void)state;
    static const uint16_t leases_ms[] = {100, 500, 1000, 1900};
    for (size_t i = 0; i < sizeof leases_ms / sizeof leases_ms[0]; i++) {
        weft_frame event;
        take_lease(leases_ms[i]);
        assert_int_equal(light(1 << 5, 256, 2000), WEFT_STATUS_OK);
        const double heard_ms = now_ms();
        weft_controller_sim_run(sim, 1000.0 * (leases_ms[i] - 2.5));
        assert_int_equal(lights(), 1 << 5);
        assert_true(next_frame(&event, 10));
        assert_int_equal(lights(), 0);
        assert_true(off_at_ms() <= heard_ms + leases_ms[i]);
        assert_int_equal(event.type, WEFT_FRAME_EVENT);
        assert_int_equal(event.command, WEFT_EVENT_SAFE);
        assert_int_equal(event.payload[0], WEFT_CAUSE_LEASE_EXPIRED);
        assert_int_equal(event.seq, i);
        assert_int_equal(status().state, WEFT_STATE_SAFE);
    }
}

static void test_safe_is_left_by_hello_and_lease_only(void **state)
{
    (void)state;
    take_lease(100);
    weft_controller_sim_run(sim, 200e3);
    assert_int_equal(status().safe_cause, WEFT_CAUSE_LEASE_EXPIRED);
    assert_int_equal(light(1, 256, 100), WEFT_STATUS_SAFE_LATCHED);
    assert_int_equal(lease(1000), WEFT_STATUS_SAFE_LATCHED); /* look first */
    assert_int_equal(light(1, 256, 100), WEFT_STATUS_SAFE_LATCHED);
    assert_int_equal(hello(NULL), WEFT_STATUS_OK);
    assert_int_equal(light(1, 256, 100), WEFT_STATUS_SAFE_LATCHED); /* looking is not enough */
    assert_int_equal(lights(), 0);
    assert_int_equal(lease(1000), WEFT_STATUS_OK);
    assert_int_equal(status().state, WEFT_STATE_IDLE);
    assert_int_equal(light(1, 256, 100), WEFT_STATUS_OK);
    assert_int_equal(lights(), 1);
    assert_int_equal(lease(0), WEFT_STATUS_OK); /* given back */
    assert_int_equal(lights(), 0);
    assert_int_equal(status().safe_cause, WEFT_CAUSE_RELEASED);
}

static void test_panic_bytes_in_mid_frame(void **state)
{
    (void)state;
    uint8_t wire[WEFT_FRAME_WIRE_MAX + 3], bytes[WEFT_LIGHT_REQUEST_BYTES];
    weft_frame event;
    take_lease(5000);
    assert_int_equal(light(1 << 7, 256, 2000), WEFT_STATUS_OK);
    const uint8_t n = request(wire, 200, WEFT_CMD_LIGHT, bytes, light_request(bytes, 1, 256, 2000));
    memset(wire + n / 2, 0, 3); /* the host dies half-way through a frame, its crash handler still speaks */
    weft_controller_sim_send(sim, wire, n / 2u + 3u);
    assert_int_equal(lights(), 1 << 7);
    const double sent_ms = now_ms();
    weft_controller_sim_run(sim, 1000);
    assert_int_equal(lights(), 0);
    const int sent = n / 2 + 3;
    assert_true(off_at_ms() - sent_ms < (sent + 1.5) * 0.022); /* with the third byte, not later */
    do
        assert_true(next_frame(&event, 20));
    while (event.type != WEFT_FRAME_EVENT);
    assert_int_equal(event.payload[0], WEFT_CAUSE_PANIC);
    assert_int_equal(status().safe_cause, WEFT_CAUSE_PANIC);
    assert_int_equal(light(1, 256, 100), WEFT_STATUS_SAFE_LATCHED);
    take_lease(1000);
    assert_int_equal(light(1, 256, 100), WEFT_STATUS_OK);
}

/* What stands in the buffer before the panic is not carried out after it, also when all of it comes in one
 * burst; what comes after it is. */
static void test_panic_overtakes_commands(void **state)
{
    (void)state;
    uint8_t wire[256], bytes[WEFT_LIGHT_REQUEST_BYTES];
    take_lease(5000);
    size_t n = request(wire, 201, WEFT_CMD_LIGHT, bytes, light_request(bytes, 1, 256, 2000));
    wire[n++] = 0;
    wire[n++] = 0;
    n += request(wire + n, 202, WEFT_CMD_LIGHT, bytes, light_request(bytes, 2, 256, 2000));
    weft_controller_sim_send(sim, wire, n);
    weft_controller_sim_run(sim, 20e3);
    assert_int_equal(lights(), 0);
    weft_frame f;
    bool refused = false;
    while (next_frame(&f, 5))
        refused |= f.type == WEFT_FRAME_REPLY && f.seq == 202 && f.payload[0] == WEFT_STATUS_SAFE_LATCHED;
    assert_true(refused);
    assert_int_equal(status().safe_cause, WEFT_CAUSE_PANIC);
}

static void test_a_repeated_frame_is_answered_but_not_run(void **state)
{
    (void)state;
    uint8_t wire[WEFT_FRAME_WIRE_MAX], bytes[WEFT_LIGHT_REQUEST_BYTES];
    weft_frame first, again;
    take_lease(5000);
    const uint8_t n = request(wire, 77, WEFT_CMD_LIGHT, bytes, light_request(bytes, 1 << 4, 256, 50));
    weft_controller_sim_send(sim, wire, n);
    assert_true(next_frame(&first, 20));
    const double begin_ms = now_ms();
    weft_controller_sim_run(sim, 40e3);
    weft_controller_sim_send(sim, wire, n);
    assert_true(next_frame(&again, 20));
    assert_int_equal(again.n, first.n);
    assert_int_equal(again.seq, 77);
    assert_memory_equal(again.payload, first.payload, first.n); /* the same on tick */
    assert_int_equal(lights(), 1 << 4);
    weft_controller_sim_run(sim, 20e3);
    assert_int_equal(lights(), 0); /* the 50 ms were not begun anew */
    assert_true(off_at_ms() - begin_ms < 50);
    weft_controller_sim_send(sim, wire, n); /* and it does not come on again */
    assert_true(next_frame(&again, 20));
    assert_memory_equal(again.payload, first.payload, first.n);
    assert_int_equal(lights(), 0);
    /* the same sequence number with other content is another command */
    request(wire, 77, WEFT_CMD_LIGHT, bytes, light_request(bytes, 1 << 2, 256, 50));
    weft_controller_sim_send(sim, wire, n);
    assert_true(next_frame(&again, 20));
    assert_int_equal(lights(), 1 << 2);
}

static void test_damaged_frames_are_never_run(void **state)
{
    (void)state;
    uint64_t seed = 5;
    uint8_t wire[WEFT_FRAME_WIRE_MAX], bytes[WEFT_LIGHT_REQUEST_BYTES];
    weft_frame f;
    take_lease(5000);
    int refused = 0;
    for (int i = 0; i < 400; i++) {
        const uint8_t n =
            request(wire, (uint8_t)i, WEFT_CMD_LIGHT, bytes, light_request(bytes, 0x3ff, 256, 2000));
        /* never into a zero byte or out of one: frames stay frames */
        const size_t at = (size_t)(weft_test_random(&seed) * (n - 1));
        const uint8_t was = wire[at];
        while (wire[at] == was || wire[at] == 0)
            wire[at] = (uint8_t)(weft_test_random(&seed) * 256);
        weft_controller_sim_send(sim, wire, n);
        weft_controller_sim_run(sim, 1200);
        assert_int_equal(lights(), 0);
        while (next_frame(&f, 0))
            ;
        while (weft_controller_sim_run(sim, 500) && next_frame(&f, 1))
            refused += f.payload[0] == WEFT_STATUS_BAD_CRC;
    }
    assert_true(refused > 100);
    const weft_status_reply s = status();
    assert_int_equal(s.state, WEFT_STATE_IDLE);
    assert_int_equal(s.crc_errors, 400);
}

static void test_unknown_and_foreign_commands(void **state)
{
    (void)state;
    uint8_t wire[WEFT_FRAME_WIRE_MAX];
    weft_frame reply;
    assert_int_equal(ask(0x2f, "", 0, &reply), WEFT_STATUS_BAD_CMD);
    assert_int_equal(reply.n, 1);
    assert_int_equal(ask(0x3f, "", 0, NULL), WEFT_STATUS_BAD_CMD);
    assert_int_equal(ask(WEFT_CMD_LIGHT, "\1", 1, NULL), WEFT_STATUS_BAD_ARG);
    assert_int_equal(hello(NULL), WEFT_STATUS_OK);
    assert_int_equal(ask(WEFT_CMD_LEASE, "\xe8\x03 more from a newer minor", 25, NULL), WEFT_STATUS_OK);
    const weft_frame newer = {.version = 2, .seq = 9, .command = WEFT_CMD_HELLO};
    weft_controller_sim_send(sim, wire, weft_frame_encode(&newer, wire));
    assert_true(next_frame(&reply, 20));
    assert_int_equal(reply.version, WEFT_PROTOCOL_MAJOR);
    assert_int_equal(reply.payload[0], WEFT_STATUS_BAD_VERSION);
}

static void test_flood_does_no_harm(void **state)
{
    (void)state;
    uint64_t seed = 6;
    uint8_t noise[3000];
    take_lease(5000);
    for (size_t i = 0; i < sizeof noise; i++)
        noise[i] = (uint8_t)(weft_test_random(&seed) * 256);
    weft_controller_sim_send(sim, noise, sizeof noise);
    weft_controller_sim_send(sim, (const uint8_t *)"\0", 1);
    weft_controller_sim_run(sim, 100e3);
    assert_int_equal(lights(), 0);
    weft_controller_sim_counters c;
    weft_controller_sim_get_counters(sim, &c);
    assert_int_equal(c.overruns, 0); /* the receive interrupt keeps up with the line */
    uint8_t rest[64];
    while (weft_controller_sim_receive(sim, rest, sizeof rest))
        ;
    take_lease(1000);
    assert_int_equal(status().overruns, 0);
    assert_true(status().crc_errors > 0);
}

/* Commands without a pause, faster than they can be answered: the time limit of the lights holds, and the
 * watchdog has no reason. */
static void test_flood_of_commands_delays_nothing(void **state)
{
    (void)state;
    uint8_t wire[WEFT_FRAME_WIRE_MAX], rest[256];
    weft_controller_sim_counters c;
    take_lease(5000);
    assert_int_equal(light(1 << 8, 256, 300), WEFT_STATUS_OK);
    const double begin_ms = now_ms();
    for (int i = 0; i < 5000; i++)
        weft_controller_sim_send(sim, wire, request(wire, (uint8_t)i, WEFT_CMD_STATUS, "", 0));
    weft_controller_sim_run(sim, 900e3);
    assert_int_equal(lights(), 0);
    assert_true(off_at_ms() - begin_ms < 302);
    weft_controller_sim_send(sim, (const uint8_t *)"", 1); /* ends a frame that has lost its end */
    weft_controller_sim_run(sim, 100e3);
    weft_controller_sim_get_counters(sim, &c);
    assert_int_equal(c.resets, 0);
    while (weft_controller_sim_receive(sim, rest, sizeof rest))
        ;
    assert_true(status().overruns > 0); /* it was a flood */
}

static void test_watchdog_ends_a_hang_in_darkness(void **state)
{
    (void)state;
    weft_controller_sim_counters c;
    weft_hello_reply h;
    take_lease(5000);
    assert_int_equal(hello(&h), WEFT_STATUS_OK);
    const uint32_t nonce = h.boot_nonce;
    assert_int_equal(light(0x155, 200, 2000), WEFT_STATUS_OK);
    const double hang_ms = now_ms();
    weft_controller_sim_hang(sim);
    weft_controller_sim_run(sim, 200e3);
    assert_int_equal(lights(), 0x155); /* it does hang */
    weft_controller_sim_run(sim, 100e3);
    assert_int_equal(lights(), 0);
    assert_true(off_at_ms() - hang_ms < 270);
    weft_controller_sim_run(sim, 1e6);
    assert_int_equal(lights(), 0); /* and it does not come back by itself, nor reset for ever */
    weft_controller_sim_get_counters(sim, &c);
    assert_int_equal(c.resets, 1);
    assert_int_equal(status().boot_nonce, 0);
    assert_int_equal(status().resets, 1);
    assert_int_equal(light(1, 256, 100), WEFT_STATUS_NOT_LEASED);
    assert_int_equal(hello(&h), WEFT_STATUS_OK);
    assert_int_equal(h.reset_cause, WEFT_RESET_WATCHDOG);
    assert_int_not_equal(h.boot_nonce, nonce);
}

static void test_panic_works_while_the_program_hangs(void **state)
{
    (void)state;
    take_lease(5000);
    assert_int_equal(light(1, 256, 2000), WEFT_STATUS_OK);
    weft_controller_sim_hang(sim);
    weft_controller_sim_send(sim, (const uint8_t *)"\0\0\0", 3);
    weft_controller_sim_run(sim, 200);
    assert_int_equal(lights(), 0);
}

static void test_reset_button(void **state)
{
    (void)state;
    weft_hello_reply h;
    double fraction[WEFT_SIM_N_LIGHTS];
    take_lease(5000);
    assert_int_equal(light(1 << 6, 256, 2000), WEFT_STATUS_OK);
    weft_controller_sim_reset(sim);
    assert_int_equal(lights(), 0);
    assert_true(weft_controller_sim_expose(sim, 5000, fraction)); /* timers live on after a reset */
    assert_near(fraction[6], 0, 0);
    assert_int_equal(hello(&h), WEFT_STATUS_OK);
    assert_int_equal(h.reset_cause, WEFT_RESET_EXTERNAL);
    assert_int_equal(status().resets, 1);
}

static int set_setting(uint8_t key, uint8_t index, const char *value, size_t n)
{
    weft_cfg_set_request r = {.key = key, .index = index};
    uint8_t bytes[WEFT_CFG_SET_REQUEST_BYTES];
    memcpy(r.value, value, n);
    weft_cfg_set_request_encode(&r, bytes);
    return ask(WEFT_CMD_CFG_SET, bytes, sizeof bytes, NULL);
}

static void test_settings_survive_power_off_and_count(void **state)
{
    (void)state;
    weft_hello_reply h;
    double fraction[WEFT_SIM_N_LIGHTS];
    assert_int_equal(hello(&h), WEFT_STATUS_OK);
    assert_int_equal(h.settings_state, WEFT_SETTINGS_DEFAULTS);
    assert_int_equal(h.serial_number[0], 0);
    assert_int_equal(set_setting(WEFT_KEY_SERIAL_NUMBER, 0, "WL-7", 4), WEFT_STATUS_OK);
    assert_int_equal(set_setting(WEFT_KEY_N_LIGHTS, 0, "\6", 1), WEFT_STATUS_OK);
    assert_int_equal(set_setting(WEFT_KEY_MAX_ON, 0, "\x64", 1), WEFT_STATUS_OK);
    assert_int_equal(set_setting(WEFT_KEY_TRIM, 2, "\x40", 1), WEFT_STATUS_OK);
    weft_controller_sim_power_cycle(sim);
    weft_controller_sim_run(sim, 3000);
    assert_int_equal(hello(&h), WEFT_STATUS_OK);
    assert_int_equal(h.reset_cause, WEFT_RESET_POWER_ON);
    assert_int_equal(h.settings_state, WEFT_SETTINGS_LOADED);
    assert_memory_equal(h.serial_number, "WL-7\0\0\0", 8);
    assert_int_equal(h.n_lights, 6);
    assert_int_equal(h.max_on_ms, 100);
    take_lease(5000);
    assert_int_equal(light(1 << 6, 256, 50), WEFT_STATUS_BAD_ARG);
    assert_int_equal(light(1, 256, 101), WEFT_STATUS_LIMIT);
    assert_int_equal(light(1 << 2, 256, 100), WEFT_STATUS_OK);
    assert_int_equal(set_setting(WEFT_KEY_N_LIGHTS, 0, "\5", 1), WEFT_STATUS_BUSY); /* a light is on */
    assert_true(weft_controller_sim_expose(sim, 1600, fraction));
    assert_near(fraction[2], 0.25, 1e-12);
    assert_int_equal(ask(WEFT_CMD_OFF, "", 0, NULL), WEFT_STATUS_OK);
    assert_int_equal(set_setting(WEFT_KEY_DEFAULTS, 0, "", 0), WEFT_STATUS_OK);
    assert_int_equal(hello(&h), WEFT_STATUS_OK);
    assert_int_equal(h.n_lights, 10);
}

static void on_pulse(void *context)
{
    ++*(int *)context;
}

static void test_trigger_pulses_are_seen(void **state)
{
    (void)state;
    weft_controller_sim *other = NULL;
    int pulses = 0;
    assert_ok(weft_controller_sim_create_stepped(elf_path("tests/firmware/pulses.elf"), &other, err));
    weft_controller_sim_set_trigger(other, on_pulse, &pulses);
    weft_controller_sim_run(other, 1500);
    assert_int_equal(pulses, 2);
    weft_controller_sim_run(other, 20e3);
    assert_int_equal(pulses, 5); /* rising edges only */
    weft_controller_sim_destroy(other);
}

static void test_bad_files(void **state)
{
    (void)state;
    weft_controller_sim *other = NULL;
    char pty[128];
    assert_fails(weft_controller_sim_create_stepped("/nonexistent.elf", &other, err), WEFT_ERR_IO,
                 "/nonexistent.elf");
    const weft_controller_sim_program not_a_bootloader = {.bootloader =
                                                              elf_path("firmware/weft-firmware.hex")};
    assert_fails(weft_controller_sim_create_with(&not_a_bootloader, &other, pty, err), WEFT_ERR_FORMAT,
                 "it begins at 0, not at 0x7000");
    const weft_controller_sim_program no_hex = {.bootloader = elf_path("firmware/weft-firmware.elf")};
    assert_fails(weft_controller_sim_create_with(&no_hex, &other, pty, err), WEFT_ERR_FORMAT, ".hex");
    assert_fails(weft_controller_sim_create_stepped("/proc/self/exe", &other, err), WEFT_ERR_FORMAT,
                 "no firmware for an AVR");
    assert_null(other);
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup_teardown(name, power_on, power_off)
    const struct CMUnitTest tests[] = {
        TEST(test_starts_dark_at_the_right_rate),
        TEST(test_answers_a_person),
        TEST(test_clock_counts_in_step),
        TEST(test_every_light_and_level_exactly),
        TEST(test_part_of_an_exposure),
        TEST(test_two_lights_are_never_on_together),
        TEST(test_the_same_light_again_does_not_blink),
        TEST(test_max_on_ends_a_light),
        TEST(test_lease_expires_into_safe),
        TEST(test_safe_is_left_by_hello_and_lease_only),
        TEST(test_panic_bytes_in_mid_frame),
        TEST(test_panic_overtakes_commands),
        TEST(test_a_repeated_frame_is_answered_but_not_run),
        TEST(test_damaged_frames_are_never_run),
        TEST(test_unknown_and_foreign_commands),
        TEST(test_flood_does_no_harm),
        TEST(test_flood_of_commands_delays_nothing),
        TEST(test_watchdog_ends_a_hang_in_darkness),
        TEST(test_panic_works_while_the_program_hangs),
        TEST(test_reset_button),
        TEST(test_settings_survive_power_off_and_count),
        cmocka_unit_test(test_trigger_pulses_are_seen),
        cmocka_unit_test(test_bad_files),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
