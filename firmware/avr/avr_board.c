/*
 * The board: registers of the ATmega328P.  Section numbers are those of its data sheet (DS40002061B).
 *
 * TIMER0 is the clock, TIMER1 the dimming and, with ICP1, the camera's exposure, TIMER2 the alarm.
 */
#include "firmware/avr/avr_pins.h"
#include "firmware/fw_board.h"
#include "firmware/fw_config.h"
#include "firmware/fw_link.h"
#include "firmware/fw_sequence.h"
#include "firmware/protocol.h"

#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>

/* -- before main ---------------------------------------------------------------------------------------- */

#define ALIVE 0x5765u

/* Survive a reset; mean something only while `alive` is ALIVE. */
static struct {
    uint16_t alive;
    uint16_t resets;
    uint16_t reboot; /* ALIVE: the reset that comes was asked for */
} kept __attribute__((section(".noinit")));

static uint8_t reset_flags __attribute__((section(".noinit")));
static uint8_t reset_cause;

void avr_board_first(void) __attribute__((naked, used, section(".init3")));

/* Runs before variables are set up.  The watchdog stays on after it has bitten (11.9.1), with 16 ms: the
 * flag must be cleared and it switched off here, or the board resets for ever. */
void avr_board_first(void)
{
    PORTB = 0;
    PORTC = 0;
    PORTD = 0;
    DDRB = AVR_DIMMING | AVR_TRIGGER | AVR_STATUS;
    DDRC = AVR_LIGHTS_C;
    DDRD = AVR_LIGHTS_D;
    reset_flags = MCUSR;
    MCUSR = 0;
    wdt_disable();
}

static void find_reset_cause(void)
{
    const bool warm = kept.alive == ALIVE;
    if (reset_flags & 1 << WDRF)
        reset_cause = warm && kept.reboot == ALIVE ? WEFT_RESET_REQUESTED : WEFT_RESET_WATCHDOG;
    else if (reset_flags & 1 << PORF || (reset_flags == 0 && !warm))
        reset_cause = WEFT_RESET_POWER_ON;
    else if (reset_flags & 1 << BORF)
        reset_cause = WEFT_RESET_BROWN_OUT;
    else if (reset_flags & 1 << EXTRF)
        reset_cause = WEFT_RESET_EXTERNAL;
    else
        reset_cause = WEFT_RESET_UNKNOWN;
    kept.resets = reset_cause == WEFT_RESET_POWER_ON || !warm ? 0 : (uint16_t)(kept.resets + 1);
    kept.alive = ALIVE;
    kept.reboot = 0;
}

/* -- watchdog ------------------------------------------------------------------------------------------- */

void fw_board_watchdog_start(void)
{
    wdt_enable(WDTO_250MS);
}

void fw_board_watchdog_feed(void)
{
    if (kept.reboot != ALIVE)
        wdt_reset();
}

void fw_board_reboot(void)
{
    kept.reboot = ALIVE;
}

/* -- lights --------------------------------------------------------------------------------------------- */

static uint8_t capture; /* ICNC1 and ICES1 of TCCR1B, which share it with the clock of TIMER1 */

void fw_board_dark(void)
{
    const uint8_t was = fw_board_lock();
    PORTD &= (uint8_t)~AVR_LIGHTS_D;
    PORTC &= (uint8_t)~AVR_LIGHTS_C;
    TCCR1A = 0;
    TCCR1B = capture;
    PORTB &= (uint8_t)~AVR_DIMMING;
    fw_board_unlock(was);
}

void fw_board_light(uint16_t mask, uint16_t level)
{
    fw_board_dark();
    if (level == FW_LEVEL_MAX) {
        PORTB |= AVR_DIMMING;
        TCCR1B = 1 << CS10 | capture; /* runs for the capture alone */
    } else {
        /* Fast PWM, 8 bits, no prescaler (15.9.3): high for OCR1A + 1 of 256 cycles.  From the top, so that
         * the first period begins one cycle after the start. */
        OCR1A = level - 1;
        TCNT1 = 255;
        TCCR1A = 1 << COM1A1 | 1 << WGM10;
        TCCR1B = 1 << WGM12 | 1 << CS10 | capture;
    }
    PORTD |= AVR_PORTD_OF(mask);
    PORTC |= AVR_PORTC_OF(mask);
}

