#include "shading/preview/preview.h"

#include "shading/preview/preview_fog.h"
#include "shading/preview/preview_samples.h"
#include "shading/preview/preview_visibility.h"

#include "core/clones.h"
#include "core/parallel.h"
#include "shading/brdf/half_vector.h"

#include <string.h>

const char weft_preview_filter_names[] = "samples|trilinear|anisotropic";

void weft_preview_direction(double azimuth_deg, double elevation_deg, double direction[3])
{
    const double a = azimuth_deg * WEFT_PI / 180, e = elevation_deg * WEFT_PI / 180;
    direction[0] = cos(e) * cos(a);
    direction[1] = cos(e) * sin(a);
    direction[2] = sin(e);
}

weft_preview_view weft_preview_view_defaults(void)
{
    weft_preview_view view = {.width = 512,
                              .height = 512,
                              .n_lights = 1,
                              .background = 0.18,
                              .repeat = 1,
                              .shadows = {.steps = 64, .voxels = 128, .voxel_steps = 32},
                              .filter = WEFT_PREVIEW_ANISOTROPIC,
                              .max_taps = 8};
    weft_preview_direction(135, 45, view.lights[0].direction);
    for (int c = 0; c < 3; c++)
        view.lights[0].irradiance[c] = WEFT_PI;
    return view;
}

static weft_err check_size(const weft_preview_surface *surface, const weft_image *image, const char *what,
                           weft_error *err)
{
    if (image->width == surface->width && image->height == surface->height)
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_MISMATCH, "the %s map has %d x %d pixels, the others %d x %d", what,
                     image->width, image->height, surface->width, surface->height);
}

weft_err weft_preview_set_map(weft_preview_surface *surface, const char *name, const weft_image *image,
                              weft_error *err)
{
    int plane;
    const weft_brdf_param *const param = weft_brdf_find_param(surface->brdf, name, &plane);
    if (!param)
        return weft_fail(err, WEFT_ERR_USAGE, "%s has no parameter %s that a map could give",
                         surface->brdf->name, name);
    WEFT_TRY(check_size(surface, image, name, err));
    if (image->planes != 1 && image->planes != param->components)
        return weft_fail(err, WEFT_ERR_MISMATCH, "the %s map has %d planes, wanted %s", name, image->planes,
                         param->components == 3 ? "1 or 3" : "1");
    for (int c = 0; c < param->components; c++)
        surface->maps[plane + c] = (weft_preview_map){image, image->planes == 1 ? 0 : c, 1};
    return WEFT_OK;
}

void weft_preview_eval(const weft_preview_setup *setup, weft_preview_samples *s,
                       float value[3][WEFT_PREVIEW_RUN])
{
    weft_brdf_batch_f32 batch = {.n = s->n,
                                 .light = {s->light[0], s->light[1], s->light[2]},
                                 .view = {s->view[0], s->view[1], s->view[2]},
                                 .data = setup->surface->brdf->data};
    float *const to[3] = {value[0], value[1], value[2]};
    for (int k = 0; k < weft_brdf_n_planes(setup->surface->brdf); k++)
        batch.param[k] = s->param[k];
    setup->surface->brdf->eval_f32(&batch, to);
}

static void shade(const weft_preview_setup *setup, weft_preview_samples *s)
{
    const weft_preview_view *const view = setup->view;
    const float exposure = (float)exp2(view->exposure_ev), background = (float)view->background;
    weft_preview_set_frame(s);
    for (int c = 0; c < 3; c++)
        memset(s->radiance[c], 0, sizeof s->radiance[c]);
    for (int k = 0; k < view->n_lights; k++)
        weft_preview_add_light(setup, &view->lights[k], s);
    if (view->surroundings.map)
        weft_preview_add_surroundings(setup, s);
    weft_preview_add_ambient(setup, s);
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < s->n; i++)
            s->value[c][i] = s->hit[i] > 0 ? exposure * s->radiance[c][i] : background;
}

typedef struct render {
    const weft_preview_setup *setup;
    weft_image *picture;
} render;

/* Where a line of samples falls in the picture: on two rows, by the tent. */
typedef struct splat_target {
    int row[2]; /* -1: not in this band */
    double weight[2];
} splat_target;

static void add_to_row(float *to, int width, int left, const double *sums, int n, double weight)
{
    const int begin = left < 0 ? -left : 0, end = left + n > width ? width - left : n;
    for (int p = begin; p < end; p++)
        to[left + p] += (float)(weight * sums[p]);
}

