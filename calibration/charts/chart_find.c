#include "calibration/charts/chart_find.h"

#include "calibration/charts/chart_blobs.h"
#include "calibration/charts/chart_edges.h"
#include "calibration/charts/chart_lattice.h"
#include "calibration/charts/chart_order.h"
#include "calibration/charts/homography.h"
#include "core/mem.h"

#include <math.h>
#include <string.h>

enum { SEARCH_SIDE_PX = 640 };

/* A way to lay the chart on a lattice. */
typedef struct placement {
    weft_mat3 to_cell; /* chart mm to cells */
    double score;      /* -INFINITY: none */
    int n_seen;        /* blobs of the lattice that lie on the chart */
} placement;

/* What was found on one lattice: the best placement, the best one that turns it otherwise, and mirrored. */
typedef struct reading {
    placement best;
    double runner_up, mirrored;
    int n_seen, columns, rows; /* blobs, extent of the lattice */
} reading;

/* What one search at one reduction gave. */
typedef struct search {
    const weft_chart *chart;
    weft_image cells;
    weft_blobs blobs;
    unsigned char *used;
    int n_charts;
    reading first, second; /* charts found */
    reading nearest;       /* the lattice that came closest when there is none */
} search;

void weft_chart_half_size(const weft_chart *chart, double *half_width_mm, double *half_height_mm)
{
    *half_width_mm = 0.5 * ((chart->columns - 1) * chart->pitch_mm + chart->patch_mm) + chart->border_mm;
    *half_height_mm = 0.5 * ((chart->rows - 1) * chart->pitch_mm + chart->patch_mm) + chart->border_mm;
}

static int n_patches(const weft_chart *chart)
{
    return chart->columns * chart->rows;
}

/* Chart mm to lattice (i, j): column = a . (i, j) + offset; `turn` quarter turns, then perhaps mirrored. */
static weft_mat3 chart_to_lattice(const weft_chart *chart, int turn, bool mirror, int column0, int row0)
{
    static const int turns[4][4] = {{1, 0, 0, 1}, {0, -1, 1, 0}, {-1, 0, 0, -1}, {0, 1, -1, 0}};
    const int *const t = turns[turn];
    const double a = mirror ? -t[0] : t[0], b = mirror ? -t[1] : t[1], c = t[2], d = t[3];
    const double det = a * d - b * c; /* 1 or -1: the inverse is exact */
    const weft_mat3 inverse = {{d / det, -b / det, 0, -c / det, a / det, 0, 0, 0, 1}};
    const double p = 1 / chart->pitch_mm;
    const weft_mat3 to_grid = {
        {p, 0, 0.5 * (chart->columns - 1) - column0, 0, -p, 0.5 * (chart->rows - 1) - row0, 0, 0, 1}};
    return weft_mat3_multiply(&inverse, &to_grid);
}

/* Column and row, without offset, of a lattice node in a turn. */
static void turned(const weft_lattice_node *node, int turn, bool mirror, int *column, int *row)
{
    static const int turns[4][4] = {{1, 0, 0, 1}, {0, -1, 1, 0}, {-1, 0, 0, -1}, {0, 1, -1, 0}};
    const int *const t = turns[turn];
    *column = (mirror ? -1 : 1) * (t[0] * node->i + t[1] * node->j);
    *row = t[2] * node->i + t[3] * node->j;
}

/* Nodes that lie on the chart when its first patch is at (-column0, -row0) of the turned lattice. */
static int count_inside(const weft_chart *chart, const weft_lattice *lattice, int turn, bool mirror,
                        int column0, int row0)
{
    int inside = 0;
    for (int k = 0; k < lattice->n; k++) {
        int c, r;
        turned(&lattice->nodes[k], turn, mirror, &c, &r);
        inside += c + column0 >= 0 && c + column0 < chart->columns && r + row0 >= 0 && r + row0 < chart->rows;
    }
    return inside;
}

