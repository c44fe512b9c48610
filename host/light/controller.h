/**
 * The light controller on its serial line: the host's side of firmware/protocol.h.
 *
 * Every call has a deadline and retries by the protocol's cached-reply rule; a board that reset in
 * between is noticed by its boot nonce and reported as WEFT_ERR_DEVICE.  One thread per controller,
 * except weft_controller_panic_fd(), which is safe in a signal handler.
 */
#ifndef WEFT_HOST_LIGHT_CONTROLLER_H
#define WEFT_HOST_LIGHT_CONTROLLER_H

#include "core/error.h"
#include "firmware/protocol.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct weft_controller weft_controller;

/** What HELLO told. */
typedef struct weft_controller_info {
    char port[256];
    char firmware[32]; /* "1.0.0" */
    char git_id[16];
    char serial_number[32];
    int protocol_major, protocol_minor;
    int n_lights;
    int level_max; /* PWM steps: level 0..level_max */
    uint32_t tick_hz;
    uint32_t boot_nonce;
    uint32_t capabilities;
    char reset_cause[32];
} weft_controller_info;

typedef struct weft_controller_status {
    const char *state; /* "BOOT", "SAFE", "IDLE", "LIT", "RUNNING", "FAULT" */
    uint32_t lights;   /* bit i: light i is on */
    int level;
    uint32_t ticks;
    int lease_left_ms;
    uint32_t frames, crc_errors, overruns, resets;
} weft_controller_status;

/** Opens the port exclusively, shakes hands (waits out a bootloader for 3 s) and takes a lease.
 *  @param lease_ms  the lights go off when the host is silent for that long; 100..5000
 *  @return WEFT_ERR_DEVICE, _TIMEOUT, _PROTOCOL with port and remedy */
weft_err weft_controller_open(const char *port, int lease_ms, weft_controller **controller, weft_error *err);

/** Lights off, lease given back, port closed.  NULL is fine. */
void weft_controller_close(weft_controller *controller);

const weft_controller_info *weft_controller_get_info(const weft_controller *controller);

/** Turns on exactly the lights of `mask` at `level` (0..level_max) for at most max_on_ms. */
weft_err weft_controller_light(weft_controller *controller, uint32_t mask, int level, int max_on_ms,
                               uint32_t *on_tick, weft_error *err);
weft_err weft_controller_off(weft_controller *controller, uint32_t *off_tick, weft_error *err);
weft_err weft_controller_get_status(weft_controller *controller, weft_controller_status *status,
                                    weft_error *err);
/** Renews the lease: call at least every lease_ms / 3 while waiting for something else. */
weft_err weft_controller_keep_alive(weft_controller *controller, weft_error *err);

/** File descriptor for the panic bytes: write(fd, "\0\0\0", 3) is async-signal-safe. */
int weft_controller_panic_fd(const weft_controller *controller);

/** Candidate ports on this machine, best first, as a NULL-ended list; free with weft_controller_free_ports().
 */
weft_err weft_controller_list_ports(char ***ports, weft_error *err);
void weft_controller_free_ports(char **ports);

#endif
