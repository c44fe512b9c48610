/*
 * udev/70-weft.rules: read as udev reads rules (udev(7)), and applied to devices as they are on the bus.
 * udevadm of Debian 12 cannot verify rules, and a machine that tests has no such devices.
 */
#include "tests/support/support.h"

#include "core/file.h"
#include "core/mem.h"
#include "host/light/usb_boards.h"

#include <fnmatch.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_RULES = 64, MAX_TERMS = 12, MAX_PAIRS = 24 };

/* ATTRS{idVendor}=="2341" */
typedef struct term {
    char key[32], op[4], value[96];
} term;

typedef struct rule {
    int line, n;
    term terms[MAX_TERMS];
} rule;

static rule rules[MAX_RULES];
static int n_rules;

/* What is known of a device, or was set: "ENV{ID_WEFT}" -> "light". */
typedef struct pairs {
    int n;
    char keys[MAX_PAIRS][32], values[MAX_PAIRS][96];
} pairs;

static const char *const known_keys[] = {"ACTION", "SUBSYSTEM", "ATTR{",   "ATTRS{", "ENV{", "TAG",
                                         "GROUP",  "MODE",      "SYMLINK", "GOTO",   "LABEL"};

static bool is_known(const char *key)
{
    for (size_t i = 0; i < sizeof known_keys / sizeof known_keys[0]; i++) {
        const size_t n = strlen(known_keys[i]);
        const bool braced = known_keys[i][n - 1] == '{';
        if (strncmp(key, known_keys[i], n) == 0 && (braced ? key[strlen(key) - 1] == '}' : key[n] == '\0'))
            return true;
    }
    return false;
}

/* One KEY, operator and quoted value; gives what follows them. */
static const char *parse_term(const char *p, term *t, int line)
{
    const size_t key = strcspn(p, "=!+ ,\"");
    const size_t op = strspn(p + key, "=!+");
    const char *const quote = p + key + op;
    const char *const end = *quote == '"' ? strchr(quote + 1, '"') : NULL;
    if (key == 0 || key >= sizeof t->key || op == 0 || op > 2 || !end ||
        (size_t)(end - quote) > sizeof t->value)
        fail_msg("line %d: not KEY, operator, \"value\": %s", line, p);
    snprintf(t->key, sizeof t->key, "%.*s", (int)key, p);
    snprintf(t->op, sizeof t->op, "%.*s", (int)op, p + key);
    snprintf(t->value, sizeof t->value, "%.*s", (int)(end - quote - 1), quote + 1);
    if (!is_known(t->key))
        fail_msg("line %d: key %s", line, t->key);
    return end + 1;
}

static int load(void **state)
{
    (void)state;
    char path[1024], *text = NULL, *rest, *row;
    size_t size;
    const char *const source = getenv("WEFT_TEST_SOURCE");
    snprintf(path, sizeof path, "%s/udev/70-weft.rules", source ? source : ".");
    weft_error error = {0};
    if (weft_file_read(path, 1 << 16, &text, &size, &error) != WEFT_OK) {
        print_error("%s\n", error.text);
        return 1;
    }
    rest = text;
    for (int line = 1; (row = strsep(&rest, "\n")) != NULL; line++) {
        const char *p = row;
        if (*p == '#' || *p == '\0')
            continue;
        rule *const r = &rules[n_rules++];
        r->line = line;
        while (*p) {
            p = parse_term(p, &r->terms[r->n++], line);
            if (*p && strncmp(p, ", ", 2) != 0)
                fail_msg("line %d: terms are parted by \", \": %s", line, p);
            p += *p ? 2 : 0;
        }
    }
    weft_free(text);
    return 0;
}

/* -- applying ------------------------------------------------------------------------------------------- */

static const char *get(const pairs *p, const char *key)
{
    for (int i = p->n - 1; i >= 0; i--)
        if (strcmp(p->keys[i], key) == 0)
            return p->values[i];
    return "";
}

static void put(pairs *p, const char *key, const char *value)
{
    assert_true(p->n < MAX_PAIRS);
    snprintf(p->keys[p->n], sizeof p->keys[0], "%s", key);
    snprintf(p->values[p->n++], sizeof p->values[0], "%s", value);
}

/* "0001|0043" and shell patterns */
static bool value_matches(const char *patterns, const char *value)
{
    char copy[96], *rest = copy, *pattern;
    snprintf(copy, sizeof copy, "%s", patterns);
    while ((pattern = strsep(&rest, "|")) != NULL)
        if (fnmatch(pattern, value, 0) == 0)
            return true;
    return false;
}

