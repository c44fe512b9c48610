/*
 * A full bake of a four-layer material over a scan of 4096 x 4096 texels, cold, stage by stage with its peak
 * memory, and warm; the mips alone beside OpenImageIO's maketx (which averages only) and Filament's
 * roughness-prefilter, where they are installed.
 *   bench_bake [SIDE]
 */
#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/formats/png_file.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/text.h"
#include "host/cli/scan_input.h"
#include "host/set/maps.h"
#include "shading/bake/material_file.h"
#include "shading/material/build.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

static weft_error error;

static void must(weft_err status)
{
    if (status == WEFT_OK)
        return;
    fprintf(stderr, "bench_bake: %s\n", error.text);
    exit(1);
}

/* A twill of 32 texels a thread with ribs of its yarns; periodic where the side is a multiple of 128. */
static double twill(double u, double v)
{
    const double pi = 3.14159265358979, warp = u / 32, weft = v / 32;
    const double up = cos(pi / 2 * (warp - weft)) > 0 ? 1 : -1;
    return 6 * (up > 0 ? fabs(sin(pi * warp)) : fabs(sin(pi * weft))) + 0.3 * sin(pi / 4 * (u + v));
}

static void write_scan(const char *folder, int side)
{
    weft_maps maps = {.width = side, .height = side, .geometry = WEFT_GEOMETRY_PLANE, .mm_per_px = 0.025};
    must(weft_image_init(&maps.normal, side, side, 3, &error));
    must(weft_image_init(&maps.albedo, side, side, 3, &error));
    uint32_t random = 1;
    for (int y = 0; y < side; y++)
        for (int x = 0; x < side; x++) {
            const double a = -(twill(x + 0.5, y) - twill(x - 0.5, y)),
                         b = twill(x, y + 0.5) - twill(x, y - 0.5);
            random = random * 1664525 + 1013904223;
            const double noise = 0.02 * ((random >> 16) / 65536.0 - 0.5), l = sqrt(a * a + b * b + 1);
            weft_image_row(&maps.normal, 0, y)[x] = (float)((a + noise) / l);
            weft_image_row(&maps.normal, 1, y)[x] = (float)((b - noise) / l);
            weft_image_row(&maps.normal, 2, y)[x] = (float)(1 / l);
            for (int c = 0; c < 3; c++)
                weft_image_row(&maps.albedo, c, y)[x] =
                    (float)(0.15 + 0.1 * c + 0.02 * twill(x, y) / 6 + noise);
        }
    must(weft_maps_save(folder, &maps, false, &error));
    weft_maps_fini(&maps);
}

static const char text[] = ":thread := ( clothmaterial :albedo_color = 0.5 :specular_roughness = 0.6 )\n"
                           ":dirt := ( opaquematerial :albedo_color = 0.05 :specular_roughness = 0.9 )\n"
                           ":coat := ( clothmaterial\n"
                           "    :layers = [\n"
                           "        ( thread :scan = \"scan.maps\" )\n"
                           "        ( dirt :alpha = 0.4 :mask = ( :from = cavity :low = 0.6 :high = 0.2 ) )\n"
                           "        ( dirt :alpha = 0.2 :channels = albedo :mask = ( :from = noise ) )\n"
                           "        ( thread :alpha = 0.3 :albedo_tint_color = #406080 :channels = albedo )\n"
                           "    ]\n"
                           ")\n";

/* Stages as the build names them: a note begins one. */
typedef struct stages {
    char name[40];
    double begin_s, first_s;
} stages;

static void end_stage(stages *s)
{
    const double now = weft_clock_s();
    if (s->name[0])
        printf("  %-34s %8.2f s\n", s->name, now - s->begin_s);
    s->begin_s = now;
}

static void begin_stage(void *context, const char *step, const char *what, const char *why)
{
    stages *const s = context;
    (void)what, (void)why;
    end_stage(s);
    (void)snprintf(s->name, sizeof s->name, "%s", step);
}

static void bake(void)
{
    static const weft_exporter *exporters[3];
    stages s = {.name = "inputs hashed", .begin_s = weft_clock_s()};
    weft_assets *assets;
    weft_build_result result;
    must(weft_exporter_find("png", &exporters[0], &error));
    must(weft_exporter_find("gltf", &exporters[1], &error));
    must(weft_assets_load("coat.radattr", NULL, &assets, &error));
    const weft_build_options options = {.folder = "coat.material",
                                        .composite = {.periodic = true, .load_scan = weft_scan_input_load},
                                        .mips = weft_mip_defaults(),
                                        .exporters = exporters,
                                        .note = begin_stage,
                                        .context = &s};
    must(weft_build(assets, weft_assets_main(assets), &options, &result, &error));
    end_stage(&s);
    weft_assets_destroy(assets);
}

