#include "shading/figures/figures.h"

#include "core/file.h"
#include "core/formats/image_file.h"
#include "core/mem.h"
#include "core/parallel.h"
#include "shading/preview/sheet.h"

#include <math.h>
#include <stdio.h>

#define SPHERE_SHARE 0.94 /* of the picture's side that the sphere takes */
#define GROUND       0.05

enum { PLACES = 3 };

double weft_figure_unit(double v[3])
{
    const double length = sqrt(weft_figure_dot(v, v));
    for (int c = 0; c < 3 && length > 0; c++)
        v[c] /= length;
    return length;
}

void weft_figure_frame(const double n[3], double t[3], double b[3])
{
    const double sign = n[2] < 0 ? -1 : 1, a = -1 / (sign + n[2]), c = n[0] * n[1] * a;
    const double first[3] = {1 + sign * n[0] * n[0] * a, sign * c, -sign * n[0]};
    const double second[3] = {c, sign + n[1] * n[1] * a, -n[1]};
    for (int k = 0; k < 3; k++) {
        t[k] = first[k];
        b[k] = second[k];
    }
}

typedef struct sphere_job {
    weft_image *picture;
    weft_figure_fn *fn;
    const void *context;
} sphere_job;

static void draw_rows(void *context, int band, int row_begin, int row_end)
{
    const sphere_job *const job = context;
    const int side = job->picture->width;
    const double radius = SPHERE_SHARE * side / 2;
    (void)band;
    for (int row = row_begin; row < row_end; row++)
        for (int column = 0; column < side; column++) {
            double sum[3] = {0};
            for (int k = 0; k < PLACES * PLACES; k++) {
                const int right = k % PLACES, down = k / PLACES;
                const double x = (column + (right + 0.5) / PLACES - side / 2.0) / radius;
                const double y = (side / 2.0 - row - (down + 0.5) / PLACES) / radius;
                const double rest = 1 - x * x - y * y, n[3] = {x, y, rest > 0 ? sqrt(rest) : 0};
                double radiance[3] = {GROUND, GROUND, GROUND};
                if (rest > 0)
                    job->fn(job->context, n, radiance);
                for (int c = 0; c < 3; c++)
                    sum[c] += radiance[c];
            }
            for (int c = 0; c < 3; c++)
                weft_image_row(job->picture, c, row)[column] = (float)(sum[c] / (PLACES * PLACES));
        }
}

weft_err weft_figure_sphere(weft_image *picture, int side_px, weft_figure_fn *fn, const void *context,
                            weft_error *err)
{
    WEFT_TRY(weft_image_init(picture, side_px, side_px, 3, err));
    weft_parallel_rows(side_px, draw_rows, &(sphere_job){picture, fn, context});
    return WEFT_OK;
}

weft_err weft_figure_save(const char *folder, const char *name, int columns, int rows,
                          weft_image *const pictures[], const char *const words[], weft_tone tone,
                          weft_error *err)
{
    weft_sheet sheet = {0};
    char *const path = weft_path_join(folder, name, err);
    weft_err status =
        path ? weft_sheet_init(&sheet, columns, rows, pictures[0]->width, pictures[0]->height, "", err)
             : WEFT_ERR_NOMEM;
    for (int i = 0; i < columns * rows && status == WEFT_OK; i++) {
        weft_tone_image(tone, pictures[i]);
        status = weft_sheet_place(&sheet, i % columns, i / columns, pictures[i], words[i], err);
    }
    if (status == WEFT_OK)
        status = weft_image_write(path, &sheet.image, 8, WEFT_TRANSFER_SRGB, err);
    if (status == WEFT_OK)
        printf("%s\n", path);
    weft_sheet_fini(&sheet);
    weft_free(path);
    return status;
}
