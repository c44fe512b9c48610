#include "host/cli/preview_lights.h"

#include "core/formats/image_file.h"
#include "shading/brdf/half_vector.h"

#include <math.h>
#include <string.h>

/* The numbers of a lamp behind its word. */
typedef struct numbers_arg {
    weft_numbers numbers;
} numbers_arg;

static const weft_field numbers_field = {
    .key = "lamp", .type = WEFT_FIELD_F64S, .offset = offsetof(numbers_arg, numbers)};

typedef struct lamp_kind {
    const char *word;
    weft_preview_light_kind kind;
    int n; /* numbers without the strength */
} lamp_kind;

static const lamp_kind kinds[] = {{"mm:", WEFT_PREVIEW_POINT, 3},
                                  {"ball:", WEFT_PREVIEW_BALL, 4},
                                  {"tube:", WEFT_PREVIEW_TUBE, 6},
                                  {"", WEFT_PREVIEW_DISTANT, 2}};

static double length(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

#define STRONGEST 1e6

static weft_err check_lamp(const char *text, const weft_preview_light *light, weft_error *err)
{
    double middle[3];
    for (int c = 0; c < 3; c++)
        middle[c] = light->kind == WEFT_PREVIEW_TUBE ? 0.5 * (light->position_mm[c] + light->end_mm[c])
                                                     : light->position_mm[c];
    if (light->kind != WEFT_PREVIEW_DISTANT && !(length(middle) > 0))
        return weft_fail(err, WEFT_ERR_USAGE, "the lamp %s wants X,Y,Z away from the origin", text);
    if (light->kind != WEFT_PREVIEW_DISTANT && !(length(light->position_mm) <= WEFT_PREVIEW_FARTHEST_MM &&
                                                 length(light->end_mm) <= WEFT_PREVIEW_FARTHEST_MM))
        return weft_fail(err, WEFT_ERR_USAGE, "the lamp %s is farther than %g mm; AZ,EL is a distant one",
                         text, WEFT_PREVIEW_FARTHEST_MM);
    if (light->kind == WEFT_PREVIEW_BALL && !(light->radius_mm > 0 && light->radius_mm < length(middle)))
        return weft_fail(err, WEFT_ERR_USAGE,
                         "the lamp %s wants a radius above 0 and below its distance from the origin", text);
    return WEFT_OK;
}

weft_err weft_preview_lamp(const char *text, weft_preview_light *light, weft_error *err)
{
    const lamp_kind *kind = kinds;
    numbers_arg arg = {0};
    while (strncmp(text, kind->word, strlen(kind->word)) != 0)
        kind++;
    *light = (weft_preview_light){.kind = kind->kind};
    if (weft_field_parse(&numbers_field, text + strlen(kind->word), &arg, NULL) != WEFT_OK ||
        arg.numbers.n < kind->n || arg.numbers.n > kind->n + 1)
        return weft_fail(err, WEFT_ERR_USAGE,
                         "no lamp is written %s; wanted AZ,EL or mm:X,Y,Z or ball:X,Y,Z,R or "
                         "tube:X,Y,Z,X,Y,Z, with ,STRENGTH behind if it is not 1",
                         text);
    const double *const v = arg.numbers.values;
    const double strength = arg.numbers.n > kind->n ? v[kind->n] : 1;
    if (!(strength >= 0 && strength <= STRONGEST) || (kind->kind == WEFT_PREVIEW_DISTANT && fabs(v[1]) > 90))
        return weft_fail(err, WEFT_ERR_USAGE,
                         "the lamp %s wants EL from -90 to 90 and a strength from 0 to %g", text, STRONGEST);
    for (int c = 0; c < 3; c++) {
        light->irradiance[c] = WEFT_PI * strength;
        light->position_mm[c] = v[c];
        light->end_mm[c] = kind->n == 6 ? v[3 + c] : v[c];
    }
    light->radius_mm = kind->n == 4 ? v[3] : 0;
    if (kind->kind == WEFT_PREVIEW_DISTANT)
        weft_preview_direction(v[0], v[1], light->direction);
    return check_lamp(text, light, err);
}

static weft_err read_key(const char *text, bool with_hour, weft_polariser_key *key, weft_error *err)
{
    numbers_arg arg = {0};
    char hour[32] = "0";
    const char *const colon = strchr(text, ':');
    if (colon && colon - text < (ptrdiff_t)sizeof hour) {
        memcpy(hour, text, (size_t)(colon - text));
        hour[colon - text] = '\0';
    }
    bool good = !with_hour == !colon && weft_field_parse(&numbers_field, hour, &arg, NULL) == WEFT_OK;
    good = good && arg.numbers.n == 1 && arg.numbers.values[0] >= 0 && arg.numbers.values[0] <= 24;
    key->hour = arg.numbers.values[0];
    good = good && weft_field_parse(&numbers_field, colon ? colon + 1 : text, &arg, NULL) == WEFT_OK &&
           arg.numbers.n == 3;
    for (int c = 0; c < 3 && good; c++) {
        key->factor[c] = arg.numbers.values[c];
        good = key->factor[c] >= 0 && key->factor[c] <= 1;
    }
    return good
               ? WEFT_OK
               : weft_fail(err, WEFT_ERR_USAGE,
                           "--polarise %s: wanted R,G,B from 0 to 1, or several HOUR:R,G,B by ascending hour",
                           text);
}

weft_err weft_preview_polariser(const weft_texts *texts, double hour, double factor[3], weft_error *err)
{
    weft_polariser_key keys[WEFT_TEXTS_MAX] = {{.factor = {1, 1, 1}}};
    for (int k = 0; k < texts->n; k++) {
        WEFT_TRY(read_key(texts->values[k], texts->n > 1 || strchr(texts->values[k], ':'), &keys[k], err));
        if (k > 0 && keys[k].hour < keys[k - 1].hour)
            return weft_fail(err, WEFT_ERR_USAGE,
                             "--polarise %s: its hour is before that of the one in front", texts->values[k]);
    }
    weft_polariser_at(texts->n > 0 ? texts->n : 1, keys, hour, factor);
    return WEFT_OK;
}

weft_err weft_preview_around_init(weft_preview_around *around, const char *file, const weft_numbers *sky_deg,
                                  const weft_sky *sky, const weft_sky_filter *filter, weft_error *err)
{
    weft_image panorama = {0};
    *around = (weft_preview_around){0};
    if (file) {
        WEFT_TRY(weft_image_read(file, WEFT_TRANSFER_SRGB, &panorama, err));
    } else {
        if (sky_deg->n != 2 || !(sky_deg->values[1] >= 0 && sky_deg->values[1] <= 90))
            return weft_fail(err, WEFT_ERR_USAGE, "--sky wants AZ,EL of the sun in degrees, EL from 0 to 90");
        WEFT_TRY(weft_environment_paint_sky(&panorama, sky, (90 - sky_deg->values[1]) * WEFT_PI / 180,
                                            sky_deg->values[0] * WEFT_PI / 180, err));
    }
    weft_err status = weft_environment_map_init_filtered(&around->map, &panorama, filter, err);
    weft_image_fini(&panorama);
    if (status != WEFT_OK)
        return file ? weft_prefix(err, status, "%s", file) : status;
    weft_environment_table_get(&around->table, WEFT_ENVIRONMENT_SMITH);
    return WEFT_OK;
}

void weft_preview_around_fini(weft_preview_around *around)
{
    weft_environment_map_fini(&around->map);
}
