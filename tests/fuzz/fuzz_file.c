/*
 * libFuzzer over every reader of files.  One program per reader, chosen by WEFT_FUZZ_READER;
 * the bytes go through a memory file, so that the real reader opens a real path.  A crash, a sanitizer report
 * or a read that never ends is a defect; an error is what damaged bytes are supposed to give.
 */
#include "calibration/calibration.h"
#include "core/csv.h"
#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/formats/ihex_file.h"
#include "core/formats/jpeg_bytes.h"
#include "core/formats/png_file.h"
#include "core/formats/raw_file.h"
#include "core/formats/tiff_file.h"
#include "core/log.h"
#include "core/mem.h"
#include "host/rig/scene.h"
#include "host/set/import_list.h"
#include "host/set/maps.h"
#include "host/set/set.h"
#include "shading/bake/material_file.h"
#include "shading/brdf/merl.h"
#include "shading/material/asset.h"
#include "shading/u3m/u3m_document.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

static void read_png(const char *path)
{
    weft_raster raster;
    if (weft_png_read(path, &raster, NULL) == WEFT_OK)
        weft_raster_fini(&raster);
}

static void read_tiff(const char *path)
{
    weft_raster raster;
    if (weft_tiff_read(path, &raster, NULL) == WEFT_OK)
        weft_raster_fini(&raster);
}

static void read_exr(const char *path)
{
    static const char *const names[] = {"X|R|Y", "Y|G", "Z|B"};
    weft_image image;
    char *channels;
    if (weft_exr_read(path, names, 1, &image, NULL) == WEFT_OK)
        weft_image_fini(&image);
    if (weft_exr_read(path, names, 3, &image, NULL) == WEFT_OK)
        weft_image_fini(&image);
    if (weft_exr_channels(path, &channels, NULL) == WEFT_OK)
        weft_free(channels);
}

static void read_raw(const char *path)
{
    weft_mosaic mosaic;
    weft_frame_info info;
    if (weft_raw_read(path, &mosaic, &info, NULL) == WEFT_OK)
        weft_mosaic_fini(&mosaic);
}

/* A folder that holds the input under `name`, by a link; the same at each call. */
static const char *folder_with(const char *name, const char *path)
{
    static char folder[32] = "";
    char link[64];
    if (!folder[0]) {
        snprintf(folder, sizeof folder, "/tmp/weft-fuzz-XXXXXX");
        if (!mkdtemp(folder))
            abort();
    }
    snprintf(link, sizeof link, "%s/%s", folder, name);
    unlink(link);
    if (symlink(path, link) != 0)
        abort();
    return folder;
}

static void read_material(const char *path)
{
    weft_assets *assets;
    if (weft_assets_load(path, NULL, &assets, NULL) == WEFT_OK)
        for (int i = 0; weft_assets_get(assets, i); i++)
            weft_asset_print(weft_assets_get(assets, i), stdout);
    weft_assets_destroy(assets);
}

static void read_merl(const char *path)
{
    static const double up[3] = {0, 0, 1};
    weft_merl *merl;
    double f[3];
    if (weft_merl_read(path, &merl, NULL) != WEFT_OK)
        return;
    weft_brdf_eval_one(&merl->brdf, NULL, up, up, f);
    weft_merl_destroy(merl);
}

/* An archive, whole: its document and all its pictures. */
static void read_u3ma(const char *path)
{
    char archive[64];
    weft_u3m *u3m;
    weft_baked baked;
    int width, height;
    snprintf(archive, sizeof archive, "%s/x.u3ma", folder_with("x.u3ma", path));
    weft_log_set_level(WEFT_LOG_QUIET);
    if (weft_u3m_open(archive, &u3m, NULL) != WEFT_OK)
        return;
    if (weft_u3m_measure(u3m, &width, &height, NULL) == WEFT_OK &&
        weft_u3m_bake(u3m, 4, 4, u3m->size_mm, &baked, NULL) == WEFT_OK)
        weft_baked_fini(&baked);
    weft_u3m_close(u3m);
}

static void read_set(const char *path)
{
    weft_set set;
    if (weft_set_load(folder_with("set.json", path), &set, NULL) == WEFT_OK)
        weft_set_fini(&set);
}

static void read_calibration(const char *path)
{
    weft_calibration cal;
    if (weft_calibration_load(folder_with("calibration.json", path), &cal, NULL) == WEFT_OK)
        weft_calibration_fini(&cal);
}

static void read_csv(const char *path)
{
    weft_csv csv;
    double value;
    if (weft_csv_read(path, &csv, NULL) != WEFT_OK)
        return;
    for (int row = 0; row < csv.rows; row++)
        for (int column = 0; column < csv.columns; column++)
            (void)weft_csv_number(&csv, row, column, path, &value, NULL);
    weft_csv_fini(&csv);
}

/* The firmware that is flashed. */
static void read_ihex(const char *path)
{
    uint8_t memory[32768];
    uint32_t begin, end;
    if (weft_ihex_read(path, memory, sizeof memory, &begin, &end, NULL) == WEFT_OK && end > sizeof memory)
        abort();
}

static void read_jpeg(const char *path)
{
    char *bytes;
    size_t n;
    weft_raster raster;
    if (weft_file_read(path, (size_t)1 << 24, &bytes, &n, NULL) != WEFT_OK)
        return;
    if (weft_jpeg_decode((const unsigned char *)bytes, n, &raster, NULL) == WEFT_OK)
        weft_raster_fini(&raster);
    weft_free(bytes);
}

/* The head of a folder of maps, whose picture is in order. */
static void read_maps(const char *path)
{
    static const char *const names[] = {"X", "Y", "Z"};
    char normal[64];
    weft_maps maps;
    const char *const folder = folder_with("maps.json", path);
    snprintf(normal, sizeof normal, "%s/normal.exr", folder);
    if (!weft_file_exists(normal)) {
        weft_image image;
        if (weft_image_init(&image, 3, 2, 3, NULL) != WEFT_OK ||
            weft_exr_write(normal, &image, names, WEFT_EXR_HALF, NULL) != WEFT_OK)
            abort();
        weft_image_fini(&image);
    }
    if (weft_maps_load(folder, &maps, NULL) == WEFT_OK)
        weft_maps_fini(&maps);
}

static void read_baked(const char *path)
{
    weft_baked baked = {0};
    json_t *state = NULL;
    if (weft_material_load_head(folder_with("material.json", path), &baked, &state, NULL) != WEFT_OK)
        return;
    json_decref(state);
    weft_baked_fini(&baked);
}

static void read_directions(const char *path)
{
    weft_import_list list;
    weft_log_set_level(WEFT_LOG_QUIET);
    if (weft_import_read_directions(folder_with("light_directions.txt", path), &list, NULL) == WEFT_OK)
        weft_import_list_fini(&list);
}

static void read_scene(const char *path)
{
    weft_rig_setup setup;
    weft_rig_setup_init(&setup);
    (void)weft_rig_setup_load(path, &setup, NULL);
}

static void read_lp(const char *path)
{
    weft_import_list list;
    weft_log_set_level(WEFT_LOG_QUIET);
    if (weft_import_read_lp(path, &list, NULL) == WEFT_OK)
        weft_import_list_fini(&list);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n)
{
    char path[64];
    const int fd = memfd_create("input", 0);
    if (fd < 0 || write(fd, bytes, n) != (ssize_t)n) {
        perror("memfd");
        return 1;
    }
    snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
    WEFT_FUZZ_READER(path);
    close(fd);
    return 0;
}
