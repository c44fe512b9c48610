/* The processor of the simulated board and its serial line, and where libsimavr is not like the chip. */
#include "core/log.h"
#include "core/mem.h"
#include "host/rig/controller_sim_private.h"

#include <simavr/avr_extint.h>
#include <simavr/avr_timer.h>

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Data addresses of the ATmega328P's registers (DS40002061B, section 30). */
enum {
    R_MCUSR = 0x54,
    R_WDTCSR = 0x60,
    R_TIMSK1 = 0x6f,
    R_TIMSK2 = 0x70,
    WDRF = 0x08, /* of MCUSR: the watchdog made this reset */
    WDE = 0x08,  /* of WDTCSR */
    WDCE = 0x10, /* of WDTCSR: lets the next write change it */
};

/* -- serial line ---------------------------------------------------------------------------------------- */

static avr_cycle_count_t character_cycles(const weft_controller_sim *sim)
{
    const avr_cycle_count_t cycles = sim->uart->cycles_per_byte;
    return cycles ? cycles : 352; /* the firmware has not set its rate yet: 500 000 bits/s */
}

static void give_byte(weft_controller_sim *sim, uint8_t byte)
{
    const uart_fifo_t *const fifo = &sim->uart->input;
    const unsigned waiting = (unsigned)(fifo->write - fifo->read) % uart_fifo_fifo_size;
    if (!avr_regbit_get(sim->avr, sim->uart->rxen))
        return; /* nobody listens, as on the chip */
    if (waiting >= RECEIVER_PLACES)
        sim->overruns++;
    else
        avr_raise_irq(sim->uart_input, byte);
}

static avr_cycle_count_t feed(avr_t *avr, avr_cycle_count_t when, void *context)
{
    weft_controller_sim *const sim = context;
    uint8_t byte;
    (void)avr;
    sim->feeding = weft_sim_queue_take(&sim->in, &byte);
    if (!sim->feeding)
        return 0;
    give_byte(sim, byte);
    return when + character_cycles(sim);
}

void weft_sim_start_feeding(weft_controller_sim *sim)
{
    if (sim->feeding || sim->in.head == sim->in.tail)
        return;
    sim->feeding = true;
    avr_cycle_timer_register(sim->avr, character_cycles(sim), feed, sim);
}

static void on_byte_sent(avr_irq_t *irq, uint32_t value, void *context)
{
    weft_controller_sim *const sim = context;
    (void)irq;
    weft_sim_queue_put(&sim->out, (uint8_t)value); /* nobody reads for 64 KiB: lost, as on a closed port */
}

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

/* On the chip a watchdog that has bitten stays on, at its shortest time of 16 ms, until the program clears
 * WDRF and switches it off (DS40002061B, 11.9.1): a program that forgets that resets for ever. */
static void keep_watchdog_on(avr_t *avr)
{
    const avr_io_addr_t io = AVR_DATA_TO_IO(R_WDTCSR);
    if (!(avr->data[R_MCUSR] & WDRF) || !avr->io[io].w.c)
        return;
    avr->io[io].w.c(avr, R_WDTCSR, WDCE | WDE, avr->io[io].w.param);
    avr->io[io].w.c(avr, R_WDTCSR, WDE, avr->io[io].w.param);
}

/* A reset clears the simulator's timers and extint flags, and the ports change without a notice. */
static void mend_after_reset(weft_controller_sim *sim)
{
    sim->was_reset = sim->lost = false;
    sim->resets++;
    for (uint8_t i = 0; i < 2; i++) /* or it polls INT0 and INT1, lights of ours, at every cycle */
        avr_extint_set_strict_lvl_trig(sim->avr, i, 0);
    weft_sim_look_at_pins(sim);
    if (sim->exposing)
        weft_sim_set_exposure_line(sim, false); /* its timer is gone */
    keep_watchdog_on(sim->avr);
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

static avr_uart_t *find_uart(avr_t *avr)
{
    avr_io_t *io = avr->io_port;
    while (io && !(strcmp(io->kind, "uart") == 0 && ((avr_uart_t *)io)->name == '0'))
        io = io->next;
    return (avr_uart_t *)io;
}

static void connect_board(weft_controller_sim *sim)
{
    avr_t *const avr = sim->avr;
    avr->sleep = no_sleep;
    avr->run_cycle_limit = 1600;
    avr->custom.data = sim;
    sim->core_reset = avr->reset;
    avr->reset = on_reset;
    sim->uart = find_uart(avr);
    assert(sim->uart);
    uint32_t flags = 0; /* no echo on stdout, no sleeping in polls */
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_byte_sent,
                            sim);
    sim->uart_input = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    weft_sim_watch_pins(sim);
    avr_irq_register_notify(avr_iomem_getirq(avr, R_TIMSK1, NULL, AVR_IOMEM_IRQ_ALL), on_timer_mask_written,
                            sim);
    avr_irq_register_notify(avr_iomem_getirq(avr, R_TIMSK2, NULL, AVR_IOMEM_IRQ_ALL), on_timer_mask_written,
                            sim);
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
    sim->master = sim->wake = -1;
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
