/*
 * One .glb: a flat swatch of true size in metres under the core metallic-roughness model with the extensions
 * that cloth needs (glTF 2.0; KHR_materials_sheen, _anisotropy, _specular).  Its pictures are PNG that any
 * reader takes, or KTX2 with the filtered mips (KHR_texture_basisu).
 */
#include "shading/export/exporter.h"

#include "core/file.h"
#include "core/formats/png_file.h"
#include "core/mem.h"
#include "core/version.h"
#include "shading/brdf/albedo.h"
#include "shading/export/channels.h"
#include "shading/export/ktx2.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Metres of a swatch whose size nobody knows. */
#define UNKNOWN_SIZE_M 0.1

/* The file under construction. */
typedef struct glb {
    const weft_export_job *job;
    const weft_baked *baked;
    bool ktx2; /* pictures are KTX2 */
    weft_text_buffer bin;
    json_t *root, *views, *images, *textures;
} glb;

static int add_view(glb *g, const void *bytes, size_t n, int target)
{
    static const char zeros[4] = {0};
    weft_text_add_bytes(&g->bin, zeros, (4 - g->bin.n % 4) % 4);
    json_t *const view = json_pack("{s:i, s:I, s:I}", "buffer", 0, "byteOffset", (json_int_t)g->bin.n,
                                   "byteLength", (json_int_t)n);
    if (target)
        json_object_set_new(view, "target", json_integer(target));
    json_array_append_new(g->views, view);
    weft_text_add_bytes(&g->bin, bytes, n);
    return (int)json_array_size(g->views) - 1;
}

static weft_err encode_picture(const glb *g, const weft_channels *channels, weft_text_buffer *bytes,
                               weft_error *err)
{
    weft_raster raster = {0};
    if (g->ktx2)
        return weft_ktx2_encode(g->baked, channels, WEFT_KTX2_UASTC, bytes, err);
    WEFT_TRY(weft_channels_raster(g->baked, channels, 0, &raster, err));
    weft_err status = weft_png_encode(&raster, bytes);
    if (status == WEFT_OK)
        status = weft_text_buffer_status(bytes, err);
    weft_raster_fini(&raster);
    return status;
}

/* A picture inside the file; `index` is that of its texture. */
static weft_err add_picture(glb *g, const char *name, const weft_channels *channels, int *index,
                            weft_error *err)
{
    weft_text_buffer bytes = {0};
    const weft_err status = encode_picture(g, channels, &bytes, err);
    if (status == WEFT_OK) {
        const int view = add_view(g, bytes.text, bytes.n, 0), source = (int)json_array_size(g->images);
        json_array_append_new(g->images, json_pack("{s:s, s:s, s:i}", "name", name, "mimeType",
                                                   g->ktx2 ? "image/ktx2" : "image/png", "bufferView", view));
        json_array_append_new(g->textures, g->ktx2
                                               ? json_pack("{s:i, s:{s:{s:i}}}", "sampler", 0, "extensions",
                                                           "KHR_texture_basisu", "source", source)
                                               : json_pack("{s:i, s:i}", "sampler", 0, "source", source));
        *index = (int)json_array_size(g->textures) - 1;
    }
    weft_text_buffer_fini(&bytes);
    return status;
}

static json_t *texture(int index)
{
    return json_pack("{s:i}", "index", index);
}

static json_t *numbers(const double *values, int n)
{
    json_t *const array = json_array();
    for (int i = 0; i < n; i++)
        json_array_append_new(array, json_real(values[i]));
    return array;
}

/* -- the swatch --------------------------------------------------------------------------------------- */

static int add_accessor(json_t *accessors, int view, int type, int count, const char *shape,
                        const double *low, const double *high)
{
    json_t *const a = json_pack("{s:i, s:i, s:i, s:s}", "bufferView", view, "componentType", type, "count",
                                count, "type", shape);
    if (low) {
        json_object_set_new(a, "min", numbers(low, 3));
        json_object_set_new(a, "max", numbers(high, 3));
    }
    json_array_append_new(accessors, a);
    return (int)json_array_size(accessors) - 1;
}

