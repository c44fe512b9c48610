#include "firmware/fw_settings.h"

#include "firmware/fw_board.h"

#include <string.h>

/* A slot: magic, layout version, length of the payload, generation (2), payload, CRC (2) of all but the
 * magic.  The magic is written last and taken away first: a slot that has it was whole when it was written.
 */
enum {
    MAGIC = 0x57,
    LAYOUT = 1,
    HEAD = 5,
    PAYLOAD = 8 + 1 + 2 + FW_N_LIGHTS,
    SLOT = HEAD + PAYLOAD + 2,
    LONGEST = 48, /* payload of any layout that this can tell from damage */
    SLOT_PLACE = 64,
};

_Static_assert((int)SLOT <= (int)SLOT_PLACE && (int)HEAD + LONGEST + 2 <= (int)SLOT_PLACE, "slots overlap");

static struct {
    fw_settings_values values;
    uint16_t generation;
    uint8_t state;
    uint8_t slot; /* that holds them */
} settings;

static void set_defaults(fw_settings_values *v)
{
    memset(v, 0, sizeof *v);
    v->n_lights = FW_N_LIGHTS;
    v->max_on_ms = FW_MAX_ON_MS;
    memset(v->trims, 255, sizeof v->trims);
}

static bool are_sane(const fw_settings_values *v)
{
    return v->n_lights >= 1 && v->n_lights <= FW_N_LIGHTS && v->max_on_ms >= 1 &&
           v->max_on_ms <= FW_MAX_ON_MS;
}

/* -- slots ---------------------------------------------------------------------------------------------- */

static void read_slot(uint8_t slot, uint8_t *bytes, uint8_t n)
{
    for (uint8_t i = 0; i < n; i++)
        bytes[i] = fw_board_eeprom_read((uint16_t)(slot * SLOT_PLACE + i));
}

typedef enum slot_kind { SLOT_EMPTY, SLOT_DAMAGED, SLOT_WHOLE } slot_kind;

static slot_kind look_at_slot(uint8_t slot, uint8_t *bytes)
{
    read_slot(slot, bytes, SLOT_PLACE);
    if (bytes[0] != MAGIC)
        return SLOT_EMPTY;
    const uint8_t length = bytes[2];
    if (length > LONGEST)
        return SLOT_DAMAGED;
    const uint8_t *const end = bytes + HEAD + length;
    return weft_crc16(bytes + 1, HEAD - 1u + length) == (uint16_t)(end[0] | end[1] << 8) ? SLOT_WHOLE
                                                                                         : SLOT_DAMAGED;
}

static void unpack(const uint8_t *p)
{
    fw_settings_values *const v = &settings.values;
    memcpy(v->serial_number, p, 8);
    v->n_lights = p[8];
    v->max_on_ms = (uint16_t)(p[9] | p[10] << 8);
    memcpy(v->trims, p + 11, FW_N_LIGHTS);
}

static void pack(const fw_settings_values *v, uint8_t *p)
{
    memcpy(p, v->serial_number, 8);
    p[8] = v->n_lights;
    p[9] = (uint8_t)v->max_on_ms;
    p[10] = (uint8_t)(v->max_on_ms >> 8);
    memcpy(p + 11, v->trims, FW_N_LIGHTS);
}

void fw_settings_init(void)
{
    uint8_t bytes[SLOT_PLACE];
    bool found = false, damaged = false;
    set_defaults(&settings.values);
    settings.generation = 0;
    settings.slot = 1;
    settings.state = WEFT_SETTINGS_DEFAULTS;
    for (uint8_t slot = 0; slot < 2; slot++) {
        const slot_kind kind = look_at_slot(slot, bytes);
        damaged |= kind == SLOT_DAMAGED;
        if (kind != SLOT_WHOLE)
            continue;
        const uint16_t generation = (uint16_t)(bytes[3] | bytes[4] << 8);
        if (found && (int16_t)(generation - settings.generation) < 0)
            continue;
        found = true;
        settings.generation = generation;
        settings.slot = slot;
        settings.state = WEFT_SETTINGS_UNREADABLE;
        set_defaults(&settings.values);
        if (bytes[1] == LAYOUT && bytes[2] == PAYLOAD) {
            unpack(bytes + HEAD);
            settings.state = WEFT_SETTINGS_LOADED;
        }
    }
    if (found ? settings.state == WEFT_SETTINGS_LOADED && !are_sane(&settings.values) : damaged) {
        set_defaults(&settings.values);
        settings.state = WEFT_SETTINGS_UNREADABLE;
    }
}

