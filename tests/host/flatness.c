/* flatness MAPS: how flat the maps of a flat sheet are, as one JSON line, beside what their uncertainty
 * expects. Blocks of about 3 mm average the noise of the pixels away: what they show is the calibration's. */
#include "core/error.h"
#include "core/linalg.h"
#include "host/set/maps.h"

#include <math.h>
#include <stdio.h>

#define BLOCKS_ACROSS 51
#define DEGREES       57.29577951308232

typedef struct flatness {
    double pixel_mean, pixel_squares, expected_squares, block_mean, block_worst;
    long n_pixels, n_blocks;
} flatness;

static void add_block(const weft_maps *maps, int u0, int v0, int side, flatness *f)
{
    weft_vec3 sum = {0, 0, 0};
    int n = 0;
    for (int v = v0; v < v0 + side; v++)
        for (int u = u0; u < u0 + side; u++) {
            if (maps->mask.data && !maps->mask.data[(size_t)v * (size_t)maps->width + (size_t)u])
                continue;
            const weft_vec3 normal = {(double)weft_image_row(&maps->normal, 0, v)[u],
                                      (double)weft_image_row(&maps->normal, 1, v)[u],
                                      (double)weft_image_row(&maps->normal, 2, v)[u]};
            sum = weft_add(sum, normal);
            const double off = weft_angle_between(normal, (weft_vec3){0, 0, 1}) * DEGREES,
                         expected = (double)weft_image_row(&maps->uncertainty, 0, v)[u];
            f->pixel_mean += off;
            f->pixel_squares += off * off;
            f->expected_squares += expected * expected;
            f->n_pixels++;
            n++;
        }
    if (2 * n < side * side)
        return;
    const double angle = weft_angle_between(sum, (weft_vec3){0, 0, 1}) * DEGREES;
    f->block_mean += angle;
    f->block_worst = fmax(f->block_worst, angle);
    f->n_blocks++;
}

int main(int argc, char **argv)
{
    weft_error error = {0};
    weft_maps maps;
    flatness f = {0};
    if (argc != 2)
        return 2;
    if (weft_maps_load(argv[1], &maps, &error) != WEFT_OK) {
        fprintf(stderr, "flatness: %s\n", error.text);
        return 1;
    }
    const int side = maps.width / BLOCKS_ACROSS > 0 ? maps.width / BLOCKS_ACROSS : 1;
    for (int v = 0; v + side <= maps.height; v += side)
        for (int u = 0; u + side <= maps.width; u += side)
            add_block(&maps, u, v, side, &f);
    printf("{\"pixel_mean_deg\": %.5f, \"pixel_rms_deg\": %.5f, \"uncertainty_rms_deg\": %.5f, "
           "\"block_mean_deg\": %.5f, \"block_worst_deg\": %.5f, \"block_px\": %d, "
           "\"blocks\": %ld}\n",
           f.pixel_mean / (double)f.n_pixels, sqrt(f.pixel_squares / (double)f.n_pixels),
           sqrt(f.expected_squares / (double)f.n_pixels), f.block_mean / (double)f.n_blocks, f.block_worst,
           side, f.n_blocks);
    weft_maps_fini(&maps);
    return 0;
}