/* Two triangles in the plane z = 0, facing +z; the picture's up is +y. */
static void add_swatch(glb *g)
{
    enum { FLOATS = 5126, SHORTS = 5123, VERTICES = 34962, INDICES = 34963 };
    const double w = g->baked->size_mm[0] > 0 ? g->baked->size_mm[0] / 1000 : UNKNOWN_SIZE_M;
    const double h = g->baked->size_mm[1] > 0 ? g->baked->size_mm[1] / 1000
                     : g->baked->width > 0    ? w * g->baked->height / g->baked->width
                                              : w;
    const float x = (float)(w / 2), y = (float)(h / 2);
    const float positions[12] = {-x, -y, 0, x, -y, 0, x, y, 0, -x, y, 0};
    const float normals[12] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
    const float tangents[16] = {1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1};
    const float uv[8] = {0, 1, 1, 1, 1, 0, 0, 0};
    const uint16_t indices[6] = {0, 1, 2, 0, 2, 3};
    const double low[3] = {(double)-x, (double)-y, 0}, high[3] = {(double)x, (double)y, 0};
    json_t *const accessors = json_array();
    json_t *const attributes = json_object();
    const int p = add_accessor(accessors, add_view(g, positions, sizeof positions, VERTICES), FLOATS, 4,
                               "VEC3", low, high);
    json_object_set_new(attributes, "POSITION", json_integer(p));
    const int n = add_accessor(accessors, add_view(g, normals, sizeof normals, VERTICES), FLOATS, 4, "VEC3",
                               NULL, NULL);
    json_object_set_new(attributes, "NORMAL", json_integer(n));
    if (json_array_size(g->textures) > 0) { /* what no picture reads, validators remark on */
        const int t = add_accessor(accessors, add_view(g, tangents, sizeof tangents, VERTICES), FLOATS, 4,
                                   "VEC4", NULL, NULL);
        json_object_set_new(attributes, "TANGENT", json_integer(t));
        const int u =
            add_accessor(accessors, add_view(g, uv, sizeof uv, VERTICES), FLOATS, 4, "VEC2", NULL, NULL);
        json_object_set_new(attributes, "TEXCOORD_0", json_integer(u));
    }
    const int i = add_accessor(accessors, add_view(g, indices, sizeof indices, INDICES), SHORTS, 6, "SCALAR",
                               NULL, NULL);
    json_object_set_new(g->root, "accessors", accessors);
    json_object_set_new(g->root, "meshes",
                        json_pack("[{s:s, s:[{s:o, s:i, s:i}]}]", "name", "swatch", "primitives",
                                  "attributes", attributes, "indices", i, "material", 0));
    json_object_set_new(g->root, "nodes", json_pack("[{s:s, s:i}]", "name", g->baked->name, "mesh", 0));
    json_object_set_new(g->root, "scenes", json_pack("[{s:[i]}]", "nodes", 0));
    json_object_set_new(g->root, "scene", json_integer(0));
}

/* -- the material ------------------------------------------------------------------------------------- */

static weft_err add_base_colour(glb *g, json_t *material, json_t *pbr, weft_error *err)
{
    const bool cut = weft_channel_varies(g->baked, "opacity") || weft_channel_mean(g->baked, "opacity") < 1;
    double factor[4] = {weft_channel_mean(g->baked, "base.r"), weft_channel_mean(g->baked, "base.g"),
                        weft_channel_mean(g->baked, "base.b"),
                        cut ? weft_channel_mean(g->baked, "opacity") : 1};
    if (weft_channel_varies(g->baked, "base.r") || weft_channel_varies(g->baked, "opacity")) {
        const weft_channels channels = {{"base.r", "base.g", "base.b", cut ? "opacity" : NULL}, 8, true};
        int index;
        WEFT_TRY(add_picture(g, "baseColor", &channels, &index, err));
        json_object_set_new(pbr, "baseColorTexture", texture(index));
        factor[0] = factor[1] = factor[2] = factor[3] = 1;
    }
    json_object_set_new(pbr, "baseColorFactor", numbers(factor, 4));
    if (cut)
        json_object_set_new(material, "alphaMode",
                            json_string(weft_channel_varies(g->baked, "opacity") ? "MASK" : "BLEND"));
    return WEFT_OK;
}

