#include "host/cli/command.h"
#include "host/cli/preview_input.h"
#include "host/cli/preview_match.h"

#include "core/file.h"
#include "core/formats/image_file.h"

#include <math.h>
#include <time.h>

#define LONGEST_SIDE 1600 /* of a plane without --size */

typedef struct preview_args {
    const char *output, *brdf, *match, *cal;
    weft_texts params;
    weft_numbers light, light_mm, crop;
    int shape;
    weft_size size;
    double exposure_ev, ambient, background, repeat, fov_deg;
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
    {.key = "shape",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(preview_args, shape),
     .choices = "plane|sphere",
     .def = "plane",
     .help = "as it lies, or on a ball"},
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
        light->is_point = true;
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
    if (a->shape == WEFT_PREVIEW_SPHERE)
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

/* Renders and writes; `view` has its light and crop. */
static weft_err look(const preview_args *a, const weft_preview_input *input, weft_preview_view *view,
                     double *seconds, weft_error *err)
{
    weft_image picture;
    weft_preview_crop shown = view->crop;
    struct timespec begin, end;
    if (shown.width == 0)
        WEFT_TRY(weft_preview_whole(&input->surface, &shown, err));
    const weft_size size = picture_size(a, &shown);
    view->width = size.width;
    view->height = size.height;
    view->shape = (weft_preview_shape)a->shape;
    view->exposure_ev = a->exposure_ev;
    view->ambient = a->ambient;
    view->background = a->background;
    view->repeat = a->repeat;
    view->fov_deg = a->fov_deg;
    clock_gettime(CLOCK_MONOTONIC, &begin);
    WEFT_TRY(weft_preview_render(&input->surface, view, &picture, err));
    clock_gettime(CLOCK_MONOTONIC, &end);
    *seconds = (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec);
    const weft_err status = weft_image_write(a->output, &picture, 8, WEFT_TRANSFER_SRGB, err);
    weft_image_fini(&picture);
    return status;
}

static weft_err run(const weft_invocation *inv, const void *args, weft_error *err)
{
    const preview_args *const a = args;
    weft_preview_view view = weft_preview_view_defaults();
    weft_preview_input input;
    double seconds;
    WEFT_TRY(weft_file_refuse_existing(a->output, inv->force, err));
    WEFT_TRY(set_light(&view.light, a, err));
    WEFT_TRY(set_crop(&view.crop, &a->crop, err));
    if (!a->match != !a->cal)
        return weft_fail(err, WEFT_ERR_USAGE, "--match SET and --calibration CAL go together");
    WEFT_TRY(weft_preview_input_load(&input, inv->operands[0], a->brdf, &a->params, err));
    if (a->match) {
        const weft_err matched = weft_preview_match(inv, &input, a->match, a->cal, a->output, err);
        weft_preview_input_fini(&input);
        return matched;
    }
    const weft_err status = look(a, &input, &view, &seconds, err);
    weft_preview_input_fini(&input);
    if (status != WEFT_OK)
        return weft_prefix(err, status, "%s", inv->operands[0]);
    return report(inv, a, (weft_size){view.width, view.height}, seconds, err);
}

const weft_command weft_cmd_preview = {
    .name = "preview",
    .summary = "look at solved maps under a light that can be moved",
    .operands = "INPUT",
    .min_operands = 1,
    .max_operands = 1,
    .args_size = sizeof(preview_args),
    .fields = fields,
    .details =
        "INPUT is a folder of solved maps (NAME.maps).  The albedo map is the model's albedo; other\n"
        "parameters are constants unless a picture of the same size is given for them.  Nothing is tone\n"
        "mapped: values above white are cut.",
    .example =
        "weft preview twill.maps -o twill.png --brdf cloth --param f0=0.1 --shape sphere --light 60,30",
    .run = run,
};
