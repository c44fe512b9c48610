#include "calibration/gamut.h"

#include "core/colour.h"
#include "core/linalg.h"
#include "core/mem_limit.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static weft_vec3 point(const double p[3])
{
    return (weft_vec3){p[0], p[1], p[2]};
}

/* Whether all points lie behind the plane; points on it are behind. */
static bool is_face(int n, const double (*points)[3], weft_vec3 normal, double d)
{
    for (int i = 0; i < n; i++)
        if (weft_dot(normal, point(points[i])) > d + 1e-9)
            return false;
    return true;
}

/* Four corners in a plane give the same face several times. */
static bool is_known(const weft_gamut *gamut, weft_vec3 normal, double d)
{
    for (int k = 0; k < gamut->n_faces; k++) {
        const float *const f = gamut->faces[k];
        if (fabs((double)f[0] - normal.x) + fabs((double)f[1] - normal.y) + fabs((double)f[2] - normal.z) +
                fabs((double)f[3] - d) <
            1e-5)
            return true;
    }
    return false;
}

static void add_face(weft_gamut *gamut, weft_vec3 normal, double d)
{
    if (is_known(gamut, normal, d) || gamut->n_faces >= WEFT_GAMUT_MAX_FACES)
        return;
    float *const f = gamut->faces[gamut->n_faces++];
    f[0] = (float)normal.x;
    f[1] = (float)normal.y;
    f[2] = (float)normal.z;
    f[3] = (float)d;
}

/* Every triangle of points whose plane has all others on one side: some 2000 for a chart of 24. */
void weft_gamut_init(weft_gamut *gamut, int n, const double (*points)[3])
{
    assert(n <= WEFT_GAMUT_MAX_POINTS);
    weft_gamut g = {0};
    for (int a = 0; a < n; a++)
        for (int b = a + 1; b < n; b++)
            for (int c = b + 1; c < n; c++) {
                const weft_vec3 origin = point(points[a]);
                const weft_vec3 cross =
                    weft_cross(weft_sub(point(points[b]), origin), weft_sub(point(points[c]), origin));
                if (weft_length(cross) < 1e-9)
                    continue;
                const weft_vec3 normal = weft_normalise(cross);
                const double d = weft_dot(normal, origin);
                if (is_face(n, points, normal, d))
                    add_face(&g, normal, d);
                if (is_face(n, points, weft_scale(normal, -1), -d))
                    add_face(&g, weft_scale(normal, -1), -d);
            }
    if (g.n_faces < 4)
        g.n_faces = 0;
    *gamut = g;
}

double weft_gamut_distance(const weft_gamut *gamut, const double rgb[3])
{
    double most = -(double)INFINITY;
    for (int k = 0; k < gamut->n_faces; k++) {
        const float *const f = gamut->faces[k];
        most =
            fmax(most, (double)f[0] * rgb[0] + (double)f[1] * rgb[1] + (double)f[2] * rgb[2] - (double)f[3]);
    }
    return gamut->n_faces ? most : 0;
}

void weft_gamut_look(const weft_gamut *gamut, int n, const double (*points)[3], const weft_image *image,
                     const weft_mask *mask, weft_gamut_survey *survey)
{
    double dark = (double)INFINITY, bright = 0;
    for (int i = 0; i < n; i++) {
        const double y = weft_luminance(points[i][0], points[i][1], points[i][2]);
        dark = fmin(dark, y);
        bright = fmax(bright, y);
    }
    *survey = (weft_gamut_survey){0};
    const size_t pixels = weft_image_plane_size(image);
    for (size_t i = 0; i < pixels; i++) {
        if (i % 65536 == 0)
            weft_mem_trim();
        if (mask && !mask->data[i])
            continue;
        const double rgb[3] = {(double)image->data[i], (double)image->data[pixels + i],
                               (double)image->data[2 * pixels + i]};
        const double distance = weft_gamut_distance(gamut, rgb);
        survey->counted++;
        if (!(distance > WEFT_GAMUT_TOLERANCE))
            continue;
        const double y = weft_luminance(rgb[0], rgb[1], rgb[2]);
        survey->outside++;
        survey->darker += y < dark;
        survey->brighter += y > bright;
        survey->distance_mean += distance;
        survey->distance_max = fmax(survey->distance_max, distance);
    }
    if (survey->outside > 0)
        survey->distance_mean /= (double)survey->outside;
}
