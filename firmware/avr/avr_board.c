/*
 * The board: registers of the ATmega328P.  Section numbers are those of its data sheet (DS40002061B).
 *
 * TIMER0 is the clock, TIMER1 the dimming (and, with ICP1, the camera's exposure), TIMER2 is free.
 */
#include "firmware/avr/avr_pins.h"
#include "firmware/fw_board.h"
#include "firmware/fw_config.h"
#include "firmware/fw_link.h"
#include "firmware/protocol.h"

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
        reset_cause = WEFT_RESET_WATCHDOG;
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
}

/* -- lights --------------------------------------------------------------------------------------------- */

void fw_board_dark(void)
{
    const uint8_t was = fw_board_lock();
    PORTD &= (uint8_t)~AVR_LIGHTS_D;
    PORTC &= (uint8_t)~AVR_LIGHTS_C;
    TCCR1A = 0;
    TCCR1B = 0;
    PORTB &= (uint8_t)~AVR_DIMMING;
    fw_board_unlock(was);
}

void fw_board_light(uint16_t mask, uint16_t level)
{
    fw_board_dark();
    if (level == FW_LEVEL_MAX) {
        PORTB |= AVR_DIMMING;
    } else {
        /* Fast PWM, 8 bits, no prescaler (15.9.3): high for OCR1A + 1 of 256 cycles.  From the top, so that
         * the first period begins one cycle after the start. */
        OCR1A = level - 1;
        TCNT1 = 255;
        TCCR1A = 1 << COM1A1 | 1 << WGM10;
        TCCR1B = 1 << WGM12 | 1 << CS10;
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

void fw_board_watchdog_start(void)
{
    wdt_enable(WDTO_250MS);
}

void fw_board_watchdog_feed(void)
{
    wdt_reset();
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
