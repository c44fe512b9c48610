/* weft batch: many sets, here or on a Slurm cluster. */
#include "host/cli/command.h"

#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "host/batch/batch.h"
#include "host/client/job_kinds.h"

#include <stdint.h>
#include <string.h>

extern const weft_command weft_cmd_solve;

typedef struct batch_args {
    const char *calibration, *output, *task;
    int jobs;
    bool slurm;
    weft_texts solve, sbatch;
} batch_args;

static const weft_field fields[] = {
    {.key = "calibration",
     .short_opt = 'c',
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(batch_args, calibration),
     .unit = "CAL",
     .required = true,
     .help = "calibration of the scanner that took the sets"},
    {.key = "output",
     .short_opt = 'o',
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(batch_args, output),
     .unit = "DIR",
     .required = true,
     .help = "folder for NAME.maps of each set and the report; the same again goes on with it"},
    {.key = "solve",
     .type = WEFT_FIELD_TEXTS,
     .offset = offsetof(batch_args, solve),
     .unit = "OPTION=VALUE",
     .help = "an option of weft solve for every set, as method=lsq; may be given several times"},
    {.key = "jobs",
     .short_opt = 'j',
     .type = WEFT_FIELD_INT,
     .offset = offsetof(batch_args, jobs),
     .unit = "N",
     .min = 0,
     .max = 10000,
     .def = "0",
     .help = "sets at a time; 0: as many as cores and memory allow, with Slurm as many as it likes"},
    {.key = "slurm",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(batch_args, slurm),
     .help = "the same work as a Slurm job array; DIR must be on a file system that the nodes share"},
    {.key = "sbatch",
     .type = WEFT_FIELD_TEXTS,
     .offset = offsetof(batch_args, sbatch),
     .unit = "WORD",
     .help = "one more word for sbatch, as --partition=long; may be given several times"},
    {.key = "task",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(batch_args, task),
     .unit = "KEY",
     .help = "be one of the processes that a batch starts: solve one set, put its maps in place"},
    {0},
};

/* ---- one set, as weft solve does it ---- */

/* What weft solve would have got from a command line: its struct points into the words. */
typedef struct solve_line {
    char *words[WEFT_TEXTS_MAX + 2];
    void *args;
} solve_line;

static void solve_line_fini(solve_line *line)
{
    for (int i = 0; i < WEFT_TEXTS_MAX + 2; i++)
        weft_free(line->words[i]);
    weft_free(line->args);
}

/* Through weft solve's own table, so that every option it has is understood here. */
static weft_err parse_solve_line(const batch_args *args, const char *maps, solve_line *line, weft_error *err)
{
    const char *operands[WEFT_TEXTS_MAX + 2];
    int n = 0, n_operands = 0;
    *line = (solve_line){.args = weft_alloc(1, weft_cmd_solve.args_size, err)};
    line->words[n++] = weft_asprintf(err, "--calibration=%s", args->calibration);
    line->words[n++] = weft_asprintf(err, "--output=%s", maps);
    for (int i = 0; i < args->solve.n; i++)
        line->words[n++] = weft_asprintf(err, "--%s", args->solve.values[i]);
    for (int i = 0; i < n; i++)
        if (!line->words[i] || !line->args)
            return WEFT_ERR_NOMEM;
    const weft_field *const tables[] = {weft_cmd_solve.fields};
    void *const structs[] = {line->args};
    weft_fields_set_defaults(weft_cmd_solve.fields, line->args);
    return weft_fields_parse_argv(tables, structs, 1, n, line->words, operands, &n_operands, err);
}

static weft_err solve_one(void *context, const char *set, const char *maps, weft_error *err)
{
    const batch_args *const args = context;
    solve_line line = {0};
    FILE *const nowhere = fopen("/dev/null", "we");
    const weft_invocation inv = {.operands = &set, .n_operands = 1, .out = nowhere};
    weft_err status = nowhere ? WEFT_OK : weft_fail_errno(err, WEFT_ERR_IO, "/dev/null");
    if (status == WEFT_OK)
        status = parse_solve_line(args, maps, &line, err);
    if (status == WEFT_OK)
        status = weft_cmd_solve.run(&inv, line.args, err);
    if (nowhere)
        fclose(nowhere);
    solve_line_fini(&line);
    return status;
}

/* A wrong option is known before the first set is looked at; paths are the batch's own matter. */
static weft_err check_solve_options(const batch_args *args, weft_error *err)
{
    const weft_job_kind *const kind = weft_job_kind_find("solve");
    solve_line line = {0};
    for (int i = 0; i < args->solve.n; i++) {
        char key[64];
        snprintf(key, sizeof key, "%.*s", (int)strcspn(args->solve.values[i], "="), args->solve.values[i]);
        if (weft_job_kind_is_path(kind, key) || strcmp(key, "explain") == 0)
            return weft_fail(err, WEFT_ERR_USAGE, "--solve %s is not for batches", args->solve.values[i]);
    }
    const weft_err status = parse_solve_line(args, "x", &line, err);
    solve_line_fini(&line);
    return status == WEFT_OK ? status : weft_prefix(err, status, "--solve");
}

