#include "host/solve/albedo_gamut.h"

#include <stdio.h>

weft_err weft_albedo_gamut_note(const weft_calibration *cal, weft_maps *maps, weft_error *err)
{
    weft_gamut gamut = {0};
    weft_gamut_survey s;
    const weft_colour_part *const colour = &cal->colour;
    if (cal->has_colour && colour->n_gamut > 0)
        weft_gamut_init(&gamut, colour->n_gamut, colour->gamut);
    if (gamut.n_faces == 0)
        return WEFT_OK;
    weft_gamut_look(&gamut, colour->n_gamut, colour->gamut, &maps->albedo, &maps->mask, &s);
    const double all = s.counted > 0 ? (double)s.counted : 1;
    json_t *const note =
        json_pack("{s:f, s:f, s:f, s:f, s:f}", "outside_share", (double)s.outside / all, "darker_share",
                  (double)s.darker / all, "brighter_share", (double)s.brighter / all, "distance_mean",
                  s.distance_mean, "distance_max", s.distance_max);
    if (json_object_set_new(json_object_get(maps->info, "result"), "gamut", note) != 0)
        return weft_fail(err, WEFT_ERR_NOMEM, "out of memory for the description of the maps");
    return WEFT_OK;
}

static double number(const json_t *object, const char *key)
{
    return json_number_value(json_object_get(object, key));
}

void weft_albedo_gamut_words(const weft_maps *maps, char *words, size_t size)
{
    const json_t *const gamut = json_object_get(json_object_get(maps->info, "result"), "gamut");
    const double outside = number(gamut, "outside_share"), darker = number(gamut, "darker_share");
    words[0] = '\0';
    if (outside < 1e-3)
        return;
    const char *const why = 2 * darker > outside                            ? "mostly darker than its black"
                            : 2 * number(gamut, "brighter_share") > outside ? "mostly brighter than its white"
                                                                            : "mostly more saturated";
    snprintf(words, size,
             "%.1f %% of the albedo is outside the chart's gamut, %s, by %.3f in the mean and %.3f at most",
             100 * outside, why, number(gamut, "distance_mean"), number(gamut, "distance_max"));
}
