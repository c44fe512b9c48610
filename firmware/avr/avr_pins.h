/**
 * Where everything is on an Arduino Uno; the only place that knows.  The table for people is in
 * docs/hardware.md.
 *
 *     lights 0..5   PD2..PD7   D2..D7
 *     lights 6..9   PC0..PC3   A0..A3
 *     dimming       PB1        D9    OC1A: high lets the lights that are chosen shine
 *     trigger       PB2        D10   to the camera
 *     exposure      PB0        D8    ICP1: from the camera
 *     status LED    PB5        D13   never a light: the bootloader blinks it
 *     I2C           PC4, PC5   A4, A5, free for sensors
 *     serial line   PD0, PD1   D0, D1
 */
#ifndef WEFT_FIRMWARE_AVR_PINS_H
#define WEFT_FIRMWARE_AVR_PINS_H

#define AVR_LIGHTS_D 0xfc /* of PORTD */
#define AVR_LIGHTS_C 0x0f /* of PORTC */

#define AVR_PORTD_OF(mask) ((uint8_t)((mask) << 2))
#define AVR_PORTC_OF(mask) ((uint8_t)((mask) >> 6 & AVR_LIGHTS_C))

#define AVR_DIMMING  (1 << 1) /* of PORTB */
#define AVR_EXPOSURE (1 << 0)
#define AVR_TRIGGER  (1 << 2)
#define AVR_STATUS   (1 << 5)

#endif