/* Of the two widths glTF's roughness is the narrow one, and its anisotropy widens the tangent. */
static double narrow_alpha(const weft_baked *b)
{
    const double along = (double)b->maps[WEFT_BAKED_ROUGHNESS].constant[0];
    return along * (1 - (double)b->maps[WEFT_BAKED_ANISOTROPY].constant[0]);
}

static weft_err add_roughness(glb *g, json_t *material, json_t *pbr, weft_error *err)
{
    const weft_baked *const b = g->baked;
    const bool maps = weft_channel_varies(b, "roughness") || weft_channel_varies(b, "occlusion");
    double roughness = sqrt(narrow_alpha(b));
    if (maps) {
        static const weft_channels channels = {{"occlusion", "roughness", "zero", NULL}, 8, false};
        int index;
        WEFT_TRY(add_picture(g, "occlusionRoughness", &channels, &index, err));
        json_object_set_new(pbr, "metallicRoughnessTexture", texture(index));
        if (weft_channel_varies(b, "occlusion"))
            json_object_set_new(material, "occlusionTexture", texture(index));
        /* the picture holds the wide alpha's root; the constant share of the narrow one goes into the factor
         */
        roughness = sqrt(1 - (double)b->maps[WEFT_BAKED_ANISOTROPY].constant[0]);
    }
    json_object_set_new(pbr, "roughnessFactor", json_real(roughness));
    json_object_set_new(pbr, "metallicFactor", json_real(maps ? 0 : weft_channel_mean(b, "metallic")));
    if (maps && weft_channel_mean(b, "metallic") > 0) {
        json_object_set_new(pbr, "metallicFactor", json_real(0));
        weft_export_lose(g->job, "metal: with a map of roughness the metal's colour is in specularColor");
    }
    return WEFT_OK;
}

static weft_err add_normal(glb *g, json_t *material, weft_error *err)
{
    static const weft_channels channels = {{"normal.x", "normal.y", "normal.z", NULL}, 8, false};
    int index;
    if (!weft_channel_varies(g->baked, "normal.x"))
        return WEFT_OK;
    WEFT_TRY(add_picture(g, "normal", &channels, &index, err));
    json_object_set_new(material, "normalTexture", texture(index));
    weft_export_lose(g->job, "normals: 8 bits, for readers that know no more; the EXR maps have the rest");
    return WEFT_OK;
}

/* F0 of the dielectric is 0.04 times the factor times the colour; a cloth has its lobe in the sheen instead.
 */
static weft_err add_specular(glb *g, json_t *extensions, weft_error *err)
{
    static const weft_channels channels = {{"one", "one", "one", "smooth"}, 8, false};
    double colour[3];
    const bool varies = weft_channel_varies(g->baked, "cloth");
    const double cloth = (double)g->baked->maps[WEFT_BAKED_CLOTH].constant[0];
    for (int p = 0; p < 3; p++)
        colour[p] = (double)g->baked->maps[WEFT_BAKED_SPECULAR].constant[p] / 0.04;
    if (!(cloth > 0) && fabs(colour[0] - 1) < 1e-3 && fabs(colour[1] - 1) < 1e-3 &&
        fabs(colour[2] - 1) < 1e-3)
        return WEFT_OK;
    json_t *const specular =
        json_pack("{s:f, s:o}", "specularFactor", varies ? 1 : fmin(fmax(1 - cloth, 0), 1),
                  "specularColorFactor", numbers(colour, 3));
    json_object_set_new(extensions, "KHR_materials_specular", specular);
    if (varies) {
        int index;
        WEFT_TRY(add_picture(g, "specular", &channels, &index, err));
        json_object_set_new(specular, "specularTexture", texture(index));
    }
    if (g->baked->maps[WEFT_BAKED_SPECULAR].n_mips > 0)
        weft_export_lose(g->job, "specular: F0 varies over the material; its mean is written");
    return WEFT_OK;
}

