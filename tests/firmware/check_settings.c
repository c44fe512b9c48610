/* The settings of the firmware on an EEPROM that may lose its power at any byte. */
#include "tests/support/support.h"

#include "firmware/fw_settings.h"
#include "firmware/sim/sim_board.h"

#include <string.h>

static int blank(void **state)
{
    (void)state;
    memset(sim_eeprom, 0xff, sizeof sim_eeprom);
    sim_board_start();
    return 0;
}

static int set_bytes(uint8_t key, uint8_t index, const char *text)
{
    weft_cfg_set_request r = {.key = key, .index = index};
    weft_cfg_set_reply reply;
    memcpy(r.value, text, strlen(text));
    return fw_settings_set(&r, &reply);
}

static int set_number(uint8_t key, uint8_t index, unsigned value)
{
    weft_cfg_set_request r = {.key = key, .index = index};
    weft_cfg_set_reply reply;
    r.value[0] = (uint8_t)value;
    r.value[1] = (uint8_t)(value >> 8);
    return fw_settings_set(&r, &reply);
}

static unsigned get_number(uint8_t key, uint8_t index)
{
    const weft_cfg_get_request r = {.key = key, .index = index};
    weft_cfg_get_reply reply;
    assert_int_equal(fw_settings_get(&r, &reply), WEFT_STATUS_OK);
    return reply.value[0] | (unsigned)reply.value[1] << 8;
}

static void test_a_new_chip_has_defaults(void **state)
{
    (void)state;
    assert_int_equal(fw_settings_state(), WEFT_SETTINGS_DEFAULTS);
    assert_int_equal(fw_settings()->n_lights, 10);
    assert_int_equal(fw_settings()->max_on_ms, 2000);
    for (uint16_t level = 0; level <= 256; level++)
        assert_int_equal(fw_settings_trim(0x3ff, level), level);
}

static void test_values_come_back_after_power_off(void **state)
{
    (void)state;
    assert_int_equal(set_bytes(WEFT_KEY_SERIAL_NUMBER, 0, "WL-00042"), WEFT_STATUS_OK);
    assert_int_equal(set_number(WEFT_KEY_N_LIGHTS, 0, 8), WEFT_STATUS_OK);
    assert_int_equal(set_number(WEFT_KEY_MAX_ON, 0, 750), WEFT_STATUS_OK);
    for (uint8_t i = 0; i < 10; i++)
        assert_int_equal(set_number(WEFT_KEY_TRIM, i, 256u - 20u * i), WEFT_STATUS_OK);
    sim_board_start();
    assert_int_equal(fw_settings_state(), WEFT_SETTINGS_LOADED);
    assert_memory_equal(fw_settings()->serial_number, "WL-00042", 8);
    assert_int_equal(get_number(WEFT_KEY_N_LIGHTS, 0), 8);
    assert_int_equal(get_number(WEFT_KEY_MAX_ON, 0), 750);
    for (uint8_t i = 0; i < 10; i++)
        assert_int_equal(get_number(WEFT_KEY_TRIM, i), 256 - 20 * i);
    assert_int_equal(fw_settings_generation(), 13);
    assert_int_equal(fw_settings_trim(1 << 5, 256), 156);
    assert_int_equal(fw_settings_trim(1 << 5 | 1, 256), 156); /* together: the lowest */
    assert_int_equal(fw_settings_trim(1 << 9, 1), 1);         /* a light that is on is never off */
    assert_int_equal(fw_settings_trim(1 << 9, 0), 0);
}