static bool rule_matches(const rule *r, const pairs *device)
{
    for (int i = 0; i < r->n; i++) {
        const term *const t = &r->terms[i];
        if (strcmp(t->op, "==") == 0 && !value_matches(t->value, get(device, t->key)))
            return false;
        if (strcmp(t->op, "!=") == 0 && value_matches(t->value, get(device, t->key)))
            return false;
    }
    return true;
}

static int find_label(const char *name, int after)
{
    for (int i = after; i < n_rules; i++)
        if (strcmp(rules[i].terms[0].key, "LABEL") == 0 && strcmp(rules[i].terms[0].value, name) == 0)
            return i;
    fail_msg("no LABEL %s behind its GOTO", name);
    return n_rules;
}

/* A value with $env{NAME} filled in. */
static void expand(const char *value, const pairs *device, char *text, size_t size)
{
    const char *const dollar = strstr(value, "$env{");
    char key[32];
    if (!dollar) {
        snprintf(text, size, "%s", value);
        return;
    }
    snprintf(key, sizeof key, "ENV{%.*s}", (int)strcspn(dollar + 5, "}"), dollar + 5);
    snprintf(text, size, "%.*s%s", (int)(dollar - value), value, get(device, key));
}

static void apply(const pairs *device, pairs *result)
{
    *result = (pairs){0};
    for (int i = 0; i < n_rules; i++) {
        if (!rule_matches(&rules[i], device))
            continue;
        for (int k = 0; k < rules[i].n; k++) {
            const term *const t = &rules[i].terms[k];
            char value[96];
            if (strcmp(t->key, "GOTO") == 0)
                i = find_label(t->value, i) - 1;
            else if (strcmp(t->key, "LABEL") != 0 && (strcmp(t->op, "=") == 0 || strcmp(t->op, "+=") == 0)) {
                expand(t->value, device, value, sizeof value);
                put(result, t->key, value);
            }
            if (strcmp(t->key, "GOTO") == 0)
                break;
        }
    }
}

#define DEVICE(...) device_of((const char *const[]){__VA_ARGS__, NULL})

static pairs device_of(const char *const *words)
{
    pairs device = {0}, result;
    for (; *words; words += 2)
        put(&device, words[0], words[1]);
    apply(&device, &result);
    return result;
}

/* -- tests ---------------------------------------------------------------------------------------------- */

static void test_arduino_uno(void **state)
{
    (void)state;
    const pairs r =
        DEVICE("ACTION", "add", "SUBSYSTEM", "tty", "ATTRS{idVendor}", "2341", "ATTRS{idProduct}", "0043",
               "ENV{ID_SERIAL_SHORT}", "75830333238351F0B1A0", "ENV{ID_PATH_TAG}", "pci-1");
    assert_string_equal(get(&r, "TAG"), "uaccess");
    assert_string_equal(get(&r, "ENV{ID_WEFT}"), "light");
    assert_string_equal(get(&r, "ENV{ID_MM_PORT_IGNORE}"), "1");
    assert_string_equal(get(&r, "SYMLINK"), "weft/light-75830333238351F0B1A0");
    assert_string_equal(get(&r, "GROUP"), ""); /* stays dialout */
    const pairs usb = DEVICE("ACTION", "add", "SUBSYSTEM", "usb", "ENV{DEVTYPE}", "usb_device",
                             "ATTR{idVendor}", "2341", "ATTR{idProduct}", "0243");
    assert_string_equal(get(&usb, "ENV{ID_MM_DEVICE_IGNORE}"), "1");
    assert_string_equal(get(&usb, "SYMLINK"), "");
}

/* The boards that weft flash knows are those of the rules, one for one. */
static void test_rules_and_program_know_the_same_boards(void **state)
{
    (void)state;
    int known = 0, nominated = 0;
    for (const weft_usb_id *id = weft_usb_ids; id->vendor; id++, known++) {
        char vendor[8], product[8];
        snprintf(vendor, sizeof vendor, "%04x", id->vendor);
        snprintf(product, sizeof product, "%04x", id->product);
        const pairs tty = DEVICE("ACTION", "add", "SUBSYSTEM", "tty", "ATTRS{idVendor}", vendor,
                                 "ATTRS{idProduct}", product, "ENV{ID_PATH_TAG}", "pci-1");
        assert_string_equal(get(&tty, "ENV{ID_WEFT}"), "light");
        const pairs usb = DEVICE("ACTION", "add", "SUBSYSTEM", "usb", "ENV{DEVTYPE}", "usb_device",
                                 "ATTR{idVendor}", vendor, "ATTR{idProduct}", product);
        assert_string_equal(get(&usb, "ENV{ID_MM_DEVICE_IGNORE}"), "1");
    }
    for (int i = 0; i < n_rules; i++)
        for (int k = 0; k < rules[i].n; k++) {
            const term *const t = &rules[i].terms[k];
            if (strcmp(t->key, "ATTRS{idProduct}") != 0)
                continue;
            nominated++;
            for (const char *bar = strchr(t->value, '|'); bar; bar = strchr(bar + 1, '|'))
                nominated++;
        }
    assert_int_equal(nominated, known);
}

