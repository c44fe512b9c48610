/*
 * Filament's roughness-prefilter (Debian's libfilament-tools) beside our rules, on the same normal maps, held
 * against the same drawn normals (tests/shading/drawn_normals.h): mean and worst Kolmogorov-Smirnov excess
 * over three fabrics, alpha 0.05 to 0.5, mips 1 to 6. peer_mips It writes 8-bit PNG: its EXR files are empty
 * in the version of Debian 12.
 */
#include "core/file.h"
#include "core/formats/png_file.h"
#include "shading/bake/mips.h"
#include "tests/shading/drawn_normals.h"
#include "tests/support/support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

typedef struct figure {
    double sum, worst;
} figure;

static void add(figure *f, double excess)
{
    f->sum += fmax(excess, 0);
    f->worst = fmax(f->worst, excess);
}

static void write_normals(const weft_baked *b)
{
    const weft_image *const n = &b->maps[WEFT_BAKED_NORMAL].mips[0];
    weft_raster raster;
    assert_ok(weft_raster_init(&raster, n->width, n->height, 3, 16, err));
    for (size_t i = 0; i < weft_image_plane_size(n); i++)
        for (size_t c = 0; c < 3; c++)
            raster.data[3 * i + c] =
                (uint16_t)lrint(32767.5 + 32767.5 * (double)weft_image_plane(n, (int)c)[i]);
    assert_ok(weft_png_write("normal.png", &raster, err));
    weft_raster_fini(&raster);
}

/* Filament's answers for all levels.  @param levels  [DRAWN_LEVELS + 1], 8 bits */
static void run_filament(double alpha, weft_raster *levels)
{
    char line[128], name[32];
    (void)snprintf(line, sizeof line, "roughness-prefilter -r %g -f png -l normal.png out.png >/dev/null",
                   alpha);
    assert_int_equal(system(line), 0);
    for (int level = 1; level <= DRAWN_LEVELS; level++) {
        (void)snprintf(name, sizeof name, "out_%d.png", level);
        assert_ok(weft_png_read(name, &levels[level], err));
        assert_int_equal(levels[level].width, DRAWN_SIDE >> level);
    }
}

static double texel(const weft_raster *level, int x, int y)
{
    const double code = level->data[(size_t)(y * level->width + x) * (size_t)level->channels];
    return code / (level->bits > 8 ? 65535 : 255);
}

static void compare(void **state)
{
    (void)state;
    figure filament[2] = {{0}}, ours[6] = {{0}};
    int n = 0;
    for (int f = 0; f < DRAWN_FABRICS; f++)
        for (int r = 0; r < DRAWN_ALPHAS; r++) {
            weft_baked b[6];
            weft_raster levels[2][DRAWN_LEVELS + 1] = {{{0}}};
            for (int rule = 0; rule < 6; rule++) {
                const weft_mip_options options = {.rule = (weft_mip_rule)rule};
                drawn_normals_make(&b[rule], f);
                b[rule].maps[WEFT_BAKED_ROUGHNESS].constant[0] = (float)drawn_alphas[r];
                assert_ok(weft_mips_make(&b[rule], &options, err));
            }
            write_normals(&b[0]);
            run_filament(drawn_alphas[r], levels[0]);
            run_filament(sqrt(drawn_alphas[r]), levels[1]);
            for (drawn_footprint at = {0}; drawn_next(&at); n++) {
                drawn_tangents tangents;
                drawn_normals_draw(&b[0], &at, drawn_alphas[r], &tangents);
                const double least = drawn_least_distance(&tangents);
                for (int k = 0; k < 2; k++) {
                    const double roughness = texel(&levels[k][at.level], at.x, at.y);
                    add(&filament[k],
                        drawn_distance(&tangents, k ? roughness * roughness : roughness) - least);
                }
                for (int rule = 0; rule < 6; rule++) {
                    const weft_image *const map = &b[rule].maps[WEFT_BAKED_ROUGHNESS].mips[at.level];
                    add(&ours[rule],
                        drawn_distance(&tangents, (double)weft_image_row(map, 0, at.y)[at.x]) - least);
                }
            }
            for (int level = 1; level <= DRAWN_LEVELS; level++)
                for (int k = 0; k < 2; k++)
                    weft_raster_fini(&levels[k][level]);
            for (int rule = 0; rule < 6; rule++)
                weft_baked_fini(&b[rule]);
        }
    static const char *const names[] = {"closest", "length", "vmf", "vmf-consistent", "toksvig", "none"};
    printf("%d footprints: Kolmogorov-Smirnov distance over that of the best GGX\n%-34s %8s %8s\n", n, "",
           "mean", "worst");
    printf("%-34s %8.4f %8.3f\n", "roughness-prefilter, of alpha", filament[0].sum / n, filament[0].worst);
    printf("%-34s %8.4f %8.3f\n", "roughness-prefilter, of sqrt(alpha)", filament[1].sum / n,
           filament[1].worst);
    for (int rule = 0; rule < 6; rule++)
        printf("weft %-29s %8.4f %8.3f\n", names[rule], ours[rule].sum / n, ours[rule].worst);
}

int main(void)
{
    char folder[] = "/tmp/weft-peer-XXXXXX";
    if (system("command -v roughness-prefilter >/dev/null") != 0) {
        puts("skipped: roughness-prefilter is not here (package libfilament-tools)");
        return 77;
    }
    if (!mkdtemp(folder) || chdir(folder) != 0)
        return 1;
    const struct CMUnitTest tests[] = {cmocka_unit_test(compare)};
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    weft_folder_remove(folder, NULL);
    return failed;
}
