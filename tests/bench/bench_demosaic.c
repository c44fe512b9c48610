/* Demosaicing and decoding of a 16 Mpixel frame, each against moving the same bytes through memory. */
#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/formats/raw_file.h"
#include "core/mem.h"
#include "core/progress.h"
#include "host/set/noise.h"
#include "host/set/plate.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { W = 4928, H = 3264, ROUNDS = 5 };

typedef struct scene {
    const char *folder, *dng, *exr;
    weft_set set;
    weft_plate mosaic, rgb;
    weft_error error;
} scene;

static void must(weft_err status, const scene *s)
{
    if (status == WEFT_OK)
        return;
    fprintf(stderr, "bench_demosaic: %s\n", s->error.text);
    weft_folder_remove(s->folder, NULL);
    _Exit(1);
}

static void do_linear(scene *s)
{
    weft_plate_fini(&s->rgb);
    must(weft_plate_demosaic(&s->mosaic, WEFT_DEMOSAIC_LINEAR, &s->rgb, &s->error), s);
}

static void do_half(scene *s)
{
    weft_plate_fini(&s->rgb);
    must(weft_plate_demosaic(&s->mosaic, WEFT_DEMOSAIC_HALF, &s->rgb, &s->error), s);
}

static void do_noise(scene *s)
{
    s->mosaic.noise_floor = weft_noise_floor(&s->mosaic.image, 2);
}

static void do_load(scene *s)
{
    weft_plate_fini(&s->mosaic);
    must(weft_plate_load_frame(&s->set, 0, &s->mosaic, &s->error), s);
}

static void do_read_dng(scene *s)
{
    weft_mosaic m;
    must(weft_raw_read(s->dng, &m, NULL, &s->error), s);
    weft_mosaic_fini(&m);
}

static void do_write_exr(scene *s)
{
    static const char *const names[] = {"R", "G", "B"};
    must(weft_exr_write(s->exr, &s->rgb.image, names, WEFT_EXR_HALF, &s->error), s);
}

static void do_read_exr(scene *s)
{
    static const char *const names[] = {"R", "G", "B"};
    weft_image image;
    must(weft_exr_read(s->exr, names, 3, &image, &s->error), s);
    weft_image_fini(&image);
}

/* Seconds to copy `bytes` into fresh memory, as every result needs. */
static double copy_s(size_t bytes)
{
    char *const from = weft_alloc(bytes, 1, NULL);
    double best = 1e9;
    for (int i = 0; from && i < ROUNDS; i++) {
        memset(from, i, bytes);
        const double begin = weft_clock_s();
        char *const to = weft_alloc(bytes, 1, NULL);
        if (!to)
            break;
        memcpy(to, from, bytes);
        const double took = weft_clock_s() - begin;
        best = to[bytes / 2] == i && took < best ? took : best;
        weft_free(to);
    }
    weft_free(from);
    return best;
}

static void make_frame(scene *s)
{
    weft_mosaic m;
    const weft_frame_info info = {.exposure_s = 0.1};
    must(weft_mosaic_init(&m, W, H, WEFT_CFA_RGGB, &s->error), s);
    m.white = 15871;
    uint32_t state = 1;
    for (size_t i = 0; i < (size_t)W * H; i++) {
        state = state * 1664525 + 1013904223;
        m.data[i] = (uint16_t)(4000 + i % W + (state >> 24));
    }
    for (int i = 0; i < 4; i++)
        m.black[i] = 256;
    must(weft_dng_write(s->dng, &m, &info, &s->error), s);
    weft_mosaic_fini(&m);
    must(weft_set_init(&s->set, s->folder, &s->error), s);
    s->set.width = W;
    s->set.height = H;
    s->set.cfa = WEFT_CFA_RGGB;
    char name[] = "a.dng";
    const weft_set_frame frame = {.file = name, .exposure_s = 0.1, .gain = 1};
    must(weft_set_add_frame(&s->set, &frame, &s->error), s);
}

int main(void)
{
    char folder[] = "/tmp/weft-bench-XXXXXX", dng[64], exr[64];
    if (!mkdtemp(folder)) {
        perror("bench_demosaic: /tmp");
        return 1;
    }
    snprintf(dng, sizeof dng, "%s/a.dng", folder);
    snprintf(exr, sizeof exr, "%s/a.exr", folder);
    scene s = {.folder = folder, .dng = dng, .exr = exr};
    make_frame(&s);
    const size_t n = (size_t)W * H;
    const struct {
        const char *what;
        void (*run)(scene *s);
        size_t bytes; /* of the result */
    } rows[] = {
        {"read DNG (LibRaw)", do_read_dng, n * 2},
        {"load frame to linear light", do_load, n * 5},
        {"noise floor", do_noise, n * 4},
        {"demosaic, half size", do_half, n / 4 * 13},
        {"demosaic, full size", do_linear, n * 13},
        {"write EXR half, ZIP", do_write_exr, n * 6},
        {"read EXR half, ZIP", do_read_exr, n * 12},
    };
    printf("%d x %d pixels, best of %d; copy: memcpy of the result's bytes into fresh memory, one thread\n",
           W, H, ROUNDS);
    printf("%-28s %9s %9s %8s\n", "", "ms", "copy ms", "ratio");
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        double best = 1e9;
        for (int k = 0; k < ROUNDS; k++) {
            const double begin = weft_clock_s();
            rows[i].run(&s);
            const double took = weft_clock_s() - begin;
            best = took < best ? took : best;
        }
        const double copy = copy_s(rows[i].bytes);
        printf("%-28s %9.1f %9.1f %8.1f\n", rows[i].what, 1e3 * best, 1e3 * copy, best / copy);
    }
    weft_plate_fini(&s.mosaic);
    weft_plate_fini(&s.rgb);
    weft_set_fini(&s.set);
    weft_folder_remove(s.folder, NULL);
    return 0;
}
