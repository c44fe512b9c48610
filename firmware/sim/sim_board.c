#include "firmware/sim/sim_board.h"

#include "firmware/fw_board.h"
#include "firmware/fw_config.h"
#include "firmware/fw_light.h"
#include "firmware/fw_link.h"
#include "firmware/fw_safety.h"
#include "firmware/fw_sequence.h"
#include "firmware/fw_settings.h"

#include <assert.h>

sim_board sim;
uint8_t sim_eeprom[SIM_EEPROM_BYTES];

void sim_board_start(void)
{
    sim = (sim_board){.eeprom_writes_left = -1};
    fw_link_init();
    fw_safety_init();
    fw_light_init();
    fw_sequence_init();
    fw_settings_init();
    fw_board_init();
}

void sim_board_turn(void)
{
    do {
        fw_link_poll();
        fw_light_poll();
        fw_sequence_poll();
        fw_safety_poll();
        fw_board_watchdog_feed();
        assert(sim.locked == 0);
    } while (fw_link_has_bytes()); /* the board does not sleep then */
}

void sim_board_pass_ms(int ms)
{
    for (int i = 0; i < ms; i++) {
        const uint32_t until = sim.tick + FW_TICKS_A_MS;
        while (sim.alarm && (int32_t)(until - sim.alarm_tick) >= 0) {
            sim.tick = sim.alarm_tick;
            sim.alarm = false;
            sim.locked++;
            fw_sequence_on_alarm();
            sim.locked--;
        }
        sim.tick = until;
        sim_board_turn();
    }
}

void fw_board_init(void) {}

uint8_t fw_board_reset_cause(void)
{
    return sim.reset_cause;
}

uint16_t fw_board_resets(void)
{
    return sim.resets;
}

uint8_t fw_board_lock(void)
{
    sim.locked++;
    return (uint8_t)(sim.locked - 1);
}

void fw_board_unlock(uint8_t was)
{
    assert(sim.locked == was + 1);
    sim.locked = was;
}

void fw_board_dark(void)
{
    sim.mask = sim.level = 0;
    sim.darkened++;
}

void fw_board_light(uint16_t mask, uint16_t level)
{
    assert(sim.locked > 0 && mask && level);
    sim.mask = mask;
    sim.level = level;
    sim.lit++;
}

uint32_t fw_board_ticks(void)
{
    return sim.tick;
}

uint16_t fw_board_ms(void)
{
    return (uint16_t)(sim.tick / FW_TICKS_A_MS);
}

void fw_board_trigger(bool high)
{
    assert(sim.locked > 0);
    sim.trigger = high;
}

void fw_board_watch_exposure(bool on)
{
    sim.watching = on;
}

bool fw_board_is_exposing(void)
{
    return sim.exposing;
}

void sim_board_expose(bool high)
{
    sim.exposing = high;
    sim.locked++;
    if (sim.watching)
        fw_sequence_on_exposure(high, sim.tick);
    sim.locked--;
}

void fw_board_alarm_begin(uint32_t ticks)
{
    assert(sim.locked > 0);
    sim.alarm = true;
    sim.alarm_tick = sim.tick + ticks;
}

void fw_board_alarm_after(uint32_t ticks)
{
    sim.alarm = true;
    sim.alarm_tick += ticks;
}

void fw_board_alarm_stop(void)
{
    sim.alarm = false;
}

uint8_t fw_board_eeprom_read(uint16_t address)
{
    assert(address < SIM_EEPROM_BYTES);
    return sim_eeprom[address];
}

/* Without power nothing is written any more; the byte that was being written is then neither. */
void fw_board_eeprom_write(uint16_t address, uint8_t byte)
{
    assert(address < SIM_EEPROM_BYTES);
    if (sim.eeprom_writes_left == 0) {
        sim.eeprom_writes_left = -2;
        sim_eeprom[address] = (uint8_t)(sim_eeprom[address] & byte & 0xa5);
    }
    if (sim.eeprom_writes_left == -2)
        return;
    if (sim.eeprom_writes_left > 0)
        sim.eeprom_writes_left--;
    sim_eeprom[address] = byte;
}

void fw_board_reboot(void)
{
    sim.rebooting = true;
}

void fw_board_send(void)
{
    uint8_t byte;
    while (!sim.stalled && sim.sent < sizeof sim.wire && fw_link_next_byte(&byte))
        sim.wire[sim.sent++] = byte;
}

void fw_board_status_led(bool on)
{
    sim.status_led = on;
}

void fw_board_watchdog_start(void) {}

void fw_board_watchdog_feed(void)
{
    sim.fed++;
}

void fw_board_sleep(void) {}
