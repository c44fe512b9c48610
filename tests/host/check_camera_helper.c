/*
 * Cameras in processes of their own: crashes, hangs, lies, kills; and that nothing is left over.
 *
 * WEFT_KILLS=1000 makes the test of random kills a long one.
 */
#include "tests/support/support.h"

#include "core/mem.h"
#include "core/progress.h"
#include "host/camera/camera_message.h"
#include "host/camera/camera_serve.h"
#include "tests/host/drawn_camera.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

/* ---- what must not grow ---- */

static int count_open_files(void)
{
    int n = 0;
    DIR *const d = opendir("/proc/self/fd");
    while (readdir(d))
        n++;
    closedir(d);
    return n;
}

static int count_mappings_of_frames(void)
{
    int n = 0;
    char line[512];
    FILE *const f = fopen("/proc/self/maps", "r");
    while (fgets(line, sizeof line, f))
        n += strstr(line, "memfd:weft") != NULL;
    fclose(f);
    return n;
}

static int open_files_before;

static int set_up(void **state)
{
    (void)state;
    unsetenv("WEFT_CAMERA_FAULT");
    unsetenv("WEFT_CAMERA_PATIENCE");
    open_files_before = count_open_files();
    return 0;
}

/* After every test: no process, no descriptor, no shared memory of a helper is left. */
static int tear_down(void **state)
{
    (void)state;
    const pid_t child = waitpid(-1, NULL, WNOHANG);
    if (child != -1 || errno != ECHILD || count_open_files() != open_files_before ||
        count_mappings_of_frames() != 0) {
        print_error("left over: child %d, %d descriptors, %d mappings\n", (int)child,
                    count_open_files() - open_files_before, count_mappings_of_frames());
        return -1;
    }
    return 0;
}

static weft_camera_device *open_drawn(const char *address)
{
    weft_camera_device *camera = NULL;
    char id[64];
    snprintf(id, sizeof id, "aravis:%s", address);
    assert_ok(weft_camera_open(id, &camera, err));
    return camera;
}

static int count_wrong(const weft_captured_frame *frame)
{
    int wrong = 0;
    for (int i = 0; i < DRAWN_WIDTH * DRAWN_HEIGHT; i++)
        wrong += frame->mosaic.data[i] != drawn_camera_sample(i, frame->sequence, frame->exposure_s);
    return wrong;
}

static void expose_whole(weft_camera_device *camera, weft_captured_frame *frame)
{
    assert_ok(weft_camera_expose(camera, 2, frame, err));
    if (frame->status != WEFT_FRAME_COMPLETE)
        fail_msg("status %d: %s", frame->status, frame->reason);
    assert_int_equal(count_wrong(frame), 0);
}

static void let_go(weft_camera_device *camera, weft_captured_frame *frame)
{
    weft_mosaic_fini(&frame->mosaic);
    weft_camera_close(camera);
}

/* ---- all well ---- */

static void test_frames_and_settings_pass_unchanged(void **state)
{
    (void)state;
    weft_captured_frame frame = {0};
    weft_camera_device *const camera = open_drawn("1");
    const weft_camera_state *const s = weft_camera_get_state(camera);
    assert_string_equal(s->id, "aravis:1");
    assert_string_equal(s->serial, "D1-0");
    assert_string_equal(weft_camera_backend_name(camera), "aravis");
    assert_true(s->width == DRAWN_WIDTH && s->cfa == WEFT_CFA_GRBG && s->black[3] == 256 &&
                s->white == 15871);
    for (int i = 1; i < 20; i++) {
        assert_ok(weft_camera_configure(camera, &(weft_camera_settings){.exposure_s = 1e-4 * i}, err));
        expose_whole(camera, &frame);
        assert_true(frame.exposure_s == 1e-4 * i && frame.sequence == (uint64_t)i);
        assert_true(frame.mosaic.cfa == WEFT_CFA_GRBG && frame.mosaic.white == 15871);
    }
    assert_fails(weft_camera_configure(camera, &(weft_camera_settings){.exposure_s = 61}, err),
                 WEFT_ERR_RANGE, "camera 1: only to 60 s");
    expose_whole(camera, &frame); /* a refusal changes nothing */
    assert_true(frame.exposure_s == 1e-4 * 19);
    let_go(camera, &frame);
}

static void test_all_kinds_are_listed(void **state)
{
    (void)state;
    weft_camera_found found[8];
    int n = 0;
    assert_ok(weft_camera_list(found, 8, &n, err));
    assert_int_equal(n, 3);
    assert_string_equal(found[2].id, "aravis:2");
    assert_string_equal(found[2].serial, "D2");
    assert_ok(weft_camera_list(found, 2, &n, err));
    assert_int_equal(n, 2);
    weft_camera_device *camera = NULL;
    assert_fails(weft_camera_open("auto", &camera, err), WEFT_ERR_MISSING, "there are 3 cameras");
}

