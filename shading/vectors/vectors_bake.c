/* Tables of filtering: gloss and lengths, von Mises-Fisher, Toksvig, detail normals, height, occlusion. */
#include "shading/bake/gloss.h"
#include "shading/bake/height.h"
#include "shading/bake/horizon.h"
#include "shading/bake/normal_filter.h"
#include "shading/bake/vmf.h"
#include "shading/vectors/vectors_tables.h"

static void gloss(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        out[0][i] = weft_gloss_alpha(in[0][i]);
        out[1][i] = weft_gloss_alpha_advanced(in[0][i]);
        out[2][i] = weft_gloss_of_alpha(out[0][i]);
    }
}

static void mean_length(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        out[1][i] = weft_ggx_missing_length(in[0][i]);
        out[0][i] = 1 - out[1][i];
    }
}

static void gloss_length(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        out[1][i] = weft_gloss_missing_length(in[0][i]);
        out[0][i] = 1 - out[1][i];
        out[2][i] = weft_gloss_length_fit(in[0][i]);
    }
}

static void length_gloss(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++)
        out[0][i] = weft_gloss_of_missing_length(1 - in[0][i]);
}

static void gloss_combine(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        out[0][i] = weft_gloss_combine(in[0][i], in[1][i]);
        out[1][i] = weft_gloss_combine_fit(in[0][i], in[1][i]);
    }
}

static void mip(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        weft_gloss_texel texels[4] = {0};
        for (size_t k = 0; k < 4; k++) {
            const double x = in[3 * k][i], y = in[3 * k + 1][i];
            texels[k] = (weft_gloss_texel){{x, y, sqrt(1 - x * x - y * y)}, in[3 * k + 2][i], 0};
        }
        const weft_gloss_texel result = weft_gloss_filter(4, texels, NULL);
        for (int c = 0; c < 3; c++)
            out[c][i] = result.normal[c];
        out[3][i] = result.gloss;
        out[4][i] = result.length;
    }
}

static void density(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++)
        out[0][i] = weft_vmf_density(in[0][i], in[1][i]);
}

static void kappa(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        out[0][i] = weft_vmf_kappa(in[0][i]);
        out[1][i] = weft_vmf_kappa_exact(in[0][i]);
    }
}

static void roughness(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double k = weft_vmf_kappa_listing(in[0][i]);
        out[0][i] = k;
        out[1][i] = weft_vmf_roughness(in[1][i], k, WEFT_VMF_LISTING);
        out[2][i] = weft_vmf_roughness(in[1][i], k, WEFT_VMF_EQ_37);
        out[3][i] = weft_vmf_roughness(in[1][i], k, WEFT_VMF_CONSISTENT);
    }
}

static void coefficient(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        out[0][i] = weft_vmf_coefficient(in[0][i], (int)in[1][i]);
        out[1][i] = weft_vmf_coefficient_gauss(in[0][i], (int)in[1][i]);
    }
}

static void toksvig(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        out[0][i] = weft_toksvig_factor(in[0][i], in[1][i]);
        out[1][i] = out[0][i] * in[1][i];
        out[2][i] = weft_blinn_phong_gloss(out[1][i]);
    }
}

static void reorient(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double b[3] = {in[0][i], in[1][i], in[2][i]}, d[3] = {in[3][i], in[4][i], in[5][i]};
        double result[3];
        weft_normal_reorient(b, d, result);
        for (int c = 0; c < 3; c++)
            out[c][i] = result[c];
    }
}

/* One map a table: the rows are its texels, row by row, and as wide as the longest run of x. */
static void relax(int n, const double *const *in, double *const *out)
{
    int width = 1;
    for (int i = 0; i < n; i++) {
        width = (int)fmax(width, in[0][i] + 1);
        out[0][i] = (double)NAN;
    }
    if (n % width == 0)
        (void)weft_height_from_slopes(width, n / width, in[2], in[3], 1e-14, out[0], NULL);
}

static void arc(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const weft_horizon_arc clamped = weft_horizon_clamp((weft_horizon_arc){in[0][i], in[1][i]}, in[2][i]);
        out[0][i] = clamped.h1_rad;
        out[1][i] = clamped.h2_rad;
        out[2][i] = weft_horizon_visibility(clamped, in[2][i]);
    }
}

/* Infinite wall along y at x = distance, trench between two of them, pit around: horizons as seen from the
 * middle of the floor. */
typedef struct shape {
    int kind; /* 0 wall, 1 trench, 2 pit */
    double slope;
} shape;

static weft_horizon_arc shape_horizons(void *context, double phi_rad)
{
    const shape *const s = context;
    const double open = 2 * atan(1), toward = s->kind == 2 ? 1 : cos(phi_rad);
    const double there = open - atan(s->slope * fmax(toward, 0));
    const double back = open - atan(s->slope * fmax(s->kind == 2 ? 1 : -toward, 0));
    const double behind = open - atan(s->slope * fabs(toward));
    return s->kind == 0 ? (weft_horizon_arc){-back, there} : (weft_horizon_arc){-behind, behind};
}

static void shapes(int n, const double *const *in, double *const *out)
{
    static const double up[3] = {0, 0, 1};
    for (int i = 0; i < n; i++) {
        shape s = {(int)in[0][i], in[1][i] / in[2][i]};
        out[0][i] = weft_horizon_occlusion(shape_horizons, &s, up, 256);
    }
}

const weft_vectors_model weft_vectors_bake[] = {
    {"ao_shapes", "S-COD-12", "shape height width", "ao", 1e-3, shapes},
    {"cod_gloss", "S-COD-01", "gloss", "alpha_wwii alpha_aw gloss_back", 1e-12, gloss},
    {"cod_gloss_combine", "S-COD-08 S-COD-09", "gx gy", "exact fit", 1e-8, gloss_combine},
    {"cod_gloss_length", "S-COD-04 S-COD-06", "gloss", "length one_minus fit", 1e-8, gloss_length},
    {"cod_length_gloss", "S-COD-04", "length", "gloss", 1e-8, length_gloss},
    {"cod_mip", "S-COD-05", "nx0 ny0 g0 nx1 ny1 g1 nx2 ny2 g2 nx3 ny3 g3", "nx ny nz g length", 1e-8, mip},
    {"cod_relax", "S-COD-10", "x y dx dy", "h", 1e-9, relax},
    {"ggx_mean_length", "S-COD-03", "alpha", "length one_minus", 1e-7, mean_length},
    {"gtao_arc", "S-COD-12", "h1 h2 gamma", "h1c h2c arc", 1e-12, arc},
    {"rnm", "S-COD-07", "bx by bz dx dy dz", "x y z", 1e-12, reorient},
    {"toksvig", "S-FC3-14", "length m", "ft m gloss", 1e-11, toksvig},
    {"vmf_density", "S-ORD-20", "kappa cosine", "gamma", 1e-11, density},
    {"vmf_kappa", "S-ORD-21", "r", "kappa_approx kappa_exact", 1e-8, kappa},
    {"vmf_roughness", "S-ORD-22", "r alpha", "kappa code eq37 consistent", 1e-8, roughness},
    {"vmf_sh", "S-ORD-20", "kappa l", "exact gauss", 1e-10, coefficient},
    {0},
};
