/* The scene file: what a user may set of the virtual scanner. */
#include "core/json.h"
#include "host/rig/scene.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define SCENE_VERSION 1

void weft_rig_setup_init(weft_rig_setup *setup)
{
    *setup = (weft_rig_setup){
        .size = {WEFT_RIG_WIDTH, WEFT_RIG_HEIGHT},
        .seed = 1,
        .noise = true,
        .supersample = 3,
        .light_jitter_mm = 2,
        .aim_jitter_deg = 1,
        .room_light = 0.003,
        .interreflection = true,
    };
}

static const char of_a_scene[] = "a scene; docs/virtual-scanner.md lists them";

static weft_err load_light(const json_t *object, const char *file, int i, weft_rig_setup *setup,
                           weft_error *err)
{
    static const char *const known[] = {"position_mm", "axis", "exponent", "power", "pump_scale", NULL};
    char place[512];
    snprintf(place, sizeof place, "%s: light %d", file, i);
    if (!json_is_object(object))
        return weft_fail(err, WEFT_ERR_FORMAT, "%s must be an object", place);
    WEFT_TRY(weft_json_refuse_unknown(object, known, of_a_scene, place, err));
    double position[3], axis[3], exponent = 1.2, power = 1, pump = 1;
    WEFT_TRY(weft_json_get_numbers(object, "position_mm", WEFT_JSON_REQUIRED, 3, position, place, err));
    const double distance =
        sqrt(position[0] * position[0] + position[1] * position[1] + position[2] * position[2]);
    if (!(position[2] >= 10 && distance <= 5000))
        return weft_fail(err, WEFT_ERR_RANGE,
                         "%s: \"position_mm\" must be 10 mm or more above the table and "
                         "within 5000 mm of its middle",
                         place);
    for (int k = 0; k < 3; k++)
        axis[k] = -position[k] / distance;
    WEFT_TRY(weft_json_get_numbers(object, "axis", WEFT_JSON_OPTIONAL, 3, axis, place, err));
    if (!(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2] > 0))
        return weft_fail(err, WEFT_ERR_RANGE, "%s: \"axis\" must not be zero", place);
    WEFT_TRY(weft_json_get_number(object, "exponent", WEFT_JSON_OPTIONAL, 0, 50, &exponent, place, err));
    WEFT_TRY(weft_json_get_number(object, "power", WEFT_JSON_OPTIONAL, 0.01, 100, &power, place, err));
    WEFT_TRY(weft_json_get_number(object, "pump_scale", WEFT_JSON_OPTIONAL, 0.5, 2, &pump, place, err));
    memcpy(setup->lights[i].position_mm, position, sizeof position);
    memcpy(setup->lights[i].axis, axis, sizeof axis);
    setup->lights[i].exponent = exponent;
    setup->lights[i].power = power;
    setup->lights[i].pump_scale = pump;
    return WEFT_OK;
}

static weft_err load_lights(const json_t *array, const char *file, weft_rig_setup *setup, weft_error *err)
{
    if (json_array_size(array) != WEFT_RIG_N_LIGHTS)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: \"lights\" has %zu entries; the scanner has %d lights",
                         file, json_array_size(array), WEFT_RIG_N_LIGHTS);
    for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++)
        WEFT_TRY(load_light(json_array_get(array, (size_t)i), file, i, setup, err));
    setup->has_lights = true;
    return WEFT_OK;
}

static weft_err load_sheet(const json_t *object, const char *file, weft_rig_sheet *sheet, weft_error *err)
{
    static const char *const known[] = {"bow_mm", "tilt_deg", "offset_mm", "size_mm", NULL};
    double *const values[] = {sheet->bow_mm, sheet->tilt_deg, sheet->offset_mm, sheet->size_mm};
    static const double most[] = {20, 30, 500, 2000};
    char place[512];
    snprintf(place, sizeof place, "%s: sheet", file);
    WEFT_TRY(weft_json_refuse_unknown(object, known, of_a_scene, place, err));
    for (int k = 0; known[k]; k++) {
        WEFT_TRY(weft_json_get_numbers(object, known[k], WEFT_JSON_OPTIONAL, 2, values[k], place, err));
        if (!(fabs(values[k][0]) <= most[k] && fabs(values[k][1]) <= most[k]))
            return weft_fail(err, WEFT_ERR_RANGE, "%s: \"%s\" beyond %g", place, known[k], most[k]);
    }
    return WEFT_OK;
}

