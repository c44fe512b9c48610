#include "host/cli/preview_options.h"

#include "host/cli/preview_lights.h"

#include "core/file.h"
#include "core/formats/image_file.h"
#include "shading/preview/tone.h"

#include <math.h>
#include <string.h>

const weft_field weft_preview_fields[] = {
    {.key = "output",
     .short_opt = 'o',
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(weft_preview_options, output),
     .unit = "IMAGE",
     .required = true,
     .help = "picture to write: PNG or TIFF in sRGB, EXR linear"},
    {.key = "brdf",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(weft_preview_options, brdf),
     .unit = "NAME",
     .def = "lambert",
     .help = "reflectance model; \"weft brdf\" lists them"},
    {.key = "param",
     .short_opt = 'p',
     .type = WEFT_FIELD_TEXTS,
     .offset = offsetof(weft_preview_options, params),
     .unit = "NAME=VALUE",
     .help = "a parameter of the model: a number, r,g,b or a picture; may be given several times"},
    {.key = "light",
     .type = WEFT_FIELD_F64S,
     .offset = offsetof(weft_preview_options, light),
     .unit = "AZ,EL",
     .def = "135,45",
     .help = "distant light: degrees from +X (90 is up in the picture), degrees above the plane"},
    {.key = "light-mm",
     .type = WEFT_FIELD_F64S,
     .offset = offsetof(weft_preview_options, light_mm),
     .unit = "X,Y,Z",
     .help = "a light at a place in mm instead; inverse square, 1 at the origin"},
    {.key = "lamp",
     .type = WEFT_FIELD_TEXTS,
     .offset = offsetof(weft_preview_options, lamps),
     .unit = "LAMP",
     .help = "in place of --light, several times: AZ,EL or mm:X,Y,Z or ball:X,Y,Z,R or tube:X,Y,Z,X,Y,Z, "
             "with ,STRENGTH; none: no lamp"},
    {.key = "area",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(weft_preview_options, area),
     .choices = "points|representative",
     .def = "points",
     .help =
         "balls and tubes as 24 points, or as the one point of Unreal's notes (ggx, ggx-specular, beckmann)"},
    {.key = "env",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(weft_preview_options, env),
     .unit = "FILE",
     .help = "light from all round: an equirectangular panorama, EXR, or PNG or TIFF in sRGB"},
    {.key = "sky",
     .type = WEFT_FIELD_F64S,
     .offset = offsetof(weft_preview_options, sky),
     .unit = "AZ,EL",
     .help = "light from a clear sky with the sun there (its disc is a --lamp): a level white card reads 1"},
    {.key = "sky-model",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(weft_preview_options, sky_model),
     .choices = "cie-clear|far-cry-3",
     .def = "cie-clear",
     .help = "the constants of the sky"},
    {.key = "polarise",
     .type = WEFT_FIELD_TEXTS,
     .offset = offsetof(weft_preview_options, polarise),
     .unit = "R,G,B",
     .help = "Far Cry 3's polarising filter: a factor on the sky that is mirrored, not on the diffuse light; "
             "several HOUR:R,G,B are a day"},
    {.key = "hour",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(weft_preview_options, hour),
     .min = 0,
     .max = 24,
     .def = "12",
     .help = "of the day, between the keys of --polarise"},
    {.key = "ambient-saturation",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(weft_preview_options, ambient_saturation),
     .min = 0,
     .max = 1,
     .def = "1",
     .help = "of the diffuse light of --env and --sky; 0 is grey"},
    {.key = "env-scale",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(weft_preview_options, env_scale),
     .min = 0,
     .max = 1e6,
     .def = "1",
     .help = "factor on the light of --env and --sky"},
    {.key = "tone",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(weft_preview_options, tone),
     .choices = weft_tone_names,
     .def = "none",
     .help = "tone curve: cut at white, or like ACES or AgX"},
    {.key = "sweep",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(weft_preview_options, sweep),
     .min = 0,
     .max = 999,
     .def = "0",
     .help = "so many pictures, the lamps going once round the z axis: NAME-000.png on, or one NAME.webp"},
    {.key = "turntable",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(weft_preview_options, turntable),
     .min = 0,
     .max = 999,
     .def = "0",
     .help = "so many pictures, the sample going once round under lamps and camera that stay"},
    {.key = "fps",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(weft_preview_options, fps),
     .min = 0.1,
     .max = 100,
     .def = "12",
     .help = "frames a second of a WebP"},
    {.key = "quality",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(weft_preview_options, quality),
     .min = 0,
     .max = 100,
     .def = "90",
     .help = "of a WebP; 100 is lossless"},
    {.key = "resume",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(weft_preview_options, resume),
     .help = "keep the frames that an interrupted run has left, when its options and maps are the same"},
    {.key = "columns",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(weft_preview_options, columns),
     .unit = "WHAT",
     .help = "a grid: a row for each model of --brdf A,B, a column for each lamp (\"lamps\") or NAME=V,V"},
    {.key = "shape",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(weft_preview_options, shape),
     .choices = "plane|sphere|cylinder|drape",
     .def = "plane",
     .help = "as it lies, on a ball, round a roll, or hung in folds"},
    {.key = "size",
     .type = WEFT_FIELD_SIZE,
     .offset = offsetof(weft_preview_options, size),
     .help = "of the picture; without it a plane keeps its pixels up to 1600, a ball gets 768x768"},
    {.key = "crop",
     .type = WEFT_FIELD_F64S,
     .offset = offsetof(weft_preview_options, crop),
     .unit = "X,Y,W,H",
     .help = "show only this rectangle of the map, in its pixels"},
    {.key = "exposure",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(weft_preview_options, exposure_ev),
     .unit = "EV",
     .min = -20,
     .max = 20,
     .def = "0",
     .help = "at 0 a white card that faces the light is just white"},
    {.key = "ambient",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(weft_preview_options, ambient),
     .min = 0,
     .max = 10,
     .def = "0.02",
     .help = "light from all round, against that of a white sky"},
    {.key = "background",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(weft_preview_options, background),
     .min = 0,
     .max = 1,
     .def = "0.18",
     .help = "linear grey beside the sample"},
    {.key = "repeat",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(weft_preview_options, repeat),
     .min = 0.01,
     .max = 100,
     .def = "1",
     .help = "ball: how often the shorter side of the map fits half round"},
    {.key = "fov",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(weft_preview_options, fov_deg),
     .unit = "deg",
     .min = 0,
     .max = 120,
     .def = "0",
     .help = "field of view of the camera; 0 sees everything straight on"},
    {.key = "watch",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(weft_preview_options, watch),
     .help =
         "draw again whenever INPUT or a picture of --param, --env or --height-map changes, until Ctrl-C"},
    {.key = "draft",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(weft_preview_options, draft),
     .help = "one sample a pixel: quick, and right for materials, whose mips are filtered"},
    {.key = "self-shadow",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(weft_preview_options, self_shadow),
     .help = "the cloth's height map throws shadows on the cloth: from solve --height, or the material's"},
    {.key = "height-map",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(weft_preview_options, height_map),
     .unit = "FILE",
     .help = "the heights of --self-shadow in mm (EXR), in place of those of INPUT"},
    {.key = "shadow-steps",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(weft_preview_options, shadow_steps),
     .min = 1,
     .max = 4096,
     .def = "64",
     .help = "looks at most along a ray through the relief; fewer are quicker and coarser"},
    {.key = "shadow-blur",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(weft_preview_options, shadow_blur),
     .choices = "coarse|always|never",
     .def = "coarse",
     .help = "dither and blur shadows where a ray is coarse or a lamp large, or everywhere, or nowhere"},
    {.key = "accumulate",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(weft_preview_options, accumulate),
     .min = 1,
     .max = 1024,
     .def = "1",
     .help = "looks for each shadow, with other dithers and places on the lamps: their mean is soft"},
    {.key = "sun-disc",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(weft_preview_options, sun_disc_deg),
     .unit = "deg",
     .min = 0,
     .max = 30,
     .def = "0.27",
     .help = "half angle of distant lamps under --accumulate or --temporal; the default is the sun's"},
    {.key = "temporal",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(weft_preview_options, temporal),
     .help = "shadows of a sequence remember the frame before: less flicker from few steps"},
    {.key = "folds",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(weft_preview_options, folds),
     .choices = "formula|marched|walked",
     .def = "formula",
     .help = "shadows of the drape's folds: by their formula, or through a grid of voxels"},
    {.key = "voxels",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(weft_preview_options, voxels),
     .min = 8,
     .max = 512,
     .def = "128",
     .help = "of that grid, along the drape's width"},
    {.key = "filter",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(weft_preview_options, filter),
     .choices = weft_preview_filter_names,
     .def = "anisotropic",
     .help = "materials: every texel shaded, or their mips looked up by the pixel's footprint"},
    {.key = "taps",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(weft_preview_options, taps),
     .min = 1,
     .max = WEFT_PREVIEW_MAX_TAPS,
     .def = "8",
     .help = "most look-ups along a footprint of --filter anisotropic"},
    {.key = "fog",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(weft_preview_options, fog),
     .min = 0,
     .max = 1000,
     .def = "0",
     .help = "light in the air before the sample: optical depth of the box around it, 0.3 is a haze"},
    {.key = "fog-g",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(weft_preview_options, fog_g),
     .min = -0.99,
     .max = 0.99,
     .def = "0.5",
     .help = "how far the air scatters forwards: above 0 it glows around the lamps"},
    {.key = "fog-steps",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(weft_preview_options, fog_steps),
     .min = 1,
     .max = 4096,
     .def = "12",
     .help = "looks along each ray through the air"},
    {.key = "fog-even",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(weft_preview_options, fog_even),
     .help = "a glow of one strength whatever the distance, which dims nothing"},
    {.key = "match",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(weft_preview_options, match),
     .unit = "SET",
     .help = "render each light of this set with --calibration and compare with its photographs"},
    {.key = "calibration",
     .short_opt = 'c',
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(weft_preview_options, cal),
     .unit = "CAL",
     .help = "where the lights of --match are"},
    {0},
};

