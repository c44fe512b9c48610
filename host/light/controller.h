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
    int max_on_ms; /* the longest time that one weft_controller_light() may ask for */
    uint32_t tick_hz;
    uint32_t boot_nonce;
    uint32_t capabilities; /* WEFT_CAPABILITY_* */
    int max_steps;         /* longest sequence; 0: none */
    const char *settings;  /* "DEFAULTS", "LOADED", "UNREADABLE" */
    char reset_cause[32];  /* "POWER_ON", "WATCHDOG", ... */
    int baud;              /* 500000, or 38400 for firmware that was built for bad cables */
} weft_controller_info;

typedef struct weft_controller_status {
    const char *state;      /* "BOOT", "SAFE", "IDLE", "LIT", "RUNNING", "FAULT" */
    const char *safe_cause; /* "NONE", "LEASE_EXPIRED", "PANIC", "RELEASED" */
    uint32_t lights;        /* bit i: light i is on */
    int level;
    uint32_t ticks;
    int lease_left_ms;
    int on_left_ms;                                /* until the lights go off by themselves */
    uint32_t frames, crc_errors, overruns, resets; /* as the board counts them since its reset */
    uint32_t max_on_offs;                          /* times that lights went off by their time limit */
    uint32_t retries, bad_replies;                 /* as this host counts them since opening */
} weft_controller_status;

/** Opens the port exclusively, shakes hands (waits out a bootloader for 3 s) and takes a lease.
 *  @param port      "/dev/ttyACM0", or "serial:WL-00042" for the board with that number on whatever port
 *  @param lease_ms  the lights go off when the host is silent for that long; 100..5000
 *  @return WEFT_ERR_DEVICE (no such port, no permission, in use, unplugged), _TIMEOUT (nobody answers),
 *          _PROTOCOL (something else answers, or firmware of another version) with port and remedy */
weft_err weft_controller_open(const char *port, int lease_ms, weft_controller **controller, weft_error *err);

/** The same with another folder than /dev to look for serial numbers in, now and in weft_controller_reopen().
 */
weft_err weft_controller_open_under(const char *dev, const char *port, int lease_ms,
                                    weft_controller **controller, weft_error *err);

/** Whether its port has vanished: the cable is out.  Its lights go off by the end of the lease. */
bool weft_controller_is_gone(const weft_controller *controller);

/**
 * Looks for the board again, on whatever port, by its serial number, until timeout_s from now; then shakes
 * hands and takes the lease anew.  What was going on is void: lights are off, the sequence table is empty.
 *
 * @return WEFT_ERR_DEVICE when it did not come back, or with other settings: then only close it, or try
 * again; WEFT_ERR_CANCELLED
 */
weft_err weft_controller_reopen(weft_controller *controller, double timeout_s, weft_error *err);

/** Lights off, lease given back (by the panic bytes when the board does not answer), port closed.  NULL is
 *  fine. */
void weft_controller_close(weft_controller *controller);

const weft_controller_info *weft_controller_get_info(const weft_controller *controller);

/**
 * Turns on exactly the lights of `mask` at `level` (0..level_max) for at most max_on_ms (to a millisecond, on
 * the short side).  Asking again for what is on begins the time anew without a gap.
 *
 * @param max_on_ms  1 .. info->max_on_ms
 * @param on_tick    gets the board's clock when they went on (info->tick_hz); NULL is fine
 * @return WEFT_ERR_RANGE; WEFT_ERR_DEVICE when the board has reset or went dark by itself meanwhile;
 *         WEFT_ERR_TIMEOUT
 */
weft_err weft_controller_light(weft_controller *controller, uint32_t mask, int level, int max_on_ms,
                               uint32_t *on_tick, weft_error *err);
/** All lights off.  off_tick may be NULL. */
weft_err weft_controller_off(weft_controller *controller, uint32_t *off_tick, weft_error *err);
/** What the board is doing.  @return WEFT_ERR_DEVICE when it has reset since it was opened */
weft_err weft_controller_get_status(weft_controller *controller, weft_controller_status *status,
                                    weft_error *err);
