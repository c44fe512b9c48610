/* For the simulated board: five pulses of 100 us on the trigger pin, one a millisecond;
 * says nothing on the line. */
#define F_CPU 16000000ul
#include <avr/io.h>
#include <util/delay.h>

int main(void)
{
    DDRB = 1 << 2;
    for (int i = 0; i < 5; i++) {
        PORTB |= 1 << 2;
        _delay_us(100);
        PORTB &= (unsigned char)~(1 << 2);
        _delay_us(900);
    }
    for (;;)
        ;
}
