/*
 * Frames a second of a 1920 x 1080 preview that is filled by a woven material of 4096 x 4096 texels (its
 * chains of mips, anisotropic look-ups) under one ball light and a clear sky.
 *
 * Baseline: the same picture with a distant light alone.  Goal: 10 frames a second on two cores.
 *
 *     bench_preview [PICTURE.png]      keeps the first picture (tests/bench/peers/preview_three.sh)
 */
#include "core/formats/image_file.h"
#include "core/mem.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "shading/bake/mips.h"
#include "shading/brdf/half_vector.h"
#include "shading/preview/preview.h"

#include <stdio.h>
#include <time.h>

enum { SIDE = 4096, WIDTH = 1920, HEIGHT = 1080, SHOWN = SIDE * HEIGHT / WIDTH, ROUNDS = 7 };

static void weave(weft_baked *baked)
{
    weft_image *const normal = &baked->maps[WEFT_BAKED_NORMAL].mips[0];
    weft_image *const albedo = &baked->maps[WEFT_BAKED_ALBEDO].mips[0];
    weft_image *const alpha = &baked->maps[WEFT_BAKED_ROUGHNESS].mips[0];
    static const float yarns[2][3] = {{0.05F, 0.1F, 0.3F}, {0.6F, 0.5F, 0.3F}};
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            const double a = 0.4 * sin(0.2 * x), b = 0.4 * sin(0.2 * y), z = 1 / sqrt(1 + a * a + b * b);
            const double n[3] = {-a * z, -b * z, z};
            for (int c = 0; c < 3; c++) {
                weft_image_row(normal, c, y)[x] = (float)n[c];
                weft_image_row(albedo, c, y)[x] = yarns[(x + y) & 64 ? 1 : 0][c];
            }
            weft_image_row(alpha, 0, y)[x] = 0.3f;
        }
}

typedef struct cost {
    double wall_s, cpu_s; /* the quickest of the rounds; cpu over all threads */
} cost;

static cost cost_of(const weft_preview_surface *surface, const weft_preview_view *view)
{
    cost best = {1e9, 1e9};
    for (int i = 0; i < ROUNDS; i++) {
        weft_image picture;
        const clock_t cpu = clock();
        const double begin = weft_clock_s();
        if (weft_preview_render(surface, view, &picture, NULL) != WEFT_OK)
            return best;
        const double wall = weft_clock_s() - begin, used = (double)(clock() - cpu) / CLOCKS_PER_SEC;
        best.wall_s = wall < best.wall_s ? wall : best.wall_s;
        best.cpu_s = used < best.cpu_s ? used : best.cpu_s;
        weft_image_fini(&picture);
    }
    return best;
}

static const struct {
    const char *name;
    weft_preview_shape shape;
    bool draft;
} pictures[] = {{"plane, one sample a pixel", WEFT_PREVIEW_PLANE, true},
                {"plane, four samples", WEFT_PREVIEW_PLANE, false},
                {"ball, one sample a pixel", WEFT_PREVIEW_SPHERE, true}};

static weft_err keep(const weft_preview_surface *surface, const weft_preview_view *view, const char *path)
{
    weft_image picture;
    WEFT_TRY(weft_preview_render(surface, view, &picture, NULL));
    const weft_err status = weft_image_write(path, &picture, 8, WEFT_TRANSFER_SRGB, NULL);
    weft_image_fini(&picture);
    return status;
}