void fw_board_status_led(bool on)
{
    if (on)
        PORTB |= AVR_STATUS;
    else
        PORTB &= (uint8_t)~AVR_STATUS;
}

/* -- clock ---------------------------------------------------------------------------------------------- */

static volatile uint32_t tick_base; /* ticks at the last full millisecond; the timer interrupt */
static volatile uint16_t ms;        /* the timer interrupt */

static void start_clock(void)
{
    OCR0A = FW_TICKS_A_MS - 1;
    TCCR0A = 1 << WGM01; /* counts 0 .. OCR0A */
    TCCR0B = 1 << CS01 | 1 << CS00;
    TIMSK0 = 1 << OCIE0A;
}

ISR(TIMER0_COMPA_vect)
{
    tick_base += FW_TICKS_A_MS;
    ms++;
}

uint32_t fw_board_ticks(void)
{
    const uint8_t was = fw_board_lock();
    uint32_t ticks = tick_base;
    const uint8_t count = TCNT0;
    if (TIFR0 & 1 << OCF0A && count < FW_TICKS_A_MS / 2)
        ticks += FW_TICKS_A_MS; /* it wrapped, and the interrupt waits for us */
    fw_board_unlock(was);
    return ticks + count;
}

uint16_t fw_board_ms(void)
{
    const uint8_t was = fw_board_lock();
    const uint16_t now = ms;
    fw_board_unlock(was);
    return now;
}

/* -- camera --------------------------------------------------------------------------------------------- */

void fw_board_trigger(bool high)
{
    if (high)
        PORTB |= AVR_TRIGGER;
    else
        PORTB &= (uint8_t)~AVR_TRIGGER;
}

bool fw_board_is_exposing(void)
{
    return (PINB & AVR_EXPOSURE) != 0;
}

/* Which edge comes next follows from the level: one that was missed is caught up with at the next. */
static void await_edge(void)
{
    const uint8_t was = fw_board_lock();
    const bool high = fw_board_is_exposing();
    capture = (uint8_t)(1 << ICNC1 | (high ? 0 : 1 << ICES1));
    TCCR1B = (TCCR1B & (uint8_t) ~(1 << ICES1)) | capture;
    TIFR1 = 1 << ICF1; /* changing the edge may set it (15.6.3) */
    fw_board_unlock(was);
}

/* The interrupts of exposure and alarm keep each other out, and let in all others: what they do takes up to
 * 30 us, and the serial line cannot wait so long. */
static struct {
    uint8_t exposure, alarm; /* what they are to be outside of them: bits of TIMSK1, TIMSK2 */
    bool inside;
} masks;

static void enter(void)
{
    masks.inside = true;
    TIMSK1 = 0;
    TIMSK2 = 0;
    sei();
}

static void leave(void)
{
    cli();
    masks.inside = false;
    TIMSK1 = masks.exposure;
    TIMSK2 = masks.alarm;
}

void fw_board_watch_exposure(bool on)
{
    masks.exposure = on ? 1 << ICIE1 : 0;
    if (on)
        await_edge();
    if (!masks.inside)
        TIMSK1 = masks.exposure;
}

ISR(TIMER1_CAPT_vect)
{
    const uint32_t now = fw_board_ticks();
    uint16_t cycles = (uint16_t)(TCNT1 - ICR1); /* since the edge; 0 when the timer stands */
    enter();
    if (TCCR1A)
        cycles &= 255u; /* dimming: it counts to 255 */
    const bool rose = (capture & 1 << ICES1) != 0;
    await_edge();
    fw_sequence_on_exposure(rose, now - cycles / (FW_CPU_HZ / FW_TICK_HZ));
    leave();
}

/* -- alarm: TIMER2 runs freely with the tick ------------------------------------------------------------- */

static uint32_t alarm_left; /* ticks beyond the compare that is set */
static uint8_t alarm_due;   /* TCNT2 of that compare */

