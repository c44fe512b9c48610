/*
 * The same work as a Slurm job array.
 *
 * The array's script holds the list of sets and keys, so what a task number means is fixed when it is
 * submitted.  The job's name is "weft-FOLDER-WORK", two hashes: it tells a later run, which has nothing but
 * the folder, that the array in the queue is its own.  Results come through the folder, never through Slurm:
 * a task that is gone from the queue has left maps, or a reason, or was killed; then it is submitted again.
 */
#include "host/batch/batch.h"

#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/sha256.h"
#include "core/shipped.h"
#include "core/text_buffer.h"
#include "host/batch/batch_command.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MOST_ATTEMPTS = 3, POLL_S = 1, MOST_DEAF_POLLS = 60 };

typedef struct slurm_run {
    weft_batch *batch;
    char prefix[32], name[48]; /* of the jobs: "weft-FOLDER", "weft-FOLDER-WORK" */
    int jobs;
    const char *const *words;
    int n_words;
    bool *queued; /* [n_items] in the queue at the last look */
    int n_queued;
} slurm_run;

/* ---- names ---- */

static void name_jobs(slurm_run *run)
{
    weft_sha256 hash;
    char folder[65], work[65];
    weft_sha256_init(&hash);
    weft_sha256_update(&hash, run->batch->folder, strlen(run->batch->folder));
    weft_sha256_final_hex(&hash, folder);
    weft_sha256_init(&hash);
    for (int i = 0; i < run->batch->n_items; i++) {
        weft_sha256_update(&hash, run->batch->items[i].name, strlen(run->batch->items[i].name) + 1);
        weft_sha256_update(&hash, run->batch->items[i].key, 65);
    }
    weft_sha256_final_hex(&hash, work);
    snprintf(run->prefix, sizeof run->prefix, "weft-%.10s-", folder);
    snprintf(run->name, sizeof run->name, "weft-%.10s-%.10s", folder, work);
}

/* ---- the queue ---- */

static weft_err words_of(const char *program, const weft_command_output *output, weft_error *err)
{
    return weft_fail(err, WEFT_ERR_DEVICE, "%s failed with status %d: %s", program, output->exit_status,
                     output->err[0] ? output->err : output->out);
}

/* "JOB_TASK|NAME|STATE|REASON" */
static weft_err take_queue_line(slurm_run *run, char *line, weft_error *err)
{
    char *rest = line;
    const char *const id = strsep(&rest, "|"), *const name = strsep(&rest, "|");
    const char *const state = strsep(&rest, "|"), *const reason = strsep(&rest, "|");
    if (!reason || strncmp(name, run->prefix, strlen(run->prefix)) != 0)
        return WEFT_OK;
    const char *const task = strchr(id, '_');
    if (strcmp(name, run->name) != 0)
        return weft_fail(
            err, WEFT_ERR_EXISTS,
            "Slurm job %s of an earlier batch in %s, with other sets or options, is not done: wait "
            "for it, or end it with \"scancel %.*s\"",
            id, run->batch->folder, (int)strcspn(id, "_"), id);
    const long i = task ? strtol(task + 1, NULL, 10) : -1;
    if (i < 0 || i >= run->batch->n_items || run->queued[i])
        return WEFT_OK;
    run->queued[i] = true;
    run->n_queued++;
    weft_explain("%s: task %s is %s (%s)", run->batch->items[i].name, id, state, reason);
    return WEFT_OK;
}

static weft_err look_at_queue(slurm_run *run, weft_error *err)
{
    char *const words[] = {"squeue", "--noheader", "--array", "--me", "--format=%i|%j|%T|%r", NULL};
    weft_command_output output;
    WEFT_TRY(weft_command_capture(words, NULL, &output, err));
    weft_err status = output.exit_status == 0 ? WEFT_OK : words_of("squeue", &output, err);
    if (status == WEFT_OK) {
        run->n_queued = 0;
        memset(run->queued, 0, (size_t)run->batch->n_items * sizeof *run->queued);
    }
    char *rest = output.out;
    for (char *line = strsep(&rest, "\n"); line && status == WEFT_OK; line = strsep(&rest, "\n"))
        status = take_queue_line(run, line, err);
    weft_command_output_fini(&output);
    return status;
}

