/* The processor of the simulated board and its serial line, and where libsimavr is not like the chip. */
#include "core/log.h"
#include "core/mem.h"
#include "host/rig/controller_sim_private.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* -- processor ------------------------------------------------------------------------------------------ */

static weft_controller_sim *sim_of(avr_t *avr)
{
    return avr->custom.data;
}

static void on_reset(avr_t *avr)
{
    weft_controller_sim *const sim = sim_of(avr);
    sim->core_reset(avr);
    sim->was_reset = true;
}

/* A reset clears the simulator's timers and settings, and the ports change without a notice. */
static void mend_after_reset(weft_controller_sim *sim)
{
    sim->was_reset = sim->lost = false;
    sim->resets++;
    weft_sim_look_at_pins(sim);
    if (sim->exposing)
        weft_sim_set_exposure_line(sim, false); /* its timer is gone */
    weft_sim_mend_chip(sim);
    sim->feeding = false;
    weft_sim_start_feeding(sim);
    weft_sim_resume_exposures(sim);
}

void weft_sim_press_reset(weft_controller_sim *sim)
{
    avr_reset(sim->avr);
    avr_regbit_set(sim->avr, sim->avr->reset_flags.extrf);
    mend_after_reset(sim);
}

static void no_sleep(avr_t *avr, avr_cycle_count_t cycles)
{
    (void)avr;
    (void)cycles;
}

static avr_cycle_count_t no_action(avr_t *avr, avr_cycle_count_t when, void *context)
{
    (void)avr;
    (void)when;
    (void)context;
    return 0;
}

/* Interrupts are off from the instruction that clears I to the one that sets it, or to the end of an
 * interrupt's function. */
static void watch_lock(weft_controller_sim *sim)
{
    const avr_t *const avr = sim->avr;
    if (avr->sreg[S_I]) {
        sim->locked_since = 0;
    } else if (sim->locked_since == 0) {
        sim->locked_since = avr->cycle;
    } else if (avr->cycle - sim->locked_since > sim->longest_lock) {
        sim->longest_lock = avr->cycle - sim->locked_since;
    }
}

/* A program that is broken off or missing runs into nonsense.  On the chip it stays there until a reset calls
 * the bootloader, and so it does here; without a bootloader there is no way back. */
static void lose_way(weft_controller_sim *sim)
{
    sim->lost = sim->has_bootloader;
    sim->crashed = !sim->lost;
}

/* The chip's 10 000 erasures are over: a bit of it no longer takes a 1. */
static void keep_worn_cell(const weft_controller_sim *sim)
{
    if (sim->has_worn_cell)
        sim->avr->flash[sim->worn_cell] &= 0xfe;
}

/* Runs to `until` and not beyond: a timer there ends a sleep. */
void weft_sim_run_until(weft_controller_sim *sim, avr_cycle_count_t until)
{
    avr_t *const avr = sim->avr;
    bool armed = false;
    while (avr->cycle < until && !sim->crashed) {
        if (sim->lost) {
            avr->cycle = until;
            break;
        }
        if (!armed)
            avr_cycle_timer_register(avr, until - avr->cycle, no_action, sim);
        armed = true;
        if (sim->watch_lock)
            avr->run_cycle_count = 1; /* one instruction at a time */
        const int state = avr_run(avr);
        if (sim->watch_lock)
            watch_lock(sim);
        if (state == cpu_Done || state == cpu_Crashed)
            lose_way(sim);
        keep_worn_cell(sim);
        if (sim->was_reset) {
            mend_after_reset(sim);
            armed = false;
        }
    }
    avr_cycle_timer_cancel(avr, no_action, sim);
    if (sim->crashed)
        pthread_cond_broadcast(&sim->passed);
}

static void log_line(avr_t *avr, const int level, const char *format, va_list args)
{
    char text[256];
    (void)avr;
    if (level > LOG_ERROR)
        return;
    vsnprintf(text, sizeof text, format, args);
    text[strcspn(text, "\n")] = 0;
    weft_explain("simavr: %s", text);
}

/* -- starting ------------------------------------------------------------------------------------------- */

static void connect_board(weft_controller_sim *sim)
{
    avr_t *const avr = sim->avr;
    avr->sleep = no_sleep;
    avr->custom.data = sim;
    sim->core_reset = avr->reset;
    avr->reset = on_reset;
    weft_sim_watch_uart(sim);
    weft_sim_watch_pins(sim);
    weft_sim_watch_chip(sim);
    avr_reset(avr);
    mend_after_reset(sim);
    avr_regbit_set(avr, avr->reset_flags.porf);
    sim->resets = 0;
}

weft_err weft_sim_make(const weft_controller_sim_program *program, weft_controller_sim **out, weft_error *err)
{
    avr_global_logger_set(log_line);
    weft_controller_sim *const sim = weft_alloc(1, sizeof *sim, err);
    if (!sim)
        return WEFT_ERR_NOMEM;
    sim->master = sim->name_kept = sim->wake = -1;
    pthread_mutex_init(&sim->mutex, NULL);
    pthread_cond_init(&sim->passed, NULL);
    weft_err status = WEFT_OK;
    sim->avr = avr_make_mcu_by_name("atmega328p");
    if (!sim->avr)
        status = weft_fail(err, WEFT_ERR_UNSUPPORTED, "this libsimavr has no ATmega328P");
    if (status == WEFT_OK) {
        avr_init(sim->avr);
        sim->avr->log = LOG_ERROR;
        sim->avr->frequency = WEFT_SIM_CLOCK_HZ;
        status = weft_sim_load(sim, program, err);
    }
    if (status == WEFT_OK) {
        connect_board(sim);
        *out = sim;
    } else {
        weft_controller_sim_destroy(sim);
    }
    return status;
}

weft_err weft_controller_sim_create_stepped(const char *elf_path, weft_controller_sim **sim, weft_error *err)
{
    return weft_sim_make(&(weft_controller_sim_program){.firmware = elf_path}, sim, err);
}

void weft_controller_sim_destroy(weft_controller_sim *sim)
{
    if (!sim)
        return;
    weft_sim_stop_pace(sim);
    if (sim->avr) {
        avr_terminate(sim->avr);
        free(sim->avr);
    }
    pthread_cond_destroy(&sim->passed);
    pthread_mutex_destroy(&sim->mutex);
    weft_free(sim);
}
