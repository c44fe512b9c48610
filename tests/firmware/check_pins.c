/* The table of pins in docs/hardware.md, and the wiring diagram, against the constants that the firmware is
 * built with: what people solder is what it drives. */
#include "tests/support/support.h"

#include "firmware/avr/avr_pins.h"
#include "firmware/fw_config.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static char page[1 << 16];

static void read_page(const char *name)
{
    char path[1024];
    const char *const source = getenv("WEFT_TEST_SOURCE");
    snprintf(path, sizeof path, "%s/docs/%s", source ? source : ".", name);
    FILE *const file = fopen(path, "rb");
    if (!file)
        fail_msg("%s cannot be read", path);
    const size_t n = fread(page, 1, sizeof page - 1, file);
    fclose(file);
    page[n] = '\0';
}

static int bit_of(unsigned mask)
{
    int bit = 0;
    while (mask >> bit > 1)
        bit++;
    assert_int_equal(mask, 1u << bit); /* one pin */
    return bit;
}

/* An Uno's name of a pin of port 'B', 'C' or 'D' (the board's own drawing). */
static void arduino_name(char port, int bit, char name[16])
{
    if (port == 'C')
        snprintf(name, 16, "A%d", bit);
    else
        snprintf(name, 16, "D%d", port == 'B' ? 8 + bit : bit);
}

static void assert_row(const char *what, char port, unsigned mask)
{
    char arduino[16], row[64];
    const int bit = bit_of(mask);
    arduino_name(port, bit, arduino);
    snprintf(row, sizeof row, "\n| %s | P%c%d | %s |", what, port, bit, arduino);
    if (!strstr(page, row))
        fail_msg("docs/hardware.md has no row \"%s\"", row + 1);
}

static void test_table_of_the_document(void **state)
{
    (void)state;
    read_page("hardware.md");
    for (int i = 0; i < FW_N_LIGHTS; i++) {
        char what[16];
        const unsigned d = AVR_PORTD_OF(1u << i), c = AVR_PORTC_OF(1u << i);
        snprintf(what, sizeof what, "light %d", i);
        assert_true((d != 0) != (c != 0));
        assert_int_equal(d & ~(unsigned)AVR_LIGHTS_D, 0);
        assert_row(what, d ? 'D' : 'C', d ? d : c);
    }
    assert_row("dimming", 'B', AVR_DIMMING);
    assert_row("camera trigger", 'B', AVR_TRIGGER);
    assert_row("exposure of the camera", 'B', AVR_EXPOSURE);
    assert_row("status LED", 'B', AVR_STATUS);
}

/* The drawing names each pin once, as <text ... data-pin="light 0">D2</text>. */
static void assert_drawn(const char *what, char port, unsigned mask)
{
    char arduino[16], words[64];
    arduino_name(port, bit_of(mask), arduino);
    snprintf(words, sizeof words, "data-pin=\"%s\">%s<", what, arduino);
    if (!strstr(page, words))
        fail_msg("docs/images/wiring.svg has no text with %s", words);
}

static void test_drawing(void **state)
{
    (void)state;
    read_page("images/wiring.svg");
    for (int i = 0; i < FW_N_LIGHTS; i++) {
        char what[16];
        const unsigned d = AVR_PORTD_OF(1u << i), c = AVR_PORTC_OF(1u << i);
        snprintf(what, sizeof what, "light %d", i);
        assert_drawn(what, d ? 'D' : 'C', d ? d : c);
    }
    assert_drawn("dimming", 'B', AVR_DIMMING);
    assert_drawn("trigger", 'B', AVR_TRIGGER);
    assert_drawn("exposure", 'B', AVR_EXPOSURE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_table_of_the_document),
        cmocka_unit_test(test_drawing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
