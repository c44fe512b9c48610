#include "calibration/lens/lens_fit.h"

#include "calibration/lens/lens_model.h"
#include "calibration/lens/lens_module.h"
#include "core/log.h"
#include "core/mem.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define WINDOW_SHARE     0.35 /* of the smallest spacing */
#define OUTLIER_PX       0.25
#define OUTLIER_FACTOR   3
#define FOCAL_SIGMA_MOST 0.01
#define BLUR_FACTOR      2.5  /* times the median edge */
#define BLUR_LEAST_PX    3    /* no edge below it is blurred */
#define RICHER_GAIN      0.97 /* of the held-out error, for more coefficients */
#define BENT_GAIN        0.95 /* likewise, for a bent board */

weft_err weft_board_check(const weft_board *board, weft_error *err)
{
    if (board->columns < 3 || board->rows < 3 || board->columns > WEFT_BOARD_MAX_SIDE ||
        board->rows > WEFT_BOARD_MAX_SIDE)
        return weft_fail(err, WEFT_ERR_USAGE, "a board of %dx%d inner corners; wanted 3 to %d each way",
                         board->columns, board->rows, WEFT_BOARD_MAX_SIDE);
    if (!(board->square_mm > 0 && isfinite(board->square_mm)))
        return weft_fail(err, WEFT_ERR_USAGE, "squares of %g mm; wanted above 0", board->square_mm);
    return WEFT_OK;
}

weft_err weft_board_find(const uint8_t *grey, int width, int height, const weft_board *board, float *corners,
                         bool *found, weft_error *err)
{
    const weft_lens_opencv *opencv;
    weft_lens_why why;
    WEFT_TRY(weft_board_check(board, err));
    WEFT_TRY(weft_lens_opencv_load(&opencv, err));
    const int result = opencv->find_chessboard(grey, width, height, (size_t)width, board->columns,
                                               board->rows, WINDOW_SHARE, corners, &why);
    if (result < 0)
        return weft_fail(err, WEFT_ERR_NODATA, "the corner finder failed: %s", why.text);
    *found = result > 0;
    if (result == 2)
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "there are two boards of %dx%d inner corners in it; cover one, or take the picture again",
            board->columns, board->rows);
    return WEFT_OK;
}

/* Corner (column, row) on the board, mm: x along the rows, y against the order of the rows. */
static void fill_object(const weft_board *board, const double origin_mm[2], float *object)
{
    for (int r = 0; r < board->rows; r++)
        for (int c = 0; c < board->columns; c++) {
            float *const p = object + 3 * ((size_t)r * (size_t)board->columns + (size_t)c);
            p[0] = (float)(origin_mm[0] + board->square_mm * (c - 0.5 * (board->columns - 1)));
            p[1] = (float)(origin_mm[1] + board->square_mm * (0.5 * (board->rows - 1) - r));
            p[2] = 0;
        }
}

const char *weft_lens_model_name(weft_lens_model_choice model)
{
    static const char *const names[WEFT_LENS_N_MODELS] = {"k1k2p1p2", "k1k2p1p2k3", "rational"};
    return model >= 0 && model < WEFT_LENS_N_MODELS ? names[model] : "auto";
}

/* What a fit leaves free. */
typedef struct fit_model {
    weft_lens_model_choice terms;
    bool bent;
} fit_model;

/* Arrays of a fit: allocated once, used by all its rounds. */
typedef struct fit_work {
    const weft_lens_opencv *opencv;
    int n_points, columns, width, height;
    float *object;    /* [n_points][3] */
    float *bent;      /* [n_points][3] the board as found */
    float *residuals; /* [n_views][n_points][2] of the packed views */
    float *image;     /* [n_views][n_points][2]: the views that take part, packed */
    double *per_view; /* [n_views] of the packed views */
    double *sorted;   /* [n_views] */
    int *packed;      /* [n_views] index of the view */
} fit_work;

static void work_fini(fit_work *work)
{
    weft_free(work->object);
    weft_free(work->bent);
    weft_free(work->residuals);
    weft_free(work->image);
    weft_free(work->per_view);
    weft_free(work->sorted);
    weft_free(work->packed);
}

