#include "host/rig/controller_sim.h"

#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"

#include <simavr/avr_extint.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <pty.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#define CLOCK_HZ 16000000u

/* Data addresses of the ATmega328P's registers (DS40002061B, section 30). */
enum {
    R_DDRB = 0x24,
    R_PORTB = 0x25,
    R_DDRC = 0x27,
    R_PORTC = 0x28,
    R_DDRD = 0x2a,
    R_PORTD = 0x2b,
    R_MCUSR = 0x54,
    R_WDTCSR = 0x60,
    R_TCCR1A = 0x80,
    R_TCCR1B = 0x81,
    R_OCR1AL = 0x88,
    R_UCSR0A = 0xc0,
    R_UBRR0L = 0xc4,
    R_UBRR0H = 0xc5,
    COM1A = 0xc0,       /* of TCCR1A: not 0 when PB1 belongs to the timer */
    FAST_PWM_1A = 0x81, /* of TCCR1A: high from 0 to OCR1A, fast PWM of 8 bits */
    FAST_PWM_1B = 0x08, /* of TCCR1B: the same */
    WAVEFORM_1B = 0x18,
    CLOCK_1B = 0x07,
    WDRF = 0x08, /* of MCUSR: the watchdog made this reset */
    WDE = 0x08,  /* of WDTCSR */
    WDCE = 0x10, /* of WDTCSR: lets the next write change it */
    U2X0 = 0x02, /* of UCSR0A */
};

/* How the virtual scanner is wired; docs/hardware.md says it for the real one. */
enum {
    LIGHTS_D_SHIFT = 2, /* lights 0..5 on PD2..PD7 */
    N_LIGHTS_D = 6,
    LIGHTS_C_MASK = 0x0f, /* lights 6..9 on PC0..PC3 */
    DIMMING_B = 1 << 1,
    TRIGGER_B = 1 << 2,
};

enum {
    FULL_DUTY = 256,
    RECEIVER_PLACES = 3, /* two in the chip's buffer, one in its shift register */
    QUEUE_BYTES = 1 << 16,
};

/* Bytes on their way; write at head, read at tail, both count on for ever. */
typedef struct queue {
    size_t head, tail;
    uint8_t bytes[QUEUE_BYTES];
} queue;

/* An exposure under way. */
typedef struct exposure {
    struct exposure *next;
    avr_cycle_count_t begin, end;
    uint64_t on_parts[WEFT_SIM_N_LIGHTS]; /* at `begin`, then from `begin` to `end` */
    weft_controller_sim *sim;
    bool done;
} exposure;

struct weft_controller_sim {
    avr_t *avr;
    avr_uart_t *uart;
    avr_irq_t *uart_input;
    void (*core_reset)(avr_t *avr);
    bool was_reset, crashed;

    /* light */
    uint32_t lights;              /* on at this cycle */
    unsigned duty;                /* in FULL_DUTY parts: how much of the time the dimming lets them be */
    avr_cycle_count_t since;      /* `lights` and `duty` hold since then */
    avr_cycle_count_t dark_since; /* `lights` is 0 since then */
    uint64_t on_parts[WEFT_SIM_N_LIGHTS]; /* cycles x duty, up to `since` */
    int most_lights;
    exposure *exposures;

    bool trigger_high;
    void (*on_trigger)(void *context);
    void *trigger_context;