/* All offsets of one turn: the best score; stray blobs beside the chart may stay outside it. */
static placement best_offset(const search *s, const weft_lattice *lattice, int turn, bool mirror)
{
    placement best = {.score = -INFINITY};
    int least = lattice->n * 9 / 10;
    if (least < n_patches(s->chart) * 45 / 100)
        least = n_patches(s->chart) * 45 / 100;
    int c_min = 0, c_max = 0, r_min = 0, r_max = 0;
    for (int k = 0; k < lattice->n; k++) {
        int c, r;
        turned(&lattice->nodes[k], turn, mirror, &c, &r);
        c_min = c < c_min ? c : c_min;
        c_max = c > c_max ? c : c_max;
        r_min = r < r_min ? r : r_min;
        r_max = r > r_max ? r : r_max;
    }
    for (int row0 = s->chart->rows - 2 - r_max; row0 <= 1 - r_min; row0++)
        for (int column0 = s->chart->columns - 2 - c_max; column0 <= 1 - c_min; column0++) {
            const int inside = count_inside(s->chart, lattice, turn, mirror, column0, row0);
            if (inside < least)
                continue;
            const weft_mat3 to_lattice = chart_to_lattice(s->chart, turn, mirror, column0, row0);
            const weft_mat3 to_cell = weft_mat3_multiply(&lattice->to_pixel, &to_lattice);
            weft_chart_colours colours;
            if (!weft_chart_colours_read(s->chart, &s->cells, &to_cell, &colours))
                continue;
            const double score = weft_chart_score(s->chart, &colours);
            if (score > best.score)
                best = (placement){to_cell, score, inside};
        }
    return best;
}

static reading read_lattice(const search *s, const weft_lattice *lattice)
{
    reading r = {.best.score = -INFINITY,
                 .runner_up = -INFINITY,
                 .mirrored = -INFINITY,
                 .n_seen = lattice->n,
                 .columns = lattice->i_max - lattice->i_min + 1,
                 .rows = lattice->j_max - lattice->j_min + 1};
    for (int turn = 0; turn < 4; turn++) {
        const placement p = best_offset(s, lattice, turn, false);
        if (p.score > r.best.score) {
            r.runner_up = r.best.score;
            r.best = p;
        } else if (p.score > r.runner_up)
            r.runner_up = p.score;
        const placement m = best_offset(s, lattice, turn, true);
        r.mirrored = fmax(r.mirrored, m.score);
    }
    return r;
}

/* Blobs on a chart that was found take no part in another. */
static void use_blobs(search *s, const weft_mat3 *to_cell)
{
    weft_mat3 back;
    double half_x, half_y;
    weft_chart_half_size(s->chart, &half_x, &half_y);
    if (!weft_mat3_invert(to_cell, &back))
        return;
    for (int k = 0; k < s->blobs.n; k++) {
        double x, y;
        if (weft_homography_apply(&back, s->blobs.items[k].u, s->blobs.items[k].v, &x, &y) &&
            fabs(x) < half_x && fabs(y) < half_y)
            s->used[k] = 1;
    }
}

static bool believed(const reading *r)
{
    return r->best.score >= WEFT_CHART_SCORE_MIN;
}

static void search_lattices(search *s)
{
    const double ratio = s->chart->pitch_mm / s->chart->patch_mm;
    weft_lattice lattice;
    for (int seed = 0; seed < s->blobs.n && s->n_charts < 2; seed++) {
        if (!weft_lattice_grow(&s->blobs, seed, ratio, s->used, &lattice))
            continue;
        const reading r = read_lattice(s, &lattice);
        const bool better_turned = r.mirrored > r.best.score;
        if (believed(&r) && !better_turned) {
            *(s->n_charts++ ? &s->second : &s->first) = r;
            use_blobs(s, &r.best.to_cell);
        } else if (fmax(r.best.score, r.mirrored) > fmax(s->nearest.best.score, s->nearest.mirrored) ||
                   s->nearest.n_seen == 0)
            s->nearest = r;
    }
}

