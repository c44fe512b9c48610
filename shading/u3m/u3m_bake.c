/* What the parameters of a U3M mean as Weft's quantities. */
#include "shading/u3m/u3m_document.h"

#include "core/colour.h"
#include "core/json.h"
#include "core/mem.h"
#include "shading/material/texture.h"
#include "shading/u3m/u3m_picture.h"

#include <math.h>
#include <string.h>

/* A parameter over the material: one value a plane, or a picture at the size asked for. */
typedef struct field {
    float constant[3];
    weft_image image; /* planes 0: the constant */
} field;

typedef struct bake_job {
    const weft_u3m *u3m;
    int width, height;
    double size_mm[2];
} bake_job;

static const json_t *texture_of(const weft_u3m *u, const char *key)
{
    const json_t *const texture = json_object_get(json_object_get(u->side, key), "texture");
    return json_is_object(texture) ? texture : NULL;
}

static double member(const json_t *object, const char *key, double absent)
{
    const json_t *const m = json_object_get(object, key);
    return json_is_number(m) ? json_number_value(m) : absent;
}

static float at(const field *f, int plane, size_t i)
{
    if (f->image.planes == 0)
        return f->constant[plane];
    return weft_image_plane(&f->image, f->image.planes == 1 ? 0 : plane)[i];
}

/* -- pictures ----------------------------------------------------------------------------------------- */

static weft_err read_picture(const weft_u3m *u, const json_t *texture, weft_transfer transfer,
                             weft_image *image, weft_error *err)
{
    const json_t *const picture = json_object_get(texture, "image");
    const int index = weft_u3m_files_find(u->files, json_string_value(json_object_get(picture, "path")));
    const weft_err status = weft_u3m_picture_read(u->files, index, transfer, image, err);
    return status == WEFT_OK ? WEFT_OK : weft_prefix(err, status, "%s", u->path);
}

/* Every picture at its own true size over the material's. */
static weft_err fit(const bake_job *job, const json_t *texture, weft_texture_use use, weft_image *image,
                    weft_error *err)
{
    const json_t *const picture = json_object_get(texture, "image");
    const double unit = job->u3m->is_1_0 ? 10 : 1;
    const double w = unit * member(picture, "width", 0), h = unit * member(picture, "height", 0);
    const double tiling[2] = {w > 0 ? job->size_mm[0] / w : 1, h > 0 ? job->size_mm[1] / h : 1};
    weft_image at_size;
    const weft_err status = weft_texture_resample(image, use, job->width, job->height, tiling, &at_size, err);
    weft_image_fini(image);
    *image = status == WEFT_OK ? at_size : (weft_image){0};
    return status;
}

static double mix(const char *mode, double a, double b)
{
    if (strcmp(mode, "add") == 0)
        return a + b;
    if (strcmp(mode, "subtract") == 0)
        return a - b;
    if (strcmp(mode, "divide") == 0)
        return b > 0 ? a / b : 1;
    if (strcmp(mode, "max") == 0)
        return fmax(a, b);
    if (strcmp(mode, "min") == 0)
        return fmin(a, b);
    if (strcmp(mode, "overlay") == 0)
        return a < 0.5 ? 2 * a * b : 1 - 2 * (1 - a) * (1 - b);
    return a * b;
}

static weft_err read_colour(const bake_job *job, field *f, weft_error *err)
{
    static const char *const rgb[] = {"r", "g", "b"};
    const json_t *const texture = texture_of(job->u3m, "basecolor");
    const json_t *const constant = json_object_get(
        texture ? texture : json_object_get(job->u3m->side, "basecolor"), texture ? "factor" : "constant");
    for (int p = 0; p < 3; p++)
        f->constant[p] = (float)weft_srgb_decode(fmin(fmax(member(constant, rgb[p], 0), 0), 1));
    if (!texture)
        return WEFT_OK;
    const char *const mode = json_string_value(json_object_get(texture, "mode"));
    weft_image read;
    WEFT_TRY(read_picture(job->u3m, texture, WEFT_TRANSFER_SRGB, &read, err));
    const size_t n = weft_image_plane_size(&read);
    weft_err status = weft_image_init(&f->image, read.width, read.height, 3, err);
    for (int p = 0; p < 3 && status == WEFT_OK; p++) {
        const float *const from = weft_image_plane(&read, read.planes == 1 ? 0 : p);
        float *const to = weft_image_plane(&f->image, p);
        for (size_t i = 0; i < n; i++)
            to[i] = (float)fmin(
                fmax(mix(mode ? mode : "multiply", (double)from[i], (double)f->constant[p]), 0), 1);
    }
    weft_image_fini(&read);
    return status == WEFT_OK ? fit(job, texture, WEFT_TEXTURE_COLOUR, &f->image, err) : status;
}