    queue in, out;
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

static weft_controller_sim *sim_of(avr_t *avr)
{
    return avr->custom.data;
}

/* -- queues --------------------------------------------------------------------------------------------- */

static bool queue_put(queue *q, uint8_t byte)
{
    if (q->head - q->tail == QUEUE_BYTES)
        return false;
    q->bytes[q->head++ % QUEUE_BYTES] = byte;
    return true;
}

static bool queue_take(queue *q, uint8_t *byte)
{
    if (q->head == q->tail)
        return false;
    *byte = q->bytes[q->tail++ % QUEUE_BYTES];
    return true;
}

/* -- light ---------------------------------------------------------------------------------------------- */

static void count_light_until(weft_controller_sim *sim, avr_cycle_count_t cycle)
{
    if (cycle <= sim->since)
        return;
    for (int i = 0; i < WEFT_SIM_N_LIGHTS; i++)
        if (sim->lights >> i & 1)
            sim->on_parts[i] += (cycle - sim->since) * sim->duty;
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

/* Reads the pins from the registers, at every write to one of them.  A light shines while its own pin and
 * the dimming line are driven high; what is not driven is pulled down. */
static void look_at_pins(weft_controller_sim *sim)
{
    const uint8_t *const r = sim->avr->data;
    const unsigned d = r[R_PORTD] & r[R_DDRD], c = r[R_PORTC] & r[R_DDRC], duty = dimming_duty(r);
    const uint32_t chosen = d >> LIGHTS_D_SHIFT | (c & LIGHTS_C_MASK) << N_LIGHTS_D;
    const uint32_t lights = duty ? chosen : 0;
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
    const bool trigger = (r[R_PORTB] & r[R_DDRB] & TRIGGER_B) != 0;
    const bool rises = trigger && !sim->trigger_high;
    sim->trigger_high = trigger;
    if (rises && sim->on_trigger)
        sim->on_trigger(sim->trigger_context);
}

static void on_register_written(avr_irq_t *irq, uint32_t value, void *context)
{
    (void)irq;
    (void)value;
    look_at_pins(context);
}

static void watch_pins(weft_controller_sim *sim)
{
    static const uint8_t registers[] = {R_DDRB,  R_PORTB,  R_DDRC,   R_PORTC, R_DDRD,
                                        R_PORTD, R_TCCR1A, R_TCCR1B, R_OCR1AL};
    for (size_t i = 0; i < sizeof registers; i++)
        avr_irq_register_notify(avr_iomem_getirq(sim->avr, registers[i], NULL, AVR_IOMEM_IRQ_ALL),
                                on_register_written, sim);
}

/* -- exposures ------------------------------------------------------------------------------------------ */

static avr_cycle_count_t end_exposure(avr_t *avr, avr_cycle_count_t when, void *context)
{
    exposure *const e = context;
    weft_controller_sim *const sim = e->sim;
    (void)avr;
    (void)when;
    count_light_until(sim, e->end);
    for (int i = 0; i < WEFT_SIM_N_LIGHTS; i++)
        e->on_parts[i] = sim->on_parts[i] - e->on_parts[i];
    e->done = true;
    pthread_cond_broadcast(&sim->passed);
    return 0;
}

static void begin_exposure(weft_controller_sim *sim, exposure *e, uint32_t exposure_us)
{
    count_light_until(sim, sim->avr->cycle);
    *e = (exposure){.next = sim->exposures, .begin = sim->avr->cycle, .sim = sim};
    e->end = e->begin + (avr_cycle_count_t)exposure_us * (CLOCK_HZ / 1000000);
    memcpy(e->on_parts, sim->on_parts, sizeof e->on_parts);
    sim->exposures = e;
    avr_cycle_timer_register(sim->avr, e->end - sim->avr->cycle, end_exposure, e);
}

static void forget_exposure(weft_controller_sim *sim, const exposure *e)
{
    exposure **link = &sim->exposures;
    while (*link != e)
        link = &(*link)->next;
    *link = e->next;
}

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
    sim->feeding = queue_take(&sim->in, &byte);
    if (!sim->feeding)
        return 0;
    give_byte(sim, byte);
    return when + character_cycles(sim);
}

static void start_feeding(weft_controller_sim *sim)
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
    queue_put(&sim->out, (uint8_t)value); /* nobody reads for 64 KiB: lost, as on a closed port */
}

/* -- the processor -------------------------------------------------------------------------------------- */

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
    sim->was_reset = false;
    sim->resets++;
    for (uint8_t i = 0; i < 2; i++) /* or it polls INT0 and INT1, lights of ours, at every cycle */
        avr_extint_set_strict_lvl_trig(sim->avr, i, 0);
    look_at_pins(sim);
    keep_watchdog_on(sim->avr);
    sim->feeding = false;
    start_feeding(sim);
    for (exposure *e = sim->exposures; e; e = e->next)
        if (!e->done)
            avr_cycle_timer_register(sim->avr, e->end > sim->avr->cycle ? e->end - sim->avr->cycle : 1,
                                     end_exposure, e);
}

