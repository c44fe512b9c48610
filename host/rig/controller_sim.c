#include "host/rig/controller_sim_private.h"

#include <assert.h>
#include <string.h>

bool weft_controller_sim_expose(weft_controller_sim *sim, uint32_t exposure_us,
                                double on_fraction[WEFT_SIM_N_LIGHTS])
{
    weft_sim_exposure e;
    pthread_mutex_lock(&sim->mutex);
    weft_sim_begin_exposure(sim, &e, exposure_us);
    if (sim->paced)
        while (!e.done && !sim->stop && !sim->crashed)
            pthread_cond_wait(&sim->passed, &sim->mutex);
    else
        while (!e.done && !sim->crashed)
            weft_sim_run_until(sim, (e.end > sim->avr->cycle ? e.end : sim->avr->cycle) + 1);
    weft_sim_forget_exposure(sim, &e);
    pthread_mutex_unlock(&sim->mutex);
    for (int i = 0; i < WEFT_SIM_N_LIGHTS && e.done; i++)
        on_fraction[i] = (double)e.on_parts[i] / (double)((e.end - e.begin) * FULL_DUTY);
    return e.done;
}

uint32_t weft_controller_sim_lights(weft_controller_sim *sim, double *dark_for_s)
{
    pthread_mutex_lock(&sim->mutex);
    const uint32_t lights = sim->lights;
    if (dark_for_s)
        *dark_for_s = lights ? 0 : (double)(sim->avr->cycle - sim->dark_since) / WEFT_SIM_CLOCK_HZ;
    pthread_mutex_unlock(&sim->mutex);
    return lights;
}

void weft_controller_sim_reset(weft_controller_sim *sim)
{
    pthread_mutex_lock(&sim->mutex);
    weft_sim_press_reset(sim);
    pthread_mutex_unlock(&sim->mutex);
}

void weft_controller_sim_hang(weft_controller_sim *sim)
{
    pthread_mutex_lock(&sim->mutex);
    for (int i = 0; i < 1000 && !sim->avr->sreg[S_I]; i++) /* an interrupt ends first */
        avr_run(sim->avr);
    const avr_flashaddr_t far = sim->avr->flashend - 0xff; /* a free place: rjmp to itself */
    sim->avr->flash[far] = 0xff;
    sim->avr->flash[far + 1] = 0xcf;
    sim->avr->pc = far;
    sim->avr->state = cpu_Running;
    pthread_mutex_unlock(&sim->mutex);
}

void weft_controller_sim_set_trigger(weft_controller_sim *sim, void (*on_trigger)(void *context),
                                     void *context)
{
    pthread_mutex_lock(&sim->mutex);
    sim->on_trigger = on_trigger;
    sim->trigger_context = context;
    pthread_mutex_unlock(&sim->mutex);
}

void weft_controller_sim_set_watch(weft_controller_sim *sim,
                                   void (*on_change)(void *context, uint64_t cycle, uint32_t lights,
                                                     bool trigger),
                                   void *context)
{
    pthread_mutex_lock(&sim->mutex);
    sim->on_change = on_change;
    sim->change_context = context;
    pthread_mutex_unlock(&sim->mutex);
}

void weft_controller_sim_set_camera(weft_controller_sim *sim, uint32_t delay_us, uint32_t exposure_us)
{
    pthread_mutex_lock(&sim->mutex);
    sim->camera_delay_us = delay_us;
    sim->camera_exposure_us = exposure_us;
    pthread_mutex_unlock(&sim->mutex);
}

void weft_controller_sim_wire_exposure(weft_controller_sim *sim)
{
    pthread_mutex_lock(&sim->mutex);
    sim->exposure_wired = true;
    pthread_mutex_unlock(&sim->mutex);
}

void weft_controller_sim_set_exposure_line(weft_controller_sim *sim, bool high)
{
    pthread_mutex_lock(&sim->mutex);
    weft_sim_set_exposure_line(sim, high);
    pthread_mutex_unlock(&sim->mutex);
}

