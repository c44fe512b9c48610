/* Sequences on the real firmware and a simulated processor: every edge against what was asked for. */
#include "firmware/fw_config.h"
#include "tests/firmware/talk.h"
#include "tests/support/support.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* -- the edges, as the pins show them -------------------------------------------------------------------- */

typedef struct edge {
    double us;
    uint32_t lights;
    bool trigger;
} edge;

enum { MAX_EDGES = 4096 };
static edge edges[MAX_EDGES];
static int n_edges;

static void note_edge(void *context, uint64_t cycle, uint32_t lights, bool trigger)
{
    (void)context;
    assert_true(n_edges < MAX_EDGES);
    edges[n_edges++] = (edge){.us = (double)cycle / 16, .lights = lights, .trigger = trigger};
}

static int start(void **state)
{
    n_edges = 0;
    if (power_on(state) != 0)
        return 1;
    weft_controller_sim_set_watch(sim, note_edge, NULL);
    take_lease(5000);
    return 0;
}

/* -- asking --------------------------------------------------------------------------------------------- */

static int set_step(const weft_seq_set_request *s)
{
    uint8_t bytes[WEFT_SEQ_SET_REQUEST_BYTES];
    weft_seq_set_request_encode(s, bytes);
    return ask(WEFT_CMD_SEQ_SET, bytes, sizeof bytes, NULL);
}

static int run_steps(uint8_t first, uint8_t count, uint16_t run_id)
{
    const weft_seq_run_request r = {.first = first, .count = count, .run_id = run_id};
    uint8_t bytes[WEFT_SEQ_RUN_REQUEST_BYTES];
    weft_seq_run_request_encode(&r, bytes);
    return ask(WEFT_CMD_SEQ_RUN, bytes, sizeof bytes, NULL);
}

static weft_step_event next_step(int ms)
{
    weft_frame f;
    weft_step_event e;
    assert_true(next_frame(&f, ms));
    assert_int_equal(f.type, WEFT_FRAME_EVENT);
    assert_int_equal(f.command, WEFT_EVENT_STEP);
    weft_step_event_decode(f.payload, f.n, &e);
    return e;
}

static void await_done(uint16_t run_id, int n_steps, int ms)
{
    weft_frame f;
    weft_done_event e;
    assert_true(next_frame(&f, ms));
    assert_int_equal(f.command, WEFT_EVENT_DONE);
    weft_done_event_decode(f.payload, f.n, &e);
    assert_int_equal(e.run_id, run_id);
    assert_int_equal(e.n_steps, n_steps);
}

static int await_fault(int ms)
{
    weft_frame f;
    do
        assert_true(next_frame(&f, ms));
    while (f.command == WEFT_EVENT_STEP);
    assert_int_equal(f.command, WEFT_EVENT_FAULT);
    return f.payload[0];
}

static void set_ten(uint32_t settle_us, uint32_t trigger_us, uint32_t hold_us, uint32_t gap_us, uint8_t mode)
{
    for (uint8_t i = 0; i < 10; i++) {
        const weft_seq_set_request s = {.index = i,
                                        .mask = (uint16_t)(1u << i),
                                        .level = i % 3 ? 256 : 128,
                                        .settle_us = settle_us,
                                        .trigger_us = trigger_us,
                                        .hold_mode = mode,
                                        .hold_us = hold_us,
                                        .gap_us = gap_us};
        assert_int_equal(set_step(&s), WEFT_STATUS_OK);
    }
}

/* -- tests ---------------------------------------------------------------------------------------------- */

/* Times below 40 us are as short as the firmware can make them: about 35 us, 0 included. */
typedef struct errors {
    double settle, pulse, on, gap; /* the largest, us */
} errors;

static void worst(double *most, double measured, double asked)
{
    const double error = measured > asked ? measured - asked : asked - measured;
    if (error > *most)
        *most = error;
}

/* Four edges a step: lights on, trigger up, trigger down, lights off. */
static errors compare_edges(double settle_us, double trigger_us, double hold_us, double gap_us)
{
    errors e = {0};
    assert_int_equal(n_edges, 40);
    for (int i = 0; i < 10; i++) {
        const edge *const k = edges + 4 * i;
        assert_true(k[0].lights == 1u << i && !k[0].trigger);
        assert_true(k[1].lights == 1u << i && k[1].trigger);
        assert_true(k[2].lights == 1u << i && !k[2].trigger);
        assert_true(k[3].lights == 0 && !k[3].trigger);
        worst(&e.settle, k[1].us - k[0].us, settle_us);
        worst(&e.pulse, k[2].us - k[1].us, trigger_us);
        worst(&e.on, k[3].us - k[0].us, settle_us + hold_us);
        if (i < 9)
            worst(&e.gap, k[4].us - k[3].us, gap_us);
    }
    return e;
}

