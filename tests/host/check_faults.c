/*
 * The fault matrix of serial line and lights: each fault in the middle of a capture.  Whatever it is, in the
 * end the lamps are dark, there is a reason in words, every file with a final name is whole, and a second
 * attempt succeeds.  docs/virtual-scanner.md lists the tests by row.
 */
#include "tests/host/capture_bench.h"
#include "tests/support/support.h"

#include "core/file.h"
#include "core/progress.h"

#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

static void sleep_ms(int ms)
{
    nanosleep(&(struct timespec){.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000l}, NULL);
}

static void reopen_controller(void)
{
    weft_controller_close(bench.controller);
    bench.controller = NULL;
    assert_ok(weft_controller_open(pty, LEASE_MS, &bench.controller, err));
}

/* Dark for a second of simulated time at most, and dark it stays: the board, not only the host, has ended it.
 */
static void check_dark_within_a_second(void)
{
    const double begin_s = weft_controller_sim_time_s(bench.sim);
    while (weft_controller_sim_driven(bench.sim) && weft_controller_sim_time_s(bench.sim) < begin_s + 1)
        sleep_ms(5);
    assert_int_equal(weft_controller_sim_driven(bench.sim), 0);
}

static weft_capture_options options_for(const char *name)
{
    return (weft_capture_options){.folder = weft_test_path(name), .exposure_s = 0.04};
}

/* The fault does not hinder the capture: all frames, each with its lamp. */
static void check_right_set(const weft_capture_options *options)
{
    weft_set set;
    check_folder(options->folder, 11, true);
    assert_ok(weft_set_load(options->folder, &set, err));
    for (int i = 1; i < 11; i++)
        assert_int_equal(json_integer_value(json_object_get(set.frames[i].capture, "lights")), 1 << (i - 1));
    weft_set_fini(&set);
}

/* The capture fails with these words; `mend` makes it good, and --resume completes it. */
static void check_failure_and_second_attempt(weft_capture_options *options, const char *words,
                                             void (*mend)(void))
{
    weft_set set;
    weft_capture_report report;
    weft_error why = {0};
    assert_int_not_equal(run(options, &set, &report, &why), WEFT_OK);
    print_message("%s\n", why.text);
    if (!strstr(why.text, words))
        fail_msg("the reason was \"%s\", wanted \"%s\"", why.text, words);
    check_dark_within_a_second();
    assert_ok(weft_set_load(options->folder, &set, err));
    const int kept = set.n_frames;
    weft_set_fini(&set);
    check_folder(options->folder, kept, false);
    mend();
    options->resume = true;
    run_well(options, &report);
    assert_int_equal(report.n_kept, kept);
    check_right_set(options);
}

/* -- serial: a bad cable --------------------------------------------------------------------------------- */

static void spoil(const weft_sim_line_faults *faults)
{
    weft_controller_sim_set_line_faults(bench.sim, WEFT_SIM_TO_BOARD, faults);
    weft_controller_sim_set_line_faults(bench.sim, WEFT_SIM_FROM_BOARD, faults);
}

static void good_cable(void)
{
    spoil(NULL);
    reopen_controller();
}

static void capture_over(const weft_sim_line_faults *faults, const char *name)
{
    const weft_capture_options options = options_for(name);
    weft_capture_report report;
    weft_controller_status s;
    spoil(faults);
    run_well(&options, &report);
    spoil(NULL);
    assert_int_equal(report.n_retries, 0); /* no frame was spoilt: the line mends itself */
    check_right_set(&options);
    assert_ok(weft_controller_get_status(bench.controller, &s, err));
    print_message("%s: %u frames, %u retries, %u damaged at the board, %u here\n", name, s.frames, s.retries,
                  s.crc_errors, s.bad_replies);
    assert_true(s.retries + s.crc_errors + s.bad_replies > 0 || faults->repeat_frame > 0);
    assert_true(s.frames > 30);
}

static void serial_dropped_byte(void **state)
{
    (void)state;
    capture_over(&(weft_sim_line_faults){.drop = 0.005, .seed = 1}, "drop.set");
}

