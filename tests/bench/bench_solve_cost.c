/*
 * What a picture costs against its size and the number of lights, as text and as two SVG files: straight
 * lines.
 *
 *     bench_solve_cost [FOLDER]     writes solve-cost-size.svg and solve-cost-lights.svg into FOLDER
 */
#include "core/file.h"
#include "core/parallel.h"
#include "core/plot/plot.h"
#include "tests/bench/solve_work.h"

#include <math.h>
#include <stdio.h>

enum { ROUNDS = 5, POINTS = 8, METHODS = 3 };

typedef struct curve {
    double x[POINTS], seconds[METHODS][POINTS];
    int n;
} curve;

static const char *const method_names[METHODS] = {"lsq", "robust, matte", "robust, all searched"};

static void measure_point(curve *c, double x, int width, int height, int n)
{
    static work w;
    work_init(&w, width, height, n);
    c->x[c->n] = x;
    for (int m = 0; m < METHODS; m++) {
        double least = (double)NAN;
        for (int round = 0; round < ROUNDS; round++)
            work_take_less(&least,
                           work_solve_ns(&w, m == 0 ? &weft_method_lsq : &weft_method_robust, NULL, m == 2));
        c->seconds[m][c->n] = least * 1e-9 * width * height;
    }
    printf("%8.2f", x);
    for (int m = 0; m < METHODS; m++)
        printf("  %9.4f s", c->seconds[m][c->n]);
    printf("\n");
    c->n++;
    work_fini(&w);
}

/* Largest distance of the points from the straight line fitted to them, relative to the last point. */
static double bend(const curve *c, int m)
{
    double sx = 0, sy = 0, sxx = 0, sxy = 0, worst = 0;
    for (int i = 0; i < c->n; i++) {
        sx += c->x[i], sy += c->seconds[m][i];
        sxx += c->x[i] * c->x[i], sxy += c->x[i] * c->seconds[m][i];
    }
    const double slope = (c->n * sxy - sx * sy) / (c->n * sxx - sx * sx), base = (sy - slope * sx) / c->n;
    for (int i = 0; i < c->n; i++)
        worst = fmax(worst, fabs(c->seconds[m][i] - base - slope * c->x[i]));
    return worst / c->seconds[m][c->n - 1];
}

static int draw(const curve *c, const char *title, const char *label, const char *folder, const char *name,
                int n_methods)
{
    char path[1024];
    weft_plot plot;
    weft_text_buffer text = {0};
    double most = 0;
    for (int m = 0; m < n_methods; m++)
        most = fmax(most, c->seconds[m][c->n - 1]);
    const weft_plot_spec spec = {.title = title,
                                 .width = 560,
                                 .height = 360,
                                 .x = {label, 0, c->x[c->n - 1] * 1.03, false},
                                 .y = {"seconds, one core", 0, most * 1.05, false},
                                 .legend_rows = 1,
                                 .standalone = true};
    weft_plot_begin(&plot, &spec, &text);
    for (int m = 0; m < n_methods; m++) {
        weft_plot_line(&plot, m, c->n, c->x, c->seconds[m], method_names[m]);
        weft_plot_dots(&plot, m, 3, c->n, c->x, c->seconds[m], NULL);
        printf("%s: %.1f %% off a straight line at most\n", method_names[m], 100 * bend(c, m));
    }
    weft_plot_end(&plot);
    snprintf(path, sizeof path, "%s/%s", folder, name);
    const weft_err status = weft_text_buffer_status(&text, NULL) == WEFT_OK
                                ? weft_file_write(path, text.text, text.n, NULL)
                                : WEFT_ERR_NOMEM;
    weft_text_buffer_fini(&text);
    if (status != WEFT_OK)
        fprintf(stderr, "%s cannot be written\n", path);
    return status == WEFT_OK ? 0 : 1;
}

int main(int argc, char **argv)
{
    static const int sides[][2] = {{880, 584},   {1232, 816},  {1744, 1152},
                                   {2464, 1632}, {3488, 2304}, {4928, 3264}};
    static const int lights[] = {4, 8, 12, 16, 24, 32, 48, 64};
    curve size = {.n = 0}, number = {.n = 0};
    int failed = 0;
    weft_parallel_set_threads(1);
    printf("Mpixel    lsq          robust, matte  all searched   (ten lights)\n");
    for (int i = 0; i < 6; i++)
        measure_point(&size, sides[i][0] * sides[i][1] * 1e-6, sides[i][0], sides[i][1], 10);
    if (argc > 1)
        failed |= draw(&size, "Ten lights", "megapixels", argv[1], "solve-cost-size.svg", METHODS);
    printf("lights    lsq          robust, matte  all searched   (1 Mpixel)\n");
    for (int i = 0; i < 8; i++)
        measure_point(&number, lights[i], 1232, 816, lights[i]);
    if (argc > 1)
        failed |= draw(&number, "1 megapixel", "lights", argv[1], "solve-cost-lights.svg", 2);
    return failed;
}