/* Adds a run of samples to the picture under a tent two pixels wide: along the line first. */
static void splat_run(const render *r, const weft_preview_samples *s, int first, const splat_target *target)
{
    const int ss = r->setup->supersampling;
    if (ss == 1) {
        for (int c = 0; c < 3 && target->row[0] >= 0; c++)
            for (int i = 0; i < s->n; i++)
                weft_image_row(r->picture, c, target->row[0])[first + i] = s->value[c][i];
        return;
    }
    const int begin = first + ss / 2; /* samples from the left neighbour on */
    const int n_pixels = (begin + s->n - 1) / ss - begin / ss + 2;
    for (int c = 0; c < 3; c++) {
        double sums[WEFT_PREVIEW_RUN / 2 + 2] = {0};
        int pixel = 0, k = begin % ss;
        for (int i = 0; i < s->n; i++) {
            const double right = (k + 0.5) / ss;
            sums[pixel] += (1 - right) * (double)s->value[c][i];
            sums[pixel + 1] += right * (double)s->value[c][i];
            k = k + 1 < ss ? k + 1 : 0;
            pixel += k == 0;
        }
        for (int j = 0; j < 2; j++)
            if (target->row[j] >= 0)
                add_to_row(weft_image_row(r->picture, c, target->row[j]), r->picture->width, begin / ss - 1,
                           sums, n_pixels, target->weight[j]);
    }
}

/* Samples beyond the picture, which the tent wants, repeat its edge. */
static double inside(double x, int size)
{
    const double half = size / 2.0;
    return x < -half ? -half : x > half ? half : x;
}

static void shade_run(const weft_preview_setup *setup, weft_preview_samples *s, int first, int n, double y)
{
    const int ss = setup->supersampling, width = setup->view->width;
    s->n = n;
    for (int i = 0; i < n; i++) {
        s->x[i] = (float)inside((first + i + 0.5) / ss - width / 2.0, width);
        s->y[i] = (float)inside(y, setup->view->height);
    }
    weft_preview_hit(setup, s);
    bool any = false;
    for (int i = 0; i < n; i++)
        any |= s->hit[i] > 0;
    if (!any) {
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < n; i++)
                s->value[c][i] = (float)setup->view->background;
        return;
    }
    if (setup->texture)
        weft_preview_fetch_filtered(setup, s);
    else
        weft_preview_fetch(setup, s);
    shade(setup, s);
}

/* Rows of samples reach half a pixel beyond those of the picture, for the tent. */
static void render_rows(void *context, int band, int row_begin, int row_end)
{
    const render *const r = context;
    const weft_preview_setup *const setup = r->setup;
    const int ss = setup->supersampling, width = r->picture->width, height = r->picture->height;
    const int last_column = width * ss + ss / 2;
    weft_preview_samples s = {0};
    (void)band;
    for (int line = row_begin * ss - ss / 2; line < row_end * ss + ss / 2; line++) {
        const double py = (line + 0.5) / ss - 0.5, top = floor(py), lower = py - top;
        const int row = (int)top;
        const splat_target target = {.row = {row >= row_begin && row < row_end ? row : -1,
                                             row + 1 >= row_begin && row + 1 < row_end ? row + 1 : -1},
                                     .weight = {(1 - lower) / (ss * ss), lower / (ss * ss)}};
        for (int first = -ss / 2; first < last_column; first += WEFT_PREVIEW_RUN) {
            const int rest = last_column - first;
            shade_run(setup, &s, first, rest < WEFT_PREVIEW_RUN ? rest : WEFT_PREVIEW_RUN,
                      height / 2.0 - (py + 0.5));
            splat_run(r, &s, first, &target);
        }
    }
}

weft_err weft_preview_whole(const weft_preview_surface *surface, weft_preview_crop *crop, weft_error *err)
{
    const weft_mask *const mask = surface->mask;
    int x0 = surface->width, y0 = surface->height, x1 = -1, y1 = -1;
    *crop = (weft_preview_crop){0, 0, surface->width, surface->height};
    if (!mask)
        return WEFT_OK;
    for (int y = 0; y < mask->height; y++)
        for (int x = 0; x < mask->width; x++)
            if (mask->data[(size_t)y * (size_t)mask->width + (size_t)x]) {
                x0 = x < x0 ? x : x0;
                x1 = x > x1 ? x : x1;
                y0 = y < y0 ? y : y0;
                y1 = y;
            }
    if (x1 < 0)
        return weft_fail(err, WEFT_ERR_NODATA, "the mask is empty: there is nothing to look at");
    *crop = (weft_preview_crop){x0, y0, x1 - x0 + 1, y1 - y0 + 1};
    return WEFT_OK;
}