/* ---- submitting ---- */

/* 'it'\''s' */
static void add_quoted(weft_text_buffer *script, const char *word)
{
    weft_text_add(script, "'");
    for (const char *p = word; *p; p++)
        if (*p == '\'')
            weft_text_add(script, "'\\''");
        else
            weft_text_add_bytes(script, p, 1);
    weft_text_add(script, "' ");
}

static bool to_submit(const slurm_run *run, int i)
{
    const weft_batch_item *const item = &run->batch->items[i];
    return item->state == WEFT_BATCH_WAITING && !run->queued[i] && item->attempts < MOST_ATTEMPTS;
}

static weft_err write_script(const slurm_run *run, const char *program, weft_text_buffer *script,
                             weft_error *err)
{
    weft_text_add(script, "#!/bin/sh\nexport OMP_NUM_THREADS=${SLURM_CPUS_PER_TASK:-1}\n"
                          "case $SLURM_ARRAY_TASK_ID in\n");
    for (int i = 0; i < run->batch->n_items; i++) {
        if (!to_submit(run, i))
            continue;
        char **const words = weft_batch_task_words(run->batch, i, err);
        if (!words)
            return WEFT_ERR_NOMEM;
        weft_text_add(script, "%d) exec ", i);
        add_quoted(script, program);
        for (int w = 1; words[w]; w++)
            add_quoted(script, words[w]);
        weft_text_add(script, ";;\n");
        weft_free(words);
    }
    weft_text_add(script, "esac\nexit 1\n");
    return weft_text_buffer_status(script, err);
}

/* "--array=0,3,7%4" */
static weft_err write_array(const slurm_run *run, weft_text_buffer *array, weft_error *err)
{
    const char *comma = "";
    weft_text_add(array, "--array=");
    for (int i = 0; i < run->batch->n_items; i++)
        if (to_submit(run, i)) {
            weft_text_add(array, "%s%d", comma, i);
            comma = ",";
        }
    if (run->jobs > 0)
        weft_text_add(array, "%%%d", run->jobs);
    return weft_text_buffer_status(array, err);
}

static weft_err call_sbatch(slurm_run *run, const char *script, char *array, weft_error *err)
{
    weft_command_output output = {0};
    char *const log = weft_asprintf(err, "--output=%s/batch/slurm-%%A_%%a.log", run->batch->folder);
    char *const name = weft_asprintf(err, "--job-name=%s", run->name);
    char **const words = weft_alloc((size_t)run->n_words + 8, sizeof *words, err);
    weft_err status = log && name && words ? WEFT_OK : WEFT_ERR_NOMEM;
    if (status == WEFT_OK) {
        int n = 0;
        words[n++] = (char *)(uintptr_t) "sbatch";
        words[n++] = (char *)(uintptr_t) "--parsable";
        words[n++] = (char *)(uintptr_t) "--requeue"; /* when its node fails */
        words[n++] = name;
        words[n++] = log;
        words[n++] = array;
        for (int i = 0; i < run->n_words; i++)
            words[n++] = (char *)(uintptr_t)run->words[i];
        status = weft_command_capture(words, script, &output, err);
    }
    if (status == WEFT_OK && output.exit_status != 0)
        status = words_of("sbatch", &output, err);
    if (status == WEFT_OK)
        weft_note("submitted as Slurm job %.*s, tasks %s", (int)strcspn(output.out, ";"), output.out,
                  array + 8);
    weft_command_output_fini(&output);
    weft_free(words);
    weft_free(name);
    weft_free(log);
    return status;
}