static weft_err work_init(fit_work *work, const weft_board *board, int n_views, weft_error *err)
{
    const size_t views = (size_t)n_views, points = (size_t)work->n_points;
    if (!(work->object = weft_alloc(3 * points, sizeof(float), err)) ||
        !(work->bent = weft_alloc(3 * points, sizeof(float), err)) ||
        !(work->residuals = weft_alloc(2 * points * views, sizeof(float), err)) ||
        !(work->image = weft_alloc(2 * points * views, sizeof(float), err)) ||
        !(work->per_view = weft_alloc(views, sizeof(double), err)) ||
        !(work->sorted = weft_alloc(views, sizeof(double), err)) ||
        !(work->packed = weft_alloc(views, sizeof(int), err)))
        return WEFT_ERR_NOMEM;
    fill_object(board, (const double[]){0, 0}, work->object);
    return WEFT_OK;
}

/* One fit of the used views but `skip` (-1: of all); the board comes out in work->bent. */
static weft_err fit_views(fit_work *work, const weft_board_view *views, int n_views, int skip,
                          fit_model model, weft_lens_estimate *estimate, int *n_used, weft_error *err)
{
    const size_t n = 2 * (size_t)work->n_points;
    static const weft_lens_terms terms[WEFT_LENS_N_MODELS] = {WEFT_LENS_TERMS_4, WEFT_LENS_TERMS_5,
                                                              WEFT_LENS_TERMS_8};
    weft_lens_why why;
    *n_used = 0;
    for (int i = 0; i < n_views; i++)
        if (views[i].used && i != skip) {
            memcpy(work->image + n * (size_t)*n_used, views[i].corners, n * sizeof(float));
            work->packed[(*n_used)++] = i;
        }
    if (work->opencv->calibrate(*n_used, work->n_points, work->object, work->image, work->width, work->height,
                                terms[model.terms], model.bent ? work->columns - 1 : -1, estimate, work->bent,
                                work->per_view, work->residuals, &why) != 0)
        return weft_fail(err, WEFT_ERR_NODATA, "the fit of the lens failed: %s", why.text);
    return WEFT_OK;
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The packed view that is to be left out, -1 when all agree. */
static int find_outlier(const fit_work *work, int n)
{
    memcpy(work->sorted, work->per_view, (size_t)n * sizeof *work->sorted);
    qsort(work->sorted, (size_t)n, sizeof *work->sorted, compare_doubles);
    const double limit = fmax(OUTLIER_PX, OUTLIER_FACTOR * work->sorted[n / 2]);
    int worst = -1;
    for (int i = 0; i < n; i++)
        if (work->per_view[i] > limit && (worst < 0 || work->per_view[i] > work->per_view[worst]))
            worst = i;
    return worst;
}

static weft_err too_few(const weft_board_view *views, int n_views, int n_used, weft_error *err)
{
    for (int i = 0; i < n_views; i++)
        if (views[i].blurred)
            return weft_fail(
                err, WEFT_ERR_NODATA,
                "%d views are left without the blurred ones (%s: edges %.1f px wide); wanted %d or more, "
                "sharp: focus, and hold the board still",
                n_used, views[i].name, views[i].edge_px, WEFT_LENS_MIN_VIEWS);
        else if (!views[i].used)
            return weft_fail(
                err, WEFT_ERR_NODATA,
                "too many views contradict the others (%s by %.2f px, %d in all): is the board flat, "
                "fixed while photographed, and of the stated corners?",
                views[i].name, views[i].rms_px, n_views - n_used);
    return weft_fail(err, WEFT_ERR_NODATA,
                     "%d views of the board; wanted %d or more (15 are better), tilted 20 to 40 degrees in "
                     "different directions and filling the frame",
                     n_used, WEFT_LENS_MIN_VIEWS);
}

/* Views whose edges are far wider than the others'. */
static void leave_out_blurred(fit_work *work, weft_board_view *views, int n_views)
{
    int n = 0;
    for (int i = 0; i < n_views; i++)
        if (views[i].edge_px > 0)
            work->sorted[n++] = views[i].edge_px;
    if (n == 0)
        return;
    qsort(work->sorted, (size_t)n, sizeof *work->sorted, compare_doubles);
    const double limit = fmax(BLUR_FACTOR * work->sorted[n / 2], BLUR_LEAST_PX);
    for (int i = 0; i < n_views; i++)
        if (views[i].edge_px > limit) {
            views[i].blurred = true;
            views[i].used = false;
        }
}

static weft_err fit_without_outliers(fit_work *work, weft_board_view *views, int n_views, fit_model model,
                                     weft_lens_estimate *estimate, int *n_used, weft_error *err)
{
    for (;;) {
        int left = 0;
        for (int i = 0; i < n_views; i++)
            left += views[i].used;
        if (left < WEFT_LENS_MIN_VIEWS || 3 * (n_views - left) > n_views)
            return too_few(views, n_views, left, err);
        WEFT_TRY(fit_views(work, views, n_views, -1, model, estimate, n_used, err));
        for (int i = 0; i < *n_used; i++)
            views[work->packed[i]].rms_px = work->per_view[i];
        const int worst = find_outlier(work, *n_used);
        if (worst < 0)
            return WEFT_OK;
        views[work->packed[worst]].used = false;
    }
}

/* Leave one view out: how well does the lens predict a view it has not seen? */
static weft_err held_out_error(fit_work *work, const weft_board_view *views, int n_views, int n_used,
                               fit_model model, double *held_out_px, weft_error *err)
{
    double sum = 0;
    *held_out_px = 0;
    if (n_used <= WEFT_LENS_MIN_VIEWS)
        return WEFT_OK;
    for (int i = 0; i < n_views; i++) {
        weft_lens_estimate e;
        weft_lens_why why;
        double rotation[9], translation[3], rms;
        int n;
        if (!views[i].used)
            continue;
        WEFT_TRY(fit_views(work, views, n_views, i, model, &e, &n, err));
        if (work->opencv->solve_pose(work->n_points, model.bent ? work->bent : work->object, views[i].corners,
                                     e.camera, e.distortion, rotation, translation, &rms, &why) != 0)
            return weft_fail(err, WEFT_ERR_NODATA, "%s: no pose of the board: %s", views[i].name, why.text);
        sum += rms * rms;
    }
    *held_out_px = sqrt(sum / n_used);
    return WEFT_OK;
}

static void fill_coverage(const fit_work *work, const weft_board_view *views, int n_views,
                          weft_lens_report *r)
{
    int n = 0;
    for (int i = 0; i < n_views; i++)
        for (int p = 0; views[i].used && p < work->n_points; p++) {
            const float *const corner = views[i].corners + 2 * (size_t)p;
            const double u = (double)corner[0], v = (double)corner[1];
            const int column = (int)(u * WEFT_COVERAGE_COLUMNS / work->width),
                      row = (int)(v * WEFT_COVERAGE_ROWS / work->height);
            if (u >= 0 && v >= 0 && column < WEFT_COVERAGE_COLUMNS && row < WEFT_COVERAGE_ROWS)
                n += r->map[row][column]++ == 0;
        }
    r->coverage = (double)n / (WEFT_COVERAGE_COLUMNS * WEFT_COVERAGE_ROWS);
}

/* How far the found board is from a plane. */
static double bend_of(const fit_work *work)
{
    double xx = 0, xy = 0, yy = 0, x = 0, y = 0, z = 0, xz = 0, yz = 0;
    const double n = work->n_points;
    for (int i = 0; i < work->n_points; i++) {
        const float *const at = work->bent + 3 * (size_t)i;
        const double px = (double)at[0], py = (double)at[1], pz = (double)at[2];
        x += px, y += py, z += pz, xx += px * px, xy += px * py, yy += py * py, xz += px * pz, yz += py * pz;
    }
    const weft_mat3 m = {{n, x, y, x, xx, xy, y, xy, yy}};
    weft_mat3 inverse;
    if (!weft_mat3_invert(&m, &inverse))
        return 0;
    const weft_vec3 plane = weft_mat3_apply(&inverse, (weft_vec3){z, xz, yz});
    double least = INFINITY, most = -INFINITY;
    for (int i = 0; i < work->n_points; i++) {
        const float *const at = work->bent + 3 * (size_t)i;
        const double off = (double)at[2] - plane.x - plane.y * (double)at[0] - plane.z * (double)at[1];
        least = fmin(least, off);
        most = fmax(most, off);
    }
    return most - least;
}

static weft_err try_model(fit_work *work, const weft_board_view *views, int n_views, fit_model model,
                          weft_lens_report *r, weft_error *err)
{
    double *const to = &r->tried_px[model.bent][model.terms];
    WEFT_TRY(held_out_error(work, views, n_views, r->n_used, model, to, err));
    weft_explain("lens: %s, %s board: held out %.4f px", weft_lens_model_name(model.terms),
                 model.bent ? "bent" : "flat", *to);
    return WEFT_OK;
}

/* The simplest model that no richer one beats on views it has not seen. */
static weft_err choose_model(fit_work *work, const weft_board_view *views, int n_views,
                             const weft_lens_options *options, fit_model *model, weft_lens_report *r,
                             weft_error *err)
{
    const bool can_choose = r->n_used > WEFT_LENS_MIN_VIEWS;
    *model = (fit_model){options->model == WEFT_LENS_AUTO ? WEFT_LENS_K1K2P1P2 : options->model,
                         options->bent == 1};
    WEFT_TRY(try_model(work, views, n_views, *model, r, err));
    for (int m = 1; m < WEFT_LENS_N_MODELS && options->model == WEFT_LENS_AUTO && can_choose; m++) {
        const fit_model richer = {(weft_lens_model_choice)m, model->bent};
        WEFT_TRY(try_model(work, views, n_views, richer, r, err));
        if (r->tried_px[richer.bent][m] < RICHER_GAIN * r->tried_px[model->bent][model->terms])
            *model = richer;
    }
    if (options->bent < 0 && can_choose) {
        const fit_model bent = {model->terms, true};
        WEFT_TRY(try_model(work, views, n_views, bent, r, err));
        model->bent = r->tried_px[1][bent.terms] < BENT_GAIN * r->tried_px[0][bent.terms];
    }
    r->model = model->terms;
    r->bent = model->bent;
    r->held_out_px = r->tried_px[model->bent][model->terms];
    return WEFT_OK;
}

static void keep_residuals(const fit_work *work, weft_board_view *views, int n_used)
{
    const size_t n = 2 * (size_t)work->n_points;
    for (int i = 0; i < n_used; i++) {
        weft_board_view *const view = &views[work->packed[i]];
        view->rms_px = work->per_view[i];
        if (view->residuals)
            memcpy(view->residuals, work->residuals + n * (size_t)i, n * sizeof(float));
    }
}

static weft_err check_estimate(const weft_lens_estimate *e, weft_error *err)
{
    const double focal = fmax(e->sigma[0] / e->camera[0], e->sigma[1] / e->camera[1]);
    if (!isfinite(e->rms_px) || !(e->camera[0] > 0 && e->camera[1] > 0) || !isfinite(focal))
        return weft_fail(err, WEFT_ERR_NODATA,
                         "the fit of the lens gave no camera; check the board's corners");
    if (focal > FOCAL_SIGMA_MOST)
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "the views leave the focal length uncertain by %.1f %% (wanted %.0f %% or less): tilt the "
            "board 20 to 40 degrees in different directions",
            100 * focal, 100 * FOCAL_SIGMA_MOST);
    return WEFT_OK;
}

