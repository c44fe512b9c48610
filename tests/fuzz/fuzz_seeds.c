/* fuzz_seeds FOLDER: writes small valid files for the fuzzers to start from: FOLDER/png/..., tiff, ...
 */
#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/formats/jpeg_bytes.h"
#include "core/formats/png_file.h"
#include "core/formats/tiff_file.h"
#include "core/formats/zip_file.h"
#include "core/log.h"
#include "firmware/protocol.h"

#include <stdio.h>
#include <string.h>

static weft_err seed_path(const char *folder, const char *reader, const char *name, char path[1024],
                          weft_error *err)
{
    snprintf(path, 1024, "%s/%s", folder, reader);
    WEFT_TRY(weft_folder_create(path, err));
    snprintf(path, 1024, "%s/%s/%s", folder, reader, name);
    return WEFT_OK;
}

static weft_err write_rasters(const char *folder, weft_error *err)
{
    for (int channels = 1; channels <= 3; channels += 2)
        for (int bits = 8; bits <= 16; bits += 8) {
            char path[1024], name[32];
            weft_raster raster;
            WEFT_TRY(weft_raster_init(&raster, 9, 7, channels, bits, err));
            for (int i = 0; i < 9 * 7 * channels; i++)
                raster.data[i] = (uint16_t)(i * 3);
            snprintf(name, sizeof name, "%d-%d", channels, bits);
            weft_err status = seed_path(folder, "png", name, path, err);
            if (status == WEFT_OK)
                status = weft_png_write(path, &raster, err);
            if (status == WEFT_OK)
                status = seed_path(folder, "tiff", name, path, err);
            if (status == WEFT_OK)
                status = weft_tiff_write(path, &raster, err);
            weft_raster_fini(&raster);
            WEFT_TRY(status);
        }
    return WEFT_OK;
}

static weft_err write_exrs(const char *folder, weft_error *err)
{
    static const char *const names[] = {"R", "G", "B"};
    weft_image image;
    char path[1024];
    WEFT_TRY(weft_image_init(&image, 9, 7, 3, err));
    for (int i = 0; i < 9 * 7 * 3; i++)
        image.data[i] = (float)i;
    weft_err status = seed_path(folder, "exr", "half", path, err);
    if (status == WEFT_OK)
        status = weft_exr_write(path, &image, names, WEFT_EXR_HALF, err);
    if (status == WEFT_OK)
        status = seed_path(folder, "exr", "float", path, err);
    if (status == WEFT_OK)
        status = weft_exr_write(path, &image, names, WEFT_EXR_FLOAT, err);
    weft_image_fini(&image);
    return status;
}

static weft_err write_raws(const char *folder, weft_error *err)
{
    weft_mosaic mosaic;
    char path[1024];
    WEFT_TRY(weft_mosaic_init(&mosaic, 32, 24, WEFT_CFA_RGGB, err));
    for (int i = 0; i < 32 * 24; i++)
        mosaic.data[i] = (uint16_t)(256 + i);
    const weft_frame_info info = {.exposure_s = 0.04, .gain = 1, .make = "Weft", .model = "seed"};
    weft_err status = seed_path(folder, "raw", "dng", path, err);
    if (status == WEFT_OK)
        status = weft_dng_write(path, &mosaic, &info, err);
    weft_mosaic_fini(&mosaic);
    return status;
}

static weft_err write_texts(const char *folder, weft_error *err)
{
    static const char material[] =
        ":a := ( clothmaterial :rim_tint_color = #ff8000 // x\n :mask = ( :name = \"m\" ) )\n"
        ":b := ( a :layers = [ ( a :alpha = 0.5 ) ] :tiling = [1, 2e0] )\n";
    static const char lp[] = "2\na.png 0 0 1\n\"b c.png\" 0,6 0 0.8\n";
    static const char set[] =
        "{\"weft\":\"set\",\"version\":1,\"name\":\"s\",\"created\":\"2026-11-23T10:00:00Z\",\"camera\":{},"
        "\"sensor\":{\"width\":32,\"height\":24,\"cfa\":\"RGGB\",\"black\":[0,0,0,0],\"white\":4095},"
        "\"frames\":[{\"file\":\"a.dng\",\"role\":\"light\",\"light\":0,\"exposure_s\":0.1,\"gain\":1.0}],"
        "\"state\":\"complete\"}";
    static const char cal[] =
        "{\"weft\":\"calibration\",\"version\":1,\"lights\":[{\"position_mm\":[0,0,300],\"axis\":[0,0,-1],"
        "\"exponent\":1,\"intensity\":[1,1,1]}]}";
    static const char csv[] = "x,\"y \"\"z\"\r\n1,2e-3\n\"3\n\",nan\n";
    static const char ihex[] = ":10010000214601360121470136007EFE09D2190140\n:020000021000EC\n:00000001FF\n";
    static const char maps[] =
        "{\"weft\":\"maps\",\"version\":1,\"geometry\":\"plane\",\"mm_per_px\":0.1,\"origin_mm\":[0,0],"
        "\"albedo_colour\":\"linear sRGB\",\"width\":3,\"height\":2}";
    static const char directions[] = "0 0 1\n0.6,0,0.8\n";
    static const char scene[] = "{\"weft\":\"scene\",\"version\":1,\"seed\":2,\"noise\":false,\"room_light\":"
                                "0.1,\"strip_mm\":[0,0,9,9],"
                                "\"lights\":[{\"position_mm\":[0,0,300],\"axis\":[0,0,-1],\"power\":1}],"
                                "\"sheet\":{\"bow_mm\":[1,0]}}";
    static const char baked[] =
        "{\"weft\":\"material\",\"version\":1,\"name\":\"a\",\"type\":\"clothmaterial\",\"width\":8,"
        "\"height\":8,"
        "\"size_mm\":[10,10],\"periodic\":true,\"maps\":{\"albedo\":{\"mips\":4,\"constant\":[1,1,1]}}}";
    const struct {
        const char *reader, *text;
        size_t n;
    } texts[] = {{"lp", lp, sizeof lp - 1},
                 {"csv", csv, sizeof csv - 1},
                 {"ihex", ihex, sizeof ihex - 1},
                 {"maps", maps, sizeof maps - 1},
                 {"directions", directions, sizeof directions - 1},
                 {"scene", scene, sizeof scene - 1},
                 {"baked", baked, sizeof baked - 1},
                 {"material", material, sizeof material - 1},
                 {"set", set, sizeof set - 1},
                 {"calibration", cal, sizeof cal - 1}};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        char path[1024];
        WEFT_TRY(seed_path(folder, texts[i].reader, "small", path, err));
        WEFT_TRY(weft_file_write(path, texts[i].text, texts[i].n, err));
    }
    return WEFT_OK;
}

