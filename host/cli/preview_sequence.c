#include "host/cli/preview_sequence.h"

#include "core/file.h"
#include "core/formats/image_file.h"
#include "core/formats/png_file.h"
#include "core/formats/webp_file.h"
#include "core/json.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/sha256.h"
#include "core/version.h"
#include "shading/brdf/half_vector.h"
#include "shading/preview/preview_history.h"

#include <string.h>
#include <unistd.h>

/* A run of a sequence. */
typedef struct run {
    const weft_preview_sequence *sequence;
    const weft_preview_surface *surface;
    const weft_preview_view *view;
    bool webp;
    char *stem;      /* of the frames: "dir/ball-" or "dir/ball.webp.frames/" */
    char *extension; /* ".png" */
    char *note, *folder;
    char key[65];
} run;

/* ---- what decides the pictures ---- */

static void add_number(weft_sha256 *hash, double value)
{
    char text[40];
    const int n = snprintf(text, sizeof text, "%.17g;", value);
    weft_sha256_update(hash, text, (size_t)n);
}

static void add_numbers(weft_sha256 *hash, int n, const double *values)
{
    for (int i = 0; i < n; i++)
        add_number(hash, values[i]);
}

static void add_image(weft_sha256 *hash, const weft_image *image)
{
    add_number(hash, image && image->data ? image->planes : 0);
    if (image && image->data)
        weft_sha256_update(hash, image->data,
                           weft_image_plane_size(image) * (size_t)image->planes * sizeof *image->data);
}

static void add_surface(weft_sha256 *hash, const weft_preview_surface *surface)
{
    const double numbers[] = {surface->width, surface->height, surface->mm_per_px, surface->origin_mm[0],
                              surface->origin_mm[1]};
    add_numbers(hash, 5, numbers);
    add_image(hash, surface->normal);
    add_image(hash, surface->height_mm);
    if (surface->mask)
        weft_sha256_update(hash, surface->mask->data,
                           (size_t)surface->mask->width * (size_t)surface->mask->height);
    weft_sha256_update(hash, surface->brdf->name, strlen(surface->brdf->name));
    add_numbers(hash, weft_brdf_n_planes(surface->brdf), surface->params);
    for (int k = 0; k < weft_brdf_n_planes(surface->brdf); k++) {
        const weft_preview_map map = surface->maps[k];
        add_number(hash, map.image ? map.plane : -1);
        if (map.image)
            weft_sha256_update(hash, weft_image_plane(map.image, map.plane),
                               weft_image_plane_size(map.image) * sizeof *map.image->data);
    }
}

static void add_view(weft_sha256 *hash, const weft_preview_view *view)
{
    const weft_preview_shadows *const shadows = &view->shadows;
    const double numbers[] = {view->width,      view->height,         view->shape,       view->ambient,
                              view->background, view->exposure_ev,    view->repeat,      view->crop.x,
                              view->crop.y,     view->crop.width,     view->crop.height, view->draft,
                              view->fov_deg,    view->turn_rad,       view->filter,      view->max_taps,
                              shadows->relief,  shadows->blur,        shadows->steps,    shadows->folds,
                              shadows->voxels,  shadows->voxel_steps, shadows->phase,    view->fog.depth,
                              view->fog.g,      view->fog.steps,      view->fog.even,    view->n_lights};
    add_numbers(hash, (int)(sizeof numbers / sizeof numbers[0]), numbers);
    for (int k = 0; k < view->n_lights; k++) {
        const weft_preview_light *const light = &view->lights[k];
        add_number(hash, light->kind);
        add_number(hash, light->area);
        add_numbers(hash, 3, light->direction);
        add_numbers(hash, 3, light->position_mm);
        add_numbers(hash, 3, light->end_mm);
        add_number(hash, light->radius_mm);
        add_numbers(hash, 3, light->irradiance);
    }
    if (view->surroundings.map) {
        add_number(hash, view->surroundings.scale);
        add_image(hash, &view->surroundings.map->levels[0]);
        for (int c = 0; c < 3; c++)
            add_numbers(hash, WEFT_SH_COUNT, view->surroundings.map->light[c]);
    }
}

static void find_key(run *r)
{
    weft_sha256 hash;
    weft_sha256_init(&hash);
    weft_sha256_update(&hash, WEFT_VERSION, strlen(WEFT_VERSION));
    add_number(&hash, r->sequence->n_frames);
    add_number(&hash, r->sequence->turntable);
    add_number(&hash, r->sequence->tone);
    add_number(&hash, r->sequence->temporal);
    add_number(&hash, r->view->shadows.accumulate);
    add_number(&hash, r->view->shadows.disc_rad);
    add_surface(&hash, r->surface);
    add_view(&hash, r->view);
    weft_sha256_final_hex(&hash, r->key);
}