static void press_reset(weft_controller_sim *sim)
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

/* Runs to `until` and not beyond: a timer there ends a sleep. */
static void run_until(weft_controller_sim *sim, avr_cycle_count_t until)
{
    avr_t *const avr = sim->avr;
    bool armed = false;
    while (avr->cycle < until && !sim->crashed) {
        if (!armed)
            avr_cycle_timer_register(avr, until - avr->cycle, no_action, sim);
        armed = true;
        const int state = avr_run(avr);
        sim->crashed = state == cpu_Done || state == cpu_Crashed;
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

/* -- loading -------------------------------------------------------------------------------------------- */

enum { ELF_MACHINE_AVR = 83 };

/* libsimavr says little about a file that it does not like. */
static weft_err check_elf(const char *path, weft_error *err)
{
    unsigned char head[20];
    FILE *const file = fopen(path, "rb");
    if (!file)
        return weft_fail_errno(err, WEFT_ERR_IO,
                               "%s: the firmware cannot be read (the build makes it: "
                               "cmake --build build --target weft_firmware)",
                               path);
    const size_t n = fread(head, 1, sizeof head, file);
    fclose(file);
    if (n != sizeof head || memcmp(head, "\177ELF\1\1", 6) != 0 || head[18] != ELF_MACHINE_AVR)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: this is no firmware for an AVR (wanted its .elf file)",
                         path);
    return WEFT_OK;
}

static weft_err load_elf(avr_t *avr, const char *path, weft_error *err)
{
    elf_firmware_t elf;
    memset(&elf, 0, sizeof elf);
    const int failed = elf_read_firmware(path, &elf) != 0 || elf.flashsize == 0 ||
                       elf.flashbase + elf.flashsize > avr->flashend + 1;
    if (!failed) {
        elf.frequency = CLOCK_HZ;
        avr_load_firmware(avr, &elf);
    }
    for (uint32_t i = 0; i < elf.symbolcount; i++)
        free(elf.symbol[i]);
    free(elf.symbol);
    free(elf.flash);
    free(elf.eeprom);
    if (failed)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: the firmware is damaged or does not fit the ATmega328P",
                         path);
    return WEFT_OK;
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
    watch_pins(sim);
    avr_reset(avr);
    mend_after_reset(sim);
    avr_regbit_set(avr, avr->reset_flags.porf);
    sim->resets = 0;
}

weft_err weft_controller_sim_create_stepped(const char *elf_path, weft_controller_sim **out, weft_error *err)
{
    avr_global_logger_set(log_line);
    WEFT_TRY(check_elf(elf_path, err));
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
        status = load_elf(sim->avr, elf_path, err);
    }
    if (status == WEFT_OK) {
        connect_board(sim);
        *out = sim;
    } else {
        weft_controller_sim_destroy(sim);
    }
    return status;
}

/* -- the paced thread ----------------------------------------------------------------------------------- */

/* Moves bytes between the pty and the queues, and sees a host open and close it. */
static void serve_pty(weft_controller_sim *sim)
{
    struct pollfd state = {.fd = sim->master, .events = POLLIN};
    poll(&state, 1, 0);
    const bool nobody = (state.revents & POLLHUP) != 0, bytes = (state.revents & POLLIN) != 0;
    if (!sim->is_open && (!nobody || bytes)) { /* DTR falls, the board's reset capacitor bites */
        sim->is_open = true;
        sim->opened++;
        sim->in.head = sim->in.tail = sim->out.head = sim->out.tail = 0;
        press_reset(sim);
    }
    uint8_t buffer[1024];
    if (bytes) {
        const ssize_t n = read(sim->master, buffer, sizeof buffer);
        for (ssize_t i = 0; i < n; i++)
            queue_put(&sim->in, buffer[i]);
        start_feeding(sim);
    }
    if (nobody && !bytes)
        sim->is_open = false;
    for (;;) {
        size_t n = 0;
        while (n < sizeof buffer && queue_take(&sim->out, &buffer[n]))
            n++;
        if (n == 0)
            break;
        if (sim->is_open && write(sim->master, buffer, n) < 0)
            break; /* a host that does not read loses bytes */
    }
}

