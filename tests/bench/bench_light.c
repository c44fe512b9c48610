/*
 * The light controller: how long a command takes to and fro, over the pty and in simulated time alone,
 * against the time that its bytes take on the wire; the size of the firmware, the depth of its stack, the
 * longest time that its interrupts are off.
 */
#include "core/mem.h"
#include "core/progress.h"
#include "firmware/protocol.h"
#include "host/light/controller.h"
#include "host/rig/controller_sim.h"

#include <libgen.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { ROUNDS = 2000, RATE = 500000, BITS_A_BYTE = 10 };

static weft_error error;

static void must(weft_err status)
{
    if (status == WEFT_OK)
        return;
    fprintf(stderr, "bench_light: %s\n", error.text);
    exit(1);
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Sorts. */
static void say(const char *what, double us[ROUNDS], double wire_us)
{
    qsort(us, ROUNDS, sizeof *us, by_size);
    printf("%-28s median %8.1f us, 99 %% %8.1f us, most %8.1f us", what, us[ROUNDS / 2],
           us[ROUNDS * 99 / 100], us[ROUNDS - 1]);
    printf("; median %.2f times its bytes on the wire (%.0f us)\n", us[ROUNDS / 2] / wire_us, wire_us);
}

/* -- simulated time ------------------------------------------------------------------------------------- */

static uint8_t seq;

/* Sends a command and waits for its reply in steps of 1 us.  @return bytes both ways; `us` gets the time */
static size_t exchange(weft_controller_sim *sim, uint8_t command, const uint8_t *payload, uint8_t n,
                       double *us)
{
    weft_frame f = {.version = WEFT_PROTOCOL_MAJOR, .seq = ++seq, .command = command, .n = n}, reply;
    uint8_t wire[WEFT_FRAME_WIRE_MAX];
    memcpy(f.payload, payload, n);
    const size_t sent = weft_frame_encode(&f, wire);
    const double begin_s = weft_controller_sim_time_s(sim);
    weft_controller_sim_send(sim, wire, sent);
    size_t heard = 0;
    for (long i = 0; i < 100000; i++) {
        weft_controller_sim_run(sim, 1);
        if (heard < sizeof wire && weft_controller_sim_receive(sim, wire + heard, 1) == 1 &&
            wire[heard++] == 0) {
            *us = 1e6 * (weft_controller_sim_time_s(sim) - begin_s);
            const bool good = weft_frame_decode(wire, heard - 1, &reply) == WEFT_FRAME_GOOD;
            if (good && reply.type == WEFT_FRAME_REPLY && reply.seq == seq)
                return sent + heard;
            heard = 0; /* an event */
        }
    }
    must(weft_fail(&error, WEFT_ERR_TIMEOUT, "no reply to command 0x%02x", command));
    return 0;
}

static void take_lease(weft_controller_sim *sim)
{
    double us;
    exchange(sim, WEFT_CMD_HELLO, (const uint8_t *)"\1\1\1\2\3\4", WEFT_HELLO_REQUEST_BYTES, &us);
    exchange(sim, WEFT_CMD_LEASE, (const uint8_t *)"\x88\x13", WEFT_LEASE_REQUEST_BYTES, &us);
}

static size_t light_request(uint8_t payload[WEFT_LIGHT_REQUEST_BYTES], int i)
{
    const weft_light_request request = {.mask = (uint16_t)(1u << i % 10), .level = 256, .max_on_ms = 2000};
    weft_light_request_encode(&request, payload);
    return WEFT_LIGHT_REQUEST_BYTES;
}

static void time_commands(weft_controller_sim *sim)
{
    static double status_us[ROUNDS], light_us[ROUNDS];
    size_t status_bytes = 0, light_bytes = 0;
    take_lease(sim);
    for (int i = 0; i < ROUNDS; i++) {
        uint8_t payload[WEFT_LIGHT_REQUEST_BYTES];
        const uint8_t n = (uint8_t)light_request(payload, i);
        weft_controller_sim_run(sim, 100 + i * 37 % 1000); /* anywhere in the firmware's millisecond */
        status_bytes = exchange(sim, WEFT_CMD_STATUS, payload, 0, &status_us[i]);
        light_bytes = exchange(sim, WEFT_CMD_LIGHT, payload, n, &light_us[i]);
    }
    const double byte_us = 1e6 * BITS_A_BYTE / RATE;
    say("STATUS, simulated time", status_us, (double)status_bytes * byte_us);
    say("LIGHT, simulated time", light_us, (double)light_bytes * byte_us);
}

/* -- stack and interrupts ------------------------------------------------------------------------------- */

/* A sequence with a camera under questions, text, noise and a panic. */
static void exercise(weft_controller_sim *sim, int rounds)
{
    uint8_t payload[WEFT_SEQ_SET_REQUEST_BYTES], noise[300], rest[512];
    uint32_t random = 1;
    double us;
    weft_controller_sim_set_camera(sim, 50, 600);
    for (int round = 0; round < rounds; round++) {
        take_lease(sim);
        for (uint8_t i = 0; i < 10; i++) {
            const weft_seq_set_request step = {.index = i,
                                               .mask = (uint16_t)(1u << i),
                                               .level = round & 1 ? 256 : 77,
                                               .settle_us = 100,
                                               .trigger_us = 100,
                                               .hold_mode = i & 1,
                                               .hold_us = 1500,
                                               .gap_us = 100};
            weft_seq_set_request_encode(&step, payload);
            exchange(sim, WEFT_CMD_SEQ_SET, payload, sizeof payload, &us);
        }
        const weft_seq_run_request run = {.first = 0, .count = 10, .run_id = (uint16_t)round};
        weft_seq_run_request_encode(&run, payload);
        exchange(sim, WEFT_CMD_SEQ_RUN, payload, WEFT_SEQ_RUN_REQUEST_BYTES, &us);
        for (int i = 0; i < 10; i++)
            exchange(sim, WEFT_CMD_STATUS, payload, 0, &us);
        for (size_t i = 0; i < sizeof noise; i++)
            noise[i] = (uint8_t)((random = random * 1664525u + 1013904223u) >> 24);
        weft_controller_sim_send(sim, noise, sizeof noise);
        weft_controller_sim_send(sim, (const uint8_t *)"\r?\n\0\0\0\0", 7);
        weft_controller_sim_run(sim, 60e3);
        while (weft_controller_sim_receive(sim, rest, sizeof rest))
            ;
    }
}

static void measure_program(const char *elf)
{
    weft_controller_sim *sim;
    int used, untouched;
    must(weft_controller_sim_create_stepped(elf, &sim, &error));
    weft_controller_sim_run(sim, 3000);
    time_commands(sim);
    if (!weft_controller_sim_paint_stack(sim))
        must(weft_fail(&error, WEFT_ERR_FORMAT, "%s: no symbol _end", elf));
    exercise(sim, 30);
    weft_controller_sim_measure_stack(sim, &used, &untouched);
    (void)weft_controller_sim_longest_lock(sim);
    exercise(sim, 3);
    const double lock_us = weft_controller_sim_longest_lock(sim) / 16.0, byte_us = 1e6 * BITS_A_BYTE / RATE;
    printf("stack: %d bytes at its deepest, %d of the free RAM never touched\n", used, untouched);
    printf(
        "interrupts off for %.1f us at most: %.2f of a byte on the wire, of which the receiver holds two\n",
        lock_us, lock_us / byte_us);
    weft_controller_sim_destroy(sim);
}

/* -- the pty -------------------------------------------------------------------------------------------- */

static void time_client(const char *elf)
{
    static double us[ROUNDS];
    char pty[128];
    weft_controller_sim *sim;
    weft_controller *c;
    must(weft_controller_sim_create(elf, &sim, pty, &error));
    must(weft_controller_open(pty, 5000, &c, &error));
    for (int i = 0; i < ROUNDS; i++) {
        const double begin_s = weft_clock_s();
        must(weft_controller_keep_alive(c, &error));
        us[i] = 1e6 * (weft_clock_s() - begin_s);
    }
    const double bytes = 8 + 8 + 1 + WEFT_STATUS_REPLY_BYTES; /* two frames of 8 without payload */
    say("STATUS, client over the pty", us, bytes * 1e6 * BITS_A_BYTE / RATE);
    weft_controller_close(c);
    weft_controller_sim_destroy(sim);
}

int main(void)
{
    char self[PATH_MAX], elf[PATH_MAX + 64], command[PATH_MAX + 128];
    const ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
    if (n <= 0)
        return 1;
    self[n] = '\0';
    snprintf(elf, sizeof elf, "%s/../firmware/weft-firmware.elf", dirname(self));
    measure_program(elf);
    time_client(elf);
    snprintf(command, sizeof command, "avr-size '%s'", elf);
    fflush(stdout);
    return system(command) == 0 ? 0 : 1; /* NOLINT(cert-env33-c): a path of the build, for a person to read */
}
