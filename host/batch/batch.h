/**
 * Many sets at once, each solved by a process of its own: here, or as a Slurm job array (docs/batch.md).
 *
 * Everything that is known of a batch stands in its folder, so that any run can go on where any other was
 * stopped, whatever stopped it:
 *
 *     DIR/NAME.maps/            the maps of a set, put there whole, with their stamp `batch.json`
 *     DIR/batch/NAME-KEY.maps/  maps that are solved but not yet put in place
 *     DIR/batch/NAME.failed     why a set could not be solved, JSON
 *     DIR/batch/NAME.lock       held by the process that works on a set
 *     DIR/batch/events.jsonl    what happened when, a line each
 *     DIR/report.html, .json
 *
 * The key of a set is the SHA-256 of everything that its maps follow from.  Maps with the right key are
 * never solved again; maps with another key are replaced only with --force.
 */
#ifndef WEFT_HOST_BATCH_BATCH_H
#define WEFT_HOST_BATCH_BATCH_H

#include "core/error.h"

#include <jansson.h>
#include <stdbool.h>

typedef enum weft_batch_state {
    WEFT_BATCH_WAITING, /* to be solved */
    WEFT_BATCH_SOLVED,  /* in this run */
    WEFT_BATCH_KEPT,    /* its maps were there */
    WEFT_BATCH_FAILED,
} weft_batch_state;

typedef struct weft_batch_item {
    char *set;  /* absolute path */
    char *name; /* of NAME.set */
    char key[65];
    weft_batch_state state;
    double memory;    /* estimate of what solving takes, bytes; 0 unknown */
    int attempts;     /* how often it was begun in this run */
    char error[1024]; /* of a failed one */
    json_t *stamp;    /* of its maps, when they are there; else NULL */
} weft_batch_item;

typedef struct weft_batch {
    char *folder, *calibration; /* absolute paths */
    int n_options;
    const char *const *options; /* "method=lsq": of weft solve; borrowed */
    bool force;                 /* maps of another key are replaced */
    int lock;                   /* on the folder; -1 in workers */
    int n_items;
    weft_batch_item *items;
} weft_batch;

/** Solves one set: writes maps as the folder `maps`, which is not there.  Runs in the worker's process. */
typedef weft_err weft_batch_solve_fn(void *context, const char *set, const char *maps, weft_error *err);

/**
 * Makes DIR and DIR/batch, names the sets, takes their keys and looks what is there already.
 *
 * A set that cannot be read becomes a failed item and stops nothing.
 *
 * @param options  borrowed
 * @param worker   one of the processes of a batch; else the folder is locked
 * @return WEFT_ERR_EXISTS when another batch works there, for two sets of one name, or maps of another key
 * without `force`; what reading the calibration says; WEFT_ERR_IO
 */
weft_err weft_batch_init(weft_batch *batch, const char *const *sets, int n_sets, const char *calibration,
                         const char *folder, const char *const *options, int n_options, bool force,
                         bool worker, weft_error *err);
void weft_batch_fini(weft_batch *batch);

/** Looks into the folder: whether an item's maps are there, or why not.  Waiting ones become solved or
 *  failed; others stay as they are. */
void weft_batch_look(const weft_batch *batch, weft_batch_item *item);

int weft_batch_count(const weft_batch *batch, weft_batch_state state);

/** The key of a set: the SHA-256 of the program's version, the options in the order of the alphabet,
 *  calibration.json, the grid of gains, set.json, and the frames and mask (by the hashes that set.json
 *  records, which are checked whenever a frame is read, or by their bytes).
 *  @param memory  gets the estimate of what solving takes, bytes; may be NULL */
weft_err weft_batch_key(const char *set, const char *calibration, const char *const *options, int n_options,
                        char key[65], double *memory, weft_error *err);

/** Paths inside the folder, on the heap. */
char *weft_batch_maps_path(const weft_batch *batch, const char *name, weft_error *err);
char *weft_batch_side_path(const weft_batch *batch, const char *name, const char *suffix, weft_error *err);

/** Reads the stamp of maps; NULL when there is none. */
json_t *weft_batch_read_stamp(const char *maps);

/**
 * The worker: solves the only item of the batch and puts its maps in place.
 *
 * Waits while another process works on the same set.  Leaves maps with a stamp, or NAME.failed; cancelled or
 * killed, neither.
 *
 * @param key  what the batch was planned with
 * @return what solving says; WEFT_ERR_MISMATCH when the inputs have changed since
 */
weft_err weft_batch_task(weft_batch *batch, const char *key, weft_batch_solve_fn *solve, void *context,
                         weft_error *err);

/** Words of the command line that works on item `i`: `weft batch SET -c CAL -o DIR --task KEY ...`, on the
 *  heap, ends with NULL; weft_free() the array alone. */
char **weft_batch_task_words(const weft_batch *batch, int i, weft_error *err);

/** This machine, or the Slurm node that the process runs on. */
void weft_batch_host(char host[256]);

/**
 * Works on all waiting items in `jobs` processes (0: as many as cores and memory allow).
 * @return WEFT_ERR_CANCELLED after Ctrl-C, when all processes have ended; failures of sets are in the items
 */
weft_err weft_batch_run_here(weft_batch *batch, int jobs, weft_error *err);

/**
 * The same through Slurm: submits the waiting items as one array, or joins the array that an earlier run
 * submitted, waits, and submits again what ended without a result.
 *
 * @param jobs   most tasks at a time; 0: Slurm's own choice
 * @param words  more words for sbatch
 * @return WEFT_ERR_CANCELLED after Ctrl-C: the array goes on without us; WEFT_ERR_MISSING without sbatch
 */
weft_err weft_batch_run_slurm(weft_batch *batch, int jobs, const char *const *words, int n_words,
                              weft_error *err);

/** Everything about the batch as one JSON object; NULL without memory. */
json_t *weft_batch_report(const weft_batch *batch, double seconds);
/** Writes report.json and report.html into the folder. */
weft_err weft_batch_report_save(const weft_batch *batch, const json_t *report, weft_error *err);

/** Appends a line to events.jsonl; the object is released.  Failure to do so is no failure of the batch. */
void weft_batch_event(const weft_batch *batch, const char *event, const char *name, const char *key);

#endif