static weft_err set_light(weft_preview_light *light, const weft_preview_options *a, weft_error *err)
{
    if (a->light_mm.n) {
        const double *const v = a->light_mm.values, far_mm = hypot(hypot(v[0], v[1]), v[2]);
        if (a->light_mm.n != 3 || !(far_mm > 0 && far_mm <= WEFT_PREVIEW_FARTHEST_MM))
            return weft_fail(err, WEFT_ERR_USAGE,
                             "--light-mm wants X,Y,Z away from the origin and within %g mm",
                             WEFT_PREVIEW_FARTHEST_MM);
        light->kind = WEFT_PREVIEW_POINT;
        for (int c = 0; c < 3; c++)
            light->position_mm[c] = a->light_mm.values[c];
        return WEFT_OK;
    }
    if (a->light.n != 2 || fabs(a->light.values[1]) > 90)
        return weft_fail(err, WEFT_ERR_USAGE, "--light wants AZ,EL in degrees, EL from -90 to 90");
    weft_preview_direction(a->light.values[0], a->light.values[1], light->direction);
    return WEFT_OK;
}

static weft_err set_crop(weft_preview_crop *crop, const weft_numbers *given, weft_error *err)
{
    const double *const v = given->values;
    if (given->n == 0)
        return WEFT_OK;
    for (int i = 0; i < given->n; i++)
        if (v[i] != (int)v[i] || v[i] < (i < 2 ? 0 : 1) || v[i] > WEFT_IMAGE_MAX_SIDE)
            return weft_fail(err, WEFT_ERR_USAGE, "--crop wants whole pixels X,Y,W,H");
    if (given->n != 4)
        return weft_fail(err, WEFT_ERR_USAGE, "--crop wants four numbers X,Y,W,H");
    *crop = (weft_preview_crop){(int)v[0], (int)v[1], (int)v[2], (int)v[3]};
    return WEFT_OK;
}

