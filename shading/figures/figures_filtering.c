/* The Order: 1886, figures 17 and 18: specular antialiasing of a fine normal map, seen from afar. */
#include "shading/figures/figures.h"

#include "core/mem.h"
#include "core/parallel.h"
#include "shading/bake/normal_filter.h"
#include "shading/bake/vmf.h"
#include "shading/brdf/beckmann.h"
#include "shading/brdf/fresnel.h"
#include "shading/brdf/ggx.h"
#include "shading/brdf/half_vector.h"

#include <stdbool.h>
#include <stdio.h>

enum { SIDE = 1024, WAVES = 60, METHODS = 5 };

#define ALPHA 0.05
#define F0    0.6

/* How the normals within a pixel are answered for. */
typedef enum method { NONE, TOKSVIG, LEAN, ORDER, TRUTH } method;

static const char *const method_words[] = {"no antialiasing", "Toksvig", "LEAN", "vMF (The Order)",
                                           "ground truth"};

/* A plane of SIDE x SIDE texels, repeated, and who looks at it from where. */
typedef struct scene {
    double *slope[2];                 /* [SIDE][SIDE], dz/dx and dz/dy */
    double eye[3], at[3], light[3];   /* in texels; light: a direction */
    double fov_rad, exposure;         /* over the height */
    int width, height, across, along; /* of the pictures; places a pixel */
    bool beckmann;
} scene;

/* A hammered sheet: waves of 5 to 26 texels in all directions, slopes of 0.06 to 0.3 (rms) by turns. */
static weft_err make_slopes(scene *s, weft_error *err)
{
    const size_t n = (size_t)SIDE * SIDE;
    double swing[WAVES], kx[WAVES], ky[WAVES], turn[WAVES];
    for (int k = 0; k < 2; k++)
        if (!(s->slope[k] = weft_alloc(n, sizeof(double), err)))
            return WEFT_ERR_NOMEM;
    for (int k = 0; k < WAVES; k++) {
        const double angle = 2.399963 * k, length = 5 + 21 * fmod(0.618034 * k, 1);
        kx[k] = 2 * WEFT_PI * floor(SIDE / length * cos(angle)) / SIDE;
        ky[k] = 2 * WEFT_PI * floor(SIDE / length * sin(angle)) / SIDE;
        turn[k] = 1.7 * k * k;
        swing[k] = 0.3 * sqrt(2.0 / WAVES) / sqrt(kx[k] * kx[k] + ky[k] * ky[k]);
    }
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++)
            for (int k = 0; k < WAVES; k++) {
                const double worn = 0.6 + 0.4 * sin(2 * WEFT_PI * x / SIDE) * cos(2 * WEFT_PI * y / SIDE);
                const double rise = worn * swing[k] * cos(kx[k] * x + ky[k] * y + turn[k]);
                s->slope[0][(size_t)y * SIDE + (size_t)x] += kx[k] * rise;
                s->slope[1][(size_t)y * SIDE + (size_t)x] += ky[k] * rise;
            }
    return WEFT_OK;
}

/* f n.l of a lobe of width alpha about n; D may come from elsewhere (negative: from the model). */
static double lobe(const scene *s, const double n[3], const double v[3], double alpha, double given_d)
{
    double h[3] = {s->light[0] + v[0], s->light[1] + v[1], s->light[2] + v[2]};
    weft_figure_unit(h);
    const double nl = weft_figure_dot(n, s->light), nv = weft_max(weft_figure_dot(n, v), WEFT_MIN_NV);
    const double nh = weft_figure_dot(n, h);
    const double cross[3] = {n[1] * h[2] - n[2] * h[1], n[2] * h[0] - n[0] * h[2], n[0] * h[1] - n[1] * h[0]};
    const double s2 = weft_figure_dot(cross, cross), f = weft_fresnel_schlick(F0, weft_figure_dot(h, v));
    if (nl <= 0 || nh <= 0)
        return 0;
    if (!s->beckmann)
        return weft_ggx_d(nh, s2, alpha) * f * weft_ggx_v1(nl, alpha) * weft_ggx_v1(nv, alpha) * nl;
    const double d = given_d >= 0 ? given_d : weft_beckmann_d(nh, s2, alpha);
    return d * f * weft_beckmann_v1(nl, alpha) * weft_beckmann_v1(nv, alpha) / 4 * nl;
}

