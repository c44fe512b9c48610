/* The worker: one set, from its key to its maps in place. */
#include "host/batch/batch.h"

#include "core/file.h"
#include "core/json.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/version.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <time.h>
#include <unistd.h>

/* One process works on a set at a time, here and (where the file system knows locks) on a cluster. */
static weft_err lock_item(const weft_batch *batch, const weft_batch_item *item, int *lock, weft_error *err)
{
    char *const path = weft_batch_side_path(batch, item->name, ".lock", err);
    if (!path)
        return WEFT_ERR_NOMEM;
    *lock = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    weft_err status = WEFT_OK;
    if (*lock < 0)
        status = weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be written", path);
    bool told = false;
    while (status == WEFT_OK && flock(*lock, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
        if (!told)
            weft_note("%s: another process works on this set: waiting", item->name);
        told = true;
        if (weft_cancelled())
            status = weft_fail(err, WEFT_ERR_CANCELLED, "cancelled");
        nanosleep(&(struct timespec){.tv_nsec = 200000000}, NULL);
    }
    weft_free(path);
    return status;
}

/* What a killed solve of this set has left: unfinished folders, and maps of other keys. */
static void sweep(const weft_batch *batch, const weft_batch_item *item)
{
    char unfinished[512], prefix[512], suffix[32];
    char *const folder = weft_path_join(batch->folder, "batch", NULL);
    DIR *const dir = folder ? opendir(folder) : NULL;
    snprintf(prefix, sizeof prefix, "%s-", item->name);
    snprintf(unfinished, sizeof unfinished, ".weft-%s-", item->name);
    snprintf(suffix, sizeof suffix, "-%.16s.maps", item->key);
    for (const struct dirent *e = dir ? readdir(dir) : NULL; e; e = readdir(dir)) {
        const size_t n = strlen(e->d_name), at = strlen(item->name);
        const bool of_key = n == at + strlen(suffix) && strcmp(e->d_name + at, suffix) == 0;
        const bool maps = strncmp(e->d_name, prefix, strlen(prefix)) == 0 && n == at + strlen(suffix) &&
                          weft_path_has_suffix(e->d_name, ".maps") && !of_key;
        const bool part = strncmp(e->d_name, unfinished, strlen(unfinished)) == 0 &&
                          strncmp(e->d_name + strlen(unfinished) + 16, ".maps-", 6) == 0;
        char *const path = maps || part ? weft_path_join(folder, e->d_name, NULL) : NULL;
        if (path)
            (void)weft_folder_remove(path, NULL);
        weft_free(path);
    }
    if (dir)
        closedir(dir);
    weft_free(folder);
}

static weft_err write_stamp(const weft_batch *batch, const weft_batch_item *item, const char *maps,
                            const char *begun, double seconds, weft_error *err)
{
    char finished[32], host[256];
    weft_time_now_iso(finished);
    weft_batch_host(host);
    json_t *const options = json_array();
    for (int i = 0; i < batch->n_options; i++)
        json_array_append_new(options, json_string(batch->options[i]));
    json_t *const stamp = json_pack(
        "{s:s, s:i, s:s, s:s, s:s, s:o, s:s, s:s, s:s, s:f, s:s}", "weft", "batch-stamp", "version", 1, "key",
        item->key, "set", item->set, "calibration", batch->calibration, "options", options, "software",
        "weft " WEFT_VERSION, "begun", begun, "finished", finished, "seconds", seconds, "host", host);
    char *const path = weft_path_join(maps, "batch.json", err);
    weft_err status = WEFT_ERR_NOMEM;
    if (stamp && path)
        status = weft_json_save(path, stamp, err);
    weft_free(path);
    json_decref(stamp);
    return status;
}

/* Solved maps, stamped or not yet, become NAME.maps. */
static weft_err put_in_place(const weft_batch *batch, const weft_batch_item *item, const char *solved,
                             weft_error *err)
{
    weft_atomic a = {.final_path = weft_batch_maps_path(batch, item->name, err),
                     .temp_path = weft_strdup(solved, err)};
    if (!a.final_path || !a.temp_path) {
        weft_free(a.final_path);
        weft_free(a.temp_path);
        return WEFT_ERR_NOMEM;
    }
    return weft_atomic_commit(&a, err);
}

static weft_err solve_and_place(const weft_batch *batch, const weft_batch_item *item,
                                weft_batch_solve_fn *solve, void *context, weft_error *err)
{
    char suffix[32], begun[32];
    const double clock = weft_clock_s();
    snprintf(suffix, sizeof suffix, "-%.16s.maps", item->key);
    weft_time_now_iso(begun);
    char *const solved = weft_batch_side_path(batch, item->name, suffix, err);
    if (!solved)
        return WEFT_ERR_NOMEM;
    weft_err status = WEFT_OK;
    if (!weft_folder_exists(solved)) { /* else: an earlier worker was killed right behind solving */
        weft_batch_event(batch, "begin", item->name, item->key);
        status = solve(context, item->set, solved, err);
        if (status == WEFT_OK)
            weft_batch_event(batch, "solved", item->name, item->key);
    }
    if (status == WEFT_OK)
        status = write_stamp(batch, item, solved, begun, weft_clock_s() - clock, err);
    if (status == WEFT_OK)
        status = put_in_place(batch, item, solved, err);
    weft_free(solved);
    return status;
}

static void note_failure(const weft_batch *batch, const weft_batch_item *item, const weft_error *why)
{
    char when[32];
    weft_time_now_iso(when);
    json_t *const failure = json_pack("{s:s, s:s, s:s, s:s}", "key", item->key, "when", when, "code",
                                      weft_err_name(why->code), "error", why->text);
    char *const path = weft_batch_side_path(batch, item->name, ".failed", NULL);
    if (failure && path && weft_json_save(path, failure, NULL) != WEFT_OK)
        weft_warn("%s cannot be written", path);
    weft_free(path);
    json_decref(failure);
    weft_batch_event(batch, "failed", item->name, item->key);
}

static void forget_failure(const weft_batch *batch, const weft_batch_item *item)
{
    char *const path = weft_batch_side_path(batch, item->name, ".failed", NULL);
    if (path)
        (void)unlink(path);
    weft_free(path);
}

weft_err weft_batch_task(weft_batch *batch, const char *key, weft_batch_solve_fn *solve, void *context,
                         weft_error *err)
{
    weft_batch_item *const item = &batch->items[0];
    weft_error why = {0};
    int lock = -1;
    if (item->state == WEFT_BATCH_KEPT)
        return WEFT_OK;
    weft_err status = lock_item(batch, item, &lock, err);
    if (status != WEFT_OK)
        return status;
    if (strcmp(item->key, key) != 0) {
        if (item->state != WEFT_BATCH_FAILED)
            snprintf(item->error, sizeof item->error,
                     "%s or the calibration has changed since the batch began: run weft batch again",
                     item->set);
        snprintf(item->key, sizeof item->key, "%s", key); /* the record is for the batch that waits */
        status = weft_fail(&why, WEFT_ERR_MISMATCH, "%s", item->error);
    } else {
        weft_batch_look(batch, item);
        if (item->state != WEFT_BATCH_SOLVED) { /* else by the process that held the lock */
            forget_failure(batch, item);
            sweep(batch, item);
            status = solve_and_place(batch, item, solve, context, &why);
        }
    }
    if (status != WEFT_OK && status != WEFT_ERR_CANCELLED)
        note_failure(batch, item, &why);
    if (lock >= 0)
        close(lock);
    return status == WEFT_OK ? status : weft_fail(err, status, "%s", why.text);
}