/* In a process of its own, for the peak of its memory. */
static void bake_apart(const char *title)
{
    printf("%s\n", title);
    (void)fflush(stdout);
    const double begin = weft_clock_s();
    const pid_t child = fork();
    if (child == 0) {
        bake();
        exit(0);
    }
    int status;
    struct rusage used;
    if (child < 0 || wait4(child, &status, 0, &used) < 0 || status != 0)
        exit(1);
    printf("  %-34s %8.2f s, %.2f s of processor, peak %.2f GiB (limit 3)\n", "in all",
           weft_clock_s() - begin,
           (double)(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
               1e-6 * (double)(used.ru_utime.tv_usec + used.ru_stime.tv_usec),
           (double)used.ru_maxrss / 1048576);
}

/* Copying the bytes of a chain of mips of normals and roughness, for scale. */
static double copy_s(size_t bytes)
{
    char *const a = weft_alloc(bytes, 1, &error), *const b = weft_alloc(bytes, 1, &error);
    must(a && b ? WEFT_OK : WEFT_ERR_NOMEM);
    memset(a, 1, bytes);
    memset(b, 2, bytes);
    const double begin = weft_clock_s();
    memcpy(b, a, bytes);
    const double took = weft_clock_s() - begin;
    weft_free(a);
    weft_free(b);
    return took;
}

static void time_program(const char *title, const char *command, double ours)
{
    char probe[64];
    (void)snprintf(probe, sizeof probe, "command -v %.*s >/dev/null", (int)strcspn(command, " "), command);
    if (system(probe) != 0) {
        printf("  %-52s not here\n", title);
        return;
    }
    const double begin = weft_clock_s();
    const int status = system(command);
    const double took = weft_clock_s() - begin;
    printf("  %-52s %8.2f s  %6.2f x ours%s\n", title, took, took / ours, status ? "  (it failed)" : "");
}

static void load_lobe(weft_baked *b)
{
    static const char *const names[] = {"X", "Y", "Z"};
    weft_image normal;
    must(weft_baked_init(b, "mips", weft_material_type_find("opaquematerial"), &error));
    must(weft_exr_read("normal.exr", names, 3, &normal, &error));
    must(weft_baked_add(b, WEFT_BAKED_NORMAL, normal.width, normal.height, &error));
    memcpy(b->maps[WEFT_BAKED_NORMAL].mips[0].data, normal.data,
           3 * weft_image_plane_size(&normal) * sizeof(float));
    weft_image_fini(&normal);
    b->maps[WEFT_BAKED_ROUGHNESS].constant[0] = 0.3F;
}

/* One picture of normals from file to file with its mips: ours filters roughness as well. */
static void compare_mips(int side)
{
    static const char *const rules[] = {"closest", "vmf-consistent"};
    static const weft_mip_rule which[] = {WEFT_MIP_CLOSEST, WEFT_MIP_VMF_CONSISTENT};
    double ours = 0;
    printf("mips of a normal map with their roughness, file to file; copying the same floats takes %.2f s\n",
           copy_s((size_t)side * (size_t)side * 4 * sizeof(float) * 4 / 3));
    for (int i = 1; i >= 0; i--) {
        weft_baked b;
        double begin = weft_clock_s();
        load_lobe(&b);
        const double read = weft_clock_s() - begin;
        begin = weft_clock_s();
        const weft_mip_options options = {.rule = which[i]};
        must(weft_mips_make(&b, &options, &error));
        const double made = weft_clock_s() - begin;
        begin = weft_clock_s();
        must(weft_material_save_map(".", &b, WEFT_BAKED_ROUGHNESS, &error));
        must(weft_material_save_map("out", &b, WEFT_BAKED_NORMAL, &error));
        const double written = weft_clock_s() - begin;
        weft_baked_fini(&b);
        ours = read + made + written;
        printf("  weft, rule %-16s read %.2f, made %.2f, written %.2f %8.2f s\n", rules[i], read, made,
               written, ours);
    }
    time_program("maketx (normals averaged, no roughness)",
                 "maketx --threads 2 -o maketx.exr normal.exr >/dev/null 2>&1", ours);
    time_program("roughness-prefilter (roughness alone, 8 bits)",
                 "roughness-prefilter -r 0.3 -f png -l normal.png filament.png >/dev/null 2>&1", ours);
}

/* What the peers read. */
static void write_peer_inputs(int side)
{
    static const char *const names[] = {"X", "Y", "Z"};
    weft_maps maps;
    weft_raster raster;
    must(weft_maps_load("scan.maps", &maps, &error));
    must(weft_exr_write("normal.exr", &maps.normal, names, WEFT_EXR_HALF, &error));
    must(weft_raster_init(&raster, side, side, 3, 16, &error));
    for (size_t i = 0; i < weft_image_plane_size(&maps.normal); i++)
        for (size_t c = 0; c < 3; c++)
            raster.data[3 * i + c] =
                (uint16_t)lrint(32767.5 + 32767.5 * (double)weft_image_plane(&maps.normal, (int)c)[i]);
    must(weft_png_write("normal.png", &raster, &error));
    weft_raster_fini(&raster);
    weft_maps_fini(&maps);
    must(weft_folder_create("out", &error));
}

int main(int argc, char **argv)
{
    int side = 4096;
    char folder[] = "/tmp/weft-bench-XXXXXX";
    if ((argc > 1 && !weft_text_to_int(argv[1], &side)) || side < 64 || side > 16384 || !mkdtemp(folder) ||
        chdir(folder) != 0) {
        fprintf(stderr, "bench_bake: give a side of 64 to 16384; /tmp must be writable\n");
        return 1;
    }
    printf("%d x %d texels, four layers over a scan; exports png and gltf\n", side, side);
    (void)fflush(stdout);
    const pid_t maker = fork(); /* its memory is not the bake's */
    if (maker == 0) {
        write_scan("scan.maps", side);
        must(weft_file_write("coat.radattr", text, sizeof text - 1, &error));
        write_peer_inputs(side);
        exit(0);
    }
    int status;
    if (maker < 0 || waitpid(maker, &status, 0) < 0 || status != 0)
        return 1;
    bake_apart("cold");
    bake_apart("warm, nothing changed");
    compare_mips(side);
    weft_folder_remove(folder, NULL);
    return 0;
}