/* Olano and Baker 2010: a Gaussian of slopes from the first two moments, the material's alpha^2/2 added. */
static double lean_d(const scene *s, const double v[3], const double moment[5])
{
    double h[3] = {s->light[0] + v[0], s->light[1] + v[1], s->light[2] + v[2]};
    weft_figure_unit(h);
    const double own = 0.5 * ALPHA * ALPHA;
    const double xx = moment[2] - moment[0] * moment[0] + own, yy = moment[3] - moment[1] * moment[1] + own;
    const double xy = moment[4] - moment[0] * moment[1], area = xx * yy - xy * xy;
    const double x = -h[0] / h[2] - moment[0], y = -h[1] / h[2] - moment[1];
    const double square = (x * x * yy + y * y * xx - 2 * x * y * xy) / area;
    return h[2] > 0 ? exp(-0.5 * square) / (2 * WEFT_PI * sqrt(area) * h[2] * h[2] * h[2] * h[2]) : 0;
}

/* What a pixel's places say together. */
typedef struct footprint {
    double normal[3], moment[5], truth, view[3];
    int n;
} footprint;

static void add_place(const scene *s, const double ray[3], footprint *f)
{
    double v[3] = {-ray[0], -ray[1], -ray[2]};
    const double t = -s->eye[2] / ray[2];
    const int x = (int)floor(s->eye[0] + t * ray[0]) & (SIDE - 1);
    const int y = (int)floor(s->eye[1] + t * ray[1]) & (SIDE - 1);
    const size_t texel = (size_t)y * SIDE + (size_t)x;
    const double a = s->slope[0][texel], b = s->slope[1][texel];
    double n[3] = {-a, -b, 1};
    weft_figure_unit(n);
    weft_figure_unit(v);
    f->truth += lobe(s, n, v, ALPHA, -1);
    for (int c = 0; c < 3; c++) {
        f->normal[c] += n[c];
        f->view[c] += v[c];
    }
    const double moment[5] = {a, b, a * a, b * b, a * b};
    for (int k = 0; k < 5; k++)
        f->moment[k] += moment[k];
    f->n++;
}

static double answer(const scene *s, method way, footprint f)
{
    for (int k = 0; k < 5; k++)
        f.moment[k] /= f.n;
    const double r = weft_figure_unit(f.normal) / f.n;
    const double power = 2 / (ALPHA * ALPHA) - 2;
    weft_figure_unit(f.view);
    switch (way) {
    case NONE:
        return lobe(s, f.normal, f.view, ALPHA, -1);
    case TOKSVIG:
        return lobe(s, f.normal, f.view, sqrt(2 / (weft_toksvig_factor(r, power) * power + 2)), -1);
    case LEAN:
        return lobe(s, f.normal, f.view, ALPHA, lean_d(s, f.view, f.moment));
    case ORDER:
        return lobe(s, f.normal, f.view,
                    fmin(weft_vmf_roughness(ALPHA, weft_vmf_kappa_listing(r), WEFT_VMF_LISTING), 1), -1);
    case TRUTH:
        break;
    }
    return f.truth / f.n;
}

typedef struct draw_job {
    const scene *scene;
    weft_image *pictures; /* [METHODS] */
} draw_job;

