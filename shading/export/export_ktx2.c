/*
 * KTX 2.0 textures with the whole chain of filtered mips, RGBA of 8 bits: what an engine can load as it is,
 * without making mips of its own that forget what normals do to roughness.
 */
#include "shading/export/exporter.h"

#include "core/file.h"
#include "core/mem.h"
#include "core/text_buffer.h"
#include "shading/export/ktx2.h"

static weft_err write_texture(const weft_export_job *job, const char *suffix, const weft_channels *channels,
                              weft_error *err)
{
    weft_text_buffer out = {0};
    char *const path = weft_asprintf(err, "%s/%s_%s.ktx2", job->folder, job->baked->name, suffix);
    weft_err status =
        path ? weft_ktx2_encode(job->baked, channels, WEFT_KTX2_RGBA8, &out, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = weft_file_write(path, out.text, out.n, err);
    weft_text_buffer_fini(&out);
    weft_free(path);
    return status;
}

static weft_err write(const weft_export_job *job, weft_error *err)
{
    static const struct {
        const char *suffix;
        weft_channels channels;
    } textures[] = {{"base_color", {{"base.r", "base.g", "base.b", "opacity"}, 8, true}},
                    {"normal", {{"normal.x", "normal.y", "normal.z", "one"}, 8, false}},
                    {"orm", {{"occlusion", "roughness", "metallic", "one"}, 8, false}}};
    for (size_t i = 0; i < sizeof textures / sizeof textures[0]; i++) {
        bool varies = false;
        for (int c = 0; c < 4; c++)
            varies = varies || weft_channel_varies(job->baked, textures[i].channels.names[c]);
        if (varies)
            WEFT_TRY(write_texture(job, textures[i].suffix, &textures[i].channels, err));
    }
    weft_export_lose(job, "cloth lobe, anisotropy, height: not in these textures");
    if (job->baked->two_lobes)
        weft_export_lose(job, "two lobes: roughness is the smooth part's, the colour is that of both");
    return WEFT_OK;
}

const weft_exporter weft_exporter_ktx2 = {
    .name = "ktx2",
    .summary = "KTX 2.0 textures that carry the filtered mips",
    .version = 2,
    .write = write,
};
