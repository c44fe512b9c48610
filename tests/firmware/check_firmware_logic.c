/* The logic of the firmware on a board of variables: what a simulated processor shows badly, or too slowly.
 */
#include "tests/support/support.h"

#include "firmware/fw_board.h"
#include "firmware/fw_config.h"
#include "firmware/fw_light.h"
#include "firmware/fw_link.h"
#include "firmware/fw_safety.h"
#include "firmware/protocol.h"
#include "firmware/sim/sim_board.h"

#include <string.h>

static uint8_t seq;
static size_t read_at; /* of sim.wire */

static int start(void **state)
{
    (void)state;
    sim_board_start();
    read_at = 0;
    return 0;
}

static void hear(const uint8_t *bytes, size_t n)
{
    for (size_t i = 0; i < n; i++)
        fw_link_on_byte(bytes[i], false);
}

static uint8_t request(uint8_t *wire, uint8_t command, const void *payload, uint8_t n)
{
    weft_frame f = {.version = WEFT_PROTOCOL_MAJOR, .seq = ++seq, .command = command, .n = n};
    memcpy(f.payload, payload, n);
    return weft_frame_encode(&f, wire);
}

/* The next frame that the board has sent. */
static bool next_frame(weft_frame *f)
{
    const uint8_t *const begin = sim.wire + read_at;
    const uint8_t *const end = memchr(begin, 0, sim.sent - read_at);
    if (!end)
        return false;
    assert_int_equal(weft_frame_decode(begin, (size_t)(end - begin), f), WEFT_FRAME_GOOD);
    read_at += (size_t)(end - begin) + 1;
    if (read_at == sim.sent)
        read_at = sim.sent = 0;
    return true;
}

static int ask(uint8_t command, const void *payload, uint8_t n, weft_frame *reply)
{
    uint8_t wire[WEFT_FRAME_WIRE_MAX];
    weft_frame f = {0};
    hear(wire, request(wire, command, payload, n));
    sim_board_turn();
    do /* replies to earlier requests may still be on their way */
        assert_true(next_frame(&f));
    while (f.type == WEFT_FRAME_EVENT || f.seq != seq);
    if (reply)
        *reply = f;
    return f.payload[0];
}

static void take_lease(uint16_t ms)
{
    const uint8_t lease[] = {(uint8_t)ms, (uint8_t)(ms >> 8)};
    assert_int_equal(ask(WEFT_CMD_HELLO, "\1\0abcd", 6, NULL), WEFT_STATUS_OK);
    assert_int_equal(ask(WEFT_CMD_LEASE, lease, 2, NULL), WEFT_STATUS_OK);
}

static weft_status_reply status(void)
{
    weft_frame f;
    weft_status_reply s;
    assert_int_equal(ask(WEFT_CMD_STATUS, "", 0, &f), WEFT_STATUS_OK);
    weft_status_reply_decode(f.payload + 1, (uint8_t)(f.n - 1), &s);
    return s;
}

static const uint8_t light_2_full_500ms[] = {4, 0, 0, 1, 0xf4, 1};

static void test_lease_is_clamped_and_ends_on_the_millisecond(void **state)
{
    (void)state;
    static const uint16_t asked[] = {1, 99, 100, 2500, 5000, 5001, 65535};
    static const uint16_t granted[] = {100, 100, 100, 2500, 5000, 5000, 5000};
    for (size_t i = 0; i < sizeof asked / sizeof asked[0]; i++) {
        const uint8_t lease[] = {(uint8_t)asked[i], (uint8_t)(asked[i] >> 8)};
        weft_frame f;
        assert_int_equal(ask(WEFT_CMD_HELLO, "\1\0abcd", 6, NULL), WEFT_STATUS_OK);
        assert_int_equal(ask(WEFT_CMD_LEASE, lease, 2, &f), WEFT_STATUS_OK);
        assert_int_equal(f.payload[1] | f.payload[2] << 8, granted[i]);
        sim_board_pass_ms(granted[i] - 1);
        assert_int_equal(fw_safety_state(), WEFT_STATE_IDLE);
        sim_board_pass_ms(1);
        assert_int_equal(fw_safety_state(), WEFT_STATE_SAFE);
        assert_int_equal(fw_safety_cause(), WEFT_CAUSE_LEASE_EXPIRED);
        assert_true(next_frame(&f) && f.type == WEFT_FRAME_EVENT);
    }
}

