/* Each way in which libsimavr is not like the chip, and that the simulated board makes up for it. */
#include "tests/firmware/talk.h"
#include "tests/support/support.h"

#include <string.h>

enum { CHARACTER_US = 20 };

static int start(void **state)
{
    (void)state;
    weft_error error = {0};
    if (weft_controller_sim_create_stepped(elf_path("tests/firmware/chip.elf"), &sim, &error) == WEFT_OK) {
        weft_controller_sim_run(sim, 1000);
        return 0;
    }
    print_error("%s\n", error.text);
    return 1;
}

static void say(const char *bytes)
{
    weft_controller_sim_send(sim, (const uint8_t *)bytes, strlen(bytes));
}

/* n bytes, waiting for them in steps of 1 us.  @return the time of the last one, us */
static double hear(uint8_t *bytes, size_t n)
{
    size_t got = 0;
    for (long us = 0; got < n && us < 1000000; us++) {
        weft_controller_sim_run(sim, 1);
        got += weft_controller_sim_receive(sim, bytes + got, n - got);
    }
    assert_int_equal(got, n);
    return 1e3 * now_ms();
}

static void test_the_receiver_keeps_three_bytes_not_64(void **state)
{
    (void)state;
    uint8_t answer[2];
    weft_controller_sim_counters c;
    say("d0123456789012345678901234567890123456789");
    hear(answer, 2);
    weft_controller_sim_get_counters(sim, &c);
    print_message("1 ms deaf, 40 bytes sent: %d kept, %u lost\n", answer[0], c.overruns);
    assert_int_equal(answer[0], 3);
    assert_int_equal(answer[1], 1); /* DOR0 */
    assert_int_equal(c.overruns, 37);
}

static void test_a_character_has_ten_bits_at_the_rate_of_both_registers(void **state)
{
    (void)state;
    uint8_t echo[200], bytes[201] = "";
    memset(bytes, 'x', 200);
    const double begin_us = 1e3 * now_ms();
    say((const char *)bytes);
    const double took_us = hear(echo, sizeof echo) - begin_us;
    assert_memory_equal(echo, bytes, sizeof echo);
    assert_near(took_us, 201 * CHARACTER_US, 0.02 * 201 * CHARACTER_US);
}

static void note_trigger(void *context, uint64_t cycle, uint32_t lit, bool trigger)
{
    double *const at_us = context;
    (void)lit;
    if (trigger && *at_us <= 0)
        *at_us = (double)cycle / 16;
}

static void test_a_byte_takes_its_time_to_be_sent(void **state)
{
    (void)state;
    uint8_t byte;
    double written_us = 0;
    weft_controller_sim_set_watch(sim, note_trigger, &written_us);
    say("t");
    const double heard_us = hear(&byte, 1);
    assert_true(written_us > 0);
    assert_near(heard_us - written_us, CHARACTER_US, 1.5);
}

static void test_a_reset_lets_go_of_the_pins_at_once(void **state)
{
    (void)state;
    say("l");
    weft_controller_sim_run(sim, 200);
    assert_int_equal(lights(), 0x3f);
    weft_controller_sim_reset(sim); /* this program does not touch its light pins again */
    assert_int_equal(lights(), 0);
    weft_controller_sim_run(sim, 1000);
    say("lw");
    weft_controller_sim_run(sim, 240e3);
    assert_int_equal(lights(), 0x3f);
    weft_controller_sim_run(sim, 40e3); /* the watchdog bites */
    assert_int_equal(lights(), 0);
}

static void test_what_was_going_on_goes_on_after_a_reset(void **state)
{
    (void)state;
    uint8_t echo[5];
    double fraction[WEFT_SIM_N_LIGHTS];
    say("lxxxxx");
    weft_controller_sim_reset(sim);
    hear(echo, sizeof echo); /* bytes on the line are not lost */
    weft_controller_sim_run(sim, 1000);
    const double begin_ms = now_ms();
    say("lw");
    assert_true(weft_controller_sim_expose(sim, 500000, fraction)); /* nor is an exposure */
    assert_near(now_ms() - begin_ms, 500, 0.001);
    assert_near(fraction[0], 0.52, 0.03); /* until the watchdog bit */
}