static weft_err write_jobs(const char *folder, weft_error *err)
{
    static const char *const jobs[] = {
        "{\"command\":\"solve\",\"operands\":[\"a.set\"],\"options\":{\"calibration\":\"a.cal\",\"output\":"
        "\"a.maps\",\"force\":true}}",
        "{\"command\":\"capture\",\"operands\":[\"a.set\"],\"options\":{\"exposure\":0.04,\"bracket\":3}}",
        "{\"command\":\"preview\",\"operands\":[\"a\"],\"options\":{\"output\":\"a.png\",\"light\":[1,2],"
        "\"param\":"
        "[\"a=1\"]},\"format\":\"text\",\"hold\":false}",
        "/v1/jobs/12/log%20",
    };
    for (size_t i = 0; i < sizeof jobs / sizeof jobs[0]; i++) {
        char path[1024], name[8];
        snprintf(name, sizeof name, "%zu", i);
        WEFT_TRY(seed_path(folder, "job", name, path, err));
        WEFT_TRY(weft_file_write(path, jobs[i], strlen(jobs[i]), err));
    }
    return WEFT_OK;
}

static weft_err write_frame(const char *folder, weft_error *err)
{
    const weft_frame frame = {.version = 1, .n = 3, .payload = {1, 0, 2}};
    uint8_t wire[WEFT_FRAME_WIRE_MAX];
    char path[1024];
    const size_t n = weft_frame_encode(&frame, wire);
    WEFT_TRY(seed_path(folder, "frame", "small", path, err));
    return weft_file_write(path, wire, n - 1, err);
}

static weft_err write_jpeg(const char *folder, weft_error *err)
{
    uint8_t rgb[16 * 16 * 3];
    unsigned char *bytes;
    size_t n;
    char path[1024];
    for (size_t i = 0; i < sizeof rgb; i++)
        rgb[i] = (uint8_t)(i * 7);
    WEFT_TRY(weft_jpeg_encode(rgb, 16, 16, 90, &bytes, &n, err));
    weft_err status = seed_path(folder, "jpeg", "small", path, err);
    if (status == WEFT_OK)
        status = weft_file_write(path, bytes, n, err);
    weft_jpeg_free(bytes);
    return status;
}

/* The parameters that are read, as constants. */
static weft_err write_archive(const char *folder, weft_error *err)
{
#define NUMBER(key) "\"" key "\":{\"constant\":0.5,\"texture\":null},"
    static const char document[] =
        "{\"schema\":\"1.1\",\"custom\":null,\"material\":{\"name\":\"x\",\"front\":{" NUMBER("metalness")
            NUMBER("specular_value") NUMBER("roughness") NUMBER("anisotropy_value")
                NUMBER("anisotropy_rotation") NUMBER("alpha") NUMBER("normal") NUMBER("displacement")
                    NUMBER("sheen_value") NUMBER("basecolor") "\"shader\":\"principled\"}}}";
#undef NUMBER
    const weft_zip_entry entries[] = {{"x.u3m", document, sizeof document - 1}, {"a/b.png", "x", 1}};
    char path[1024];
    WEFT_TRY(seed_path(folder, "u3ma", "constants", path, err));
    return weft_zip_write(path, entries, 2, 1700000000, err);
}

int main(int argc, char **argv)
{
    weft_error error = {0};
    if (argc != 2) {
        fputs("usage: fuzz_seeds FOLDER\n", stderr);
        return 2;
    }
    static weft_err (*const writers[])(const char *, weft_error *) = {
        write_rasters, write_exrs,  write_raws, write_texts,
        write_jobs,    write_frame, write_jpeg, write_archive};
    weft_err status = WEFT_OK;
    for (size_t i = 0; i < sizeof writers / sizeof writers[0] && status == WEFT_OK; i++)
        status = writers[i](argv[1], &error);
    if (status != WEFT_OK)
        weft_log_error("%s", error.text);
    return weft_err_exit_status(status);
}
