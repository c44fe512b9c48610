#!/usr/bin/env bash
# The bound of the firmware's stack, and that what has no bound, or a higher one, is refused.
set -u
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
elf=$WEFT_TEST_BUILD/firmware/weft-firmware.elf
most=$(sed -n 's/^#define FW_STACK_BYTES \(.*\)/\1/p' "$WEFT_TEST_SOURCE/firmware/fw_config.h")
# shellcheck disable=SC2317 # by expect
bound() { python3 "$WEFT_TEST_SOURCE/tests/firmware/stack_bound.py" "$@"; }
expect 0 'stack: ' bound "$elf" --table commands:5:3 --quiet 0x6f,0x70 --most "$most" # TIMSK1 and TIMSK2
cat out
expect 1 'more than 100 bytes' bound "$elf" --table commands:5:3 --quiet 0x6f,0x70 --most 100
expect 1 'a call of what only the running program knows' bound "$elf" --quiet 0x6f,0x70
expect 1 'no table nothing' bound "$elf" --table nothing:5:3
expect 1 'lets in others like it: 0x6e' bound "$elf" --table commands:5:3 --quiet 0x6e

# program WORDS SOURCE: what is said of a program
program() {
    printf '#include <avr/interrupt.h>\nvolatile char v;\n%s\n' "$3" >p.c
    avr-gcc -mmcu=atmega328p -std=c11 -Os -ffunction-sections -Wl,--gc-sections p.c -o p.elf || exit 1
    expect "$1" "$2" bound p.elf "${@:4}"
}
# By hand: crt calls main (2), main calls f (2), which keeps 20 bytes and r28, r29.  The interrupt: its return
# address, r0, r1, SREG and r24.
program 0 'stack: 32 bytes at most: 26 of the program, 0 and 6 of interrupts' '
    __attribute__((noinline, noclone)) void f(void) { volatile char room[20]; room[v & 15] = 1; v = room[3]; }
    ISR(USART_RX_vect) { v++; }
    int main(void) { for (;;) { f(); v++; } }'
program 1 'calls itself' '
    __attribute__((noinline, noclone)) int f(int n) { if (n > 0) v = f(n - v) + f(n + v); return v; }
    int main(void) { return f(v) + v; }'
program 1 'moves the stack pointer by what is no constant' '
    __attribute__((noinline, noclone)) void f(int n) { volatile char room[n]; room[0] = v; }
    int main(void) { f(v); v++; return v; }'
program 1 'a call of what only the running program knows' '
    void (*volatile at)(void);
    int main(void) { at(); v++; return v; }'
program 1 'lets in others like it: 0x6f' '
    ISR(TIMER1_CAPT_vect) { sei(); v++; cli(); }
    int main(void) { for (;;) ; }' --quiet 0x6f
exit 0