static void test_values_out_of_range_change_nothing(void **state)
{
    (void)state;
    assert_int_equal(set_bytes(WEFT_KEY_SERIAL_NUMBER, 0, "A"), WEFT_STATUS_OK);
    uint8_t before[SIM_EEPROM_BYTES];
    memcpy(before, sim_eeprom, sizeof before);
    assert_int_equal(set_bytes(WEFT_KEY_SERIAL_NUMBER, 0, "a b"), WEFT_STATUS_BAD_ARG);
    assert_int_equal(set_bytes(WEFT_KEY_SERIAL_NUMBER, 0, "caf\xc3\xa9"), WEFT_STATUS_BAD_ARG);
    assert_int_equal(set_number(WEFT_KEY_N_LIGHTS, 0, 0), WEFT_STATUS_BAD_ARG);
    assert_int_equal(set_number(WEFT_KEY_N_LIGHTS, 0, 11), WEFT_STATUS_BAD_ARG);
    assert_int_equal(set_number(WEFT_KEY_N_LIGHTS, 0, 257), WEFT_STATUS_BAD_ARG);
    assert_int_equal(set_number(WEFT_KEY_MAX_ON, 0, 0), WEFT_STATUS_BAD_ARG);
    assert_int_equal(set_number(WEFT_KEY_MAX_ON, 0, 2001), WEFT_STATUS_BAD_ARG); /* the cap is in flash */
    assert_int_equal(set_number(WEFT_KEY_TRIM, 0, 0), WEFT_STATUS_BAD_ARG);
    assert_int_equal(set_number(WEFT_KEY_TRIM, 0, 257), WEFT_STATUS_BAD_ARG);
    assert_int_equal(set_number(WEFT_KEY_TRIM, 10, 256), WEFT_STATUS_BAD_ARG);
    assert_int_equal(set_number(99, 0, 1), WEFT_STATUS_BAD_ARG);
    assert_memory_equal(before, sim_eeprom, sizeof before);
    assert_memory_equal(fw_settings()->serial_number, "A\0\0\0\0\0\0\0", 8);
}

/* Power goes at each of the writes of a change, in three states of the two slots: afterwards the board has
 * the old value or the new one, says so, and a second attempt succeeds. */
static void test_power_may_go_at_every_write(void **state)
{
    (void)state;
    int cuts = 0, kept_old = 0, took_new = 0;
    for (unsigned changes = 0; changes < 3; changes++)
        for (int writes = 0;; writes++) {
            blank(NULL);
            for (unsigned i = 0; i < changes; i++)
                assert_int_equal(set_number(WEFT_KEY_MAX_ON, 0, 100 + i), WEFT_STATUS_OK);
            const unsigned old = get_number(WEFT_KEY_MAX_ON, 0);
            sim.eeprom_writes_left = writes;
            const int answer = set_number(WEFT_KEY_MAX_ON, 0, 1999);
            const bool cut = sim.eeprom_writes_left == -2;
            sim_board_start(); /* power comes back */
            const unsigned now = get_number(WEFT_KEY_MAX_ON, 0);
            assert_true(now == old || now == 1999);
            if (answer == WEFT_STATUS_OK)
                assert_int_equal(now, 1999); /* what was acknowledged is there */
            assert_int_equal(fw_settings_state(),
                             changes || now == 1999 ? WEFT_SETTINGS_LOADED : WEFT_SETTINGS_DEFAULTS);
            kept_old += cut && now == old;
            took_new += cut && now == 1999;
            cuts += cut;
            assert_int_equal(set_number(WEFT_KEY_MAX_ON, 0, 1500), WEFT_STATUS_OK);
            sim_board_start();
            assert_int_equal(get_number(WEFT_KEY_MAX_ON, 0), 1500);
            if (!cut)
                break;
        }
    print_message("power cut at %d writes: %d times the old value, %d times the new\n", cuts, kept_old,
                  took_new);
    assert_true(cuts >= 3 * 29);
    assert_int_equal(kept_old + took_new, cuts);
}

static void test_damage_is_told_and_not_wiped(void **state)
{
    (void)state;
    assert_int_equal(set_number(WEFT_KEY_MAX_ON, 0, 111), WEFT_STATUS_OK);
    assert_int_equal(set_number(WEFT_KEY_MAX_ON, 0, 222), WEFT_STATUS_OK);
    uint8_t good[SIM_EEPROM_BYTES];
    memcpy(good, sim_eeprom, sizeof good);
    for (int bit = 0; bit < 8 * 28; bit++) { /* any bit of the newer slot: the older one is taken */
        memcpy(sim_eeprom, good, sizeof good);
        sim_eeprom[64 + bit / 8] ^= (uint8_t)(1 << bit % 8);
        sim_board_start();
        const unsigned now = get_number(WEFT_KEY_MAX_ON, 0);
        assert_int_equal(now, 111);
        assert_int_equal(fw_settings_state(), WEFT_SETTINGS_LOADED);
    }
    memcpy(sim_eeprom, good, sizeof good);
    sim_eeprom[8] ^= 1;
    sim_eeprom[64 + 8] ^= 1;
    memcpy(good, sim_eeprom, sizeof good);
    sim_board_start();
    assert_int_equal(fw_settings_state(), WEFT_SETTINGS_UNREADABLE);
    assert_int_equal(fw_settings()->max_on_ms, 2000);
    assert_int_equal(set_number(WEFT_KEY_MAX_ON, 0, 333), WEFT_STATUS_EEPROM);
    assert_memory_equal(sim_eeprom, good, sizeof good);
    assert_int_equal(set_number(WEFT_KEY_DEFAULTS, 0, 0), WEFT_STATUS_OK);
    assert_int_equal(set_number(WEFT_KEY_MAX_ON, 0, 333), WEFT_STATUS_OK);
    sim_board_start();
    assert_int_equal(fw_settings()->max_on_ms, 333);
}

