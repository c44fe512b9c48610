/* The host's client when the port vanishes and comes back elsewhere, and at which rate it talks. */
#include "tests/support/support.h"

#include "core/file.h"
#include "core/progress.h"
#include "host/light/controller.h"
#include "host/rig/controller_sim.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

enum { N_BOARDS = 2, LEASE_MS = 500 };

/* Boards, each with a link in a folder that is laid out like /dev. */
static struct {
    weft_controller_sim *sim;
    char pty[128], link[512];
} boards[N_BOARDS];

static char dev[400];

static int start(void **state)
{
    (void)state;
    static int n_tests;
    char name[32];
    snprintf(name, sizeof name, "dev%d", n_tests++);
    snprintf(dev, sizeof dev, "%s", weft_test_path(name));
    assert_ok(weft_folder_create(dev, err));
    return 0;
}

static int stop(void **state)
{
    (void)state;
    for (int i = 0; i < N_BOARDS; i++)
        weft_controller_sim_destroy(boards[i].sim);
    memset(boards, 0, sizeof boards);
    return 0;
}

static void sleep_ms(int ms)
{
    nanosleep(&(struct timespec){.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000l}, NULL);
}

static void make_link(int board, int number)
{
    snprintf(boards[board].link, sizeof boards[board].link, "%s/ttyACM%d", dev, number);
    assert_int_equal(symlink(boards[board].pty, boards[board].link), 0);
}

static weft_controller *open_it(const char *port)
{
    weft_controller *c = NULL;
    assert_ok(weft_controller_open_under(dev, port, LEASE_MS, &c, err));
    return c;
}

/* A board under ttyACMn with this serial number, or none. */
static void plug_in_new(int board, const char *elf, const char *number)
{
    char path[1024];
    uint8_t value[8] = "";
    const char *const build = getenv("WEFT_TEST_BUILD");
    snprintf(path, sizeof path, "%s/%s", build ? build : "build", elf);
    assert_ok(weft_controller_sim_create(path, &boards[board].sim, boards[board].pty, err));
    make_link(board, board);
    if (!number)
        return;
    for (size_t i = 0; i < sizeof value && number[i]; i++)
        value[i] = (uint8_t)number[i];
    weft_controller *const c = open_it(boards[board].link);
    assert_ok(weft_controller_set_setting(c, WEFT_KEY_SERIAL_NUMBER, 0, value, err));
    weft_controller_close(c);
}

static void unplug(int board)
{
    weft_controller_sim_unplug(boards[board].sim, false);
    assert_int_equal(unlink(boards[board].link), 0);
}

static void plug_in_again(int board, int number)
{
    char before[128];
    snprintf(before, sizeof before, "%s", boards[board].pty);
    assert_ok(weft_controller_sim_plug_in(boards[board].sim, boards[board].pty, err));
    assert_string_not_equal(boards[board].pty, before);
    make_link(board, number);
}

static const char firmware[] = "firmware/weft-firmware.elf";

static void test_comes_back_under_another_name(void **state)
{
    (void)state;
    double dark_s;
    plug_in_new(0, firmware, "WL-00001");
    weft_controller *const c = open_it("serial:WL-00001");
    assert_ok(weft_controller_light(c, 1 << 4, 256, 2000, NULL, err));
    const double heard_s = weft_controller_sim_time_s(boards[0].sim);
    unplug(0);
    assert_int_equal(weft_controller_sim_lights(boards[0].sim, NULL), 1 << 4);
    assert_false(weft_controller_is_gone(c));
    assert_fails(weft_controller_keep_alive(c, err), WEFT_ERR_DEVICE, "has vanished");
    assert_true(weft_controller_is_gone(c));
    assert_fails(weft_controller_light(c, 1, 256, 100, NULL, err), WEFT_ERR_DEVICE, "has vanished");
    while (weft_controller_sim_time_s(boards[0].sim) < heard_s + 0.001 * LEASE_MS + 0.02)
        sleep_ms(10);
    assert_int_equal(weft_controller_sim_lights(boards[0].sim, &dark_s), 0); /* by its lease */
    plug_in_again(0, 7);
    assert_ok(weft_controller_reopen(c, 5, err));
    assert_false(weft_controller_is_gone(c));
    assert_string_equal(weft_controller_get_info(c)->port, boards[0].link);
    assert_string_equal(weft_controller_get_info(c)->serial_number, "WL-00001"); /* the same EEPROM */
    assert_ok(weft_controller_light(c, 1 << 5, 256, 2000, NULL, err));
    assert_int_equal(weft_controller_sim_lights(boards[0].sim, NULL), 1 << 5);
    weft_controller_close(c);
    assert_int_equal(weft_controller_sim_lights(boards[0].sim, NULL), 0);
}