/* ---- the table ---- */

static void print_row(const weft_invocation *inv, const json_t *set)
{
    const char *const error = json_string_value(json_object_get(set, "error"));
    fprintf(inv->out, "%-24s %-13s", json_string_value(json_object_get(set, "name")),
            json_string_value(json_object_get(set, "state")));
    if (error)
        fprintf(inv->out, " %s", error);
    else if (json_object_get(set, "answered"))
        fprintf(inv->out, " %5d x %-5d %6.1f %% %8.2f %% %7.1f s",
                (int)json_number_value(json_object_get(set, "width")),
                (int)json_number_value(json_object_get(set, "height")),
                100 * json_number_value(json_object_get(set, "answered")),
                100 * json_number_value(json_object_get(set, "residual_mean")),
                json_number_value(json_object_get(set, "seconds")));
    fputc('\n', inv->out);
}

static void print_table(const weft_invocation *inv, const weft_batch *batch, const json_t *report)
{
    const json_t *const sets = json_object_get(report, "sets");
    fprintf(inv->out, "%-24s %-13s %13s %8s %10s %9s\n", "set", "", "pixels", "answered", "residual", "time");
    for (size_t i = 0; i < json_array_size(sets); i++)
        print_row(inv, json_array_get(sets, i));
    fprintf(
        inv->out, "%d sets: %d solved, %d there already, %d failed, %d not solved, %.1f s\n%s/report.html\n",
        batch->n_items, weft_batch_count(batch, WEFT_BATCH_SOLVED), weft_batch_count(batch, WEFT_BATCH_KEPT),
        weft_batch_count(batch, WEFT_BATCH_FAILED), weft_batch_count(batch, WEFT_BATCH_WAITING),
        json_number_value(json_object_get(report, "seconds")), batch->folder);
}

static weft_err tell(const weft_invocation *inv, const weft_batch *batch, double seconds, weft_error *err)
{
    json_t *const report = weft_batch_report(batch, seconds);
    if (!report)
        return weft_fail(err, WEFT_ERR_NOMEM, "out of memory for the report");
    const weft_err status = weft_batch_report_save(batch, report, err);
    if (inv->json)
        return status == WEFT_OK ? weft_print_json(inv, report, err) : (json_decref(report), status);
    print_table(inv, batch, report);
    json_decref(report);
    return status;
}

static weft_err run_batch(const weft_invocation *inv, const batch_args *args, weft_batch *batch,
                          weft_error *err)
{
    const double begun = weft_clock_s();
    weft_error in_report = {0};
    weft_err status = args->slurm
                          ? weft_batch_run_slurm(batch, args->jobs, args->sbatch.values, args->sbatch.n, err)
                          : weft_batch_run_here(batch, args->jobs, err);
    const weft_err told = status == WEFT_OK || status == WEFT_ERR_CANCELLED
                              ? tell(inv, batch, weft_clock_s() - begun, &in_report)
                              : WEFT_OK;
    const int failed = weft_batch_count(batch, WEFT_BATCH_FAILED);
    if (status == WEFT_OK && told != WEFT_OK)
        status = weft_fail(err, told, "%s", in_report.text);
    if (status == WEFT_OK && failed > 0)
        status =
            weft_fail(err, WEFT_ERR_NODATA, "%d of %d sets could not be solved (%s/report.html says why)",
                      failed, batch->n_items, batch->folder);
    return status;
}

static weft_err run(const weft_invocation *inv, const void *args_, weft_error *err)
{
    const batch_args *const args = args_;
    weft_batch batch;
    WEFT_TRY(check_solve_options(args, err));
    if (args->task && inv->n_operands != 1)
        return weft_fail(err, WEFT_ERR_USAGE, "--task is for one set");
    WEFT_TRY(weft_batch_init(&batch, inv->operands, inv->n_operands, args->calibration, args->output,
                             args->solve.values, args->solve.n, inv->force, args->task != NULL, err));
    const weft_err status = args->task
                                ? weft_batch_task(&batch, args->task, solve_one, (void *)(uintptr_t)args, err)
                                : run_batch(inv, args, &batch, err);
    weft_batch_fini(&batch);
    return status;
}

const weft_command weft_cmd_batch = {
    .name = "batch",
    .summary = "solve many sets, here or on a Slurm cluster",
    .operands = "SET...",
    .min_operands = 1,
    .max_operands = -1,
    .args_size = sizeof(batch_args),
    .fields = fields,
    .details =
        "Each set is solved by a process of its own; one that fails stops no other.  Stopped or killed\n"
        "at any moment, the same command goes on: a set whose maps were made of the same inputs with\n"
        "the same options is not solved again.  At the end DIR has report.html and report.json, and\n"
        "the exit status is 1 when a set failed (docs/batch.md).",
    .example = "weft batch scans/*.set -c scanner.cal -o maps --solve resolution=half",
    .run = run,
};
