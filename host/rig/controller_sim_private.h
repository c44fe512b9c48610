/**
 * The inside of controller_sim.h: the board's light, its processor and serial line, its pace.  Private to
 * controller_sim*.c; all functions are called with the mutex held.
 */
#ifndef WEFT_HOST_RIG_CONTROLLER_SIM_PRIVATE_H
#define WEFT_HOST_RIG_CONTROLLER_SIM_PRIVATE_H

#include "host/rig/controller_sim.h"

#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>

#include <pthread.h>

#define WEFT_SIM_CLOCK_HZ    16000000u
#define WEFT_SIM_CYCLES_A_US 16u

enum {
    FULL_DUTY = 256,
    QUEUE_BYTES = 1 << 16,
    WEFT_SIM_FRAME_BYTES = 64, /* longer than any frame */
};

/* One direction of the serial line: bytes on their way and what happens to them.  Write at head, read at
 * tail, both count on for ever; none is ready before the one ahead of it. */
typedef struct weft_sim_line {
    size_t head, tail;
    struct weft_sim_byte {
        avr_cycle_count_t ready;
        uint8_t value;
    } bytes[QUEUE_BYTES];
    weft_sim_line_faults faults;
    uint64_t random;
    avr_cycle_count_t stalled_until;
    uint8_t frame[WEFT_SIM_FRAME_BYTES]; /* since the last zero byte */
    size_t n_frame;
} weft_sim_line;

/* A lamp and what is wrong with it. */
typedef struct weft_sim_lamp_fault {
    weft_sim_lamp_state state;
    int other;                      /* of WEFT_SIM_LAMP_AS */
    avr_cycle_count_t late;         /* light comes so long after current */
    avr_cycle_count_t driven_since; /* while it is driven */
    weft_controller_sim *sim;
} weft_sim_lamp_fault;

/* An exposure under way. */
typedef struct weft_sim_exposure {
    struct weft_sim_exposure *next;
    avr_cycle_count_t begin, end;
    uint64_t on_parts[WEFT_SIM_N_LIGHTS]; /* at `begin`, then from `begin` to `end` */
    weft_controller_sim *sim;
    bool done;
} weft_sim_exposure;

struct weft_controller_sim {
    avr_t *avr;
    avr_uart_t *uart;
    avr_irq_t *uart_input;
    void (*core_reset)(avr_t *avr);
    bool was_reset, crashed;
    bool has_bootloader;
    bool lost; /* in nonsense until the next reset: its program is broken off */
    bool has_worn_cell;
    uint32_t worn_cell;

    /* light */
    uint32_t driven; /* the board has them on at this cycle */
    uint32_t lights; /* give light at this cycle: the same but for broken lamps */
    unsigned duty;   /* in FULL_DUTY parts: how much of the time the dimming lets them be */
    weft_sim_lamp_fault lamps[WEFT_SIM_N_LIGHTS];
    avr_cycle_count_t since;              /* `lights` and `duty` hold since then */
    avr_cycle_count_t dark_since;         /* `lights` is 0 since then */
    uint64_t on_parts[WEFT_SIM_N_LIGHTS]; /* cycles x duty, up to `since` */
    int most_lights;
    weft_sim_exposure *exposures;

    bool trigger_high;
    void (*on_trigger)(void *context);
    void *trigger_context;

    void (*on_change)(void *context, uint64_t cycle, uint32_t lights, bool trigger);
    void *change_context;
    uint32_t camera_delay_us, camera_exposure_us; /* 0: no camera */
    bool exposing;
    bool exposure_wired; /* the line follows weft_controller_sim_expose() */

    uint32_t ram_free; /* first address behind the variables; 0: unknown */
    bool watch_lock;
    avr_cycle_count_t locked_since, longest_lock; /* 0: interrupts are on */

    weft_sim_line in, out;        /* to the board, from it */
    avr_cycle_count_t sent_until; /* the board's transmitter is busy until then */
    bool feeding;
    unsigned resets, opened, overruns;
    bool storing; /* the EEPROM is, until the cycle `stored_at` */
    avr_cycle_count_t stored_at;

    /* paced use */
    bool paced, stop;
    pthread_mutex_t mutex; /* over all of this but `thread`, `wake` */
    pthread_cond_t passed; /* an exposure has ended, or the simulator */
    pthread_t thread;
    int master;    /* of the pty; -1: none, or unplugged */
    int name_kept; /* while unplugged: the old pty, so that the new one gets another name; -1: none */
    int wake;
    bool is_open;
};

/* -- serial line (controller_sim_line.c) */

/** A byte goes on the line at the cycle `now`, and suffers its faults; lost when 64 KiB wait already. */
void weft_sim_line_put(weft_sim_line *line, uint8_t byte, avr_cycle_count_t now);
/** False when none is there yet. */
bool weft_sim_line_take(weft_sim_line *line, uint8_t *byte, avr_cycle_count_t now);
/** Forgets what is on its way. */
void weft_sim_line_clear(weft_sim_line *line);
/** Connects the UART. */
void weft_sim_watch_uart(weft_controller_sim *sim);
/** Hands the bytes of sim->in to the board, one per character time. */
void weft_sim_start_feeding(weft_controller_sim *sim);
/** The rate that the firmware has set, bits/s. */
double weft_sim_baud(const weft_controller_sim *sim);

/* -- where the simulator is not like the chip (controller_sim_chip.c) */

void weft_sim_watch_chip(weft_controller_sim *sim);
/** The processor was reset: what the simulator forgets then and the chip does not. */
void weft_sim_mend_chip(weft_controller_sim *sim);
/** RAM is lost, and the byte that the EEPROM was storing; a reset must follow. */
void weft_sim_lose_power(weft_controller_sim *sim);

/* -- light (controller_sim_light.c) */

/** Has the pins read at every write to their registers. */
void weft_sim_watch_pins(weft_controller_sim *sim);
/** Reads them now. */
void weft_sim_look_at_pins(weft_controller_sim *sim);
/** The exposure line of the camera. */
void weft_sim_set_exposure_line(weft_controller_sim *sim, bool high);
/** An exposure of `exposure_us` from now on, until it is done and forgotten. */
void weft_sim_begin_exposure(weft_controller_sim *sim, weft_sim_exposure *e, uint32_t exposure_us);
void weft_sim_forget_exposure(weft_controller_sim *sim, weft_sim_exposure *e);
/** Sets the timers of all exposures again, which a reset has cleared. */
void weft_sim_resume_exposures(weft_controller_sim *sim);

/* -- processor and serial line (controller_sim_board.c) */

void weft_sim_press_reset(weft_controller_sim *sim);
void weft_sim_power_cycle(weft_controller_sim *sim);
/** Runs to the cycle `until` and not beyond. */
void weft_sim_run_until(weft_controller_sim *sim, avr_cycle_count_t until);

/** Makes the board with this in its flash memory; stepped, without mutex. */
weft_err weft_sim_make(const weft_controller_sim_program *program, weft_controller_sim **sim,
                       weft_error *err);

/* -- flash memory (controller_sim_program.c) */

weft_err weft_sim_load(weft_controller_sim *sim, const weft_controller_sim_program *program, weft_error *err);

/* -- pace (controller_sim_pace.c) */

/** Ends the thread and closes the pty, where there are any.  Without the mutex. */
void weft_sim_stop_pace(weft_controller_sim *sim);

#endif