static weft_err count_and_pulse(void *context, weft_error *err)
{
    (void)err;
    ++*(int *)context;
    return WEFT_OK;
}

static void test_armed_is_told_once_a_frame(void **state)
{
    (void)state;
    int pulses = 0;
    weft_captured_frame frame = {0};
    weft_camera_device *const camera = open_drawn("1");
    weft_camera_set_fire(camera, count_and_pulse, &pulses);
    expose_whole(camera, &frame);
    assert_int_equal(pulses, 0);
    const weft_camera_settings wire = {.exposure_s = 0.02, .trigger = WEFT_TRIGGER_WIRE};
    assert_ok(weft_camera_configure(camera, &wire, err));
    for (int i = 1; i <= 5; i++) {
        expose_whole(camera, &frame);
        assert_int_equal(pulses, i);
    }
    let_go(camera, &frame);
}

/* ---- a library that fails ---- */

static void check_abort(const char *fault, const char *words)
{
    weft_captured_frame frame = {0};
    setenv("WEFT_CAMERA_FAULT", fault, 1);
    weft_camera_device *const camera = open_drawn("1");
    assert_ok(weft_camera_configure(camera, &(weft_camera_settings){.exposure_s = 0.003}, err));
    expose_whole(camera, &frame);
    const long before = weft_camera_process(camera);
    assert_true(before > 0);
    assert_ok(weft_camera_expose(camera, 1, &frame, err));
    assert_int_equal(frame.status, WEFT_FRAME_ABORTED);
    if (!strstr(frame.reason, words))
        fail_msg("%s: \"%s\" does not say \"%s\"", fault, frame.reason, words);
    assert_int_equal(weft_camera_process(camera), 0);
    assert_true(kill((pid_t)before, 0) == -1 && errno == ESRCH);
    expose_whole(camera, &frame); /* a new helper, set as the old one was */
    assert_true(weft_camera_process(camera) > 0);
    assert_true(frame.exposure_s == 0.003 && frame.sequence == 1);
    let_go(camera, &frame);
}

static void test_a_crash_costs_a_frame(void **state)
{
    (void)state;
    check_abort("crash@expose:2", "camera 1: the camera's helper process (weft-camera-aravis) was killed by "
                                  "signal 11");
    check_abort("exit@expose:2", "ended with status 9");
}

static void test_a_helper_that_lies_is_ended(void **state)
{
    (void)state;
    check_abort("garbage@expose:2", "said something that is no message");
    check_abort("stray@expose:2", "answered something that was not asked");
    check_abort("loose@expose:2", "a frame that is none");
    check_abort("short@expose:2", "a frame that is none");
}

static void test_a_hang_has_a_deadline(void **state)
{
    (void)state;
    setenv("WEFT_CAMERA_PATIENCE", "1", 1);
    const double start_s = weft_clock_s();
    check_abort("hang@expose:2", "did not answer in time");
    assert_true(weft_clock_s() - start_s < 30);
}

static void test_opening_fails_in_words(void **state)
{
    (void)state;
    weft_camera_device *camera = NULL;
    assert_fails(weft_camera_open("aravis:none", &camera, err), WEFT_ERR_DEVICE, "is not there; plug it in");
    setenv("WEFT_CAMERA_FAULT", "crash@open", 1);
    assert_fails(weft_camera_open("aravis:1", &camera, err), WEFT_ERR_DEVICE,
                 "camera 1: the camera's helper process (weft-camera-aravis) was killed by signal 11 "
                 "(Segmentation fault) during OPEN");
    setenv("WEFT_CAMERA_FAULT", "exit@hello", 1);
    assert_fails(weft_camera_open("aravis:1", &camera, err), WEFT_ERR_DEVICE,
                 "ended with status 9 during HELLO");
    setenv("WEFT_CAMERA_PATIENCE", "1", 1);
    setenv("WEFT_CAMERA_FAULT", "hang@open", 1);
    assert_fails(weft_camera_open("aravis:1", &camera, err), WEFT_ERR_DEVICE, "did not answer in time");
    assert_null(camera);
    weft_camera_found found[4];
    int n = -1;
    setenv("WEFT_CAMERA_FAULT", "crash@list",
           1); /* the cameras of the other backends are wanted all the same */
    assert_ok(weft_camera_list(found, 4, &n, err));
    assert_int_equal(n, 0);
}

