/* Height, what it says of light, and detail maps: made, or taken from the files where they still are right.
 */
#include "shading/material/build_private.h"

#include "core/formats/exr_file.h"
#include "core/mem.h"
#include "shading/bake/height_poisson.h"
#include "shading/bake/relief.h"
#include "shading/material/build_key.h"

#include <math.h>
#include <string.h>

/* Raised when the code of a step changes what it makes. */
enum { HEIGHT_VERSION = 1, RELIEF_VERSION = 1 };

enum { CAVITY_RADIUS_PX = 8 };

static double mm_per_px(const weft_builder *b)
{
    return b->baked.size_mm[0] > 0 ? b->baked.size_mm[0] / b->baked.width : 0;
}

/* Takes level 0 of a file that is still right; false when it cannot be read, and is then made again. */
static bool reuse(weft_builder *b, weft_baked_kind kind)
{
    char *const path = weft_asprintf(NULL, "%s/%s.exr", b->options->folder, weft_baked_rows[kind].name);
    weft_image image = {0};
    const bool good = path &&
                      weft_exr_read(path, weft_baked_rows[kind].channels, weft_baked_rows[kind].planes,
                                    &image, NULL) == WEFT_OK &&
                      image.width == b->baked.width && image.height == b->baked.height;
    weft_free(path);
    if (good && weft_baked_add(&b->baked, kind, image.width, image.height, NULL) == WEFT_OK) {
        weft_image_fini(&b->baked.maps[kind].mips[0]);
        b->baked.maps[kind].mips[0] = image;
        return true;
    }
    weft_image_fini(&image);
    return false;
}

static void adopt(weft_baked *baked, weft_baked_kind kind, weft_image *image)
{
    weft_image_fini(&baked->maps[kind].mips[0]);
    baked->maps[kind].mips[0] = *image;
    baked->maps[kind].n_mips = 1;
    *image = (weft_image){0};
}

weft_err weft_builder_make_height(weft_builder *b, weft_error *err)
{
    char hex[65];
    weft_image height;
    weft_build_key key = weft_build_key_begin("height", HEIGHT_VERSION);
    if (b->baked.maps[WEFT_BAKED_HEIGHT].n_mips > 0 || b->baked.maps[WEFT_BAKED_NORMAL].n_mips == 0)
        return WEFT_OK;
    weft_build_key_text(&key, "normal", b->texels[WEFT_BAKED_NORMAL]);
    weft_build_key_number(&key, "mm", mm_per_px(b));
    weft_build_key_number(&key, "periodic", b->baked.periodic);
    weft_build_key_end(&key, hex);
    memcpy(b->texels[WEFT_BAKED_HEIGHT], hex,
           sizeof hex); /* the file rounds: a key of what went in, not of it */
    if (weft_builder_file_is_current(b, WEFT_BAKED_HEIGHT) && reuse(b, WEFT_BAKED_HEIGHT)) {
        weft_builder_note(b, "height", "kept", "its normals are as they were");
        return WEFT_OK;
    }
    const double scale = mm_per_px(b) > 0 ? mm_per_px(b) : 1;
    weft_builder_note(b, "height", "rebuilt", "the normals or the scale changed");
    WEFT_TRY(weft_height_integrate(&b->baked.maps[WEFT_BAKED_NORMAL].mips[0], NULL, scale, b->baked.periodic,
                                   &height, NULL, err));
    adopt(&b->baked, WEFT_BAKED_HEIGHT, &height);
    return WEFT_OK;
}

static const weft_baked_kind relief_kinds[] = {WEFT_BAKED_OCCLUSION, WEFT_BAKED_BENT_CONE, WEFT_BAKED_CAVITY,
                                               WEFT_BAKED_CURVATURE};

static bool reuse_all(weft_builder *b, const weft_baked_kind *kinds, int n)
{
    for (int i = 0; i < n; i++)
        if (!weft_builder_file_is_current(b, kinds[i]) || !reuse(b, kinds[i]))
            return false;
    return true;
}

