#include "host/cli/command.h"
#include "host/cli/preview_grid.h"
#include "host/cli/preview_input.h"
#include "host/cli/preview_lights.h"
#include "host/cli/preview_match.h"
#include "host/cli/preview_sequence.h"

#include "core/file.h"
#include "core/formats/image_file.h"
#include "core/mem.h"

#include <math.h>
#include <string.h>
#include <time.h>

#define LONGEST_SIDE 1600 /* of a plane without --size */

typedef struct preview_args {
    const char *output, *brdf, *match, *cal, *env, *columns;
    weft_texts params, lamps, polarise;
    weft_numbers light, light_mm, crop, sky;
    int shape, area, sky_model, tone, sweep, turntable, quality, shadow_steps, shadow_blur, folds, voxels,
        accumulate, fog_steps;
    bool draft, self_shadow, resume, temporal, fog_even;
    const char *height_map;
    int filter, taps;
    weft_size size;
    double fog, fog_g, sun_disc_deg, hour, ambient_saturation, fps, exposure_ev, env_scale, ambient,
        background, repeat, fov_deg;
} preview_args;

static const weft_field fields[] = {
    {.key = "output",
     .short_opt = 'o',
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(preview_args, output),
     .unit = "IMAGE",
     .required = true,
     .help = "picture to write: PNG or TIFF in sRGB, EXR linear"},
    {.key = "brdf",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(preview_args, brdf),
     .unit = "NAME",
     .def = "lambert",
     .help = "reflectance model; \"weft brdf\" lists them"},
    {.key = "param",
     .short_opt = 'p',
     .type = WEFT_FIELD_TEXTS,
     .offset = offsetof(preview_args, params),
     .unit = "NAME=VALUE",
     .help = "a parameter of the model: a number, r,g,b or a picture; may be given several times"},
    {.key = "light",
     .type = WEFT_FIELD_F64S,
     .offset = offsetof(preview_args, light),
     .unit = "AZ,EL",
     .def = "135,45",
     .help = "distant light: degrees from +X (90 is up in the picture), degrees above the plane"},
    {.key = "light-mm",
     .type = WEFT_FIELD_F64S,
     .offset = offsetof(preview_args, light_mm),
     .unit = "X,Y,Z",
     .help = "a light at a place in mm instead; inverse square, 1 at the origin"},
    {.key = "lamp",
     .type = WEFT_FIELD_TEXTS,
     .offset = offsetof(preview_args, lamps),
     .unit = "LAMP",
     .help = "in place of --light, several times: AZ,EL or mm:X,Y,Z or ball:X,Y,Z,R or tube:X,Y,Z,X,Y,Z, "
             "with ,STRENGTH; none: no lamp"},
    {.key = "area",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(preview_args, area),
     .choices = "points|representative",
     .def = "points",
     .help = "balls and tubes as 24 points, or as the one point of Unreal's notes"},
    {.key = "env",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(preview_args, env),
     .unit = "FILE",
     .help = "light from all round: an equirectangular panorama, EXR, or PNG or TIFF in sRGB"},
    {.key = "sky",
     .type = WEFT_FIELD_F64S,
     .offset = offsetof(preview_args, sky),
     .unit = "AZ,EL",
     .help = "light from a clear sky with the sun there (its disc is a --lamp): a level white card reads 1"},
    {.key = "sky-model",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(preview_args, sky_model),
     .choices = "cie-clear|far-cry-3",
     .def = "cie-clear",
     .help = "the constants of the sky"},
    {.key = "polarise",
     .type = WEFT_FIELD_TEXTS,
     .offset = offsetof(preview_args, polarise),
     .unit = "R,G,B",
     .help = "Far Cry 3's polarising filter: a factor on the sky that is mirrored, not on the diffuse light; "
             "several HOUR:R,G,B are a day"},
    {.key = "hour",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(preview_args, hour),
     .min = 0,
     .max = 24,
     .def = "12",
     .help = "of the day, between the keys of --polarise"},
    {.key = "ambient-saturation",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(preview_args, ambient_saturation),
     .min = 0,
     .max = 1,
     .def = "1",
     .help = "of the diffuse light of --env and --sky; 0 is grey"},
    {.key = "env-scale",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(preview_args, env_scale),
     .min = 0,
     .max = 1e6,
     .def = "1",
     .help = "factor on the light of --env and --sky"},
    {.key = "tone",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(preview_args, tone),
     .choices = weft_tone_names,
     .def = "none",
     .help = "tone curve: cut at white, or like ACES or AgX"},
    {.key = "sweep",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(preview_args, sweep),
     .min = 0,
     .max = 999,
     .def = "0",
     .help = "so many pictures, the lamps going once round the z axis: NAME-000.png on, or one NAME.webp"},
    {.key = "turntable",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(preview_args, turntable),
     .min = 0,
     .max = 999,
     .def = "0",
     .help = "so many pictures, the sample going once round under lamps and camera that stay"},
    {.key = "fps",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(preview_args, fps),
     .min = 0.1,
     .max = 100,
     .def = "12",
     .help = "frames a second of a WebP"},
    {.key = "quality",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(preview_args, quality),
     .min = 0,
     .max = 100,
     .def = "90",
     .help = "of a WebP; 100 is lossless"},
    {.key = "resume",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(preview_args, resume),
     .help = "keep the frames that an interrupted run has left, when its options and maps are the same"},
    {.key = "columns",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(preview_args, columns),
     .unit = "WHAT",
     .help = "a grid: a row for each model of --brdf A,B, a column for each lamp (\"lamps\") or NAME=V,V"},
    {.key = "shape",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(preview_args, shape),
     .choices = "plane|sphere|cylinder|drape",
     .def = "plane",
     .help = "as it lies, on a ball, round a roll, or hung in folds"},
    {.key = "size",
     .type = WEFT_FIELD_SIZE,
     .offset = offsetof(preview_args, size),
     .help = "of the picture; without it a plane keeps its pixels up to 1600, a ball gets 768x768"},
    {.key = "crop",
     .type = WEFT_FIELD_F64S,
     .offset = offsetof(preview_args, crop),
     .unit = "X,Y,W,H",
     .help = "show only this rectangle of the map, in its pixels"},
    {.key = "exposure",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(preview_args, exposure_ev),
     .unit = "EV",
     .min = -20,
     .max = 20,
     .def = "0",
     .help = "at 0 a white card that faces the light is just white"},
    {.key = "ambient",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(preview_args, ambient),
     .min = 0,
     .max = 10,
     .def = "0.02",
     .help = "light from all round, against that of a white sky"},
    {.key = "background",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(preview_args, background),
     .min = 0,
     .max = 1,
     .def = "0.18",
     .help = "linear grey beside the sample"},
    {.key = "repeat",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(preview_args, repeat),
     .min = 0.01,
     .max = 100,
     .def = "1",
     .help = "ball: how often the shorter side of the map fits half round"},
    {.key = "fov",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(preview_args, fov_deg),
     .unit = "deg",
     .min = 0,
     .max = 120,
     .def = "0",
     .help = "field of view of the camera; 0 sees everything straight on"},
    {.key = "draft",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(preview_args, draft),
     .help = "one sample a pixel: quick, and right for materials, whose mips are filtered"},
    {.key = "self-shadow",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(preview_args, self_shadow),
     .help = "the cloth's height map throws shadows on the cloth: from solve --height, or the material's"},
    {.key = "height-map",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(preview_args, height_map),
     .unit = "FILE",
     .help = "the heights of --self-shadow in mm (EXR), in place of those of INPUT"},
    {.key = "shadow-steps",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(preview_args, shadow_steps),
     .min = 1,
     .max = 4096,
     .def = "64",
     .help = "looks at most along a ray through the relief; fewer are quicker and coarser"},
    {.key = "shadow-blur",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(preview_args, shadow_blur),
     .choices = "coarse|always|never",
     .def = "coarse",
     .help = "dither and blur shadows where a ray is coarse or a lamp large, or everywhere, or nowhere"},
    {.key = "accumulate",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(preview_args, accumulate),
     .min = 1,
     .max = 1024,
     .def = "1",
     .help = "looks for each shadow, with other dithers and places on the lamps: their mean is soft"},
    {.key = "sun-disc",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(preview_args, sun_disc_deg),
     .unit = "deg",
     .min = 0,
     .max = 30,
     .def = "0.27",
     .help = "half angle of distant lamps under --accumulate or --temporal; the default is the sun's"},
    {.key = "temporal",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(preview_args, temporal),
     .help = "shadows of a sequence remember the frame before: less flicker from few steps"},
    {.key = "folds",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(preview_args, folds),
     .choices = "formula|marched|walked",
     .def = "formula",
     .help = "shadows of the drape's folds: by their formula, or through a grid of voxels"},
    {.key = "voxels",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(preview_args, voxels),
     .min = 8,
     .max = 512,
     .def = "128",
     .help = "of that grid, along the drape's width"},
    {.key = "filter",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(preview_args, filter),
     .choices = weft_preview_filter_names,
     .def = "anisotropic",
     .help = "materials: every texel shaded, or their mips looked up by the pixel's footprint"},
    {.key = "taps",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(preview_args, taps),
     .min = 1,
     .max = WEFT_PREVIEW_MAX_TAPS,
     .def = "8",
     .help = "most look-ups along a footprint of --filter anisotropic"},
    {.key = "fog",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(preview_args, fog),
     .min = 0,
     .max = 1000,
     .def = "0",
     .help = "light in the air before the sample: optical depth of the box around it, 0.3 is a haze"},
    {.key = "fog-g",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(preview_args, fog_g),
     .min = -0.99,
     .max = 0.99,
     .def = "0.5",
     .help = "how far the air scatters forwards: above 0 it glows around the lamps"},
    {.key = "fog-steps",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(preview_args, fog_steps),
     .min = 1,
     .max = 4096,
     .def = "12",
     .help = "looks along each ray through the air"},
    {.key = "fog-even",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(preview_args, fog_even),
     .help = "a glow of one strength whatever the distance, which dims nothing"},
    {.key = "match",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(preview_args, match),
     .unit = "SET",
     .help = "render each light of this set with --calibration and compare with its photographs"},
    {.key = "calibration",
     .short_opt = 'c',
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(preview_args, cal),
     .unit = "CAL",
     .help = "where the lights of --match are"},
    {0},
};