bool weft_preview_is_sequence(const weft_preview_options *a)
{
    return a->sweep || a->turntable;
}

weft_err weft_preview_options_view(const weft_preview_options *a, weft_preview_view *view, weft_error *err)
{
    const bool none = a->lamps.n == 1 && strcmp(a->lamps.values[0], "none") == 0;
    if (a->lamps.n > WEFT_PREVIEW_MAX_LIGHTS)
        return weft_fail(err, WEFT_ERR_USAGE, "at most %d lamps can shine", WEFT_PREVIEW_MAX_LIGHTS);
    if (a->env && a->sky.n)
        return weft_fail(err, WEFT_ERR_USAGE, "--env and --sky are two ways to say the same thing");
    if (a->lamps.n == 0)
        WEFT_TRY(set_light(&view->lights[0], a, err));
    for (int k = 0; k < a->lamps.n && !none; k++)
        WEFT_TRY(weft_preview_lamp(a->lamps.values[k], &view->lights[k], err));
    view->n_lights = none ? 0 : a->lamps.n ? a->lamps.n : 1;
    for (int k = 0; k < view->n_lights; k++)
        view->lights[k].area = (weft_preview_area)a->area;
    WEFT_TRY(set_crop(&view->crop, &a->crop, err));
    view->shape = (weft_preview_shape)a->shape;
    view->exposure_ev = a->exposure_ev;
    view->ambient = a->ambient;
    view->background = a->background;
    view->repeat = a->repeat;
    view->fov_deg = a->fov_deg;
    view->draft = a->draft;
    view->fog =
        (weft_preview_fog){.depth = a->fog, .g = a->fog_g, .steps = a->fog_steps, .even = a->fog_even};
    view->shadows = (weft_preview_shadows){.relief = a->self_shadow,
                                           .blur = (weft_preview_blur)a->shadow_blur,
                                           .steps = a->shadow_steps,
                                           .folds = (weft_preview_folds)a->folds,
                                           .accumulate = a->accumulate,
                                           .disc_rad = a->sun_disc_deg * 3.14159265358979323846 / 180,
                                           .voxels = a->voxels,
                                           .voxel_steps = a->voxels < 32 ? 8 : a->voxels / 4};
    view->filter = (weft_preview_filter)a->filter;
    view->max_taps = a->taps;
    return WEFT_OK;
}

