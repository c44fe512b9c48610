/* weft doctor: what is wrong with this scanner, and what to do about it. */
#include "core/progress.h"
#include "host/cli/command.h"
#include "host/cli/doctor.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

typedef struct doctor_args {
    weft_device_options devices;
    const char *folder;
    bool lamps;
} doctor_args;

static const weft_field fields[] = {
    WEFT_DEVICE_FIELDS(doctor_args, devices),
    {.key = "folder",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(doctor_args, folder),
     .unit = "DIR",
     .def = ".",
     .help = "where scans will be kept"},
    {.key = "lamps",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(doctor_args, lamps),
     .help = "light lamp after lamp, and see with the camera whether it shines"},
    {0},
};

/* By weft_doctor_verdict. */
static const char *const words[] = {"ok", "warning", "FAILED", "skipped"};
static const char *const json_words[] = {"ok", "warning", "failed", "skipped"};

static void print_line(FILE *out, const char *name, const weft_doctor_result *r)
{
    fprintf(out, "%-8s %-18s %s%s%s\n", words[r->verdict], name, r->text, r->remedy[0] ? "; remedy: " : "",
            r->remedy);
    (void)fflush(out);
}

static weft_err finish(const weft_invocation *inv, json_t *list, const int counts[4], weft_error *err)
{
    const int failed = counts[WEFT_DOCTOR_FAILED], warnings = counts[WEFT_DOCTOR_WARNING];
    if (inv->json)
        WEFT_TRY(weft_print_json(inv,
                                 json_pack("{s:b, s:i, s:i, s:O}", "ok", failed == 0, "failed", failed,
                                           "warnings", warnings, "checks", list),
                                 err));
    else
        fprintf(inv->out, "%d ok, %d warnings, %d failed, %d skipped\n", counts[WEFT_DOCTOR_OK], warnings,
                failed, counts[WEFT_DOCTOR_SKIPPED]);
    if (failed > 0)
        return weft_fail(err, WEFT_ERR_DEVICE, "%d of %d checks failed", failed,
                         counts[0] + counts[1] + counts[2] + counts[3]);
    return WEFT_OK;
}

static weft_err run(const weft_invocation *inv, const void *data, weft_error *err)
{
    const doctor_args *const args = data;
    weft_doctor doctor = {.is_rig = args->devices.rig != NULL, .walk = args->lamps, .folder = args->folder};
    int counts[4] = {0};
    WEFT_TRY(weft_device_options_resolve(&args->devices, &doctor.names, err));
    json_t *const list = json_array();
    weft_err status = WEFT_OK;
    for (const weft_doctor_check *c = weft_doctor_checks; c->name && status == WEFT_OK; c++) {
        weft_doctor_result r = {0};
        c->run(&doctor, &r);
        counts[r.verdict]++;
        if (inv->json)
            json_array_append_new(list, json_pack("{s:s, s:s, s:s, s:s}", "name", c->name, "verdict",
                                                  json_words[r.verdict], "text", r.text, "remedy", r.remedy));
        else
            print_line(inv->out, c->name, &r);
        if (weft_cancelled())
            status = weft_fail(err, WEFT_ERR_CANCELLED, "cancelled; the lights are off");
    }
    weft_controller_close(doctor.controller);
    if (status == WEFT_OK)
        status = finish(inv, list, counts, err);
    json_decref(list);
    return status;
}

const weft_command weft_cmd_doctor = {
    .name = "doctor",
    .summary = "check computer, controller and camera; says the remedy of each failure",
    .operands = "",
    .args_size = sizeof(doctor_args),
    .fields = fields,
    .details =
        "One line a check: ok, warning (works, but may not work well), FAILED, or skipped with the reason.\n"
        "Exits with 1 when one has failed.  Opening the port resets an Arduino; a port that another program\n"
        "has open is left alone.  docs/hardware.md goes through a new build with it, step by step.",
    .example = "weft doctor --lamps",
    .run = run,
};
