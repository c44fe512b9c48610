#include "calibration/calibration_colour.h"

#include "core/json.h"

#include <stdio.h>

static weft_err get_root(const json_t *object, weft_colour_model *model, const char *place, weft_error *err)
{
    return weft_json_get_numbers(object, "root_polynomial", WEFT_JSON_REQUIRED, 3 * WEFT_COLOUR_ROOT_TERMS,
                                 model->root[0], place, err);
}

static weft_err get_sequence(const json_t *object, weft_colour_sequence *s, const char *place,
                             weft_error *err)
{
    const json_t *part;
    WEFT_TRY(weft_json_get_object(object, "sequence", WEFT_JSON_REQUIRED, &part, place, err));
    WEFT_TRY(weft_json_get_numbers(part, "first", WEFT_JSON_REQUIRED, 12, s->first[0], place, err));
    WEFT_TRY(weft_json_get_numbers(part, "second", WEFT_JSON_REQUIRED, 12, s->second[0], place, err));
    s->has_cubic = json_object_get(part, "cubic") != NULL;
    if (!s->has_cubic)
        return WEFT_OK;
    WEFT_TRY(weft_json_get_numbers(part, "cubic", WEFT_JSON_REQUIRED, 12, s->cubic[0], place, err));
    WEFT_TRY(weft_json_get_numbers(part, "range", WEFT_JSON_REQUIRED, 6, s->range[0], place, err));
    for (int c = 0; c < 3; c++)
        if (!(s->range[c][0] < s->range[c][1]))
            return weft_fail(err, WEFT_ERR_RANGE, "%s: \"range\" of the cubic is empty", place);
    return WEFT_OK;
}

static weft_err get_method(const json_t *object, weft_colour_model *model, const char *place, weft_error *err)
{
    const char *name = weft_colour_method_name(WEFT_COLOUR_MATRIX);
    WEFT_TRY(weft_json_get_text(object, "method", WEFT_JSON_OPTIONAL, &name, place, err));
    if (!weft_colour_method_from_name(name, &model->method))
        return weft_fail(
            err, WEFT_ERR_UNSUPPORTED,
            "%s: this program does not know the method \"%s\"; make it again with \"weft calibrate "
            "colour\"",
            place, name);
    if (model->method == WEFT_COLOUR_ROOT_POLYNOMIAL)
        return get_root(object, model, place, err);
    return model->method == WEFT_COLOUR_SEQUENCE ? get_sequence(object, &model->sequence, place, err)
                                                 : WEFT_OK;
}

static weft_err get_gamut(const json_t *object, weft_colour_part *colour, const char *place, weft_error *err)
{
    const json_t *array;
    WEFT_TRY(weft_json_get_array(object, "gamut", WEFT_JSON_OPTIONAL, &array, place, err));
    const size_t n = json_array_size(array);
    if (n % 3 != 0 || n / 3 > WEFT_GAMUT_MAX_POINTS)
        return weft_fail(err, WEFT_ERR_RANGE,
                         "%s: \"gamut\" has %zu numbers, wanted 3 a colour for at most %d colours", place, n,
                         WEFT_GAMUT_MAX_POINTS);
    colour->n_gamut = (int)(n / 3);
    if (n == 0)
        return WEFT_OK;
    return weft_json_get_numbers(object, "gamut", WEFT_JSON_REQUIRED, (int)n, colour->gamut[0], place, err);
}

weft_err weft_calibration_colour_from_json(const json_t *object, weft_colour_part *colour, const char *file,
                                           weft_error *err)
{
    char place[1024];
    const weft_json_need maybe = WEFT_JSON_OPTIONAL;
    weft_mat3 inverse;
    const json_t *delta_e;
    snprintf(place, sizeof place, "%s: colour", file);
    WEFT_TRY(weft_json_get_numbers(object, "to_linear_srgb", WEFT_JSON_REQUIRED, 9, colour->model.matrix.m,
                                   place, err));
    if (!weft_mat3_invert(&colour->model.matrix, &inverse))
        return weft_fail(err, WEFT_ERR_RANGE, "%s: \"to_linear_srgb\" is singular", place);
    WEFT_TRY(get_method(object, &colour->model, place, err));
    WEFT_TRY(get_gamut(object, colour, place, err));
    WEFT_TRY(weft_json_get_object(object, "delta_e_2000", maybe, &delta_e, place, err));
    if (!delta_e)
        return WEFT_OK;
    WEFT_TRY(weft_json_get_number(delta_e, "mean", maybe, 0, 1e3, &colour->delta_e_mean, place, err));
    WEFT_TRY(weft_json_get_number(delta_e, "max", maybe, 0, 1e3, &colour->delta_e_max, place, err));
    return weft_json_get_number(delta_e, "held_out_mean", maybe, 0, 1e3, &colour->delta_e_held_out_mean,
                                place, err);
}

static json_t *sequence_json(const weft_colour_sequence *s)
{
    json_t *const object = json_pack("{s:o, s:o}", "first", weft_json_numbers(s->first[0], 12), "second",
                                     weft_json_numbers(s->second[0], 12));
    if (object && s->has_cubic) {
        json_object_set_new(object, "cubic", weft_json_numbers(s->cubic[0], 12));
        json_object_set_new(object, "range", weft_json_numbers(s->range[0], 6));
    }
    return object;
}

json_t *weft_calibration_colour_to_json(const weft_colour_part *colour)
{
    const weft_colour_model *const model = &colour->model;
    json_t *const object = json_pack(
        "{s:s, s:o, s:{s:f, s:f, s:f}}", "method", weft_colour_method_name(model->method), "to_linear_srgb",
        weft_json_numbers(model->matrix.m, 9), "delta_e_2000", "mean", colour->delta_e_mean, "max",
        colour->delta_e_max, "held_out_mean", colour->delta_e_held_out_mean);
    if (!object)
        return NULL;
    if (model->method == WEFT_COLOUR_ROOT_POLYNOMIAL)
        json_object_set_new(object, "root_polynomial",
                            weft_json_numbers(model->root[0], 3 * WEFT_COLOUR_ROOT_TERMS));
    if (model->method == WEFT_COLOUR_SEQUENCE)
        json_object_set_new(object, "sequence", sequence_json(&model->sequence));
    if (colour->n_gamut > 0)
        json_object_set_new(object, "gamut", weft_json_numbers(colour->gamut[0], 3 * colour->n_gamut));
    return object;
}

int weft_calibration_colour_version(const weft_colour_part *colour)
{
    return colour->model.method == WEFT_COLOUR_MATRIX ? 1 : 2;
}