/* As far as 8 bits go, in parts that leave none too short to be set in time. */
static void set_compare(void)
{
    const uint8_t part = alarm_left > 255 ? 128 : (uint8_t)alarm_left;
    const uint8_t from = alarm_due;
    alarm_left -= part;
    alarm_due = (uint8_t)(from + part);
    const uint8_t was = fw_board_lock();
    const uint8_t passed = (uint8_t)(TCNT2 - from);
    if (passed + 1u >= part)
        alarm_due = (uint8_t)(from + passed + 2); /* late: what follows is late too, not shorter */
    OCR2A = alarm_due;
    TIFR2 = 1 << OCF2A;
    masks.alarm = 1 << OCIE2A;
    if (!masks.inside)
        TIMSK2 = masks.alarm;
    fw_board_unlock(was);
}

void fw_board_alarm_begin(uint32_t ticks)
{
    TCCR2B = 1 << CS22; /* prescaler 64, as the tick */
    alarm_due = TCNT2;
    alarm_left = ticks;
    set_compare();
}

void fw_board_alarm_after(uint32_t ticks)
{
    alarm_left = ticks;
    set_compare();
}

void fw_board_alarm_stop(void)
{
    masks.alarm = 0;
    if (!masks.inside)
        TIMSK2 = 0;
}

ISR(TIMER2_COMPA_vect)
{
    enter();
    if (alarm_left > 0)
        set_compare();
    else
        fw_sequence_on_alarm();
    leave();
}

/* -- EEPROM --------------------------------------------------------------------------------------------- */

uint8_t fw_board_eeprom_read(uint16_t address)
{
    return eeprom_read_byte((const uint8_t *)address);
}

void fw_board_eeprom_write(uint16_t address, uint8_t byte)
{
    fw_board_watchdog_feed();
    eeprom_update_byte((uint8_t *)address, byte);
    eeprom_busy_wait();
}

/* -- serial line ---------------------------------------------------------------------------------------- */

static void start_serial(void)
{
    UCSR0A = 1 << U2X0; /* before the divisor: simulators compute the rate when UBRR0L is written */
    UBRR0H = (uint8_t)(FW_UBRR >> 8);
    UBRR0L = (uint8_t)FW_UBRR;
    UCSR0C = 1 << UCSZ01 | 1 << UCSZ00;
    UCSR0B = 1 << RXCIE0 | 1 << RXEN0 | 1 << TXEN0;
}

ISR(USART_RX_vect)
{
    const uint8_t flags = UCSR0A; /* belongs to the byte: before UDR0 */
    fw_link_on_byte(UDR0, (flags & (1 << FE0 | 1 << DOR0)) != 0);
}

ISR(USART_UDRE_vect)
{
    uint8_t byte;
    if (fw_link_next_byte(&byte))
        UDR0 = byte;
    else
        UCSR0B &= (uint8_t) ~(1 << UDRIE0);
}

void fw_board_send(void)
{
    const uint8_t was = fw_board_lock();
    UCSR0B |= 1 << UDRIE0;
    fw_board_unlock(was);
}

/* -- the rest ------------------------------------------------------------------------------------------- */

void fw_board_init(void)
{
    find_reset_cause();
    EICRA = 1 << ISC11 | 1 << ISC01; /* INT0, INT1 on edges: unused, and their pins are lights */
    set_sleep_mode(SLEEP_MODE_IDLE);
    start_clock();
    start_serial();
    sei();
}

uint8_t fw_board_reset_cause(void)
{
    return reset_cause;
}

uint16_t fw_board_resets(void)
{
    return kept.resets;
}

uint8_t fw_board_lock(void)
{
    const uint8_t was = SREG;
    cli();
    return was;
}

void fw_board_unlock(uint8_t was)
{
    SREG = was;
}

void fw_board_sleep(void)
{
    cli();
    if (!fw_link_has_bytes()) {
        sleep_enable();
        sei(); /* lets no interrupt in before the next instruction: none is slept through */
        sleep_cpu();
        sleep_disable();
    }
    sei();
}