static void draw_rows(void *context, int band, int row_begin, int row_end)
{
    const draw_job *const job = context;
    const scene *const s = job->scene;
    double ahead[3], right[3], up[3];
    (void)band;
    for (int c = 0; c < 3; c++)
        ahead[c] = s->at[c] - s->eye[c];
    weft_figure_unit(ahead);
    right[0] = ahead[1], right[1] = -ahead[0], right[2] = 0; /* ahead x z */
    weft_figure_unit(right);
    up[0] = right[1] * ahead[2], up[1] = -right[0] * ahead[2],
    up[2] = right[0] * ahead[1] - right[1] * ahead[0];
    const double scale = 2 * tan(s->fov_rad / 2) / s->height;
    for (int row = row_begin; row < row_end; row++)
        for (int column = 0; column < s->width; column++) {
            footprint f = {0};
            for (int k = 0; k < s->across * s->along; k++) {
                const int aside = k % s->across, down = k / s->across;
                const double x = (column + (aside + 0.5) / s->across - 0.5 * s->width) * scale;
                const double y = (0.5 * s->height - row - (down + 0.5) / s->along) * scale;
                double ray[3];
                for (int c = 0; c < 3; c++)
                    ray[c] = ahead[c] + x * right[c] + y * up[c];
                add_place(s, ray, &f);
            }
            for (int m = 0; m < METHODS; m++)
                for (int c = 0; c < 3; c++)
                    weft_image_row(&job->pictures[m], c, row)[column] =
                        (float)(s->exposure * WEFT_PI * answer(s, (method)m, f));
        }
}

/* Says how far a picture is from the truth: rms of the difference over the mean. */
static void print_distance(const weft_image *picture, const weft_image *truth, const char *name)
{
    const size_t n = weft_image_plane_size(truth);
    double sum2 = 0, sum = 0, mean = 0;
    for (size_t i = 0; i < n; i++) {
        const double d = (double)picture->data[i] - (double)truth->data[i];
        sum2 += d * d;
        sum += d;
        mean += (double)truth->data[i];
    }
    printf("  %-18s off by %.2f (rms) and %+.2f (mean) of the mean truth\n", name,
           sqrt(sum2 * (double)n) / mean, sum / mean);
}

static weft_err draw(scene *s, const char *folder, const char *name, int columns, int rows,
                     const method order[4], weft_error *err)
{
    weft_image pictures[METHODS] = {0}, *each[4];
    const char *words[4];
    weft_err status = make_slopes(s, err);
    for (int m = 0; m < METHODS && status == WEFT_OK; m++)
        status = weft_image_init(&pictures[m], s->width, s->height, 3, err);
    if (status == WEFT_OK) {
        weft_parallel_rows(s->height, draw_rows, &(draw_job){s, pictures});
        for (int i = 0; i < 4; i++) {
            each[i] = &pictures[order[i]];
            words[i] = method_words[order[i]];
            print_distance(each[i], &pictures[TRUTH], words[i]);
        }
        status = weft_figure_save(folder, name, columns, rows, each, words, WEFT_TONE_AGX, err);
    }
    for (int m = 0; m < METHODS; m++)
        weft_image_fini(&pictures[m]);
    for (int k = 0; k < 2; k++)
        weft_free(s->slope[k]);
    return status;
}

weft_err weft_figure_order_17(const char *folder, weft_error *err)
{
    /* clockwise from the top left in the source: none, Toksvig, truth, theirs */
    static const method order[4] = {NONE, TOKSVIG, ORDER, TRUTH};
    scene s = {.eye = {512, -6000, 6500},
               .at = {512, 512, 0},
               .light = {0.1, 0.62, 0.77},
               .fov_rad = 0.6,
               .exposure = 0.5,
               .width = 200,
               .height = 200,
               .across = 24,
               .along = 32};
    weft_figure_unit(s.light);
    return draw(&s, folder, "order-17.png", 2, 2, order, err);
}

weft_err weft_figure_order_18(const char *folder, weft_error *err)
{
    static const method order[4] = {NONE, LEAN, ORDER, TRUTH};
    scene s = {.eye = {512, -9000, 1600},
               .at = {512, 800, 0},
               .light = {0.05, 0.985, 0.16},
               .fov_rad = 0.17,
               .exposure = 0.12,
               .width = 400,
               .height = 100,
               .across = 12,
               .along = 80,
               .beckmann = true};
    weft_figure_unit(s.light);
    return draw(&s, folder, "order-18.png", 1, 4, order, err);
}