static weft_err check_shadows(const weft_preview_surface *surface, const weft_preview_view *view,
                              weft_error *err)
{
    const weft_preview_shadows *const shadows = &view->shadows;
    if (shadows->relief && !surface->height_mm)
        return weft_fail(err, WEFT_ERR_MISSING,
                         "there is no height map that could throw shadows (solve with --height)");
    if (shadows->relief && !(surface->mm_per_px > 0))
        return weft_fail(err, WEFT_ERR_MISSING,
                         "shadows of the relief want maps with a scale; solve with --geometry plane");
    if (shadows->relief && (shadows->steps < 1 || shadows->steps > 100000))
        return weft_fail(err, WEFT_ERR_RANGE, "wanted 1 to 100000 steps through the relief");
    if (shadows->folds == WEFT_PREVIEW_FOLDS_MARCHED &&
        (shadows->voxel_steps < 1 || shadows->voxel_steps > 100000))
        return weft_fail(err, WEFT_ERR_RANGE, "wanted 1 to 100000 steps through the voxels");
    if (shadows->accumulate < 0 || shadows->accumulate > 4096 ||
        !(shadows->disc_rad >= 0 && shadows->disc_rad < 1))
        return weft_fail(err, WEFT_ERR_RANGE, "wanted up to 4096 looks and a disc below one radian");
    return shadows->relief ? check_size(surface, surface->height_mm, "height", err) : WEFT_OK;
}

/* Whether rays are looked at before the picture is shaded. */
static bool wants_visibility(const weft_preview_view *view)
{
    return view->n_lights > 0 &&
           (view->shadows.relief ||
            (view->shape == WEFT_PREVIEW_DRAPE && view->shadows.folds != WEFT_PREVIEW_FOLDS_FORMULA));
}

static weft_err check_surface(const weft_preview_surface *surface, const weft_preview_view *view,
                              weft_error *err)
{
    if (surface->normal)
        WEFT_TRY(check_size(surface, surface->normal, "normal", err));
    if (surface->mask && (surface->mask->width != surface->width || surface->mask->height != surface->height))
        return weft_fail(err, WEFT_ERR_MISMATCH, "the mask has %d x %d pixels, the maps %d x %d",
                         surface->mask->width, surface->mask->height, surface->width, surface->height);
    if (view->n_lights < 0 || view->n_lights > WEFT_PREVIEW_MAX_LIGHTS)
        return weft_fail(err, WEFT_ERR_RANGE, "%d lights; at most %d can shine", view->n_lights,
                         WEFT_PREVIEW_MAX_LIGHTS);
    for (int k = 0; k < view->n_lights; k++)
        if (view->lights[k].kind != WEFT_PREVIEW_DISTANT && !(surface->mm_per_px > 0))
            return weft_fail(err, WEFT_ERR_MISSING,
                             "a light at a position in mm needs maps with a scale; these have none (solve "
                             "with --geometry plane, or give the light as azimuth and elevation)");
    WEFT_TRY(check_shadows(surface, view, err));
    if (!(view->fog.depth >= 0 && view->fog.depth <= 1000) || !(fabs(view->fog.g) < 1) ||
        (view->fog.depth > 0 && (view->fog.steps < 1 || view->fog.steps > 4096)))
        return weft_fail(err, WEFT_ERR_RANGE,
                         "wanted fog of a depth from 0 to 1000, g between -1 and 1, and 1 to 4096 steps");
    if (view->filter != WEFT_PREVIEW_SAMPLES &&
        (view->max_taps < 1 || view->max_taps > WEFT_PREVIEW_MAX_TAPS))
        return weft_fail(err, WEFT_ERR_RANGE, "%d look-ups along a footprint; wanted 1 to %d", view->max_taps,
                         WEFT_PREVIEW_MAX_TAPS);
    if (!(view->repeat > 0 && view->repeat <= 1000) || !(view->fov_deg >= 0 && view->fov_deg < 170))
        return weft_fail(err, WEFT_ERR_RANGE, "wanted a repeat of more than 0 and a field of view below 170");
    return WEFT_OK;
}

static weft_err find_crop(const weft_preview_surface *surface, const weft_preview_view *view,
                          weft_preview_crop *crop, weft_error *err)
{
    const weft_preview_crop wanted = view->crop;
    if (wanted.width == 0)
        return weft_preview_whole(surface, crop, err);
    if (wanted.x < 0 || wanted.y < 0 || wanted.width < 1 || wanted.height < 1 ||
        wanted.width > surface->width - wanted.x || wanted.height > surface->height - wanted.y)
        return weft_fail(err, WEFT_ERR_RANGE,
                         "%d x %d pixels from %d, %d on are not inside the map's %d x %d", wanted.width,
                         wanted.height, wanted.x, wanted.y, surface->width, surface->height);
    *crop = wanted;
    return WEFT_OK;
}

