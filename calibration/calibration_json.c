#include "calibration/calibration_json.h"

#include "calibration/calibration_colour.h"
#include "core/json.h"

#include <stdio.h>
#include <string.h>

#define FAR_MM 1e7 /* ten kilometres: beyond it a number is a mistake of units */

static const char *const known_keys[] = {"weft",   "version",    "created", "camera", "linearity",
                                         "lights", "light_grid", "colour",  NULL};

static weft_vec3 vec3(const double v[3])
{
    return (weft_vec3){v[0], v[1], v[2]};
}

static json_t *vec3_json(weft_vec3 v)
{
    return weft_json_numbers((const double[]){v.x, v.y, v.z}, 3);
}

/* A unit vector, renormalised; people write three digits, so 1 % off is taken for rounding. */
static weft_err get_unit(const json_t *object, const char *key, weft_vec3 *unit, const char *place,
                         weft_error *err)
{
    double v[3];
    WEFT_TRY(weft_json_get_numbers(object, key, WEFT_JSON_REQUIRED, 3, v, place, err));
    const double length = weft_length(vec3(v));
    if (!(length > 0.99 && length < 1.01))
        return weft_fail(err, WEFT_ERR_RANGE, "%s: \"%s\" has length %g, wanted a unit vector", place, key,
                         length);
    *unit = weft_normalise(vec3(v));
    return WEFT_OK;
}

static bool is_rotation(const weft_mat3 *r)
{
    const weft_mat3 t = weft_mat3_transpose(r), p = weft_mat3_multiply(r, &t);
    double worst = fabs(weft_mat3_determinant(r) - 1);
    for (int i = 0; i < 9; i++)
        worst = fmax(worst, fabs(p.m[i] - (i % 4 == 0)));
    return worst < 1e-3;
}

static weft_err get_pose(const json_t *object, weft_camera *camera, const char *place, weft_error *err)
{
    double t[3];
    camera->has_pose = json_object_get(object, "rotation") || json_object_get(object, "translation_mm");
    if (!camera->has_pose)
        return WEFT_OK;
    WEFT_TRY(
        weft_json_get_numbers(object, "rotation", WEFT_JSON_REQUIRED, 9, camera->rotation.m, place, err));
    WEFT_TRY(weft_json_get_numbers(object, "translation_mm", WEFT_JSON_REQUIRED, 3, t, place, err));
    camera->translation = vec3(t);
    if (!is_rotation(&camera->rotation))
        return weft_fail(err, WEFT_ERR_RANGE, "%s: \"rotation\" is not a rotation matrix (row by row)",
                         place);
    if (!(weft_length(camera->translation) < FAR_MM))
        return weft_fail(err, WEFT_ERR_RANGE, "%s: \"translation_mm\" is farther than %g mm", place, FAR_MM);
    return WEFT_OK;
}

static weft_err get_camera(const json_t *object, weft_camera *camera, const char *file, weft_error *err)
{
    const weft_json_need need = WEFT_JSON_REQUIRED;
    char place[1024];
    snprintf(place, sizeof place, "%s: camera", file);
    WEFT_TRY(weft_json_get_int(object, "width", need, 1, WEFT_IMAGE_MAX_SIDE, &camera->width, place, err));
    WEFT_TRY(weft_json_get_int(object, "height", need, 1, WEFT_IMAGE_MAX_SIDE, &camera->height, place, err));
    WEFT_TRY(weft_json_get_number(object, "fx", need, 1e-3, 1e8, &camera->fx, place, err));
    WEFT_TRY(weft_json_get_number(object, "fy", need, 1e-3, 1e8, &camera->fy, place, err));
    WEFT_TRY(weft_json_get_number(object, "cx", need, -1e6, 1e6, &camera->cx, place, err));
    WEFT_TRY(weft_json_get_number(object, "cy", need, -1e6, 1e6, &camera->cy, place, err));
    /* Five coefficients, or eight of the rational model. */
    const int n_distortion =
        json_array_size(json_object_get(object, "distortion")) == WEFT_DISTORTION ? WEFT_DISTORTION : 5;
    WEFT_TRY(weft_json_get_numbers(object, "distortion", WEFT_JSON_OPTIONAL, n_distortion, camera->distortion,
                                   place, err));
    WEFT_TRY(weft_json_get_number(object, "rms_px", WEFT_JSON_OPTIONAL, 0, 1e6, &camera->rms_px, place, err));
    return get_pose(object, camera, place, err);
}

