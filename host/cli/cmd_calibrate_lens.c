/* weft calibrate lens: intrinsics, distortion and pose from photographs of a chessboard. */
#include "host/cli/command.h"

#include "calibration/calibration_report.h"
#include "calibration/lens/lens_fit.h"
#include "calibration/lens/lens_model.h"
#include "calibration/lens/lens_module.h"
#include "core/json.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "host/cli/board_picture.h"

#include <math.h>
#include <string.h>

#define BLUR_MOST        0.2 /* width of an edge over a square's */
#define LEANING_MOST_DEG 15  /* of a camera over a table; the boards of a lens lean by 20 and more */

typedef struct lens_args {
    const char *output, *on_table;
    weft_size board;
    double square_mm;
    weft_numbers origin_mm;
    const char *model, *bent;
} lens_args;

static const weft_field fields[] = {
    {.key = "output",
     .short_opt = 'o',
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(lens_args, output),
     .unit = "CAL",
     .required = true,
     .help = "calibration to add to (NAME.cal; made when it is not there)"},
    {.key = "board",
     .type = WEFT_FIELD_SIZE,
     .offset = offsetof(lens_args, board),
     .unit = "CxR",
     .def = "9x6",
     .help = "inner corners of the chessboard, along its rows and across"},
    {.key = "square-mm",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(lens_args, square_mm),
     .unit = "mm",
     .min = 1e-3,
     .max = 1e4,
     .def = "10",
     .help = "side of a square, measured on the print"},
    {.key = "board-on-table",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(lens_args, on_table),
     .unit = "IMAGE",
     .help = "picture of the board lying on the sample plane, rows along the width: gives the pose"},
    {.key = "board-origin-mm",
     .type = WEFT_FIELD_F64S,
     .offset = offsetof(lens_args, origin_mm),
     .unit = "X,Y",
     .def = "0,0",
     .help = "where the middle of that board is in the world"},
    {.key = "model",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(lens_args, model),
     .unit = "NAME",
     .def = "auto",
     .help =
         "coefficients of the lens: k1k2p1p2, k1k2p1p2k3, rational; auto takes the held-out error's word"},
    {.key = "bent",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(lens_args, bent),
     .unit = "WORD",
     .def = "auto",
     .help = "whether the board may be bent: yes, no; auto takes the held-out error's word"},
    {0},
};

/* All that a run holds. */
typedef struct lens_run {
    const lens_args *args;
    weft_board board;
    weft_calibration cal;
    int width, height;      /* px, of the first picture */
    const char *first_name; /* of the picture that gave them */
    weft_board_view *views; /* [n_views] */
    int n_views;
    weft_lens_options options;
    float *residuals;      /* [operands][corners][2] */
    float *corners;        /* [operands + 1][corners][2]; the last is the board on the table */
    json_t *without_board; /* names of pictures without a board */
    weft_lens_report lens;
    double pose_rms_px;
} lens_run;

static float *corners_of(const lens_run *run, int i)
{
    return run->corners + (size_t)(2 * run->board.columns * run->board.rows) * (size_t)i;
}

static weft_err check_size(lens_run *run, const weft_board_picture *picture, const char *name,
                           weft_error *err)
{
    if (!run->first_name) {
        run->first_name = name;
        run->width = picture->width;
        run->height = picture->height;
    }
    if (picture->width == run->width && picture->height == run->height)
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_MISMATCH,
                     "%s: is %dx%d, but %s is %dx%d; all pictures must come from the same camera settings",
                     name, picture->width, picture->height, run->first_name, run->width, run->height);
}

/* The widest edge is `edge_px`; a picture in which corners have lost their place is refused. */
static weft_err check_sharp(const lens_run *run, const weft_board_picture *picture, const float *corners,
                            double *edge_px, weft_error *err)
{
    double share;
    *edge_px =
        weft_board_edge_width(picture->grey, picture->width, picture->height, &run->board, corners, &share);
    if (share > BLUR_MOST)
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "the board is blurred: its edges are %.0f px wide, %.0f %% of a square (%.0f %% at most); focus, "
            "and hold it still",
            *edge_px, 100 * share, 100 * BLUR_MOST);
    return WEFT_OK;
}