static void lose_all_bytes(void)
{
    spoil(&(weft_sim_line_faults){.drop = 1});
}

static void serial_all_bytes_dropped(void **state)
{
    (void)state;
    weft_capture_options options = options_for("cut.set");
    plan_deed(ACT, 4, 1);
    bench.act = lose_all_bytes;
    check_failure_and_second_attempt(&options, "the light controller does not answer", good_cable);
}

static void serial_flipped_bit(void **state)
{
    (void)state;
    capture_over(&(weft_sim_line_faults){.flip = 0.005, .seed = 2}, "flip.set");
}

static void serial_duplicated_frame(void **state)
{
    (void)state;
    capture_over(&(weft_sim_line_faults){.repeat_frame = 0.3, .seed = 3}, "twice.set");
    capture_over(&(weft_sim_line_faults){.repeat = 0.005, .seed = 3}, "bytes-twice.set");
}

static void serial_delayed_ack(void **state)
{
    (void)state;
    const weft_sim_line_faults late = {.stall = 0.003, .stall_ms = 120, .seed = 4};
    const weft_capture_options options = options_for("late.set");
    weft_controller_status s;
    weft_controller_sim_set_line_faults(bench.sim, WEFT_SIM_FROM_BOARD, &late);
    run_well(&options, NULL);
    spoil(NULL);
    check_right_set(&options);
    assert_ok(weft_controller_get_status(bench.controller, &s, err));
    assert_true(s.retries > 0); /* asked again while the answer was on its way */
}

/* -- serial: what does not belong there --------------------------------------------------------------------
 */

static void flood(void)
{
    uint8_t noise[300];
    uint64_t seed = 5;
    for (size_t i = 0; i < sizeof noise; i++)
        noise[i] = (uint8_t)(weft_test_random(&seed) * 256);
    assert_int_equal(write(weft_controller_panic_fd(bench.controller), noise, sizeof noise), sizeof noise);
}

static void serial_300_byte_flood(void **state)
{
    (void)state;
    const weft_capture_options options = options_for("flood.set");
    weft_controller_status s;
    plan_deed(ACT, 2, 3);
    bench.act = flood;
    run_well(&options, NULL);
    check_right_set(&options);
    assert_ok(weft_controller_get_status(bench.controller, &s, err));
    assert_true(s.crc_errors > 0);
}

static void serial_garbage_before_hello(void **state)
{
    (void)state;
    const weft_capture_options options = options_for("garbage.set");
    struct termios t;
    weft_controller_close(bench.controller);
    bench.controller = NULL;
    sleep_ms(20);
    const int fd = open(pty, O_RDWR | O_NOCTTY | O_NONBLOCK); /* as a modem probe that stays */
    assert_true(fd >= 0 && tcgetattr(fd, &t) == 0);
    cfmakeraw(&t);
    cfsetspeed(&t, B500000);
    assert_int_equal(tcsetattr(fd, TCSANOW, &t), 0);
    sleep_ms(20);
    static const char garbage[] = "AT+GCAP\r\x7e\xff\x55\x01\x02half a fra";
    assert_int_equal(write(fd, garbage, sizeof garbage - 1), sizeof garbage - 1);
    assert_ok(weft_controller_open(pty, LEASE_MS, &bench.controller, err)); /* finds the board as it is */
    close(fd);
    run_well(&options, NULL);
    check_right_set(&options);
}

/* -- serial: the board goes away
 * ----------------------------------------------------------------------------- */

static void reset_board(void)
{
    weft_controller_sim_reset(bench.sim);
}

static void serial_board_reset(void **state)
{
    (void)state;
    weft_capture_options options = options_for("reset.set");
    plan_deed(ACT, 3, 1);
    bench.act = reset_board;
    check_failure_and_second_attempt(&options, "the light controller has reset meanwhile", reopen_controller);
}

static atomic_int pulses;

static void count_pulse(void *context)
{
    (void)context;
    atomic_fetch_add(&pulses, 1);
}

static void *reset_at_third_pulse(void *context)
{
    (void)context;
    for (int i = 0; i < 2000 && atomic_load(&pulses) < 3; i++)
        sleep_ms(2);
    weft_controller_sim_reset(bench.sim);
    return NULL;
}