static weft_err compute_relief(weft_builder *b, weft_error *err)
{
    weft_baked *const baked = &b->baked;
    const weft_image *const height = &baked->maps[WEFT_BAKED_HEIGHT].mips[0];
    const weft_image *const normal =
        baked->maps[WEFT_BAKED_NORMAL].n_mips ? &baked->maps[WEFT_BAKED_NORMAL].mips[0] : NULL;
    const double scale = mm_per_px(b) > 0 ? mm_per_px(b) : 1;
    weft_relief_options options = weft_relief_defaults(scale);
    options.periodic = baked->periodic;
    if (b->options->reach_mm > 0)
        options.reach_mm = b->options->reach_mm;
    else if (!(mm_per_px(b) > 0))
        options.reach_mm = 32; /* texels */
    weft_image occlusion, cone, other;
    WEFT_TRY(weft_relief_occlusion(height, normal, &options, &occlusion, &cone, err));
    if (baked->maps[WEFT_BAKED_OCCLUSION].n_mips > 0)
        weft_image_fini(&occlusion); /* a picture of it was given */
    else
        adopt(baked, WEFT_BAKED_OCCLUSION, &occlusion);
    adopt(baked, WEFT_BAKED_BENT_CONE, &cone);
    WEFT_TRY(weft_relief_cavity(height, scale, CAVITY_RADIUS_PX * scale, baked->periodic, &other, err));
    adopt(baked, WEFT_BAKED_CAVITY, &other);
    if (normal) {
        WEFT_TRY(weft_relief_curvature(normal, scale, baked->periodic, &other, err));
        adopt(baked, WEFT_BAKED_CURVATURE, &other);
    }
    return WEFT_OK;
}

weft_err weft_builder_make_relief(weft_builder *b, weft_error *err)
{
    char hex[65];
    if (b->baked.maps[WEFT_BAKED_HEIGHT].n_mips == 0)
        return WEFT_OK;
    weft_build_key key = weft_build_key_begin("relief", RELIEF_VERSION);
    weft_build_key_text(&key, "height", b->texels[WEFT_BAKED_HEIGHT]);
    weft_build_key_text(&key, "normal", b->texels[WEFT_BAKED_NORMAL]);
    weft_build_key_text(&key, "occlusion", b->texels[WEFT_BAKED_OCCLUSION]);
    weft_build_key_number(&key, "mm", mm_per_px(b));
    weft_build_key_number(&key, "reach", b->options->reach_mm);
    weft_build_key_number(&key, "periodic", b->baked.periodic);
    weft_build_key_end(&key, hex);
    for (int i = 0; i < 4; i++)
        memcpy(b->texels[relief_kinds[i]], hex, sizeof hex);
    const int n_kinds =
        b->baked.maps[WEFT_BAKED_NORMAL].n_mips > 0 ? 4 : 3; /* curvature is that of normals */
    if (reuse_all(b, relief_kinds, n_kinds)) {
        weft_builder_note(b, "occlusion, cavity, curvature", "kept", "the height is as it was");
        return WEFT_OK;
    }
    weft_builder_note(b, "occlusion, cavity, curvature", "rebuilt", "the height changed");
    return compute_relief(b, err);
}

weft_err weft_builder_make_detail(weft_builder *b, weft_error *err)
{
    weft_baked *const baked = &b->baked;
    const double scale = mm_per_px(b) > 0 ? mm_per_px(b) : 1, sigma = b->options->detail_mm / scale;
    if (!(b->options->detail_mm > 0))
        return WEFT_OK;
    for (int which = 0; which < 2; which++) {
        const weft_baked_kind from = which ? WEFT_BAKED_NORMAL : WEFT_BAKED_ALBEDO;
        const weft_baked_kind to = which ? WEFT_BAKED_DETAIL_NORMAL : WEFT_BAKED_DETAIL_ALBEDO;
        if (baked->maps[from].n_mips == 0)
            continue;
        const weft_image *const source = &baked->maps[from].mips[0];
        const size_t n = weft_image_plane_size(source);
        weft_image plane, base;
        WEFT_TRY(weft_baked_add(baked, to, baked->width, baked->height, err));
        weft_image *const out = &baked->maps[to].mips[0];
        WEFT_TRY(weft_image_init(&plane, source->width, source->height, 1, err));
        for (int p = 0; p < 3 - which; p++) { /* colours, or the slopes in x and y */
            for (size_t i = 0; i < n; i++)
                plane.data[i] =
                    which ? weft_image_plane(source, p)[i] / fmaxf(weft_image_plane(source, 2)[i], 0.01F)
                          : weft_image_plane(source, p)[i];
            const weft_err status = weft_relief_blur(&plane, fmax(sigma, 0.5), baked->periodic, &base, err);
            if (status != WEFT_OK) {
                weft_image_fini(&plane);
                return status;
            }
            for (size_t i = 0; i < n; i++)
                weft_image_plane(out, p)[i] =
                    which ? plane.data[i] - base.data[i] : plane.data[i] / fmaxf(base.data[i], 1e-4F);
            weft_image_fini(&base);
        }
        weft_image_fini(&plane);
        for (size_t i = 0; which && i < n; i++) {
            float *const x = weft_image_plane(out, 0) + i, *const y = weft_image_plane(out, 1) + i;
            const float length = sqrtf(*x * *x + *y * *y + 1);
            *x /= length;
            *y /= length;
            weft_image_plane(out, 2)[i] = 1 / length;
        }
    }
    return WEFT_OK;
}
