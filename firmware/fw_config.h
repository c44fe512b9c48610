/**
 * Every choice of the firmware, with its unit, range and reason.
 */
#ifndef WEFT_FIRMWARE_FW_CONFIG_H
#define WEFT_FIRMWARE_FW_CONFIG_H

#define FW_VERSION_MAJOR 1
#ifndef FW_VERSION_MINOR /* a test builds an older one */
#define FW_VERSION_MINOR 1
#endif
#define FW_VERSION_PATCH 0

#define FW_TEXT_(x)      #x
#define FW_TEXT(x)       FW_TEXT_(x)
#define FW_VERSION_TEXT  FW_TEXT(FW_VERSION_MAJOR) "." FW_TEXT(FW_VERSION_MINOR) "." FW_TEXT(FW_VERSION_PATCH)
#define FW_PROTOCOL_TEXT FW_TEXT(WEFT_PROTOCOL_MAJOR) "." FW_TEXT(WEFT_PROTOCOL_MINOR)

/** Source the build was made from; eight characters of the commit, set by the build. */
#ifndef FW_GIT_ID
#define FW_GIT_ID "unknown"
#endif

/** Hz; the crystal of an Arduino Uno. */
#define FW_CPU_HZ 16000000ul

/** Bits per second, 8N1.  500 000 divides 16 MHz exactly and is an ordinary termios constant; 115 200
 *  would be off by 2.1 %.  38400 is the fallback for long or bad cables. */
#ifndef FW_BAUD
#define FW_BAUD 500000ul
#endif

/** USART divisor in double-speed mode (U2X). */
#define FW_UBRR ((FW_CPU_HZ + 4 * FW_BAUD) / (8 * FW_BAUD) - 1)

/** The board has ten lights: bits 0..5 on PD2..PD7, bits 6..9 on PC0..PC3. */
#define FW_N_LIGHTS 10

/** Steps of the dimming PWM; full is no PWM at all.  256 steps of one 16 MHz cycle: 62.5 kHz, so that a
 *  10 ms exposure that is not in step with it errs by at most 0.16 %. */
#define FW_LEVEL_MAX 256

/** ms; longest that one LIGHT or step may keep lights on, whatever the settings say.  Longer light means that
 * the host is there to ask again. */
#define FW_MAX_ON_MS 2000

/** ms; range of leases.  Shorter than 100 trips on an ordinary computer's pauses, longer than 5 s is no
 *  protection. */
#define FW_LEASE_MIN_MS 100
#define FW_LEASE_MAX_MS 5000

/** Hz of the tick: TIMER0 with prescaler 64; 4 us each, wraps after 4.8 hours. */
#define FW_TICK_HZ    250000ul
#define FW_TICKS_A_MS 250

/** Bytes, powers of two up to 128.  One frame is 56 bytes at most and one command is under way, so 128
 *  holds a request behind a repeated one, and a reply behind an event. */
#define FW_RX_RING 128
#define FW_TX_RING 128

/** Bytes that the stack may need at its deepest, interrupts and all: tests/firmware/stack_bound.py finds the
 * bound in the machine code, and check_size.cmake leaves it 1024. */
#define FW_STACK_BYTES 400

/** us of a tick; a power of two, so that dividing by it is a shift. */
#define FW_US_A_TICK 4

/** Longest sequence: ten lights, a dark frame and some to spare, in 20 bytes of RAM each. */
#define FW_MAX_STEPS 16

/** Steps that have ended, or run, and that the host has not been told of; a power of two. */
#define FW_STEP_RING 4

/** us; ranges of a step's times.  Settling and pulse are kept in 16 bits of ticks; a shorter hold than 100
 *  would end before its own edges are done. */
#define FW_SETTLE_MAX_US 250000ul
#define FW_HOLD_MIN_US   100
#define FW_PULSE_MIN_US  20
#define FW_GAP_MAX_US    10000000ul

/** From SEQ_RUN to the first lights. */
#define FW_START_TICKS 25

/* -- impossible choices -------------------------------------------------------------------------------- */

#define FW_REAL_BAUD (FW_CPU_HZ / (8 * (FW_UBRR + 1)))
#if FW_REAL_BAUD * 200 > FW_BAUD * 201 || FW_REAL_BAUD * 200 < FW_BAUD * 199
#error "FW_BAUD is more than 0.5 % off with this crystal: take 500000, 250000 or 38400"
#endif
#if FW_US_A_TICK * FW_TICK_HZ != 1000000 || FW_STEP_RING & (FW_STEP_RING - 1)
#error "a tick must be a power of two of microseconds, the ring of steps a power of two long"
#endif
#if FW_SETTLE_MAX_US / FW_US_A_TICK > 65535 || FW_MAX_STEPS > 64
#error "settling and trigger pulses are kept in 16 bits of ticks"
#endif
#if FW_RX_RING & (FW_RX_RING - 1) || FW_TX_RING & (FW_TX_RING - 1) || FW_RX_RING > 128 || FW_TX_RING > 128
#error "the rings are indexed by masking a byte: powers of two up to 128"
#endif
#if FW_N_LIGHTS > 10
#error "an Uno has pins for ten lights: the rest of its pins belong to the serial line, trigger and I2C"
#endif
#if FW_MAX_ON_MS > 30000 || FW_LEASE_MAX_MS > 30000
#error "milliseconds are compared in 16 bits: at most 30000"
#endif
#if FW_CPU_HZ / 64 != FW_TICK_HZ || FW_TICK_HZ != FW_TICKS_A_MS * 1000ul
#error "the tick is TIMER0 with prescaler 64: it must divide the millisecond"
#endif

#endif
