#include "firmware/sim/sim_board.h"

#include "firmware/fw_board.h"
#include "firmware/fw_config.h"
#include "firmware/fw_light.h"
#include "firmware/fw_link.h"
#include "firmware/fw_safety.h"

#include <assert.h>

sim_board sim;

void sim_board_start(void)
{
    sim = (sim_board){0};
    fw_link_init();
    fw_safety_init();
    fw_light_init();
    fw_board_init();
}

void sim_board_turn(void)
{
    fw_link_poll();
    fw_light_poll();
    fw_safety_poll();
    fw_board_watchdog_feed();
    assert(sim.locked == 0);
}

void sim_board_pass_ms(int ms)
{
    for (int i = 0; i < ms; i++) {
        sim.tick += FW_TICKS_A_MS;
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