/* Times are compared in 16 bits: nothing may happen when the clock wraps after 65.5 s. */
static void test_clock_wraps_without_notice(void **state)
{
    (void)state;
    for (int i = 0; i < 90; i++) {
        sim_board_pass_ms(i == 0 ? 64000 : 1000);
        if (fw_safety_state() != WEFT_STATE_IDLE && fw_safety_state() != WEFT_STATE_LIT)
            take_lease(1200);
        sim.sent = read_at = 0;
        assert_int_equal(ask(WEFT_CMD_LIGHT, light_2_full_500ms, 6, NULL), WEFT_STATUS_OK);
        assert_int_equal(sim.mask, 4);
        sim_board_pass_ms(499);
        assert_int_equal(sim.mask, 4);
        sim_board_pass_ms(1);
        assert_int_equal(sim.mask, 0);
        assert_int_equal(fw_safety_state(), WEFT_STATE_IDLE);
        sim_board_pass_ms(200);
        assert_int_equal(ask(WEFT_CMD_STATUS, "", 0, NULL), WEFT_STATUS_OK);
    }
}

static void test_any_valid_frame_renews_the_lease_and_no_other(void **state)
{
    (void)state;
    uint8_t wire[WEFT_FRAME_WIRE_MAX];
    take_lease(100);
    for (int i = 0; i < 5; i++) {
        sim_board_pass_ms(90);
        assert_int_equal(ask(0x77, "", 0, NULL), WEFT_STATUS_BAD_CMD); /* the host lives */
    }
    assert_int_equal(fw_safety_state(), WEFT_STATE_IDLE);
    for (int i = 0; i < 9; i++) { /* noise is no sign of life */
        const uint8_t n = request(wire, WEFT_CMD_STATUS, "", 0);
        wire[2] ^= 0x10;
        hear(wire, n);
        sim_board_pass_ms(12);
    }
    assert_int_equal(fw_safety_state(), WEFT_STATE_SAFE);
}

static void test_every_way_into_safe_ends_dark(void **state)
{
    (void)state;
    for (int way = 0; way < 3; way++) {
        take_lease(1000);
        assert_int_equal(ask(WEFT_CMD_LIGHT, light_2_full_500ms, 6, NULL), WEFT_STATUS_OK);
        assert_int_equal(sim.mask, 4);
        sim.sent = read_at = 0;
        if (way == 0)
            hear((const uint8_t *)"\0\0\0", 3);
        else if (way == 1)
            assert_int_equal(ask(WEFT_CMD_LEASE, "\0\0", 2, NULL), WEFT_STATUS_OK);
        else
            sim_board_pass_ms(1000);
        assert_int_equal(sim.mask, 0); /* the panic before the loop has turned */
        sim_board_turn();
        assert_int_equal(fw_safety_state(), WEFT_STATE_SAFE);
        assert_int_equal(fw_light_mask(), 0);
        sim.sent = read_at = 0;
        assert_int_equal(ask(WEFT_CMD_LIGHT, light_2_full_500ms, 6, NULL), WEFT_STATUS_SAFE_LATCHED);
        assert_int_equal(sim.mask, 0);
    }
}

/* A panic between the check and the switching on: the interrupt comes while the command is being run. */
static void test_no_light_between_panic_and_its_notice(void **state)
{
    (void)state;
    take_lease(1000);
    hear((const uint8_t *)"\0\0\0", 3);
    assert_false(fw_light_set(1, 256, 100));
    assert_int_equal(sim.mask, 0);
    assert_int_equal(sim.lit, 0);
    sim_board_turn();
    assert_int_equal(fw_safety_cause(), WEFT_CAUSE_PANIC);
}

