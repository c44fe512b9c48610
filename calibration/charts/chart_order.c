#include "calibration/charts/chart_order.h"

#include "calibration/charts/homography.h"

#include <math.h>

/* Cells averaged in the middle of a patch, each way. */
enum { SPOTS_MIN = 4, SPOTS_MAX = 24 };
static const double middle = 0.6; /* of the patch's side */

/* Price of a gradient in log units per half chart, as a share of all patches: 2:1 over the chart costs 0.03.
 */
static const double gradient_price = 0.25;
static const double floor_reflectance = 0.012; /* dark noise and negative reference values end here */

/* Enough spots to meet every cell once. */
static int count_spots(const weft_chart *chart, const weft_mat3 *to_cell, double x, double y)
{
    double u0, v0, u1, v1;
    const double half = 0.5 * middle * chart->patch_mm;
    if (!weft_homography_apply(to_cell, x - half, y - half, &u0, &v0) ||
        !weft_homography_apply(to_cell, x + half, y + half, &u1, &v1))
        return SPOTS_MIN;
    const double spots = hypot(u1 - u0, v1 - v0) * 0.7071;
    return spots < SPOTS_MIN ? SPOTS_MIN : spots > SPOTS_MAX ? SPOTS_MAX : (int)spots;
}

static bool read_patch(const weft_chart *chart, const weft_image *cells, const weft_mat3 *to_cell, int patch,
                       double rgb[3])
{
    double x, y, u, v, sum[3] = {0};
    weft_chart_patch_centre(chart, patch, &x, &y);
    const int n = count_spots(chart, to_cell, x, y);
    const double step = middle * chart->patch_mm / n;
    for (int k = 0; k < n * n; k++) {
        const int i = k % n, j = k / n;
        const double dx = (i - 0.5 * (n - 1)) * step, dy = (j - 0.5 * (n - 1)) * step;
        if (!weft_homography_apply(to_cell, x + dx, y + dy, &u, &v) ||
            !(u >= 0 && v >= 0 && u <= cells->width - 1 && v <= cells->height - 1))
            return false;
        for (int c = 0; c < 3; c++)
            sum[c] += (double)weft_image_sample(cells, c, u, v);
    }
    for (int c = 0; c < 3; c++)
        rgb[c] = sum[c] / (n * n);
    return true;
}

bool weft_chart_colours_read(const weft_chart *chart, const weft_image *cells, const weft_mat3 *to_cell,
                             weft_chart_colours *colours)
{
    for (int p = 0; p < chart->columns * chart->rows; p++)
        if (!read_patch(chart, cells, to_cell, p, colours->rgb[p]))
            return false;
    return true;
}

/*
 * Measured and predicted logarithms.  The prediction: each channel of the camera sees a mixture of the three
 * reference colours (for a chart of greys: a multiple of one), times a gradient of the light.
 */
typedef struct comparison {
    int n;
    double measured[WEFT_CHART_MAX_PATCHES][3], predicted[WEFT_CHART_MAX_PATCHES][3]; /* logarithms */
    double x[WEFT_CHART_MAX_PATCHES], y[WEFT_CHART_MAX_PATCHES];                      /* -1..1 */
    double gx, gy; /* log units per half chart */
} comparison;

static bool is_grey(const weft_chart *chart)
{
    for (int p = 0; p < chart->columns * chart->rows; p++)
        if (!(chart->patches[p].munsell_value > 0))
            return false;
    return true;
}

