/*
 * U3M 1.1, the textile industry's open material (vizoogmbh/u3m): NAME.u3m with 16-bit PNGs, and the same in
 * one NAME.u3ma.  Sizes are millimetres, normals +Y up, the model is Disney's principled one.
 */
#include "shading/export/exporter.h"

#include "core/file.h"
#include "core/formats/png_file.h"
#include "core/formats/zip_file.h"
#include "core/mem.h"
#include "core/sha256.h"
#include "core/version.h"
#include "shading/export/channels.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_FILES = 16 };

typedef struct u3m {
    const weft_export_job *job;
    const weft_baked *baked;
    double size_mm[2];
    int n_files;
    char *names[MAX_FILES];
    weft_text_buffer bytes[MAX_FILES];
} u3m;

/* A stable name for the material: a version 4 UUID made of its name, not of chance. */
static void make_id(const weft_baked *baked, char id[37])
{
    weft_sha256 hash;
    char hex[65];
    weft_sha256_init(&hash);
    weft_sha256_update(&hash, "weft material", 13);
    weft_sha256_update(&hash, baked->name, strlen(baked->name));
    weft_sha256_update(&hash, baked->type->name, strlen(baked->type->name));
    weft_sha256_final_hex(&hash, hex);
    (void)snprintf(id, 37, "%.8s-%.4s-4%.3s-8%.3s-%.12s", hex, hex + 8, hex + 12, hex + 15, hex + 18);
}

/* The moment of the export; SOURCE_DATE_EPOCH for builds that must not change. */
static time_t moment(void)
{
    const char *const fixed = getenv("SOURCE_DATE_EPOCH");
    return fixed ? (time_t)strtoll(fixed, NULL, 10) : time(NULL);
}

static weft_err add_picture(u3m *u, const char *name, const weft_channels *channels, json_t **image,
                            weft_error *err)
{
    weft_raster raster = {0};
    char *const file = weft_asprintf(err, "textures/%s.png", name);
    if (!file)
        return WEFT_ERR_NOMEM;
    u->names[u->n_files] = file;
    weft_text_buffer *const png = &u->bytes[u->n_files++];
    WEFT_TRY(weft_channels_raster(u->baked, channels, 0, &raster, err));
    weft_err status = weft_png_encode(&raster, png);
    if (status == WEFT_OK)
        status = weft_text_buffer_status(png, err);
    weft_raster_fini(&raster);
    *image = json_pack("{s:s, s:f, s:f, s:{s:f, s:f}, s:{s:s, s:f}}", "path", file, "width", u->size_mm[0],
                       "height", u->size_mm[1], "dpi", "x", u->baked->width * 25.4 / u->size_mm[0], "y",
                       u->baked->height * 25.4 / u->size_mm[1], "repeat", "mode", "normal", "rotation", 0.0);
    return status;
}

static void put(json_t *side, const char *key, json_t *constant, json_t *texture)
{
    json_object_set_new(
        side, key, json_pack("{s:o, s:o}", "constant", constant, "texture", texture ? texture : json_null()));
}

static json_t *rgb(double r, double g, double b)
{
    return json_pack("{s:f, s:f, s:f}", "r", r, "g", g, "b", b);
}

static double clamp(double v)
{
    return v < 0 ? 0 : v > 1 ? 1 : v;
}

static weft_err add_colour(u3m *u, json_t *side, weft_error *err)
{
    static const weft_channels channels = {{"base.r", "base.g", "base.b", NULL}, 16, true};
    const weft_baked *const b = u->baked;
    json_t *texture = NULL, *image;
    if (weft_channel_varies(b, "base.r")) {
        WEFT_TRY(add_picture(u, "basecolor", &channels, &image, err));
        texture = json_pack("{s:s, s:o, s:o}", "mode", "multiply", "factor", rgb(1, 1, 1), "image", image);
    }
    put(side, "basecolor",
        rgb(clamp(weft_channel_mean(b, "base.r")), clamp(weft_channel_mean(b, "base.g")),
            clamp(weft_channel_mean(b, "base.b"))),
        texture);
    return WEFT_OK;
}

/* A scalar: a constant, and a picture where it varies; value = offset + factor * picture. */
static weft_err add_scalar(u3m *u, json_t *side, const char *key, const char *channel, double constant,
                           double factor, double offset, weft_error *err)
{
    const weft_channels channels = {{channel, NULL}, 16, false};
    json_t *texture = NULL, *image;
    if (channel && weft_channel_varies(u->baked, channel)) {
        WEFT_TRY(add_picture(u, key, &channels, &image, err));
        texture = json_pack("{s:f, s:f, s:o}", "factor", factor, "offset", offset, "image", image);
    }
    put(side, key, json_real(constant), texture);
    return WEFT_OK;
}

