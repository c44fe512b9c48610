/**
 * Figures of the sources drawn again for the same situations: "weft-figures DIR", a part of ./dev gallery.
 *
 * Everything is shaded by the functions of shading/ at the pixel, without the preview: the figures show terms
 * of the models (a masking rule, a filter, an approximation of light), which the preview does not offer.
 * View is along -z unless said otherwise; +X is right, +Y up.
 */
#ifndef WEFT_SHADING_FIGURES_FIGURES_H
#define WEFT_SHADING_FIGURES_FIGURES_H

#include "core/error.h"
#include "core/image.h"
#include "shading/preview/tone.h"

/** Radiance at a place of the unit sphere, whose normal is `n` (n.z > 0). */
typedef void weft_figure_fn(const void *context, const double n[3], double radiance[3]);

/** A picture of the unit sphere on a dark ground, 3 x 3 places a pixel, all cores; linear. */
weft_err weft_figure_sphere(weft_image *picture, int side_px, weft_figure_fn *fn, const void *context,
                            weft_error *err);

/** A grid of pictures with words below each, row by row: takes all of them through the tone curve to a PNG.
 */
weft_err weft_figure_save(const char *folder, const char *name, int columns, int rows,
                          weft_image *const pictures[], const char *const words[], weft_tone tone,
                          weft_error *err);

/** The figures; each writes its files into the folder and replaces what is there. */
weft_err weft_figure_order_1(const char *folder, weft_error *err);
weft_err weft_figure_order_2(const char *folder, weft_error *err);
weft_err weft_figure_order_17(const char *folder, weft_error *err);
weft_err weft_figure_order_18(const char *folder, weft_error *err);
weft_err weft_figure_cod_spheres(const char *folder, weft_error *err);
weft_err weft_figure_unreal_4(const char *folder, weft_error *err);
weft_err weft_figure_unreal_10(const char *folder, weft_error *err);
weft_err weft_figure_unreal_11(const char *folder, weft_error *err);

static inline double weft_figure_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/** Makes a vector as long as 1; its old length. */
double weft_figure_unit(double v[3]);

/** An orthonormal frame with `n` as its third axis. */
void weft_figure_frame(const double n[3], double t[3], double b[3]);

#endif
