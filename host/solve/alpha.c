#include "host/solve/alpha.h"

#include "core/colour.h"
#include "host/solve/finish.h"
#include "host/solve/flaw_search.h"
#include "host/solve/running_mean.h"

#include <math.h>
#include <string.h>

/* The ground is where a pixel is nearer than this part of the way to the darkest yarns; its neighbours within
 * EDGE_PX show both. */
static const double way_to_dark = 0.3, dark_yarns = 0.05;
enum { EDGE_PX = 2 };
/* Yarns are looked for within this; surely yarn is what reflects BRIGHTER times what the ground does. */
static const double yarn_mm = 0.5, brighter = 3;

typedef struct alpha_job {
    const weft_maps *maps;
    float ground;
    int reach;
    weft_image luminance; /* 1 plane */
    weft_image yarn;      /* 2 planes: luminance of closed pixels, and their number; means of both */
    weft_mask closed;     /* surely yarn, and nothing else */
    weft_mask edge;       /* 1 at holes and within EDGE_PX of them */
    double mean;          /* of all closed pixels */
    float dark;           /* the darkest of them */
} alpha_job;

static void fill_luminance(alpha_job *job)
{
    const weft_image *const albedo = &job->maps->albedo;
    const size_t n = weft_image_plane_size(albedo);
    for (size_t i = 0; i < n; i++)
        job->luminance.data[i] = (float)weft_luminance((double)albedo->data[i], (double)albedo->data[n + i],
                                                       (double)albedo->data[2 * n + i]);
}

/* Brighter is yarn. */
static float sure_of(const alpha_job *job)
{
    return (float)brighter * job->ground + 0.01F;
}

static void find_closed(alpha_job *job)
{
    const size_t n = weft_image_plane_size(&job->luminance);
    for (size_t i = 0; i < n; i++)
        job->closed.data[i] =
            weft_flaw_answered(job->maps, i) && !job->edge.data[i] && job->luminance.data[i] > sure_of(job);
}

/* Mean luminance of the closed pixels around each. */
static weft_err find_yarn(alpha_job *job, weft_error *err)
{
    const size_t n = weft_image_plane_size(&job->luminance);
    float *const sum = weft_image_plane(&job->yarn, 0), *const count = weft_image_plane(&job->yarn, 1);
    double total = 0, closed = 0;
    find_closed(job);
    for (size_t i = 0; i < n; i++) {
        const bool use = job->closed.data[i];
        sum[i] = use ? job->luminance.data[i] : 0;
        count[i] = use ? 1 : 0;
        total += (double)sum[i];
        closed += (double)count[i];
    }
    if (!(closed > 0))
        return weft_fail(err, WEFT_ERR_NODATA,
                         "--ground %.3g: no pixel is %g times as bright as that (what is its reflectance?)",
                         (double)job->ground, brighter);
    job->mean = total / closed;
    return weft_running_mean(&job->yarn, job->reach, 1, err);
}

static float coverage(const alpha_job *job, size_t i)
{
    const float count = weft_image_plane(&job->yarn, 1)[i];
    const float yarn = count > 0.01F ? weft_image_plane(&job->yarn, 0)[i] / count : (float)job->mean;
    return fminf(fmaxf((job->luminance.data[i] - job->ground) / (yarn - job->ground), 0), 1);
}

/* Pixels darker than `most`, and their neighbours. */
static void mark_edges(alpha_job *job, float most)
{
    const int w = job->luminance.width, h = job->luminance.height;
    memset(job->edge.data, 0, (size_t)w * (size_t)h);
    for (int v = 0; v < h; v++)
        for (int u = 0; u < w; u++) {
            const size_t i = (size_t)v * (size_t)w + (size_t)u;
            if (!weft_flaw_answered(job->maps, i) || !(job->luminance.data[i] < most))
                continue;
            for (int y = v - EDGE_PX < 0 ? 0 : v - EDGE_PX; y <= v + EDGE_PX && y < h; y++)
                for (int x = u - EDGE_PX < 0 ? 0 : u - EDGE_PX; x <= u + EDGE_PX && x < w; x++)
                    job->edge.data[(size_t)y * (size_t)w + (size_t)x] = 1;
        }
}

static weft_err make_job(alpha_job *job, weft_error *err)
{
    const weft_maps *const m = job->maps;
    WEFT_TRY(weft_image_init(&job->luminance, m->width, m->height, 1, err));
    WEFT_TRY(weft_image_init(&job->yarn, m->width, m->height, 2, err));
    WEFT_TRY(weft_mask_init(&job->closed, m->width, m->height, 0, err));
    return weft_mask_init(&job->edge, m->width, m->height, 0, err);
}

weft_err weft_maps_find_alpha(weft_maps *maps, double ground, weft_error *err)
{
    alpha_job job = {.maps = maps, .ground = (float)ground};
    weft_image alpha = {0};
    WEFT_TRY(weft_maps_require_plane(maps, "--ground", err));
    job.reach = (int)fmax(2, round(yarn_mm / maps->mm_per_px));
    weft_err status = make_job(&job, err);
    if (status == WEFT_OK) {
        fill_luminance(&job);
        mark_edges(&job, sure_of(&job));
        find_closed(&job);
        status = weft_flaw_quantile(&job.luminance, &job.closed, dark_yarns, &job.dark, err);
    }
    if (status == WEFT_OK) {
        mark_edges(&job, fminf(sure_of(&job), job.ground + (float)way_to_dark * (job.dark - job.ground)));
        status = find_yarn(&job, err); /* without the edges, which are dimmer */
    }
    if (status == WEFT_OK)
        status = weft_image_init(&alpha, maps->width, maps->height, 1, err);
    if (status == WEFT_OK) {
        const size_t n = weft_image_plane_size(&alpha);
        for (size_t i = 0; i < n; i++)
            alpha.data[i] = !weft_flaw_answered(maps, i) ? 0 : job.edge.data[i] ? coverage(&job, i) : 1;
        weft_image_fini(&maps->alpha);
        maps->alpha = alpha;
    }
    weft_image_fini(&job.luminance);
    weft_image_fini(&job.yarn);
    weft_mask_fini(&job.closed);
    weft_mask_fini(&job.edge);
    return status;
}