static void fill_camera(const fit_work *work, const weft_lens_estimate *e, weft_camera *camera)
{
    *camera = (weft_camera){.width = work->width,
                            .height = work->height,
                            .fx = e->camera[0],
                            .fy = e->camera[1],
                            .cx = e->camera[2],
                            .cy = e->camera[3],
                            .rms_px = e->rms_px};
    memcpy(camera->distortion, e->distortion, sizeof e->distortion);
}

static weft_err fit_lens(fit_work *work, weft_board_view *views, int n_views,
                         const weft_lens_options *options, weft_lens_estimate *e, weft_lens_report *r,
                         weft_error *err)
{
    fit_model model = {options->model == WEFT_LENS_AUTO ? WEFT_LENS_K1K2P1P2 : options->model,
                       options->bent == 1};
    leave_out_blurred(work, views, n_views);
    WEFT_TRY(fit_without_outliers(work, views, n_views, model, e, &r->n_used, err));
    WEFT_TRY(check_estimate(e, err));
    WEFT_TRY(choose_model(work, views, n_views, options, &model, r, err));
    WEFT_TRY(fit_views(work, views, n_views, -1, model, e, &r->n_used, err));
    WEFT_TRY(check_estimate(e, err));
    keep_residuals(work, views, r->n_used);
    r->bend_mm = model.bent ? bend_of(work) : 0;
    fill_coverage(work, views, n_views, r);
    memcpy(r->sigma, e->sigma, sizeof r->sigma);
    return WEFT_OK;
}