static void test_ten_lights_within_50_us(void **state)
{
    (void)state;
    static const struct {
        uint32_t settle, trigger, hold, gap;
    } cases[] = {{2000, 100, 10000, 1000},  {0, 20, 10000, 0},        {40, 1000, 1000, 40},
                 {1020, 1024, 10004, 1028}, {20000, 20000, 20000, 3}, {250000, 21, 12345, 100000}};
    for (size_t c = 0; c < sizeof cases / sizeof cases[0]; c++) {
        const uint32_t settle = cases[c].settle, trigger = cases[c].trigger, hold = cases[c].hold,
                       gap = cases[c].gap;
        set_ten(settle, trigger, hold, gap, WEFT_HOLD_FIXED);
        n_edges = 0;
        assert_int_equal(run_steps(0, 10, 7), WEFT_STATUS_OK);
        for (int i = 0; i < 10; i++) {
            const weft_step_event e = next_step(400);
            assert_int_equal(e.index, i);
            assert_int_equal(e.run_id, 7);
            const double told_on_us = 4.0 * (e.off_tick - e.on_tick);
            assert_near(told_on_us, edges[4 * i + 3].us - edges[4 * i].us, 20);
            assert_near(4.0 * (e.trigger_tick - e.on_tick), edges[4 * i + 1].us - edges[4 * i].us, 20);
        }
        await_done(7, 10, 120);
        const errors e = compare_edges(settle, trigger, hold, gap);
        print_message("settle %u, trigger %u, hold %u, gap %u us: largest error settle %.1f, trigger %.1f, "
                      "on %.1f, gap %.1f us\n",
                      settle, trigger, hold, gap, e.settle, e.pulse, e.on, e.gap);
        assert_true(e.settle <= 50 && e.pulse <= 50 && e.on <= 50 && e.gap <= 50);
        assert_int_equal(status().state, WEFT_STATE_IDLE);
        assert_int_equal(lights(), 0);
    }
}

/* What the host asks meanwhile is answered, and moves no edge. */
static void test_questions_do_not_move_edges(void **state)
{
    (void)state;
    set_ten(500, 100, 3000, 500, WEFT_HOLD_FIXED);
    n_edges = 0;
    assert_int_equal(run_steps(0, 10, 8), WEFT_STATUS_OK);
    int running = 0;
    for (int i = 0; i < 30; i++) {
        const weft_status_reply s = status();
        running += s.state == WEFT_STATE_RUNNING;
        assert_int_equal(s.lights & (s.lights - 1), 0);
    }
    assert_true(running > 10);
    assert_int_equal(light(1, 256, 100),
                     status().state == WEFT_STATE_RUNNING ? WEFT_STATUS_BUSY : WEFT_STATUS_OK);
    weft_controller_sim_run(sim, 100e3);
    n_edges = n_edges > 40 ? 40 : n_edges; /* the light behind the sequence */
    const errors e = compare_edges(500, 100, 3000, 500);
    print_message("under questions: settle %.1f, trigger %.1f, on %.1f, gap %.1f us\n", e.settle, e.pulse,
                  e.on, e.gap);
    assert_true(e.settle <= 50 && e.pulse <= 50 && e.on <= 50 && e.gap <= 50);
}

static void test_many_sequences_and_no_wrong_light(void **state)
{
    (void)state;
    weft_controller_sim_counters c;
    set_ten(100, 50, 1000, 100, WEFT_HOLD_FIXED);
    int wrong = 0, steps = 0;
    double most = 0;
    for (uint16_t run = 0; run < 1000; run++) {
        n_edges = 0;
        assert_int_equal(run_steps(0, 10, run), WEFT_STATUS_OK);
        for (int i = 0; i < 10; i++) {
            const weft_step_event e = next_step(20);
            steps += e.index == i && e.run_id == run;
        }
        await_done(run, 10, 20);
        for (int i = 0; i < n_edges; i++)
            wrong += edges[i].lights != 0 && edges[i].lights != 1u << i / 4;
        wrong += n_edges != 40;
        for (int i = 0; i < 10 && n_edges == 40; i++)
            worst(&most, edges[4 * i + 3].us - edges[4 * i].us, 1100);
    }
    weft_controller_sim_get_counters(sim, &c);
    print_message("1000 sequences of ten: %d wrong, %d steps told, on-time off by %.1f us at most\n", wrong,
                  steps, most);
    assert_int_equal(wrong, 0);
    assert_int_equal(steps, 10000);
    assert_true(most <= 50);
    assert_int_equal(c.most_lights, 1);
}