static weft_err read_scalar(const bake_job *job, const char *key, field *f, weft_error *err)
{
    const json_t *const texture = texture_of(job->u3m, key);
    f->constant[0] = (float)member(json_object_get(job->u3m->side, key), "constant", 0);
    if (!texture)
        return WEFT_OK;
    const float factor = (float)member(texture, "factor", 1), offset = (float)member(texture, "offset", 0);
    weft_image read;
    WEFT_TRY(read_picture(job->u3m, texture, WEFT_TRANSFER_LINEAR, &read, err));
    const size_t n = weft_image_plane_size(&read);
    weft_err status = weft_image_init(&f->image, read.width, read.height, 1, err);
    for (size_t i = 0; i < n && status == WEFT_OK; i++) {
        float sum = 0;
        for (int p = 0; p < read.planes; p++)
            sum += weft_image_plane(&read, p)[i];
        f->image.data[i] = offset + factor * sum / (float)read.planes;
    }
    weft_image_fini(&read);
    return status == WEFT_OK ? fit(job, texture, WEFT_TEXTURE_SCALAR, &f->image, err) : status;
}

/* 2 v - 1, x and y by the scale, unit length. */
static void decode_normals(weft_image *image, float scale)
{
    float *const x = weft_image_plane(image, 0), *const y = weft_image_plane(image, 1),
                 *const z = weft_image_plane(image, 2);
    for (size_t i = 0; i < weft_image_plane_size(image); i++) {
        const float a = (2 * x[i] - 1) * scale, b = (2 * y[i] - 1) * scale, c = 2 * z[i] - 1;
        const float length = sqrtf(a * a + b * b + c * c);
        x[i] = length > 0 ? a / length : 0;
        y[i] = length > 0 ? b / length : 0;
        z[i] = length > 0 ? c / length : 1;
    }
}

static weft_err read_normal(const bake_job *job, field *f, weft_error *err)
{
    const json_t *const texture = texture_of(job->u3m, "normal");
    f->constant[2] = 1;
    if (!texture)
        return WEFT_OK;
    WEFT_TRY(read_picture(job->u3m, texture, WEFT_TRANSFER_LINEAR, &f->image, err));
    if (f->image.planes != 3) {
        weft_image_fini(&f->image);
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: its picture of normals is not RGB", job->u3m->path);
    }
    decode_normals(&f->image, (float)member(texture, job->u3m->is_1_0 ? "factor" : "scale", 1));
    return fit(job, texture, WEFT_TEXTURE_NORMAL, &f->image, err);
}

/* -- quantities --------------------------------------------------------------------------------------- */

/* A quantity of several fields, texel by texel; of constants alone a constant. */
typedef void combine_fn(const float *const values[], float *out);

static weft_err put(const bake_job *job, weft_baked *baked, weft_baked_kind kind, const field *const *fields,
                    int n, combine_fn *combine, weft_error *err)
{
    float values[4][3] = {{0}}, out[4] = {0};
    const float *const in[4] = {values[0], values[1], values[2], values[3]};
    bool varies = false;
    for (int k = 0; k < n; k++)
        varies = varies || fields[k]->image.planes > 0;
    if (varies)
        WEFT_TRY(weft_baked_add(baked, kind, job->width, job->height, err));
    const int planes = weft_baked_rows[kind].planes;
    const size_t texels = varies ? (size_t)job->width * (size_t)job->height : 1;
    double sum[4] = {0};
    for (size_t i = 0; i < texels; i++) {
        for (int k = 0; k < n; k++)
            for (int p = 0; p < (fields[k]->image.planes == 1 ? 1 : 3); p++)
                values[k][p] = at(fields[k], p, i);
        combine(in, out);
        for (int p = 0; p < planes; p++) {
            sum[p] += (double)out[p];
            if (varies)
                weft_image_plane(&baked->maps[kind].mips[0], p)[i] = out[p];
        }
    }
    for (int p = 0; p < planes; p++)
        baked->maps[kind].constant[p] = (float)(sum[p] / (double)texels);
    return WEFT_OK;
}

static float clamp01(float v)
{
    return v < 0 ? 0 : v > 1 ? 1 : v;
}

static void combine_albedo(const float *const v[], float *out)
{
    for (int p = 0; p < 3; p++)
        out[p] = v[0][p] * (1 - clamp01(v[1][0]));
}