static weft_err find_board(lens_run *run, const char *path, float *corners, bool *found, double *edge_px,
                           weft_error *err)
{
    weft_board_picture picture;
    WEFT_TRY(weft_board_picture_load(path, &picture, err));
    weft_err status = check_size(run, &picture, path, err);
    if (status == WEFT_OK) {
        status =
            weft_board_find(picture.grey, picture.width, picture.height, &run->board, corners, found, err);
        if (status == WEFT_OK && *found)
            status = check_sharp(run, &picture, corners, edge_px, err);
        if (status != WEFT_OK)
            weft_prefix(err, status, "%s", path);
    }
    weft_board_picture_fini(&picture);
    return status;
}

static weft_err find_boards(const weft_invocation *inv, lens_run *run, weft_error *err)
{
    weft_progress progress;
    weft_progress_begin(&progress, "looking for the board", "pictures", inv->n_operands);
    weft_err status = WEFT_OK;
    for (int i = 0; i < inv->n_operands && status == WEFT_OK; i++) {
        bool found = false;
        double edge_px = 0;
        float *const corners = corners_of(run, run->n_views);
        float *const residuals = run->residuals + (corners - run->corners);
        status = find_board(run, inv->operands[i], corners, &found, &edge_px, err);
        if (status == WEFT_OK && found)
            run->views[run->n_views++] = (weft_board_view){
                .name = inv->operands[i], .corners = corners, .edge_px = edge_px, .residuals = residuals};
        else if (status == WEFT_OK) {
            weft_warn("%s: no board of %dx%d inner corners in it; left out", inv->operands[i],
                      run->board.columns, run->board.rows);
            json_array_append_new(run->without_board, json_string(inv->operands[i]));
        }
        if (status == WEFT_OK)
            status = weft_progress_step(&progress, 1, err);
    }
    weft_progress_end(&progress);
    return status;
}

static void warn_of_weak_views(const lens_run *run)
{
    for (int i = 0; i < run->n_views; i++)
        if (run->views[i].blurred)
            weft_warn("%s: left out: blurred, its edges are %.1f px wide; was it in focus, and still?",
                      run->views[i].name, run->views[i].edge_px);
        else if (!run->views[i].used)
            weft_warn(
                "%s: left out: its corners are off by %.2f px where the others fit; was the board bent, or "
                "moved?",
                run->views[i].name, run->views[i].rms_px);
    if (run->lens.n_used < 10)
        weft_warn("only %d views; 15 make the figures more certain", run->lens.n_used);
    if (run->lens.coverage < 0.6)
        weft_warn("the boards cover %.0f %% of the frame; what the lens does elsewhere is extrapolated",
                  100 * run->lens.coverage);
}

/* Degrees between the camera's view and straight down on the table. */
static double leaning_deg(const weft_camera *camera)
{
    return acos(fmin(fmax(-camera->rotation.m[8], -1), 1)) * 57.29577951308232;
}

static weft_err fit_lens(lens_run *run, weft_error *err)
{
    if (run->n_views == 0)
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "none of the %zu pictures shows a board of %dx%d inner corners: count those where four "
            "squares meet, and give their number with --board",
            json_array_size(run->without_board), run->board.columns, run->board.rows);
    const bool had_lights = run->cal.has_lights, had_pose = run->cal.has_camera && run->cal.camera.has_pose;
    WEFT_TRY(weft_lens_fit(&run->board, run->width, run->height, run->views, run->n_views, &run->options,
                           &run->cal.camera, &run->lens, err));
    run->cal.has_camera = true;
    warn_of_weak_views(run);
    if (had_pose && !run->args->on_table)
        weft_warn("the former pose does not hold for the new lens; give --board-on-table to make it again");
    if (had_lights)
        weft_warn("the lights of %s were found with the former camera; run \"weft calibrate lights\" again",
                  run->args->output);
    return WEFT_OK;
}