static void test_exposure_is_proved(void **state)
{
    (void)state;
    for (int mode = WEFT_HOLD_FIXED; mode <= WEFT_HOLD_EXPOSURE; mode++) {
        weft_controller_sim_set_camera(sim, 300, 10000);
        set_ten(2000, 100, 20000, 1000, (uint8_t)mode);
        n_edges = 0;
        assert_int_equal(run_steps(0, 10, 9), WEFT_STATUS_OK);
        for (int i = 0; i < 10; i++) {
            const weft_step_event e = next_step(60);
            const edge *const k = edges + 4 * i;
            assert_int_equal(e.flags, WEFT_STEP_ROSE | WEFT_STEP_FELL);
            assert_near(4.0 * (e.rise_tick - e.trigger_tick), 300, 24);
            assert_near(4.0 * (e.fall_tick - e.rise_tick), 10000, 12);
            assert_true(e.on_tick + 500 <= e.rise_tick && e.fall_tick <= e.off_tick);
            assert_near(k[3].us - k[1].us, mode == WEFT_HOLD_EXPOSURE ? 10300 : 20000, 50);
        }
        await_done(9, 10, 20);
    }
}

static void test_a_camera_that_fails_ends_in_a_fault(void **state)
{
    (void)state;
    set_ten(1000, 100, 5000, 100, WEFT_HOLD_EXPOSURE);
    assert_int_equal(run_steps(0, 10, 1), WEFT_STATUS_OK); /* no camera */
    assert_int_equal(await_fault(20), WEFT_FAULT_EXPOSURE_MISSING);
    assert_int_equal(lights(), 0);
    assert_near(edges[n_edges - 1].us - edges[0].us, 6000, 50);
    assert_int_equal(status().state, WEFT_STATE_FAULT);
    weft_controller_sim_set_exposure_line(sim, true); /* the camera exposes by itself */
    assert_int_equal(run_steps(0, 10, 2), WEFT_STATUS_OK);
    assert_int_equal(await_fault(20), WEFT_FAULT_EXPOSURE_EARLY);
    assert_int_equal(lights(), 0);
    weft_controller_sim_set_exposure_line(sim, false);
    weft_controller_sim_set_camera(sim, 100, 8000); /* longer than the light */
    assert_int_equal(run_steps(0, 10, 3), WEFT_STATUS_OK);
    assert_int_equal(await_fault(20), WEFT_FAULT_EXPOSURE_MISSING);
    weft_controller_sim_run(sim, 20e3);
    weft_controller_sim_set_camera(sim, 100, 3000); /* and a second attempt succeeds */
    assert_int_equal(run_steps(0, 10, 4), WEFT_STATUS_OK);
    for (int i = 0; i < 10; i++)
        assert_int_equal(next_step(20).flags, WEFT_STEP_ROSE | WEFT_STEP_FELL);
    await_done(4, 10, 20);
    assert_int_equal(status().state, WEFT_STATE_IDLE);
}