weft_err weft_lens_fit(const weft_board *board, int width, int height, weft_board_view *views, int n_views,
                       const weft_lens_options *options, weft_camera *camera, weft_lens_report *report,
                       weft_error *err)
{
    static const weft_lens_options automatic = {WEFT_LENS_AUTO, -1};
    fit_work work = {.n_points = board->columns * board->rows,
                     .columns = board->columns,
                     .width = width,
                     .height = height};
    weft_lens_estimate e;
    weft_lens_report r = {0};
    WEFT_TRY(weft_board_check(board, err));
    WEFT_TRY(weft_lens_opencv_load(&work.opencv, err));
    for (int i = 0; i < n_views; i++) {
        views[i].used = true;
        views[i].blurred = false;
    }
    weft_err status = work_init(&work, board, n_views, err);
    if (status == WEFT_OK)
        status = fit_lens(&work, views, n_views, options ? options : &automatic, &e, &r, err);
    if (status == WEFT_OK) {
        *report = r;
        fill_camera(&work, &e, camera);
    }
    work_fini(&work);
    return status;
}

/* Where the numbers of a corner begin in [rows][columns][2]. */
static size_t corner_at(const weft_board *board, int row, int column)
{
    return 2 * ((size_t)row * (size_t)board->columns + (size_t)column);
}

