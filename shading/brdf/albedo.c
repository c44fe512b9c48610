#include "shading/brdf/albedo.h"

#include "shading/brdf/half_vector.h"
#include "shading/brdf/quadrature.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

/* One integral under way. */
typedef struct integral {
    weft_albedo_fn *fn;
    void *context;
    weft_albedo_domain domain;
    bool anisotropic;
    double nv, sv, view[3];
    double min_nl;  /* lights below it are left out */
    double phi_rad; /* azimuth of the view, and its cosine and sine */
    double tangent[2];
    weft_quadrature q;
    double sum[3];
} integral;

/* Half the range of azimuths (from that of the view) in which half vectors at polar angle theta have
 * n.l = 2 (v.h) nh - nv > min_nl (UPPER), or v.h > 0 (VISIBLE). */
static double azimuth_reach(const integral *in, weft_albedo_domain domain, double theta)
{
    const double nh = cos(theta), sh = sin(theta);
    const double over =
        domain == WEFT_ALBEDO_UPPER ? in->min_nl + in->nv * (1 - 2 * nh * nh) : -in->nv * nh * sh;
    const double under = domain == WEFT_ALBEDO_UPPER ? 2 * nh * sh * in->sv : sh * sh * in->sv;
    if (over <= -under)
        return WEFT_PI;
    if (over >= under)
        return 0;
    return acos(over / under);
}

/* Adds the half vectors at polar angle theta and azimuths begin..end from that of the view. */
static void add_arc(integral *in, double theta, double begin, double end, double weight)
{
    const double nh = cos(theta), sh = sin(theta);
    double light[3][WEFT_QUADRATURE_MAX], view[3][WEFT_QUADRATURE_MAX], value[3][WEFT_QUADRATURE_MAX];
    double w[WEFT_QUADRATURE_MAX];
    const int n = in->q.n;
    for (int i = 0; i < n; i++) {
        const double phi =
            in->q.at[i] < 0.5 ? begin + (end - begin) * in->q.at[i] : end - (end - begin) * in->q.to_end[i];
        const double along = cos(phi), across = sin(phi);
        const double h[3] = {sh * (along * in->tangent[0] - across * in->tangent[1]),
                             sh * (along * in->tangent[1] + across * in->tangent[0]), nh};
        const double vh = in->sv * sh * along + in->nv * nh;
        for (int c = 0; c < 3; c++) {
            light[c][i] = 2 * vh * h[c] - in->view[c];
            view[c][i] = in->view[c];
        }
        w[i] = weight * in->q.weight[i] * (end - begin) * sh * 4 * weft_max(vh, 0);
        if (in->domain == WEFT_ALBEDO_UPPER)
            w[i] *= weft_max(light[2][i], 0);
    }
    const weft_brdf_batch batch = {
        .n = n, .light = {light[0], light[1], light[2]}, .view = {view[0], view[1], view[2]}};
    double *const out[3] = {value[0], value[1], value[2]};
    in->fn(in->context, &batch, out);
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < n; i++)
            in->sum[c] += w[i] > 0 ? w[i] * value[c][i] : 0;
}

/* The next azimuth (from that of the view) above `from` where an anisotropic lobe may have a ridge, and
 * around it at some decades of the ridge's width: nodes crowd at the ends of an interval, but not enough for
 * widths a factor 1e5 apart. */
static double next_cut(const integral *in, double from)
{
    static const double around[] = {-3e-2, -1e-3, -3e-5, 0, 3e-5, 1e-3, 3e-2};
    const double quarter = WEFT_PI / 2, nearest = floor((in->phi_rad + from) / quarter + 0.5);
    for (int side = 0; side < 2; side++)
        for (size_t i = 0; i < sizeof around / sizeof around[0]; i++) {
            const double cut = (nearest + side) * quarter + around[i] - in->phi_rad;
            if (cut > from + 1e-9)
                return cut;
        }
    return from + quarter;
}

/* Both arcs begin..end beside the view's azimuth; those of anisotropic models are cut at tangent and
 * bitangent, where a lobe can be as narrow as it likes. */
static void add_arcs(integral *in, double theta, double begin, double end, double weight)
{
    for (int side = -1; side <= 1; side += 2) {
        double from = side < 0 ? -end : begin;
        const double to = side < 0 ? -begin : end;
        while (in->anisotropic) {
            const double cut = next_cut(in, from);
            if (cut >= to)
                break;
            add_arc(in, theta, from, cut, weight);
            from = cut;
        }
        add_arc(in, theta, from, to, weight);
    }
}

/* The ring is cut where the light meets the horizon: a density may have a kink there. */
static void add_ring(integral *in, double theta, double weight)
{
    const double lit = azimuth_reach(in, WEFT_ALBEDO_UPPER, theta);
    if (lit > 0)
        add_arcs(in, theta, 0, lit, weight);
    if (in->domain == WEFT_ALBEDO_VISIBLE) {
        const double reach = azimuth_reach(in, WEFT_ALBEDO_VISIBLE, theta);
        if (reach > lit)
            add_arcs(in, theta, lit, reach, weight);
    }
}