static weft_err search_at(const weft_chart *chart, const weft_chart_picture *picture, int side, search *s,
                          weft_error *err)
{
    weft_image contrast = {0};
    *s = (search){.chart = chart, .nearest = {.best.score = -INFINITY, .mirrored = -INFINITY}};
    weft_err status = weft_chart_picture_reduce(picture, side, &s->cells, err);
    if (status == WEFT_OK)
        status = weft_chart_picture_contrast(&s->cells, WEFT_CONTRAST_MAX, &contrast, err);
    if (status == WEFT_OK)
        status = weft_blobs_find(&contrast, &s->blobs, err);
    if (status == WEFT_OK) {
        s->used = weft_alloc((size_t)s->blobs.n, 1, err);
        status = s->used ? WEFT_OK : WEFT_ERR_NOMEM;
    }
    if (status == WEFT_OK)
        search_lattices(s);
    weft_image_fini(&contrast);
    return status;
}

static void search_fini(search *s)
{
    weft_image_fini(&s->cells);
    weft_blobs_fini(&s->blobs);
    weft_free(s->used);
    *s = (search){0};
}

#define REMEDY "show the whole chart, sharp and unobstructed, or give its corners with --corners"

static weft_err explain_nothing(const search *s, weft_error *err)
{
    const weft_chart *const chart = s->chart;
    const reading *const n = &s->nearest;
    if (n->n_seen == 0)
        return weft_fail(err, WEFT_ERR_NODATA,
                         "no %s chart found: %d regions look like a patch, and none of them stand in rows "
                         "and columns; " REMEDY,
                         chart->name, s->blobs.n);
    if (n->mirrored >= WEFT_CHART_SCORE_MIN)
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "the %s chart is mirrored (score %.2f mirrored, %.2f as it should be): the pictures are "
            "flipped",
            chart->name, n->mirrored, fmax(n->best.score, 0));
    if (!isfinite(n->best.score))
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "no %s chart found: the %d x %d patches in the picture (%d seen) are not its %d x %d; " REMEDY,
            chart->name, n->columns, n->rows, n->n_seen, chart->columns, chart->rows);
    if (!(n->best.score > 0) && n->columns * n->rows < n_patches(chart))
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "no %s chart found: %d patches stand in %d x %d, the chart has %d x %d: a part of it is "
            "outside the picture or covered; " REMEDY,
            chart->name, n->n_seen, n->columns, n->rows, chart->columns, chart->rows);
    return weft_fail(
        err, WEFT_ERR_NODATA,
        "no %s chart found: %d patches stand in %d x %d, but the chart's colours explain %.2f of what "
        "they look like (%.2f wanted); " REMEDY,
        chart->name, n->n_seen, n->columns, n->rows, fmax(n->best.score, 0), WEFT_CHART_SCORE_MIN);
}

static weft_err check_reading(const search *s, int side, weft_error *err)
{
    const weft_chart *const chart = s->chart;
    if (s->n_charts > 1) {
        double u[2] = {0}, v[2] = {0};
        weft_homography_apply(&s->first.best.to_cell, 0, 0, &u[0], &v[0]);
        weft_homography_apply(&s->second.best.to_cell, 0, 0, &u[1], &v[1]);
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "two %s charts in the picture, at (%.0f, %.0f) and (%.0f, %.0f): cover one or give --corners",
            chart->name, weft_chart_from_cell(u[0], side), weft_chart_from_cell(v[0], side),
            weft_chart_from_cell(u[1], side), weft_chart_from_cell(v[1], side));
    }
    const double other = fmax(s->first.runner_up, s->first.mirrored);
    if (s->first.best.score - other < WEFT_CHART_LEAD_MIN)
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "which way the %s chart lies is ambiguous: scores %.2f and %.2f (a lead of %.2f is wanted); "
            "light it evenly or give --corners",
            chart->name, s->first.best.score, other, WEFT_CHART_LEAD_MIN);
    return WEFT_OK;
}

