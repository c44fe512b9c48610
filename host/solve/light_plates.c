#include "host/solve/light_plates.h"

#include "core/progress.h"

/* Rows that the demosaicing looks at above and below; even, so that the CFA keeps its phase. */
enum { MARGIN = 4 };

static void free_colour(weft_light_plates *p)
{
    for (int j = 0; j < p->n; j++) {
        weft_plate_fini(&p->colour[j]);
        p->colour[j] = (weft_plate){0};
    }
}

void weft_light_plates_fini(weft_light_plates *p)
{
    free_colour(p);
    for (int j = 0; j < p->n; j++)
        weft_plate_fini(&p->plate[j]);
    *p = (weft_light_plates){0};
}

/* Pictures without a mosaic at half size: averaged at once. */
static weft_err halve(weft_plate *plate, weft_error *err)
{
    weft_plate half = {0};
    WEFT_TRY(weft_plate_demosaic(plate, WEFT_DEMOSAIC_HALF, &half, err));
    half.noise_floor = plate->noise_floor;
    weft_plate_fini(plate);
    *plate = half;
    return WEFT_OK;
}

static weft_err load_light(const weft_set *set, int light, const weft_plate *ambient, bool half,
                           weft_plate *plate, weft_error *err)
{
    WEFT_TRY(weft_plate_load_light(set, light, ambient, plate, err));
    if (plate->image.width != set->width || plate->image.height != set->height)
        return weft_fail(err, WEFT_ERR_MISMATCH, "%s: light %d has %d x %d pixels, the set says %d x %d",
                         set->folder, light, plate->image.width, plate->image.height, set->width,
                         set->height);
    return plate->cfa == WEFT_CFA_NONE && half ? halve(plate, err) : WEFT_OK;
}

weft_err weft_light_plates_load(const weft_set *set, bool half, weft_light_plates *p, weft_error *err)
{
    weft_plate ambient = {0};
    bool present = false;
    weft_progress progress;
    const int n = weft_set_n_lights(set);
    WEFT_TRY(weft_plate_load_ambient(set, &ambient, &present, err));
    weft_err status = WEFT_OK;
    weft_progress_begin(&progress, "reading", "lights", n);
    while (p->n < n && status == WEFT_OK) {
        weft_plate *const plate = &p->plate[p->n];
        p->n++; /* a plate that fails half way is freed with the others */
        status = load_light(set, p->n - 1, present ? &ambient : NULL, half, plate, err);
        if (status == WEFT_OK)
            status = weft_progress_step(&progress, 1, err);
    }
    weft_progress_end(&progress);
    weft_plate_fini(&ambient);
    for (int j = 1; j < p->n && status == WEFT_OK; j++)
        if (p->plate[j].cfa != p->plate[0].cfa)
            status = weft_fail(err, WEFT_ERR_MISMATCH, "%s: light %d is %s, light 0 is %s", set->folder, j,
                               weft_cfa_name(p->plate[j].cfa), weft_cfa_name(p->plate[0].cfa));
    if (status != WEFT_OK)
        weft_light_plates_fini(p);
    else
        p->mosaic = p->plate[0].cfa != WEFT_CFA_NONE;
    return status;
}

/* Rows of a mosaic as a plate of their own; nothing is copied. */
static weft_plate view_rows(const weft_plate *whole, int first, int n)
{
    const size_t skip = (size_t)first * (size_t)whole->image.width;
    weft_plate view = *whole;
    view.image.height = n;
    view.image.data += skip;
    if (view.clipped.data) {
        view.clipped.height = n;
        view.clipped.data += skip;
    }
    return view;
}

weft_err weft_light_plates_make_band(weft_light_plates *p, int first, int n, bool half, weft_error *err)
{
    if (!p->mosaic)
        return WEFT_OK;
    free_colour(p);
    const int height = p->plate[0].image.height;
    const int scale = half ? 2 : 1, margin = half ? 0 : MARGIN;
    const int top = first * scale - margin > 0 ? first * scale - margin : 0;
    const int bottom = (first + n) * scale + margin < height ? (first + n) * scale + margin : height;
    p->colour_row = top / scale;
    for (int j = 0; j < p->n; j++) {
        const weft_plate view = view_rows(&p->plate[j], top, bottom - top);
        WEFT_TRY(
            weft_plate_demosaic(&view, half ? WEFT_DEMOSAIC_HALF : WEFT_DEMOSAIC_LINEAR, &p->colour[j], err));
    }
    return WEFT_OK;
}

void weft_light_plates_row(const weft_light_plates *plates, int row, weft_solve_row_in in[WEFT_LIGHTS_MAX])
{
    for (int j = 0; j < plates->n; j++) {
        const weft_plate *const p = plates->mosaic ? &plates->colour[j] : &plates->plate[j];
        const int y = plates->mosaic ? row - plates->colour_row : row;
        for (int c = 0; c < 3; c++)
            in[j].rgb[c] = weft_image_row(&p->image, p->image.planes == 3 ? c : 0, y);
        in[j].clipped = p->clipped.data ? p->clipped.data + (size_t)y * (size_t)p->clipped.width : NULL;
        in[j].least = (float)(3 * plates->plate[j].noise_floor);
    }
}