static weft_err get_linearity(const json_t *object, weft_linearity *linearity, const char *file,
                              weft_error *err)
{
    char place[1024];
    snprintf(place, sizeof place, "%s: linearity", file);
    const json_t *const curve = json_object_get(object, "curve");
    if (curve && !json_is_null(curve))
        return weft_fail(err, WEFT_ERR_UNSUPPORTED,
                         "%s: \"curve\" is not null, but this program only takes linear sensors; make it "
                         "again with \"weft calibrate linearity\"",
                         place);
    WEFT_TRY(weft_json_get_numbers(object, "range", WEFT_JSON_REQUIRED, 2, linearity->range, place, err));
    if (!(linearity->range[0] < linearity->range[1]))
        return weft_fail(err, WEFT_ERR_RANGE, "%s: \"range\" is empty (%g to %g)", place, linearity->range[0],
                         linearity->range[1]);
    return weft_json_get_number(object, "max_deviation", WEFT_JSON_OPTIONAL, 0, 1e3,
                                &linearity->max_deviation, place, err);
}

static weft_err get_near_light(const json_t *object, weft_light *light, const char *place, weft_error *err)
{
    double p[3];
    WEFT_TRY(weft_json_get_numbers(object, "position_mm", WEFT_JSON_REQUIRED, 3, p, place, err));
    light->position = vec3(p);
    if (!(weft_length(light->position) < FAR_MM))
        return weft_fail(err, WEFT_ERR_RANGE,
                         "%s: \"position_mm\" is farther than %g mm; a distant light has \"direction\"",
                         place, FAR_MM);
    light->axis = weft_scale(weft_normalise(light->position), -1);
    if (json_object_get(object, "axis"))
        WEFT_TRY(get_unit(object, "axis", &light->axis, place, err));
    return weft_json_get_number(object, "exponent", WEFT_JSON_OPTIONAL, 0, 1e3, &light->exponent, place, err);
}

static weft_err get_light(const json_t *object, weft_light *light, const char *place, weft_error *err)
{
    *light = (weft_light){.intensity = {1, 1, 1}, .white_balance = {1, 1, 1}};
    light->distant = json_object_get(object, "direction") != NULL;
    if (light->distant)
        WEFT_TRY(get_unit(object, "direction", &light->direction, place, err));
    else
        WEFT_TRY(get_near_light(object, light, place, err));
    const weft_json_need maybe = WEFT_JSON_OPTIONAL;
    WEFT_TRY(weft_json_get_numbers(object, "intensity", maybe, 3, light->intensity, place, err));
    WEFT_TRY(weft_json_get_numbers(object, "white_balance", maybe, 3, light->white_balance, place, err));
    for (int c = 0; c < 3; c++)
        if (!(light->intensity[c] > 0 && light->white_balance[c] > 0))
            return weft_fail(err, WEFT_ERR_RANGE, "%s: intensity and white_balance must be above 0", place);
    WEFT_TRY(weft_json_get_number(object, "position_sigma_mm", maybe, 0, FAR_MM, &light->position_sigma_mm,
                                  place, err));
    return weft_json_get_number(object, "residual", maybe, 0, 1e6, &light->residual, place, err);
}

static weft_err get_lights(const json_t *array, weft_calibration *cal, const char *file, weft_error *err)
{
    const size_t n = json_array_size(array);
    if (n < 1 || n > WEFT_LIGHTS_MAX)
        return weft_fail(err, WEFT_ERR_RANGE, "%s: has %zu lights, wanted 1 to %d", file, n, WEFT_LIGHTS_MAX);
    for (size_t i = 0; i < n; i++) {
        char place[1024];
        snprintf(place, sizeof place, "%s: light %zu", file, i);
        const json_t *const light = json_array_get(array, i);
        if (!json_is_object(light))
            return weft_fail(err, WEFT_ERR_FORMAT, "%s: is not an object", place);
        WEFT_TRY(get_light(light, &cal->lights[i], place, err));
    }
    cal->n_lights = (int)n;
    return WEFT_OK;
}

static weft_err get_grid(const json_t *object, weft_calibration *cal, const char **grid_file,
                         const char *file, weft_error *err)
{
    char place[1024];
    snprintf(place, sizeof place, "%s: light_grid", file);
    WEFT_TRY(weft_json_get_text(object, "file", WEFT_JSON_REQUIRED, grid_file, place, err));
    WEFT_TRY(
        weft_json_get_int(object, "columns", WEFT_JSON_REQUIRED, 2, 4096, &cal->grid.columns, place, err));
    WEFT_TRY(weft_json_get_int(object, "rows", WEFT_JSON_REQUIRED, 2, 4096, &cal->grid.rows, place, err));
    if (!**grid_file || strchr(*grid_file, '/'))
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: \"file\" must name a file in the same folder", place);
    if (!cal->has_camera || !cal->has_lights)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: is there without the camera and the lights it is for",
                         place);
    return WEFT_OK;
}

static bool is_known(const char *key)
{
    for (const char *const *k = known_keys; *k; k++)
        if (strcmp(*k, key) == 0)
            return true;
    return false;
}

static weft_err get_other(const json_t *root, weft_calibration *cal, const char *place, weft_error *err)
{
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)root, key, value) /* does not change it: Jansson's macro lacks the const */
    {
        if (is_known(key))
            continue;
        if (!cal->other)
            cal->other = json_object();
        if (!cal->other || json_object_set(cal->other, key, value) != 0)
            return weft_fail(err, WEFT_ERR_NOMEM, "%s: out of memory", place);
    }
    return WEFT_OK;
}