/* Where the strip lies and how much the lamps drift: what a scan has beside the sample. */
static weft_err load_surroundings(const json_t *object, const char *file, weft_rig_setup *setup,
                                  weft_error *err)
{
    const json_t *sheet = NULL;
    const double *const s = setup->strip_mm;
    WEFT_TRY(weft_json_get_number(object, "light_drift", WEFT_JSON_OPTIONAL, 0, 0.5, &setup->light_drift,
                                  file, err));
    WEFT_TRY(weft_json_get_numbers(object, "strip_mm", WEFT_JSON_OPTIONAL, 4, setup->strip_mm, file, err));
    if ((s[0] != 0 || s[1] != 0 || s[2] != 0 || s[3] != 0) && !(s[0] < s[2] && s[1] < s[3]))
        return weft_fail(err, WEFT_ERR_RANGE,
                         "%s: \"strip_mm\" must be left, bottom, right, top of a rectangle", file);
    WEFT_TRY(weft_json_get_object(object, "sheet", WEFT_JSON_OPTIONAL, &sheet, file, err));
    return sheet ? load_sheet(sheet, file, &setup->sheet, err) : WEFT_OK;
}

static weft_err load_scene(const json_t *object, const char *file, weft_rig_setup *setup, weft_error *err)
{
    static const char *const known[] = {
        "weft",       "version",         "seed",   "noise",       "light_jitter_mm", "aim_jitter_deg",
        "room_light", "interreflection", "lights", "light_drift", "strip_mm",        "sheet",
        NULL};
    WEFT_TRY(weft_json_refuse_unknown(object, known, of_a_scene, file, err));
    int seed = (int)setup->seed;
    WEFT_TRY(weft_json_get_int(object, "seed", WEFT_JSON_OPTIONAL, 0, 2147483647, &seed, file, err));
    setup->seed = (uint64_t)seed;
    WEFT_TRY(weft_json_get_bool(object, "noise", WEFT_JSON_OPTIONAL, &setup->noise, file, err));
    WEFT_TRY(weft_json_get_number(object, "light_jitter_mm", WEFT_JSON_OPTIONAL, 0, 30,
                                  &setup->light_jitter_mm, file, err));
    WEFT_TRY(weft_json_get_number(object, "aim_jitter_deg", WEFT_JSON_OPTIONAL, 0, 30, &setup->aim_jitter_deg,
                                  file, err));
    WEFT_TRY(
        weft_json_get_number(object, "room_light", WEFT_JSON_OPTIONAL, 0, 1, &setup->room_light, file, err));
    WEFT_TRY(weft_json_get_bool(object, "interreflection", WEFT_JSON_OPTIONAL, &setup->interreflection, file,
                                err));
    WEFT_TRY(load_surroundings(object, file, setup, err));
    const json_t *lights = NULL;
    WEFT_TRY(weft_json_get_array(object, "lights", WEFT_JSON_OPTIONAL, &lights, file, err));
    return lights ? load_lights(lights, file, setup, err) : WEFT_OK;
}

weft_err weft_rig_setup_load(const char *path, weft_rig_setup *setup, weft_error *err)
{
    json_t *object = NULL;
    weft_rig_setup loaded = *setup;
    WEFT_TRY(weft_json_load_kind(path, "scene", SCENE_VERSION, &object, err));
    const weft_err status = load_scene(object, path, &loaded, err);
    json_decref(object);
    if (status == WEFT_OK)
        *setup = loaded;
    return status;
}
