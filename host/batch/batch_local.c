/* Many processes on this machine. */
#include "host/batch/batch.h"

#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/shipped.h"
#include "host/process/child.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { MOST_JOBS = 32 }; /* the loop watches four descriptors for each */

typedef struct local_run local_run;

typedef struct slot {
    local_run *run;
    weft_child *child; /* NULL: free */
    int item;
    bool ended;
    int status;
    char last[512]; /* the last line it said on stderr */
} slot;

struct local_run {
    weft_batch *batch;
    weft_loop *loop;
    char program[PATH_MAX];
    int n_slots, next;
    slot slots[MOST_JOBS];
};

/* ---- what the processes say ---- */

static void on_line(void *context, const char *stream, const char *text)
{
    slot *const s = context;
    if (strcmp(stream, "err") != 0)
        return;
    snprintf(s->last, sizeof s->last, "%s", text);
    weft_explain("%s: %s", s->run->batch->items[s->item].name, text);
}

static void on_report(void *context, json_t *message, int picture)
{
    (void)context, (void)message;
    if (picture >= 0)
        close(picture);
}

static void on_end(void *context, int status)
{
    slot *const s = context;
    s->ended = true;
    s->status = status;
}

/* ---- the work ---- */

static weft_err begin(slot *s, int item, weft_error *err)
{
    local_run *const run = s->run;
    char **const words = weft_batch_task_words(run->batch, item, err);
    if (!words)
        return WEFT_ERR_NOMEM;
    const weft_child_ears ears = {on_line, on_report, on_end, s};
    s->item = item;
    s->ended = false;
    s->last[0] = '\0';
    const weft_err status = weft_child_start(run->loop, run->program, words, 0, &ears, &s->child, err);
    weft_free(words);
    if (status != WEFT_OK)
        return status;
    run->batch->items[item].attempts++;
    weft_child_go(s->child);
    return WEFT_OK;
}

/* The maps, or the reason that the worker wrote, or else how the process ended. */
static void settle(slot *s)
{
    weft_batch_item *const item = &s->run->batch->items[s->item];
    weft_child_destroy(s->child);
    s->child = NULL;
    weft_batch_look(s->run->batch, item);
    if (item->state != WEFT_BATCH_WAITING || weft_cancelled())
        return;
    item->state = WEFT_BATCH_FAILED;
    if (WIFSIGNALED(s->status))
        snprintf(item->error, sizeof item->error, "its process was ended by signal %d (%s)%s",
                 WTERMSIG(s->status), strsignal(WTERMSIG(s->status)),
                 WTERMSIG(s->status) == SIGKILL ? ": was memory short? fewer --jobs help" : "");
    else
        snprintf(item->error, sizeof item->error, "%s",
                 s->last[0] ? s->last : "its process ended without a result");
}

static int next_waiting(local_run *run)
{
    while (run->next < run->batch->n_items && run->batch->items[run->next].state != WEFT_BATCH_WAITING)
        run->next++;
    return run->next < run->batch->n_items ? run->next++ : -1;
}

static weft_err fill_slots(local_run *run, int *busy, weft_error *err)
{
    *busy = 0;
    for (int i = 0; i < run->n_slots; i++) {
        slot *const s = &run->slots[i];
        const int item = s->child || weft_cancelled() ? -1 : next_waiting(run);
        if (item >= 0)
            WEFT_TRY(begin(s, item, err));
        *busy += s->child != NULL;
    }
    return WEFT_OK;
}

static void interrupt_all(const local_run *run)
{
    for (int i = 0; i < run->n_slots; i++)
        if (run->slots[i].child)
            weft_child_signal(run->slots[i].child, SIGTERM);
}

static weft_err work(local_run *run, weft_error *err)
{
    weft_progress progress;
    weft_err status = WEFT_OK;
    bool interrupted = false;
    int busy = 0;
    weft_progress_begin(&progress, "solving", "sets", weft_batch_count(run->batch, WEFT_BATCH_WAITING));
    for (;;) {
        if (status == WEFT_OK)
            status = fill_slots(run, &busy, err);
        if (busy == 0 || (status != WEFT_OK && status != WEFT_ERR_CANCELLED))
            break;
        weft_loop_turn(run->loop, 200);
        for (int i = 0; i < run->n_slots; i++)
            if (run->slots[i].child && run->slots[i].ended) {
                settle(&run->slots[i]);
                progress.done++;
                busy--;
            }
        if (weft_progress_step(&progress, 0, status == WEFT_OK ? err : NULL) != WEFT_OK) {
            status = WEFT_ERR_CANCELLED;
            if (!interrupted)
                interrupt_all(run);
            interrupted = true;
        }
    }
    if (status == WEFT_OK && weft_batch_count(run->batch, WEFT_BATCH_WAITING) > 0)
        status = weft_progress_step(&progress, 0, err); /* cancelled when one had ended and none had begun */
    weft_progress_end(&progress);
    for (int i = 0; i < run->n_slots; i++)
        weft_child_destroy(run->slots[i].child);
    return status;
}

/* ---- how many ---- */

/* What the kernel could give without swapping, bytes. */
static double memory_available(void)
{
    char line[128];
    long kib = 0;
    FILE *const f = fopen("/proc/meminfo", "re");
    while (f && fgets(line, sizeof line, f))
        if (strncmp(line, "MemAvailable:", 13) == 0)
            kib = strtol(line + 13, NULL, 10);
    if (f)
        fclose(f);
    return kib > 0 ? 1024.0 * (double)kib : 1e18;
}

static int choose_jobs(const weft_batch *batch, int wanted)
{
    long cores = sysconf(_SC_NPROCESSORS_ONLN), jobs = wanted > 0 ? wanted : cores;
    double most = 1;
    for (int i = 0; i < batch->n_items; i++)
        if (batch->items[i].state == WEFT_BATCH_WAITING && batch->items[i].memory > most)
            most = batch->items[i].memory;
    const double fit = memory_available() / most;
    if (wanted == 0 && (double)jobs > fit)
        jobs = fit >= 1 ? (long)fit : 1;
    const int waiting = weft_batch_count(batch, WEFT_BATCH_WAITING);
    jobs = jobs > waiting ? waiting : jobs;
    jobs = jobs < 1 ? 1 : jobs > MOST_JOBS ? MOST_JOBS : jobs;
    char threads[32];
    snprintf(threads, sizeof threads, "%ld", cores / jobs > 1 ? cores / jobs : 1);
    (void)setenv("OMP_NUM_THREADS", threads, 0); /* of the processes; who has set it knows better */
    weft_explain("%ld sets at a time, each with %s threads; one takes about %.0f MB", jobs,
                 getenv("OMP_NUM_THREADS"), most / 1e6);
    return (int)jobs;
}

weft_err weft_batch_run_here(weft_batch *batch, int jobs, weft_error *err)
{
    local_run *const run = weft_alloc(1, sizeof *run, err);
    if (!run)
        return WEFT_ERR_NOMEM;
    *run = (local_run){.batch = batch};
    weft_err status = weft_program_path(run->program, err);
    if (status == WEFT_OK)
        status = weft_loop_create(&run->loop, err);
    if (status == WEFT_OK) {
        run->n_slots = choose_jobs(batch, jobs);
        for (int i = 0; i < run->n_slots; i++)
            run->slots[i].run = run;
        status = work(run, err);
    }
    weft_loop_destroy(run->loop);
    weft_free(run);
    return status;
}