weft_err weft_calibration_from_json(const json_t *root, const char *place, weft_calibration *cal,
                                    const char **grid_file, weft_error *err)
{
    const weft_json_need maybe = WEFT_JSON_OPTIONAL;
    const char *created = "";
    const json_t *camera, *linearity, *lights, *grid, *colour;
    WEFT_TRY(weft_json_get_text(root, "created", maybe, &created, place, err));
    WEFT_TRY(weft_json_get_object(root, "camera", maybe, &camera, place, err));
    WEFT_TRY(weft_json_get_object(root, "linearity", maybe, &linearity, place, err));
    WEFT_TRY(weft_json_get_array(root, "lights", maybe, &lights, place, err));
    WEFT_TRY(weft_json_get_object(root, "light_grid", maybe, &grid, place, err));
    WEFT_TRY(weft_json_get_object(root, "colour", maybe, &colour, place, err));
    snprintf(cal->created, sizeof cal->created, "%.*s", (int)sizeof cal->created - 1, created);
    *grid_file = NULL;
    if (camera)
        WEFT_TRY(get_camera(camera, &cal->camera, place, err));
    cal->has_camera = camera;
    if (linearity)
        WEFT_TRY(get_linearity(linearity, &cal->linearity, place, err));
    cal->has_linearity = linearity;
    if (lights)
        WEFT_TRY(get_lights(lights, cal, place, err));
    cal->has_lights = lights;
    if (grid)
        WEFT_TRY(get_grid(grid, cal, grid_file, place, err));
    if (colour)
        WEFT_TRY(weft_calibration_colour_from_json(colour, &cal->colour, place, err));
    cal->has_colour = colour;
    return get_other(root, cal, place, err);
}

static json_t *camera_json(const weft_camera *c)
{
    const bool rational = c->distortion[5] != 0 || c->distortion[6] != 0 || c->distortion[7] != 0;
    json_t *const object =
        json_pack("{s:i, s:i, s:f, s:f, s:f, s:f, s:o, s:f}", "width", c->width, "height", c->height, "fx",
                  c->fx, "fy", c->fy, "cx", c->cx, "cy", c->cy, "distortion",
                  weft_json_numbers(c->distortion, rational ? WEFT_DISTORTION : 5), "rms_px", c->rms_px);
    if (object && c->has_pose) {
        json_object_set_new(object, "rotation", weft_json_numbers(c->rotation.m, 9));
        json_object_set_new(object, "translation_mm", vec3_json(c->translation));
    }
    return object;
}

static json_t *light_json(const weft_light *light)
{
    json_t *const object = light->distant
                               ? json_pack("{s:o}", "direction", vec3_json(light->direction))
                               : json_pack("{s:o, s:o, s:f}", "position_mm", vec3_json(light->position),
                                           "axis", vec3_json(light->axis), "exponent", light->exponent);
    if (!object)
        return NULL;
    json_object_set_new(object, "intensity", weft_json_numbers(light->intensity, 3));
    json_object_set_new(object, "white_balance", weft_json_numbers(light->white_balance, 3));
    if (light->position_sigma_mm > 0)
        json_object_set_new(object, "position_sigma_mm", json_real(light->position_sigma_mm));
    if (light->residual > 0)
        json_object_set_new(object, "residual", json_real(light->residual));
    return object;
}

static json_t *lights_json(const weft_calibration *cal)
{
    json_t *const array = json_array();
    for (int i = 0; array && i < cal->n_lights; i++)
        json_array_append_new(array, light_json(&cal->lights[i]));
    return array;
}

json_t *weft_calibration_to_json(const weft_calibration *cal, const char *created, const char *grid_file)
{
    /* The lowest version that says it all: programs that know no more can still read it. */
    const int version = cal->has_colour ? weft_calibration_colour_version(&cal->colour) : 1;
    json_t *const root =
        json_pack("{s:s, s:i, s:s}", "weft", "calibration", "version", version, "created", created);
    if (!root)
        return NULL;
    if (cal->has_camera)
        json_object_set_new(root, "camera", camera_json(&cal->camera));
    if (cal->has_linearity)
        json_object_set_new(root, "linearity",
                            json_pack("{s:o, s:f, s:n}", "range", weft_json_numbers(cal->linearity.range, 2),
                                      "max_deviation", cal->linearity.max_deviation, "curve"));
    if (cal->has_lights)
        json_object_set_new(root, "lights", lights_json(cal));
    if (grid_file)
        json_object_set_new(root, "light_grid",
                            json_pack("{s:s, s:i, s:i}", "file", grid_file, "columns", cal->grid.columns,
                                      "rows", cal->grid.rows));
    if (cal->has_colour)
        json_object_set_new(root, "colour", weft_calibration_colour_to_json(&cal->colour));
    if (cal->other)
        json_object_update_missing(root, cal->other);
    return root;
}