/* The map in pixels from the map in cells of `side`. */
static weft_mat3 cells_to_pixels(const weft_mat3 *to_cell, int side)
{
    const double c = 0.5 * side - 0.5;
    const weft_mat3 scale = {{side, 0, c, 0, side, c, 0, 0, 1}};
    return weft_mat3_multiply(&scale, to_cell);
}

static weft_mat3 pixels_to_cells(const weft_mat3 *to_pixel, int side)
{
    const double c = 0.5 / side - 0.5;
    const weft_mat3 scale = {{1.0 / side, 0, c, 0, 1.0 / side, c, 0, 0, 1}};
    return weft_mat3_multiply(&scale, to_pixel);
}

/* Fills corners, edges and the order of the greys from a first map. */
static weft_err finish(const weft_chart *chart, const weft_chart_picture *picture, weft_chart_pose *pose,
                       weft_error *err)
{
    const int side = picture->cfa != WEFT_CFA_NONE || picture->image->width > 3000 ? 2 : 1;
    weft_image cells = {0}, contrast = {0};
    weft_chart_colours colours;
    weft_err status = weft_chart_picture_reduce(picture, side, &cells, err);
    if (status == WEFT_OK)
        status = weft_chart_picture_contrast(&cells, WEFT_CONTRAST_MEAN, &contrast, err);
    weft_mat3 to_cell = pixels_to_cells(&pose->to_pixel, side);
    if (status == WEFT_OK)
        status = weft_chart_edges_refine(chart, &contrast, &to_cell, &pose->n_edges, &pose->edge_rms_px, err);
    if (status == WEFT_OK && !weft_chart_colours_read(chart, &cells, &to_cell, &colours))
        status = weft_fail(err, WEFT_ERR_NODATA, "the %s chart is not wholly in the picture: move it",
                           chart->name);
    if (status == WEFT_OK) {
        int a, b;
        if (!weft_chart_greys_in_order(chart, &colours, &a, &b))
            status = weft_fail(
                err, WEFT_ERR_NODATA,
                "the %s chart's greys are not in order: \"%s\" is darker than \"%s\"; look for glints, "
                "shadows or another kind of chart",
                chart->name, chart->patches[a].name, chart->patches[b].name);
        pose->score = weft_chart_score(chart, &colours);
    }
    if (status == WEFT_OK) {
        double x, y;
        static const double sign[4][2] = {{-1, 1}, {1, 1}, {1, -1}, {-1, -1}};
        pose->to_pixel = cells_to_pixels(&to_cell, side);
        pose->edge_rms_px *= side;
        weft_chart_half_size(chart, &x, &y);
        for (int k = 0; k < 4; k++)
            if (!weft_homography_apply(&pose->to_pixel, sign[k][0] * x, sign[k][1] * y, &pose->corners[k][0],
                                       &pose->corners[k][1]))
                status = weft_fail(err, WEFT_ERR_NODATA, "the %s chart is tilted too much", chart->name);
    }
    weft_image_fini(&cells);
    weft_image_fini(&contrast);
    return status;
}

static int search_side(const weft_chart_picture *picture)
{
    const weft_image *const image = picture->image;
    const int longer = image->width > image->height ? image->width : image->height;
    int side = (longer + SEARCH_SIDE_PX / 2) / SEARCH_SIDE_PX;
    if (picture->cfa != WEFT_CFA_NONE)
        side += side % 2;
    const int least = picture->cfa != WEFT_CFA_NONE ? 2 : 1;
    return side > least ? side : least;
}