static weft_err submit(slurm_run *run, int *n, weft_error *err)
{
    char program[PATH_MAX];
    weft_text_buffer script = {0}, array = {0};
    *n = 0;
    for (int i = 0; i < run->batch->n_items; i++)
        *n += to_submit(run, i);
    if (*n == 0)
        return WEFT_OK;
    weft_err status = weft_program_path(program, err);
    if (status == WEFT_OK)
        status = write_script(run, program, &script, err);
    if (status == WEFT_OK)
        status = write_array(run, &array, err);
    if (status == WEFT_OK)
        status = call_sbatch(run, script.text, array.text, err);
    if (status == WEFT_OK)
        for (int i = 0; i < run->batch->n_items; i++)
            if (to_submit(run, i)) {
                run->batch->items[i].attempts++;
                run->queued[i] = true;
                run->n_queued++;
            }
    weft_text_buffer_fini(&script);
    weft_text_buffer_fini(&array);
    return status;
}

/* ---- waiting ---- */

/* One look at the queue, and then (a task leaves its result before it leaves the queue) at the folder. */
static weft_err look(slurm_run *run, int *deaf, weft_error *err)
{
    weft_error why = {0};
    const weft_err status = look_at_queue(run, &why);
    if (status == WEFT_ERR_DEVICE && ++*deaf <= MOST_DEAF_POLLS) { /* slurmctld restarts, and goes on */
        if (*deaf == 1)
            weft_warn("%s; waiting for it", why.text);
        return WEFT_OK;
    }
    if (status != WEFT_OK)
        return weft_fail(err, status, "%s", why.text);
    *deaf = 0;
    for (int i = 0; i < run->batch->n_items; i++)
        weft_batch_look(run->batch, &run->batch->items[i]);
    return WEFT_OK;
}

static weft_err cancelled(const slurm_run *run, weft_error *err)
{
    return weft_fail(err, WEFT_ERR_CANCELLED,
                     "cancelled: the %d tasks in Slurm's queue go on; the same command waits for them again, "
                     "\"scancel --name=%s\" ends them",
                     run->n_queued, run->name);
}

static weft_err wait_for_all(slurm_run *run, weft_error *err)
{
    weft_progress progress;
    weft_err status = WEFT_OK;
    int deaf = 0, n = 0;
    const int total = weft_batch_count(run->batch, WEFT_BATCH_WAITING);
    weft_progress_begin(&progress, "solving in Slurm", "sets", total);
    while (status == WEFT_OK) {
        status = look(run, &deaf, err);
        if (status == WEFT_OK && deaf == 0)
            status = submit(run, &n, err);
        const int left = weft_batch_count(run->batch, WEFT_BATCH_WAITING);
        progress.done = total - left;
        if (status != WEFT_OK || (deaf == 0 && run->n_queued == 0))
            break;
        if (weft_progress_step(&progress, 0, NULL) != WEFT_OK) {
            status = cancelled(run, err);
            break;
        }
        nanosleep(&(struct timespec){.tv_sec = POLL_S}, NULL);
    }
    weft_progress_end(&progress);
    return status;
}

weft_err weft_batch_run_slurm(weft_batch *batch, int jobs, const char *const *words, int n_words,
                              weft_error *err)
{
    slurm_run run = {.batch = batch, .jobs = jobs, .words = words, .n_words = n_words};
    if (weft_batch_count(batch, WEFT_BATCH_WAITING) == 0)
        return WEFT_OK;
    run.queued = weft_alloc((size_t)batch->n_items, sizeof *run.queued, err);
    if (!run.queued)
        return WEFT_ERR_NOMEM;
    name_jobs(&run);
    weft_err status = look_at_queue(&run, err);
    if (status == WEFT_ERR_MISSING)
        weft_prefix(err, status, "Slurm is not here (Debian: slurm-client)");
    if (status == WEFT_OK && run.n_queued > 0)
        weft_note("%d tasks of an earlier run are in Slurm's queue: waiting for them", run.n_queued);
    if (status == WEFT_OK)
        status = wait_for_all(&run, err);
    for (int i = 0; i < batch->n_items && status == WEFT_OK; i++)
        if (batch->items[i].state == WEFT_BATCH_WAITING) {
            batch->items[i].state = WEFT_BATCH_FAILED;
            snprintf(batch->items[i].error, sizeof batch->items[i].error,
                     "its Slurm task ended %d times without a result (look at %.300s/batch/slurm-*_%d.log)",
                     batch->items[i].attempts, batch->folder, i);
        }
    weft_free(run.queued);
    return status;
}
