#include "tests/host/capture_bench.h"

#include "core/file.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/sha256.h"
#include "tests/support/support.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

capture_bench bench;

static weft_err bench_list(weft_camera_found *found, int max, int *n, weft_error *err)
{
    (void)found, (void)max, (void)err;
    *n = 0;
    return WEFT_OK;
}

static weft_err bench_open(void *state, const char *address, weft_camera_state *info, weft_error *err)
{
    (void)state, (void)address, (void)err;
    *info = (weft_camera_state){.vendor = "Weft",
                                .model = "Bench",
                                .width = WIDTH,
                                .height = HEIGHT,
                                .bits = 12,
                                .cfa = WEFT_CFA_GBRG,
                                .black = {BLACK, BLACK, BLACK, BLACK},
                                .white = WHITE,
                                .gain = 1};
    snprintf(info->serial, sizeof info->serial, "%s", bench.serial);
    return WEFT_OK;
}

weft_camera_settings bench_set;

static weft_err bench_configure(void *state, const weft_camera_settings *wanted, weft_camera_state *info,
                                weft_error *err)
{
    (void)state;
    if (wanted->exposure_s > 10)
        return weft_fail(err, WEFT_ERR_RANGE, "camera bench: only to 10 s");
    bench_set = *wanted;
    info->exposure_s = wanted->exposure_s;
    info->gain = wanted->gain;
    return WEFT_OK;
}

/* A lamp's side of the picture is the brighter: 1 in its corner, 0.7 in the one across. */
static double side_of(int lamp, int u, int v)
{
    const double angle = 2 * acos(-1) * lamp / N_LIGHTS, c = cos(angle), s = sin(angle);
    const double across = (c * (2.0 * u / WIDTH - 1) + s * (2.0 * v / HEIGHT - 1)) / (fabs(c) + fabs(s));
    return 0.85 + 0.15 * across;
}

double light_at(const double on[N_LIGHTS], int u, int v)
{
    double light = bench.room;
    for (int i = 0; i < N_LIGHTS; i++)
        if (!(bench.broken_lamps >> i & 1))
            light += bench.power * on[i] * (bench.faint_lamps >> i & 1 ? 0.2 : 1) * side_of(i, u, v);
    return light * bench_set.exposure_s * bench_set.gain;
}

/* Red, green and blue see 0.5, 1 and 0.7 of the light. */
uint16_t sample_at(double light, weft_cfa cfa, int u, int v)
{
    static const double colour[3] = {0.5, 1, 0.7};
    const double share = light * colour[weft_cfa_colour(cfa, u, v)];
    return (uint16_t)fmin(BLACK + (WHITE - BLACK) * share + 0.5, WHITE);
}

static weft_err wait_slowly(weft_camera_idle_fn *idle, void *context, weft_error *err)
{
    const double end_s = weft_clock_s() + bench_set.exposure_s;
    while (weft_clock_s() < end_s) {
        nanosleep(&(struct timespec){.tv_nsec = 50000000}, NULL);
        WEFT_TRY(idle(context, err));
    }
    return WEFT_OK;
}

static weft_err bench_expose(void *state, double deadline_s, weft_camera_idle_fn *idle, void *context,
                             weft_captured_frame *frame, weft_error *err)
{
    const int index = bench.n_exposures++;
    const bool now = index >= bench.deed_at && index < bench.deed_at + bench.n_deeds;
    const deed what = now ? bench.deed : WORK;
    double on[N_LIGHTS];
    (void)state, (void)deadline_s;
    if (what == DIE)
        return weft_fail(err, WEFT_ERR_DEVICE, "camera bench: the connection was lost");
    if (what == CANCEL_IT)
        weft_cancel_request(true);
    if (what == ACT)
        bench.act();
    if (what == RESET_BOARD)
        weft_controller_sim_reset(bench.sim);
    WEFT_TRY(idle(context, err));
    if (bench.slow && weft_controller_sim_lights(bench.sim, NULL))
        WEFT_TRY(wait_slowly(idle, context, err));
    frame->exposure_s = bench_set.exposure_s;
    frame->gain = bench_set.gain;
    frame->sequence = (uint64_t)index;
    frame->status = what == LOSE_PACKETS   ? WEFT_FRAME_INCOMPLETE
                    : what == SEND_NOTHING ? WEFT_FRAME_TIMEOUT
                                           : WEFT_FRAME_COMPLETE;
    snprintf(frame->reason, sizeof frame->reason, "%s",
             what == LOSE_PACKETS   ? "packets were lost"
             : what == SEND_NOTHING ? "no frame came"
                                    : "");
    assert_true(weft_controller_sim_expose(
        bench.sim, (uint32_t)lround(1e6 * fmin(bench_set.exposure_s, bench.slow ? 0.01 : 0.02)), on));
    bench.lit_before_end[index % 256] = weft_controller_sim_lights(bench.sim, NULL);
    if (frame->status != WEFT_FRAME_COMPLETE)
        return WEFT_OK;
    if (!frame->mosaic.data)
        WEFT_TRY(weft_mosaic_init(&frame->mosaic, WIDTH, HEIGHT, WEFT_CFA_GBRG, err));
    for (int i = 0; i < 4; i++)
        frame->mosaic.black[i] = BLACK;
    frame->mosaic.white = WHITE;
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++)
            frame->mosaic.data[v * WIDTH + u] = sample_at(light_at(on, u, v), WEFT_CFA_GBRG, u, v);
    return WEFT_OK;
}

