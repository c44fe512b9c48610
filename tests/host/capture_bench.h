/**
 * A scanner on the bench for tests of the capture engine: the real firmware on a simulated board behind its
 * serial line, and a camera that sees the lamps which that firmware has on, and fails when it is told to.
 */
#ifndef WEFT_TESTS_CAPTURE_BENCH_H
#define WEFT_TESTS_CAPTURE_BENCH_H

#include "host/capture/capture.h"
#include "host/rig/controller_sim.h"

enum { WIDTH = 64, HEIGHT = 48, N_LIGHTS = WEFT_SIM_N_LIGHTS, LEASE_MS = 800 };
#define BLACK 100
#define WHITE 4095

/* What the camera does at an exposure. */
typedef enum deed { WORK, LOSE_PACKETS, SEND_NOTHING, DIE, CANCEL_IT, RESET_BOARD, ACT } deed;

typedef struct capture_bench {
    weft_controller_sim *sim;
    weft_controller *controller;
    weft_camera_device *camera;
    const char *serial;       /* of the camera */
    double room, power;       /* share of the range per second: of the room, of a lamp */
    uint32_t broken_lamps;    /* these stay dark */
    uint32_t faint_lamps;     /* these have a fifth of the power */
    bool slow;                /* waits as a long exposure does, calling idle */
    int n_exposures, deed_at; /* the deed is done at that exposure (counted from 0) and n_deeds on */
    int n_deeds;
    deed deed;
    void (*act)(void);            /* what ACT does; the exposure goes on after it */
    uint32_t lit_before_end[256]; /* lamps that were on at each exposure */
} capture_bench;

extern capture_bench bench;

/** What the camera was told last. */
extern weft_camera_settings bench_set;
/** The board's serial line. */
extern char pty[128];

/** What the camera sees at a photosite with the lamps on for these shares of the exposure, and what that
 * gives there. */
double light_at(const double on[N_LIGHTS], int u, int v);
uint16_t sample_at(double light, weft_cfa cfa, int u, int v);

/** A camera like that of set_up(), with bench.serial. */
void open_bench_camera(void);

/** Set-up and tear-down of a test. */
int set_up(void **state);
int tear_down(void **state);

/** Has the camera do this at the exposure `at` from now, n times. */
void plan_deed(deed what, int at, int n);

/** A capture, after which the lamps are dark whatever happened. */
weft_err run(const weft_capture_options *options, weft_set *set, weft_capture_report *report,
             weft_error *err);
void run_well(const weft_capture_options *options, weft_capture_report *report);

/** Every file of the folder is set.json, a frame in it with the recorded hash, or a sidecar where the set has
 *  them. */
void check_folder(const char *folder, int n_frames, bool complete);

#endif
