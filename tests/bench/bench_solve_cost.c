/*
 * What a picture costs against its size and the number of lights, from the decoded planes to normals and
 * three albedo planes, as text and as SVG files: dots measured, lines the straight ones that fit them best.
 *
 *     bench_solve_cost [FOLDER]     writes solve-cost-{size,lights}.svg and search-cost-{size,lights}.svg
 * there
 */
#include "core/file.h"
#include "core/parallel.h"
#include "core/plot/plot.h"
#include "tests/bench/solve_work.h"

#include <math.h>
#include <stdio.h>

enum { ROUNDS = 5, POINTS = 8, METHODS = 3, SEARCH = 2 };

/* Up to here the search tries every triple of lights, whose number grows with the cube; then always 220. */
enum { ALL_TRIPLES = 12 };

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
        for (int round = 0; round < ROUNDS; round++) {
            const weft_solve_method *const method = m == 0 ? &weft_method_lsq : &weft_method_robust;
            const double ns = work_solve_ns(&w, method, NULL, m == SEARCH);
            work_take_less(&least, ns + work_demosaic_ns(&w));
        }
        c->seconds[m][c->n] = least * 1e-9 * width * height;
    }
    printf("%8.2f", x);
    for (int m = 0; m < METHODS; m++)
        printf("  %9.4f s", c->seconds[m][c->n]);
    printf("\n");
    c->n++;
    work_fini(&w);
}

typedef struct straight {
    double base, slope;
    double bend; /* largest distance of a point, relative to the last one */
} straight;

/* The line that fits the points from x = `from` on. */
static straight fit(const curve *c, int m, double from)
{
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    straight s = {0};
    for (int i = 0; i < c->n; i++) {
        const double w = c->x[i] >= from ? 1 : 0;
        n += w, sx += w * c->x[i], sy += w * c->seconds[m][i];
        sxx += w * c->x[i] * c->x[i], sxy += w * c->x[i] * c->seconds[m][i];
    }
    s.slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
    s.base = (sy - s.slope * sx) / n;
    for (int i = 0; i < c->n; i++)
        if (c->x[i] >= from)
            s.bend = fmax(s.bend, fabs(c->seconds[m][i] - s.base - s.slope * c->x[i]));
    s.bend /= c->seconds[m][c->n - 1];
    return s;
}

/* Methods `first` to `last` of a curve into FOLDER/NAME. */
static int draw(const curve *c, const char *title, const char *label, const char *folder, const char *name,
                int first, int last, double from)
{
    char path[1024];
    weft_plot plot;
    weft_text_buffer text = {0};
    double most = 0;
    for (int m = first; m <= last; m++)
        most = fmax(most, c->seconds[m][c->n - 1]);
    const weft_plot_spec spec = {.title = title,
                                 .width = 460,
                                 .height = 300,
                                 .x = {label, 0, c->x[c->n - 1] * 1.03, false},
                                 .y = {"seconds, one core", 0, most * 1.1, false},
                                 .legend_rows = 1,
                                 .standalone = true};
    weft_plot_begin(&plot, &spec, &text);
    for (int m = first; m <= last; m++) {
        const straight s = fit(c, m, from);
        const double x[2] = {fmax(from, 0), c->x[c->n - 1]},
                     y[2] = {s.base + s.slope * x[0], s.base + s.slope * x[1]};
        weft_plot_line(&plot, m, 2, x, y, method_names[m]);
        weft_plot_dots(&plot, m, 3, c->n, c->x, c->seconds[m], NULL);
        printf("%s over %s: %.1f %% of the last off a straight line at most\n", method_names[m], label,
               100 * s.bend);
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
        failed |= draw(&size, "Ten lights", "megapixels", argv[1], "solve-cost-size.svg", 0, SEARCH - 1, 0) |
                  draw(&size, "Ten lights", "megapixels", argv[1], "search-cost-size.svg", SEARCH, SEARCH, 0);
    printf("lights    lsq          robust, matte  all searched   (1 Mpixel)\n");
    for (int i = 0; i < 8; i++)
        measure_point(&number, lights[i], 1232, 816, lights[i]);
    if (argc > 1)
        failed |= draw(&number, "1 megapixel", "lights", argv[1], "solve-cost-lights.svg", 0, SEARCH - 1, 0) |
                  draw(&number, "1 megapixel", "lights", argv[1], "search-cost-lights.svg", SEARCH, SEARCH,
                       ALL_TRIPLES + 1);
    return failed;
}