static void test_steps_out_of_range(void **state)
{
    (void)state;
    const weft_seq_set_request good = {.mask = 1, .level = 256, .trigger_us = 100, .hold_us = 1000};
    weft_seq_set_request s = good;
    assert_int_equal(run_steps(0, 1, 1), WEFT_STATUS_BAD_ARG); /* nothing is set */
    assert_int_equal(set_step(&good), WEFT_STATUS_OK);
    assert_int_equal(run_steps(0, 0, 1), WEFT_STATUS_BAD_ARG);
    assert_int_equal(run_steps(0, 2, 1), WEFT_STATUS_BAD_ARG);
    assert_int_equal(run_steps(255, 2, 1), WEFT_STATUS_BAD_ARG);
    s.index = 16;
    assert_int_equal(set_step(&s), WEFT_STATUS_LIMIT);
    s = good, s.mask = 1 << 10;
    assert_int_equal(set_step(&s), WEFT_STATUS_BAD_ARG);
    s = good, s.level = 257;
    assert_int_equal(set_step(&s), WEFT_STATUS_BAD_ARG);
    s = good, s.hold_mode = 2;
    assert_int_equal(set_step(&s), WEFT_STATUS_BAD_ARG);
    s = good, s.hold_us = 99, s.trigger_us = 0;
    assert_int_equal(set_step(&s), WEFT_STATUS_BAD_ARG);
    s = good, s.trigger_us = 1001;
    assert_int_equal(set_step(&s), WEFT_STATUS_BAD_ARG);
    s = good, s.hold_us = 2000001;
    assert_int_equal(set_step(&s), WEFT_STATUS_LIMIT);
    s = good, s.hold_us = 2000000, s.settle_us = 1;
    assert_int_equal(set_step(&s), WEFT_STATUS_LIMIT);
    s = good, s.settle_us = UINT32_MAX;
    assert_int_equal(set_step(&s), WEFT_STATUS_LIMIT);
    s = good, s.gap_us = 10000001;
    assert_int_equal(set_step(&s), WEFT_STATUS_LIMIT);
    assert_int_equal(n_edges, 0);
    assert_int_equal(lease(0), WEFT_STATUS_OK);
    assert_int_equal(run_steps(0, 1, 1), WEFT_STATUS_SAFE_LATCHED);
    assert_int_equal(lights(), 0);
}

/* Whatever ends it, a sequence ends dark, with the trigger low, and for good. */
static void test_every_way_out_is_dark(void **state)
{
    (void)state;
    weft_frame f;
    for (int way = 0; way < 6; way++) {
        take_lease(way == 2 ? 100 : 5000);
        set_ten(200000, 1000, 200000, 1000, WEFT_HOLD_FIXED);
        assert_int_equal(run_steps(0, 10, 1), WEFT_STATUS_OK);
        weft_controller_sim_run(sim, 60e3);
        assert_int_equal(lights(), 1);
        const double begin_ms = now_ms();
        if (way == 0)
            assert_int_equal(ask(WEFT_CMD_SEQ_ABORT, "", 0, NULL), WEFT_STATUS_OK);
        else if (way == 1)
            weft_controller_sim_send(sim, (const uint8_t *)"\0\0\0", 3);
        else if (way == 3)
            assert_int_equal(ask(WEFT_CMD_OFF, "", 0, NULL), WEFT_STATUS_OK);
        else if (way == 4)
            weft_controller_sim_reset(sim);
        else if (way == 5)
            weft_controller_sim_hang(sim);
        weft_controller_sim_run(sim, way == 2 ? 50e3 : way == 5 ? 300e3 : 1e3);
        assert_int_equal(lights(), 0);
        assert_true(off_at_ms() - begin_ms <= (way == 5 ? 270 : way == 2 ? 45 : 1));
        const int edges_then = n_edges;
        weft_controller_sim_run(sim, 5e6);
        assert_int_equal(n_edges, edges_then);
        assert_false(edges[n_edges - 1].trigger);
        while (next_frame(&f, 5))
            assert_true(f.command != WEFT_EVENT_STEP && f.command != WEFT_EVENT_DONE);
    }
}

static void test_dark_frames(void **state)
{
    (void)state;
    const weft_seq_set_request s = {.hold_us = 5000, .trigger_us = 100, .settle_us = 100};
    assert_int_equal(set_step(&s), WEFT_STATUS_OK);
    n_edges = 0;
    assert_int_equal(run_steps(0, 1, 3), WEFT_STATUS_OK);
    const weft_step_event e = next_step(20);
    assert_near(4.0 * (e.off_tick - e.on_tick), 5100, 50);
    await_done(3, 1, 10);
    assert_int_equal(n_edges, 2); /* the trigger's */
    assert_true(edges[0].lights == 0 && edges[0].trigger && edges[1].lights == 0);
}

static void test_reboot_is_dark_and_known(void **state)
{
    (void)state;
    weft_hello_reply h;
    assert_int_equal(light(3, 256, 2000), WEFT_STATUS_OK);
    assert_int_equal(ask(WEFT_CMD_REBOOT, "\1", 1, NULL), WEFT_STATUS_BAD_ARG);
    assert_int_equal(lights(), 3);
    assert_int_equal(ask(WEFT_CMD_REBOOT, "", 1, NULL), WEFT_STATUS_OK);
    assert_int_equal(lights(), 0);
    weft_controller_sim_run(sim, 350e3);
    assert_int_equal(status().state, WEFT_STATE_BOOT);
    assert_int_equal(hello(&h), WEFT_STATUS_OK);
    assert_int_equal(h.reset_cause, WEFT_RESET_REQUESTED);
    assert_int_equal(status().resets, 1);
}

