/* Where libsimavr is not like the chip, beside its UART: masked interrupts, EEPROM. */
#include "host/rig/controller_sim_private.h"

#include <simavr/avr_eeprom.h>
#include <simavr/avr_extint.h>
#include <simavr/avr_timer.h>

#include <string.h>

/* Data addresses of the ATmega328P's registers (DS40002061B, section 30). */
enum {
    R_EECR = 0x3f,
    R_EEARL = 0x41,
    R_EEARH = 0x42,
    R_TIMSK1 = 0x6f,
    R_TIMSK2 = 0x70,
    EEPE = 0x02,  /* of EECR: begins to store, and stays until it is done */
    EEMPE = 0x04, /* of EECR: lets the next write begin */
};

/* -- interrupts ----------------------------------------------------------------------------------------- */

static avr_timer_t *find_timer(avr_t *avr, char name)
{
    avr_io_t *io = avr->io_port;
    while (io && !(strcmp(io->kind, "timer") == 0 && ((avr_timer_t *)io)->name == name))
        io = io->next;
    return (avr_timer_t *)io;
}

/* On the chip an interrupt whose flag was raised while it was masked comes when it is let in; the simulator
 * forgets it. */
static void recall(avr_t *avr, avr_int_vector_t *vector)
{
    if (avr_regbit_get(avr, vector->enable) && avr_regbit_get(avr, vector->raised) && !vector->pending)
        avr_raise_interrupt(avr, vector);
}

static void on_timer_mask_written(avr_irq_t *irq, uint32_t value, void *context)
{
    weft_controller_sim *const sim = context;
    (void)irq;
    (void)value;
    recall(sim->avr, &find_timer(sim->avr, '1')->icr);
    recall(sim->avr, &find_timer(sim->avr, '2')->comp[AVR_TIMER_COMPA].interrupt);
}

/* -- EEPROM --------------------------------------------------------------------------------------------- */

/* Table 8-2: 26 368 cycles of the calibrated oscillator, 3.4 ms. */
static const avr_cycle_count_t store_cycles = (avr_cycle_count_t)WEFT_SIM_CLOCK_HZ * 34 / 10000;

static avr_cycle_count_t end_storing(avr_t *avr, avr_cycle_count_t when, void *context)
{
    weft_controller_sim *const sim = context;
    (void)when;
    sim->storing = false;
    avr->data[R_EECR] &= (uint8_t)~EEPE;
    return 0;
}

/* The simulator stores at once and clears EEPE; the chip holds it for 3.4 ms. */
static void on_eecr_written(avr_irq_t *irq, uint32_t value, void *context)
{
    weft_controller_sim *const sim = context;
    (void)irq;
    if (!sim->storing && (value & (EEMPE | EEPE)) == (EEMPE | EEPE)) {
        sim->storing = true;
        sim->stored_at = sim->avr->cycle + store_cycles;
        avr_cycle_timer_register(sim->avr, store_cycles, end_storing, sim);
    }
    if (sim->storing)
        sim->avr->data[R_EECR] |= EEPE;
}

/* A reset does not stop what the EEPROM has begun. */
static void go_on_storing(weft_controller_sim *sim)
{
    const avr_cycle_count_t now = sim->avr->cycle;
    if (!sim->storing)
        return;
    sim->avr->data[R_EECR] |= EEPE;
    avr_cycle_timer_register(sim->avr, sim->stored_at > now ? sim->stored_at - now : 1, end_storing, sim);
}

/* The two ioctls work and say that they do not: their value is of no use. */
static void get_eeprom(weft_controller_sim *sim, uint8_t bytes[1024])
{
    avr_eeprom_desc_t all = {.ee = bytes, .size = 1024};
    avr_ioctl(sim->avr, AVR_IOCTL_EEPROM_GET, &all);
}

static void set_eeprom(weft_controller_sim *sim, uint8_t bytes[1024])
{
    avr_eeprom_desc_t all = {.ee = bytes, .size = 1024};
    avr_ioctl(sim->avr, AVR_IOCTL_EEPROM_SET, &all);
}

void weft_controller_sim_read_eeprom(weft_controller_sim *sim, uint8_t bytes[1024])
{
    pthread_mutex_lock(&sim->mutex);
    get_eeprom(sim, bytes);
    pthread_mutex_unlock(&sim->mutex);
}

void weft_controller_sim_write_eeprom(weft_controller_sim *sim, const uint8_t bytes[1024])
{
    uint8_t copy[1024];
    memcpy(copy, bytes, sizeof copy);
    pthread_mutex_lock(&sim->mutex);
    set_eeprom(sim, copy);
    pthread_mutex_unlock(&sim->mutex);
}

/* Without power the byte that is being stored is neither the old one nor the new one. */
void weft_sim_lose_power(weft_controller_sim *sim)
{
    const uint8_t *const r = sim->avr->data;
    if (sim->storing) {
        uint8_t all[1024];
        const unsigned address = ((unsigned)r[R_EEARH] << 8 | r[R_EEARL]) % sizeof all;
        get_eeprom(sim, all);
        all[address] = (uint8_t)(all[address] ^ 0x5a);
        set_eeprom(sim, all);
        avr_cycle_timer_cancel(sim->avr, end_storing, sim);
    }
    sim->storing = false;
    memset(sim->avr->data + sim->avr->ioend + 1, 0x5a, sim->avr->ramend - sim->avr->ioend);
}

/* -- both ----------------------------------------------------------------------------------------------- */

void weft_sim_mend_chip(weft_controller_sim *sim)
{
    sim->avr->run_cycle_limit = 1600;
    for (uint8_t i = 0; i < 2; i++) /* or it polls INT0 and INT1, lights of ours, at every cycle */
        avr_extint_set_strict_lvl_trig(sim->avr, i, 0);
    go_on_storing(sim);
}

void weft_sim_watch_chip(weft_controller_sim *sim)
{
    avr_t *const avr = sim->avr;
    avr_irq_register_notify(avr_iomem_getirq(avr, R_TIMSK1, NULL, AVR_IOMEM_IRQ_ALL), on_timer_mask_written,
                            sim);
    avr_irq_register_notify(avr_iomem_getirq(avr, R_TIMSK2, NULL, AVR_IOMEM_IRQ_ALL), on_timer_mask_written,
                            sim);
    avr_irq_register_notify(avr_iomem_getirq(avr, R_EECR, NULL, AVR_IOMEM_IRQ_ALL), on_eecr_written, sim);
}
