/*
 * Frames a second of a 1920 x 1080 preview: a woven material of 4096 x 4096 texels under one ball light and a
 * clear sky, drawn from the mip that fits.
 *
 * Baseline: the same picture with a distant light alone.  Goal: 10 frames a second on two cores.
 */
#include "core/mem.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "shading/bake/mips.h"
#include "shading/brdf/half_vector.h"
#include "shading/preview/preview.h"

#include <stdio.h>
#include <time.h>

enum { SIDE = 4096, LEVEL = 2, ROUNDS = 5 };

static void weave(weft_baked *baked)
{
    weft_image *const normal = &baked->maps[WEFT_BAKED_NORMAL].mips[0];
    weft_image *const albedo = &baked->maps[WEFT_BAKED_ALBEDO].mips[0];
    weft_image *const alpha = &baked->maps[WEFT_BAKED_ROUGHNESS].mips[0];
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            const double a = 0.4 * sin(0.2 * x), b = 0.4 * sin(0.2 * y), z = 1 / sqrt(1 + a * a + b * b);
            const double n[3] = {-a * z, -b * z, z};
            for (int c = 0; c < 3; c++) {
                weft_image_row(normal, c, y)[x] = (float)n[c];
                weft_image_row(albedo, c, y)[x] = (x + y) & 64 ? 0.5f : 0.1f;
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

static void run(const weft_preview_surface *surface, const weft_environment_map *map,
                const weft_environment_table *table)
{
    weft_preview_view view = weft_preview_view_defaults();
    view.width = 1920;
    view.height = 1080;
    for (int draft = 1; draft >= 0; draft--) {
        view.draft = draft;
        view.surroundings = (weft_preview_surroundings){0};
        view.lights[0].kind = WEFT_PREVIEW_DISTANT;
        const cost plain = cost_of(surface, &view);
        view.surroundings = (weft_preview_surroundings){map, table, 1};
        view.lights[0].kind = WEFT_PREVIEW_BALL;
        view.lights[0].area = WEFT_PREVIEW_REPRESENTATIVE;
        view.lights[0].position_mm[2] = 300;
        view.lights[0].radius_mm = 40;
        const cost full = cost_of(surface, &view);
        printf("%-21s ball and sky %6.2f frames/s (%.3f s of core time, so %.2f on two cores to itself), "
               "%.1f times a distant light alone (%.2f frames/s)\n",
               draft ? "one sample a pixel:" : "four samples a pixel:", 1 / full.wall_s, full.cpu_s,
               2 / full.cpu_s, full.cpu_s / plain.cpu_s, 1 / plain.wall_s);
    }
}

int main(void)
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
    options.max_levels = LEVEL + 1;
    options.rule = WEFT_MIP_VMF;
    if (weft_mips_make(&baked, &options, NULL) != WEFT_OK ||
        weft_environment_paint_sky(&panorama, &weft_sky_cie_clear, 0.8, 1, NULL) != WEFT_OK ||
        weft_environment_map_init(&map, &panorama, NULL) != WEFT_OK)
        return 1;
    weft_environment_table_get(&table, WEFT_ENVIRONMENT_SMITH);
    weft_preview_surface surface = {.width = SIDE >> LEVEL, .height = SIDE >> LEVEL, .mm_per_px = 0.2};
    surface.normal = &baked.maps[WEFT_BAKED_NORMAL].mips[LEVEL];
    if (weft_brdf_find("ggx", &surface.brdf, NULL) != WEFT_OK)
        return 1;
    weft_brdf_defaults(surface.brdf, surface.params);
    if (weft_preview_set_map(&surface, "albedo", &baked.maps[WEFT_BAKED_ALBEDO].mips[LEVEL], NULL) !=
            WEFT_OK ||
        weft_preview_set_map(&surface, "alpha", &baked.maps[WEFT_BAKED_ROUGHNESS].mips[LEVEL], NULL) !=
            WEFT_OK)
        return 1;
    run(&surface, &map, &table);
    weft_environment_map_fini(&map);
    weft_image_fini(&panorama);
    weft_baked_fini(&baked);
    return 0;
}
