/*
 * From the camera to a DNG on the disk, against plainly copying the same bytes: a GigE Vision camera on
 * loopback (which draws each frame, and that takes its time), in this process and in its helper.
 */
#include "core/file.h"
#include "core/formats/tiff_file.h"
#include "core/mem.h"
#include "core/progress.h"
#include "host/camera/camera.h"
#include "host/camera/camera_message.h"
#include "tests/host/fake_camera.h"
#include "tests/support/support.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { W = 2464, H = 1632, BYTES = 2 * W * H, N_FRAMES = 20 };

extern const weft_camera_backend weft_camera_aravis;

static fake_camera fake;
static double copy_s;

static void must(weft_err status, const weft_error *error)
{
    if (status == WEFT_OK)
        return;
    fprintf(stderr, "bench_capture: %s\n", error->text);
    fake_camera_kill(&fake);
    _Exit(1);
}

static void report(const char *what, double seconds)
{
    printf("  %-58s %7.2f ms  %7.1f MB/s  %6.1f frames/s  %6.2f x\n", what, 1e3 * seconds,
           1e-6 * BYTES / seconds, 1 / seconds, copy_s > 0 ? seconds / copy_s : 1);
}

static void expose(weft_camera_device *camera, weft_captured_frame *frame)
{
    weft_error error = {0};
    for (int try = 0; try < 5; try++) {
        must(weft_camera_expose(camera, 2, frame, &error), &error);
        if (frame->status == WEFT_FRAME_COMPLETE)
            return;
    }
    must(weft_fail(&error, WEFT_ERR_DEVICE, "%s", frame->reason), &error);
}

/* @param path  where each frame goes; NULL: nowhere.  @return seconds a frame */
static double time_camera(weft_camera_device *camera, weft_captured_frame *frame, const char *path)
{
    weft_error error = {0};
    expose(camera, frame); /* starts the stream */
    const double start_s = weft_clock_s();
    for (int i = 0; i < N_FRAMES; i++) {
        expose(camera, frame);
        if (path)
            must(weft_dng_write(path, &frame->mosaic, &(weft_frame_info){.exposure_s = 1e-5, .gain = 1},
                                &error),
                 &error);
    }
    return (weft_clock_s() - start_s) / N_FRAMES;
}

static double time_camera_on(weft_camera_device *camera, weft_captured_frame *frame, const char *path)
{
    weft_error error = {0};
    must(weft_camera_configure(camera, &(weft_camera_settings){.exposure_s = 1e-5}, &error), &error);
    const double seconds = time_camera(camera, frame, path);
    weft_camera_close(camera);
    return seconds;
}

static double time_dng(const weft_mosaic *mosaic, const char *path)
{
    weft_error error = {0};
    const double start_s = weft_clock_s();
    for (int i = 0; i < N_FRAMES; i++)
        must(weft_dng_write(path, mosaic, &(weft_frame_info){.exposure_s = 1e-5, .gain = 1}, &error), &error);
    return (weft_clock_s() - start_s) / N_FRAMES;
}

/* The same bytes from memory to a file that is on the disk, under its final name. */
static double time_copy(const weft_mosaic *mosaic, const char *path)
{
    weft_error error = {0};
    const double start_s = weft_clock_s();
    for (int i = 0; i < N_FRAMES; i++)
        must(weft_file_write(path, mosaic->data, BYTES, &error), &error);
    return (weft_clock_s() - start_s) / N_FRAMES;
}

/* What the shared memory between helper and program costs: into sealed memory, and out of it. */
static double time_shared(const weft_mosaic *mosaic, uint16_t *to)
{
    const double start_s = weft_clock_s();
    for (int i = 0; i < N_FRAMES; i++) {
        const int fd = weft_camera_sealed_memory(mosaic->data, BYTES, NULL, 0);
        for (ssize_t done = 0, n = 1; done < BYTES && n > 0; done += n)
            n = pread(fd, (char *)to + done, (size_t)(BYTES - done), done);
        close(fd);
    }
    return (weft_clock_s() - start_s) / N_FRAMES;
}

static double time_memcpy(const weft_mosaic *mosaic, uint16_t *to)
{
    const double start_s = weft_clock_s();
    for (int i = 0; i < N_FRAMES; i++)
        memcpy(to, mosaic->data + i, BYTES - 2 * N_FRAMES);
    return (weft_clock_s() - start_s) / N_FRAMES;
}

int main(void)
{
    char folder[] = "bench-capture-XXXXXX", path[64], size[32];
    weft_captured_frame frame = {0};
    weft_camera_device *camera = NULL;
    weft_error error = {0};
    snprintf(size, sizeof size, "%dx%d", W, H);
    fake_camera_start(&fake, "BayerRG16", size);
    if (!mkdtemp(folder))
        return 1;
    snprintf(path, sizeof path, "%s/frame.dng", folder);
    must(weft_camera_open_on(&weft_camera_aravis, "127.0.0.1", &camera, &error), &error);
    const double direct_s = time_camera_on(camera, &frame, NULL);
    must(weft_camera_open("aravis:127.0.0.1", &camera, &error), &error);
    const double helper_s = time_camera_on(camera, &frame, NULL);
    must(weft_camera_open("aravis:127.0.0.1", &camera, &error), &error);
    const double disk_s = time_camera_on(camera, &frame, path);
    uint16_t *const to = weft_alloc(W * H, sizeof *to, &error);
    copy_s = time_copy(&frame.mosaic, path);
    printf(
        "one frame of %d x %d, 16 bit, %.1f MB; as a multiple of copying its bytes to a file on the disk:\n",
        W, H, 1e-6 * BYTES);
    report("copying: memory to a file, synced and renamed", copy_s);
    report("DNG: memory to a file, synced and renamed", time_dng(&frame.mosaic, path));
    report("memcpy", time_memcpy(&frame.mosaic, to));
    report("into sealed shared memory and out of it", time_shared(&frame.mosaic, to));
    report("camera to memory, library in this process", direct_s);
    report("camera to memory, library in its helper", helper_s);
    report("camera in its helper to a DNG on the disk", disk_s);
    weft_free(to);
    weft_mosaic_fini(&frame.mosaic);
    weft_folder_remove(folder, NULL);
    fake_camera_kill(&fake);
    return 0;
}