static void test_deaths_in_a_row_have_a_limit(void **state)
{
    (void)state;
    weft_captured_frame frame = {0};
    setenv("WEFT_CAMERA_FAULT", "crash@expose", 1);
    weft_camera_device *const camera = open_drawn("1");
    weft_error error = {0};
    int n_aborted = 0;
    while (weft_camera_expose(camera, 1, &frame, &error) == WEFT_OK && n_aborted < 20)
        n_aborted += frame.status == WEFT_FRAME_ABORTED;
    assert_int_equal(n_aborted, 5);
    assert_non_null(strstr(error.text, "ended 5 times in a row (the last time it was killed by signal 11"));
    let_go(camera, &frame);
    setenv("WEFT_CAMERA_FAULT", "crash@configure", 1);
    weft_camera_device *const other = open_drawn("1");
    assert_fails(weft_camera_configure(other, &(weft_camera_settings){.exposure_s = 0.1}, err),
                 WEFT_ERR_DEVICE, "5 times in a row");
    weft_camera_close(other);
}

static void test_another_camera_in_its_place_is_refused(void **state)
{
    (void)state;
    weft_captured_frame frame = {0};
    setenv("WEFT_CAMERA_FAULT", "crash@expose:2", 1);
    weft_camera_device *const camera = open_drawn("other-1");
    expose_whole(camera, &frame);
    assert_ok(weft_camera_expose(camera, 1, &frame, err));
    assert_fails(weft_camera_expose(camera, 1, &frame, err), WEFT_ERR_MISMATCH, "connect that one again");
    let_go(camera, &frame);
}

static void test_no_helper(void **state)
{
    (void)state;
    weft_camera_device *camera = NULL;
    char here[1024];
    snprintf(here, sizeof here, "%s", getenv("WEFT_HELPERS"));
    setenv("WEFT_HELPERS", "/nonexistent", 1);
    assert_false(weft_camera_is_installed("aravis"));
    assert_fails(weft_camera_open("aravis:1", &camera, err), WEFT_ERR_UNSUPPORTED,
                 "weft-camera-aravis is not installed");
    setenv("WEFT_HELPERS", here, 1);
    assert_true(weft_camera_is_installed("aravis"));
}

/* ---- cancelling ---- */

static weft_err enough(void *context, weft_error *err)
{
    (void)context;
    return weft_fail(err, WEFT_ERR_CANCELLED, "enough");
}

static void check_cancel(const char *address, double close_within_s)
{
    weft_captured_frame frame = {0};
    weft_camera_device *const camera = open_drawn(address);
    assert_ok(weft_camera_configure(camera, &(weft_camera_settings){.exposure_s = 30}, err));
    weft_camera_set_idle(camera, enough, NULL);
    double start_s = weft_clock_s();
    assert_fails(weft_camera_expose(camera, 5, &frame, err), WEFT_ERR_CANCELLED, "enough");
    assert_true(weft_clock_s() - start_s < 15); /* and not the 30 s of the exposure */
    weft_camera_set_idle(camera, NULL, NULL);
    if (strcmp(address, "1") == 0) { /* a helper that obeys goes on: no frame of before the cancellation */
        const long process = weft_camera_process(camera);
        assert_ok(weft_camera_configure(camera, &(weft_camera_settings){.exposure_s = 0.001}, err));
        expose_whole(camera, &frame);
        assert_int_equal(weft_camera_process(camera), process);
    }
    start_s = weft_clock_s();
    let_go(camera, &frame);
    assert_true(weft_clock_s() - start_s < close_within_s);
}

static void test_cancel_always_works(void **state)
{
    (void)state;
    check_cancel("1", 2);
    check_cancel("stuck", 1);
}

/* ---- kills ---- */

static atomic_int whole_frames;
static atomic_bool enough_kills;

/* At random moments, also while a helper starts; but not so often that none would ever live, which is told
 * after five. */
static void *kill_at_random(void *context)
{
    enum { IN_A_ROW = 3 };
    int in_a_row = 0, seen = 0;
    weft_camera_device *const camera = context;
    uint64_t seed = 42;
    const char *const wanted = getenv("WEFT_KILLS");
    const int n = wanted ? (int)strtol(wanted, NULL, 10) : 25;
    for (int i = 0; i < n && !atomic_load(&enough_kills);) {
        nanosleep(&(struct timespec){.tv_nsec = (long)(6e7 * weft_test_random(&seed))}, NULL);
        const long pid = weft_camera_process(camera); /* read without a lock: 0, or a helper that lives */
        in_a_row = atomic_load(&whole_frames) != seen ? 0 : in_a_row;
        seen = atomic_load(&whole_frames);
        if (in_a_row < IN_A_ROW && pid > 0 && kill((pid_t)pid, SIGKILL) == 0) {
            i++;
            in_a_row++;
        }
    }
    return (void *)(intptr_t)n;
}

