#include "host/cli/command.h"
#include "host/cli/contact_set.h"
#include "host/cli/preview_input.h"

#include "core/file.h"
#include "core/formats/image_file.h"
#include "core/mem.h"
#include "core/text.h"
#include "shading/preview/sheet.h"

#include <math.h>
#include <string.h>

enum { COLUMNS = 5, ROWS_PER_INPUT = 2, N_LIGHTS = 3 };

typedef struct contact_args {
    const char *output, *brdf;
    weft_texts params;
    weft_numbers lights;
    weft_size tile;
    double exposure_ev, repeat;
} contact_args;

static const weft_field fields[] = {
    {.key = "output",
     .short_opt = 'o',
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(contact_args, output),
     .unit = "IMAGE",
     .required = true,
     .help = "picture to write: PNG or TIFF in sRGB, EXR linear"},
    {.key = "brdf",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(contact_args, brdf),
     .unit = "NAME",
     .def = "lambert",
     .help = "reflectance model of the previews; \"weft brdf\" lists them"},
    {.key = "param",
     .short_opt = 'p',
     .type = WEFT_FIELD_TEXTS,
     .offset = offsetof(contact_args, params),
     .unit = "NAME=VALUE",
     .help = "a parameter of the model: a number or r,g,b; may be given several times"},
    {.key = "lights",
     .type = WEFT_FIELD_F64S,
     .offset = offsetof(contact_args, lights),
     .unit = "AZ,EL,AZ,EL,AZ,EL",
     .def = "0,30,120,30,240,30",
     .help = "the three lights over the plane, in degrees"},
    {.key = "tile",
     .type = WEFT_FIELD_SIZE,
     .offset = offsetof(contact_args, tile),
     .def = "420x280",
     .help = "of one picture of the sheet"},
    {.key = "exposure",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(contact_args, exposure_ev),
     .unit = "EV",
     .min = -20,
     .max = 20,
     .def = "0.5",
     .help = "of the previews; at 0 a white card that faces the light is just white"},
    {.key = "repeat",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(contact_args, repeat),
     .min = 0.01,
     .max = 100,
     .def = "1",
     .help = "ball: how often the shorter side of the map fits half round"},
    {0},
};

/* One input's block of tiles. */
typedef struct block {
    weft_sheet *sheet;
    int first_row;
    const contact_args *args;
    const weft_preview_input *input;
    weft_preview_crop detail; /* pixels from the middle of the sample, as many as a tile has */
} block;

static weft_err place(const block *b, int tile, const weft_image *picture, const char *label, weft_error *err)
{
    return weft_sheet_place(b->sheet, tile % COLUMNS, b->first_row + tile / COLUMNS, picture, label, err);
}

static weft_err place_and_release(const block *b, int tile, weft_image *picture, const char *label,
                                  weft_error *err)
{
    const weft_err status = place(b, tile, picture, label, err);
    weft_image_fini(picture);
    return status;
}

static weft_err place_albedo(const block *b, int tile, weft_error *err)
{
    const weft_maps *const maps = &b->input->maps;
    weft_image picture;
    WEFT_TRY(weft_sheet_show_colour(&picture, &maps->albedo, maps->mask.data ? &maps->mask : NULL, err));
    return place_and_release(b, tile, &picture, maps->albedo_is_srgb ? "albedo" : "albedo (camera colours)",
                             err);
}

static weft_err place_normal(const block *b, int tile, weft_error *err)
{
    weft_image picture;
    WEFT_TRY(weft_sheet_show_normals(&picture, &b->input->maps.normal, err));
    return place_and_release(b, tile, &picture, "normal", err);
}

static weft_err place_residual(const block *b, int tile, weft_error *err)
{
    const weft_maps *const maps = &b->input->maps;
    const weft_mask *const mask = maps->mask.data ? &maps->mask : NULL;
    weft_image picture;
    double median, top;
    char label[64];
    WEFT_TRY(weft_image_quantile(&maps->residual, 0, mask, 0.5, &median, err));
    WEFT_TRY(weft_image_quantile(&maps->residual, 0, mask, 0.99, &top, err));
    WEFT_TRY(weft_sheet_show_scalar(&picture, &maps->residual, mask, 0, top, err));
    snprintf(label, sizeof label, "residual 0..%.2g%% med %.2g%%", 100 * top, 100 * median);
    return place_and_release(b, tile, &picture, label, err);
}