static void bench_close(void *state)
{
    (void)state;
}

static const weft_camera_backend bench_backend = {.name = "bench",
                                                  .summary = "the camera of this test",
                                                  .state_size = 1,
                                                  .list = bench_list,
                                                  .open = bench_open,
                                                  .configure = bench_configure,
                                                  .expose = bench_expose,
                                                  .close = bench_close};

char pty[128];

void open_bench_camera(void)
{
    assert_ok(weft_camera_open_on(&bench_backend, "1", &bench.camera, err));
}

int set_up(void **state)
{
    char elf[1024];
    const char *const build = getenv("WEFT_TEST_BUILD");
    (void)state;
    memset(&bench, 0, sizeof bench);
    bench.serial = "B1";
    bench.room = 0.05;
    bench.power = 15; /* 60 % of the range at 0.04 s */
    snprintf(elf, sizeof elf, "%s/%s", build ? build : "build", "firmware/weft-firmware.elf");
    assert_ok(weft_controller_sim_create(elf, &bench.sim, pty, err));
    open_bench_camera();
    assert_ok(weft_controller_open(pty, LEASE_MS, &bench.controller, err));
    return 0;
}

int tear_down(void **state)
{
    (void)state;
    weft_cancel_request(false);
    weft_controller_close(bench.controller);
    weft_camera_close(bench.camera);
    weft_controller_sim_destroy(bench.sim);
    return 0;
}

void plan_deed(deed what, int at, int n)
{
    bench.deed = what;
    bench.deed_at = bench.n_exposures + at;
    bench.n_deeds = n;
}

weft_err run(const weft_capture_options *options, weft_set *set, weft_capture_report *report, weft_error *err)
{
    weft_progress progress = {0};
    const weft_err status =
        weft_capture_run(options, bench.camera, bench.controller, &progress, set, report, err);
    assert_int_equal(weft_controller_sim_driven(bench.sim), 0); /* whatever happened */
    return status;
}

void run_well(const weft_capture_options *options, weft_capture_report *report)
{
    weft_set set;
    assert_ok(run(options, &set, report, err));
    weft_set_fini(&set);
}

void check_folder(const char *folder, int n_frames, bool complete)
{
    weft_set set;
    int n_files = 0;
    const struct dirent *entry;
    assert_ok(weft_set_load(folder, &set, err));
    assert_int_equal(set.n_frames, n_frames);
    assert_int_equal(set.complete, complete);
    DIR *const d = opendir(folder);
    while ((entry = readdir(d)) != NULL)
        n_files += entry->d_name[0] != '.' || strncmp(entry->d_name, ".weft-", 6) == 0;
    closedir(d);
    const json_t *const sidecars = json_object_get(json_object_get(set.other, "capture"), "sidecar");
    assert_int_equal(n_files, (json_is_true(sidecars) ? 2 : 1) * n_frames + 1);
    for (int i = 0; i < set.n_frames; i++) {
        char hex[65];
        char *const path = weft_set_frame_path(&set, i, NULL);
        assert_ok(weft_sha256_file(path, hex, err));
        assert_string_equal(hex, set.frames[i].sha256);
        weft_free(path);
    }
    weft_set_fini(&set);
}
