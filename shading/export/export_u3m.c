/*
 * U3M 1.1, the textile industry's open material (vizoogmbh/u3m): NAME.u3m with 16-bit PNGs, and the same in
 * one NAME.u3ma.  Sizes are millimetres, normals +Y up, the model is Disney's principled one.  A material
 * made from a U3M keeps of it whatever it did not change, other vendors' sections and files above all.
 */
#include "shading/export/exporter.h"

#include "core/colour.h"
#include "core/file.h"
#include "core/formats/png_file.h"
#include "core/formats/zip_file.h"
#include "core/mem.h"
#include "core/sha256.h"
#include "core/version.h"
#include "shading/export/channels.h"
#include "shading/u3m/u3m_keep.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct u3m_file {
    char *name, *bytes; /* a name that ends with '/' is a folder's */
    size_t n;
} u3m_file;

typedef struct u3m {
    const weft_export_job *job;
    const weft_baked *baked;
    double size_mm[2];
    weft_u3m_keep keep; /* of the U3M it is made from; source NULL: from none */
    int n_files;
    u3m_file *files;
} u3m;

/* Takes the bytes over, also when it fails. */
static weft_err add_file(u3m *u, const char *name, char *bytes, size_t n, weft_error *err)
{
    char *const copy = weft_strdup(name, err);
    u3m_file *const files = copy ? weft_realloc(u->files, (size_t)u->n_files + 1, sizeof *files, err) : NULL;
    if (!files) {
        weft_free(copy);
        weft_free(bytes);
        return WEFT_ERR_NOMEM;
    }
    u->files = files;
    u->files[u->n_files++] = (u3m_file){copy, bytes, n};
    return WEFT_OK;
}

/* The folder that the document lies in: in an archive of others it may be one. */
static int document_folder(const u3m *u)
{
    const char *const document = u->keep.source ? weft_u3m_files_document(u->keep.source->files) : "";
    return (int)(weft_path_name(document) - document);
}

static bool keeps(const u3m *u, const char *key)
{
    return u->keep.source && weft_u3m_keeps(&u->keep, key);
}

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

static weft_err add_png(u3m *u, const char *path, const weft_raster *raster, weft_error *err)
{
    weft_text_buffer png = {0};
    weft_err status = weft_png_encode(raster, &png);
    if (status == WEFT_OK)
        status = weft_text_buffer_status(&png, err);
    char *name = NULL;
    if (status == WEFT_OK) {
        const int n = document_folder(u);
        name = weft_asprintf(err, "%.*s%s", n, n > 0 ? weft_u3m_files_document(u->keep.source->files) : "",
                             path);
        status = name ? WEFT_OK : WEFT_ERR_NOMEM;
    }
    if (status == WEFT_OK)
        status = add_file(u, name, png.text, png.n, err);
    else
        weft_text_buffer_fini(&png);
    weft_free(name);
    return status;
}

