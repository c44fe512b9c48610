#include "shading/export/exporter.h"

#include "core/file.h"

#include <stdio.h>
#include <string.h>

extern const weft_exporter weft_exporter_gltf, weft_exporter_gltf_ktx2;
extern const weft_exporter weft_exporter_mtlx;
extern const weft_exporter weft_exporter_png, weft_exporter_tiff;
extern const weft_exporter weft_exporter_u3m;
extern const weft_exporter weft_exporter_ktx2, weft_exporter_unreal, weft_exporter_unity_hdrp,
    weft_exporter_unity_urp;
extern const weft_exporter weft_exporter_godot, weft_exporter_blender;

/* One a line, so that a new one is one line. */
const weft_exporter *const weft_exporters[] = {
    &weft_exporter_png,        //
    &weft_exporter_tiff,       //
    &weft_exporter_gltf,       //
    &weft_exporter_gltf_ktx2,  //
    &weft_exporter_u3m,        //
    &weft_exporter_mtlx,       //
    &weft_exporter_ktx2,       //
    &weft_exporter_unreal,     //
    &weft_exporter_unity_hdrp, //
    &weft_exporter_unity_urp,  //
    &weft_exporter_godot,      //
    &weft_exporter_blender,    //
    NULL,
};

weft_err weft_exporter_find(const char *name, const weft_exporter **exporter, weft_error *err)
{
    char names[512] = "";
    for (const weft_exporter *const *e = weft_exporters; *e; e++) {
        if (strcmp((*e)->name, name) == 0) {
            *exporter = *e;
            return WEFT_OK;
        }
        const size_t n = strlen(names);
        (void)snprintf(names + n, sizeof names - n, "%s%s", n ? ", " : "", (*e)->name);
    }
    return weft_fail(err, WEFT_ERR_USAGE, "there is no exporter '%s'; there are: %s", name, names);
}

void weft_export_lose(const weft_export_job *job, const char *format, ...)
{
    char text[512];
    va_list list;
    va_start(list, format);
    (void)vsnprintf(text, sizeof text, format, list);
    va_end(list);
    json_array_append_new(job->lost, json_string(text));
}

char *weft_export_path(const weft_export_job *job, const char *name, weft_error *err)
{
    return weft_path_join(job->folder, name, err);
}
