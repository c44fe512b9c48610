#include "calibration/colour_model.h"

#include "core/colour.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

static const char *const names[WEFT_COLOUR_METHODS] = {"matrix", "root-polynomial", "sequence"};

const char *weft_colour_method_name(weft_colour_method method)
{
    return names[method];
}

bool weft_colour_method_from_name(const char *name, weft_colour_method *method)
{
    for (int i = 0; i < WEFT_COLOUR_METHODS; i++)
        if (strcmp(name, names[i]) == 0) {
            *method = (weft_colour_method)i;
            return true;
        }
    return false;
}

void weft_colour_root_terms(const double rgb[3], double terms[WEFT_COLOUR_ROOT_TERMS])
{
    for (int c = 0; c < 3; c++) {
        terms[c] = rgb[c];
        terms[3 + c] = sqrt(fmax(rgb[c], 0) * fmax(rgb[(c + 1) % 3], 0));
    }
}

static void affine(const double m[3][4], const double in[3], double out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = m[c][0] * in[0] + m[c][1] * in[1] + m[c][2] * in[2] + m[c][3];
}

/* Beyond its range a cubic may turn back; its tangent does not. */
static double cubic(const double a[4], const double range[2], double x)
{
    const double at = fmin(fmax(x, range[0]), range[1]);
    const double slope = a[1] + at * (2 * a[2] + at * 3 * a[3]);
    return a[0] + at * (a[1] + at * (a[2] + at * a[3])) + (x - at) * slope;
}

void weft_colour_sequence_apply(const weft_colour_sequence *sequence, const double in[3], double out[3])
{
    double a[3], b[3];
    affine(sequence->first, in, a);
    for (int c = 0; c < 3; c++)
        b[c] = sequence->has_cubic ? cubic(sequence->cubic[c], sequence->range[c], a[c]) : a[c];
    affine(sequence->second, b, out);
}

static void apply_sequence(const weft_colour_sequence *sequence, const double camera[3], double rgb[3])
{
    const double positive[3] = {fmax(camera[0], 0), fmax(camera[1], 0), fmax(camera[2], 0)};
    double xyz[3], in[3], out[3];
    weft_srgb_to_xyz(positive, xyz); /* noise below black has no chromaticity */
    weft_xyz_to_xyy(xyz, in);
    weft_colour_sequence_apply(sequence, in, out);
    out[0] = fmin(fmax(out[0], 0), 0.8); /* what lies beyond is no colour, and would explode in 1/y */
    out[1] = fmin(fmax(out[1], 0.03), 0.8);
    out[2] = fmax(out[2], 0);
    weft_xyy_to_xyz(out, xyz);
    weft_xyz_to_srgb(xyz, rgb);
}

void weft_colour_model_apply(const weft_colour_model *model, const double camera[3], double linear_srgb[3])
{
    double out[3];
    if (model->method == WEFT_COLOUR_SEQUENCE) {
        apply_sequence(&model->sequence, camera, out);
    } else if (model->method == WEFT_COLOUR_ROOT_POLYNOMIAL) {
        double terms[WEFT_COLOUR_ROOT_TERMS];
        weft_colour_root_terms(camera, terms);
        for (int c = 0; c < 3; c++) {
            out[c] = 0;
            for (int k = 0; k < WEFT_COLOUR_ROOT_TERMS; k++)
                out[c] += model->root[c][k] * terms[k];
        }
    } else {
        const weft_vec3 v = weft_mat3_apply(&model->matrix, (weft_vec3){camera[0], camera[1], camera[2]});
        out[0] = v.x;
        out[1] = v.y;
        out[2] = v.z;
    }
    memcpy(linear_srgb, out, sizeof out);
}

static void matrix_row(const weft_mat3 *matrix, float *const rgb[3], int n)
{
    float m[9];
    for (size_t i = 0; i < 9; i++)
        m[i] = (float)matrix->m[i];
    for (int i = 0; i < n; i++) {
        const float r = rgb[0][i], g = rgb[1][i], b = rgb[2][i];
        for (size_t c = 0; c < 3; c++)
            rgb[c][i] = m[3 * c] * r + m[3 * c + 1] * g + m[3 * c + 2] * b;
    }
}

static void root_row(const double root[3][WEFT_COLOUR_ROOT_TERMS], float *const rgb[3], int n)
{
    float m[3][WEFT_COLOUR_ROOT_TERMS];
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < WEFT_COLOUR_ROOT_TERMS; k++)
            m[c][k] = (float)root[c][k];
    for (int i = 0; i < n; i++) {
        const float r = rgb[0][i], g = rgb[1][i], b = rgb[2][i];
        const float r0 = r > 0 ? r : 0, g0 = g > 0 ? g : 0, b0 = b > 0 ? b : 0;
        const float rg = sqrtf(r0 * g0), gb = sqrtf(g0 * b0), br = sqrtf(b0 * r0);
        for (int c = 0; c < 3; c++)
            rgb[c][i] = m[c][0] * r + m[c][1] * g + m[c][2] * b + m[c][3] * rg + m[c][4] * gb + m[c][5] * br;
    }
}

void weft_colour_model_apply_row(const weft_colour_model *model, float *const rgb[3], int n)
{
    if (model->method == WEFT_COLOUR_MATRIX) {
        matrix_row(&model->matrix, rgb, n);
        return;
    }
    if (model->method == WEFT_COLOUR_ROOT_POLYNOMIAL) {
        root_row(model->root, rgb, n);
        return;
    }
    for (int i = 0; i < n; i++) {
        double pixel[3] = {(double)rgb[0][i], (double)rgb[1][i], (double)rgb[2][i]};
        weft_colour_model_apply(model, pixel, pixel);
        for (int c = 0; c < 3; c++)
            rgb[c][i] = (float)pixel[c];
    }
}