static void serial_board_reset_in_mid_sequence(void **state)
{
    (void)state;
    pthread_t thread;
    weft_controller_step steps[10];
    weft_controller_step_result results[10];
    for (int i = 0; i < 10; i++)
        steps[i] = (weft_controller_step){
            .lights = 1u << i, .level = 256, .trigger_us = 100, .hold_us = 100000, .gap_us = 1000};
    atomic_store(&pulses, 0);
    weft_controller_sim_set_trigger(bench.sim, count_pulse, NULL);
    assert_int_equal(pthread_create(&thread, NULL, reset_at_third_pulse, NULL), 0);
    assert_fails(weft_controller_run_sequence(bench.controller, steps, 10, results, err), WEFT_ERR_DEVICE,
                 "has reset meanwhile");
    pthread_join(thread, NULL);
    check_dark_within_a_second();
    assert_in_range(atomic_load(&pulses), 3, 4);
    reopen_controller();
    assert_ok(weft_controller_run_sequence(bench.controller, steps, 10, results, err));
    for (int i = 0; i < 10; i++)
        assert_near(4.0 * (results[i].off_tick - results[i].on_tick), 100000, 60);
    weft_controller_sim_set_trigger(bench.sim, NULL, NULL);
}

static char link_path[600];

static void *plug_in_again(void *context)
{
    (void)context;
    sleep_ms(1200);
    assert_int_equal(weft_controller_sim_driven(bench.sim), 0); /* by its lease */
    assert_ok(weft_controller_sim_plug_in(bench.sim, pty, err));
    assert_int_equal(symlink(pty, link_path), 0);
    return NULL;
}

static pthread_t plugging;

static void pull_out(void)
{
    assert_int_not_equal(weft_controller_sim_driven(bench.sim), 0);
    weft_controller_sim_unplug(bench.sim, false);
    assert_int_equal(unlink(link_path), 0);
    snprintf(link_path, sizeof link_path, "%s/ttyACM9", weft_test_path("dev"));
    assert_int_equal(pthread_create(&plugging, NULL, plug_in_again, NULL), 0);
}

static void serial_port_vanishes_and_comes_back(void **state)
{
    (void)state;
    const weft_capture_options options = options_for("vanish.set");
    weft_capture_report report;
    weft_set set;
    assert_ok(weft_controller_set_setting(bench.controller, WEFT_KEY_SERIAL_NUMBER, 0,
                                          (const uint8_t *)"WL-00007", err));
    weft_controller_close(bench.controller);
    bench.controller = NULL;
    assert_ok(weft_folder_create(weft_test_path("dev"), err));
    snprintf(link_path, sizeof link_path, "%s/ttyACM0", weft_test_path("dev"));
    assert_int_equal(symlink(pty, link_path), 0);
    assert_ok(weft_controller_open_under(weft_test_path("dev"), "serial:WL-00007", LEASE_MS,
                                         &bench.controller, err));
    plan_deed(ACT, 4, 1);
    bench.act = pull_out;
    assert_ok(run(&options, &set, &report, err));
    pthread_join(plugging, NULL);
    assert_int_equal(report.n_retries, 1);
    assert_string_equal(
        json_string_value(json_array_get(json_object_get(set.frames[4].capture, "retries"), 0)),
        "the light controller was unplugged");
    weft_set_fini(&set);
    check_right_set(&options);
}

static void pull_out_for_good(void)
{
    weft_controller_sim_unplug(bench.sim, false);
}

static void put_in(void)
{
    assert_ok(weft_controller_sim_plug_in(bench.sim, pty, err));
    reopen_controller();
}

static void serial_port_vanishes_for_good(void **state)
{
    (void)state;
    weft_capture_options options = options_for("gone.set");
    options.patience_s = 1; /* longer than the lease */
    plan_deed(ACT, 4, 1);
    bench.act = pull_out_for_good;
    check_failure_and_second_attempt(&options, "the light controller has vanished", put_in);
}