static void test_a_bitten_watchdog_bites_again(void **state)
{
    (void)state;
    weft_controller_sim_counters c;
    say("w");
    weft_controller_sim_run(sim, 750e3);
    weft_controller_sim_get_counters(sim, &c);
    assert_true(c.resets > 20); /* after 250 ms every 16 ms: nobody has switched it off */
}

static void test_the_eeprom_takes_its_time(void **state)
{
    (void)state;
    uint8_t ticks[2], all[1024];
    say("e");
    hear(ticks, 2);
    const double took_ms = 0.004 * (ticks[0] | ticks[1] << 8);
    print_message("8 bytes of EEPROM: %.2f ms\n", took_ms);
    assert_near(took_ms, 8 * 3.4, 0.3);
    weft_controller_sim_read_eeprom(sim, all);
    assert_memory_equal(all, "\0\1\2\3\4\5\6\7", 8);
}

static void test_power_loss_takes_the_byte_that_is_stored(void **state)
{
    (void)state;
    uint8_t all[1024];
    say("e");
    weft_controller_sim_run(sim, 3400 * 3.5);
    weft_controller_sim_power_cycle(sim);
    weft_controller_sim_run(sim, 100e3);
    weft_controller_sim_read_eeprom(sim, all);
    assert_memory_equal(all, "\0\1\2", 3);
    assert_int_not_equal(all[3], 3);
    assert_int_not_equal(all[3], 0xff);
    assert_int_equal(all[4], 0xff);
}

static void test_a_masked_interrupt_is_not_forgotten(void **state)
{
    (void)state;
    uint8_t byte = 0;
    say("i");
    weft_controller_sim_run(sim, 300);
    weft_controller_sim_set_exposure_line(sim, true);
    weft_controller_sim_run(sim, 300);
    assert_int_equal(weft_controller_sim_receive(sim, &byte, 1), 0);
    hear(&byte, 1);
    assert_int_equal(byte, 'I');
}

/* -- the wrong rate ----------------------------------------------------------------------------------------
 */

static void test_rates_that_differ_give_garbage(void **state)
{
    (void)state;
    uint8_t sent[32], heard[16 * sizeof sent];
    for (size_t i = 0; i < sizeof sent; i++)
        sent[i] = (uint8_t)(7 * i + 1);
    static const double good[][2] = {{500000, 500000}, {38400, 38461.5}, {115200, 117647}};
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        assert_int_equal(
            weft_controller_sim_garble(sent, sizeof sent, good[i][0], good[i][1], heard, sizeof heard),
            sizeof sent);
        assert_memory_equal(heard, sent, sizeof sent);
    }
    static const double bad[][2] = {{500000, 38461.5}, {38400, 500000}, {115200, 500000}, {9600, 500000}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        const size_t n =
            weft_controller_sim_garble(sent, sizeof sent, bad[i][0], bad[i][1], heard, sizeof heard);
        size_t right = 0;
        for (size_t k = 0; k < n && k < sizeof sent; k++)
            right += heard[k] == sent[k];
        print_message("%.0f to %.0f bits/s: %zu bytes become %zu, %zu of them right\n", bad[i][0], bad[i][1],
                      sizeof sent, n, right);
        assert_true(right < sizeof sent / 4);
    }
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup_teardown(name, start, power_off)
    const struct CMUnitTest tests[] = {
        TEST(test_the_receiver_keeps_three_bytes_not_64),
        TEST(test_a_character_has_ten_bits_at_the_rate_of_both_registers),
        TEST(test_a_byte_takes_its_time_to_be_sent),
        TEST(test_a_reset_lets_go_of_the_pins_at_once),
        TEST(test_what_was_going_on_goes_on_after_a_reset),
        TEST(test_a_bitten_watchdog_bites_again),
        TEST(test_the_eeprom_takes_its_time),
        TEST(test_power_loss_takes_the_byte_that_is_stored),
        TEST(test_a_masked_interrupt_is_not_forgotten),
        cmocka_unit_test(test_rates_that_differ_give_garbage),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
