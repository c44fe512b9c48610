/* The simulated board's serial line: its pace, its rate, and what a bad cable does to it. */
#include "host/rig/controller_sim_private.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Data addresses of the ATmega328P's registers (DS40002061B, section 30). */
enum { R_UCSR0A = 0xc0, R_UBRR0L = 0xc4, R_UBRR0H = 0xc5, U2X0 = 0x02, DOR0 = 0x08 };

enum {
    RECEIVER_PLACES = 3,    /* two in the chip's buffer, one in its shift register */
    BITS_A_CHARACTER = 10,  /* start, eight, stop */
    FIRST_DIVISOR_BITS = 8, /* of UBRR0L; the rest is in UBRR0H */
};

/* -- the cable ------------------------------------------------------------------------------------------ */

/* SplitMix64 (Steele, Lea and Flood 2014): uniform in [0, 1). */
static double uniform(weft_sim_line *line)
{
    uint64_t z = line->random += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return (double)((z ^ z >> 31) >> 11) * 0x1p-53;
}

static bool happens(weft_sim_line *line, double chance)
{
    return chance > 0 && uniform(line) < chance;
}

static void append(weft_sim_line *line, uint8_t byte, avr_cycle_count_t ready)
{
    if (line->head - line->tail == QUEUE_BYTES)
        return; /* nobody reads for 64 KiB: lost, as on a closed port */
    line->bytes[line->head++ % QUEUE_BYTES] = (struct weft_sim_byte){ready, byte};
}

static void carry(weft_sim_line *line, uint8_t byte, avr_cycle_count_t now)
{
    const weft_sim_line_faults *const f = &line->faults;
    if (happens(line, f->stall))
        line->stalled_until = now + (avr_cycle_count_t)f->stall_ms * (WEFT_SIM_CLOCK_HZ / 1000);
    if (happens(line, f->drop))
        return;
    if (happens(line, f->flip))
        byte ^= (uint8_t)(1u << (int)(8 * uniform(line)));
    const avr_cycle_count_t ready = now > line->stalled_until ? now : line->stalled_until;
    append(line, byte, ready);
    if (happens(line, f->repeat))
        append(line, byte, ready);
}

void weft_sim_line_put(weft_sim_line *line, uint8_t byte, avr_cycle_count_t now)
{
    carry(line, byte, now);
    if (line->n_frame < sizeof line->frame)
        line->frame[line->n_frame] = byte;
    line->n_frame++;
    if (byte != 0)
        return;
    if (line->n_frame > 1 && line->n_frame <= sizeof line->frame && happens(line, line->faults.repeat_frame))
        for (size_t i = 0; i < line->n_frame; i++)
            carry(line, line->frame[i], now);
    line->n_frame = 0;
}

bool weft_sim_line_take(weft_sim_line *line, uint8_t *byte, avr_cycle_count_t now)
{
    if (line->head == line->tail || line->bytes[line->tail % QUEUE_BYTES].ready > now)
        return false;
    *byte = line->bytes[line->tail++ % QUEUE_BYTES].value;
    return true;
}

void weft_sim_line_clear(weft_sim_line *line)
{
    line->head = line->tail = line->n_frame = 0;
    line->stalled_until = 0;
}

void weft_controller_sim_set_line_faults(weft_controller_sim *sim, weft_sim_direction direction,
                                         const weft_sim_line_faults *faults)
{
    weft_sim_line *const line = direction == WEFT_SIM_TO_BOARD ? &sim->in : &sim->out;
    pthread_mutex_lock(&sim->mutex);
    line->faults = faults ? *faults : (weft_sim_line_faults){0};
    line->random = line->faults.seed;
    line->stalled_until = 0;
    pthread_mutex_unlock(&sim->mutex);
}

/* -- the wrong rate ---------------------------------------------------------------------------------------
 */

/* The line's level over time, in bits of the sender: characters back to back, then idle, which is high. */
static bool level_at(const uint8_t *sent, size_t n, size_t bit)
{
    const size_t character = bit / BITS_A_CHARACTER, place = bit % BITS_A_CHARACTER;
    if (character >= n || place == BITS_A_CHARACTER - 1)
        return true;
    return place > 0 && sent[character] >> (place - 1) & 1;
}