static weft_err add_normal(u3m *u, json_t *side, weft_error *err)
{
    static const weft_channels channels = {{"normal.x", "normal.y", "normal.z", NULL}, 16, false};
    json_t *texture = NULL, *image;
    if (weft_channel_varies(u->baked, "normal.x")) {
        WEFT_TRY(add_picture(u, "normal", &channels, &image, err));
        texture = json_pack("{s:f, s:o}", "scale", 1.0, "image", image);
    }
    put(side, "normal", json_pack("{s:f, s:f, s:f}", "x", 0.0, "y", 0.0, "z", 1.0), texture);
    put(side, "clearcoat_normal", json_pack("{s:f, s:f, s:f}", "x", 0.0, "y", 0.0, "z", 1.0), NULL);
    return WEFT_OK;
}

/* Disney 2012: alpha_t = r^2/aspect, alpha_b = r^2 aspect, aspect^2 = 1 - 0.9 a. */
static void disney_lobe(const weft_baked *b, double *roughness, double *anisotropy)
{
    const double ratio = 1 - (double)b->maps[WEFT_BAKED_ANISOTROPY].constant[0];
    const double along = (double)b->maps[WEFT_BAKED_ROUGHNESS].constant[0];
    *anisotropy = clamp((1 - ratio) / 0.9);
    *roughness = sqrt(along * sqrt(fmax(1 - 0.9 * *anisotropy, 0)));
}

static weft_err add_side(u3m *u, json_t **side, weft_error *err)
{
    const weft_baked *const b = u->baked;
    double roughness, anisotropy, range_mm[2];
    const double f0 = clamp(((double)b->maps[WEFT_BAKED_SPECULAR].constant[0] +
                             (double)b->maps[WEFT_BAKED_SPECULAR].constant[1] +
                             (double)b->maps[WEFT_BAKED_SPECULAR].constant[2]) /
                            3);
    const double turn = atan2((double)b->maps[WEFT_BAKED_TANGENT].constant[1],
                              (double)b->maps[WEFT_BAKED_TANGENT].constant[0]);
    json_t *const s = *side = json_object();
    disney_lobe(b, &roughness, &anisotropy);
    weft_channels_height_range(b, range_mm);
    json_object_set_new(s, "shader", json_string("principled"));
    json_object_set_new(s, "preview", json_null());
    WEFT_TRY(add_colour(u, s, err));
    WEFT_TRY(add_normal(u, s, err));
    WEFT_TRY(add_scalar(u, s, "alpha", "opacity", weft_channel_mean(b, "opacity"), 1, 0, err));
    WEFT_TRY(add_scalar(u, s, "roughness", "roughness", roughness, 1, 0, err));
    WEFT_TRY(add_scalar(u, s, "metalness", NULL, weft_channel_mean(b, "metallic"), 1, 0, err));
    WEFT_TRY(add_scalar(u, s, "displacement", "height", 0, range_mm[1] - range_mm[0], range_mm[0], err));
    const struct {
        const char *key;
        double value;
    } rest[] = {
        {"anisotropy_value", anisotropy},
        {"anisotropy_rotation", turn / (2 * acos(-1)) - floor(turn / (2 * acos(-1)))},
        {"specular_value", clamp(f0 / 0.08)},
        {"ior", (1 + sqrt(f0)) / (1 - fmin(sqrt(f0), 0.99))}, /* the same F0 twice: readers use either */
        {"sheen_value", (double)b->maps[WEFT_BAKED_CLOTH].constant[0]},
        {"sheen_tint", 0},
        {"specular_tint", 0},
        {"clearcoat_value", 0},
        {"clearcoat_roughness", 0},
        {"subsurface_value", 0},
        {"subsurface_radius", 0},
        {"transmission", 0}};
    for (size_t i = 0; i < sizeof rest / sizeof rest[0]; i++)
        put(s, rest[i].key, json_real(rest[i].value), NULL);
    put(s, "subsurface_color", rgb(1, 1, 1), NULL);
    return WEFT_OK;
}

/* What U3M has no key for, in a vendor's own section that others keep and do not read. */
static json_t *own_section(const weft_baked *b)
{
    double range_mm[2];
    weft_channels_height_range(b, range_mm);
    return json_pack(
        "{s:{s:s, s:s, s:f, s:f, s:[f,f], s:[f,f,f], s:[f,f,f], s:f}}", "weft", "version", WEFT_VERSION,
        "model", b->type->brdf, "alpha", (double)b->maps[WEFT_BAKED_ROUGHNESS].constant[0], "anisotropy",
        (double)b->maps[WEFT_BAKED_ANISOTROPY].constant[0], "height_mm", range_mm[0], range_mm[1],
        "front_tint", (double)b->maps[WEFT_BAKED_FRONT_TINT].constant[0],
        (double)b->maps[WEFT_BAKED_FRONT_TINT].constant[1],
        (double)b->maps[WEFT_BAKED_FRONT_TINT].constant[2], "rim_tint",
        (double)b->maps[WEFT_BAKED_RIM_TINT].constant[0], (double)b->maps[WEFT_BAKED_RIM_TINT].constant[1],
        (double)b->maps[WEFT_BAKED_RIM_TINT].constant[2], "rim_amplitude",
        (double)b->maps[WEFT_BAKED_RIM_AMPLITUDE].constant[0]);
}