/* ---- files ---- */

static void run_fini(run *r)
{
    weft_free(r->stem);
    weft_free(r->extension);
    weft_free(r->note);
    weft_free(r->folder);
}

static weft_err run_init(run *r, const weft_preview_sequence *sequence, const weft_preview_surface *surface,
                         const weft_preview_view *view, weft_error *err)
{
    const char *const dot = strrchr(weft_path_name(sequence->output), '.');
    const int stem = (int)(dot ? (size_t)(dot - sequence->output) : strlen(sequence->output));
    *r = (run){.sequence = sequence,
               .surface = surface,
               .view = view,
               .webp = weft_path_has_suffix(sequence->output, ".webp")};
    if (r->webp) {
        r->folder = weft_asprintf(err, "%s.frames", sequence->output);
        r->stem = weft_asprintf(err, "%s.frames/", sequence->output);
        r->extension = weft_strdup(".png", err);
        r->note = weft_asprintf(err, "%s.frames/sequence.json", sequence->output);
    } else {
        r->stem = weft_asprintf(err, "%.*s-", stem, sequence->output);
        r->extension = weft_strdup(dot ? dot : "", err);
        r->note = weft_asprintf(err, "%.*s.sequence.json", stem, sequence->output);
    }
    find_key(r);
    if (r->stem && r->extension && r->note && (r->folder || !r->webp))
        return WEFT_OK;
    run_fini(r);
    return WEFT_ERR_NOMEM;
}

static char *frame_path(const run *r, int frame, weft_error *err)
{
    return weft_asprintf(err, "%s%03d%s", r->stem, frame, r->extension);
}

/* Whether the note is there; WEFT_ERR_MISMATCH when it is of other options. */
static weft_err read_note(const run *r, bool *found, weft_error *err)
{
    json_t *note = NULL;
    const char *key = NULL;
    *found = weft_file_exists(r->note);
    if (!*found)
        return WEFT_OK;
    WEFT_TRY(weft_json_load_kind(r->note, "sequence", 1, &note, err));
    weft_err status = weft_json_get_text(note, "key", WEFT_JSON_REQUIRED, &key, r->note, err);
    if (status == WEFT_OK && strcmp(key, r->key) != 0)
        status = weft_fail(err, WEFT_ERR_MISMATCH,
                           "%s: the frames there were made with other options or maps; give those again, or "
                           "--force without --resume to begin anew",
                           r->note);
    json_decref(note);
    return status;
}

static weft_err write_note(const run *r, weft_error *err)
{
    json_t *const note = json_pack("{s:s, s:i, s:s, s:i}", "weft", "sequence", "version", 1, "key", r->key,
                                   "frames", r->sequence->n_frames);
    if (!note)
        return weft_fail(err, WEFT_ERR_NOMEM, "no memory for %s", r->note);
    const weft_err status = weft_json_save(r->note, note, err);
    json_decref(note);
    return status;
}

/* A new sequence: nothing of an old one may stay, lest a later --resume takes it for its own. */
static weft_err clear_frames(const run *r, bool force, weft_error *err)
{
    if (r->webp && weft_folder_exists(r->folder)) {
        if (!force)
            return weft_fail(
                err, WEFT_ERR_EXISTS,
                "%s: an interrupted run has left frames; --resume goes on with them, --force begins "
                "anew",
                r->folder);
        return weft_folder_remove(r->folder, err);
    }
    for (int pass = 0; pass < 2; pass++) /* first refuse, then remove */
        for (int frame = 0; frame < r->sequence->n_frames; frame++) {
            char *const path = frame_path(r, frame, err);
            if (!path)
                return WEFT_ERR_NOMEM;
            weft_err status = WEFT_OK;
            if (pass == 0)
                status = weft_file_refuse_existing(path, force, err);
            else
                unlink(path);
            weft_free(path);
            WEFT_TRY(status);
        }
    return WEFT_OK;
}

static weft_err begin(const run *r, bool force, weft_error *err)
{
    bool found = false;
    if (r->webp)
        WEFT_TRY(weft_file_refuse_existing(r->sequence->output, force, err));
    if (r->sequence->resume)
        WEFT_TRY(read_note(r, &found, err));
    if (found)
        return WEFT_OK;
    WEFT_TRY(clear_frames(r, force, err));
    if (r->webp)
        WEFT_TRY(weft_folder_create(r->folder, err));
    return write_note(r, err);
}