static void add_anisotropy(glb *g, json_t *extensions)
{
    const weft_baked *const b = g->baked;
    const double s = (double)b->maps[WEFT_BAKED_ANISOTROPY].constant[0];
    const double along = (double)b->maps[WEFT_BAKED_ROUGHNESS].constant[0], across = along * (1 - s);
    if (!(s > 0) || !(across < 1))
        return;
    const double strength = sqrt((along - across) / (1 - across));
    const double turn = atan2((double)b->maps[WEFT_BAKED_TANGENT].constant[1],
                              (double)b->maps[WEFT_BAKED_TANGENT].constant[0]);
    json_object_set_new(extensions, "KHR_materials_anisotropy",
                        json_pack("{s:f, s:f}", "anisotropyStrength", strength, "anisotropyRotation", turn));
    if (b->maps[WEFT_BAKED_ANISOTROPY].n_mips > 0 || b->maps[WEFT_BAKED_TANGENT].n_mips > 0)
        weft_export_lose(g->job, "anisotropy: its strength or direction varies; the mean is written");
}

enum { VIEWS = 8, WIDTHS = 32 };

/* Directional albedo of one lobe of unit colour at VIEWS cosines. */
static weft_err lobe_albedo(const char *name, double alpha, double amplitude, double albedo[VIEWS],
                            weft_error *err)
{
    const weft_brdf *brdf;
    double values[WEFT_BRDF_MAX_PLANES];
    WEFT_TRY(weft_brdf_find(name, &brdf, err));
    weft_brdf_defaults(brdf, values);
    static const char *const ones[] = {"f0", "sheen"}, *const zeros[] = {"albedo"};
    char text[64];
    for (int k = 0; k < 2; k++)
        if (weft_brdf_find_param(brdf, ones[k], NULL)) {
            (void)snprintf(text, sizeof text, "%s=1", ones[k]);
            WEFT_TRY(weft_brdf_set(brdf, text, values, err));
        }
    if (weft_brdf_find_param(brdf, zeros[0], NULL))
        WEFT_TRY(weft_brdf_set(brdf, "albedo=0", values, err));
    (void)snprintf(text, sizeof text, "alpha=%.9g", alpha);
    WEFT_TRY(weft_brdf_set(brdf, text, values, err));
    if (weft_brdf_find_param(brdf, "amplitude", NULL)) {
        (void)snprintf(text, sizeof text, "amplitude=%.9g", amplitude);
        WEFT_TRY(weft_brdf_set(brdf, text, values, err));
    }
    for (int k = 0; k < VIEWS; k++) {
        double rgb[3];
        weft_brdf_albedo(brdf, values, (k + 0.5) / VIEWS, 0, WEFT_ALBEDO_QUICK, rgb);
        albedo[k] = rgb[0];
    }
    return WEFT_OK;
}

/* The Charlie sheen whose directional albedo is nearest to the cloth lobe's by least squares. */
static weft_err nearest_sheen(double cloth_alpha, double amplitude, double *width, double *scale,
                              double *left, weft_error *err)
{
    double wanted[VIEWS], norm = 0, best = INFINITY;
    WEFT_TRY(lobe_albedo("cloth", cloth_alpha, amplitude, wanted, err));
    for (int k = 0; k < VIEWS; k++)
        norm += wanted[k] * wanted[k];
    for (int step = 0; step < WIDTHS; step++) {
        const double alpha = 0.1 + 0.9 * step / (WIDTHS - 1);
        double sheen[VIEWS], both = 0, self = 0, rest = 0;
        WEFT_TRY(lobe_albedo("charlie", alpha, 0, sheen, err));
        for (int k = 0; k < VIEWS; k++) {
            both += wanted[k] * sheen[k];
            self += sheen[k] * sheen[k];
        }
        for (int k = 0; k < VIEWS; k++)
            rest += pow(wanted[k] - both / self * sheen[k], 2);
        if (rest < best) {
            best = rest;
            *width = alpha;
            *scale = both / self;
        }
    }
    *left = sqrt(best / norm);
    return WEFT_OK;
}

