/* weft light set: the settings in the controller's EEPROM. */
#include "core/text.h"
#include "host/cli/command.h"
#include "host/cli/device_open.h"

#include <stdio.h>
#include <string.h>

typedef struct set_args {
    weft_device_options devices;
} set_args;

static const weft_field fields[] = {
    WEFT_CONTROLLER_FIELDS(set_args, devices),
    {0},
};

/* The firmware refuses what is beyond these, too; here they make the better message. */
static const struct {
    const char *name;
    int key, min, max;
} keys[] = {
    {"serial", WEFT_KEY_SERIAL_NUMBER, 0, 0},
    {"lights", WEFT_KEY_N_LIGHTS, 1, 10},
    {"max-on", WEFT_KEY_MAX_ON, 1, 2000},
    {"trim", WEFT_KEY_TRIM, 1, 256},
};

enum { N_KEYS = sizeof keys / sizeof keys[0] };

typedef struct setting {
    int key, index, min, max;
    bool is_text;
} setting;

/* "max-on", or "trim-3". */
static weft_err parse_key(const char *text, setting *s, weft_error *err)
{
    const size_t n = strncmp(text, "trim-", 5) == 0 ? 4 : strlen(text);
    *s = (setting){0};
    for (int i = 0; i < N_KEYS; i++)
        if (strlen(keys[i].name) == n && strncmp(keys[i].name, text, n) == 0) {
            *s = (setting){.key = keys[i].key,
                           .min = keys[i].min,
                           .max = keys[i].max,
                           .is_text = keys[i].key == WEFT_KEY_SERIAL_NUMBER};
            if (s->key != WEFT_KEY_TRIM)
                return WEFT_OK;
            if (text[n] == '-' && weft_text_to_int(text + n + 1, &s->index) && s->index >= 0 && s->index < 10)
                return WEFT_OK;
        }
    return weft_fail(err, WEFT_ERR_USAGE,
                     "\"%s\" is no setting: wanted serial, lights, max-on, trim-0 to trim-9, or defaults",
                     text);
}

static weft_err parse_serial(const char *text, uint8_t value[8], weft_error *err)
{
    const size_t n = strlen(text);
    bool good = n <= 8;
    for (size_t i = 0; i < n && good; i++)
        good = text[i] > ' ' && text[i] < 0x7f;
    if (!good)
        return weft_fail(
            err, WEFT_ERR_USAGE,
            "\"%s\" is no serial number: wanted up to 8 letters, digits and signs without spaces", text);
    for (size_t i = 0; i < n; i++) /* NUL behind it only where there is room */
        value[i] = (uint8_t)text[i];
    return WEFT_OK;
}

static weft_err parse_value(const char *name, const char *text, const setting *s, uint8_t value[8],
                            weft_error *err)
{
    int number;
    memset(value, 0, 8);
    if (s->is_text)
        return parse_serial(text, value, err);
    if (!weft_text_to_int(text, &number) || number < s->min || number > s->max)
        return weft_fail(err, WEFT_ERR_USAGE, "%s: \"%s\": wanted %d to %d", name, text, s->min, s->max);
    value[0] = (uint8_t)number;
    value[1] = (uint8_t)(number >> 8);
    return WEFT_OK;
}

static weft_err print_value(const weft_invocation *inv, const char *name, const setting *s,
                            const uint8_t value[8], weft_error *err)
{
    char text[9] = "";
    const int number = value[0] | value[1] << 8;
    memcpy(text, value, 8);
    if (inv->json)
        return weft_print_json(
            inv, s->is_text ? json_pack("{s:s}", name, text) : json_pack("{s:i}", name, number), err);
    if (s->is_text)
        fprintf(inv->out, "%s %s\n", name, text[0] ? text : "(none)");
    else
        fprintf(inv->out, "%s %d\n", name, number);
    return WEFT_OK;
}

static weft_err reset_all(const weft_invocation *inv, weft_controller *c, weft_error *err)
{
    static const uint8_t nothing[8];
    WEFT_TRY(weft_controller_set_setting(c, WEFT_KEY_DEFAULTS, 0, nothing, err));
    if (inv->json)
        return weft_print_json(inv, json_pack("{s:b}", "defaults", 1), err);
    fputs("all settings are the built-in ones\n", inv->out);
    return WEFT_OK;
}

static weft_err run(const weft_invocation *inv, const void *data, weft_error *err)
{
    const set_args *const args = data;
    const char *const name = inv->operands[0];
    const bool defaults = strcmp(name, "defaults") == 0, stores = inv->n_operands == 2;
    weft_device_names names;
    weft_controller *c = NULL;
    setting s = {0};
    uint8_t value[8];
    if (defaults && stores)
        return weft_fail(err, WEFT_ERR_USAGE, "\"defaults\" takes no value");
    if (!defaults)
        WEFT_TRY(parse_key(name, &s, err));
    if (stores)
        WEFT_TRY(parse_value(name, inv->operands[1], &s, value, err));
    WEFT_TRY(weft_device_options_resolve(&args->devices, &names, err));
    WEFT_TRY(weft_device_open_controller(&names, &c, err));
    weft_err status = WEFT_OK;
    if (defaults)
        status = reset_all(inv, c, err);
    else if (stores)
        status = weft_controller_set_setting(c, s.key, s.index, value, err);
    else
        status = weft_controller_get_setting(c, s.key, s.index, value, err);
    if (status == WEFT_OK && !defaults)
        status = print_value(inv, name, &s, value, err);
    weft_controller_close(c);
    return status;
}

const weft_command weft_cmd_light_set = {
    .name = "light set",
    .summary = "store a setting in the light controller, or read it",
    .operands = "KEY [VALUE]",
    .min_operands = 1,
    .max_operands = 2,
    .args_size = sizeof(set_args),
    .fields = fields,
    .details =
        "Settings stay in the controller without power.  Without VALUE the setting is read.\n"
        "serial   name of this controller, up to 8 characters without spaces\n"
        "lights   number of lights that are there, 1 to 10\n"
        "max-on   ms, longest time that a light may be on at a stretch, 1 to 2000\n"
        "trim-N   brightness of light N at full level, 1 to 256 parts of 256; several lights that are on\n"
        "         together share one line, and the lowest of their trims counts\n"
        "defaults (without VALUE) forgets all of them",
    .example = "weft light set serial WL-00042",
    .run = run,
};
