/* What the pins of the simulated board give as light, and what an exposure sees of it. */
#include "host/rig/controller_sim_private.h"

#include <simavr/avr_ioport.h>

#include <string.h>

/* Data addresses of the ATmega328P's registers (DS40002061B, section 30). */
enum {
    R_DDRB = 0x24,
    R_PORTB = 0x25,
    R_DDRC = 0x27,
    R_PORTC = 0x28,
    R_DDRD = 0x2a,
    R_PORTD = 0x2b,
    R_TCCR1A = 0x80,
    R_TCCR1B = 0x81,
    R_OCR1AL = 0x88,
    COM1A = 0xc0,       /* of TCCR1A: not 0 when PB1 belongs to the timer */
    FAST_PWM_1A = 0x81, /* of TCCR1A: high from 0 to OCR1A, fast PWM of 8 bits */
    FAST_PWM_1B = 0x08, /* of TCCR1B: the same */
    WAVEFORM_1B = 0x18,
    CLOCK_1B = 0x07,
};

/* How the virtual scanner is wired; docs/hardware.md says it for the real one. */
enum {
    LIGHTS_D_SHIFT = 2, /* lights 0..5 on PD2..PD7 */
    N_LIGHTS_D = 6,
    LIGHTS_C_MASK = 0x0f, /* lights 6..9 on PC0..PC3 */
    DIMMING_B = 1 << 1,
    TRIGGER_B = 1 << 2,
};

static void count_light_until(weft_controller_sim *sim, avr_cycle_count_t cycle)
{
    if (cycle <= sim->since)
        return;
    for (int i = 0; i < WEFT_SIM_N_LIGHTS; i++)
        if (sim->lights >> i & 1)
            sim->on_parts[i] +=
                (cycle - sim->since) * (sim->lamps[i].state == WEFT_SIM_LAMP_ON ? FULL_DUTY : sim->duty);
    sim->since = cycle;
}

/* How much of the time the dimming line is high, from the registers of TIMER1: its compare events come a
 * few cycles late in the simulator, which would lose the shortest pulses.  A waveform that this does not
 * know lets no light through, and a test fails. */
static unsigned dimming_duty(const uint8_t *r)
{
    if (!(r[R_DDRB] & DIMMING_B))
        return 0;
    if (!(r[R_TCCR1A] & COM1A))
        return r[R_PORTB] & DIMMING_B ? FULL_DUTY : 0;
    if (r[R_TCCR1A] != FAST_PWM_1A || (r[R_TCCR1B] & WAVEFORM_1B) != FAST_PWM_1B || !(r[R_TCCR1B] & CLOCK_1B))
        return 0;
    return r[R_OCR1AL] + 1u;
}

/* -- broken lamps --------------------------------------------------------------------------------------- */

static avr_cycle_count_t light_up(avr_t *avr, avr_cycle_count_t when, void *context)
{
    const weft_sim_lamp_fault *const lamp = context;
    (void)avr;
    (void)when;
    weft_sim_look_at_pins(lamp->sim);
    return 0;
}

static bool gives_light(const weft_controller_sim *sim, int i)
{
    const weft_sim_lamp_fault *const lamp = &sim->lamps[i];
    const bool driven = sim->driven >> i & 1;
    switch (lamp->state) {
    case WEFT_SIM_LAMP_ON:
        return true;
    case WEFT_SIM_LAMP_OFF:
    case WEFT_SIM_LAMP_OPEN:
        return false;
    case WEFT_SIM_LAMP_LATE:
        return driven && sim->avr->cycle >= lamp->driven_since + lamp->late;
    default:
        return driven;
    }
}

/* What the lamps make of what the pins want. */
static uint32_t drive_lamps(weft_controller_sim *sim, uint32_t wanted)
{
    const uint32_t rises = wanted & ~sim->driven;
    uint32_t lights = 0;
    sim->driven = wanted;
    for (int i = 0; i < WEFT_SIM_N_LIGHTS; i++) {
        weft_sim_lamp_fault *const lamp = &sim->lamps[i];
        if (rises >> i & 1) {
            lamp->driven_since = sim->avr->cycle;
            if (lamp->state == WEFT_SIM_LAMP_LATE)
                avr_cycle_timer_register(sim->avr, lamp->late, light_up, lamp);
        }
        lights |= (uint32_t)gives_light(sim, i) << (lamp->state == WEFT_SIM_LAMP_AS ? lamp->other : i);
    }
    return lights;
}

void weft_controller_sim_set_lamp(weft_controller_sim *sim, int lamp, weft_sim_lamp_state state,
                                  uint32_t number)
{
    const bool late = state == WEFT_SIM_LAMP_LATE;
    pthread_mutex_lock(&sim->mutex);
    count_light_until(sim, sim->avr->cycle);
    sim->lamps[lamp] =
        (weft_sim_lamp_fault){.state = state,
                              .late = 1 + (avr_cycle_count_t)(late ? number : 0) * WEFT_SIM_CYCLES_A_US,
                              .other = late ? 0 : (int)number,
                              .driven_since = sim->avr->cycle,
                              .sim = sim};
    weft_sim_look_at_pins(sim);
    pthread_mutex_unlock(&sim->mutex);
}

uint32_t weft_controller_sim_driven(weft_controller_sim *sim)
{
    pthread_mutex_lock(&sim->mutex);
    const uint32_t driven = sim->driven;
    pthread_mutex_unlock(&sim->mutex);
    return driven;
}