size_t weft_controller_sim_garble(const uint8_t *sent, size_t n, double sent_rate, double read_rate,
                                  uint8_t *heard, size_t room)
{
    const double step = sent_rate / read_rate; /* a bit of the receiver, in bits of the sender */
    const size_t end = n * BITS_A_CHARACTER;
    size_t n_heard = 0;
    for (size_t bit = 0; bit < end && n_heard < room;) {
        const bool falls = !level_at(sent, n, bit) && (bit == 0 || level_at(sent, n, bit - 1));
        if (!falls || level_at(sent, n, bit + (size_t)(0.5 * step))) { /* no start, or only a spike */
            bit++;
            continue;
        }
        uint8_t byte = 0;
        for (int i = 0; i < 8; i++)
            byte |= (uint8_t)(level_at(sent, n, bit + (size_t)((1.5 + i) * step)) << i);
        heard[n_heard++] = byte;
        bit += (size_t)fmax(1, 9.5 * step); /* in the middle of the stop bit it is ready for the next */
    }
    return n_heard;
}

/* -- the UART ------------------------------------------------------------------------------------------- */

static unsigned bit_cycles(const weft_controller_sim *sim)
{
    const uint8_t *const r = sim->avr->data;
    const unsigned divisor = (unsigned)r[R_UBRR0H] << FIRST_DIVISOR_BITS | r[R_UBRR0L];
    return (r[R_UCSR0A] & U2X0 ? 8u : 16u) * (divisor + 1);
}

double weft_sim_baud(const weft_controller_sim *sim)
{
    return (double)WEFT_SIM_CLOCK_HZ / bit_cycles(sim);
}

static avr_cycle_count_t character_cycles(const weft_controller_sim *sim)
{
    return (avr_cycle_count_t)BITS_A_CHARACTER * bit_cycles(sim);
}

/* The simulator keeps 64 bytes; the chip loses what comes when its places are taken, and says so. */
static void give_byte(weft_controller_sim *sim, uint8_t byte)
{
    const uart_fifo_t *const fifo = &sim->uart->input;
    const unsigned waiting = (unsigned)(fifo->write - fifo->read) % uart_fifo_fifo_size;
    if (!avr_regbit_get(sim->avr, sim->uart->rxen))
        return; /* nobody listens, as on the chip */
    if (waiting < RECEIVER_PLACES) {
        avr_raise_irq(sim->uart_input, byte);
    } else {
        sim->overruns++;
        sim->avr->data[R_UCSR0A] |= DOR0;
    }
}

/* The beginning of a character: the simulator tells the program of it a character's time later. */
static avr_cycle_count_t feed(avr_t *avr, avr_cycle_count_t when, void *context)
{
    weft_controller_sim *const sim = context;
    uint8_t byte;
    (void)avr;
    const weft_sim_line *const in = &sim->in;
    sim->feeding = in->head != in->tail;
    if (!sim->feeding)
        return 0;
    if (!weft_sim_line_take(&sim->in, &byte, when)) /* the cable holds it back */
        return in->bytes[in->tail % QUEUE_BYTES].ready;
    give_byte(sim, byte);
    return when + character_cycles(sim);
}

void weft_sim_start_feeding(weft_controller_sim *sim)
{
    if (sim->feeding || sim->in.head == sim->in.tail)
        return;
    sim->feeding = true;
    avr_cycle_timer_register(sim->avr, 1, feed, sim);
}

/* The simulator hands over a byte when the program writes it; on the wire it takes its time. */
static void on_byte_sent(avr_irq_t *irq, uint32_t value, void *context)
{
    weft_controller_sim *const sim = context;
    const avr_cycle_count_t now = sim->avr->cycle;
    (void)irq;
    sim->sent_until = (now > sim->sent_until ? now : sim->sent_until) + character_cycles(sim);
    weft_sim_line_put(&sim->out, (uint8_t)value, sim->sent_until);
}

/* The simulator counts a parity bit that is not there, and looks at U2X0 only when UBRR0L is written. */
static void on_rate_written(avr_irq_t *irq, uint32_t value, void *context)
{
    weft_controller_sim *const sim = context;
    (void)irq;
    (void)value;
    sim->uart->cycles_per_byte = character_cycles(sim);
}

static avr_uart_t *find_uart(avr_t *avr)
{
    avr_io_t *io = avr->io_port;
    while (io && !(strcmp(io->kind, "uart") == 0 && ((avr_uart_t *)io)->name == '0'))
        io = io->next;
    return (avr_uart_t *)io;
}

void weft_sim_watch_uart(weft_controller_sim *sim)
{
    static const uint8_t of_the_rate[] = {R_UCSR0A, R_UBRR0L, R_UBRR0H};
    avr_t *const avr = sim->avr;
    sim->uart = find_uart(avr);
    assert(sim->uart);
    uint32_t flags = 0; /* no echo on stdout, no sleeping in polls */
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_byte_sent,
                            sim);
    sim->uart_input = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    for (size_t i = 0; i < sizeof of_the_rate; i++)
        avr_irq_register_notify(avr_iomem_getirq(avr, of_the_rate[i], NULL, AVR_IOMEM_IRQ_ALL),
                                on_rate_written, sim);
}