/* The serial line brings a byte every 20 us and the chip keeps two: interrupts must never be off for longer.
 */
static void test_interrupts_are_never_off_for_long(void **state)
{
    (void)state;
    weft_seq_set_request s = {.mask = 0x3ff, .level = 77, .settle_us = 40, .trigger_us = 40, .hold_us = 200};
    weft_controller_sim_set_camera(sim, 50, 60);
    (void)weft_controller_sim_longest_lock(sim);
    for (uint8_t i = 0; i < 16; i++) {
        s.index = i;
        s.hold_mode = i & 1;
        s.gap_us = 900;
        assert_int_equal(set_step(&s), WEFT_STATUS_OK);
    }
    for (uint16_t k = 0; k < 10; k++) {
        assert_int_equal(run_steps(0, 16, k), WEFT_STATUS_OK);
        for (int i = 0; i < 16; i++)
            assert_true(status().state != WEFT_STATE_FAULT);
        weft_controller_sim_run(sim, 20e3);
    }
    for (uint16_t level = 0; level <= 256; level += 32)
        assert_int_equal(light((uint16_t)(1u << level / 32), level, 5), WEFT_STATUS_OK);
    weft_controller_sim_send(sim, (const uint8_t *)"?\n\0\0\0", 5);
    weft_controller_sim_run(sim, 20e3);
    const double longest_us = weft_controller_sim_longest_lock(sim) / 16.0;
    print_message("interrupts off for %.1f us at most\n", longest_us);
    assert_true(longest_us > 1 && longest_us <= 20);
}

/* Every command, events and refusals, the panic and noise, under a running sequence: how deep the stack gets.
 */
static void test_stack_is_deep_enough(void **state)
{
    (void)state;
    uint64_t seed = 3;
    uint8_t noise[400];
    int used, untouched;
    weft_frame f;
    assert_true(weft_controller_sim_paint_stack(sim));
    weft_controller_sim_set_camera(sim, 50, 600);
    for (int round = 0; round < 30; round++) {
        const uint8_t mode = round & 1;
        take_lease(5000);
        assert_int_equal(ask(WEFT_CMD_CFG_SET, "\3\0\xd0\7\0\0\0\0\0\0", 10, NULL), WEFT_STATUS_OK);
        assert_int_equal(ask(WEFT_CMD_CFG_GET, "\4\2", 2, NULL), WEFT_STATUS_OK);
        set_ten(100, 100, 1500, 100, mode);
        assert_int_equal(run_steps(0, 10, 1), WEFT_STATUS_OK);
        for (int k = 0; k < 10; k++) {
            status();
            (void)ask((uint8_t)(k * 7), "0123456789012345678901234567890123456789", 40, NULL);
            take_lease(5000);
        }
        for (size_t i = 0; i < sizeof noise; i++)
            noise[i] = (uint8_t)(weft_test_random(&seed) * 256);
        weft_controller_sim_send(sim, noise, sizeof noise);
        weft_controller_sim_send(sim, (const uint8_t *)"\r?\n\0\0\0\0", 7);
        weft_controller_sim_run(sim, 50e3);
        uint8_t rest[256];
        while (weft_controller_sim_receive(sim, rest, sizeof rest) || next_frame(&f, 2))
            ;
    }
    weft_controller_sim_measure_stack(sim, &used, &untouched);
    print_message("stack: %d bytes used, %d never touched\n", used, untouched);
    assert_true(used > 60 && used <= FW_STACK_BYTES && untouched >= 256);
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup_teardown(name, start, power_off)
    const struct CMUnitTest tests[] = {
        TEST(test_ten_lights_within_50_us),
        TEST(test_questions_do_not_move_edges),
        TEST(test_many_sequences_and_no_wrong_light),
        TEST(test_exposure_is_proved),
        TEST(test_a_camera_that_fails_ends_in_a_fault),
        TEST(test_steps_out_of_range),
        TEST(test_every_way_out_is_dark),
        TEST(test_dark_frames),
        TEST(test_interrupts_are_never_off_for_long),
        TEST(test_stack_is_deep_enough),
        TEST(test_reboot_is_dark_and_known),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
