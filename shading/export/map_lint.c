#include "shading/export/map_lint.h"

#include "shading/brdf/specular_doubt.h"

#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>

static void say(const weft_lint *lint, weft_lint_level level, const char *check, const char *format, ...)
    WEFT_PRINTF(4, 5);

static void say(const weft_lint *lint, weft_lint_level level, const char *check, const char *format, ...)
{
    char text[512];
    va_list list;
    va_start(list, format);
    (void)vsnprintf(text, sizeof text, format, list);
    va_end(list);
    lint->fn(lint->context, level, check, text);
}

static double at(const weft_image *image, int plane, int x, int y)
{
    return (double)weft_image_row(image, plane, y)[x];
}

/* A zero vector where nothing was measured. */
static bool is_hole(const weft_image *n, int x, int y)
{
    return fabs(at(n, 0, x, y)) + fabs(at(n, 1, x, y)) + fabs(at(n, 2, x, y)) < 0.02;
}

static void check_lengths(const weft_lint *lint, const weft_image *n)
{
    size_t off = 0, behind = 0, holes = 0;
    double sum = 0;
    const size_t count = weft_image_plane_size(n);
    for (int y = 0; y < n->height; y++)
        for (int x = 0; x < n->width; x++) {
            const double length = sqrt(at(n, 0, x, y) * at(n, 0, x, y) + at(n, 1, x, y) * at(n, 1, x, y) +
                                       at(n, 2, x, y) * at(n, 2, x, y));
            if (is_hole(n, x, y)) {
                holes++;
                continue;
            }
            sum += length;
            off += fabs(length - 1) > 0.02;
            behind += at(n, 2, x, y) < 0;
        }
    const double n_known = holes < count ? (double)(count - holes) : 1, share = 100.0 * (double)off / n_known;
    if (holes > 0)
        say(lint, WEFT_LINT_NOTE, "holes", "%.1f %% of the map has no normal (zero)",
            100.0 * (double)holes / (double)count);
    say(lint, share > 1 ? WEFT_LINT_WRONG : WEFT_LINT_GOOD, "unit normals",
        share > 1 ? "%.1f %% of the normals are not of unit length (mean %.3f): filtered, compressed or "
                    "edited as a "
                    "colour; normalise them"
                  : "%.1f %% are off by more than 2 %% (mean length %.3f)",
        share, sum / n_known);
    say(lint, behind > 0 ? WEFT_LINT_WRONG : WEFT_LINT_GOOD, "facing outwards",
        behind > 0
            ? "%zu normals point behind the surface: is it an object-space map, or are channels swapped?"
            : "all point outwards (%zu behind)",
        behind);
}

/* Mean size of the curl of the slopes with green up (sign 1) or down (-1), over gentle places: yarns end in
 * cliffs, where no slope is right, and holes have none.  Rows go down. */
static double curl(const weft_image *n, double sign)
{
    double sum = 0;
    for (int y = 1; y + 1 < n->height; y++)
        for (int x = 1; x + 1 < n->width; x++) {
            double p[2], q[2];
            const double least = fmin(fmin(at(n, 2, x, y - 1), at(n, 2, x, y + 1)),
                                      fmin(at(n, 2, x - 1, y), at(n, 2, x + 1, y)));
            if (least < 0.7) /* 45 degrees */
                continue;
            for (int k = 0; k < 2; k++) {
                const int v = k ? y + 1 : y - 1, u = k ? x + 1 : x - 1;
                p[k] = -at(n, 0, x, v) / fmax(at(n, 2, x, v), 0.1);
                q[k] = sign * at(n, 1, u, y) / fmax(at(n, 2, u, y), 0.1);
            }
            sum += fabs(p[1] - p[0] - q[1] + q[0]);
        }
    return sum / ((double)n->width * n->height);
}

static void check_green(const weft_lint *lint, const weft_image *n)
{
    const double up = curl(n, 1), down = curl(n, -1);
    if (!(up > 0) && !(down > 0))
        say(lint, WEFT_LINT_NOTE, "green",
            "the map is flat, or steep throughout: its direction cannot be told");
    else if (up < down / 1.2)
        say(lint, WEFT_LINT_GOOD, "green",
            "grows upwards (OpenGL): the curl is %.2f times smaller than the other way",
            down / fmax(up, 1e-12));
    else if (down < up / 1.2)
        say(lint, WEFT_LINT_NOTE, "green",
            "grows downwards (DirectX): the curl is %.2f times smaller so; say :green = down, or flip it",
            up / fmax(down, 1e-12));
    else
        say(lint, WEFT_LINT_NOTE, "green", "cannot be told: no surface fits either way (curl %.3g and %.3g)",
            up, down);
}