weft_err weft_preview_options_check(const weft_preview_options *a, bool input, weft_error *err)
{
    if (a->self_shadow && (a->match || a->columns))
        return weft_fail(err, WEFT_ERR_USAGE, "--self-shadow goes with neither --match nor --columns");
    if (a->height_map && !a->self_shadow)
        return weft_fail(err, WEFT_ERR_USAGE, "--height-map wants --self-shadow");
    if (a->polarise.n && !a->env && !a->sky.n)
        return weft_fail(err, WEFT_ERR_USAGE, "--polarise wants a --sky or --env to filter");
    if (weft_preview_is_sequence(a) && (a->match || a->columns || (a->sweep && a->turntable)))
        return weft_fail(err, WEFT_ERR_USAGE,
                         "--sweep and --turntable go neither with each other nor with --match or --columns");
    if (a->temporal && !weft_preview_is_sequence(a))
        return weft_fail(err, WEFT_ERR_USAGE, "--temporal wants --sweep N or --turntable N");
    if (!weft_preview_is_sequence(a) && (a->resume || weft_path_has_suffix(a->output, ".webp")))
        return weft_fail(err, WEFT_ERR_USAGE, "--resume and a .webp want --sweep N or --turntable N");
    if (a->watch && (a->match || weft_preview_is_sequence(a)))
        return weft_fail(err, WEFT_ERR_USAGE,
                         "--watch draws one picture again; it goes with neither --match, --sweep nor "
                         "--turntable");
    if (!weft_path_has_suffix(a->output, ".webp"))
        WEFT_TRY(weft_image_check_name(a->output, err));
    if (!a->columns && strchr(a->brdf, ',') && !weft_path_has_suffix(a->brdf, ".binary"))
        return weft_fail(err, WEFT_ERR_USAGE, "several models of --brdf want --columns: each is a row");
    if (!a->match != !a->cal)
        return weft_fail(err, WEFT_ERR_USAGE, "--match SET and --calibration CAL go together");
    if (a->match && !input)
        return weft_fail(err, WEFT_ERR_USAGE, "--match wants the INPUT that was solved from the set");
    return WEFT_OK;
}
