#include "host/cli/command.h"
#include "host/cli/preview_grid.h"
#include "host/cli/preview_input.h"
#include "host/cli/preview_lights.h"
#include "host/cli/preview_match.h"
#include "host/cli/preview_options.h"
#include "host/cli/preview_sequence.h"
#include "host/cli/preview_watch.h"

#include "core/file.h"
#include "core/formats/image_file.h"
#include "core/log.h"
#include "core/progress.h"

#include <math.h>

#define LONGEST_SIDE 1600 /* of a plane without --size */

static weft_size picture_size(const weft_preview_options *a, const weft_preview_crop *shown)
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

static weft_err report(const weft_invocation *inv, const weft_preview_options *a, weft_size size,
                       double seconds, weft_error *err)
{
    if (inv->json)
        return weft_print_json(inv,
                               json_pack("{s:s, s:s, s:i, s:i, s:f}", "output", a->output, "brdf", a->brdf,
                                         "width", size.width, "height", size.height, "render_s", seconds),
                               err);
    fprintf(inv->out, "%s: %d x %d, %s, %.2f s\n", a->output, size.width, size.height, a->brdf, seconds);
    return WEFT_OK;
}

static weft_err write_picture(const weft_preview_options *a, const char *path, weft_image *picture,
                              weft_error *err)
{
    weft_tone_image((weft_tone)a->tone, picture);
    return weft_image_write(path, picture, 8, WEFT_TRANSFER_SRGB, err);
}

/* Renders and writes one picture. */
static weft_err look(const weft_preview_options *a, const char *path, const weft_preview_input *input,
                     const weft_preview_view *view, double *seconds, weft_error *err)
{
    weft_image picture;
    const double began_s = weft_clock_s();
    WEFT_TRY(weft_preview_render(&input->surface, view, &picture, err));
    *seconds += weft_clock_s() - began_s;
    const weft_err status = write_picture(a, path, &picture, err);
    weft_image_fini(&picture);
    return status;
}

/* Many pictures, and what to say of them. */
static weft_err look_round(const weft_invocation *inv, const weft_preview_options *a,
                           const weft_preview_input *input, const weft_preview_view *view, weft_error *err)
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

static double texels_per_px(const weft_preview_options *a, const weft_preview_surface *surface,
                            weft_size size)
{
    const double side = size.width < size.height ? size.width : size.height;
    const double shorter = surface->width < surface->height ? surface->width : surface->height;
    if (a->shape != WEFT_PREVIEW_PLANE)
        return a->repeat * shorter / side;
    return fmax((double)surface->width / size.width, (double)surface->height / size.height);
}

static weft_err look_at_input(const weft_invocation *inv, const weft_preview_options *a,
                              weft_preview_view *view, double *seconds, weft_error *err)
{
    weft_preview_input input;
    weft_preview_crop shown = view->crop;
    const char *const folder = inv->n_operands ? inv->operands[0] : NULL;
    WEFT_TRY(weft_preview_input_load(&input, folder, a->brdf, &a->params, err));
    weft_preview_input_warn(&input);
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
    if (status == WEFT_OK && weft_preview_is_sequence(a)) { /* once for all pictures */
        status = weft_preview_pack(&input.surface, view, &input.texture, err);
        input.surface.texture = &input.texture;
    }
    if (status == WEFT_OK)
        status = weft_preview_is_sequence(a) ? look_round(inv, a, &input, view, err)
                                             : look(a, a->output, &input, view, seconds, err);
    weft_preview_input_fini(&input);
    return status == WEFT_OK || !folder ? status : weft_prefix(err, status, "%s", folder);
}

static weft_err look_at_grid(const weft_invocation *inv, const weft_preview_options *a,
                             weft_preview_view *view, weft_error *err)
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

/* All that is asked for, once. */
static weft_err draw(const weft_invocation *inv, const weft_preview_options *a, weft_error *err)
{
    weft_preview_view view = weft_preview_view_defaults();
    weft_preview_around around = {0};
    double seconds = 0;
    WEFT_TRY(weft_preview_options_view(a, &view, err));
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
    return a->match || weft_preview_is_sequence(a)
               ? WEFT_OK
               : report(inv, a, (weft_size){view.width, view.height}, seconds, err);
}

/* Draws again at every change.  What cannot be drawn then is half-written or wrong for now: the picture
 * stays. */
static weft_err watch(const weft_invocation *inv, const weft_preview_options *a, weft_error *err)
{
    const char *const input = inv->n_operands ? inv->operands[0] : NULL;
    uint64_t state = weft_preview_watch_state(input, a); /* before: a change while drawing counts */
    WEFT_TRY(draw(inv, a, err));
    for (;;) {
        weft_error problem = {0};
        fflush(inv->out);
        WEFT_TRY(weft_preview_watch_wait(input, a, &state, err));
        if (draw(inv, a, &problem) != WEFT_OK && !weft_cancelled())
            weft_warn("%s; the picture stays as it was", problem.text);
    }
}

static weft_err run(const weft_invocation *inv, const void *args, weft_error *err)
{
    const weft_preview_options *const a = args;
    WEFT_TRY(weft_preview_options_check(a, inv->n_operands > 0, err));
    if (a->watch && inv->json)
        return weft_fail(err, WEFT_ERR_USAGE, "--watch prints a line a picture; it has no --json");
    if (!weft_preview_is_sequence(a))
        WEFT_TRY(weft_file_refuse_existing(a->output, inv->force, err));
    return a->watch ? watch(inv, a, err) : draw(inv, a, err);
}

const weft_command weft_cmd_preview = {
    .name = "preview",
    .summary = "look at solved maps or a material under lights that can be moved",
    .operands = "[INPUT]",
    .min_operands = 0,
    .max_operands = 1,
    .args_size = sizeof(weft_preview_options),
    .fields = weft_preview_fields,
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
        "weft preview twill.maps -o twill.png --brdf cloth --param f0=0.05 --shape sphere --light 60,30\n"
        "  weft preview twill.maps -o twill.webp --shape drape --turntable 48 --resume\n"
        "  weft preview twill.maps -o twill-shadows.png --self-shadow --light 20,20",
    .run = run,
};