void weft_lint_normal(const weft_lint *lint, const weft_image *normal)
{
    check_lengths(lint, normal);
    check_green(lint, normal);
}

void weft_lint_albedo(const weft_lint *lint, const weft_image *albedo)
{
    const size_t count = weft_image_plane_size(albedo);
    size_t dark = 0, bright = 0, holes = 0;
    double sum = 0;
    for (size_t i = 0; i < count; i++) {
        double most = 0, mean = 0;
        for (int p = 0; p < albedo->planes; p++) {
            const double v = (double)weft_image_plane(albedo, p)[i];
            most = fmax(most, v);
            mean += v / albedo->planes;
        }
        holes += most > 0 ? 0 : 1;
        dark += most > 0 && most < 0.03;
        bright += mean > 0.9;
        sum += mean;
    }
    const double n_known = holes < count ? (double)(count - holes) : 1;
    const double low = 100.0 * (double)dark / n_known, high = 100.0 * (double)bright / n_known;
    if (holes > 0)
        say(lint, WEFT_LINT_NOTE, "holes", "%.1f %% of the map is 0", 100.0 * (double)holes / (double)count);
    say(lint, low > 5 ? WEFT_LINT_WRONG : WEFT_LINT_GOOD, "dark albedo",
        low > 5 ? "%.1f %% of the texels reflect less than the black patch of a chart (3 %%): shadow in the "
                  "picture, or "
                  "sRGB decoded twice"
                : "%.1f %% below 3 %%",
        low);
    say(lint, high > 5 ? WEFT_LINT_WRONG : WEFT_LINT_GOOD, "bright albedo",
        high > 5 ? "%.1f %% of the texels reflect more than the white patch (90 %%): light in the picture, "
                   "or linear taken "
                   "for sRGB"
                 : "%.1f %% above 90 %%",
        high);
    say(lint, WEFT_LINT_GOOD, "mean albedo", "%.3f", sum / n_known);
}

static void colour_at(const weft_image *image, size_t i, double rgb[3])
{
    for (int c = 0; c < 3; c++)
        rgb[c] = (double)weft_image_plane(image, image->planes == 3 ? c : 0)[i];
}

/* Share, in percent, of the texels for which one of the bits of `doubts` holds.  Without albedo it is black.
 */
static double doubtful(const weft_image *albedo, const weft_image *f0, unsigned doubts)
{
    const size_t count = weft_image_plane_size(f0);
    size_t n = 0;
    for (size_t i = 0; i < count; i++) {
        double diffuse[3] = {0}, specular[3];
        if (albedo)
            colour_at(albedo, i, diffuse);
        colour_at(f0, i, specular);
        n += (weft_specular_doubts(diffuse, specular) & doubts) != 0;
    }
    return 100.0 * (double)n / (double)count;
}

void weft_lint_specular(const weft_lint *lint, const weft_image *f0)
{
    const double coloured = doubtful(NULL, f0, WEFT_DOUBT_COLOURED);
    const double outside = doubtful(NULL, f0, WEFT_DOUBT_LOW | WEFT_DOUBT_HIGH);
    say(lint, coloured > 1 ? WEFT_LINT_NOTE : WEFT_LINT_GOOD, "grey specular",
        coloured > 1 ? "%.1f %% of the texels have a coloured F0 that is no metal's (0.2): make them grey"
                     : "%.1f %% are coloured and no metal",
        coloured);
    say(lint, outside > 1 ? WEFT_LINT_NOTE : WEFT_LINT_GOOD, "range of F0",
        outside > 1
            ? "%.1f %% of the texels are neither a dielectric (0.017 to 0.067) nor a metal (above 0.2): "
              "is the map gloss, or linear taken for sRGB?"
            : "%.1f %% are neither dielectric nor metal",
        outside);
}

void weft_lint_specular_pair(const weft_lint *lint, const weft_image *albedo, const weft_image *f0)
{
    const double both = doubtful(albedo, f0, WEFT_DOUBT_DIFFUSE);
    say(lint, both > 1 ? WEFT_LINT_NOTE : WEFT_LINT_GOOD, "specular, albedo",
        both > 1
            ? "%.1f %% of the texels have an albedo above 0.2 beside the F0 of a metal (above 0.2), which "
              "has no diffuse light: darken one of them there"
            : "%.1f %% are above 0.2 in both",
        both);
}

static double step(const weft_image *image, int xa, int ya, int xb, int yb)
{
    double sum = 0;
    for (int p = 0; p < image->planes; p++)
        sum += fabs(at(image, p, xa, ya) - at(image, p, xb, yb));
    return sum;
}