static void test_another_board_is_not_taken_for_it(void **state)
{
    (void)state;
    plug_in_new(0, firmware, "WL-1");
    plug_in_new(1, firmware, "WL-2");
    weft_controller *const c = open_it("serial:WL-1");
    unplug(0);
    assert_fails(weft_controller_keep_alive(c, err), WEFT_ERR_DEVICE, "has vanished");
    assert_fails(weft_controller_reopen(c, 0.5, err), WEFT_ERR_DEVICE,
                 "the light controller WL-1 has vanished and did not come back within 0.5 s");
    assert_fails(weft_controller_light(c, 1, 256, 100, NULL, err), WEFT_ERR_DEVICE, "has vanished");
    plug_in_again(0, 2);
    assert_ok(weft_controller_reopen(c, 5, err));
    assert_ok(weft_controller_light(c, 1, 256, 1000, NULL, err));
    assert_int_equal(weft_controller_sim_lights(boards[0].sim, NULL), 1);
    assert_int_equal(weft_controller_sim_lights(boards[1].sim, NULL), 0);
    weft_controller *other = NULL;
    assert_fails(weft_controller_open_under(dev, "serial:WL-3", LEASE_MS, &other, err), WEFT_ERR_MISSING,
                 "no light controller with the serial number WL-3");
    assert_fails(weft_controller_open_under(dev, "serial:", LEASE_MS, &other, err), WEFT_ERR_USAGE,
                 "1 to 8 letters");
    weft_controller_close(c);
}

static void test_without_a_number_only_the_one_port_will_do(void **state)
{
    (void)state;
    plug_in_new(0, firmware, NULL);
    weft_controller *const c = open_it(boards[0].link);
    unplug(0);
    assert_fails(weft_controller_keep_alive(c, err), WEFT_ERR_DEVICE, "has vanished");
    plug_in_again(0, 1);
    assert_ok(weft_controller_reopen(c, 5, err));
    assert_int_equal(unlink(boards[0].link), 0);
    make_link(0, 4);
    plug_in_new(1, firmware, NULL);
    unplug(0);
    assert_fails(weft_controller_keep_alive(c, err), WEFT_ERR_DEVICE, "has vanished");
    plug_in_again(0, 5);
    assert_fails(weft_controller_reopen(c, 0.3, err), WEFT_ERR_DEVICE, "it has no serial number");
    weft_controller_close(c);
}

static void test_a_wait_for_it_can_be_cancelled(void **state)
{
    (void)state;
    plug_in_new(0, firmware, "WL-1");
    weft_controller *const c = open_it("serial:WL-1");
    unplug(0);
    assert_fails(weft_controller_keep_alive(c, err), WEFT_ERR_DEVICE, "has vanished");
    weft_cancel_request(true);
    assert_fails(weft_controller_reopen(c, 60, err), WEFT_ERR_CANCELLED, "cancelled");
    weft_cancel_request(false);
    weft_controller_close(c);
}

/* -- rates -------------------------------------------------------------------------------------------------
 */