static weft_err fit_pose(lens_run *run, weft_error *err)
{
    const char *const path = run->args->on_table;
    const weft_board_view view = {.name = path, .corners = corners_of(run, run->n_views)};
    bool found = false;
    double edge_px = 0;
    WEFT_TRY(find_board(run, path, view.corners, &found, &edge_px, err));
    if (!found)
        return weft_fail(err, WEFT_ERR_NODATA,
                         "%s: no board of %dx%d inner corners in it; all of the board must be seen, sharp "
                         "and flat on the table",
                         path, run->board.columns, run->board.rows);
    WEFT_TRY(weft_calibration_require_size(&run->cal, run->width, run->height, run->args->output, err));
    WEFT_TRY(weft_lens_fit_pose(&run->board, &view, run->args->origin_mm.values, &run->cal.camera,
                                &run->pose_rms_px, err));
    if (leaning_deg(&run->cal.camera) > LEANING_MOST_DEG)
        weft_warn(
            "%s: the camera looks %.0f degrees past straight down: did this board lie flat on the table?",
            path, leaning_deg(&run->cal.camera));
    return WEFT_OK;
}

static json_t *board_json(const weft_board *board)
{
    return json_pack("{s:i, s:i, s:f}", "columns", board->columns, "rows", board->rows, "square_mm",
                     board->square_mm);
}

static json_t *view_json(const lens_run *run, const weft_board_view *view)
{
    json_t *const one = json_pack("{s:s, s:f, s:b, s:f}", "image", view->name, "rms_px", view->rms_px, "used",
                                  (int)view->used, "edge_px", view->edge_px);
    if (one && !view->used)
        json_object_set_new(one, "left_out",
                            json_string(view->blurred ? "blurred" : "contradicts the others"));
    const int n = run->board.columns * run->board.rows;
    json_t *const numbers = json_array();
    for (int i = 0; view->used && i < n; i++) { /* the place to a pixel, the residual to a thousandth */
        const float *const at = view->corners + 2 * (size_t)i, *const off = view->residuals + 2 * (size_t)i;
        for (int k = 0; k < 2; k++)
            json_array_append_new(numbers, json_real(round((double)at[k])));
        for (int k = 0; k < 2; k++)
            json_array_append_new(numbers, json_real(round(1000 * (double)off[k]) / 1000));
    }
    if (view->used)
        json_object_set_new(one, "corners", numbers);
    else
        json_decref(numbers);
    return one;
}

/* The held-out errors that the choice was made by. */
static json_t *tried_json(const weft_lens_report *lens)
{
    json_t *const tried = json_array();
    for (int bent = 0; bent < 2; bent++)
        for (int m = 0; m < WEFT_LENS_N_MODELS; m++)
            if (lens->tried_px[bent][m] > 0)
                json_array_append_new(tried, json_pack("{s:s, s:b, s:f}", "model",
                                                       weft_lens_model_name((weft_lens_model_choice)m),
                                                       "bent", bent, "held_out_px", lens->tried_px[bent][m]));
    return tried;
}

static json_t *coverage_json(const weft_lens_report *lens)
{
    json_t *const map = json_array();
    for (int r = 0; r < WEFT_COVERAGE_ROWS; r++) {
        json_t *const row = json_array();
        for (int c = 0; c < WEFT_COVERAGE_COLUMNS; c++)
            json_array_append_new(row, json_integer(lens->map[r][c]));
        json_array_append_new(map, row);
    }
    return map;
}

static json_t *lens_json(const lens_run *run)
{
    const double *const s = run->lens.sigma;
    const weft_lens_opencv *opencv;
    json_t *const views = json_array();
    for (int i = 0; i < run->n_views; i++)
        json_array_append_new(views, view_json(run, &run->views[i]));
    json_t *const report =
        json_pack("{s:f, s:f, s:i, s:f, s:o, s:{s:f, s:f, s:f, s:f, s:o}, s:o, s:O}", "rms_px",
                  run->cal.camera.rms_px, "held_out_px", run->lens.held_out_px, "views_used",
                  run->lens.n_used, "coverage", run->lens.coverage, "board", board_json(&run->board), "sigma",
                  "fx", s[0], "fy", s[1], "cx", s[2], "cy", s[3], "distortion",
                  weft_json_numbers(s + 4, run->lens.model == WEFT_LENS_K1K2P1P2 ? 4
                                           : run->lens.model == WEFT_LENS_K3     ? 5
                                                                                 : 8),
                  "views", views, "without_board", run->without_board);
    if (report) {
        json_object_set_new(report, "model", json_string(weft_lens_model_name(run->lens.model)));
        json_object_set_new(report, "board_bent", json_boolean(run->lens.bent));
        json_object_set_new(report, "board_bend_mm", json_real(run->lens.bend_mm));
        json_object_set_new(report, "tried", tried_json(&run->lens));
        json_object_set_new(report, "coverage_map", coverage_json(&run->lens));
    }
    if (report && weft_lens_opencv_load(&opencv, NULL) == WEFT_OK)
        json_object_set_new(report, "opencv", json_string(opencv->version));
    return report;
}

