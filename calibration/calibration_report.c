#include "calibration/calibration_report.h"

#include "core/file.h"
#include "core/mem.h"
#include "core/version.h"

weft_err weft_calibration_open(const char *folder, weft_calibration *cal, weft_error *err)
{
    char *const path = weft_path_join(folder, "calibration.json", err);
    if (!path)
        return WEFT_ERR_NOMEM;
    const bool present = weft_file_exists(path);
    weft_free(path);
    if (present)
        return weft_calibration_load(folder, cal, err);
    weft_calibration_init(cal);
    return WEFT_OK;
}

static json_t *get_or_add(json_t *parent, const char *key)
{
    json_t *const child = json_object_get(parent, key);
    if (json_is_object(child))
        return child;
    return json_object_set_new(parent, key, json_object()) == 0 ? json_object_get(parent, key) : NULL;
}

weft_err weft_calibration_set_report(weft_calibration *cal, const char *step, json_t *report, weft_error *err)
{
    char now[32];
    weft_time_now_iso(now);
    if (!cal->other)
        cal->other = json_object();
    json_t *const reports = cal->other ? get_or_add(cal->other, "reports") : NULL;
    if (!report || !reports || json_object_set_new(report, "created", json_string(now)) != 0 ||
        json_object_set_new(report, "software", json_string("weft " WEFT_VERSION)) != 0 ||
        json_object_set(reports, step, report) != 0) {
        json_decref(report);
        return weft_fail(err, WEFT_ERR_NOMEM, "no memory for the report of \"%s\"", step);
    }
    json_decref(report);
    return WEFT_OK;
}

const json_t *weft_calibration_get_report(const weft_calibration *cal, const char *step)
{
    return json_object_get(json_object_get(cal->other, "reports"), step);
}