/* glTF has no cloth of The Order; where the share of cloth varies, so does the sheen. */
static weft_err add_sheen(glb *g, json_t *extensions, weft_error *err)
{
    static const weft_channels channels = {{"cloth", "cloth", "cloth", NULL}, 8, true};
    const weft_baked *const b = g->baked;
    const bool varies = weft_channel_varies(b, "cloth");
    const double cloth = varies ? 1 : (double)b->maps[WEFT_BAKED_CLOTH].constant[0];
    double width = 0.5, scale = 0, left = 0, colour[3];
    if (!(cloth > 0))
        return WEFT_OK;
    WEFT_TRY(nearest_sheen((double)b->maps[weft_baked_of_cloth(b, WEFT_BAKED_ROUGHNESS)].constant[0],
                           (double)b->maps[WEFT_BAKED_RIM_AMPLITUDE].constant[0], &width, &scale, &left,
                           err));
    for (int p = 0; p < 3; p++)
        colour[p] =
            fmin(cloth * scale * (double)b->maps[weft_baked_of_cloth(b, WEFT_BAKED_SPECULAR)].constant[p] *
                     (double)b->maps[WEFT_BAKED_RIM_TINT].constant[p],
                 1);
    json_t *const sheen =
        json_pack("{s:o, s:f}", "sheenColorFactor", numbers(colour, 3), "sheenRoughnessFactor", sqrt(width));
    json_object_set_new(extensions, "KHR_materials_sheen", sheen);
    if (varies) {
        int index;
        WEFT_TRY(add_picture(g, "sheenColor", &channels, &index, err));
        json_object_set_new(sheen, "sheenColorTexture", texture(index));
    }
    weft_export_lose(
        g->job,
        "cloth lobe: written as the nearest sheen, which leaves %.0f %% rms of its directional albedo",
        100 * left);
    if (b->two_lobes)
        weft_export_lose(g->job,
                         "two lobes: glTF lays sheen over one surface; its colour is that of both together");
    return WEFT_OK;
}

static weft_err add_material(glb *g, weft_error *err)
{
    json_t *const material = json_object(), *const pbr = json_object(), *const extensions = json_object();
    json_object_set_new(g->root, "materials", json_pack("[o]", material));
    json_object_set_new(material, "name", json_string(g->baked->name));
    json_object_set_new(material, "pbrMetallicRoughness", pbr);
    json_object_set_new(material, "doubleSided", json_true());
    weft_err status = add_base_colour(g, material, pbr, err);
    if (status == WEFT_OK)
        status = add_roughness(g, material, pbr, err);
    if (status == WEFT_OK)
        status = add_normal(g, material, err);
    if (status == WEFT_OK)
        status = add_sheen(g, extensions, err);
    if (status == WEFT_OK)
        status = add_specular(g, extensions, err);
    add_anisotropy(g, extensions);
    json_t *const used = json_array();
    const char *name;
    json_t *value;
    json_object_foreach(extensions, name, value) json_array_append_new(used, json_string(name));
    if (json_array_size(used) > 0)
        json_object_set(material, "extensions", extensions);
    if (g->ktx2 && json_array_size(g->textures) > 0) {
        json_array_append_new(used, json_string("KHR_texture_basisu"));
        json_object_set_new(g->root, "extensionsRequired", json_pack("[s]", "KHR_texture_basisu"));
    }
    if (json_array_size(used) > 0)
        json_object_set(g->root, "extensionsUsed", used);
    json_t *const extras =
        json_pack("{s:o, s:s}", "size_mm", numbers(g->baked->size_mm, 2), "model", weft_baked_brdf(g->baked));
    if (g->job->has_layers)
        json_object_set_new(extras, "runtime_layers", json_string("layers/layers.json"));
    json_object_set_new(material, "extras", extras);
    json_decref(used);
    json_decref(extensions);
    return status;
}

/* -- the container ------------------------------------------------------------------------------------ */

/* Header, the JSON padded with blanks, the binary padded with zeros (glTF 2.0, section 4). */
static weft_err write_glb(const glb *g, const char *path, weft_error *err)
{
    char *const json = json_dumps(g->root, JSON_COMPACT | JSON_PRESERVE_ORDER | JSON_REAL_PRECISION(9));
    weft_text_buffer out = {0};
    if (!json)
        return weft_fail(err, WEFT_ERR_NOMEM, "out of memory");
    const size_t n_json = strlen(json), pad = (4 - n_json % 4) % 4, pad_bin = (4 - g->bin.n % 4) % 4;
    const size_t total = 12 + 8 + n_json + pad + 8 + g->bin.n + pad_bin;
    if (total > UINT32_MAX) {
        free(json);
        return weft_fail(err, WEFT_ERR_RANGE,
                         "%s: would have %zu bytes, a .glb has at most 4 GiB; give a smaller --size", path,
                         total);
    }
    weft_text_add_bytes(&out, "glTF", 4);
    weft_text_add_le(&out, 2, 4);
    weft_text_add_le(&out, total, 4);
    weft_text_add_le(&out, n_json + pad, 4);
    weft_text_add_bytes(&out, "JSON", 4);
    weft_text_add_bytes(&out, json, n_json);
    weft_text_add_bytes(&out, "   ", pad);
    weft_text_add_le(&out, g->bin.n + pad_bin, 4);
    weft_text_add_bytes(&out, "BIN\0", 4);
    weft_text_add_bytes(&out, g->bin.text, g->bin.n);
    weft_text_add_bytes(&out, "\0\0\0", pad_bin);
    weft_err status = weft_text_buffer_status(&out, err);
    if (status == WEFT_OK)
        status = weft_file_write(path, out.text, out.n, err);
    weft_text_buffer_fini(&out);
    free(json);
    return status;
}

