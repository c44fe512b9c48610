/* Packed pictures for engines, as the data files of presets/ say: channel, green direction, coding, depth. */
#include "shading/export/exporter.h"

#include "core/embedded.h"
#include "core/formats/png_file.h"
#include "core/mem.h"
#include "shading/export/channels.h"

#include <string.h>

extern const weft_embedded weft_export_presets[];

static weft_err bad_preset(const char *preset, weft_error *err)
{
    return weft_fail(err, WEFT_ERR_FORMAT,
                     "preset %s: a file has suffix, bits, srgb and 1 to 4 known channels", preset);
}

static weft_err read_channels(const json_t *file, const char *preset, weft_channels *channels,
                              weft_error *err)
{
    const json_t *const names = json_object_get(file, "channels");
    const size_t n = json_array_size(names);
    *channels = (weft_channels){.bits = (int)json_integer_value(json_object_get(file, "bits")),
                                .srgb = json_is_true(json_object_get(file, "srgb"))};
    if (n < 1 || n > WEFT_CHANNELS_MAX || (channels->bits != 8 && channels->bits != 16))
        return bad_preset(preset, err);
    for (size_t i = 0; i < n; i++) {
        channels->names[i] = json_string_value(json_array_get(names, i));
        if (!channels->names[i] || !weft_channel_known(channels->names[i]))
            return bad_preset(preset, err);
    }
    return WEFT_OK;
}

/* A picture with a value that varies; one of constants alone is not worth a file. */
static bool is_wanted(const weft_baked *baked, const json_t *file, const weft_channels *channels)
{
    const char *const only_when = json_string_value(json_object_get(file, "only_when"));
    bool varies = false;
    for (int i = 0; i < WEFT_CHANNELS_MAX && channels->names[i]; i++)
        varies = varies || weft_channel_varies(baked, channels->names[i]);
    return varies && (!only_when || weft_channel_varies(baked, only_when));
}

static weft_err write_file(const weft_export_job *job, const json_t *file, const char *preset,
                           weft_error *err)
{
    weft_channels channels;
    weft_raster raster = {0};
    WEFT_TRY(read_channels(file, preset, &channels, err));
    if (!is_wanted(job->baked, file, &channels))
        return WEFT_OK;
    const char *const suffix = json_string_value(json_object_get(file, "suffix"));
    char *const path = weft_asprintf(err, "%s/%s%s.png", job->folder, job->baked->name, suffix ? suffix : "");
    weft_err status = path ? weft_channels_raster(job->baked, &channels, 0, &raster, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = weft_png_write(path, &raster, err);
    weft_raster_fini(&raster);
    weft_free(path);
    return status;
}

static void say_what_is_lost(const weft_export_job *job, const json_t *preset)
{
    size_t i;
    json_t *sentence;
    double range_mm[2];
    if ((double)job->baked->maps[WEFT_BAKED_CLOTH].constant[0] > 0)
        json_array_foreach(json_object_get(preset, "lost"), i, sentence)
            json_array_append(job->lost, sentence);
    if (job->baked->two_lobes)
        weft_export_lose(job,
                         "two lobes: roughness and F0 are the smooth part's, the colour is that of both");
    weft_channels_height_range(job->baked, range_mm);
    if (range_mm[1] > range_mm[0])
        weft_export_lose(job, "height: 0 is %.6g mm and white %.6g mm; the engine has to be told",
                         range_mm[0], range_mm[1]);
    if (job->baked->maps[WEFT_BAKED_ANISOTROPY].constant[0] > 0)
        weft_export_lose(job, "anisotropy: %.3g along the threads has no picture here",
                         (double)job->baked->maps[WEFT_BAKED_ANISOTROPY].constant[0]);
    weft_export_lose(
        job, "mips: the engine makes its own and forgets what normals do to roughness; ktx2 has ours");
}

static weft_err write_preset(const weft_export_job *job, const char *name, weft_error *err)
{
    char file_name[64];
    (void)snprintf(file_name, sizeof file_name, "%s.json", name);
    const weft_embedded *const embedded = weft_embedded_find(weft_export_presets, file_name);
    json_t *const preset =
        embedded ? json_loadb((const char *)embedded->bytes, embedded->size, 0, NULL) : NULL;
    weft_err status = preset ? WEFT_OK : bad_preset(name, err);
    size_t i;
    json_t *file;
    json_array_foreach(json_object_get(preset, "files"), i, file) if (status == WEFT_OK) status =
        write_file(job, file, name, err);
    if (status == WEFT_OK)
        say_what_is_lost(job, preset);
    json_decref(preset);
    return status;
}

#define PRESET(symbol, file, text)                                                                           \
    static weft_err write_##symbol(const weft_export_job *job, weft_error *err)                              \
    {                                                                                                        \
        return write_preset(job, file, err);                                                                 \
    }                                                                                                        \
    const weft_exporter weft_exporter_##symbol = {                                                           \
        .name = (file), .summary = (text), .version = 1, .write = write_##symbol}

PRESET(unreal, "unreal", "pictures packed for Unreal Engine: ORM, green down");
PRESET(unity_hdrp, "unity-hdrp", "pictures packed for Unity HDRP: mask map with smoothness");
PRESET(unity_urp, "unity-urp", "pictures packed for Unity URP: metallic and smoothness");
PRESET(godot, "godot", "pictures packed for Godot 4: ORM");
PRESET(blender, "blender", "pictures for Blender's Principled BSDF, one a parameter");
