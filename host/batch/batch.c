#include "host/batch/batch.h"

#include "calibration/calibration.h"
#include "core/file.h"
#include "core/json.h"
#include "core/mem.h"

#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

/* ---- names and paths ---- */

/* NAME of NAME.set: the last component of the folder without its suffix, on the heap. */
static char *name_of(const char *folder, weft_error *err)
{
    const char *const last = weft_path_name(folder);
    const size_t n = strlen(last);
    const size_t cut = n > 4 && strcmp(last + n - 4, ".set") == 0 ? n - 4 : n;
    return weft_asprintf(err, "%.*s", (int)cut, last);
}

/* Absolute and without links, as the nodes of a cluster and later runs see it; what is not there stays as it
 * is, only absolute. */
static char *absolute(const char *path, weft_error *err)
{
    char real[PATH_MAX];
    if (realpath(path, real))
        return weft_strdup(real, err);
    if (path[0] == '/' || !getcwd(real, sizeof real))
        return weft_strdup(path, err);
    return weft_path_join(real, path, err);
}

char *weft_batch_maps_path(const weft_batch *batch, const char *name, weft_error *err)
{
    return weft_asprintf(err, "%s/%s.maps", batch->folder, name);
}

char *weft_batch_side_path(const weft_batch *batch, const char *name, const char *suffix, weft_error *err)
{
    return weft_asprintf(err, "%s/batch/%s%s", batch->folder, name, suffix);
}

void weft_batch_host(char host[256])
{
    const char *const node = getenv("SLURMD_NODENAME");
    host[0] = host[255] = '\0';
    if (node)
        snprintf(host, 256, "%s", node);
    else
        (void)gethostname(host, 255);
}

/* ---- what is there ---- */

json_t *weft_batch_read_stamp(const char *maps)
{
    json_t *stamp = NULL;
    char *const path = weft_path_join(maps, "batch.json", NULL);
    if (path && weft_file_exists(path))
        (void)weft_json_load_kind(path, "batch-stamp", 1, &stamp, NULL);
    weft_free(path);
    return stamp;
}

static const char *text_of(const json_t *object, const char *key)
{
    const char *const text = json_string_value(json_object_get(object, key));
    return text ? text : "";
}

/* Why it failed, if that was with this key. */
static void look_for_failure(const weft_batch *batch, weft_batch_item *item)
{
    json_t *failure = NULL;
    char *const path = weft_batch_side_path(batch, item->name, ".failed", NULL);
    if (path && weft_file_exists(path) && weft_json_load(path, &failure, NULL) == WEFT_OK &&
        strcmp(text_of(failure, "key"), item->key) == 0) {
        item->state = WEFT_BATCH_FAILED;
        snprintf(item->error, sizeof item->error, "%s", text_of(failure, "error"));
    }
    json_decref(failure);
    weft_free(path);
}

void weft_batch_look(const weft_batch *batch, weft_batch_item *item)
{
    if (item->state != WEFT_BATCH_WAITING)
        return;
    char *const maps = weft_batch_maps_path(batch, item->name, NULL);
    json_t *const stamp = maps ? weft_batch_read_stamp(maps) : NULL;
    weft_free(maps);
    if (stamp && strcmp(text_of(stamp, "key"), item->key) == 0) {
        item->state = WEFT_BATCH_SOLVED;
        item->stamp = stamp;
        return;
    }
    json_decref(stamp);
    look_for_failure(batch, item);
}

int weft_batch_count(const weft_batch *batch, weft_batch_state state)
{
    int n = 0;
    for (int i = 0; i < batch->n_items; i++)
        n += batch->items[i].state == state;
    return n;
}

void weft_batch_event(const weft_batch *batch, const char *event, const char *name, const char *key)
{
    char when[32], host[256];
    weft_time_now_iso(when);
    weft_batch_host(host);
    json_t *const object = json_pack("{s:s, s:s, s:s, s:s, s:s, s:i}", "when", when, "event", event, "set",
                                     name, "key", key, "host", host, "pid", (int)getpid());
    char *const text = json_dumps(object, JSON_COMPACT | JSON_PRESERVE_ORDER);
    char *const path = weft_batch_side_path(batch, "events", ".jsonl", NULL);
    char *const line = text ? weft_asprintf(NULL, "%s\n", text) : NULL;
    const int fd = path && line ? open(path, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0666) : -1;
    if (fd >= 0) {
        (void)!write(fd, line, strlen(line)); /* at once: lines of several processes do not mix */
        close(fd);
    }
    weft_free(line);
    weft_free(path);
    free(text);
    json_decref(object);
}

/* ---- planning ---- */

static weft_err plan_item(const weft_batch *batch, weft_batch_item *item, weft_error *err)
{
    weft_error why = {0};
    const weft_err status = weft_batch_key(item->set, batch->calibration, batch->options, batch->n_options,
                                           item->key, &item->memory, &why);
    if (status == WEFT_ERR_NOMEM)
        return weft_fail(err, status, "%s", why.text);
    if (status != WEFT_OK) {
        item->state = WEFT_BATCH_FAILED;
        item->key[0] = '\0';
        snprintf(item->error, sizeof item->error, "%s", why.text);
        return WEFT_OK;
    }
    weft_batch_look(batch, item);
    if (item->state == WEFT_BATCH_SOLVED)
        item->state = WEFT_BATCH_KEPT;
    else
        item->state = WEFT_BATCH_WAITING; /* what failed is tried again */
    return WEFT_OK;
}