static void test_kills_at_random(void **state)
{
    (void)state;
    weft_captured_frame frame = {0};
    weft_camera_device *const camera = open_drawn("1");
    pthread_t killer;
    int n_whole = 0, n_aborted = 0, n_other = 0;
    assert_int_equal(pthread_create(&killer, NULL, kill_at_random, camera), 0);
    void *n_kills = NULL;
    while (pthread_tryjoin_np(killer, &n_kills) != 0) {
        weft_error error = {0};
        const weft_camera_settings wanted = {.exposure_s = 1e-4 * (1 + n_whole % 50)};
        weft_err status = weft_camera_configure(camera, &wanted, &error);
        if (status == WEFT_OK)
            status = weft_camera_expose(camera, 1, &frame, &error);
        if (status == WEFT_OK && frame.status == WEFT_FRAME_COMPLETE) {
            n_whole++;
            atomic_fetch_add(&whole_frames, 1);
            assert_int_equal(count_wrong(&frame), 0);
            assert_true(frame.exposure_s == wanted.exposure_s);
        } else if (status == WEFT_OK) {
            n_aborted++;
            assert_int_equal(frame.status, WEFT_FRAME_ABORTED);
            assert_non_null(strstr(frame.reason, "signal 9"));
        } else {
            n_other++; /* five in a row, and then it says so */
            assert_non_null(strstr(error.text, "in a row"));
            break;
        }
    }
    atomic_store(&enough_kills, true);
    if (n_other)
        pthread_join(killer, &n_kills);
    print_message("%ld kills: %d frames whole, %d aborted, %d refusals\n", (long)(intptr_t)n_kills, n_whole,
                  n_aborted, n_other);
    assert_true(n_whole > 10 && n_aborted > 0 && n_other == 0);
    weft_camera_prepare(camera, NULL);
    expose_whole(camera, &frame);
    let_go(camera, &frame);
}

/* The program is killed: its helper must go, even one whose library hangs. */
static void test_the_helper_dies_with_its_program(void **state)
{
    (void)state;
    for (int stuck = 0; stuck < 2; stuck++) {
        int pipes[2];
        long helper = 0;
        assert_int_equal(pipe(pipes), 0);
        const pid_t program = fork();
        if (program == 0) {
            weft_camera_device *camera = NULL;
            weft_captured_frame frame = {0};
            weft_error error = {0};
            if (weft_camera_open(stuck ? "aravis:stuck" : "aravis:1", &camera, &error) != WEFT_OK)
                _exit(1);
            helper = weft_camera_process(camera);
            if (write(pipes[1], &helper, sizeof helper) != sizeof helper)
                _exit(1);
            weft_camera_expose(camera, 60, &frame, &error);
            for (;;)
                pause();
        }
        assert_int_equal(read(pipes[0], &helper, sizeof helper), sizeof helper);
        close(pipes[0]);
        close(pipes[1]);
        nanosleep(&(struct timespec){.tv_nsec = 100000000}, NULL);
        assert_int_equal(kill((pid_t)helper, 0), 0);
        kill(program, SIGKILL);
        waitpid(program, NULL, 0);
        const double start_s = weft_clock_s();
        char path[64], line[256] = "";
        snprintf(path, sizeof path, "/proc/%ld/stat", helper);
        for (bool gone = false; !gone;) { /* a zombie that init has not collected yet is gone, too */
            FILE *const f = fopen(path, "r");
            gone = !f || !fgets(line, sizeof line, f) || strstr(line, ") Z ") || strstr(line, ") X ");
            if (f)
                fclose(f);
            assert_true(weft_clock_s() - start_s < 20);
        }
    }
}

/* ---- the wire ---- */

