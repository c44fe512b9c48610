#include "host/capture/light_print.h"

#include <math.h>

/* Less light than this, as share of the range, or fewer cells, tell no shape: offsets and noise would. */
#define LEAST_LIGHT   0.003
#define LEAST_CELLS   (WEFT_PRINT_CELLS / 4)
#define CLIPPED_SHARE 0.001

static void look_at_cell(const weft_mosaic *m, int column, int row, weft_light_print *print)
{
    const int u0 = column * m->width / WEFT_PRINT_COLUMNS, u1 = (column + 1) * m->width / WEFT_PRINT_COLUMNS;
    const int v0 = row * m->height / WEFT_PRINT_ROWS, v1 = (row + 1) * m->height / WEFT_PRINT_ROWS;
    const int cell = row * WEFT_PRINT_COLUMNS + column;
    const uint16_t white = (uint16_t)m->white;
    uint64_t sums[4] = {0};
    long n = 0, n_clipped = 0;
    double sum = 0;
    for (int v = v0; v < v1; v++) {
        const uint16_t *const dn = m->data + (size_t)v * (size_t)m->width;
        for (int u = u0; u < u1; u++) {
            sums[(v & 1) * 2 + (u & 1)] += dn[u];
            n_clipped += dn[u] >= white;
        }
        n += u1 - u0;
    }
    for (int i = 0; i < 4; i++) /* as many photosites of each, but for a row or column */
        sum += (double)sums[i] - (double)n / 4 * (double)m->black[i];
    print->cell[cell] = n > 0 ? (float)(sum / (double)n / ((double)m->white - (double)m->black[0])) : 0;
    print->clipped[cell] = (double)n_clipped > CLIPPED_SHARE * (double)n;
}

weft_light_print weft_light_print_make(const weft_mosaic *mosaic, double time)
{
    weft_light_print print = {.time = time};
    for (int row = 0; row < WEFT_PRINT_ROWS; row++)
        for (int column = 0; column < WEFT_PRINT_COLUMNS; column++)
            look_at_cell(mosaic, column, row, &print);
    return print;
}

static double light_of(const weft_light_print *p, const weft_light_print *dark, int cell)
{
    const double room = dark->time > 0 ? (double)dark->cell[cell] * p->time / dark->time : 0;
    return (double)p->cell[cell] - room;
}

double weft_light_print_difference(const weft_light_print *a, const weft_light_print *b,
                                   const weft_light_print *dark)
{
    double sum_a = 0, sum_b = 0, squares = 0;
    int n = 0;
    for (int i = 0; i < WEFT_PRINT_CELLS; i++)
        if (!a->clipped[i] && !b->clipped[i]) {
            sum_a += light_of(a, dark, i);
            sum_b += light_of(b, dark, i);
            n++;
        }
    if (!(a->time > 0) || !(b->time > 0) || n < LEAST_CELLS || sum_a < n * LEAST_LIGHT ||
        sum_b < n * LEAST_LIGHT)
        return -1;
    for (int i = 0; i < WEFT_PRINT_CELLS; i++)
        if (!a->clipped[i] && !b->clipped[i]) {
            const double d = n * light_of(a, dark, i) / sum_a - n * light_of(b, dark, i) / sum_b;
            squares += d * d;
        }
    return sqrt(squares / n);
}
