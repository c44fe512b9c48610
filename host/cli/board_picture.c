#include "host/cli/board_picture.h"

#include "calibration/lens/lens_fit.h"
#include "core/file.h"
#include "core/formats/image_file.h"
#include "core/formats/raw_file.h"
#include "core/mem.h"
#include "host/set/plate.h"

#include <string.h>

void weft_board_picture_fini(weft_board_picture *picture)
{
    weft_free(picture->grey);
    *picture = (weft_board_picture){0};
}

static weft_err make_grey(const weft_image *image, weft_cfa cfa, weft_board_picture *picture, weft_error *err)
{
    weft_board_picture made = {image->width, image->height, NULL};
    made.grey = weft_alloc(weft_image_plane_size(image), 1, err);
    if (!made.grey)
        return WEFT_ERR_NOMEM;
    weft_board_grey(image, cfa, made.grey);
    *picture = made;
    return WEFT_OK;
}

static weft_err load_raw(const char *path, weft_board_picture *picture, weft_error *err)
{
    weft_mosaic mosaic;
    weft_frame_info info;
    weft_image image = {0};
    WEFT_TRY(weft_raw_read(path, &mosaic, &info, err));
    weft_err status = weft_image_init(&image, mosaic.width, mosaic.height, 1, err);
    if (status == WEFT_OK) {
        const size_t n = weft_image_plane_size(&image);
        for (size_t i = 0; i < n; i++)
            image.data[i] = (float)mosaic.data[i];
        status = make_grey(&image, mosaic.cfa, picture, err);
    }
    weft_image_fini(&image);
    weft_mosaic_fini(&mosaic);
    return status;
}

static weft_err load_file(const char *path, weft_board_picture *picture, weft_error *err)
{
    weft_image image;
    if (weft_raw_is_name(path))
        return load_raw(path, picture, err);
    /* Where the corners are does not depend on the transfer curve. */
    WEFT_TRY(weft_image_read(path, WEFT_TRANSFER_LINEAR, &image, err));
    const weft_err status = make_grey(&image, WEFT_CFA_NONE, picture, err);
    weft_image_fini(&image);
    return status;
}

static int frame_with_all_lights(const weft_set *set)
{
    for (int i = 0; i < set->n_frames; i++)
        if (set->frames[i].role == WEFT_ROLE_ALL)
            return i;
    return -1;
}

/* The sum of the lights' plates: grey is stretched afterwards, so the number of them does not matter. */
static weft_err add_lights(const weft_set *set, weft_plate *sum, weft_error *err)
{
    const int n = weft_set_n_lights(set);
    if (n == 0)
        return weft_fail(err, WEFT_ERR_MISSING, "%s: has no frame with lights on", set->folder);
    for (int light = 0; light < n; light++) {
        weft_plate plate;
        WEFT_TRY(weft_plate_load_light(set, light, NULL, &plate, err));
        if (light == 0) {
            *sum = plate;
            continue;
        }
        const size_t values = weft_image_plane_size(&sum->image) * (size_t)sum->image.planes;
        for (size_t i = 0; i < values; i++)
            sum->image.data[i] += plate.image.data[i];
        weft_plate_fini(&plate);
    }
    return WEFT_OK;
}

static weft_err load_set(const char *path, weft_board_picture *picture, weft_error *err)
{
    weft_set set;
    weft_plate plate = {0};
    WEFT_TRY(weft_set_load(path, &set, err));
    const int all = frame_with_all_lights(&set);
    weft_err status =
        all >= 0 ? weft_plate_load_frame(&set, all, &plate, err) : add_lights(&set, &plate, err);
    if (status == WEFT_OK)
        status = make_grey(&plate.image, plate.cfa, picture, err);
    weft_plate_fini(&plate);
    weft_set_fini(&set);
    return status;
}

weft_err weft_board_picture_load(const char *path, weft_board_picture *picture, weft_error *err)
{
    if (weft_folder_exists(path) || strcmp(weft_path_name(path), "set.json") == 0)
        return load_set(path, picture, err);
    return load_file(path, picture, err);
}