static void test_copy_without_serial_number(void **state)
{
    (void)state;
    const pairs r = DEVICE("ACTION", "change", "SUBSYSTEM", "tty", "ATTRS{idVendor}", "1a86",
                           "ATTRS{idProduct}", "7523", "ENV{ID_PATH_TAG}", "pci-0000_00_14_0-usb-0_2_1_0");
    assert_string_equal(get(&r, "SYMLINK"), "weft/light-pci-0000_00_14_0-usb-0_2_1_0");
    assert_int_equal(r.n, 5);
}

static void test_cameras(void **state)
{
    (void)state;
    const pairs vision = DEVICE("ACTION", "add", "SUBSYSTEM", "usb", "ENV{DEVTYPE}", "usb_device",
                                "ENV{ID_USB_INTERFACES}", ":ef0500:ef0501:");
    assert_string_equal(get(&vision, "ENV{ID_WEFT}"), "camera");
    assert_string_equal(get(&vision, "TAG"), "uaccess");
    assert_string_equal(get(&vision, "MODE"), "0660");
    const pairs nikon =
        DEVICE("ACTION", "add", "SUBSYSTEM", "usb", "ENV{DEVTYPE}", "usb_device", "ATTR{idVendor}", "04b0",
               "ATTR{idProduct}", "0429", "ENV{ID_USB_INTERFACES}", ":060101:");
    assert_string_equal(get(&nikon, "ENV{ID_WEFT}"), "camera");
    assert_string_equal(get(&nikon, "TAG"), "uaccess");
}

static void test_nothing_else_is_touched(void **state)
{
    (void)state;
    const pairs others[] = {
        DEVICE("ACTION", "remove", "SUBSYSTEM", "tty", "ATTRS{idVendor}", "2341", "ATTRS{idProduct}", "0043"),
        DEVICE("ACTION", "add", "SUBSYSTEM", "tty", "ATTRS{idVendor}", "0403", "ATTRS{idProduct}", "6001"),
        DEVICE("ACTION", "add", "SUBSYSTEM", "tty", "ATTRS{idVendor}", "2341", "ATTRS{idProduct}", "8036"),
        DEVICE("ACTION", "add", "SUBSYSTEM", "tty"),
        DEVICE("ACTION", "add", "SUBSYSTEM", "usb", "ENV{DEVTYPE}", "usb_device", "ENV{ID_USB_INTERFACES}",
               ":030101:"),
        DEVICE("ACTION", "add", "SUBSYSTEM", "usb", "ENV{DEVTYPE}", "usb_interface", "ATTR{idVendor}", "04b0",
               "ATTR{idProduct}", "0429"),
        DEVICE("ACTION", "add", "SUBSYSTEM", "block", "ENV{ID_USB_INTERFACES}", ":ef0500:"),
    };
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++)
        assert_int_equal(others[i].n, 0);
}

static void test_nothing_is_open_to_all(void **state)
{
    (void)state;
    assert_true(n_rules > 8);
    for (int i = 0; i < n_rules; i++)
        for (int k = 0; k < rules[i].n; k++) {
            const term *const t = &rules[i].terms[k];
            if (strcmp(t->key, "MODE") == 0)
                assert_string_equal(t->value, "0660");
            if (strncmp(t->key, "ATTR", 4) == 0) /* numbers as the kernel writes them */
                assert_int_equal(strspn(t->value, "0123456789abcdef|"), strlen(t->value));
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_arduino_uno),
        cmocka_unit_test(test_rules_and_program_know_the_same_boards),
        cmocka_unit_test(test_copy_without_serial_number),
        cmocka_unit_test(test_cameras),
        cmocka_unit_test(test_nothing_else_is_touched),
        cmocka_unit_test(test_nothing_is_open_to_all),
    };
    return cmocka_run_group_tests(tests, load, NULL);
}