/* Beside the pictures of others ours have a folder of their own. */
static weft_err add_picture(u3m *u, const char *name, const weft_channels *channels, json_t **image,
                            weft_error *err)
{
    weft_raster raster = {0};
    char path[128];
    (void)snprintf(path, sizeof path, "textures/%s%s.png", u->keep.source ? "weft/" : "", name);
    WEFT_TRY(weft_channels_raster(u->baked, channels, 0, &raster, err));
    const weft_err status = add_png(u, path, &raster, err);
    weft_raster_fini(&raster);
    *image = json_pack("{s:s, s:f, s:f, s:{s:f, s:f}, s:{s:s, s:f}}", "path", path, "width", u->size_mm[0],
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

/* Colours of the document are in its standard space, sRGB, as those of pictures are. */
static double coded_mean(const weft_baked *b, const char *channel)
{
    return weft_srgb_encode(clamp(weft_channel_mean(b, channel)));
}

static weft_err add_colour(u3m *u, json_t *side, weft_error *err)
{
    static const weft_channels channels = {{"base.r", "base.g", "base.b", NULL}, 16, true};
    const weft_baked *const b = u->baked;
    json_t *texture = NULL, *image;
    if (keeps(u, "basecolor"))
        return WEFT_OK;
    if (weft_channel_varies(b, "base.r")) {
        WEFT_TRY(add_picture(u, "basecolor", &channels, &image, err));
        texture = json_pack("{s:s, s:o, s:o}", "mode", "multiply", "factor", rgb(1, 1, 1), "image", image);
    }
    put(side, "basecolor", rgb(coded_mean(b, "base.r"), coded_mean(b, "base.g"), coded_mean(b, "base.b")),
        texture);
    return WEFT_OK;
}

/* A scalar: a constant, and a picture where it varies; value = offset + factor * picture. */
static weft_err add_scalar(u3m *u, json_t *side, const char *key, const char *channel, double constant,
                           double factor, double offset, weft_error *err)
{
    const weft_channels channels = {{channel, NULL}, 16, false};
    json_t *texture = NULL, *image;
    if (keeps(u, key))
        return WEFT_OK;
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
    if (!u->keep.source)
        put(side, "clearcoat_normal", json_pack("{s:f, s:f, s:f}", "x", 0.0, "y", 0.0, "z", 1.0), NULL);
    if (keeps(u, "normal"))
        return WEFT_OK;
    if (weft_channel_varies(u->baked, "normal.x")) {
        WEFT_TRY(add_picture(u, "normal", &channels, &image, err));
        texture = json_pack("{s:f, s:o}", "scale", 1.0, "image", image);
    }
    put(side, "normal", json_pack("{s:f, s:f, s:f}", "x", 0.0, "y", 0.0, "z", 1.0), texture);
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

/* Parameters without a picture of ours; what Weft's materials do not have is set only in a new document. */
static void add_numbers(const u3m *u, json_t *side, double anisotropy)
{
    const weft_baked *const b = u->baked;
    const float *const f0s = b->maps[WEFT_BAKED_SPECULAR].constant;
    const double f0 = clamp(((double)f0s[0] + (double)f0s[1] + (double)f0s[2]) / 3);
    const double turn = atan2((double)b->maps[WEFT_BAKED_TANGENT].constant[1],
                              (double)b->maps[WEFT_BAKED_TANGENT].constant[0]);
    const struct {
        const char *key;
        double value;
    } rows[] = {
        {"metalness", weft_channel_mean(b, "metallic")},
        {"anisotropy_value", anisotropy},
        {"anisotropy_rotation", turn / (2 * acos(-1)) - floor(turn / (2 * acos(-1)))},
        {"specular_value", clamp(f0 / 0.08)},
        {"ior", (1 + sqrt(f0)) / (1 - fmin(sqrt(f0), 0.99))}, /* the same F0 twice: readers use either */
        {"sheen_tint", 0},
        {"specular_tint", 0},
        {"clearcoat_value", 0},
        {"clearcoat_roughness", 0},
        {"subsurface_value", 0},
        {"subsurface_radius", 0},
        {"transmission", 0}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        if (!keeps(u, rows[i].key))
            put(side, rows[i].key, json_real(rows[i].value), NULL);
}

/* @param side  of the source, or empty: gets what differs from the source */
static weft_err add_side(u3m *u, json_t *side, weft_error *err)
{
    const weft_baked *const b = u->baked;
    double roughness, anisotropy, range_mm[2];
    disney_lobe(b, &roughness, &anisotropy);
    weft_channels_height_range(b, range_mm);
    if (!keeps(u, "preview"))
        json_object_set_new(side, "preview", json_null());
    WEFT_TRY(add_colour(u, side, err));
    WEFT_TRY(add_normal(u, side, err));
    WEFT_TRY(add_scalar(u, side, "alpha", "opacity", weft_channel_mean(b, "opacity"), 1, 0, err));
    /* the picture holds the root of the width along the threads */
    WEFT_TRY(
        add_scalar(u, side, "roughness", "roughness", roughness, pow(1 - 0.9 * anisotropy, 0.25), 0, err));
    WEFT_TRY(add_scalar(u, side, "displacement", "height", 0, range_mm[1] - range_mm[0], range_mm[0], err));
    WEFT_TRY(add_scalar(u, side, "sheen_value", "cloth", weft_channel_mean(b, "cloth"), 1, 0, err));
    add_numbers(u, side, anisotropy);
    if (!u->keep.source) {
        json_object_set_new(side, "shader", json_string("principled"));
        put(side, "subsurface_color", rgb(1, 1, 1), NULL);
    }
    return WEFT_OK;
}

/* What U3M has no key for, in a vendor's own section that others keep and do not read. */
static json_t *own_section(const weft_baked *b)
{
    double range_mm[2];
    weft_channels_height_range(b, range_mm);
    return json_pack("{s:s, s:s, s:[f,f], s:f, s:f, s:[f,f], s:[f,f,f], s:[f,f,f], s:f}", "version",
                     WEFT_VERSION, "model", weft_baked_brdf(b), "size_mm", b->size_mm[0], b->size_mm[1],
                     "alpha", (double)b->maps[WEFT_BAKED_ROUGHNESS].constant[0], "anisotropy",
                     (double)b->maps[WEFT_BAKED_ANISOTROPY].constant[0], "height_mm", range_mm[0],
                     range_mm[1], "front_tint", (double)b->maps[WEFT_BAKED_FRONT_TINT].constant[0],
                     (double)b->maps[WEFT_BAKED_FRONT_TINT].constant[1],
                     (double)b->maps[WEFT_BAKED_FRONT_TINT].constant[2], "rim_tint",
                     (double)b->maps[WEFT_BAKED_RIM_TINT].constant[0],
                     (double)b->maps[WEFT_BAKED_RIM_TINT].constant[1],
                     (double)b->maps[WEFT_BAKED_RIM_TINT].constant[2], "rim_amplitude",
                     (double)b->maps[WEFT_BAKED_RIM_AMPLITUDE].constant[0]);
}

static json_t *known(double value)
{
    return value > 0 ? json_real(value) : json_null();
}

/* Thickness in mm and weight in g/m2; of a source's physics the rest stays. */
static void put_physics(const u3m *u, json_t *material)
{
    if (!(u->baked->thickness_mm > 0) && !(u->baked->weight_gsm > 0))
        return;
    json_t *const physics = json_object_get(material, "physics");
    if (!json_is_object(physics)) {
        json_object_set_new(material, "physics",
                            json_pack("{s:o, s:o, s:n, s:{s:s}, s:n, s:n}", "thickness",
                                      known(u->baked->thickness_mm), "weight", known(u->baked->weight_gsm),
                                      "composition", "devices", "fab", "null", "material_type",
                                      "construction"));
        return;
    }
    json_object_set_new(physics, "thickness", known(u->baked->thickness_mm));
    json_object_set_new(physics, "weight", known(u->baked->weight_gsm));
}

static void iso_time(time_t when, char text[32])
{
    struct tm t;
    gmtime_r(&when, &t);
    (void)strftime(text, 32, "%Y-%m-%dT%H:%M:%SZ", &t);
}

static json_t *new_document(const u3m *u, time_t when)
{
    char id[37], now[32];
    make_id(u->baked, id);
    iso_time(when, now);
    return json_pack("{s:s, s:{s:s, s:s, s:s, s:s, s:s, s:{}, s:n, s:n, s:n, s:n}, s:{s:o}}", "schema", "1.1",
                     "material", "id", id, "name", u->baked->name, "description", "", "created", now,
                     "modified", now, "front", "back", "side", "physics", "metadata", "custom", "weft",
                     own_section(u->baked));
}

/* The source's document with what has changed; what others have in `custom` is not looked at. */
static json_t *kept_document(const u3m *u, time_t when)
{
    char id[37], now[32];
    json_t *const document = weft_u3m_keep_document(&u->keep);
    json_t *const material = json_object_get(document, "material");
    if (!document)
        return NULL;
    iso_time(when, now);
    json_object_set_new(material, "modified", json_string(now));
    if (!u->keep.same_name) {
        make_id(u->baked, id);
        json_object_set_new(material, "id", json_string(id));
        json_object_set_new(material, "name", json_string(u->baked->name));
    }
    json_t *const custom = json_object_get(document, "custom");
    if (json_is_object(custom))
        json_object_set_new(custom, "weft", own_section(u->baked));
    else
        json_object_set_new(document, "custom", json_pack("{s:o}", "weft", own_section(u->baked)));
    return document;
}

static weft_err add_document_file(u3m *u, const json_t *document, weft_error *err)
{
    char *const text = json_dumps(document, JSON_INDENT(2) | JSON_PRESERVE_ORDER | JSON_REAL_PRECISION(17));
    const bool same = u->keep.source && u->keep.same_name;
    char *const name =
        same ? weft_strdup(weft_u3m_files_document(u->keep.source->files), err)
             : weft_asprintf(err, "%.*s%s.u3m", document_folder(u),
                             u->keep.source ? weft_u3m_files_document(u->keep.source->files) : "",
                             u->baked->name);
    char *const bytes = text ? weft_strdup(text, err) : NULL;
    weft_err status = name && bytes ? WEFT_OK : weft_fail(err, WEFT_ERR_NOMEM, "out of memory");
    if (status == WEFT_OK)
        status = add_file(u, name, bytes, strlen(bytes), err);
    else
        weft_free(bytes);
    weft_free(name);
    free(text);
    return status;
}

/* @param document  NULL: all of them, the very document too */
static weft_err add_kept_files(u3m *u, const json_t *document, weft_error *err)
{
    const weft_u3m_files *const files = u->keep.source->files;
    for (int i = 0; i < weft_u3m_files_count(files); i++) {
        char *bytes;
        size_t n;
        if (document && !weft_u3m_keeps_file(&u->keep, i, document))
            continue;
        WEFT_TRY(weft_u3m_files_read(files, i, &bytes, &n, err));
        WEFT_TRY(add_file(u, weft_u3m_files_name(files, i), bytes, n, err));
    }
    return WEFT_OK;
}

static weft_err add_document(u3m *u, time_t when, weft_error *err)
{
    if (u->keep.source && weft_u3m_keeps_all(&u->keep))
        return add_kept_files(u, NULL, err);
    json_t *const document = u->keep.source ? kept_document(u, when) : new_document(u, when);
    json_t *const side = json_object_get(json_object_get(document, "material"),
                                         u->keep.source ? u->keep.source->side_name : "front");
    weft_err status = document ? WEFT_OK : weft_fail(err, WEFT_ERR_NOMEM, "out of memory");
    if (status == WEFT_OK && !(u->keep.source && u->keep.same_physics))
        put_physics(u, json_object_get(document, "material"));
    if (status == WEFT_OK)
        status = add_side(u, side, err);
    if (status == WEFT_OK)
        status = add_document_file(u, document, err);
    if (status == WEFT_OK && u->keep.source)
        status = add_kept_files(u, document, err);
    json_decref(document);
    return status;
}

static weft_err write_file(const u3m *u, const u3m_file *file, weft_error *err)
{
    char *const path = weft_path_join(u->job->folder, file->name, err);
    char *const folder = path ? weft_path_folder(path, err) : NULL;
    weft_err status = folder ? weft_folder_create(folder, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK && path[strlen(path) - 1] != '/')
        status = weft_file_write(path, file->bytes, file->n, err);
    weft_free(folder);
    weft_free(path);
    return status;
}

static weft_err write_files(const u3m *u, time_t when, weft_error *err)
{
    weft_zip_entry *const entries = weft_alloc((size_t)u->n_files, sizeof *entries, err);
    weft_err status = entries ? WEFT_OK : WEFT_ERR_NOMEM;
    for (int i = 0; i < u->n_files && status == WEFT_OK; i++) {
        status = write_file(u, &u->files[i], err);
        entries[i] = (weft_zip_entry){u->files[i].name, u->files[i].bytes, u->files[i].n};
    }
    char *const archive = weft_asprintf(err, "%s/%s.u3ma", u->job->folder, u->baked->name);
    if (status == WEFT_OK)
        status = archive ? weft_zip_write(archive, entries, u->n_files, when, err) : WEFT_ERR_NOMEM;
    weft_free(archive);
    weft_free(entries);
    return status;
}

static void say_what_is_lost(const weft_export_job *job)
{
    const weft_baked *const b = job->baked;
    if (b->u3m)
        weft_export_lose(job, "u3m: parts of %s that the material did not change are passed on as they were",
                         b->u3m);
    if ((double)b->maps[WEFT_BAKED_CLOTH].constant[0] > 0)
        weft_export_lose(
            job, "cloth lobe: sheen_value is its weight; U3M's sheen has no width and no tint of its own");
    weft_export_lose(
        job, "displacement: in millimetres, which U3M does not say; custom.weft.height_mm repeats the range");
    if (b->two_lobes)
        weft_export_lose(job,
                         "two lobes: roughness and F0 are the smooth part's, the colour is that of both");
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
    weft_err status = job->baked->u3m ? weft_u3m_keep_open(job->baked, &u.keep, err) : WEFT_OK;
    if (status == WEFT_OK)
        status = add_document(&u, when, err);
    if (status == WEFT_OK)
        status = write_files(&u, when, err);
    say_what_is_lost(job);
    for (int i = 0; i < u.n_files; i++) {
        weft_free(u.files[i].name);
        weft_free(u.files[i].bytes);
    }
    weft_free(u.files);
    weft_u3m_keep_close(&u.keep);
    return status;
}

const weft_exporter weft_exporter_u3m = {
    .name = "u3m",
    .summary = "U3M 1.1 for textile programs, as .u3m with pictures and as one .u3ma",
    .version = 4,
    .write = write,
};