static weft_err run(weft_preview_surface *surface, const weft_environment_map *map,
                    const weft_environment_table *table, const char *path)
{
    for (size_t k = 0; k < sizeof pictures / sizeof pictures[0]; k++) {
        weft_preview_view view = weft_preview_view_defaults();
        weft_preview_texture texture;
        view.width = WIDTH;
        view.height = HEIGHT;
        view.shape = pictures[k].shape;
        view.draft = pictures[k].draft;
        view.exposure_ev = -1;
        if (view.shape == WEFT_PREVIEW_PLANE)
            view.crop = (weft_preview_crop){0, (SIDE - SHOWN) / 2, SIDE, SHOWN};
        const double begin = weft_clock_s();
        WEFT_TRY(weft_preview_pack(surface, &view, &texture, NULL));
        const double packed = weft_clock_s() - begin;
        surface->texture = &texture;
        const cost plain = cost_of(surface, &view);
        view.surroundings = (weft_preview_surroundings){map, table, 1};
        view.lights[0].kind = WEFT_PREVIEW_BALL;
        view.lights[0].area = WEFT_PREVIEW_REPRESENTATIVE;
        view.lights[0].position_mm[2] = 300;
        view.lights[0].radius_mm = 40;
        const cost full = cost_of(surface, &view);
        printf("%-25s ball and sky %6.2f frames/s (%.3f s of core time, so %.1f on two cores to itself), "
               "%.1f times a distant light alone (%.2f frames/s); packed once in %.2f s\n",
               pictures[k].name, 1 / full.wall_s, full.cpu_s, 2 / full.cpu_s, full.cpu_s / plain.cpu_s,
               1 / plain.wall_s, packed);
        if (k == 0 && path)
            WEFT_TRY(keep(surface, &view, path));
        surface->texture = NULL;
        weft_preview_texture_fini(&texture);
    }
    return WEFT_OK;
}

/* Points a plane of the model at each channel of a map's chain. */
static void use_map(weft_preview_surface *surface, const char *param, const weft_baked_map *map)
{
    int plane = 0;
    const weft_brdf_param *const row = weft_brdf_find_param(surface->brdf, param, &plane);
    for (int c = 0; row && c < row->components; c++)
        surface->maps[plane + c] = (weft_preview_map){map->mips, c, map->n_mips};
}

int main(int argc, char **argv)
{
    static weft_environment_table table;
    weft_baked baked = {0};
    weft_image panorama = {0};
    weft_environment_map map = {0};
    const weft_baked_kind kinds[] = {WEFT_BAKED_NORMAL, WEFT_BAKED_ALBEDO, WEFT_BAKED_ROUGHNESS};
    weft_mip_options options = weft_mip_defaults();
    weft_err status = weft_baked_init(&baked, "weave", NULL, NULL);
    for (int i = 0; i < 3 && status == WEFT_OK; i++)
        status = weft_baked_add(&baked, kinds[i], SIDE, SIDE, NULL);
    if (status != WEFT_OK)
        return 1;
    weave(&baked);
    options.rule = WEFT_MIP_VMF; /* the quickest to bake; they are looked up alike */
    if (weft_mips_make(&baked, &options, NULL) != WEFT_OK ||
        weft_environment_paint_sky(&panorama, &weft_sky_cie_clear, 0.8, 1, NULL) != WEFT_OK ||
        weft_environment_map_init(&map, &panorama, NULL) != WEFT_OK)
        return 1;
    weft_environment_table_get(&table, WEFT_ENVIRONMENT_SMITH);
    weft_preview_surface surface = {.width = SIDE, .height = SIDE, .mm_per_px = 0.05};
    surface.origin_mm[0] = -0.5 * (SIDE - 1) * surface.mm_per_px;
    surface.origin_mm[1] = -surface.origin_mm[0];
    surface.normal = baked.maps[WEFT_BAKED_NORMAL].mips;
    surface.normal_levels = baked.maps[WEFT_BAKED_NORMAL].n_mips;
    if (weft_brdf_find("ggx", &surface.brdf, NULL) != WEFT_OK)
        return 1;
    weft_brdf_defaults(surface.brdf, surface.params);
    use_map(&surface, "albedo", &baked.maps[WEFT_BAKED_ALBEDO]);
    use_map(&surface, "alpha", &baked.maps[WEFT_BAKED_ROUGHNESS]);
    status = run(&surface, &map, &table, argc > 1 ? argv[1] : NULL);
    weft_environment_map_fini(&map);
    weft_image_fini(&panorama);
    weft_baked_fini(&baked);
    return status == WEFT_OK ? 0 : 1;
}
