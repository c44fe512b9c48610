/* MaterialX 1.39: an OpenPBR surface with tiled pictures at true size. */
#include "shading/export/exporter.h"

#include "core/file.h"
#include "core/formats/png_file.h"
#include "core/mem.h"
#include "shading/export/channels.h"

#include <math.h>
#include <string.h>

typedef struct mtlx {
    const weft_export_job *job;
    const weft_baked *baked;
    weft_text_buffer nodes, inputs;
} mtlx;

static weft_err write_picture(const mtlx *m, const char *name, const weft_channels *channels, weft_error *err)
{
    weft_raster raster = {0};
    char *const path = weft_asprintf(err, "%s/%s.png", m->job->folder, name);
    weft_err status = path ? weft_channels_raster(m->baked, channels, 0, &raster, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = weft_png_write(path, &raster, err);
    weft_raster_fini(&raster);
    weft_free(path);
    return status;
}

/* A picture node and the input that takes it, or a constant. */
static weft_err add_input(mtlx *m, const char *input, const char *type, const weft_channels *channels,
                          const char *constant, weft_error *err)
{
    if (!channels || !weft_channel_varies(m->baked, channels->names[0])) {
        weft_text_add(&m->inputs, "    <input name=\"%s\" type=\"%s\" value=\"%s\" />\n", input, type,
                      constant);
        return WEFT_OK;
    }
    WEFT_TRY(write_picture(m, input, channels, err));
    weft_text_add(&m->nodes,
                  "  <tiledimage name=\"%s\" type=\"%s\">\n"
                  "    <input name=\"file\" type=\"filename\" value=\"%s.png\"%s />\n"
                  "    <input name=\"uvtiling\" type=\"vector2\" value=\"1, 1\" />\n"
                  "  </tiledimage>\n",
                  input, type, input, channels->srgb ? " colorspace=\"srgb_texture\"" : "");
    weft_text_add(&m->inputs, "    <input name=\"%s\" type=\"%s\" nodename=\"%s\" />\n", input, type, input);
    return WEFT_OK;
}

static weft_err add_normal(mtlx *m, weft_error *err)
{
    static const weft_channels channels = {{"normal.x", "normal.y", "normal.z", NULL}, 16, false};
    if (!weft_channel_varies(m->baked, "normal.x"))
        return WEFT_OK;
    WEFT_TRY(write_picture(m, "geometry_normal", &channels, err));
    weft_text_add(&m->nodes, "  <tiledimage name=\"normal_picture\" type=\"vector3\">\n"
                             "    <input name=\"file\" type=\"filename\" value=\"geometry_normal.png\" />\n"
                             "  </tiledimage>\n"
                             "  <normalmap name=\"normal\" type=\"vector3\">\n"
                             "    <input name=\"in\" type=\"vector3\" nodename=\"normal_picture\" />\n"
                             "  </normalmap>\n");
    weft_text_add(&m->inputs,
                  "    <input name=\"geometry_normal\" type=\"vector3\" nodename=\"normal\" />\n");
    return WEFT_OK;
}

/* OpenPBR 1.1: alpha_t = r^2 sqrt(2/(1 + (1 - a)^2)), alpha_b = (1 - a) alpha_t. */
static void openpbr_lobe(const weft_baked *b, double *roughness, double *anisotropy)
{
    const double s = (double)b->maps[WEFT_BAKED_ANISOTROPY].constant[0];
    const double along = (double)b->maps[WEFT_BAKED_ROUGHNESS].constant[0];
    *anisotropy = s;
    *roughness = fmin(sqrt(along / sqrt(2 / (1 + (1 - s) * (1 - s)))), 1);
}

static weft_err add_surface(mtlx *m, weft_error *err)
{
    static const weft_channels base = {{"base.r", "base.g", "base.b", NULL}, 8, true};
    static const weft_channels rough = {{"roughness", NULL}, 16, false},
                               opacity = {{"opacity", NULL}, 8, false}, cloth = {{"cloth", NULL}, 8, false};
    const weft_baked *const b = m->baked;
    char text[96];
    double roughness, anisotropy;
    openpbr_lobe(b, &roughness, &anisotropy);
    (void)snprintf(text, sizeof text, "%.6g, %.6g, %.6g", weft_channel_mean(b, "base.r"),
                   weft_channel_mean(b, "base.g"), weft_channel_mean(b, "base.b"));
    WEFT_TRY(add_input(m, "base_color", "color3", &base, text, err));
    (void)snprintf(text, sizeof text, "%.6g", roughness);
    WEFT_TRY(add_input(m, "specular_roughness", "float", &rough, text, err));
    (void)snprintf(text, sizeof text, "%.6g", anisotropy);
    WEFT_TRY(add_input(m, "specular_roughness_anisotropy", "float", NULL, text, err));
    (void)snprintf(text, sizeof text, "%.6g", weft_channel_mean(b, "metallic"));
    WEFT_TRY(add_input(m, "base_metalness", "float", NULL, text, err));
    const double root = sqrt(fmin((double)b->maps[WEFT_BAKED_SPECULAR].constant[1], 0.9));
    (void)snprintf(text, sizeof text, "%.6g", (1 + root) / (1 - root));
    WEFT_TRY(add_input(m, "specular_ior", "float", NULL, text, err));
    (void)snprintf(text, sizeof text, "%.6g", (double)b->maps[WEFT_BAKED_CLOTH].constant[0]);
    WEFT_TRY(add_input(m, "fuzz_weight", "float", &cloth, text, err));
    (void)snprintf(text, sizeof text, "%.6g",
                   sqrt((double)b->maps[weft_baked_of_cloth(b, WEFT_BAKED_ROUGHNESS)].constant[0]));
    WEFT_TRY(add_input(m, "fuzz_roughness", "float", NULL, text, err));
    (void)snprintf(text, sizeof text, "%.6g, %.6g, %.6g", (double)b->maps[WEFT_BAKED_RIM_TINT].constant[0],
                   (double)b->maps[WEFT_BAKED_RIM_TINT].constant[1],
                   (double)b->maps[WEFT_BAKED_RIM_TINT].constant[2]);
    WEFT_TRY(add_input(m, "fuzz_color", "color3", NULL, text, err));
    (void)snprintf(text, sizeof text, "%.6g", weft_channel_mean(b, "opacity"));
    WEFT_TRY(add_input(m, "geometry_opacity", "float", &opacity, text, err));
    return add_normal(m, err);
}

/* A swatch repeats every size_mm: the document's unit is the metre. */
static weft_err write_document(mtlx *m, weft_error *err)
{
    weft_text_buffer out = {0};
    char *const path = weft_asprintf(err, "%s/%s.mtlx", m->job->folder, m->baked->name);
    if (!path)
        return WEFT_ERR_NOMEM;
    weft_text_add(&out, "<?xml version=\"1.0\"?>\n<materialx version=\"1.39\" colorspace=\"lin_rec709\">\n");
    weft_text_add(&out, "  <!-- one repeat is %.6g x %.6g mm -->\n", m->baked->size_mm[0],
                  m->baked->size_mm[1]);
    if (m->nodes.text)
        weft_text_add_bytes(&out, m->nodes.text, m->nodes.n);
    weft_text_add(&out, "  <open_pbr_surface name=\"%s_surface\" type=\"surfaceshader\">\n", m->baked->name);
    if (m->inputs.text)
        weft_text_add_bytes(&out, m->inputs.text, m->inputs.n);
    weft_text_add(&out,
                  "  </open_pbr_surface>\n"
                  "  <surfacematerial name=\"%s\" type=\"material\">\n"
                  "    <input name=\"surfaceshader\" type=\"surfaceshader\" nodename=\"%s_surface\" />\n"
                  "  </surfacematerial>\n</materialx>\n",
                  m->baked->name, m->baked->name);
    weft_err status = weft_text_buffer_status(&out, err);
    if (status == WEFT_OK)
        status = weft_file_write(path, out.text, out.n, err);
    weft_text_buffer_fini(&out);
    weft_free(path);
    return status;
}

static weft_err write(const weft_export_job *job, weft_error *err)
{
    mtlx m = {.job = job, .baked = job->baked};
    weft_err status = add_surface(&m, err);
    if (status == WEFT_OK)
        status = write_document(&m, err);
    weft_text_buffer_fini(&m.nodes);
    weft_text_buffer_fini(&m.inputs);
    weft_export_lose(job, "cloth lobe: written as fuzz, whose shape is another");
    if (job->baked->two_lobes)
        weft_export_lose(job, "two lobes: fuzz lies over one surface; its colour is that of both together");
    weft_export_lose(job, "height: not connected, OpenPBR has no displacement; height.exr has millimetres");
    weft_export_lose(job, "mips: PNG has one level");
    return status;
}

const weft_exporter weft_exporter_mtlx = {
    .name = "mtlx",
    .summary = "MaterialX 1.39 with an OpenPBR surface",
    .version = 2,
    .write = write,
};