weft_err weft_chart_locate(const weft_chart *chart, const weft_chart_picture *picture, weft_chart_pose *pose,
                           weft_error *err)
{
    const int least = picture->cfa != WEFT_CFA_NONE ? 2 : 1;
    int side = search_side(picture);
    search s;
    weft_err status = search_at(chart, picture, side, &s, err);
    if (status == WEFT_OK && s.n_charts == 0 && side > least) { /* small in the picture: look closer */
        search_fini(&s);
        side = side / 2 < least ? least : side / 2 + (picture->cfa != WEFT_CFA_NONE ? side / 2 % 2 : 0);
        status = search_at(chart, picture, side, &s, err);
    }
    if (status == WEFT_OK)
        status = s.n_charts ? check_reading(&s, side, err) : explain_nothing(&s, err);
    if (status == WEFT_OK) {
        weft_chart_pose found = {.to_pixel = cells_to_pixels(&s.first.best.to_cell, side),
                                 .n_seen = s.first.best.n_seen,
                                 .runner_up = fmax(s.first.runner_up, s.first.mirrored)};
        status = finish(chart, picture, &found, err);
        if (status == WEFT_OK)
            *pose = found;
    }
    search_fini(&s);
    return status;
}

static bool clockwise_and_convex(const double corners[4][2])
{
    for (int k = 0; k < 4; k++) {
        const double *const a = corners[k], *const b = corners[(k + 1) % 4], *const c = corners[(k + 2) % 4];
        if (!((b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]) > 1))
            return false;
    }
    return true;
}

/* Score of the chart when its first patch is at the given corner. */
static double score_of_turn(const weft_chart *chart, const weft_image *cells, const double corners[4][2],
                            int turn, int side, weft_mat3 *to_pixel)
{
    double x, y, seen[4][2];
    weft_chart_half_size(chart, &x, &y);
    const double plane[4][2] = {{-x, y}, {x, y}, {x, -y}, {-x, -y}};
    for (int k = 0; k < 4; k++)
        memcpy(seen[k], corners[(k + turn) % 4], sizeof seen[k]);
    if (!weft_homography_from_corners(plane, (const double(*)[2])seen, to_pixel))
        return -(double)INFINITY;
    const weft_mat3 to_cell = pixels_to_cells(to_pixel, side);
    weft_chart_colours colours;
    return weft_chart_colours_read(chart, cells, &to_cell, &colours) ? weft_chart_score(chart, &colours)
                                                                     : -(double)INFINITY;
}

static weft_err check_turns(const weft_chart *chart, const double scores[4], weft_error *err)
{
    if (!isfinite(scores[0]))
        return weft_fail(err, WEFT_ERR_USAGE, "--corners: the chart would lie partly outside the picture");
    int best = 0;
    for (int turn = 1; turn < 4; turn++)
        if (scores[turn] > scores[best])
            best = turn;
    if (best != 0)
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "--corners: the colours say that \"%s\" is at corner %d, not at the first (scores %.2f, %.2f)",
            chart->patches[0].name, best + 1, scores[best], scores[0]);
    if (scores[0] < 0.5 * WEFT_CHART_SCORE_MIN)
        return weft_fail(err, WEFT_ERR_NODATA,
                         "--corners: the %s chart's colours explain only %.2f of what is there (%.2f wanted)",
                         chart->name, fmax(scores[0], 0), 0.5 * WEFT_CHART_SCORE_MIN);
    return WEFT_OK;
}

weft_err weft_chart_place(const weft_chart *chart, const weft_chart_picture *picture,
                          const double corners[4][2], weft_chart_pose *pose, weft_error *err)
{
    if (!clockwise_and_convex(corners))
        return weft_fail(
            err, WEFT_ERR_USAGE,
            "--corners: wanted u,v of the frame's four outer corners, clockwise from the first patch");
    const int side = search_side(picture);
    weft_image cells;
    weft_mat3 to_pixel[4];
    double scores[4];
    WEFT_TRY(weft_chart_picture_reduce(picture, side, &cells, err));
    for (int turn = 0; turn < 4; turn++)
        scores[turn] = score_of_turn(chart, &cells, corners, turn, side, &to_pixel[turn]);
    weft_image_fini(&cells);
    WEFT_TRY(check_turns(chart, scores, err));
    weft_chart_pose found = {.to_pixel = to_pixel[0],
                             .runner_up = fmax(scores[1], fmax(scores[2], scores[3]))};
    WEFT_TRY(finish(chart, picture, &found, err));
    *pose = found;
    return WEFT_OK;
}