/* Relative least squares of one channel, the gradient taken out before: fills its predictions. */
static void fit_channel(const weft_chart *chart, bool grey, comparison *k, int channel)
{
    weft_mat3 normal = {{0}}, inverse;
    double right[3] = {0};
    for (int p = 0; p < k->n; p++) {
        const double *const r = chart->patches[p].linear_srgb;
        const double weight = exp(k->gx * k->x[p] + k->gy * k->y[p] - k->measured[p][channel]);
        for (int i = 0; i < 3; i++) {
            right[i] += r[i] * weight;
            for (int j = 0; j < 3; j++)
                normal.m[3 * i + j] += r[i] * r[j] * weight * weight;
        }
    }
    const double ridge = 1e-9 * (normal.m[0] + normal.m[4] + normal.m[8]);
    weft_vec3 mix = {right[1] / normal.m[4], 0, 0};
    for (int i = 0; i < 9; i += 4)
        normal.m[i] += ridge;
    if (!grey && weft_mat3_invert(&normal, &inverse))
        mix = weft_mat3_apply(&inverse, (weft_vec3){right[0], right[1], right[2]});
    for (int p = 0; p < k->n; p++) {
        const double *const r = chart->patches[p].linear_srgb;
        const double value = grey ? mix.x * r[1] : mix.x * r[0] + mix.y * r[1] + mix.z * r[2];
        const double least = floor_reflectance * exp(k->measured[p][channel]);
        k->predicted[p][channel] = log(fmax(value, least));
    }
}

static void fit_gradient(comparison *k, double price_per_patch)
{
    double xx = 0, yy = 0, dx = 0, dy = 0;
    for (int p = 0; p < k->n; p++)
        for (int c = 0; c < 3; c++) {
            const double d = k->measured[p][c] - k->predicted[p][c];
            xx += k->x[p] * k->x[p];
            yy += k->y[p] * k->y[p];
            dx += k->x[p] * d;
            dy += k->y[p] * d;
        }
    const double price = price_per_patch * 3 * k->n; /* x and y of a full grid are orthogonal */
    k->gx = dx / (xx + price);
    k->gy = dy / (yy + price);
}

static void compare(const weft_chart *chart, const weft_chart_colours *colours, double price, comparison *k)
{
    const bool grey = is_grey(chart);
    const double half_x = 0.5 * (chart->columns - 1) * chart->pitch_mm;
    const double half_y = 0.5 * (chart->rows - 1) * chart->pitch_mm;
    *k = (comparison){.n = chart->columns * chart->rows};
    for (int c = 0; c < 3; c++) {
        double bright = 0;
        for (int p = 0; p < k->n; p++)
            bright = fmax(bright, colours->rgb[p][c]);
        const double floor_value = bright > 0 ? floor_reflectance * bright : 1;
        for (int p = 0; p < k->n; p++)
            k->measured[p][c] = log(fmax(colours->rgb[p][c], floor_value));
    }
    for (int p = 0; p < k->n; p++) {
        double x, y;
        weft_chart_patch_centre(chart, p, &x, &y);
        k->x[p] = x / half_x;
        k->y[p] = y / half_y;
    }
    for (int round = 0; round < 6; round++) {
        for (int c = 0; c < 3; c++)
            fit_channel(chart, grey, k, c);
        fit_gradient(k, price);
    }
}

double weft_chart_score(const weft_chart *chart, const weft_chart_colours *colours)
{
    comparison k;
    compare(chart, colours, gradient_price, &k);
    double left = gradient_price * 3 * k.n * (k.gx * k.gx + k.gy * k.gy), total = 0;
    for (int c = 0; c < 3; c++) {
        double mean = 0;
        for (int p = 0; p < k.n; p++)
            mean += k.measured[p][c] / k.n;
        for (int p = 0; p < k.n; p++) {
            const double d = k.measured[p][c] - k.predicted[p][c] - k.gx * k.x[p] - k.gy * k.y[p];
            left += d * d;
            total += pow(k.measured[p][c] - mean, 2);
        }
    }
    return total > 0 ? 1 - left / total : -(double)INFINITY;
}

bool weft_chart_greys_in_order(const weft_chart *chart, const weft_chart_colours *colours, int *first,
                               int *second)
{
    comparison k;
    compare(chart, colours, 0, &k);
    for (int a = 0; a < k.n; a++)
        for (int b = 0; b < k.n; b++) {
            const double va = chart->patches[a].munsell_value, vb = chart->patches[b].munsell_value;
            if (!(va > vb && vb > 0))
                continue;
            const double la = k.measured[a][1] - k.gx * k.x[a] - k.gy * k.y[a];
            const double lb = k.measured[b][1] - k.gx * k.x[b] - k.gy * k.y[b];
            if (la <= lb) {
                *first = a;
                *second = b;
                return false;
            }
        }
    return true;
}