/* Into the other slot.  @return whether it reads back */
static bool store(const fw_settings_values *v)
{
    uint8_t bytes[SLOT], back[SLOT];
    const uint8_t slot = settings.slot ^ 1u;
    const uint16_t generation = (uint16_t)(settings.generation + 1);
    bytes[0] = MAGIC;
    bytes[1] = LAYOUT;
    bytes[2] = PAYLOAD;
    bytes[3] = (uint8_t)generation;
    bytes[4] = (uint8_t)(generation >> 8);
    pack(v, bytes + HEAD);
    const uint16_t crc = weft_crc16(bytes + 1, HEAD - 1 + PAYLOAD);
    bytes[SLOT - 2] = (uint8_t)crc;
    bytes[SLOT - 1] = (uint8_t)(crc >> 8);
    const uint16_t place = (uint16_t)(slot * SLOT_PLACE);
    fw_board_eeprom_write(place, 0xff);
    for (int i = 1; i < SLOT; i++)
        fw_board_eeprom_write((uint16_t)(place + i), bytes[i]);
    fw_board_eeprom_write(place, MAGIC);
    read_slot(slot, back, SLOT);
    if (memcmp(bytes, back, SLOT) != 0)
        return false;
    settings.values = *v;
    settings.generation = generation;
    settings.slot = slot;
    settings.state = WEFT_SETTINGS_LOADED;
    return true;
}

/* -- access --------------------------------------------------------------------------------------------- */

const fw_settings_values *fw_settings(void)
{
    return &settings.values;
}

uint8_t fw_settings_state(void)
{
    return settings.state;
}

uint16_t fw_settings_generation(void)
{
    return settings.generation;
}

uint16_t fw_settings_trim(uint16_t mask, uint16_t level)
{
    uint8_t trim = 255;
    for (uint8_t i = 0; i < FW_N_LIGHTS; i++, mask >>= 1)
        if (mask & 1 && settings.values.trims[i] < trim)
            trim = settings.values.trims[i];
    const uint16_t trimmed = (uint16_t)(((uint32_t)level * (trim + 1u) + 128u) >> 8);
    return level && trimmed == 0 ? 1 : trimmed;
}

static void put_u16(uint8_t *bytes, uint16_t value)
{
    bytes[0] = (uint8_t)value;
    bytes[1] = (uint8_t)(value >> 8);
}

uint8_t fw_settings_get(const weft_cfg_get_request *request, weft_cfg_get_reply *reply)
{
    const fw_settings_values *const v = &settings.values;
    memset(reply, 0, sizeof *reply);
    reply->generation = settings.generation;
    switch (request->key) {
    case WEFT_KEY_SERIAL_NUMBER:
        memcpy(reply->value, v->serial_number, 8);
        break;
    case WEFT_KEY_N_LIGHTS:
        put_u16(reply->value, v->n_lights);
        break;
    case WEFT_KEY_MAX_ON:
        put_u16(reply->value, v->max_on_ms);
        break;
    case WEFT_KEY_TRIM:
        if (request->index >= FW_N_LIGHTS)
            return WEFT_STATUS_BAD_ARG;
        put_u16(reply->value, (uint16_t)(v->trims[request->index] + 1));
        break;
    default:
        return WEFT_STATUS_BAD_ARG;
    }
    return WEFT_STATUS_OK;
}

/* Printable ASCII, then only NUL. */
static bool is_serial_number(const uint8_t *text)
{
    uint8_t i = 0;
    while (i < 8 && text[i] > ' ' && text[i] < 0x7f)
        i++;
    while (i < 8 && text[i] == 0)
        i++;
    return i == 8;
}

static bool change(fw_settings_values *v, const weft_cfg_set_request *request)
{
    const uint16_t number = (uint16_t)(request->value[0] | request->value[1] << 8);
    switch (request->key) {
    case WEFT_KEY_DEFAULTS:
        return true;
    case WEFT_KEY_SERIAL_NUMBER:
        memcpy(v->serial_number, request->value, 8);
        return is_serial_number(v->serial_number);
    case WEFT_KEY_N_LIGHTS:
        v->n_lights = (uint8_t)number;
        return number >= 1 && number <= FW_N_LIGHTS;
    case WEFT_KEY_MAX_ON:
        v->max_on_ms = number;
        return number >= 1 && number <= FW_MAX_ON_MS;
    case WEFT_KEY_TRIM:
        if (request->index >= FW_N_LIGHTS || number < 1 || number > 256)
            return false;
        v->trims[request->index] = (uint8_t)(number - 1);
        return true;
    default:
        return false;
    }
}

uint8_t fw_settings_set(const weft_cfg_set_request *request, weft_cfg_set_reply *reply)
{
    fw_settings_values v = settings.values;
    if (request->key == WEFT_KEY_DEFAULTS)
        set_defaults(&v);
    else if (settings.state == WEFT_SETTINGS_UNREADABLE)
        return WEFT_STATUS_EEPROM;
    if (!change(&v, request))
        return WEFT_STATUS_BAD_ARG;
    if (!store(&v))
        return WEFT_STATUS_EEPROM;
    reply->generation = settings.generation;
    return WEFT_STATUS_OK;
}