static weft_err add_document(u3m *u, time_t when, weft_error *err)
{
    char id[37], now[32];
    struct tm t;
    json_t *side = NULL;
    gmtime_r(&when, &t);
    (void)strftime(now, sizeof now, "%Y-%m-%dT%H:%M:%SZ", &t);
    make_id(u->baked, id);
    const weft_err status = add_side(u, &side, err);
    json_t *const root =
        json_pack("{s:s, s:{s:s, s:s, s:s, s:s, s:s, s:O, s:n, s:n, s:n, s:{}}, s:o}", "schema", "1.1",
                  "material", "id", id, "name", u->baked->name, "description", "", "created", now, "modified",
                  now, "front", side, "back", "side", "physics", "metadata", "custom", own_section(u->baked));
    json_decref(side);
    char *const text =
        root ? json_dumps(root, JSON_INDENT(2) | JSON_PRESERVE_ORDER | JSON_REAL_PRECISION(9)) : NULL;
    u->names[u->n_files] = weft_asprintf(err, "%s.u3m", u->baked->name);
    if (text)
        weft_text_add_bytes(&u->bytes[u->n_files], text, strlen(text));
    const bool good = text && u->names[u->n_files];
    u->n_files++;
    free(text);
    json_decref(root);
    return status != WEFT_OK ? status : good ? WEFT_OK : weft_fail(err, WEFT_ERR_NOMEM, "out of memory");
}

static weft_err write_files(const u3m *u, time_t when, weft_error *err)
{
    weft_zip_entry entries[MAX_FILES];
    char *const textures = weft_path_join(u->job->folder, "textures", err);
    weft_err status = textures ? weft_folder_create(textures, err) : WEFT_ERR_NOMEM;
    weft_free(textures);
    for (int i = 0; i < u->n_files && status == WEFT_OK; i++) {
        char *const path = weft_path_join(u->job->folder, u->names[i], err);
        status = path ? weft_file_write(path, u->bytes[i].text, u->bytes[i].n, err) : WEFT_ERR_NOMEM;
        weft_free(path);
        entries[i] = (weft_zip_entry){u->names[i], u->bytes[i].text, u->bytes[i].n};
    }
    char *const archive = weft_asprintf(err, "%s/%s.u3ma", u->job->folder, u->baked->name);
    if (status == WEFT_OK)
        status = archive ? weft_zip_write(archive, entries, u->n_files, when, err) : WEFT_ERR_NOMEM;
    weft_free(archive);
    return status;
}

static void say_what_is_lost(const weft_export_job *job)
{
    const weft_baked *const b = job->baked;
    if ((double)b->maps[WEFT_BAKED_CLOTH].constant[0] > 0)
        weft_export_lose(
            job, "cloth lobe: sheen_value is its weight; U3M's sheen has no width and no tint of its own");
    weft_export_lose(
        job, "displacement: in millimetres, which U3M does not say; custom.weft.height_mm repeats the range");
    weft_export_lose(job, "occlusion, cavity, curvature, bent cones, mips: U3M has no place for them");
    if (b->maps[WEFT_BAKED_ANISOTROPY].n_mips > 0 || b->maps[WEFT_BAKED_TANGENT].n_mips > 0)
        weft_export_lose(job, "anisotropy: its strength or direction varies; the mean is written");
    if (b->maps[WEFT_BAKED_SPECULAR].n_mips > 0)
        weft_export_lose(job, "specular: F0 varies over the material; its mean is written");
    if (!(b->size_mm[0] > 0))
        weft_export_lose(job, "size: unknown, written as 100 mm across; set :width_mm");
}

static weft_err write(const weft_export_job *job, weft_error *err)
{
    const time_t when = moment();
    u3m u = {.job = job, .baked = job->baked, .size_mm = {100, 100}};
    if (job->baked->size_mm[0] > 0)
        memcpy(u.size_mm, job->baked->size_mm, sizeof u.size_mm);
    if (!(u.size_mm[1] > 0) || !(job->baked->size_mm[0] > 0))
        u.size_mm[1] =
            job->baked->width > 0 ? u.size_mm[0] * job->baked->height / job->baked->width : u.size_mm[0];
    weft_err status = add_document(&u, when, err);
    if (status == WEFT_OK)
        status = write_files(&u, when, err);
    say_what_is_lost(job);
    for (int i = 0; i < u.n_files; i++) {
        weft_free(u.names[i]);
        weft_text_buffer_fini(&u.bytes[i]);
    }
    return status;
}

const weft_exporter weft_exporter_u3m = {
    .name = "u3m",
    .summary = "U3M 1.1 for textile programs, as .u3m with pictures and as one .u3ma",
    .version = 1,
    .write = write,
};
