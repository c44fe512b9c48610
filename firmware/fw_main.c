/* The program of the light controller: set up, then serve for ever. */
#include "firmware/fw_board.h"
#include "firmware/fw_light.h"
#include "firmware/fw_link.h"
#include "firmware/fw_safety.h"
#include "firmware/fw_sequence.h"
#include "firmware/fw_settings.h"

int main(void)
{
    fw_link_init(); /* before interrupts may bring bytes */
    fw_safety_init();
    fw_light_init();
    fw_sequence_init();
    fw_settings_init();
    fw_board_init();
    fw_board_watchdog_start();
    for (;;) {
        fw_link_poll();
        fw_light_poll();
        fw_sequence_poll();
        fw_safety_poll();
        fw_board_watchdog_feed(); /* only here: whatever hangs above ends in a reset, and that is dark */
        fw_board_sleep();
    }
}