/* -- pins ----------------------------------------------------------------------------------------------- */

void weft_sim_set_exposure_line(weft_controller_sim *sim, bool high)
{
    sim->exposing = high;
    avr_raise_irq(avr_io_getirq(sim->avr, AVR_IOCTL_IOPORT_GETIRQ('B'), 0), high);
}

/* The camera begins its exposure, or ends it. */
static avr_cycle_count_t move_exposure_line(avr_t *avr, avr_cycle_count_t when, void *context)
{
    weft_controller_sim *const sim = context;
    (void)avr;
    weft_sim_set_exposure_line(sim, !sim->exposing);
    return sim->exposing ? when + (avr_cycle_count_t)sim->camera_exposure_us * WEFT_SIM_CYCLES_A_US : 0;
}

/* Reads the pins from the registers, at every write to one of them.  A light shines while its own pin and
 * the dimming line are driven high; what is not driven is pulled down. */
void weft_sim_look_at_pins(weft_controller_sim *sim)
{
    const uint8_t *const r = sim->avr->data;
    const unsigned d = r[R_PORTD] & r[R_DDRD], c = r[R_PORTC] & r[R_DDRC], duty = dimming_duty(r);
    const uint32_t chosen = d >> LIGHTS_D_SHIFT | (c & LIGHTS_C_MASK) << N_LIGHTS_D;
    const uint32_t lights = drive_lamps(sim, duty ? chosen : 0);
    const bool trigger = (r[R_PORTB] & r[R_DDRB] & TRIGGER_B) != 0;
    const bool changes = lights != sim->lights || trigger != sim->trigger_high;
    if (lights != sim->lights || duty != sim->duty) {
        count_light_until(sim, sim->avr->cycle);
        if (lights == 0 && sim->lights != 0)
            sim->dark_since = sim->avr->cycle;
        sim->lights = lights;
        sim->duty = duty;
        const int n = __builtin_popcount(lights);
        if (n > sim->most_lights)
            sim->most_lights = n;
    }
    const bool rises = trigger && !sim->trigger_high;
    sim->trigger_high = trigger;
    if (changes && sim->on_change)
        sim->on_change(sim->change_context, sim->avr->cycle, lights, trigger);
    if (rises && sim->camera_exposure_us)
        avr_cycle_timer_register(sim->avr, 1 + (avr_cycle_count_t)sim->camera_delay_us * WEFT_SIM_CYCLES_A_US,
                                 move_exposure_line, sim);
    if (rises && sim->on_trigger)
        sim->on_trigger(sim->trigger_context);
}

static void on_register_written(avr_irq_t *irq, uint32_t value, void *context)
{
    (void)irq;
    (void)value;
    weft_sim_look_at_pins(context);
}

void weft_sim_watch_pins(weft_controller_sim *sim)
{
    static const uint8_t registers[] = {R_DDRB,  R_PORTB,  R_DDRC,   R_PORTC, R_DDRD,
                                        R_PORTD, R_TCCR1A, R_TCCR1B, R_OCR1AL};
    for (size_t i = 0; i < sizeof registers; i++)
        avr_irq_register_notify(avr_iomem_getirq(sim->avr, registers[i], NULL, AVR_IOMEM_IRQ_ALL),
                                on_register_written, sim);
}

static avr_cycle_count_t end_exposure(avr_t *avr, avr_cycle_count_t when, void *context)
{
    weft_sim_exposure *const e = context;
    weft_controller_sim *const sim = e->sim;
    (void)avr;
    (void)when;
    count_light_until(sim, e->end);
    for (int i = 0; i < WEFT_SIM_N_LIGHTS; i++)
        e->on_parts[i] = sim->on_parts[i] - e->on_parts[i];
    e->done = true;
    if (sim->exposure_wired)
        weft_sim_set_exposure_line(sim, false);
    pthread_cond_broadcast(&sim->passed);
    return 0;
}

void weft_sim_begin_exposure(weft_controller_sim *sim, weft_sim_exposure *e, uint32_t exposure_us)
{
    count_light_until(sim, sim->avr->cycle);
    *e = (weft_sim_exposure){.next = sim->exposures, .begin = sim->avr->cycle, .sim = sim};
    e->end = e->begin + (avr_cycle_count_t)exposure_us * WEFT_SIM_CYCLES_A_US;
    memcpy(e->on_parts, sim->on_parts, sizeof e->on_parts);
    sim->exposures = e;
    if (sim->exposure_wired)
        weft_sim_set_exposure_line(sim, true);
    avr_cycle_timer_register(sim->avr, e->end - sim->avr->cycle, end_exposure, e);
}

void weft_sim_forget_exposure(weft_controller_sim *sim, weft_sim_exposure *e)
{
    if (!e->done)
        avr_cycle_timer_cancel(sim->avr, end_exposure, e);
    weft_sim_exposure **link = &sim->exposures;
    while (*link != e)
        link = &(*link)->next;
    *link = e->next;
}

void weft_sim_resume_exposures(weft_controller_sim *sim)
{
    const avr_cycle_count_t now = sim->avr->cycle;
    for (weft_sim_exposure *e = sim->exposures; e; e = e->next)
        if (!e->done)
            avr_cycle_timer_register(sim->avr, e->end > now ? e->end - now : 1, end_exposure, e);
}