static void open_again(void)
{
    weft_controller *second = NULL;
    assert_fails(weft_controller_open(pty, LEASE_MS, &second, err), WEFT_ERR_DEVICE,
                 "another program is using this port");
}

static void serial_second_opener(void **state)
{
    (void)state;
    const weft_capture_options options = options_for("second.set");
    weft_capture_report report;
    weft_controller_sim_counters k;
    plan_deed(ACT, 1, 3);
    bench.act = open_again;
    run_well(&options, &report);
    assert_int_equal(report.n_retries, 0); /* the first is not disturbed */
    check_right_set(&options);
    weft_controller_sim_get_counters(bench.sim, &k);
    assert_int_equal(k.resets, 1); /* by the first opening */
}

/* -- light -------------------------------------------------------------------------------------------------
 */

static void good_lamps(void)
{
    for (int i = 0; i < N_LIGHTS; i++)
        weft_controller_sim_set_lamp(bench.sim, i, WEFT_SIM_LAMP_GOOD, 0);
}

static void light_stuck_lamp_off(void **state)
{
    (void)state;
    weft_capture_options options = options_for("off.set");
    weft_controller_sim_set_lamp(bench.sim, 3, WEFT_SIM_LAMP_OFF, 0);
    check_failure_and_second_attempt(&options, "light 3: no brighter than without it", good_lamps);
    options = options_for("open.set");
    weft_controller_sim_set_lamp(bench.sim, 0, WEFT_SIM_LAMP_OPEN, 0);
    check_failure_and_second_attempt(&options, "is the lamp connected?", good_lamps);
}

static void light_stuck_lamp_on(void **state)
{
    (void)state;
    weft_capture_options options = options_for("on.set");
    weft_controller_sim_set_lamp(bench.sim, 7, WEFT_SIM_LAMP_ON, 0);
    check_failure_and_second_attempt(&options, "does this lamp shine all the time?", good_lamps);
}

/* Of the green photosites. */
static double mean_of_light(const weft_capture_options *options, int light)
{
    weft_set set;
    assert_ok(weft_set_load(options->folder, &set, err));
    const json_t *const statistics = json_object_get(set.frames[1 + light].capture, "statistics");
    const double mean = json_number_value(json_array_get(json_object_get(statistics, "mean"), 1));
    weft_set_fini(&set);
    return mean;
}

/* The time to settle is what a slow lamp needs; one that is slower than the exposure is found out. */
static void light_late_lamp(void **state)
{
    (void)state;
    weft_capture_options options = options_for("settle.set");
    weft_controller_sim_set_lamp(bench.sim, 2, WEFT_SIM_LAMP_LATE, 30000);
    options.settle_s = 0.04;
    run_well(&options, NULL);
    check_right_set(&options);
    assert_true(mean_of_light(&options, 2) > 0.1);
    assert_near(mean_of_light(&options, 2) / mean_of_light(&options, 1), 1, 0.01);
    options = options_for("unsettled.set");
    options.settle_s = 0.001;
    options.force = true;
    weft_controller_sim_set_lamp(bench.sim, 2, WEFT_SIM_LAMP_LATE, 15000);
    double share = 1;
    for (int i = 0; i < 10 && share > 0.9; i++) { /* a busy computer may give it the time that it needs */
        run_well(&options, NULL);
        share = mean_of_light(&options, 2) / mean_of_light(&options, 1);
    }
    assert_true(share < 0.9);
    options = options_for("too-late.set");
    weft_controller_sim_set_lamp(bench.sim, 2, WEFT_SIM_LAMP_LATE, 500000);
    check_failure_and_second_attempt(&options, "light 2: no brighter than without it", good_lamps);
}

/* The board drives the right output, and another lamp shines: only the picture can tell. */
static void light_wire_to_another_lamp(void **state)
{
    (void)state;
    weft_capture_options options = options_for("wire.set");
    weft_controller_sim_set_lamp(bench.sim, 5, WEFT_SIM_LAMP_AS, 2);
    check_failure_and_second_attempt(&options, "light 5: the same picture as under light 2", good_lamps);
    options = options_for("wire-resumed.set");
    plan_deed(CANCEL_IT, 4, 1); /* light 2 is of before, and its picture is read from its file */
    weft_set set;
    assert_fails(run(&options, &set, NULL, err), WEFT_ERR_CANCELLED, "4 of 11 frames");
    weft_cancel_request(false);
    options.resume = true;
    weft_controller_sim_set_lamp(bench.sim, 5, WEFT_SIM_LAMP_AS, 2);
    check_failure_and_second_attempt(&options, "light 5: the same picture as under light 2", good_lamps);
}

