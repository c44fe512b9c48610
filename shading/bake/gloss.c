#include "shading/bake/gloss.h"

static double clamp01(double x)
{
    return x > 0 ? (x < 1 ? x : 1) : 0;
}

double weft_gloss_of_alpha(double alpha)
{
    return alpha > 0 ? clamp01(log2(2 / (alpha * alpha) - 1) / 18) : 1;
}

double weft_ggx_missing_length(double alpha)
{
    const double a2 = alpha * alpha, q = (1 - alpha) * (1 + alpha);
    if (alpha <= 0)
        return 0;
    if (fabs(q) < 0.2) { /* the difference below would cancel */
        double sum = 0, power = 1;
        for (int k = 0; k < 24; k++, power *= q)
            sum += power / (2 * k + 3);
        return a2 * sum;
    }
    const double root = sqrt(fabs(q));
    const double turn = q > 0 ? log((1 + root) / alpha) : atan(root); /* atanh without 1 - root */
    return a2 * (turn / root - 1) / q;
}

double weft_gloss_missing_length(double gloss)
{
    return weft_ggx_missing_length(weft_gloss_alpha(gloss));
}

double weft_gloss_of_missing_length(double missing)
{
    double low = 0, high = 1;
    if (missing >= weft_gloss_missing_length(0))
        return 0;
    if (missing <= weft_gloss_missing_length(1))
        return 1;
    for (int i = 0; i < 60 && low < high; i++) { /* smoother is shorter of missing length */
        const double middle = 0.5 * (low + high);
        if (weft_gloss_missing_length(middle) > missing)
            low = middle;
        else
            high = middle;
    }
    return 0.5 * (low + high);
}

double weft_gloss_length_fit(double x)
{
    return (0.66667 + x * (0.0942205 + x * (7.41935 + x * 0.567111))) / (1 + x * (-1.0881 + x * 8.83582));
}

double weft_gloss_combine(double x, double y)
{
    const double a = weft_gloss_missing_length(x), b = weft_gloss_missing_length(y);
    return weft_gloss_of_missing_length(a + b - a * b); /* 1 - (1 - a)(1 - b) */
}

double weft_gloss_combine_fit(double x, double y)
{
    const double sum = x + y, squares = x * x + y * y, product = x * y;
    const double above = -0.535580 + 1.002204 * sum - 0.223910 * squares + 13.323150 * product;
    const double below = 1 + 8.259559 * sum + 9.896132 * squares - 22.015902 * product;
    return clamp01(above / below);
}

weft_gloss_texel weft_gloss_filter(int n, const weft_gloss_texel texels[], const double weights[])
{
    weft_gloss_texel result = {{0, 0, 1}, 0, 0};
    double s[3] = {0};
    for (int i = 0; i < n; i++) {
        const double length = 1 - weft_gloss_missing_length(texels[i].gloss);
        for (int c = 0; c < 3; c++)
            s[c] += (weights ? weights[i] : 1.0 / n) * length * texels[i].normal[c];
    }
    const double length = sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
    if (length > 0) {
        result.length = fmin(length, 1 - weft_gloss_missing_length(1));
        result.gloss = weft_gloss_of_missing_length(1 - result.length);
        for (int c = 0; c < 3; c++)
            result.normal[c] = s[c] / length;
    }
    return result;
}