static void add_interval(integral *in, double begin, double end)
{
    for (int i = 0; i < in->q.n; i++) {
        const double theta =
            in->q.at[i] < 0.5 ? begin + (end - begin) * in->q.at[i] : end - (end - begin) * in->q.to_end[i];
        if (theta > begin && theta < end)
            add_ring(in, theta, (end - begin) * in->q.weight[i]);
    }
}

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Runs over all half vectors; `in` has its inputs. */
static void integrate(integral *in, weft_albedo_effort effort, double value[3])
{
    static const double decades[] = {0, 1e-4, 1e-3, 1e-2, 0.1, 0.4, 1, 2.5, 10, 100, 1e3, 1e4};
    enum { N_DECADES = sizeof decades / sizeof decades[0], N_CUTS = N_DECADES + 4 };
    assert(in->nv > 0 && in->nv <= 1);
    weft_brdf_direction(in->nv, in->phi_rad, in->view);
    in->sv = sqrt((1 - in->nv) * (1 + in->nv));
    in->tangent[0] = cos(in->phi_rad);
    in->tangent[1] = sin(in->phi_rad);
    weft_quadrature_init(&in->q, effort == WEFT_ALBEDO_EXACT ? 16 : 8);
    /* where the two horizons begin to cut the rings of half vectors, and where they have cut them off */
    const double view_angle = atan2(in->sv, in->nv), half_pi = WEFT_PI / 2, edge = acos(in->min_nl);
    double cuts[N_CUTS] = {fabs(edge - view_angle) / 2, (edge + view_angle) / 2, half_pi - view_angle,
                           half_pi};
    for (int i = 0; i < N_DECADES; i++)
        cuts[4 + i] = atan(decades[i]);
    qsort(cuts, N_CUTS, sizeof cuts[0], by_value);
    for (int i = 0; i + 1 < N_CUTS; i++)
        if (cuts[i] < cuts[i + 1])
            add_interval(in, cuts[i], cuts[i + 1]);
    for (int c = 0; c < 3; c++)
        value[c] = in->sum[c];
}

void weft_albedo_integrate(weft_albedo_fn *fn, void *context, weft_albedo_domain domain, double nv,
                           double phi_rad, bool anisotropic, weft_albedo_effort effort, double value[3])
{
    integral in = {.fn = fn,
                   .context = context,
                   .domain = domain,
                   .anisotropic = anisotropic,
                   .nv = nv,
                   .phi_rad = phi_rad};
    integrate(&in, effort, value);
}

void weft_albedo_integrate_cone(weft_albedo_fn *fn, void *context, double nv, double min_nl,
                                weft_albedo_effort effort, double value[3])
{
    integral in = {.fn = fn, .context = context, .domain = WEFT_ALBEDO_UPPER, .nv = nv, .min_nl = min_nl};
    assert(min_nl >= 0 && min_nl <= 1);
    integrate(&in, effort, value);
}

/* A model and its constant parameters spread over a batch. */
typedef struct spread_model {
    const weft_brdf *brdf;
    double planes[WEFT_BRDF_MAX_PLANES][WEFT_QUADRATURE_MAX];
} spread_model;

static void spread(spread_model *model, const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES])
{
    model->brdf = brdf;
    for (int k = 0; k < weft_brdf_n_planes(brdf); k++)
        for (int i = 0; i < WEFT_QUADRATURE_MAX; i++)
            model->planes[k][i] = values[k];
}

static weft_brdf_batch with_params(const spread_model *model, const weft_brdf_batch *batch)
{
    weft_brdf_batch full = *batch;
    full.data = model->brdf->data;
    for (int k = 0; k < weft_brdf_n_planes(model->brdf); k++)
        full.param[k] = model->planes[k];
    return full;
}

static void eval_model(void *context, const weft_brdf_batch *batch, double *const value[3])
{
    const spread_model *const model = context;
    const weft_brdf_batch full = with_params(model, batch);
    model->brdf->eval(&full, value);
}

static void eval_density(void *context, const weft_brdf_batch *batch, double *const value[3])
{
    const spread_model *const model = context;
    const weft_brdf_batch full = with_params(model, batch);
    model->brdf->pdf(&full, value[0]);
    for (int i = 0; i < batch->n; i++)
        value[1][i] = value[2][i] = 0;
}

void weft_brdf_albedo(const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES], double nv,
                      double phi_rad, weft_albedo_effort effort, double albedo[3])
{
    spread_model model;
    spread(&model, brdf, values);
    weft_albedo_integrate(eval_model, &model, WEFT_ALBEDO_UPPER, nv, phi_rad,
                          brdf->flags & WEFT_BRDF_ANISOTROPIC, effort, albedo);
}

double weft_brdf_pdf_integral(const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES], double nv,
                              double phi_rad, weft_albedo_effort effort)
{
    spread_model model;
    double sum[3];
    spread(&model, brdf, values);
    weft_albedo_integrate(eval_density, &model, WEFT_ALBEDO_VISIBLE, nv, phi_rad,
                          brdf->flags & WEFT_BRDF_ANISOTROPIC, effort, sum);
    return sum[0];
}