static weft_err place_confidence(const block *b, int tile, weft_error *err)
{
    const weft_maps *const maps = &b->input->maps;
    weft_image picture;
    WEFT_TRY(
        weft_sheet_show_scalar(&picture, &maps->confidence, maps->mask.data ? &maps->mask : NULL, 0, 1, err));
    return place_and_release(b, tile, &picture, "confidence 0..1", err);
}

static weft_err place_normal_detail(const block *b, int tile, weft_error *err)
{
    const weft_preview_crop d = b->detail;
    weft_image part, picture;
    WEFT_TRY(weft_image_crop(&part, &b->input->maps.normal, d.x, d.y, d.width, d.height, err));
    const weft_err status = weft_sheet_show_normals(&picture, &part, err);
    weft_image_fini(&part);
    WEFT_TRY(status);
    return place_and_release(b, tile, &picture, "normal, pixel by pixel", err);
}

/* The middle of what is shown, as many pixels as a tile has. */
static weft_err find_detail(block *b, weft_error *err)
{
    weft_preview_crop whole;
    WEFT_TRY(weft_preview_whole(&b->input->surface, &whole, err));
    const int width = b->args->tile.width < whole.width ? b->args->tile.width : whole.width;
    const int height = b->args->tile.height < whole.height ? b->args->tile.height : whole.height;
    b->detail = (weft_preview_crop){whole.x + (whole.width - width) / 2,
                                    whole.y + (whole.height - height) / 2, width, height};
    return WEFT_OK;
}

static weft_err place_preview(const block *b, int tile, weft_preview_shape shape, const double angles[2],
                              const weft_preview_crop *detail, weft_error *err)
{
    weft_preview_view view = weft_preview_view_defaults();
    weft_image picture;
    char label[64];
    view.shape = shape;
    view.width = b->args->tile.width;
    view.height = b->args->tile.height;
    view.exposure_ev = b->args->exposure_ev;
    view.ambient = 0.02;
    view.background = shape == WEFT_PREVIEW_SPHERE ? WEFT_SHEET_NONE : WEFT_SHEET_GROUND;
    view.repeat = b->args->repeat;
    if (detail)
        view.crop = *detail;
    weft_preview_direction(angles[0], angles[1], view.lights[0].direction);
    WEFT_TRY(weft_preview_render(&b->input->surface, &view, &picture, err));
    snprintf(label, sizeof label, "%s, light %g, %g",
             shape == WEFT_PREVIEW_SPHERE ? "ball"
             : detail                     ? "detail"
                                          : b->input->surface.brdf->name,
             angles[0], angles[1]);
    return place_and_release(b, tile, &picture, label, err);
}

/* Maps above, previews below; what the folder does not have stays empty. */
static weft_err fill_block(block *b, weft_error *err)
{
    static const double upper_left[2] = {135, 40}; /* as in most pictures of materials */
    const weft_maps *const maps = &b->input->maps;
    WEFT_TRY(find_detail(b, err));
    if (maps->albedo.planes)
        WEFT_TRY(place_albedo(b, 0, err));
    if (maps->normal.planes) {
        WEFT_TRY(place_normal(b, 1, err));
        WEFT_TRY(place_normal_detail(b, 2, err));
    }
    if (maps->residual.planes)
        WEFT_TRY(place_residual(b, 3, err));
    if (maps->confidence.planes)
        WEFT_TRY(place_confidence(b, 4, err));
    for (int light = 0; light < N_LIGHTS; light++)
        WEFT_TRY(place_preview(b, COLUMNS + light, WEFT_PREVIEW_PLANE,
                               b->args->lights.values + (size_t)2 * (size_t)light, NULL, err));
    WEFT_TRY(place_preview(b, COLUMNS + N_LIGHTS, WEFT_PREVIEW_PLANE, upper_left, &b->detail, err));
    return place_preview(b, COLUMNS + N_LIGHTS + 1, WEFT_PREVIEW_SPHERE, upper_left, NULL, err);
}

/* The names of the inputs, each once when a set and its maps follow each other. */
static char *sheet_title(const weft_invocation *inv, weft_error *err)
{
    char *title = weft_strdup("", err), *last = NULL;
    for (int i = 0; i < inv->n_operands && title; i++) {
        char *const name = weft_preview_title(inv->operands[i], err);
        const bool again = name && last && strcmp(name, last) == 0;
        char *const longer =
            name ? weft_asprintf(err, "%s%s%s", title, last && !again ? ", " : "", again ? "" : name) : NULL;
        weft_free(last);
        last = name;
        weft_free(title);
        title = longer;
    }
    weft_free(last);
    return title;
}