static json_t *pose_json(const lens_run *run)
{
    return json_pack("{s:s, s:f, s:f, s:o, s:o}", "image", run->args->on_table, "rms_px", run->pose_rms_px,
                     "leaning_deg", leaning_deg(&run->cal.camera), "board", board_json(&run->board),
                     "board_origin_mm", weft_json_numbers(run->args->origin_mm.values, 2));
}

static weft_err print_result(const weft_invocation *inv, const lens_run *run, weft_error *err)
{
    const weft_camera *const c = &run->cal.camera;
    if (inv->json) {
        json_t *const result = json_pack("{s:s}", "calibration", run->args->output);
        if (result && inv->n_operands > 0)
            json_object_set(result, "lens", (json_t *)weft_calibration_get_report(&run->cal, "lens"));
        if (result && run->args->on_table)
            json_object_set(result, "pose", (json_t *)weft_calibration_get_report(&run->cal, "pose"));
        return weft_print_json(inv, result, err);
    }
    if (inv->n_operands > 0) {
        const double *const s = run->lens.sigma;
        fprintf(inv->out, "%d views, rms %.3f px (held out %.3f px), model %s, %s board", run->lens.n_used,
                c->rms_px, run->lens.held_out_px, weft_lens_model_name(run->lens.model),
                run->lens.bent ? "bent" : "flat");
        if (run->lens.bent)
            fprintf(inv->out, " (by %.2f mm)", run->lens.bend_mm);
        fputc('\n', inv->out);
        fprintf(inv->out, "fx %.2f +- %.2f, fy %.2f +- %.2f, cx %.2f +- %.2f, cy %.2f +- %.2f px\n", c->fx,
                s[0], c->fy, s[1], c->cx, s[2], c->cy, s[3]);
        fprintf(inv->out, "k1 %.5f +- %.5f, k2 %.5f +- %.5f, p1 %.6f +- %.6f, p2 %.6f +- %.6f\n",
                c->distortion[0], s[4], c->distortion[1], s[5], c->distortion[2], s[6], c->distortion[3],
                s[7]);
    }
    if (run->args->on_table)
        fprintf(inv->out,
                "pose: camera %.1f mm over the table, leaning by %.1f degrees, board met to %.3f px\n",
                weft_camera_centre(c).z, leaning_deg(c), run->pose_rms_px);
    return WEFT_OK;
}

static weft_err choose_options(lens_run *run, weft_error *err)
{
    static const char *const words[] = {"no", "yes", "auto"};
    int model = WEFT_LENS_N_MODELS, bent = 3;
    for (int m = WEFT_LENS_AUTO; m < WEFT_LENS_N_MODELS; m++)
        if (strcmp(run->args->model, weft_lens_model_name((weft_lens_model_choice)m)) == 0)
            model = m;
    for (int k = 0; k < 3; k++)
        if (strcmp(run->args->bent, words[k]) == 0)
            bent = k;
    if (model == WEFT_LENS_N_MODELS)
        return weft_fail(err, WEFT_ERR_USAGE, "--model %s: there are auto, k1k2p1p2, k1k2p1p2k3 and rational",
                         run->args->model);
    if (bent == 3)
        return weft_fail(err, WEFT_ERR_USAGE, "--bent %s: wanted auto, yes or no", run->args->bent);
    run->options = (weft_lens_options){(weft_lens_model_choice)model, bent == 2 ? -1 : bent};
    return WEFT_OK;
}