static void combine_specular(const float *const v[], float *out)
{
    const float metal = clamp01(v[1][0]);
    for (int p = 0; p < 3; p++)
        out[p] = clamp01(0.08F * v[2][0] * (1 - metal) + v[0][p] * metal);
}

static void combine_roughness(const float *const v[], float *out)
{
    const float r = clamp01(v[0][0]);
    out[0] = fminf(fmaxf(r * r / sqrtf(1 - 0.9F * clamp01(v[1][0])), 1e-3F), 1);
}

static void combine_anisotropy(const float *const v[], float *out)
{
    out[0] = 0.9F * clamp01(v[0][0]);
}

static void combine_tangent(const float *const v[], float *out)
{
    const float turn = v[0][0] * 2 * acosf(-1);
    out[0] = cosf(turn);
    out[1] = sinf(turn);
}

static void combine_scalar(const float *const v[], float *out)
{
    out[0] = v[0][0];
}

static void combine_unit(const float *const v[], float *out)
{
    out[0] = clamp01(v[0][0]);
}

static void combine_vector(const float *const v[], float *out)
{
    memcpy(out, v[0], 3 * sizeof *out);
}

static bool is_used(const weft_u3m *u, const char *key)
{
    return texture_of(u, key) || fabs(member(json_object_get(u->side, key), "constant", 0)) > 0;
}

/* The cloth lobe is ours: U3M's sheen says no more than its weight. */
static bool is_our_cloth(const weft_u3m *u)
{
    const char *const model = json_string_value(json_object_get(u->ours, "model"));
    return model && strncmp(model, "cloth", 5) == 0;
}

const char *weft_u3m_type(const weft_u3m *u3m)
{
    return is_our_cloth(u3m)                  ? "clothmaterial"
           : is_used(u3m, "anisotropy_value") ? "anisotropicmaterial"
                                              : "opaquematerial";
}

bool weft_u3m_has(const weft_u3m *u3m, weft_baked_kind kind)
{
    switch (kind) {
    case WEFT_BAKED_ALBEDO:
    case WEFT_BAKED_SPECULAR:
    case WEFT_BAKED_ROUGHNESS:
    case WEFT_BAKED_OPACITY:
        return true;
    case WEFT_BAKED_NORMAL:
        return texture_of(u3m, "normal") != NULL;
    case WEFT_BAKED_HEIGHT:
        return u3m->ours && texture_of(u3m, "displacement");
    case WEFT_BAKED_ANISOTROPY:
    case WEFT_BAKED_TANGENT:
        return is_used(u3m, "anisotropy_value");
    case WEFT_BAKED_CLOTH:
    case WEFT_BAKED_FRONT_TINT:
    case WEFT_BAKED_RIM_TINT:
    case WEFT_BAKED_RIM_AMPLITUDE:
        return is_our_cloth(u3m);
    default:
        return false;
    }
}

/* What our own section repeats of the cloth lobe. */
static weft_err put_cloth(const bake_job *job, weft_baked *baked, weft_error *err)
{
    double v[3] = {1, 1, 1};
    const json_t *const ours = job->u3m->ours;
    const char *const place = job->u3m->path;
    const struct {
        const char *key;
        weft_baked_kind kind;
    } tints[] = {{"front_tint", WEFT_BAKED_FRONT_TINT}, {"rim_tint", WEFT_BAKED_RIM_TINT}};
    baked->maps[WEFT_BAKED_CLOTH].constant[0] =
        clamp01((float)member(json_object_get(job->u3m->side, "sheen_value"), "constant", 1));
    for (int k = 0; k < 2; k++) {
        WEFT_TRY(weft_json_get_numbers(ours, tints[k].key, WEFT_JSON_OPTIONAL, 3, v, place, err));
        for (int p = 0; p < 3; p++)
            baked->maps[tints[k].kind].constant[p] = clamp01((float)v[p]);
    }
    WEFT_TRY(weft_json_get_number(ours, "rim_amplitude", WEFT_JSON_OPTIONAL, 0, 4, v, place, err));
    baked->maps[WEFT_BAKED_RIM_AMPLITUDE].constant[0] =
        (float)member(ours, "rim_amplitude", (double)weft_baked_rows[WEFT_BAKED_RIM_AMPLITUDE].def[0]);
    return WEFT_OK;
}

enum { BASE, METAL, SPECULAR, ROUGH, ANISOTROPY, TURN, ALPHA, NORMAL, HEIGHT, FIELDS };