/* Maps that this batch has not made, or made of other inputs or with other options.  A task of an earlier run
 * may put maps in place while this one plans: what is there now is looked at once more before it is called
 * foreign. */
static weft_err refuse_foreign(const weft_batch *batch, weft_batch_item *item, weft_error *err)
{
    char *const maps = weft_batch_maps_path(batch, item->name, err);
    if (!maps)
        return WEFT_ERR_NOMEM;
    weft_err status = WEFT_OK;
    if (item->state == WEFT_BATCH_WAITING && !batch->force && weft_folder_exists(maps)) {
        weft_batch_look(batch, item);
        if (item->state == WEFT_BATCH_SOLVED)
            item->state = WEFT_BATCH_KEPT;
        else
            status = weft_fail(err, WEFT_ERR_EXISTS,
                               "%s was made of other inputs, with other options or by another command: give "
                               "another folder, or --force to replace it",
                               maps);
    }
    weft_free(maps);
    return status;
}

static weft_err add_item(weft_batch *batch, const char *set, weft_error *err)
{
    weft_batch_item *const item = &batch->items[batch->n_items++];
    item->set = absolute(set, err);
    item->name = item->set ? name_of(item->set, err) : NULL;
    if (!item->name)
        return WEFT_ERR_NOMEM;
    for (int j = 0; j < batch->n_items - 1; j++)
        if (strcmp(batch->items[j].name, item->name) == 0)
            return weft_fail(err, WEFT_ERR_EXISTS,
                             "two sets are called %s: %s and %s (give them to two batches)", item->name,
                             batch->items[j].set, item->set);
    return WEFT_OK;
}

static weft_err make_folder(weft_batch *batch, const char *folder, weft_error *err)
{
    char *const inner = weft_path_join(folder, "batch", err);
    const weft_err status = inner ? weft_folder_create(inner, err) : WEFT_ERR_NOMEM;
    weft_free(inner);
    if (status == WEFT_OK)
        batch->folder = absolute(folder, err);
    return status != WEFT_OK ? status : batch->folder ? WEFT_OK : WEFT_ERR_NOMEM;
}

/* Two batches in one folder would do each other's work. */
static weft_err lock_folder(weft_batch *batch, weft_error *err)
{
    char *const path = weft_batch_side_path(batch, "batch", ".lock", err);
    if (!path)
        return WEFT_ERR_NOMEM;
    weft_err status = WEFT_OK;
    batch->lock = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (batch->lock < 0)
        status = weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be written", path);
    else if (flock(batch->lock, LOCK_EX | LOCK_NB) != 0)
        status =
            weft_fail(err, WEFT_ERR_EXISTS, "another weft batch works in %s: wait for it", batch->folder);
    weft_free(path);
    return status;
}

static weft_err plan(weft_batch *batch, const char *const *sets, int n_sets, const char *folder, bool worker,
                     weft_error *err)
{
    weft_calibration cal;
    WEFT_TRY(weft_calibration_load(batch->calibration, &cal, err));
    weft_calibration_fini(&cal);
    for (int i = 0; i < n_sets; i++)
        WEFT_TRY(add_item(batch, sets[i], err));
    WEFT_TRY(make_folder(batch, folder, err));
    if (!worker)
        WEFT_TRY(lock_folder(batch, err));
    for (int i = 0; i < n_sets; i++)
        WEFT_TRY(plan_item(batch, &batch->items[i], err));
    for (int i = 0; i < n_sets; i++)
        WEFT_TRY(refuse_foreign(batch, &batch->items[i], err));
    return WEFT_OK;
}

weft_err weft_batch_init(weft_batch *batch, const char *const *sets, int n_sets, const char *calibration,
                         const char *folder, const char *const *options, int n_options, bool force,
                         bool worker, weft_error *err)
{
    *batch = (weft_batch){.options = options, .n_options = n_options, .force = force, .lock = -1};
    batch->calibration = absolute(calibration, err);
    batch->items = weft_alloc((size_t)n_sets, sizeof *batch->items, err);
    const weft_err status =
        batch->calibration && batch->items ? plan(batch, sets, n_sets, folder, worker, err) : WEFT_ERR_NOMEM;
    if (status != WEFT_OK)
        weft_batch_fini(batch);
    return status;
}

void weft_batch_fini(weft_batch *batch)
{
    if (batch->lock > 0)
        close(batch->lock);
    for (int i = 0; batch->items && i < batch->n_items; i++) {
        weft_free(batch->items[i].set);
        weft_free(batch->items[i].name);
        json_decref(batch->items[i].stamp);
    }
    weft_free(batch->items);
    weft_free(batch->folder);
    weft_free(batch->calibration);
    *batch = (weft_batch){0};
}

char **weft_batch_task_words(const weft_batch *batch, int i, weft_error *err)
{
    char **const words = weft_alloc(12 + 2 * (size_t)batch->n_options, sizeof *words, err);
    if (!words)
        return NULL;
    const char *const fixed[] = {
        "weft", "batch", "-c", batch->calibration, "-o", "", "--task", "", batch->force ? "--force" : "-q"};
    int n = 0;
    for (; n < (int)(sizeof fixed / sizeof *fixed); n++)
        words[n] = (char *)(uintptr_t)fixed[n];
    words[5] = batch->folder;
    words[7] = batch->items[i].key;
    for (int o = 0; o < batch->n_options; o++) {
        words[n++] = (char *)(uintptr_t) "--solve";
        words[n++] = (char *)(uintptr_t)batch->options[o];
    }
    words[n++] = (char *)(uintptr_t) "--";
    words[n++] = batch->items[i].set;
    return words;
}
