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
    RECEIVER_PLACES = 3, /* two in the chip's buffer, one in its shift register */
    QUEUE_BYTES = 1 << 16,
};

/* Bytes on their way; write at head, read at tail, both count on for ever. */
typedef struct weft_sim_queue {
    size_t head, tail;
    uint8_t bytes[QUEUE_BYTES];
} weft_sim_queue;

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
    uint32_t lights;              /* on at this cycle */
    unsigned duty;                /* in FULL_DUTY parts: how much of the time the dimming lets them be */
    avr_cycle_count_t since;      /* `lights` and `duty` hold since then */
    avr_cycle_count_t dark_since; /* `lights` is 0 since then */
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

    uint32_t ram_free; /* first address behind the variables; 0: unknown */
    bool watch_lock;
    avr_cycle_count_t locked_since, longest_lock; /* 0: interrupts are on */

    weft_sim_queue in, out;
    bool feeding;
    unsigned resets, opened, overruns;

    /* paced use */
    bool paced, stop;
    pthread_mutex_t mutex; /* over all of this but `thread`, `master`, `wake` */
    pthread_cond_t passed; /* an exposure has ended, or the simulator */
    pthread_t thread;
    int master, wake;
    bool is_open;
};

/** False when it is full. */
bool weft_sim_queue_put(weft_sim_queue *q, uint8_t byte);
/** False when it is empty. */
bool weft_sim_queue_take(weft_sim_queue *q, uint8_t *byte);

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

/** Hands the bytes of sim->in to the board, one per character time. */
void weft_sim_start_feeding(weft_controller_sim *sim);
void weft_sim_press_reset(weft_controller_sim *sim);
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
