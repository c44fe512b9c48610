/* Frame, grid, ticks and labels of a plot. */
#include "core/plot/plot_axes.h"

#include <math.h>
#include <stdio.h>

enum { TICKS_MAX = 40 };

/* Steps of 1, 2 or 5 times a power of ten, about `wanted` of them. */
static int linear_ticks(const weft_plot_axis *axis, int wanted, double *ticks)
{
    const double span = axis->max - axis->min, raw = span / wanted;
    const double power = pow(10, floor(log10(raw))), part = raw / power;
    const double step = power * (part < 1.5 ? 1 : part < 3.5 ? 2 : part < 7.5 ? 5 : 10);
    int n = 0;
    for (double k = ceil(axis->min / step - 1e-9); k * step <= axis->max + 1e-9 * span && n < TICKS_MAX; k++)
        ticks[n++] = k == 0 ? 0 : k * step;
    return n;
}

static int log_ticks(const weft_plot_axis *axis, double *ticks)
{
    const double decades = log10(axis->max / axis->min);
    static const double parts[3] = {1, 2, 5};
    int n = 0;
    const int last = (int)floor(log10(axis->max));
    for (int e = (int)floor(log10(axis->min)); e <= last; e++)
        for (int k = 0; k < (decades > 4 ? 1 : 3) && n < TICKS_MAX; k++) {
            const double at = parts[k] * pow(10, e);
            if (at >= axis->min * (1 - 1e-9) && at <= axis->max * (1 + 1e-9))
                ticks[n++] = at;
        }
    return n;
}

int weft_plot_ticks(const weft_plot_axis *axis, int wanted, double *ticks)
{
    return axis->log10 ? log_ticks(axis, ticks) : linear_ticks(axis, wanted, ticks);
}

static void grid_line(const weft_plot *p, bool vertical, double at, const char *class)
{
    if (vertical)
        weft_text_add(p->out, "<path class=\"%s\" d=\"M%.1f %.1fV%.1f\"/>\n", class, at, p->top, p->bottom);
    else
        weft_text_add(p->out, "<path class=\"%s\" d=\"M%.1f %.1fH%.1f\"/>\n", class, p->left, at, p->right);
}

static void ticks_of_x(const weft_plot *p)
{
    double ticks[TICKS_MAX];
    const int n = weft_plot_ticks(&p->spec.x, (int)fmax((p->right - p->left) / 70, 2), ticks);
    for (int i = 0; i < n; i++) {
        const double u = weft_plot_u(p, ticks[i]);
        grid_line(p, true, u, "g");
        weft_text_add(p->out, "<text class=\"n\" x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%.6g</text>\n",
                      u, p->bottom + 15, ticks[i]);
    }
}

static void ticks_of_y(const weft_plot *p)
{
    double ticks[TICKS_MAX];
    const int n = weft_plot_ticks(&p->spec.y, (int)fmax((p->bottom - p->top) / 40, 2), ticks);
    for (int i = 0; i < n; i++) {
        const double v = weft_plot_v(p, ticks[i]);
        grid_line(p, false, v, "g");
        weft_text_add(p->out, "<text class=\"n\" x=\"%.1f\" y=\"%.1f\" text-anchor=\"end\">%.6g</text>\n",
                      p->left - 6, v + 4, ticks[i]);
    }
}

static void label(const weft_plot *p, double u, double v, const char *more, const char *text)
{
    if (!text)
        return;
    weft_text_add(p->out, "<text x=\"%.1f\" y=\"%.1f\"%s>", u, v, more);
    weft_text_add_escaped(p->out, text);
    weft_text_add(p->out, "</text>\n");
}

void weft_plot_draw_axes(const weft_plot *p)
{
    char turn[96];
    const double middle = 0.5 * (p->top + p->bottom);
    if (!p->spec.no_ticks) {
        ticks_of_x(p);
        ticks_of_y(p);
    }
    weft_text_add(p->out, "<rect class=\"a\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/>\n",
                  p->left, p->top, p->right - p->left, p->bottom - p->top);
    label(p, p->left, 16, " class=\"t\"", p->spec.title);
    label(p, 0.5 * (p->left + p->right), p->spec.height - 6, " text-anchor=\"middle\"", p->spec.x.label);
    snprintf(turn, sizeof turn, " text-anchor=\"middle\" transform=\"rotate(-90 12 %.1f)\"", middle);
    label(p, 12, middle, turn, p->spec.y.label);
}