static weft_err write_swatch(const weft_export_job *job, bool ktx2, weft_error *err)
{
    glb g = {.job = job,
             .baked = job->baked,
             .ktx2 = ktx2,
             .root = json_object(),
             .views = json_array(),
             .images = json_array(),
             .textures = json_array()};
    char *const path = weft_asprintf(err, "%s/%s.glb", job->folder, job->baked->name);
    weft_err status = path ? WEFT_OK : WEFT_ERR_NOMEM;
    json_object_set_new(g.root, "asset",
                        json_pack("{s:s, s:s}", "version", "2.0", "generator", "Weft " WEFT_VERSION));
    if (status == WEFT_OK) {
        status = add_material(&g, err);
        add_swatch(&g);
    }
    if (json_array_size(g.textures) > 0) {
        json_object_set(g.root, "images", g.images);
        json_object_set(g.root, "textures", g.textures);
        json_object_set_new(g.root, "samplers",
                            json_pack("[{s:i, s:i, s:i, s:i}]", "magFilter", 9729, "minFilter", 9987, "wrapS",
                                      10497, "wrapT", 10497));
    }
    json_object_set(g.root, "bufferViews", g.views);
    json_object_set_new(g.root, "buffers", json_pack("[{s:I}]", "byteLength", (json_int_t)g.bin.n));
    if (status == WEFT_OK)
        status = weft_text_buffer_status(&g.bin, err);
    if (status == WEFT_OK)
        status = write_glb(&g, path, err);
    if (!(job->baked->size_mm[0] > 0))
        weft_export_lose(job, "size: unknown, the swatch is 0.1 m wide; set :width_mm");
    if (!ktx2)
        weft_export_lose(job,
                         "mips: PNG has one level; readers average roughness as if normals were not there");
    weft_export_lose(job, "height, cavity, curvature, bent cones: glTF has no place for them");
    json_decref(g.root);
    json_decref(g.views);
    json_decref(g.images);
    json_decref(g.textures);
    weft_text_buffer_fini(&g.bin);
    weft_free(path);
    return status;
}

static weft_err write(const weft_export_job *job, weft_error *err)
{
    return write_swatch(job, false, err);
}

static weft_err write_ktx2(const weft_export_job *job, weft_error *err)
{
    const int own[2] = {job->baked->width, job->baked->height};
    int size[2];
    weft_ktx2_size(job->baked, WEFT_KTX2_UASTC, size);
    if (memcmp(own, size, sizeof own) != 0)
        weft_export_lose(job,
                         "size in texels: glTF wants KTX2 of sides that are multiples of 4; the pictures of "
                         "%d x %d are stretched to %d x %d",
                         own[0], own[1], size[0], size[1]);
    weft_export_lose(job, "pictures: UASTC keeps 8 bits a texel; the EXR maps have the rest");
    return write_swatch(job, true, err);
}

const weft_exporter weft_exporter_gltf = {
    .name = "gltf",
    .summary = "a .glb: a swatch of true size with sheen, anisotropy and specular extensions",
    .version = 2,
    .write = write,
};

const weft_exporter weft_exporter_gltf_ktx2 = {
    .name = "gltf-ktx2",
    .summary = "the same with KTX2 pictures (UASTC) that carry the filtered mips",
    .version = 2,
    .write = write_ktx2,
};