static weft_err read_fields(const bake_job *job, field f[FIELDS], weft_error *err)
{
    static const char *const scalars[FIELDS] = {
        [METAL] = "metalness",          [SPECULAR] = "specular_value",
        [ROUGH] = "roughness",          [ANISOTROPY] = "anisotropy_value",
        [TURN] = "anisotropy_rotation", [ALPHA] = "alpha",
        [HEIGHT] = "displacement"};
    WEFT_TRY(read_colour(job, &f[BASE], err));
    WEFT_TRY(read_normal(job, &f[NORMAL], err));
    for (int k = 0; k < FIELDS; k++)
        if (scalars[k] && (k != HEIGHT || weft_u3m_has(job->u3m, WEFT_BAKED_HEIGHT)))
            WEFT_TRY(read_scalar(job, scalars[k], &f[k], err));
    f[TURN].constant[0] /= job->u3m->is_1_0 ? 360 : 1;
    return WEFT_OK;
}

static weft_err put_fields(const bake_job *job, field f[FIELDS], weft_baked *baked, weft_error *err)
{
    const struct {
        weft_baked_kind kind;
        const field *fields[3];
        int n;
        combine_fn *combine;
    } rows[] = {{WEFT_BAKED_ALBEDO, {&f[BASE], &f[METAL]}, 2, combine_albedo},
                {WEFT_BAKED_SPECULAR, {&f[BASE], &f[METAL], &f[SPECULAR]}, 3, combine_specular},
                {WEFT_BAKED_ROUGHNESS, {&f[ROUGH], &f[ANISOTROPY]}, 2, combine_roughness},
                {WEFT_BAKED_ANISOTROPY, {&f[ANISOTROPY]}, 1, combine_anisotropy},
                {WEFT_BAKED_TANGENT, {&f[TURN]}, 1, combine_tangent},
                {WEFT_BAKED_OPACITY, {&f[ALPHA]}, 1, combine_unit},
                {WEFT_BAKED_NORMAL, {&f[NORMAL]}, 1, combine_vector},
                {WEFT_BAKED_HEIGHT, {&f[HEIGHT]}, 1, combine_scalar}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        /* F0 of a dielectric with a colour picture is no picture */
        const bool is_dielectric = f[METAL].image.planes == 0 && !(f[METAL].constant[0] > 0);
        const field *fields[4] = {rows[i].fields[0], rows[i].fields[1], rows[i].fields[2], NULL};
        const field black = {.constant = {0, 0, 0}};
        if (rows[i].kind == WEFT_BAKED_SPECULAR && is_dielectric)
            fields[0] = &black;
        if (weft_u3m_has(job->u3m, rows[i].kind))
            WEFT_TRY(put(job, baked, rows[i].kind, fields, rows[i].n, rows[i].combine, err));
    }
    return is_our_cloth(job->u3m) ? put_cloth(job, baked, err) : WEFT_OK;
}

weft_err weft_u3m_bake(const weft_u3m *u3m, int w, int h, const double size_mm[2], weft_baked *baked,
                       weft_error *err)
{
    const bool known = size_mm[0] > 0 && size_mm[1] > 0;
    const bake_job job = {
        u3m, w, h, {known ? size_mm[0] : u3m->size_mm[0], known ? size_mm[1] : u3m->size_mm[1]}};
    field fields[FIELDS] = {0};
    WEFT_TRY(weft_baked_init(baked, u3m->name, weft_material_type_find(weft_u3m_type(u3m)), err));
    weft_err status = read_fields(&job, fields, err);
    if (status == WEFT_OK)
        status = put_fields(&job, fields, baked, err);
    for (int k = 0; k < FIELDS; k++)
        weft_image_fini(&fields[k].image);
    if (status != WEFT_OK)
        weft_baked_fini(baked);
    return status;
}

weft_err weft_u3m_measure(const weft_u3m *u3m, int *width, int *height, weft_error *err)
{
    static const char *const keys[] = {"basecolor", "metalness", "specular_value",      "roughness",
                                       "normal",    "alpha",     "anisotropy_rotation", "anisotropy_value"};
    *width = *height = 0;
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) {
        const json_t *const texture = texture_of(u3m, keys[i]);
        const char *const path =
            json_string_value(json_object_get(json_object_get(texture, "image"), "path"));
        int w, h;
        if (!path)
            continue;
        const weft_err status =
            weft_u3m_picture_size(u3m->files, weft_u3m_files_find(u3m->files, path), &w, &h, err);
        if (status != WEFT_OK)
            return weft_prefix(err, status, "%s", u3m->path);
        if ((long)w * h > (long)*width * *height) {
            *width = w;
            *height = h;
        }
    }
    return WEFT_OK;
}
