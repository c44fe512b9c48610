/**
 * The light controller of the virtual scanner: the firmware ELF on libsimavr, its UART on a pty, its pins
 * read as light.  Everything is measured in simulated time (cycles of the 16 MHz clock).
 *
 * It runs in one of two ways:
 * - paced: an own thread keeps simulated time in step with the wall clock, and a host talks over a pty.
 *   Opening the pty resets the board, as DTR resets an Uno (without the wait for its bootloader, unless
 *   it is given one);
 * - stepped: no thread, no pty; time passes only in weft_controller_sim_run(), thousands of times faster
 *   than a clock when the board sleeps, and the same way every time.  For tests.
 *
 * Where libsimavr differs from the chip, this makes up for it: a byte takes ten bit times each way, at the
 * rate that the registers say in whatever order they were written; it is lost when the receiver's three
 * places are taken; host and board at different rates hear garbage; pins are driven or dark, also right after
 * a reset; a byte of the EEPROM takes 3.4 ms; an interrupt that came while it was masked is not forgotten.
 *
 * All functions may be called from any thread, except that a stepped one is for one thread, and that
 * nothing may be called from inside the trigger callback.
 */
#ifndef WEFT_HOST_RIG_CONTROLLER_SIM_H
#define WEFT_HOST_RIG_CONTROLLER_SIM_H

#include "core/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define WEFT_SIM_N_LIGHTS 10

typedef struct weft_controller_sim weft_controller_sim;

/** Loads the ELF, opens the pty and starts the simulator's thread, paced to the wall clock.
 *  @param pty_path  gets the path that a host opens; room for 128 bytes */
weft_err weft_controller_sim_create(const char *elf_path, weft_controller_sim **sim, char *pty_path,
                                    weft_error *err);

/** What is in the flash memory when power comes on. */
typedef struct weft_controller_sim_program {
    const char *firmware;   /* .elf or .hex; NULL: none */
    const char *bootloader; /* .hex; NULL: none, a reset starts the firmware */
} weft_controller_sim_program;

/** As weft_controller_sim_create().  With a bootloader a reset starts that, as on an Arduino, and avrdude
 *  programs the board over the pty; a program that runs into nonsense then waits there for the next reset. */
weft_err weft_controller_sim_create_with(const weft_controller_sim_program *program,
                                         weft_controller_sim **sim, char *pty_path, weft_error *err);

/** Loads the ELF for stepped use; the board has just got its power. */
weft_err weft_controller_sim_create_stepped(const char *elf_path, weft_controller_sim **sim, weft_error *err);

void weft_controller_sim_destroy(weft_controller_sim *sim);

/**
 * Watches the lights over an exposure that begins now, in simulated time, and waits for its end (stepped:
 * lets that time pass).
 *
 * @param exposure_us    1..10 000 000
 * @param on_fraction    per light: the share of the exposure during which it was on, times its dimming
 * @return false when the simulator has stopped
 */
bool weft_controller_sim_expose(weft_controller_sim *sim, uint32_t exposure_us,
                                double on_fraction[WEFT_SIM_N_LIGHTS]);

/** Which lamps give light now, and since when all have been dark (seconds of simulated time; 0 when lit).
 *  A dimmed light counts as on all the time.  dark_for_s may be NULL. */
uint32_t weft_controller_sim_lights(weft_controller_sim *sim, double *dark_for_s);

/** Resets the board as its button does. */
void weft_controller_sim_reset(weft_controller_sim *sim);

/** Sends the program into an endless loop, as a mistake in it would; interrupts go on. */
void weft_controller_sim_hang(weft_controller_sim *sim);

/* -- faults --------------------------------------------------------------------------------------------- */

typedef enum weft_sim_direction { WEFT_SIM_TO_BOARD, WEFT_SIM_FROM_BOARD } weft_sim_direction;

/** What a bad cable does: chances per byte, or per frame (which ends with a zero byte).  All 0: a good one.
 */
typedef struct weft_sim_line_faults {
    double drop, flip, repeat; /* a byte is lost, has a bit wrong, comes twice */
    double repeat_frame;       /* a whole frame comes twice */
    double stall;              /* nothing comes for stall_ms, and then all of it */
    int stall_ms;
    uint64_t seed; /* the same seed gives the same faults */
} weft_sim_line_faults;

/** From now on; NULL: a good cable. */
void weft_controller_sim_set_line_faults(weft_controller_sim *sim, weft_sim_direction direction,
                                         const weft_sim_line_faults *faults);

/** A lamp that is not as the board wants it: its transistor conducts always, or never; its LED is open, so
 *  that it draws no current; its driver takes its time to light it; or its wire goes to another lamp. */
typedef enum weft_sim_lamp_state {
    WEFT_SIM_LAMP_GOOD,
    WEFT_SIM_LAMP_ON,
    WEFT_SIM_LAMP_OFF,
    WEFT_SIM_LAMP_OPEN,
    WEFT_SIM_LAMP_LATE,
    WEFT_SIM_LAMP_AS,
} weft_sim_lamp_state;

