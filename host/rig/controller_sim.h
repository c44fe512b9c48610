/**
 * The light controller of the virtual scanner: the firmware ELF on libsimavr, its UART on a pty, its pins
 * read as light.  Everything is measured in simulated time (cycles of the 16 MHz clock).
 */
#ifndef WEFT_HOST_RIG_CONTROLLER_SIM_H
#define WEFT_HOST_RIG_CONTROLLER_SIM_H

#include "core/error.h"

#include <stdbool.h>
#include <stdint.h>

#define WEFT_SIM_N_LIGHTS 10

typedef struct weft_controller_sim weft_controller_sim;

/** Loads the ELF, opens the pty and starts the simulator's thread, paced to the wall clock.
 *  @param pty_path  gets the path that a host opens; room for 128 bytes */
weft_err weft_controller_sim_create(const char *elf_path, weft_controller_sim **sim, char *pty_path,
                                    weft_error *err);
void weft_controller_sim_destroy(weft_controller_sim *sim);

/**
 * Watches the lights over an exposure that begins now, in simulated time, and waits for its end.
 *
 * @param exposure_us    1..10 000 000
 * @param on_fraction    per light: the share of the exposure during which it was on, times its dimming
 * @return false when the simulator has stopped
 */
bool weft_controller_sim_expose(weft_controller_sim *sim, uint32_t exposure_us,
                                double on_fraction[WEFT_SIM_N_LIGHTS]);

/** Which lights are on now, and since when all have been dark (seconds of simulated time; 0 when lit). */
uint32_t weft_controller_sim_lights(weft_controller_sim *sim, double *dark_for_s);

/** Resets the board as its button does. */
void weft_controller_sim_reset(weft_controller_sim *sim);

/** Called from the simulator's thread at each rising edge of the camera trigger pin. */
void weft_controller_sim_set_trigger(weft_controller_sim *sim, void (*on_trigger)(void *context),
                                     void *context);

#endif