static void cross_or_mend(void)
{
    static bool crossed;
    crossed = !crossed;
    weft_controller_sim_set_lamp(bench.sim, 4, crossed ? WEFT_SIM_LAMP_AS : WEFT_SIM_LAMP_GOOD,
                                 crossed ? 9 : 0);
}

static void light_of_another_lamp_within_a_bracket(void **state)
{
    (void)state;
    weft_capture_options options = options_for("crossed.set");
    weft_capture_report report;
    weft_set set;
    options.lights = 1 << 4;
    options.bracket = 3;
    plan_deed(ACT, 2, 2); /* after ambient and 0.04 s: 0.01 s, and the one that is taken in its stead */
    bench.act = cross_or_mend;
    assert_ok(run(&options, &set, &report, err));
    assert_int_equal(report.n_retries, 1);
    const json_t *const reason = json_array_get(json_object_get(set.frames[2].capture, "retries"), 0);
    assert_non_null(strstr(json_string_value(reason), "another picture than its exposure of 0.04 s"));
    weft_set_fini(&set);
    check_folder(options.folder, 4, true);
}

static void fall_silent(void)
{
    const double begin_s = weft_controller_sim_time_s(bench.sim);
    assert_int_not_equal(weft_controller_sim_driven(bench.sim), 0);
    while (weft_controller_sim_time_s(bench.sim) < begin_s + 0.001 * LEASE_MS + 0.02)
        sleep_ms(10);
    assert_int_equal(weft_controller_sim_driven(bench.sim), 0);
}

static void light_lease_expires_in_mid_exposure(void **state)
{
    (void)state;
    weft_capture_options options = options_for("lease.set");
    plan_deed(ACT, 5, 1);
    bench.act = fall_silent;
    check_failure_and_second_attempt(&options, "the host was silent", reopen_controller);
}

static void hang(void)
{
    assert_int_not_equal(weft_controller_sim_driven(bench.sim), 0);
    weft_controller_sim_hang(bench.sim);
    const double begin_s = weft_controller_sim_time_s(bench.sim);
    while (weft_controller_sim_time_s(bench.sim) < begin_s + 0.3)
        sleep_ms(10);
    assert_int_equal(weft_controller_sim_driven(bench.sim), 0);
}

static void light_watchdog(void **state)
{
    (void)state;
    weft_capture_options options = options_for("hang.set");
    plan_deed(ACT, 6, 1);
    bench.act = hang;
    check_failure_and_second_attempt(&options, "has reset meanwhile", reopen_controller);
}

int main(void)
{
#define ON_BENCH(test) cmocka_unit_test_setup_teardown(test, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        ON_BENCH(serial_dropped_byte),
        ON_BENCH(serial_all_bytes_dropped),
        ON_BENCH(serial_flipped_bit),
        ON_BENCH(serial_duplicated_frame),
        ON_BENCH(serial_delayed_ack),
        ON_BENCH(serial_300_byte_flood),
        ON_BENCH(serial_garbage_before_hello),
        ON_BENCH(serial_board_reset),
        ON_BENCH(serial_board_reset_in_mid_sequence),
        ON_BENCH(serial_port_vanishes_and_comes_back),
        ON_BENCH(serial_port_vanishes_for_good),
        ON_BENCH(serial_second_opener),
        ON_BENCH(light_stuck_lamp_off),
        ON_BENCH(light_stuck_lamp_on),
        ON_BENCH(light_late_lamp),
        ON_BENCH(light_wire_to_another_lamp),
        ON_BENCH(light_of_another_lamp_within_a_bracket),
        ON_BENCH(light_lease_expires_in_mid_exposure),
        ON_BENCH(light_watchdog),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
