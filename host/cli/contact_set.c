#include "host/cli/contact_set.h"

#include "core/file.h"
#include "core/mem.h"
#include "core/progress.h"
#include "host/set/plate.h"

#include <assert.h>
#include <stdio.h>

/* What a tile needs of a frame: small, linear, light per second. */
typedef struct thumb {
    weft_image image; /* 3 planes */
    double mean[3];
    double bright; /* 99 % of the green values are below */
} thumb;

bool weft_contact_is_set(const char *path)
{
    char *const file = weft_path_join(path, "set.json", NULL);
    const bool found = (file && weft_file_exists(file)) || weft_path_has_suffix(path, "set.json");
    weft_free(file);
    return found;
}

int weft_contact_set_rows(const weft_set *set, int columns)
{
    return (set->n_frames + columns - 1) / columns;
}

static weft_err load_thumb(const weft_set *set, int frame, const weft_sheet *sheet, thumb *t, weft_error *err)
{
    weft_plate plate = {0}, rgb = {0};
    WEFT_TRY(weft_plate_load_frame(set, frame, &plate, err));
    weft_err status = weft_plate_demosaic(&plate, WEFT_DEMOSAIC_HALF, &rgb, err);
    weft_plate_fini(&plate);
    WEFT_TRY(status);
    const double wide = (double)sheet->tile_width / rgb.image.width;
    const double high = (double)sheet->tile_height / rgb.image.height, scale = wide < high ? wide : high;
    const int width = (int)(rgb.image.width * scale), height = (int)(rgb.image.height * scale);
    status = weft_image_scale(&t->image, &rgb.image, width > 0 ? width : 1, height > 0 ? height : 1, err);
    weft_plate_fini(&rgb);
    WEFT_TRY(status);
    const size_t n = weft_image_plane_size(&t->image);
    for (int c = 0; c < 3; c++) {
        for (size_t i = 0; i < n; i++)
            t->mean[c] += (double)weft_image_plane(&t->image, c)[i] / (double)n;
    }
    return weft_image_quantile(&t->image, 1, NULL, 0.99, &t->bright, err);
}

/* Gains that make the lights' frames grey on the whole and the brightest just white. */
static void find_gains(const weft_set *set, const thumb *thumbs, double gain[3])
{
    double sum[3] = {0}, bright = 0;
    for (int i = 0; i < set->n_frames; i++) {
        if (set->frames[i].role != WEFT_ROLE_LIGHT && set->frames[i].role != WEFT_ROLE_ALL)
            continue;
        bright = thumbs[i].bright > bright ? thumbs[i].bright : bright;
        for (int c = 0; c < 3; c++)
            sum[c] += thumbs[i].mean[c];
    }
    for (int c = 0; c < 3; c++)
        gain[c] = (bright > 0 ? 1 / bright : 1) * (sum[c] > 0 && sum[1] > 0 ? sum[1] / sum[c] : 1);
}

static void label_of(const weft_set_frame *frame, char label[64])
{
    if (frame->role == WEFT_ROLE_LIGHT)
        snprintf(label, 64, "light %d, %g s", frame->light, frame->exposure_s);
    else
        snprintf(label, 64, "%s, %g s", weft_frame_role_name(frame->role), frame->exposure_s);
}

/* The lights come first, each kind in the order of the set. */
static int frame_of_tile(const weft_set *set, int tile)
{
    for (int lights = 1; lights >= 0; lights--)
        for (int i = 0; i < set->n_frames; i++)
            if ((set->frames[i].role == WEFT_ROLE_LIGHT) == lights && tile-- == 0)
                return i;
    assert(!"a tile for each frame");
    return 0;
}

static weft_err place_thumbs(weft_sheet *sheet, int first_row, const weft_set *set, thumb *thumbs,
                             weft_error *err)
{
    double gain[3];
    char label[64];
    find_gains(set, thumbs, gain);
    for (int tile = 0; tile < set->n_frames; tile++) {
        const int i = frame_of_tile(set, tile);
        weft_image *const image = &thumbs[i].image;
        for (int c = 0; c < 3; c++)
            for (size_t k = 0; k < weft_image_plane_size(image); k++)
                weft_image_plane(image, c)[k] *= (float)gain[c];
        label_of(&set->frames[i], label);
        WEFT_TRY(weft_sheet_place(sheet, tile % sheet->columns, first_row + tile / sheet->columns, image,
                                  label, err));
    }
    return WEFT_OK;
}

weft_err weft_contact_set(weft_sheet *sheet, int first_row, const weft_set *set, weft_error *err)
{
    thumb *const thumbs = weft_alloc((size_t)set->n_frames, sizeof *thumbs, err);
    weft_err status = thumbs ? WEFT_OK : WEFT_ERR_NOMEM;
    weft_progress progress;
    weft_progress_begin(&progress, "frames", "frames", set->n_frames);
    for (int i = 0; i < set->n_frames && status == WEFT_OK; i++) {
        status = load_thumb(set, i, sheet, &thumbs[i], err);
        if (status == WEFT_OK)
            status = weft_progress_step(&progress, 1, err);
    }
    weft_progress_end(&progress);
    if (status == WEFT_OK)
        status = place_thumbs(sheet, first_row, set, thumbs, err);
    for (int i = 0; thumbs && i < set->n_frames; i++)
        weft_image_fini(&thumbs[i].image);
    weft_free(thumbs);
    return status;
}