static void set_ranges(weft_preview_setup *setup)
{
    const weft_brdf *const brdf = setup->surface->brdf;
    int plane = 0;
    setup->albedo_plane = setup->alpha_plane = -1;
    setup->matte = weft_preview_matte_of(brdf);
    for (const weft_brdf_param *p = brdf->params; p->name; p++) {
        if (strcmp(p->name, "albedo") == 0 && p->components == 3)
            setup->albedo_plane = plane;
        if (strcmp(p->name, "alpha") == 0 && weft_preview_is_glossy(brdf))
            setup->alpha_plane = plane;
        for (int c = 0; c < p->components; c++, plane++) {
            setup->low[plane] = p->min;
            setup->high[plane] = p->max;
        }
    }
}

/* Checks the input and fills what does not depend on the maps' contents.  `finest` gets the finest level of
 * the chains that is wanted, -1 where they are not used. */
static weft_err prepare(weft_preview_setup *setup, int *finest, weft_error *err)
{
    const weft_preview_surface *const surface = setup->surface;
    const weft_preview_view *const view = setup->view;
    WEFT_TRY(check_surface(surface, view, err));
    WEFT_TRY(find_crop(surface, view, &setup->crop, err));
    set_ranges(setup);
    setup->turn_cos = view->turn_rad != 0 ? cos(view->turn_rad) : 1;
    setup->turn_sin = view->turn_rad != 0 ? sin(view->turn_rad) : 0;
    weft_preview_setup_shape(setup);
    const bool filtered =
        view->filter != WEFT_PREVIEW_SAMPLES && !surface->mask && weft_preview_surface_levels(surface) > 1;
    if (view->draft || filtered)
        setup->supersampling = view->draft ? 1 : 2;
    const double lod = log2(setup->texels_per_px / setup->supersampling);
    *finest = !filtered ? -1 : lod > 0 ? (int)lod : 0;
    return WEFT_OK;
}

weft_err weft_preview_pack(const weft_preview_surface *surface, const weft_preview_view *view,
                           weft_preview_texture *texture, weft_error *err)
{
    weft_preview_setup setup = {.surface = surface, .view = view};
    int finest;
    *texture = (weft_preview_texture){0};
    WEFT_TRY(prepare(&setup, &finest, err));
    return finest < 0 ? WEFT_OK : weft_preview_texture_init(texture, surface, finest, err);
}

/* The surface's texture where it has the level, else `own`. */
static weft_err choose_texture(weft_preview_setup *setup, int finest, weft_preview_texture *own,
                               weft_error *err)
{
    const weft_preview_texture *const given = setup->surface->texture;
    if (finest < 0)
        return WEFT_OK;
    setup->texture = given && given->texels && given->first <= finest ? given : own;
    return setup->texture == own ? weft_preview_texture_init(own, setup->surface, finest, err) : WEFT_OK;
}

weft_err weft_preview_render(const weft_preview_surface *surface, const weft_preview_view *given,
                             weft_image *picture, weft_error *err)
{
    weft_preview_view turned = *given;
    const weft_preview_view *const view = &turned;
    weft_preview_setup setup = {.surface = surface, .view = view};
    weft_preview_texture own = {0};
    weft_preview_visibility visibility = {0};
    weft_image made = {0};
    int finest;
    WEFT_TRY(prepare(&setup, &finest, err));
    if (given->turn_rad != 0)
        weft_preview_turn_lamps(&setup, &turned);
    weft_err status = choose_texture(&setup, finest, &own, err);
    if (status == WEFT_OK && wants_visibility(view)) {
        status = weft_preview_visibility_init(&visibility, &setup, err);
        setup.visibility = &visibility;
    }
    if (status == WEFT_OK && view->surroundings.map)
        status = weft_environment_planes_init(&setup.around, view->surroundings.map, view->surroundings.table,
                                              err);
    if (status == WEFT_OK)
        status = weft_image_init(&made, view->width, view->height, 3, err);
    if (status == WEFT_OK)
        status =
            weft_parallel_rows_progress(view->height, render_rows, &(render){&setup, &made}, "preview", err);
    if (status == WEFT_OK && view->fog.depth > 0)
        status = weft_preview_add_fog(&setup, &made, err);
    weft_environment_planes_fini(&setup.around);
    weft_preview_visibility_fini(&visibility);
    weft_preview_texture_fini(&own);
    if (status != WEFT_OK)
        weft_image_fini(&made);
    else
        *picture = made;
    return status;
}

weft_err weft_preview_remember(const weft_preview_surface *surface, const weft_preview_view *given,
                               weft_error *err)
{
    weft_preview_view turned = *given;
    weft_preview_setup setup = {.surface = surface, .view = &turned};
    weft_preview_visibility visibility = {0};
    int finest;
    WEFT_TRY(prepare(&setup, &finest, err));
    if (given->turn_rad != 0)
        weft_preview_turn_lamps(&setup, &turned);
    if (!wants_visibility(&turned))
        return WEFT_OK;
    WEFT_TRY(weft_preview_visibility_init(&visibility, &setup, err));
    weft_preview_visibility_fini(&visibility);
    return WEFT_OK;
}