/* ---- pictures ---- */

static void turn(double v[3], double angle)
{
    const double x = v[0], y = v[1];
    v[0] = cos(angle) * x - sin(angle) * y;
    v[1] = sin(angle) * x + cos(angle) * y;
}

/* The view of a frame. */
static weft_preview_view view_of(const run *r, int frame)
{
    weft_preview_view view = *r->view;
    const double angle = 2 * WEFT_PI * frame / r->sequence->n_frames;
    if (r->sequence->turntable)
        view.turn_rad += angle;
    for (int k = 0; k < view.n_lights && !r->sequence->turntable; k++) {
        turn(view.lights[k].direction, angle);
        turn(view.lights[k].position_mm, angle);
        turn(view.lights[k].end_mm, angle);
    }
    return view;
}

static weft_err render_frame(const run *r, const weft_preview_view *view, const char *path,
                             weft_preview_sequence_report *report, weft_error *err)
{
    weft_image picture;
    const double began_s = weft_clock_s();
    WEFT_TRY(weft_preview_render(r->surface, view, &picture, err));
    report->seconds += weft_clock_s() - began_s;
    report->rendered++;
    weft_tone_image(r->sequence->tone, &picture);
    const weft_err status = weft_image_write(path, &picture, 8, WEFT_TRANSFER_SRGB, err);
    weft_image_fini(&picture);
    return status;
}

static weft_err render_frames(const run *r, weft_preview_sequence_report *report, weft_error *err)
{
    weft_progress progress;
    weft_preview_history history = {0};
    weft_err status = WEFT_OK;
    weft_progress_begin(&progress, r->sequence->turntable ? "turntable" : "sweep", "frames",
                        r->sequence->n_frames);
    weft_progress_hide(true);
    for (int frame = 0; frame < r->sequence->n_frames && status == WEFT_OK; frame++) {
        char *const path = frame_path(r, frame, err);
        const bool kept = path && weft_file_exists(path);
        weft_preview_view view = view_of(r, frame);
        view.shadows.history = r->sequence->temporal ? &history : NULL;
        if (!path)
            status = WEFT_ERR_NOMEM;
        else if (!kept)
            status = render_frame(r, &view, path, report, err);
        else if (view.shadows.history) /* later frames shall be what they would have been */
            status = weft_preview_remember(r->surface, &view, err);
        report->kept += kept;
        weft_free(path);
        if (status == WEFT_OK)
            status = weft_progress_step(&progress, 1, err);
    }
    weft_preview_history_fini(&history);
    weft_progress_hide(false);
    weft_progress_end(&progress);
    return status;
}

static weft_err add_frame(const run *r, int frame, weft_webp *webp, weft_error *err)
{
    weft_raster picture;
    char *const path = frame_path(r, frame, err);
    weft_err status = path ? weft_png_read(path, &picture, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK) {
        status = weft_webp_add(webp, &picture, err);
        weft_raster_fini(&picture);
    }
    weft_free(path);
    return status;
}

static weft_err assemble(const run *r, weft_error *err)
{
    weft_webp *webp;
    weft_progress progress;
    const weft_preview_sequence *const sequence = r->sequence;
    WEFT_TRY(weft_webp_begin(&webp, r->view->width, r->view->height, sequence->frames_per_s,
                             sequence->quality, err));
    weft_err status = WEFT_OK;
    weft_progress_begin(&progress, "compressing", "frames", sequence->n_frames);
    for (int frame = 0; frame < sequence->n_frames && status == WEFT_OK; frame++) {
        status = add_frame(r, frame, webp, err);
        if (status == WEFT_OK)
            status = weft_progress_step(&progress, 1, err);
    }
    weft_progress_end(&progress);
    if (status == WEFT_OK)
        status = weft_webp_write(webp, sequence->output, err);
    weft_webp_destroy(webp);
    return status == WEFT_OK ? weft_folder_remove(r->folder, err) : status;
}

weft_err weft_preview_sequence_render(const weft_invocation *inv, const weft_preview_sequence *sequence,
                                      const weft_preview_surface *surface, const weft_preview_view *view,
                                      weft_preview_sequence_report *report, weft_error *err)
{
    run r;
    *report = (weft_preview_sequence_report){0};
    WEFT_TRY(run_init(&r, sequence, surface, view, err));
    weft_err status = begin(&r, inv->force, err);
    if (status == WEFT_OK)
        status = render_frames(&r, report, err);
    if (status == WEFT_OK && r.webp)
        status = assemble(&r, err);
    run_fini(&r);
    return status;
}