/* Mean step over an edge, and the largest mean step between two lines inside. */
static void measure_edge(const weft_image *image, bool across, double *over, double *inside)
{
    const int count = across ? image->width : image->height, length = across ? image->height : image->width;
    *over = *inside = 0;
    for (int t = 0; t < count; t++) {
        double mean = 0;
        const int next = t + 1 < count ? t + 1 : 0;
        for (int s = 0; s < length; s++)
            mean += (across ? step(image, t, s, next, s) : step(image, s, t, s, next)) / length;
        if (next)
            *inside = fmax(*inside, mean);
        else
            *over = mean;
    }
}

static bool is_power_of_two(int n)
{
    return n > 0 && (n & (n - 1)) == 0;
}

void weft_lint_size(const weft_lint *lint, int width, int height)
{
    const bool even = is_power_of_two(width) && is_power_of_two(height);
    say(lint, even ? WEFT_LINT_GOOD : WEFT_LINT_NOTE, "size",
        even ? "%d x %d" : "%d x %d: no powers of two, which some engines resample", width, height);
}

void weft_lint_picture(const weft_lint *lint, const weft_image *image)
{
    size_t bad = 0;
    for (size_t i = 0; i < weft_image_plane_size(image) * (size_t)image->planes; i++)
        bad += isfinite(image->data[i]) ? 0 : 1;
    say(lint, bad ? WEFT_LINT_WRONG : WEFT_LINT_GOOD, "numbers",
        bad ? "%zu values are not numbers" : "all finite (%zu not)", bad);
    if (bad || image->width < 2 || image->height < 2)
        return;
    for (int axis = 0; axis < 2; axis++) {
        double over, inside;
        measure_edge(image, axis == 0, &over, &inside);
        const bool open = over > 1.1 * inside;
        say(lint, open ? WEFT_LINT_NOTE : WEFT_LINT_GOOD, axis ? "repeats down" : "repeats across",
            open ? "no: the step over the edge is %.3g, the largest inside %.3g; weft weave cuts a tile"
                 : "yes: the step over the edge is %.3g, the largest inside %.3g",
            over, inside);
    }
}

static double mean_of(const weft_image *image)
{
    const size_t n = weft_image_plane_size(image) * (size_t)image->planes;
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += (double)image->data[i];
    return sum / (double)n;
}

void weft_lint_mips(const weft_lint *lint, const weft_map *map)
{
    const weft_image *const last = &map->levels[map->n_levels - 1];
    const double mean = mean_of(&map->levels[0]);
    double worst = 0;
    int at = 0;
    if (map->n_levels == 1)
        return;
    if (last->width > 1 || last->height > 1) {
        say(lint, WEFT_LINT_WRONG, "mip chain", "%d levels end at %d x %d: a chain goes down to 1 x 1",
            map->n_levels, last->width, last->height);
        return;
    }
    if (map->kind != WEFT_MAP_ALBEDO && map->kind != WEFT_MAP_ROUGHNESS) {
        say(lint, WEFT_LINT_GOOD, "mip chain", "%d levels, down to 1 x 1", map->n_levels);
        return;
    }
    for (int level = 1; level < map->n_levels && mean > 0; level++) {
        const double change = mean_of(&map->levels[level]) / mean - 1;
        const bool counts = map->kind == WEFT_MAP_ALBEDO || change < 0;
        if (counts && fabs(change) > fabs(worst)) {
            worst = change;
            at = level;
        }
    }
    const bool good = fabs(worst) <= 0.02;
    say(lint, good ? WEFT_LINT_GOOD : WEFT_LINT_WRONG, "mip chain",
        good ? "%d levels, their means off by at most %.1f %%"
             : "of %d levels one has a mean that is off by %.1f %% (level %d): were codes averaged in place "
               "of light?",
        map->n_levels, 100 * worst, at);
}

void weft_lint_scalar(const weft_lint *lint, const weft_map *map)
{
    const weft_image *const image = &map->levels[0];
    float low = INFINITY, high = -INFINITY;
    for (int level = 0; level < map->n_levels; level++)
        for (size_t i = 0; i < weft_image_plane_size(&map->levels[level]); i++) {
            low = fminf(low, map->levels[level].data[i]);
            high = fmaxf(high, map->levels[level].data[i]);
        }
    const bool constant = !(high > low);
    say(lint, constant ? WEFT_LINT_NOTE : WEFT_LINT_GOOD, "range",
        constant ? "constant (%.3g to %.3g): a number would do" : "%.3g to %.3g", (double)low, (double)high);
    if (image->planes == 3) {
        bool same = true;
        for (size_t i = 0; i < weft_image_plane_size(image) && same; i++)
            same = fabsf(image->data[i] - weft_image_plane(image, 1)[i]) < 1e-6F;
        say(lint, same ? WEFT_LINT_GOOD : WEFT_LINT_NOTE, "channels",
            same ? "the same in all" : "they differ: several maps are packed into one; name the channel");
    }
}