/* Mean step in the picture from one corner to the next along a row, or across the rows. */
static void mean_step(const weft_board *board, const float *corners, bool along, double step[2])
{
    const int nc = board->columns - along, nr = board->rows - !along;
    const size_t next = along ? 2 : 2 * (size_t)board->columns;
    step[0] = step[1] = 0;
    for (int r = 0; r < nr; r++)
        for (int c = 0; c < nc; c++) {
            const float *const p = corners + corner_at(board, r, c), *const q = p + next;
            step[0] += (double)(q[0] - p[0]) / (nc * nr);
            step[1] += (double)(q[1] - p[1]) / (nc * nr);
        }
}

/*
 * The corners with rows from left to right and the first row on top.  The lattice has no labels of its own,
 * so any turn or flip of the finder's order names the same points.
 */
static weft_err order_corners(const weft_board *board, const weft_board_view *view, float *ordered,
                              weft_error *err)
{
    double along[2], across[2];
    mean_step(board, view->corners, true, along);
    mean_step(board, view->corners, false, across);
    const bool swap = board->columns == board->rows && fabs(along[0]) < fabs(along[1]);
    const double *const right = swap ? across : along, *const down = swap ? along : across;
    const double turned = atan2(fabs(right[1]), fabs(right[0]));
    if (!(turned <= atan2(1, 1)))
        return weft_fail(
            err, WEFT_ERR_RANGE,
            "%s: the board's rows of %d corners are turned by %.0f degrees from the width of the "
            "picture; lay it down straight",
            view->name, board->columns, turned * 45 / atan2(1, 1));
    for (int r = 0; r < board->rows; r++)
        for (int c = 0; c < board->columns; c++) {
            const int cc = right[0] < 0 ? board->columns - 1 - c : c;
            const int rr = down[1] < 0 ? board->rows - 1 - r : r;
            const size_t from = swap ? corner_at(board, cc, rr) : corner_at(board, rr, cc);
            memcpy(ordered + corner_at(board, r, c), view->corners + from, 2 * sizeof(float));
        }
    return WEFT_OK;
}

weft_err weft_lens_fit_pose(const weft_board *board, const weft_board_view *view, const double origin_mm[2],
                            weft_camera *camera, double *rms_px, weft_error *err)
{
    const weft_lens_opencv *opencv;
    weft_lens_why why;
    weft_camera posed = *camera;
    double translation[3], rms;
    WEFT_TRY(weft_board_check(board, err));
    WEFT_TRY(weft_lens_opencv_load(&opencv, err));
    const int n = board->columns * board->rows;
    float *const points = weft_alloc(5 * (size_t)n, sizeof *points, err);
    if (!points)
        return WEFT_ERR_NOMEM;
    float *const object = points, *const image = points + 3 * (size_t)n;
    weft_err status = order_corners(board, view, image, err);
    if (status == WEFT_OK) {
        fill_object(board, origin_mm, object);
        if (opencv->solve_pose(n, object, image,
                               (const double[]){camera->fx, camera->fy, camera->cx, camera->cy},
                               camera->distortion, posed.rotation.m, translation, &rms, &why) != 0)
            status = weft_fail(err, WEFT_ERR_NODATA, "%s: no pose of the board: %s", view->name, why.text);
    }
    weft_free(points);
    if (status != WEFT_OK)
        return status;
    posed.translation = (weft_vec3){translation[0], translation[1], translation[2]};
    posed.has_pose = true;
    if (!(weft_camera_centre(&posed).z > 0))
        return weft_fail(err, WEFT_ERR_NODATA,
                         "%s: the pose has the camera under the table; check the corners", view->name);
    *camera = posed;
    *rms_px = rms;
    return WEFT_OK;
}