void weft_sim_power_cycle(weft_controller_sim *sim)
{
    weft_sim_lose_power(sim);
    weft_sim_press_reset(sim);
    avr_regbit_clear(sim->avr, sim->avr->reset_flags.extrf);
    avr_regbit_set(sim->avr, sim->avr->reset_flags.porf);
}

void weft_controller_sim_power_cycle(weft_controller_sim *sim)
{
    pthread_mutex_lock(&sim->mutex);
    weft_sim_power_cycle(sim);
    pthread_mutex_unlock(&sim->mutex);
}

/* -- measuring the program ------------------------------------------------------------------------------ */

enum { PAINT = 0xc5 };

bool weft_controller_sim_paint_stack(weft_controller_sim *sim)
{
    pthread_mutex_lock(&sim->mutex);
    const uint32_t top = (uint32_t)sim->avr->data[R_SPH] << 8 | sim->avr->data[R_SPL];
    const bool known = sim->ram_free != 0 && sim->ram_free < top;
    if (known)
        memset(sim->avr->data + sim->ram_free, PAINT, top - sim->ram_free);
    pthread_mutex_unlock(&sim->mutex);
    return known;
}

void weft_controller_sim_measure_stack(weft_controller_sim *sim, int *used, int *untouched)
{
    pthread_mutex_lock(&sim->mutex);
    uint32_t deepest = sim->ram_free;
    while (deepest < sim->avr->ramend && sim->avr->data[deepest] == PAINT)
        deepest++;
    *used = (int)(sim->avr->ramend + 1 - deepest);
    *untouched = (int)(deepest - sim->ram_free);
    pthread_mutex_unlock(&sim->mutex);
}

unsigned weft_controller_sim_longest_lock(weft_controller_sim *sim)
{
    pthread_mutex_lock(&sim->mutex);
    const unsigned longest = (unsigned)sim->longest_lock;
    sim->watch_lock = true;
    sim->longest_lock = 0;
    sim->locked_since = 0;
    pthread_mutex_unlock(&sim->mutex);
    return longest;
}

double weft_controller_sim_time_s(weft_controller_sim *sim)
{
    pthread_mutex_lock(&sim->mutex);
    const double now_s = (double)sim->avr->cycle / WEFT_SIM_CLOCK_HZ;
    pthread_mutex_unlock(&sim->mutex);
    return now_s;
}

void weft_controller_sim_get_counters(weft_controller_sim *sim, weft_controller_sim_counters *counters)
{
    pthread_mutex_lock(&sim->mutex);
    *counters = (weft_controller_sim_counters){
        .resets = sim->resets,
        .opened = sim->opened,
        .overruns = sim->overruns,
        .most_lights = sim->most_lights,
        .bits_per_s = weft_sim_baud(sim),
        .simulated_s = (double)sim->avr->cycle / WEFT_SIM_CLOCK_HZ,
        .running = !sim->crashed,
    };
    pthread_mutex_unlock(&sim->mutex);
}

/* -- stepped use ---------------------------------------------------------------------------------------- */

bool weft_controller_sim_run(weft_controller_sim *sim, double microseconds)
{
    assert(!sim->paced);
    pthread_mutex_lock(&sim->mutex);
    weft_sim_run_until(sim, sim->avr->cycle + (avr_cycle_count_t)(microseconds * WEFT_SIM_CYCLES_A_US));
    const bool running = !sim->crashed;
    pthread_mutex_unlock(&sim->mutex);
    return running;
}

void weft_controller_sim_send(weft_controller_sim *sim, const uint8_t *bytes, size_t n)
{
    assert(!sim->paced);
    pthread_mutex_lock(&sim->mutex);
    for (size_t i = 0; i < n; i++)
        weft_sim_line_put(&sim->in, bytes[i], sim->avr->cycle);
    weft_sim_start_feeding(sim);
    pthread_mutex_unlock(&sim->mutex);
}

size_t weft_controller_sim_receive(weft_controller_sim *sim, uint8_t *bytes, size_t room)
{
    size_t n = 0;
    pthread_mutex_lock(&sim->mutex);
    while (n < room && weft_sim_line_take(&sim->out, &bytes[n], sim->avr->cycle))
        n++;
    pthread_mutex_unlock(&sim->mutex);
    return n;
}