/* A whole opening conversation in the ring, and then the panic: none of it is carried out afterwards. */
static void test_panic_voids_what_was_said_before(void **state)
{
    (void)state;
    uint8_t wire[WEFT_FRAME_WIRE_MAX];
    hear(wire, request(wire, WEFT_CMD_HELLO, "\1\0abcd", 6));
    hear(wire, request(wire, WEFT_CMD_LEASE, "\xe8\3", 2));
    hear(wire, request(wire, WEFT_CMD_LIGHT, light_2_full_500ms, 6));
    hear((const uint8_t *)"\0\0", 2);
    sim_board_turn();
    assert_int_equal(sim.lit, 0);
    assert_int_equal(fw_link_frames(), 0);
    assert_int_equal(fw_safety_state(), WEFT_STATE_SAFE);
    sim.sent = read_at = 0;
    take_lease(1000); /* what is said after it counts */
    assert_int_equal(fw_safety_state(), WEFT_STATE_IDLE);
}

static void test_two_zeros_are_no_panic(void **state)
{
    (void)state;
    uint8_t wire[WEFT_FRAME_WIRE_MAX];
    take_lease(1000);
    for (int i = 0; i < 20; i++) { /* an end, a beginning, an end: what hosts send */
        hear((const uint8_t *)"", 1);
        hear(wire, request(wire, WEFT_CMD_STATUS, "", 0));
        sim_board_turn();
    }
    assert_int_equal(fw_safety_state(), WEFT_STATE_IDLE);
    sim.sent = read_at = 0;
    assert_int_equal(status().crc_errors, 0);
}

/* While the line takes nothing, replies that do not fit are dropped whole; afterwards all is well. */
static void test_a_full_ring_drops_whole_replies(void **state)
{
    (void)state;
    uint8_t wire[WEFT_FRAME_WIRE_MAX];
    weft_frame f;
    int replies = 0;
    sim.stalled = true;
    for (int i = 0; i < 30; i++) {
        hear(wire, request(wire, WEFT_CMD_STATUS, "", 0));
        sim_board_turn();
    }
    assert_int_equal(sim.sent, 0);
    sim.stalled = false;
    fw_board_send(); /* the transmit interrupt goes on */
    while (next_frame(&f)) {
        assert_int_equal(f.n, WEFT_STATUS_REPLY_BYTES + 1);
        replies++;
    }
    assert_int_equal(replies,
                     (FW_TX_RING - 1) / (WEFT_STATUS_REPLY_BYTES + 9)); /* + status, frame, COBS, end */
    assert_int_equal(fw_link_frames(), 30);
    assert_int_equal(status().crc_errors, 0);
}

/* More than the ring holds before the loop turns: the rest is lost and counted, and the next frame is heard.
 */
static void test_a_burst_beyond_the_ring(void **state)
{
    (void)state;
    uint8_t wire[WEFT_FRAME_WIRE_MAX];
    size_t n = 0;
    while (n < (size_t)4 * FW_RX_RING) {
        const uint8_t m = request(wire, WEFT_CMD_OFF, "", 0);
        hear(wire, m);
        n += m;
    }
    sim_board_turn();
    fw_link_on_byte(0, false); /* the end of the frame that was cut */
    sim_board_turn();
    sim.sent = read_at = 0;
    assert_int_equal(status().overruns, n - (FW_RX_RING - 1));
}

static void test_damaged_bytes_are_counted(void **state)
{
    (void)state;
    for (int i = 0; i < 70000; i++) {
        fw_link_on_byte('x', true);
        if (i % 64 == 63)
            sim_board_turn();
    }
    fw_link_on_byte(0, false);
    sim_board_turn();
    sim.sent = read_at = 0;
    assert_int_equal(status().overruns, 65535); /* stays there */
}