/** @param lamp    0 .. WEFT_SIM_N_LIGHTS - 1
 *  @param number  of WEFT_SIM_LAMP_LATE: microseconds; of WEFT_SIM_LAMP_AS: the lamp that shines in its stead
 */
void weft_controller_sim_set_lamp(weft_controller_sim *sim, int lamp, weft_sim_lamp_state state,
                                  uint32_t number);

/** Lamps that the board has on: those of weft_controller_sim_lights() and the ones that are broken. */
uint32_t weft_controller_sim_driven(weft_controller_sim *sim);

/** The serial line is pulled out: the pty hangs up and its name is gone.  The board keeps its power, unless
 *  `power` says that it came with the cable. */
void weft_controller_sim_unplug(weft_controller_sim *sim, bool power);
/** It is plugged in again: a pty under another name, the same board with the same EEPROM.  Unplugs it first
 *  where that was not done.  @param pty_path  gets the name; room for 128 bytes */
weft_err weft_controller_sim_plug_in(weft_controller_sim *sim, char *pty_path, weft_error *err);

/** What a UART at read_rate makes of bytes that were sent at sent_rate, back to back.
 *  @return bytes heard, at most `room` */
size_t weft_controller_sim_garble(const uint8_t *sent, size_t n, double sent_rate, double read_rate,
                                  uint8_t *heard, size_t room);

/* -- around the board ----------------------------------------------------------------------------------- */

/** Called from the simulator's thread at each rising edge of the camera trigger pin. */
void weft_controller_sim_set_trigger(weft_controller_sim *sim, void (*on_trigger)(void *context),
                                     void *context);

/** Called from the simulator's thread whenever lights or trigger change, with the cycle of the 16 MHz clock.
 */
void weft_controller_sim_set_watch(weft_controller_sim *sim,
                                   void (*on_change)(void *context, uint64_t cycle, uint32_t lights,
                                                     bool trigger),
                                   void *context);

/** A camera on trigger and exposure line: `delay_us` after each rise of the trigger the line rises, for
 *  exposure_us; 0: no camera, the line stays low. */
void weft_controller_sim_set_camera(weft_controller_sim *sim, uint32_t delay_us, uint32_t exposure_us);

/** From now on the exposure line is high during every weft_controller_sim_expose(). */
void weft_controller_sim_wire_exposure(weft_controller_sim *sim);

/** The exposure line by hand. */
void weft_controller_sim_set_exposure_line(weft_controller_sim *sim, bool high);

/** The EEPROM, 1024 bytes: a copy of it, or other contents. */
void weft_controller_sim_read_eeprom(weft_controller_sim *sim, uint8_t bytes[1024]);
void weft_controller_sim_write_eeprom(weft_controller_sim *sim, const uint8_t bytes[1024]);

/** Power goes and comes back: RAM is lost, the EEPROM stays but for a byte that was being stored.  (A reset
 *  keeps both.) */
void weft_controller_sim_power_cycle(weft_controller_sim *sim);

/** From now on bit 0 of the flash memory's byte `address` is 0, whatever is written there. */
void weft_controller_sim_wear_out(weft_controller_sim *sim, uint32_t address);

/** Fills the free RAM between variables and stack with a pattern; then, later: the deepest that the stack
 *  has been since, in bytes from the end of RAM, and the bytes that were never touched.
 *  @return false for an ELF without the symbol _end */
bool weft_controller_sim_paint_stack(weft_controller_sim *sim);
void weft_controller_sim_measure_stack(weft_controller_sim *sim, int *used, int *untouched);

/** From now on every instruction is looked at (100 times slower): gives the longest time that interrupts
 *  have been off since the last call, in cycles. */
unsigned weft_controller_sim_longest_lock(weft_controller_sim *sim);

/** Simulated seconds since power came on. */
double weft_controller_sim_time_s(weft_controller_sim *sim);

typedef struct weft_controller_sim_counters {
    unsigned resets;    /* by button, opened port and watchdog */
    unsigned opened;    /* times that a host opened the pty */
    unsigned overruns;  /* received bytes that the firmware was too slow for */
    int most_lights;    /* the most lights that ever shone at the same moment */
    double bits_per_s;  /* as the firmware has set it */
    double simulated_s; /* since power came on */
    bool running;       /* false when the program has crashed the simulator */
} weft_controller_sim_counters;

void weft_controller_sim_get_counters(weft_controller_sim *sim, weft_controller_sim_counters *counters);

/* -- stepped use ---------------------------------------------------------------------------------------- */

/** Lets simulated time pass.  @return false when the simulator has stopped */
bool weft_controller_sim_run(weft_controller_sim *sim, double microseconds);

/** Queues bytes for the board, which get there one per character time; at most 64 KiB wait. */
void weft_controller_sim_send(weft_controller_sim *sim, const uint8_t *bytes, size_t n);

/** Takes what the board has sent.  @return number of bytes, at most `room` */
size_t weft_controller_sim_receive(weft_controller_sim *sim, uint8_t *bytes, size_t room);

#endif