static void test_firmware_for_bad_cables_is_found_at_its_rate(void **state)
{
    (void)state;
    weft_controller_status first, s; /* what it heard at the wrong rate counts as damaged */
    weft_controller_sim_counters k;
    plug_in_new(0, "tests/firmware/firmware-at-38400.elf", NULL);
    weft_controller *const c = open_it(boards[0].link);
    assert_int_equal(weft_controller_get_info(c)->baud, 38400);
    assert_ok(weft_controller_get_status(c, &first, err));
    for (int i = 0; i < 10; i++) {
        assert_ok(weft_controller_light(c, 1u << i, 256, 2000, NULL, err));
        assert_int_equal(weft_controller_sim_lights(boards[0].sim, NULL), 1 << i);
    }
    assert_ok(weft_controller_get_status(c, &s, err));
    weft_controller_sim_get_counters(boards[0].sim, &k);
    assert_near(k.bits_per_s, 38461.5, 0.1);
    assert_int_equal(s.retries, first.retries);
    assert_int_equal(s.crc_errors, first.crc_errors);
    weft_controller_close(c);
}

static void test_the_port_is_raw_and_does_not_hang_up(void **state)
{
    (void)state;
    struct termios t;
    plug_in_new(0, firmware, NULL);
    weft_controller *const c = open_it(boards[0].link);
    assert_int_equal(weft_controller_get_info(c)->baud, 500000);
    assert_int_equal(tcgetattr(weft_controller_panic_fd(c), &t), 0);
    assert_int_equal(t.c_cflag & (HUPCL | CSTOPB | CRTSCTS | PARENB), 0);
    assert_int_equal(t.c_cflag & (CLOCAL | CREAD | CSIZE), CLOCAL | CREAD | CS8);
    assert_int_equal(t.c_lflag & (ICANON | ECHO | ISIG), 0);
    assert_int_equal(t.c_iflag & (IXON | ICRNL | ISTRIP), 0);
    assert_int_equal(cfgetospeed(&t), B500000);
    assert_int_equal(cfgetispeed(&t), B500000);
    weft_controller_close(c);
}

/* Asks who is there at a rate, as a person at a terminal would.  @return bytes in `text` */
static size_t ask_at(int fd, speed_t speed, char *text, size_t size)
{
    struct termios t;
    assert_int_equal(tcgetattr(fd, &t), 0);
    cfmakeraw(&t);
    cfsetispeed(&t, speed);
    cfsetospeed(&t, speed);
    assert_int_equal(tcsetattr(fd, TCSANOW, &t), 0);
    sleep_ms(50);
    assert_int_equal(write(fd, "\n?\n", 3), 3);
    sleep_ms(150);
    const ssize_t n = read(fd, text, size - 1);
    text[n > 0 ? n : 0] = '\0';
    return n > 0 ? (size_t)n : 0;
}

static void test_at_the_wrong_rate_there_is_nothing_but_garbage(void **state)
{
    (void)state;
    char text[1024];
    static const speed_t wrong[] = {B9600, B38400, B115200, B1000000};
    plug_in_new(0, firmware, NULL);
    const int fd = open(boards[0].pty, O_RDWR | O_NOCTTY | O_NONBLOCK);
    assert_true(fd >= 0);
    sleep_ms(50); /* it resets */
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        ask_at(fd, wrong[i], text, sizeof text);
        assert_null(strstr(text, "Weft"));
    }
    ask_at(fd, B500000, text, sizeof text);
    assert_non_null(strstr(text, "Weft light controller"));
    close(fd);
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup_teardown(name, start, stop)
    const struct CMUnitTest tests[] = {
        TEST(test_comes_back_under_another_name),
        TEST(test_another_board_is_not_taken_for_it),
        TEST(test_without_a_number_only_the_one_port_will_do),
        TEST(test_a_wait_for_it_can_be_cancelled),
        TEST(test_firmware_for_bad_cables_is_found_at_its_rate),
        TEST(test_the_port_is_raw_and_does_not_hang_up),
        TEST(test_at_the_wrong_rate_there_is_nothing_but_garbage),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