static void test_lines_for_people(void **state)
{
    (void)state;
    static const struct {
        const char *said;
        int answers;
    } lines[] = {{"?\n", 1},        {"?\r", 1},     {"?\r\n", 1},           {"?\r\n?\r\n", 2},
                 {"AT\r", 0},       {"AT\r?\r", 1}, {"what is this?\n", 0}, {"??\n", 0},
                 {"hello\n?\n", 1}, {"\x7f?\n", 0}};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        sim_board_start();
        hear((const uint8_t *)lines[i].said, strlen(lines[i].said));
        sim_board_turn();
        int answers = 0;
        for (size_t k = 0; k < sim.sent; k++)
            answers += sim.wire[k] == '\n';
        assert_int_equal(answers, lines[i].answers);
        sim.sent = read_at = 0;
        assert_int_equal(status().crc_errors, 0); /* the frame behind it is not spoilt */
    }
}

/* The LED on the board must not light the sample: dark while a host holds a lease. */
static void test_status_led(void **state)
{
    (void)state;
    int lit = 0;
    for (int i = 0; i < 1024; i++) {
        sim_board_pass_ms(1);
        lit += sim.status_led;
    }
    assert_int_equal(lit, 64); /* started: once a second */
    take_lease(5000);
    lit = 0;
    for (int i = 0; i < 4000; i++) {
        sim_board_pass_ms(1);
        lit += sim.status_led;
    }
    assert_int_equal(lit, 0);
    assert_int_equal(ask(WEFT_CMD_LEASE, "\0\0", 2, NULL), WEFT_STATUS_OK);
    for (int i = 0; i < 1024; i++) {
        sim_board_pass_ms(1);
        lit += sim.status_led;
    }
    assert_int_equal(lit, 4 * 64); /* SAFE: four times */
}

static void test_the_loop_feeds_the_watchdog(void **state)
{
    (void)state;
    sim_board_pass_ms(500);
    assert_int_equal(sim.fed, 500);
}

/* Whatever comes in, the lights never shine without a lease, and a lease and a light always end. */
static void test_noise_never_lights_a_lamp(void **state)
{
    (void)state;
    uint64_t seed = 11;
    uint8_t wire[WEFT_FRAME_WIRE_MAX];
    for (int round = 0; round < 20000; round++) {
        const double kind = weft_test_random(&seed);
        if (kind < 0.5) {
            for (int i = 0; i < 20; i++)
                fw_link_on_byte((uint8_t)(weft_test_random(&seed) * 256), weft_test_random(&seed) < 0.01);
        } else { /* a real LIGHT, damaged */
            const uint8_t n = request(wire, WEFT_CMD_LIGHT, light_2_full_500ms, 6);
            const size_t at = (size_t)(weft_test_random(&seed) * n);
            wire[at] ^= (uint8_t)(1u << (int)(weft_test_random(&seed) * 8));
            hear(wire, n);
        }
        sim_board_pass_ms(1);
        sim.sent = read_at = 0;
        assert_int_equal(sim.mask, 0);
        assert_int_equal(sim.lit, 0);
    }
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup(name, start)
    const struct CMUnitTest tests[] = {
        TEST(test_lease_is_clamped_and_ends_on_the_millisecond),
        TEST(test_clock_wraps_without_notice),
        TEST(test_any_valid_frame_renews_the_lease_and_no_other),
        TEST(test_every_way_into_safe_ends_dark),
        TEST(test_no_light_between_panic_and_its_notice),
        TEST(test_panic_voids_what_was_said_before),
        TEST(test_two_zeros_are_no_panic),
        TEST(test_a_full_ring_drops_whole_replies),
        TEST(test_a_burst_beyond_the_ring),
        TEST(test_damaged_bytes_are_counted),
        TEST(test_lines_for_people),
        TEST(test_status_led),
        TEST(test_the_loop_feeds_the_watchdog),
        TEST(test_noise_never_lights_a_lamp),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
