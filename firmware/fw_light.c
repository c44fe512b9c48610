#include "firmware/fw_light.h"

#include "firmware/fw_board.h"
#include "firmware/fw_config.h"
#include "firmware/fw_safety.h"
#include "firmware/fw_settings.h"

static struct {
    uint16_t mask, level;
    uint16_t since_ms, max_on_ms;
    uint32_t on_tick, off_tick;
    uint16_t max_on_offs;
} light;

void fw_light_init(void)
{
    light.mask = light.level = 0;
    light.max_on_offs = 0;
    light.on_tick = light.off_tick = 0;
}

void fw_light_dark(void)
{
    fw_board_dark();
}

bool fw_light_set(uint16_t mask, uint16_t level, uint16_t max_on_ms)
{
    if (mask == 0 || level == 0) {
        fw_light_off();
        return !fw_safety_panicked();
    }
    const uint16_t trimmed = fw_settings_trim(mask, level);
    const uint8_t was = fw_board_lock();
    const bool allowed = !fw_safety_panicked();
    const bool same = mask == light.mask && level == light.level;
    if (allowed && !same)
        fw_board_light(mask, trimmed);
    fw_board_unlock(was);
    if (!allowed)
        return false;
    if (!same)
        light.on_tick = fw_board_ticks();
    light.mask = mask;
    light.level = level;
    light.since_ms = fw_board_ms();
    light.max_on_ms = max_on_ms;
    return true;
}

void fw_light_off(void)
{
    fw_light_dark();
    if (light.mask)
        light.off_tick = fw_board_ticks();
    light.mask = light.level = 0;
}

void fw_light_poll(void)
{
    if (light.mask && fw_light_left_ms() == 0) {
        fw_light_off();
        if (light.max_on_offs != UINT16_MAX)
            light.max_on_offs++;
    }
}

uint16_t fw_light_mask(void)
{
    return light.mask;
}

uint16_t fw_light_level(void)
{
    return light.level;
}

uint16_t fw_light_left_ms(void)
{
    const uint16_t on_ms = (uint16_t)(fw_board_ms() - light.since_ms);
    return light.mask && on_ms < light.max_on_ms ? (uint16_t)(light.max_on_ms - on_ms) : 0;
}

uint32_t fw_light_on_tick(void)
{
    return light.on_tick;
}

uint32_t fw_light_off_tick(void)
{
    return light.off_tick;
}

uint16_t fw_light_max_on_offs(void)
{
    return light.max_on_offs;
}