static void test_packets_of_noise(void **state)
{
    (void)state;
    int pair[2];
    uint64_t seed = 7;
    int n[4] = {0};
    weft_camera_message *const out = weft_alloc(1, sizeof *out, NULL), *const in =
                                                                           weft_alloc(1, sizeof *in, NULL);
    assert_int_equal(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair), 0);
    const int before = count_open_files();
    for (int i = 0; i < 20000; i++) {
        int fd = -1;
        uint8_t *const bytes = (uint8_t *)out;
        for (size_t b = 0; b < 200; b++)
            bytes[b] = (uint8_t)(256 * weft_test_random(&seed));
        if (i % 2) /* half of them with a head that passes */
            *out = (weft_camera_message){.call = (uint32_t)i % WEFT_N_CALLS, .status = i % 3};
        const size_t size = (size_t)((double)sizeof out->body * weft_test_random(&seed)) >> (i % 12);
        const int sent = i % 5 == 0 ? memfd_create("x", MFD_CLOEXEC) : -1;
        assert_true(weft_camera_message_send(pair[0], out, size, sent));
        if (sent >= 0)
            close(sent);
        const weft_camera_receipt got = weft_camera_message_receive(pair[1], 100, in, &fd);
        n[got]++;
        assert_true(got == WEFT_RECEIPT_MESSAGE || got == WEFT_RECEIPT_GARBAGE);
        assert_true(got == WEFT_RECEIPT_MESSAGE || fd == -1);
        if (got == WEFT_RECEIPT_MESSAGE && in->status)
            assert_true(strlen(in->body.error.text) < sizeof in->body.error.text);
        if (fd >= 0)
            close(fd);
    }
    assert_true(n[WEFT_RECEIPT_MESSAGE] > 3000 && n[WEFT_RECEIPT_GARBAGE] > 3000);
    assert_int_equal(count_open_files(), before);
    close(pair[0]);
    int fd = -1;
    assert_int_equal(weft_camera_message_receive(pair[1], 100, in, &fd), WEFT_RECEIPT_GONE);
    assert_false(weft_camera_message_send(pair[1], in, 8, -1));
    close(pair[1]);
    weft_free(out);
    weft_free(in);
}

static void test_sealed_memory(void **state)
{
    (void)state;
    uint16_t samples[1000];
    for (int i = 0; i < 1000; i++)
        samples[i] = (uint16_t)i;
    const int fd = weft_camera_sealed_memory(samples, sizeof samples, NULL, 0);
    assert_true(weft_camera_is_sealed_memory(fd, sizeof samples));
    assert_false(weft_camera_is_sealed_memory(fd, sizeof samples - 2));
    assert_int_equal(pwrite(fd, samples, 2, 0), -1);
    assert_int_equal(ftruncate(fd, 10), -1);
    close(fd);
    const int file = open("/proc/self/exe", O_RDONLY | O_CLOEXEC);
    assert_false(weft_camera_is_sealed_memory(file, 10));
    close(file);
    assert_false(weft_camera_is_sealed_memory(-1, 10));
}

static void test_faults_by_name(void **state)
{
    (void)state;
    const char *const faults = "crash@expose:3,hang@open";
    assert_int_equal(weft_camera_deed_for(faults, WEFT_CALL_EXPOSE, 3), WEFT_DEED_CRASH);
    assert_int_equal(weft_camera_deed_for(faults, WEFT_CALL_EXPOSE, 2), WEFT_DEED_NONE);
    assert_int_equal(weft_camera_deed_for(faults, WEFT_CALL_OPEN, 9), WEFT_DEED_HANG);
    assert_int_equal(weft_camera_deed_for(faults, WEFT_CALL_CLOSE, 1), WEFT_DEED_NONE);
    assert_int_equal(weft_camera_deed_for(NULL, WEFT_CALL_OPEN, 1), WEFT_DEED_NONE);
    assert_int_equal(weft_camera_deed_for("nonsense,@,:,crash@", WEFT_CALL_OPEN, 1), WEFT_DEED_NONE);
}

int main(void)
{
    char helpers[1024];
    const char *const build = getenv("WEFT_TEST_BUILD");
    snprintf(helpers, sizeof helpers, "%s/tests/helpers", build ? build : "build");
    setenv("WEFT_HELPERS", helpers, 1);
#define CLEAN(test) cmocka_unit_test_setup_teardown(test, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        CLEAN(test_sealed_memory),
        CLEAN(test_packets_of_noise),
        CLEAN(test_faults_by_name),
        CLEAN(test_frames_and_settings_pass_unchanged),
        CLEAN(test_all_kinds_are_listed),
        CLEAN(test_armed_is_told_once_a_frame),
        CLEAN(test_a_crash_costs_a_frame),
        CLEAN(test_a_helper_that_lies_is_ended),
        CLEAN(test_a_hang_has_a_deadline),
        CLEAN(test_opening_fails_in_words),
        CLEAN(test_deaths_in_a_row_have_a_limit),
        CLEAN(test_another_camera_in_its_place_is_refused),
        CLEAN(test_no_helper),
        CLEAN(test_cancel_always_works),
        CLEAN(test_kills_at_random),
        CLEAN(test_the_helper_dies_with_its_program),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
