/*
 * A program that does what shows how libsimavr differs from the chip, byte by byte as it is told:
 *   x        comes back
 *   d        1 ms deaf, then answers how many bytes it still got and whether one was lost
 *   e        stores eight bytes, answers the ticks (4 us) that took, low byte first
 *   t        pulls the trigger and sends a byte in the same moment
 *   l        all lights on
 *   i        waits 1 ms with the capture interrupt masked, then lets it in; its function sends "I"
 *   w        hangs under a watchdog of 250 ms, which the next start does not switch off
 */
#define F_CPU 16000000ul
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>
#include <util/delay.h>

static void put(uint8_t byte)
{
    while (!(UCSR0A & 1 << UDRE0))
        ;
    UDR0 = byte;
}

ISR(TIMER1_CAPT_vect)
{
    put('I');
}

static void be_deaf(void)
{
    uint8_t n = 0, lost = 0;
    _delay_us(1000);
    for (uint8_t i = 0; i < 100; i++) {
        const uint8_t flags = UCSR0A;
        if (flags & 1 << RXC0) {
            lost |= (flags & 1 << DOR0) != 0;
            (void)UDR0;
            n++;
        }
        _delay_us(1);
    }
    put(n);
    put(lost);
}

static void store(void)
{
    TCCR1B = 1 << CS11 | 1 << CS10;
    TCNT1 = 0;
    for (uint8_t i = 0; i < 8; i++)
        eeprom_write_byte((uint8_t *)(uint16_t)i, i);
    eeprom_busy_wait();
    const uint16_t ticks = TCNT1;
    put((uint8_t)ticks);
    put((uint8_t)(ticks >> 8));
}

static void obey(uint8_t byte)
{
    switch (byte) {
    case 'x':
        put(byte);
        break;
    case 'd':
        be_deaf();
        break;
    case 'e':
        store();
        break;
    case 't':
        UDR0 = byte;
        PORTB |= 1 << PB2;
        break;
    case 'l':
        DDRD = 0xfc;
        PORTD = 0xfc;
        PORTB |= 1 << PB1;
        break;
    case 'i':
        TCCR1B = 1 << ICES1 | 1 << CS10;
        TIMSK1 = 0;
        sei();
        _delay_us(1000);
        TIMSK1 = 1 << ICIE1;
        break;
    case 'w':
        wdt_enable(WDTO_250MS);
        for (;;)
            ;
    default:
        break;
    }
}

int main(void)
{
    UBRR0 = 3; /* 500 000 bits/s, once U2X0 is set: behind the divisor, as many programs do */
    UCSR0A = 1 << U2X0;
    UCSR0B = 1 << RXEN0 | 1 << TXEN0;
    DDRB = 1 << PB1 | 1 << PB2;
    for (;;)
        if (UCSR0A & 1 << RXC0)
            obey(UDR0);
}