static void test_a_newer_layout_is_told_and_not_wiped(void **state)
{
    (void)state;
    assert_int_equal(set_number(WEFT_KEY_MAX_ON, 0, 111), WEFT_STATUS_OK);
    uint8_t *const slot = sim_eeprom + 0; /* the first change goes there */
    assert_int_equal(slot[0], 0x57);
    slot[1] = 2;
    const uint16_t crc = weft_crc16(slot + 1, 4u + slot[2]);
    slot[5 + slot[2]] = (uint8_t)crc;
    slot[6 + slot[2]] = (uint8_t)(crc >> 8);
    sim_board_start();
    assert_int_equal(fw_settings_state(), WEFT_SETTINGS_UNREADABLE);
    assert_int_equal(fw_settings()->max_on_ms, 2000);
    assert_int_equal(set_number(WEFT_KEY_N_LIGHTS, 0, 3), WEFT_STATUS_EEPROM);
    assert_int_equal(slot[1], 2);
}

/* An EEPROM that takes no byte more: what is not stored is not in use either. */
static void test_what_cannot_be_stored_is_not_used(void **state)
{
    (void)state;
    assert_int_equal(set_number(WEFT_KEY_N_LIGHTS, 0, 6), WEFT_STATUS_OK);
    sim.eeprom_writes_left = 0;
    assert_int_equal(set_number(WEFT_KEY_N_LIGHTS, 0, 7), WEFT_STATUS_EEPROM);
    assert_int_equal(fw_settings()->n_lights, 6);
    assert_int_equal(set_number(WEFT_KEY_DEFAULTS, 0, 0), WEFT_STATUS_EEPROM);
    assert_int_equal(fw_settings()->n_lights, 6);
    sim_board_start();
    assert_int_equal(fw_settings()->n_lights, 6);
}

static void test_generations_wrap(void **state)
{
    (void)state;
    for (unsigned i = 0; i < 65600; i++)
        assert_int_equal(set_number(WEFT_KEY_MAX_ON, 0, 1 + i % 2000), WEFT_STATUS_OK);
    for (unsigned i = 65600; i < 65700; i++) {
        assert_int_equal(set_number(WEFT_KEY_MAX_ON, 0, 1 + i % 2000), WEFT_STATUS_OK);
        sim_board_start();
        assert_int_equal(get_number(WEFT_KEY_MAX_ON, 0), 1 + i % 2000);
    }
    for (unsigned i = 0; i < 65536 - 65700 % 65536 + 5; i++) {
        assert_int_equal(set_number(WEFT_KEY_MAX_ON, 0, 1 + i % 2000), WEFT_STATUS_OK);
        if (fw_settings_generation() > 5 && fw_settings_generation() < 65530)
            continue;
        sim_board_start();
        assert_int_equal(get_number(WEFT_KEY_MAX_ON, 0), 1 + i % 2000);
    }
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup(name, blank)
    const struct CMUnitTest tests[] = {
        TEST(test_a_new_chip_has_defaults),
        TEST(test_values_come_back_after_power_off),
        TEST(test_values_out_of_range_change_nothing),
        TEST(test_power_may_go_at_every_write),
        TEST(test_damage_is_told_and_not_wiped),
        TEST(test_a_newer_layout_is_told_and_not_wiped),
        TEST(test_what_cannot_be_stored_is_not_used),
        TEST(test_generations_wrap),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
