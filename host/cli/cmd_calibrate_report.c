#include "host/cli/command.h"

#include "calibration/lights/white_sheet_file.h"
#include "calibration/report/report.h"
#include "core/file.h"
#include "core/log.h"
#include "core/mem.h"

#include <string.h>

typedef struct report_args {
    const char *output;
} report_args;

static const weft_field fields[] = {
    {.key = "output",
     .short_opt = 'o',
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(report_args, output),
     .unit = "DIR|FILE.html",
     .required = true,
     .help = "a folder, which gets index.html, or the page itself"},
    {0},
};

static char *page_path(const char *output, weft_error *err)
{
    return weft_path_has_suffix(output, ".html") ? weft_strdup(output, err)
                                                 : weft_path_join(output, "index.html", err);
}

/* "scanner.cal" of "labs/scanner.cal/". */
static char *name_of(const char *folder, weft_error *err)
{
    char *const name = weft_strdup(folder, err);
    for (size_t n = name ? strlen(name) : 0; n > 1 && name[n - 1] == '/'; n--)
        name[n - 1] = '\0';
    if (name) {
        const char *const last = weft_path_name(name);
        memmove(name, last, strlen(last) + 1);
    }
    return name;
}

static weft_err write_page(const char *path, const char *folder, const weft_calibration *cal,
                           const weft_verdict *verdict, weft_error *err)
{
    weft_text_buffer page = {0};
    weft_white_sheet sheet = {0};
    weft_error why = {0};
    char *const name = name_of(folder, err);
    if (!name)
        return WEFT_ERR_NOMEM;
    weft_err loaded = WEFT_ERR_MISSING;
    if (cal->has_camera && cal->has_lights)
        loaded = weft_white_sheet_load(folder, cal, &sheet, &why);
    const bool has_sheet = loaded == WEFT_OK;
    if (loaded != WEFT_OK && loaded != WEFT_ERR_MISSING &&
        loaded != WEFT_ERR_IO) /* a calibration may lack it */
        weft_warn("the page has no maps of the sheet: %s", why.text);
    weft_report_page(cal, name, has_sheet ? &sheet : NULL, verdict, &page);
    weft_err status = weft_text_buffer_status(&page, err);
    if (status == WEFT_OK)
        status = weft_file_write(path, page.text, page.n, err);
    weft_white_sheet_fini(&sheet);
    weft_text_buffer_fini(&page);
    weft_free(name);
    return status;
}

static weft_err print(const weft_invocation *inv, const char *path, const weft_verdict *verdict,
                      weft_error *err)
{
    if (!inv->json) {
        for (int i = 0; i < verdict->n; i++) {
            const weft_finding *const f = &verdict->findings[i];
            fprintf(inv->out, "%-6s  %-9s  %s%s%s\n", weft_grade_name(f->grade), f->part, f->text,
                    f->remedy[0] ? " " : "", f->remedy);
        }
        fprintf(inv->out, "%s\n", path);
        return WEFT_OK;
    }
    json_t *const findings = json_array();
    for (int i = 0; i < verdict->n; i++) {
        const weft_finding *const f = &verdict->findings[i];
        json_array_append_new(findings, json_pack("{s:s, s:s, s:s, s:s}", "grade", weft_grade_name(f->grade),
                                                  "part", f->part, "text", f->text, "remedy", f->remedy));
    }
    return weft_print_json(inv,
                           json_pack("{s:s, s:s, s:o}", "page", path, "verdict",
                                     weft_grade_name(verdict->worst), "findings", findings),
                           err);
}

static weft_err run(const weft_invocation *inv, const void *vargs, weft_error *err)
{
    const report_args *const args = vargs;
    weft_calibration cal;
    weft_verdict verdict;
    WEFT_TRY(weft_calibration_load(inv->operands[0], &cal, err));
    char *const path = page_path(args->output, err);
    weft_err status = path ? weft_file_refuse_existing(path, inv->force, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK && !weft_path_has_suffix(args->output, ".html"))
        status = weft_folder_create(args->output, err);
    if (status == WEFT_OK) {
        weft_report_judge(&cal, &verdict);
        status = write_page(path, inv->operands[0], &cal, &verdict, err);
    }
    if (status == WEFT_OK)
        status = print(inv, path, &verdict, err);
    weft_free(path);
    weft_calibration_fini(&cal);
    return status;
}

const weft_command weft_cmd_calibrate_report = {
    .name = "calibrate report",
    .summary = "a page with pictures of a calibration, and what to do again",
    .operands = "CAL",
    .min_operands = 1,
    .max_operands = 1,
    .args_size = sizeof(report_args),
    .fields = fields,
    .details =
        "One HTML page without links to anything: residuals and coverage of the lens, places and "
        "convergence of the\nlights, maps of the sheet against the model, the Munsell line, the colour "
        "chart, and a verdict in words, which\nis printed too.  Parts that are absent are said to be.",
    .example = "weft calibrate report scanner.cal -o report",
    .run = run,
};