/* Waits for bytes of a host or a wish of another thread, at most half a millisecond. */
static void wait_a_little(const weft_controller_sim *sim, bool is_open)
{
    struct pollfd fds[] = {{.fd = sim->wake, .events = POLLIN},
                           {.fd = is_open ? sim->master : -1, .events = POLLIN}};
    const struct timespec half_a_millisecond = {.tv_nsec = 500000};
    ppoll(fds, 2, &half_a_millisecond, NULL);
}

enum { SLICE_CYCLES = CLOCK_HZ / 1000, MOST_BEHIND_CYCLES = CLOCK_HZ / 20 };

/* Simulated time follows the wall clock; when the machine is too busy for that, it falls behind for good
 * rather than hurry after it. */
static void *run_paced(void *context)
{
    weft_controller_sim *const sim = context;
    const double origin_s = weft_clock_s();
    avr_cycle_count_t behind = 0;
    pthread_mutex_lock(&sim->mutex);
    while (!sim->stop && !sim->crashed) {
        serve_pty(sim);
        const avr_cycle_count_t now = (avr_cycle_count_t)((weft_clock_s() - origin_s) * CLOCK_HZ);
        avr_cycle_count_t target = now - behind;
        if (target > sim->avr->cycle + MOST_BEHIND_CYCLES) {
            behind += target - sim->avr->cycle - MOST_BEHIND_CYCLES;
            target = sim->avr->cycle + MOST_BEHIND_CYCLES;
        }
        const bool late = target > sim->avr->cycle + SLICE_CYCLES;
        run_until(sim, late ? sim->avr->cycle + SLICE_CYCLES : target);
        serve_pty(sim);
        const bool is_open = sim->is_open;
        pthread_mutex_unlock(&sim->mutex);
        if (!late)
            wait_a_little(sim, is_open);
        pthread_mutex_lock(&sim->mutex);
    }
    pthread_cond_broadcast(&sim->passed);
    pthread_mutex_unlock(&sim->mutex);
    return NULL;
}

static weft_err open_pty(weft_controller_sim *sim, char *pty_path, weft_error *err)
{
    int slave;
    struct termios raw;
    memset(&raw, 0, sizeof raw);
    cfmakeraw(&raw);
    char name[128] = "";
    if (openpty(&sim->master, &slave, NULL, &raw, NULL) != 0)
        return weft_fail_errno(err, WEFT_ERR_DEVICE, "no pseudo terminal for the virtual controller");
    const int failed = ptsname_r(sim->master, name, sizeof name);
    close(slave); /* from now on a hang-up says that no host has it open */
    sim->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (failed || sim->wake < 0 || fcntl(sim->master, F_SETFL, O_NONBLOCK) != 0 ||
        fcntl(sim->master, F_SETFD, FD_CLOEXEC) != 0)
        return weft_fail_errno(err, WEFT_ERR_DEVICE, "the virtual controller's pseudo terminal");
    snprintf(pty_path, 128, "%s", name);
    return WEFT_OK;
}

weft_err weft_controller_sim_create(const char *elf_path, weft_controller_sim **out, char *pty_path,
                                    weft_error *err)
{
    weft_controller_sim *sim;
    WEFT_TRY(weft_controller_sim_create_stepped(elf_path, &sim, err));
    weft_err status = open_pty(sim, pty_path, err);
    if (status == WEFT_OK) {
        sim->paced = true;
        const int failed = pthread_create(&sim->thread, NULL, run_paced, sim);
        if (failed) {
            sim->paced = false;
            errno = failed;
            status = weft_fail_errno(err, WEFT_ERR_NOMEM, "no thread for the virtual controller");
        }
    }
    if (status == WEFT_OK)
        *out = sim;
    else
        weft_controller_sim_destroy(sim);
    return status;
}

static void wake_thread(const weft_controller_sim *sim)
{
    const uint64_t one = 1;
    if (sim->wake >= 0 && write(sim->wake, &one, sizeof one) < 0)
        assert(errno == EAGAIN);
}

