/* make-weave-maps FOLDER [sensor]: solved maps of a plain weave by formula (red warp, blue weft, 0.6 mm), for
 * tests of the commands that look at maps.  The lower right corner is masked. */
#include "host/set/maps.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { WIDTH = 400, HEIGHT = 300 };
#define MM_PER_PX 0.05
#define PITCH_MM  0.6

/* Height of the higher yarn in mm: round in section, rising over every other crossing. */
static double weave_height(double x, double y, bool *is_warp)
{
    const double fx = x / PITCH_MM, fy = y / PITCH_MM, ux = fx - floor(fx) - 0.5, uy = fy - floor(fy) - 0.5;
    const int up = ((int)floor(fx) + (int)floor(fy)) % 2 == 0 ? 1 : -1;
    const double pi = 3.141592653589793;
    const double warp = PITCH_MM * (0.5 * sqrt(0.25 - 0.9 * ux * ux) + up * 0.2 * cos(pi * uy));
    const double weft = PITCH_MM * (0.5 * sqrt(0.25 - 0.9 * uy * uy) - up * 0.2 * cos(pi * ux));
    *is_warp = warp > weft;
    return fmax(warp, weft);
}

static void fill_pixel(weft_maps *maps, int column, int row)
{
    static const float colours[2][3] = {{0.12f, 0.12f, 0.3f}, {0.5f, 0.08f, 0.06f}};
    const double x = maps->origin_mm[0] + column * MM_PER_PX, y = maps->origin_mm[1] - row * MM_PER_PX,
                 d = 0.01;
    bool warp, ignored;
    weft_image_row(&maps->height_mm, 0, row)[column] = (float)weave_height(x, y, &warp);
    const double gx = (weave_height(x + d, y, &ignored) - weave_height(x - d, y, &ignored)) / (2 * d);
    const double gy = (weave_height(x, y + d, &ignored) - weave_height(x, y - d, &ignored)) / (2 * d);
    const double length = sqrt(gx * gx + gy * gy + 1), normal[3] = {-gx / length, -gy / length, 1 / length};
    const bool masked = column >= WIDTH * 3 / 4 && row >= HEIGHT * 3 / 4;
    maps->mask.data[row * WIDTH + column] = masked ? 0 : 255;
    for (int c = 0; c < 3 && !masked; c++) {
        weft_image_row(&maps->normal, c, row)[column] = (float)normal[c];
        weft_image_row(&maps->albedo, c, row)[column] = colours[warp][c];
    }
    weft_image_row(&maps->residual, 0, row)[column] = (float)(0.02 * (1 - normal[2]));
    weft_image_row(&maps->confidence, 0, row)[column] = (float)normal[2];
}

int main(int argc, char **argv)
{
    weft_error error = {0};
    weft_maps maps = {.width = WIDTH, .height = HEIGHT, .albedo_is_srgb = true};
    if (argc < 2)
        return 2;
    if (argc < 3) {
        maps.geometry = WEFT_GEOMETRY_PLANE;
        maps.mm_per_px = MM_PER_PX;
    } else {
        maps.geometry = WEFT_GEOMETRY_SENSOR;
    }
    maps.origin_mm[0] = -(WIDTH - 1) / 2.0 * MM_PER_PX;
    maps.origin_mm[1] = (HEIGHT - 1) / 2.0 * MM_PER_PX;
    weft_err status = weft_image_init(&maps.normal, WIDTH, HEIGHT, 3, &error);
    status = status == WEFT_OK ? weft_image_init(&maps.albedo, WIDTH, HEIGHT, 3, &error) : status;
    status = status == WEFT_OK ? weft_image_init(&maps.height_mm, WIDTH, HEIGHT, 1, &error) : status;
    status = status == WEFT_OK ? weft_image_init(&maps.residual, WIDTH, HEIGHT, 1, &error) : status;
    status = status == WEFT_OK ? weft_image_init(&maps.confidence, WIDTH, HEIGHT, 1, &error) : status;
    status = status == WEFT_OK ? weft_mask_init(&maps.mask, WIDTH, HEIGHT, 255, &error) : status;
    for (int row = 0; row < HEIGHT && status == WEFT_OK; row++)
        for (int column = 0; column < WIDTH; column++)
            fill_pixel(&maps, column, row);
    if (status == WEFT_OK)
        status = weft_maps_save(argv[1], &maps, true, &error);
    weft_maps_fini(&maps);
    if (status != WEFT_OK)
        fprintf(stderr, "make-weave-maps: %s\n", error.text);
    return status == WEFT_OK ? 0 : 1;
}