static weft_err count_rows(const weft_invocation *inv, int *rows, weft_error *err)
{
    *rows = 0;
    for (int i = 0; i < inv->n_operands; i++) {
        weft_set set;
        if (!weft_contact_is_set(inv->operands[i])) {
            *rows += ROWS_PER_INPUT;
            continue;
        }
        WEFT_TRY(weft_set_load(inv->operands[i], &set, err));
        *rows += weft_contact_set_rows(&set, COLUMNS);
        weft_set_fini(&set);
    }
    return WEFT_OK;
}

static weft_err fill_maps(const char *path, const contact_args *a, weft_sheet *sheet, int *row,
                          weft_error *err)
{
    weft_preview_input input;
    WEFT_TRY(weft_preview_input_load(&input, path, a->brdf, &a->params, err));
    const weft_err status =
        fill_block(&(block){.sheet = sheet, .first_row = *row, .args = a, .input = &input}, err);
    weft_preview_input_fini(&input);
    *row += ROWS_PER_INPUT;
    return status == WEFT_OK ? WEFT_OK : weft_prefix(err, status, "%s", path);
}

static weft_err fill_set(const char *path, weft_sheet *sheet, int *row, weft_error *err)
{
    weft_set set;
    WEFT_TRY(weft_set_load(path, &set, err));
    const weft_err status = weft_contact_set(sheet, *row, &set, err);
    *row += weft_contact_set_rows(&set, COLUMNS);
    weft_set_fini(&set);
    return status;
}

static weft_err make_sheet(const weft_invocation *inv, const contact_args *a, weft_sheet *sheet,
                           weft_error *err)
{
    int rows, row = 0;
    WEFT_TRY(count_rows(inv, &rows, err));
    char *const title = sheet_title(inv, err);
    if (!title)
        return WEFT_ERR_NOMEM;
    weft_err status =
        weft_sheet_init(sheet, COLUMNS, rows > 0 ? rows : 1, a->tile.width, a->tile.height, title, err);
    weft_free(title);
    for (int i = 0; i < inv->n_operands && status == WEFT_OK; i++)
        status = weft_contact_is_set(inv->operands[i]) ? fill_set(inv->operands[i], sheet, &row, err)
                                                       : fill_maps(inv->operands[i], a, sheet, &row, err);
    return status;
}

static weft_err run(const weft_invocation *inv, const void *args, weft_error *err)
{
    const contact_args *const a = args;
    weft_sheet sheet = {0};
    WEFT_TRY(weft_file_refuse_existing(a->output, inv->force, err));
    if (a->lights.n != 2 * N_LIGHTS)
        return weft_fail(err, WEFT_ERR_USAGE, "--lights wants six numbers: AZ,EL of three lights");
    weft_err status = make_sheet(inv, a, &sheet, err);
    const int width = sheet.image.width, height = sheet.image.height;
    if (status == WEFT_OK)
        status = weft_image_write(a->output, &sheet.image, 8, WEFT_TRANSFER_SRGB, err);
    weft_sheet_fini(&sheet);
    WEFT_TRY(status);
    if (inv->json)
        return weft_print_json(
            inv, json_pack("{s:s, s:i, s:i}", "output", a->output, "width", width, "height", height), err);
    fprintf(inv->out, "%s: %d x %d\n", a->output, width, height);
    return WEFT_OK;
}

const weft_command weft_cmd_contact = {
    .name = "contact",
    .summary = "a sheet with the maps and previews of samples, or the frames of sets",
    .operands = "MAPS|SET...",
    .min_operands = 1,
    .max_operands = -1,
    .args_size = sizeof(contact_args),
    .fields = fields,
    .details =
        "For each folder of maps: albedo, normal (as the usual picture, whole and pixel by pixel), residual\n"
        "and confidence in false colour, then the cloth under three lights, its middle pixel by pixel, and "
        "on\n"
        "a ball.  The residual's scale ends where 99 % of the pixels are below.  For each captured set: its\n"
        "frames in the camera's colours, balanced, under one exposure.",
    .example = "weft contact twill.set twill.maps -o sheet.png --brdf cloth",
    .run = run,
};
