/* make-white-set FOLDER: white.set, a white sheet under ten lights as DNG frames by a formula of its own,
 * with cos^4 vignetting and noise; truth.cal, what was put in; camera.cal, without the lights. */
#include "calibration/calibration.h"
#include "core/file.h"
#include "core/mem.h"
#include "host/set/set.h"
#include "tests/host/dome.h"
#include "tests/support/support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 616, HEIGHT = 408, BLACK = 256, WHITE = 15871 };
#define EXPOSURE_S 0.08

static void must(weft_err status, const weft_error *error)
{
    if (status == WEFT_OK)
        return;
    fprintf(stderr, "make-white-set: %s\n", error->text);
    exit(1);
}

/* light -1: all are off. */
static void expose(const weft_calibration *truth, int light, weft_mosaic *mosaic, uint64_t *random)
{
    static const double up[3] = {0, 0, 1};
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++) {
            double point[3], value = 0.01; /* the room */
            const double x = (u - truth->camera.cx) / truth->camera.fx,
                         y = (v - truth->camera.cy) / truth->camera.fy;
            const double cos4 = 1 / ((1 + x * x + y * y) * (1 + x * x + y * y));
            dome_point(&truth->camera, u, v, 0, point);
            if (light >= 0)
                value += 0.99 * dome_radiance(&truth->lights[light], weft_cfa_colour(WEFT_CFA_RGGB, u, v),
                                              point, up, 1);
            const double electrons = 20000 * value * cos4 * EXPOSURE_S;
            const double dn =
                BLACK + (electrons + sqrt(electrons + 9) * weft_test_gauss(random)) * (WHITE - BLACK) / 20000;
            mosaic->data[v * WIDTH + u] = (uint16_t)fmin(fmax(dn + 0.5, 0), WHITE);
        }
}

static void add_frame(weft_set *set, const weft_calibration *truth, int light, uint64_t *random)
{
    weft_error error = {0};
    weft_mosaic mosaic;
    char name[32];
    const weft_frame_info info = {.exposure_s = EXPOSURE_S, .gain = 1, .make = "Weft", .model = "formula"};
    snprintf(name, sizeof name, light < 0 ? "ambient.dng" : "light-%02d.dng", light);
    weft_set_frame frame = {.file = name,
                            .role = light < 0 ? WEFT_ROLE_AMBIENT : WEFT_ROLE_LIGHT,
                            .light = light,
                            .exposure_s = EXPOSURE_S,
                            .gain = 1};
    must(weft_mosaic_init(&mosaic, WIDTH, HEIGHT, WEFT_CFA_RGGB, &error), &error);
    for (int i = 0; i < 4; i++)
        mosaic.black[i] = BLACK;
    mosaic.white = WHITE;
    expose(truth, light, &mosaic, random);
    char *const path = weft_path_join(set->folder, name, &error);
    must(path ? weft_dng_write(path, &mosaic, &info, &error) : WEFT_ERR_NOMEM, &error);
    must(weft_set_add_frame(set, &frame, &error), &error);
    weft_free(path);
    weft_mosaic_fini(&mosaic);
}

static void save(const char *folder, const char *name, const weft_calibration *cal)
{
    weft_error error = {0};
    char *const path = weft_path_join(folder, name, &error);
    must(path ? weft_calibration_save(path, cal, &error) : WEFT_ERR_NOMEM, &error);
    weft_free(path);
}

int main(int argc, char **argv)
{
    weft_error error = {0};
    weft_calibration cal;
    weft_set set;
    uint64_t random = 31;
    if (argc != 2)
        return 2;
    dome_init(&cal, WIDTH, HEIGHT);
    save(argv[1], "truth.cal", &cal);
    char *const folder = weft_path_join(argv[1], "white.set", &error);
    must(folder ? weft_folder_create(folder, &error) : WEFT_ERR_NOMEM, &error);
    must(weft_set_init(&set, folder, &error), &error);
    set.width = WIDTH;
    set.height = HEIGHT;
    set.cfa = WEFT_CFA_RGGB;
    set.white = WHITE;
    for (int i = 0; i < 4; i++)
        set.black[i] = BLACK;
    set.complete = true;
    for (int light = -1; light < cal.n_lights; light++)
        add_frame(&set, &cal, light, &random);
    must(weft_set_save(&set, &error), &error);
    weft_set_fini(&set);
    weft_free(folder);
    cal.has_lights = false;
    cal.n_lights = 0;
    save(argv[1], "camera.cal", &cal);
    weft_calibration_fini(&cal);
    return 0;
}