/** Renews the lease: call at least every lease_ms / 3 while waiting for something else.
 *  @return WEFT_ERR_DEVICE when the board has reset or went dark by itself meanwhile */
weft_err weft_controller_keep_alive(weft_controller *controller, weft_error *err);

/* -- sequences (controller_sequence.c) */

/** A step, as docs/protocol.md draws it; all times are kept to 4 us. */
typedef struct weft_controller_step {
    uint32_t lights;     /* bit i: light i; 0 for a dark frame */
    int level;           /* 0..info->level_max */
    uint32_t settle_us;  /* lights on to trigger; 0..250 000 */
    uint32_t trigger_us; /* pulse; 0 (none), 20..250 000 */
    uint32_t hold_us;    /* trigger to lights off, or the longest wait; 100.. */
    bool until_exposure; /* lights go off when the exposure line falls */
    uint32_t gap_us;     /* dark behind it; 0..10 000 000 */
} weft_controller_step;

/** What a step has been; times in ticks of the board (info->tick_hz). */
typedef struct weft_controller_step_result {
    int index;
    bool rose, fell; /* the exposure line, after the trigger and before lights off */
    uint32_t on_tick, trigger_tick, rise_tick, fall_tick, off_tick; /* rise, fall: only if rose, fell */
} weft_controller_step_result;

/** Whether the exposure line proves that these lights covered the exposure, settled. */
bool weft_controller_step_is_proved(const weft_controller_info *info, const weft_controller_step *step,
                                    const weft_controller_step_result *result);

/**
 * Runs n steps in the board and waits for their end, keeping the lease.  When cancelled (core/progress.h) the
 * sequence is aborted.
 *
 * @param n        1 .. info->max_steps
 * @param results  n of them
 * @return WEFT_ERR_RANGE; WEFT_ERR_UNSUPPORTED by firmware without sequences; WEFT_ERR_DEVICE when the camera
 *         does not expose as it should, the board has reset or went dark; WEFT_ERR_PROTOCOL when what it
 * tells is not complete; WEFT_ERR_CANCELLED; always dark then
 */
weft_err weft_controller_run_sequence(weft_controller *controller, const weft_controller_step *steps, int n,
                                      weft_controller_step_result *results, weft_error *err);

/* -- settings of the board (controller_settings.c) */

/** Reads a setting: WEFT_KEY_*, `index` of the light for a trim.  @param value  8 bytes, see protocol.def */
weft_err weft_controller_get_setting(weft_controller *controller, int key, int index, uint8_t value[8],
                                     weft_error *err);
/** Stores a setting in the EEPROM; no light may be on.  The sequence table is empty afterwards; info is
 *  that of the next opening.
 *  @return WEFT_ERR_RANGE when the board refuses the value, WEFT_ERR_DEVICE when it cannot be stored */
weft_err weft_controller_set_setting(weft_controller *controller, int key, int index, const uint8_t value[8],
                                     weft_error *err);

/** File descriptor for the panic bytes: write(fd, "\0\0\0", 3) is async-signal-safe. */
int weft_controller_panic_fd(const weft_controller *controller);

/** From now until it is closed, a crash of this program (SIGSEGV, SIGABRT and the like, also a hang-up of the
 *  terminal) darkens the lights of this controller at once instead of at the end of the lease.  One
 * controller per process; whatever handled these signals before still gets them. */
void weft_controller_panic_on_crash(const weft_controller *controller);

/** Candidate ports on this machine, best first, as a NULL-ended list; free with weft_controller_free_ports().
 *  First those that the udev rules of Weft name, then boards by their maker, then any serial USB device. */
weft_err weft_controller_list_ports(char ***ports, weft_error *err);
/** The same for a folder that is laid out like /dev. */
weft_err weft_controller_list_ports_under(const char *dev, char ***ports, weft_error *err);
void weft_controller_free_ports(char **ports);

#endif