void weft_controller_sim_destroy(weft_controller_sim *sim)
{
    if (!sim)
        return;
    if (sim->paced) {
        pthread_mutex_lock(&sim->mutex);
        sim->stop = true;
        pthread_mutex_unlock(&sim->mutex);
        wake_thread(sim);
        pthread_join(sim->thread, NULL);
    }
    if (sim->master >= 0)
        close(sim->master);
    if (sim->wake >= 0)
        close(sim->wake);
    if (sim->avr) {
        avr_terminate(sim->avr);
        free(sim->avr);
    }
    pthread_cond_destroy(&sim->passed);
    pthread_mutex_destroy(&sim->mutex);
    weft_free(sim);
}

/* -- what others ask ------------------------------------------------------------------------------------ */

bool weft_controller_sim_expose(weft_controller_sim *sim, uint32_t exposure_us,
                                double on_fraction[WEFT_SIM_N_LIGHTS])
{
    exposure e;
    pthread_mutex_lock(&sim->mutex);
    begin_exposure(sim, &e, exposure_us);
    if (sim->paced)
        while (!e.done && !sim->stop && !sim->crashed)
            pthread_cond_wait(&sim->passed, &sim->mutex);
    else
        while (!e.done && !sim->crashed)
            run_until(sim, (e.end > sim->avr->cycle ? e.end : sim->avr->cycle) + 1);
    if (!e.done)
        avr_cycle_timer_cancel(sim->avr, end_exposure, &e);
    forget_exposure(sim, &e);
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
        *dark_for_s = lights ? 0 : (double)(sim->avr->cycle - sim->dark_since) / CLOCK_HZ;
    pthread_mutex_unlock(&sim->mutex);
    return lights;
}

void weft_controller_sim_reset(weft_controller_sim *sim)
{
    pthread_mutex_lock(&sim->mutex);
    press_reset(sim);
    pthread_mutex_unlock(&sim->mutex);
}

void weft_controller_sim_hang(weft_controller_sim *sim)
{
    pthread_mutex_lock(&sim->mutex);
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

double weft_controller_sim_time_s(weft_controller_sim *sim)
{
    pthread_mutex_lock(&sim->mutex);
    const double now_s = (double)sim->avr->cycle / CLOCK_HZ;
    pthread_mutex_unlock(&sim->mutex);
    return now_s;
}

void weft_controller_sim_get_counters(weft_controller_sim *sim, weft_controller_sim_counters *counters)
{
    pthread_mutex_lock(&sim->mutex);
    const uint8_t *const r = sim->avr->data;
    const unsigned divisor = (unsigned)r[R_UBRR0H] << 8 | r[R_UBRR0L];
    *counters = (weft_controller_sim_counters){
        .resets = sim->resets,
        .opened = sim->opened,
        .overruns = sim->overruns,
        .most_lights = sim->most_lights,
        .bits_per_s = (double)CLOCK_HZ / ((r[R_UCSR0A] & U2X0 ? 8 : 16) * (divisor + 1)),
        .simulated_s = (double)sim->avr->cycle / CLOCK_HZ,
        .running = !sim->crashed,
    };
    pthread_mutex_unlock(&sim->mutex);
}

/* -- stepped use ---------------------------------------------------------------------------------------- */

bool weft_controller_sim_run(weft_controller_sim *sim, double microseconds)
{
    assert(!sim->paced);
    pthread_mutex_lock(&sim->mutex);
    run_until(sim, sim->avr->cycle + (avr_cycle_count_t)(microseconds * (CLOCK_HZ / 1000000)));
    const bool running = !sim->crashed;
    pthread_mutex_unlock(&sim->mutex);
    return running;
}

void weft_controller_sim_send(weft_controller_sim *sim, const uint8_t *bytes, size_t n)
{
    assert(!sim->paced);
    pthread_mutex_lock(&sim->mutex);
    for (size_t i = 0; i < n; i++)
        queue_put(&sim->in, bytes[i]);
    start_feeding(sim);
    pthread_mutex_unlock(&sim->mutex);
}

size_t weft_controller_sim_receive(weft_controller_sim *sim, uint8_t *bytes, size_t room)
{
    size_t n = 0;
    pthread_mutex_lock(&sim->mutex);
    while (n < room && queue_take(&sim->out, &bytes[n]))
        n++;
    pthread_mutex_unlock(&sim->mutex);
    return n;
}