static weft_err set_light(weft_preview_light *light, const preview_args *a, weft_error *err)
{
    if (a->light_mm.n) {
        if (a->light_mm.n != 3 ||
            !(hypot(hypot(a->light_mm.values[0], a->light_mm.values[1]), a->light_mm.values[2]) > 0))
            return weft_fail(err, WEFT_ERR_USAGE, "--light-mm wants X,Y,Z away from the origin");
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

static weft_size picture_size(const preview_args *a, const weft_preview_crop *shown)
{
    if (a->size.width)
        return a->size;
    if (a->columns)
        return (weft_size){240, 240};
    if (a->shape != WEFT_PREVIEW_PLANE)
        return (weft_size){768, 768};
    const int longest = shown->width > shown->height ? shown->width : shown->height;
    const double scale = longest > LONGEST_SIDE ? (double)LONGEST_SIDE / longest : 1;
    return (weft_size){(int)fmax(1, shown->width * scale + 0.5), (int)fmax(1, shown->height * scale + 0.5)};
}

static weft_err report(const weft_invocation *inv, const preview_args *a, weft_size size, double seconds,
                       weft_error *err)
{
    if (inv->json)
        return weft_print_json(inv,
                               json_pack("{s:s, s:s, s:i, s:i, s:f}", "output", a->output, "brdf", a->brdf,
                                         "width", size.width, "height", size.height, "render_s", seconds),
                               err);
    fprintf(inv->out, "%s: %d x %d, %s, %.2f s\n", a->output, size.width, size.height, a->brdf, seconds);
    return WEFT_OK;
}

static weft_err write_picture(const preview_args *a, const char *path, weft_image *picture, weft_error *err)
{
    weft_tone_image((weft_tone)a->tone, picture);
    return weft_image_write(path, picture, 8, WEFT_TRANSFER_SRGB, err);
}

/* Renders and writes one picture. */
static weft_err look(const preview_args *a, const char *path, const weft_preview_input *input,
                     const weft_preview_view *view, double *seconds, weft_error *err)
{
    weft_image picture;
    struct timespec begin, end;
    clock_gettime(CLOCK_MONOTONIC, &begin);
    WEFT_TRY(weft_preview_render(&input->surface, view, &picture, err));
    clock_gettime(CLOCK_MONOTONIC, &end);
    *seconds += (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec);
    const weft_err status = write_picture(a, path, &picture, err);
    weft_image_fini(&picture);
    return status;
}

static bool is_sequence(const preview_args *a)
{
    return a->sweep || a->turntable;
}

/* Many pictures, and what to say of them. */
static weft_err look_round(const weft_invocation *inv, const preview_args *a, const weft_preview_input *input,
                           const weft_preview_view *view, weft_error *err)
{
    weft_preview_sequence_report done;
    const weft_preview_sequence sequence = {.output = a->output,
                                            .n_frames = a->turntable ? a->turntable : a->sweep,
                                            .turntable = a->turntable > 0,
                                            .resume = a->resume,
                                            .temporal = a->temporal,
                                            .frames_per_s = a->fps,
                                            .quality = a->quality,
                                            .tone = (weft_tone)a->tone};
    WEFT_TRY(weft_preview_sequence_render(inv, &sequence, &input->surface, view, &done, err));
    if (inv->json)
        return weft_print_json(inv,
                               json_pack("{s:s, s:s, s:i, s:i, s:i, s:i, s:f}", "output", a->output, "brdf",
                                         a->brdf, "width", view->width, "height", view->height, "frames",
                                         sequence.n_frames, "kept", done.kept, "render_s", done.seconds),
                               err);
    fprintf(inv->out, "%s: %d frames of %d x %d, %s, %d of them kept, %.2f s\n", a->output, sequence.n_frames,
            view->width, view->height, a->brdf, done.kept, done.seconds);
    return WEFT_OK;
}

/* Lights, crop and all that does not depend on the input. */
static weft_err set_view(const preview_args *a, weft_preview_view *view, weft_error *err)
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

static double texels_per_px(const preview_args *a, const weft_preview_surface *surface, weft_size size)
{
    const double side = size.width < size.height ? size.width : size.height;
    const double shorter = surface->width < surface->height ? surface->width : surface->height;
    if (a->shape != WEFT_PREVIEW_PLANE)
        return a->repeat * shorter / side;
    return fmax((double)surface->width / size.width, (double)surface->height / size.height);
}

static weft_err look_at_input(const weft_invocation *inv, const preview_args *a, weft_preview_view *view,
                              double *seconds, weft_error *err)
{
    weft_preview_input input;
    weft_preview_crop shown = view->crop;
    const char *const folder = inv->n_operands ? inv->operands[0] : NULL;
    WEFT_TRY(weft_preview_input_load(&input, folder, a->brdf, &a->params, err));
    weft_err status = WEFT_OK;
    if (a->match) {
        status = weft_preview_match(inv, &input, a->match, a->cal, a->output, err);
        weft_preview_input_fini(&input);
        return status;
    }
    if (shown.width == 0)
        status = weft_preview_whole(&input.surface, &shown, err);
    const weft_size size = picture_size(a, &shown);
    view->width = size.width;
    view->height = size.height;
    if (status == WEFT_OK && view->crop.width == 0 && view->filter == WEFT_PREVIEW_SAMPLES)
        status = weft_preview_input_level(&input, texels_per_px(a, &input.surface, size), err);
    if (status == WEFT_OK && a->self_shadow)
        status = weft_preview_input_height(&input, folder, a->height_map, err);
    if (status == WEFT_OK && is_sequence(a)) { /* once for all pictures */
        status = weft_preview_pack(&input.surface, view, &input.texture, err);
        input.surface.texture = &input.texture;
    }
    if (status == WEFT_OK)
        status = is_sequence(a) ? look_round(inv, a, &input, view, err)
                                : look(a, a->output, &input, view, seconds, err);
    weft_preview_input_fini(&input);
    return status == WEFT_OK || !folder ? status : weft_prefix(err, status, "%s", folder);
}

static weft_err look_at_grid(const weft_invocation *inv, const preview_args *a, weft_preview_view *view,
                             weft_error *err)
{
    weft_image sheet;
    const weft_size size = picture_size(a, NULL);
    view->width = size.width;
    view->height = size.height;
    const weft_preview_grid grid = {inv->n_operands ? inv->operands[0] : NULL,
                                    a->brdf,
                                    &a->params,
                                    &a->lamps,
                                    a->columns,
                                    (weft_tone)a->tone};
    WEFT_TRY(weft_preview_grid_render(&grid, view, &sheet, err));
    view->width = sheet.width;
    view->height = sheet.height;
    const weft_err status = weft_image_write(a->output, &sheet, 8, WEFT_TRANSFER_SRGB, err);
    weft_image_fini(&sheet);
    return status;
}

static weft_err run(const weft_invocation *inv, const void *args, weft_error *err)
{
    const preview_args *const a = args;
    weft_preview_view view = weft_preview_view_defaults();
    weft_preview_around around = {0};
    double seconds = 0;
    if (a->self_shadow && (a->match || a->columns))
        return weft_fail(err, WEFT_ERR_USAGE, "--self-shadow goes with neither --match nor --columns");
    if (a->height_map && !a->self_shadow)
        return weft_fail(err, WEFT_ERR_USAGE, "--height-map wants --self-shadow");
    if (a->polarise.n && !a->env && !a->sky.n)
        return weft_fail(err, WEFT_ERR_USAGE, "--polarise wants a --sky or --env to filter");
    if (is_sequence(a) && (a->match || a->columns || (a->sweep && a->turntable)))
        return weft_fail(err, WEFT_ERR_USAGE,
                         "--sweep and --turntable go neither with each other nor with --match or --columns");
    if (a->temporal && !is_sequence(a))
        return weft_fail(err, WEFT_ERR_USAGE, "--temporal wants --sweep N or --turntable N");
    if (!is_sequence(a) && (a->resume || weft_path_has_suffix(a->output, ".webp")))
        return weft_fail(err, WEFT_ERR_USAGE, "--resume and a .webp want --sweep N or --turntable N");
    if (!a->match != !a->cal)
        return weft_fail(err, WEFT_ERR_USAGE, "--match SET and --calibration CAL go together");
    if (a->match && !inv->n_operands)
        return weft_fail(err, WEFT_ERR_USAGE, "--match wants the INPUT that was solved from the set");
    if (!is_sequence(a))
        WEFT_TRY(weft_file_refuse_existing(a->output, inv->force, err));
    WEFT_TRY(set_view(a, &view, err));
    if (a->env || a->sky.n) {
        weft_sky_filter filter = {.ambient_saturation = a->ambient_saturation};
        WEFT_TRY(weft_preview_polariser(&a->polarise, a->hour, filter.factor, err));
        WEFT_TRY(weft_preview_around_init(&around, a->env, &a->sky,
                                          a->sky_model == 0 ? &weft_sky_cie_clear : &weft_sky_far_cry_3,
                                          &filter, err));
        view.surroundings = (weft_preview_surroundings){&around.map, &around.table, a->env_scale};
    }
    const weft_err status =
        a->columns ? look_at_grid(inv, a, &view, err) : look_at_input(inv, a, &view, &seconds, err);
    weft_preview_around_fini(&around);
    WEFT_TRY(status);
    return a->match || is_sequence(a) ? WEFT_OK
                                      : report(inv, a, (weft_size){view.width, view.height}, seconds, err);
}

const weft_command weft_cmd_preview = {
    .name = "preview",
    .summary = "look at solved maps or a material under lights that can be moved",
    .operands = "[INPUT]",
    .min_operands = 0,
    .max_operands = 1,
    .args_size = sizeof(preview_args),
    .fields = fields,
    .details =
        "INPUT is a folder of solved maps (NAME.maps) or a baked material (NAME.material); without it a "
        "smooth\n"
        "surface is shown, of which a ball has a radius of 50 mm.  The albedo map is the model's albedo; a\n"
        "material gives f0, alpha and tints too, from its mips.  Other parameters are constants "
        "unless\n"
        "a picture of the same size is given for them.  Positions of lamps are in mm, from the world's "
        "origin\n"
        "on a plane, from the middle of the other shapes.",
    .example =
        "weft preview twill.maps -o twill.png --brdf cloth --param f0=0.1 --shape sphere --light 60,30\n"
        "  weft preview twill.maps -o twill.webp --shape drape --turntable 48 --resume\n"
        "  weft preview twill.maps -o twill-shadows.png --self-shadow --light 20,20",
    .run = run,
};