static weft_err check_args(const weft_invocation *inv, lens_run *run, weft_error *err)
{
    const lens_args *const args = run->args;
    WEFT_TRY(choose_options(run, err));
    WEFT_TRY(weft_board_check(&run->board, err));
    if (inv->n_operands == 0 && !args->on_table)
        return weft_fail(err, WEFT_ERR_USAGE, "pictures of the board are missing");
    if (args->origin_mm.n != 2)
        return weft_fail(err, WEFT_ERR_USAGE, "--board-origin-mm wants two numbers, X,Y");
    if (inv->n_operands == 0)
        WEFT_TRY(weft_calibration_require(&run->cal, WEFT_CALIBRATION_CAMERA, args->output, err));
    if (inv->n_operands > 0 && run->cal.has_camera && !inv->force)
        return weft_fail(err, WEFT_ERR_EXISTS, "%s: has a camera already; --force replaces it", args->output);
    if (inv->n_operands == 0 && run->cal.camera.has_pose && !inv->force)
        return weft_fail(err, WEFT_ERR_EXISTS, "%s: has a pose already; --force replaces it", args->output);
    return WEFT_OK;
}

static weft_err alloc_run(lens_run *run, int n, weft_error *err)
{
    const size_t corners = (size_t)run->board.columns * (size_t)run->board.rows;
    run->views = weft_alloc((size_t)n, sizeof *run->views, err);
    run->corners = weft_alloc(2 * corners * (size_t)(n + 1), sizeof *run->corners, err);
    run->residuals = weft_alloc(2 * corners * (size_t)(n + 1), sizeof *run->residuals, err);
    run->without_board = json_array();
    if (!run->views || !run->corners || !run->residuals)
        return WEFT_ERR_NOMEM;
    return run->without_board ? WEFT_OK : weft_fail(err, WEFT_ERR_NOMEM, "out of memory");
}

static weft_err do_steps(const weft_invocation *inv, lens_run *run, weft_error *err)
{
    if (inv->n_operands > 0) {
        WEFT_TRY(find_boards(inv, run, err));
        WEFT_TRY(fit_lens(run, err));
        WEFT_TRY(weft_calibration_set_report(&run->cal, "lens", lens_json(run), err));
        json_object_del(json_object_get(run->cal.other, "reports"), "pose");
    }
    if (run->args->on_table) {
        WEFT_TRY(fit_pose(run, err));
        WEFT_TRY(weft_calibration_set_report(&run->cal, "pose", pose_json(run), err));
    }
    WEFT_TRY(weft_calibration_save(run->args->output, &run->cal, err));
    return print_result(inv, run, err);
}

static weft_err run_lens(const weft_invocation *inv, const void *args, weft_error *err)
{
    lens_run run = {.args = args};
    run.board = (weft_board){run.args->board.width, run.args->board.height, run.args->square_mm};
    WEFT_TRY(weft_calibration_open(run.args->output, &run.cal, err));
    weft_err status = check_args(inv, &run, err);
    if (status == WEFT_OK)
        status = alloc_run(&run, inv->n_operands, err);
    if (status == WEFT_OK)
        status = do_steps(inv, &run, err);
    json_decref(run.without_board);
    weft_free(run.views);
    weft_free(run.corners);
    weft_free(run.residuals);
    weft_calibration_fini(&run.cal);
    return status;
}

const weft_command weft_cmd_calibrate_lens = {
    .name = "calibrate lens",
    .summary = "a chessboard: focal length, distortion and pose of the camera",
    .operands = "IMAGE...",
    .min_operands = 0,
    .max_operands = -1,
    .args_size = sizeof(lens_args),
    .fields = fields,
    .details =
        "An IMAGE is a captured set (NAME.set: its frame with all lights on, else the mean of its lights), "
        "a\n"
        "camera raw, or a PNG, TIFF or EXR picture.  Take 15 or so with the board tilted 20 to 40 degrees "
        "in\n"
        "different directions, all parts of the frame covered.  Without IMAGEs only the pose is made.\n"
        "World frame: millimetres, origin at the board's middle, X right in the picture, Y up, Z to the "
        "camera.",
    .example = "weft calibrate lens board-*.set -o scanner.cal --square-mm 10 --board-on-table table.set",
    .run = run_lens,
};
