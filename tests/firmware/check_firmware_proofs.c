/* What must never happen, tried often: random moments, damaged lines, noise.  Simulated time, fixed seeds. */
#include "tests/firmware/talk.h"
#include "tests/support/support.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint64_t seed;

static int start(void **state)
{
    seed = 2026;
    return power_on(state);
}

static double uniform(double from, double to)
{
    return from + weft_test_random(&seed) * (to - from);
}

static int below(int n)
{
    return (int)(weft_test_random(&seed) * n);
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Sorts, says the distribution, gives the largest. */
static double say_distribution(const char *what, double *ms, int n)
{
    qsort(ms, (size_t)n, sizeof *ms, by_size);
    print_message("%s, %d times: dark after %.3f ms at least, %.3f median, %.3f 90 %%, %.3f at most\n", what,
                  n, ms[0], ms[n / 2], ms[n * 9 / 10], ms[n - 1]);
    return ms[n - 1];
}

static int set_step(uint8_t index, uint16_t mask, uint32_t hold_us)
{
    const weft_seq_set_request s = {
        .index = index, .mask = mask, .level = 256, .trigger_us = 40, .hold_us = hold_us};
    uint8_t bytes[WEFT_SEQ_SET_REQUEST_BYTES];
    weft_seq_set_request_encode(&s, bytes);
    return ask(WEFT_CMD_SEQ_SET, bytes, sizeof bytes, NULL);
}

static uint8_t run_request(uint8_t *wire, uint8_t number, uint8_t first, uint8_t count, uint16_t run_id)
{
    const weft_seq_run_request r = {.first = first, .count = count, .run_id = run_id};
    uint8_t bytes[WEFT_SEQ_RUN_REQUEST_BYTES];
    weft_seq_run_request_encode(&r, bytes);
    return request(wire, number, WEFT_CMD_SEQ_RUN, bytes, sizeof bytes);
}

/* -- a host that falls silent ---------------------------------------------------------------------------- */

/* Frames as of a host that holds lights or runs sequences, cut off after a random byte. */
static double kill_host(uint16_t lease_ms, bool sequence)
{
    uint8_t wire[WEFT_FRAME_WIRE_MAX], bytes[WEFT_LIGHT_REQUEST_BYTES];
    take_lease(lease_ms);
    for (uint8_t i = 0; i < 10 && sequence; i++)
        assert_int_equal(set_step(i, (uint16_t)(1u << i), 300000), WEFT_STATUS_OK);
    const int whole = 1 + below(8);
    for (int i = 0; i <= whole; i++) {
        uint8_t n = sequence && i == 0
                        ? run_request(wire, (uint8_t)(100 + i), 0, 10, 1)
                        : request(wire, (uint8_t)(100 + i), WEFT_CMD_LIGHT, bytes,
                                  light_request(bytes, (uint16_t)(1u << below(10)), 256, 2000));
        if (i == whole)
            n = (uint8_t)below(n); /* the last word is not finished */
        weft_controller_sim_send(sim, wire, n);
        weft_controller_sim_run(sim, 22.0 * n + (i < whole ? uniform(500, 40e3) : 0));
    }
    const double killed_ms = now_ms();
    assert_true(lights() != 0 || sequence);
    weft_controller_sim_run(sim, 1e3 * (lease_ms + 20.0));
    assert_int_equal(lights(), 0);
    const double dark_ms = off_at_ms() - killed_ms;
    weft_controller_sim_run(sim, 8e6);
    assert_int_equal(lights(), 0);                         /* and for good */
    weft_controller_sim_send(sim, (const uint8_t *)"", 1); /* what every new host begins with */
    weft_frame f;
    while (next_frame(&f, 3))
        ;
    return dark_ms;
}

static void test_a_killed_host_leaves_darkness(void **state)
{
    (void)state;
    double ms[2][100];
    for (int i = 0; i < 100; i++) {
        ms[0][i] = kill_host(1000, false);
        ms[1][i] = kill_host(1000, true);
    }
    assert_true(say_distribution("host killed, lights held, lease 1000 ms", ms[0], 100) <= 1020);
    assert_true(say_distribution("host killed, sequence running, lease 1000 ms", ms[1], 100) <= 1020);
    assert_true(ms[0][0] > 900); /* it is the lease that ends it */
}

static void test_a_hang_at_any_moment_ends_dark(void **state)
{
    (void)state;
    double ms[40];
    for (int i = 0; i < 40; i++) {
        take_lease(5000);
        assert_int_equal(light((uint16_t)(1 + below(1023)), (uint16_t)(1 + below(256)), 2000),
                         WEFT_STATUS_OK);
        weft_controller_sim_run(sim, uniform(0, 300e3));
        const double hung_ms = now_ms();
        weft_controller_sim_hang(sim);
        weft_controller_sim_run(sim, 350e3);
        assert_int_equal(lights(), 0);
        ms[i] = off_at_ms() - hung_ms;
    }
    assert_true(say_distribution("main loop hung", ms, 40) <= 300);
    assert_true(ms[0] > 200);
}

static void test_panic_at_any_byte_of_a_frame(void **state)
{
    (void)state;
    double ms[200];
    for (int i = 0; i < 200; i++) {
        uint8_t wire[WEFT_FRAME_WIRE_MAX + 3], bytes[WEFT_LIGHT_REQUEST_BYTES];
        take_lease(5000);
        if (i % 2) {
            assert_int_equal(light((uint16_t)(1 + below(1023)), 256, 2000), WEFT_STATUS_OK);
        } else {
            assert_int_equal(set_step(0, 1 << 4, 1900000), WEFT_STATUS_OK);
            weft_controller_sim_send(sim, wire, run_request(wire, 99, 0, 1, 1));
            weft_controller_sim_run(sim, uniform(2e3, 4e3));
        }
        assert_true(lights() != 0);
        const uint8_t n = request(wire, 200, WEFT_CMD_LIGHT, bytes, light_request(bytes, 0x3ff, 256, 2000));
        const size_t at = (size_t)below(n);
        memset(wire + at, 0, 3);
        weft_controller_sim_send(sim, wire, at);
        weft_controller_sim_run(sim, 22.0 * (double)at);
        const double begin_ms = now_ms();
        weft_controller_sim_send(sim, wire + at, 3);
        weft_controller_sim_run(sim, 5e3);
        assert_int_equal(lights(), 0);
        ms[i] = off_at_ms() - begin_ms;
        weft_frame f;
        while (next_frame(&f, 3))
            ;
    }
    assert_true(say_distribution("panic inside a frame, from its first byte", ms, 200) < 1);
}

/* -- power that goes while a setting is stored -------------------------------------------------------------
 */

static uint8_t number_request(uint8_t *wire, const char *number)
{
    weft_cfg_set_request r = {.key = WEFT_KEY_SERIAL_NUMBER};
    uint8_t bytes[WEFT_CFG_SET_REQUEST_BYTES];
    memcpy(r.value, number, 8);
    weft_cfg_set_request_encode(&r, bytes);
    return request(wire, 77, WEFT_CMD_CFG_SET, bytes, sizeof bytes);
}

/* The bytes of a slot go to the EEPROM one by one, 3.4 ms each; the one that is stored when the power goes is
 * spoilt.  Every 75 us of it: the old number or the new one, never a third thing. */
static void test_power_goes_at_any_moment_of_a_setting(void **state)
{
    (void)state;
    char now[9] = "WL-00000", next[9];
    uint8_t wire[WEFT_FRAME_WIRE_MAX];
    int n_old = 0, n_new = 0;
    weft_controller_sim_send(sim, wire, number_request(wire, now));
    weft_controller_sim_run(sim, 400e3);
    for (int i = 0; i < 400; i++) {
        weft_hello_reply h;
        uint8_t rest[256];
        snprintf(next, sizeof next, "WL-%05d", i + 1);
        weft_controller_sim_send(sim, wire, number_request(wire, next));
        weft_controller_sim_run(sim, 75.0 * i);
        weft_controller_sim_power_cycle(sim);
        weft_controller_sim_run(sim, 20e3);
        while (weft_controller_sim_receive(sim, rest, sizeof rest))
            ;
        assert_int_equal(hello(&h), WEFT_STATUS_OK);
        assert_int_equal(h.settings_state, WEFT_SETTINGS_LOADED);
        const bool is_new = memcmp(h.serial_number, next, 8) == 0;
        assert_true(is_new || memcmp(h.serial_number, now, 8) == 0);
        n_new += is_new;
        n_old += !is_new;
        if (is_new)
            memcpy(now, next, sizeof now);
    }
    print_message(
        "power lost at 400 moments of storing a setting: %d times the old one, %d the new one, 0 neither\n",
        n_old, n_new);
    assert_true(n_old > 100 && n_new > 100);
}

/* -- a damaged line -------------------------------------------------------------------------------------- */

typedef struct pulses {
    int n, wrong;
    bool high;
} pulses;

/* Each SEQ_RUN that is carried out gives one pulse with its own light. */
static void count_pulse(void *context, uint64_t cycle, uint32_t lit, bool trigger)
{
    pulses *const p = context;
    (void)cycle;
    if (trigger && !p->high) {
        p->wrong += lit != 1u << p->n % 10;
        p->n++;
    }
    p->high = trigger;
}

/* One byte in a hundred is flipped, lost or doubled.  @return bytes afterwards */
static size_t damage(const uint8_t *from, size_t n, uint8_t *to, int *damaged)
{
    size_t m = 0;
    for (size_t i = 0; i < n; i++) {
        to[m++] = from[i];
        if (weft_test_random(&seed) >= 0.01)
            continue;
        ++*damaged;
        switch (below(3)) {
        case 0:
            to[m - 1] ^= (uint8_t)(1 << below(8));
            break;
        case 1:
            m--;
            break;
        default:
            to[m++] = from[i];
        }
    }
    return m;
}

/* The reply to `number` within `ms`; false when none comes, or a complaint. */
static bool await_reply(uint8_t number, int ms, int *status_byte, int *damaged)
{
    static uint8_t wire[2 * WEFT_FRAME_WIRE_MAX];
    static size_t n;
    for (int i = 0; i < ms * 20; i++) {
        uint8_t in[64], out[128];
        const size_t m = damage(in, weft_controller_sim_receive(sim, in, sizeof in), out, damaged);
        for (size_t k = 0; k < m; k++) {
            weft_frame f;
            if (out[k] != 0) {
                wire[n++ % sizeof wire] = out[k];
                continue;
            }
            const bool good = n <= sizeof wire && weft_frame_decode(wire, n, &f) == WEFT_FRAME_GOOD;
            n = 0;
            if (!good || f.type != WEFT_FRAME_REPLY || f.n == 0)
                continue;
            *status_byte = f.payload[0];
            if (f.payload[0] == WEFT_STATUS_BAD_CRC)
                return false;
            if (f.seq == number && f.command == WEFT_CMD_SEQ_RUN)
                return true;
        }
        weft_controller_sim_run(sim, 50);
    }
    return false;
}

/* The client's rule: the same frame again until it is answered, up to ten times. */
static int send_until_answered(const uint8_t *wire, size_t n, uint8_t number, int *status_byte, int *damaged)
{
    static const int try_ms[] = {30, 30, 40, 50, 50, 100, 100, 150, 200, 200};
    for (int i = 0; i < 10; i++) {
        uint8_t sent[2 * WEFT_FRAME_WIRE_MAX];
        weft_controller_sim_send(sim, sent, damage(wire, n, sent, damaged));
        if (await_reply(number, try_ms[i], status_byte, damaged))
            return i;
    }
    return -1;
}

static void test_10000_commands_over_a_damaged_line(void **state)
{
    (void)state;
    pulses p = {0};
    int damaged = 0, retries = 0, most = 0, lost = 0, refused = 0;
    take_lease(5000);
    for (uint8_t i = 0; i < 10; i++)
        assert_int_equal(set_step(i, (uint16_t)(1u << i), 100), WEFT_STATUS_OK);
    weft_controller_sim_set_watch(sim, count_pulse, &p);
    for (int i = 0; i < 10000; i++) {
        uint8_t wire[WEFT_FRAME_WIRE_MAX];
        int status_byte = -1;
        const uint8_t number = (uint8_t)i;
        const size_t n = run_request(wire, number, (uint8_t)(i % 10), 1, (uint16_t)i);
        const int again = send_until_answered(wire, n, number, &status_byte, &damaged);
        lost += again < 0;
        refused += again >= 0 && status_byte != WEFT_STATUS_OK;
        retries += again > 0 ? again : 0;
        most = again > most ? again : most;
        weft_controller_sim_run(sim, 1500);
        assert_int_equal(p.n, i + 1); /* once, and not twice */
    }
    print_message(
        "10000 commands, %d bytes damaged: %d retries, %d for one command at most, %d lost, %d refused, "
        "%d carried out, %d with the wrong light\n",
        damaged, retries, most, lost, refused, p.n, p.wrong);
    assert_true(damaged > 2000 && retries > 1000);
    assert_int_equal(lost, 0);
    assert_int_equal(refused, 0);
    assert_int_equal(p.n, 10000);
    assert_int_equal(p.wrong, 0);
}

/* -- noise ------------------------------------------------------------------------------------------------
 */

enum { ONLY_LIGHT = 1 << 3 };

typedef struct oracle {
    bool may_light; /* a valid LIGHT or SEQ_RUN has been said in this round */
    int violations, lit;
} oracle;

static void check_light(void *context, uint64_t cycle, uint32_t lit, bool trigger)
{
    oracle *const o = context;
    (void)cycle;
    (void)trigger;
    o->lit += lit != 0;
    o->violations += (lit & ~(uint32_t)ONLY_LIGHT) != 0 || (lit && !o->may_light);
}

/* A valid frame of any command and payload, but no reboot; lights only as ONLY_LIGHT. */
static size_t valid_frame(uint8_t *wire, bool may_light)
{
    weft_frame f = {.version = WEFT_PROTOCOL_MAJOR, .seq = (uint8_t)below(256), .n = (uint8_t)below(49)};
    static const uint8_t known[] = {0x00, 0x01, 0x02, 0x10, 0x11, 0x20, 0x21, 0x22, 0x30};
    f.command = below(4) ? known[below((int)sizeof known)] : (uint8_t)below(256);
    for (int i = 0; i < f.n; i++)
        f.payload[i] = (uint8_t)below(below(2) ? 256 : 4);
    if (f.command == WEFT_CMD_REBOOT || (f.command == WEFT_CMD_CFG_SET && below(50)))
        f.command = WEFT_CMD_STATUS;
    if (f.command == WEFT_CMD_CFG_SET)
        f.payload[0] = WEFT_KEY_DEFAULTS;
    if ((f.command == WEFT_CMD_LIGHT || f.command == WEFT_CMD_SEQ_RUN) && !may_light)
        f.command = WEFT_CMD_STATUS;
    if (f.command == WEFT_CMD_LIGHT && f.n >= 6) {
        const weft_light_request l = {.mask = ONLY_LIGHT, .level = (uint16_t)below(300), .max_on_ms = 1};
        weft_light_request_encode(&l, f.payload);
    }
    if (f.command == WEFT_CMD_SEQ_SET && f.n >= WEFT_SEQ_SET_REQUEST_BYTES) {
        const weft_seq_set_request s = {.index = (uint8_t)below(20),
                                        .mask = ONLY_LIGHT,
                                        .level = (uint16_t)below(300),
                                        .trigger_us = 20,
                                        .hold_us = 20 + (uint32_t)below(1000)};
        weft_seq_set_request_encode(&s, f.payload);
    }
    if (f.command == WEFT_CMD_SEQ_RUN && f.n >= 2)
        f.payload[1] = (uint8_t)below(6);
    if (below(40) == 0)
        f.version = (uint8_t)below(16), f.type = (uint8_t)below(16);
    return weft_frame_encode(&f, wire);
}

/* Changes, cuts or repeats a few bytes of a frame that is no LIGHT and no SEQ_RUN. */
static size_t mutated_frame(uint8_t *wire)
{
    size_t n = valid_frame(wire, false);
    for (int k = 1 + below(4); k > 0 && n > 1; k--)
        switch (below(3)) {
        case 0:
            wire[below((int)n)] ^= (uint8_t)(1 << below(8));
            break;
        case 1:
            n = 1 + (size_t)below((int)n);
            break;
        default:
            wire[below((int)n)] = wire[below((int)n)];
        }
    return n;
}

static size_t one_of_many(uint8_t *wire, oracle *o)
{
    const int kind = below(10);
    size_t n = 0;
    if (kind < 3) {
        n = 1 + (size_t)below(60);
        for (size_t i = 0; i < n; i++)
            wire[i] = (uint8_t)below(256);
    } else if (kind < 7) {
        n = mutated_frame(wire);
    } else {
        n = valid_frame(wire, o->may_light);
    }
    return n;
}

/* Rounds of frames without a pause between them.  In half of the rounds nobody asks for light. */
static void test_noise_lights_nothing(void **state)
{
    (void)state;
    const char *const asked = getenv("WEFT_FUZZ_FRAMES");
    const long n_frames = asked ? strtol(asked, NULL, 10) : 60000;
    oracle o = {0};
    weft_controller_sim_counters c;
    long sent = 0, rounds = 0;
    while (sent < n_frames) {
        uint8_t wire[256], rest[4096];
        weft_controller_sim_set_watch(sim, NULL, NULL);
        weft_controller_sim_send(sim, (const uint8_t *)"\0\0\0", 3); /* ends what the last round left */
        weft_controller_sim_run(sim, 400e3);
        while (weft_controller_sim_receive(sim, rest, sizeof rest))
            ;
        take_lease(5000);
        o.may_light = rounds++ & 1;
        weft_controller_sim_set_watch(sim, check_light, &o);
        for (int i = 0; i < 500 && sent < n_frames; i++, sent++) {
            const size_t n = one_of_many(wire, &o);
            weft_controller_sim_send(sim, wire, n);
            assert_true(weft_controller_sim_run(sim, 22.0 * (double)n));
        }
        while (weft_controller_sim_receive(sim, rest, sizeof rest))
            ;
    }
    weft_controller_sim_set_watch(sim, NULL, NULL);
    weft_controller_sim_send(sim, (const uint8_t *)"\0\0\0", 3);
    weft_controller_sim_run(sim, 400e3);
    weft_frame f;
    while (next_frame(&f, 5))
        ;
    take_lease(1000);
    assert_int_equal(light(1, 256, 100), WEFT_STATUS_OK);
    weft_controller_sim_get_counters(sim, &c);
    print_message("%ld frames of noise: %d lights without a command, %d with one, %u resets, answers HELLO\n",
                  sent, o.violations, o.lit, c.resets);
    assert_int_equal(o.violations, 0);
    assert_true(o.lit > 0);
    assert_int_equal(c.resets, 0);
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup_teardown(name, start, power_off)
    const struct CMUnitTest tests[] = {
        TEST(test_a_killed_host_leaves_darkness),         TEST(test_a_hang_at_any_moment_ends_dark),
        TEST(test_panic_at_any_byte_of_a_frame),          TEST(test_10000_commands_over_a_damaged_line),
        TEST(test_power_goes_at_any_moment_of_a_setting), TEST(test_noise_lights_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
