/* Who owns a GigE Vision camera: a second program is refused, a killed one is outlived. */
#include "tests/support/support.h"

#include "core/progress.h"
#include "host/camera/camera.h"
#include "tests/host/fake_camera.h"

#include <signal.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static fake_camera fake;
static char program[1024];

static int end_fake(void **state)
{
    (void)state;
    fake_camera_kill(&fake);
    return 0;
}

/* The other program: opens the camera, takes a frame, says so and keeps it. */
static int be_client(void)
{
    weft_camera_device *camera = NULL;
    weft_captured_frame frame = {0};
    weft_error error = {0};
    if (weft_camera_open("aravis:127.0.0.1", &camera, &error) != WEFT_OK ||
        weft_camera_expose(camera, 2, &frame, &error) != WEFT_OK) {
        fprintf(stderr, "%s\n", error.text);
        return 1;
    }
    if (write(STDOUT_FILENO, "mine", 4) != 4)
        return 1;
    for (;;)
        pause();
}

static pid_t start_client(void)
{
    int from[2];
    char said[4];
    assert_int_equal(pipe(from), 0);
    const pid_t pid = fork();
    if (pid == 0) {
        dup2(from[1], STDOUT_FILENO);
        execl(program, program, "--client", (char *)NULL);
        _exit(127);
    }
    close(from[1]);
    assert_int_equal(read(from[0], said, 4), 4);
    close(from[0]);
    return pid;
}

static void test_a_second_program_is_refused_a_killed_one_outlived(void **state)
{
    (void)state;
    weft_camera_device *camera = NULL;
    weft_captured_frame frame = {0};
    weft_camera_found found[8];
    int n = 0, here = -1;
    fake_camera_start(&fake, "BayerRG16", "320x240");
    const pid_t client = start_client();
    assert_ok(weft_camera_list(found, 8, &n, err));
    for (int i = 0; i < n; i++)
        if (strcmp(found[i].id, "aravis:127.0.0.1") == 0)
            here = i;
    assert_true(here >= 0);
    assert_non_null(strstr(found[here].problem, "another program controls it"));
    assert_string_equal(found[here].vendor, "Aravis");
    assert_fails(weft_camera_open("aravis:127.0.0.1", &camera, err), WEFT_ERR_DEVICE,
                 "another program controls it; close that one");

    kill(client, SIGKILL);
    waitpid(client, NULL, 0);
    const double start_s = weft_clock_s();
    assert_ok(weft_camera_open("aravis:127.0.0.1", &camera, err));
    assert_true(weft_clock_s() - start_s < 30);
    assert_ok(weft_camera_expose(camera, 2, &frame, err));
    assert_int_equal(frame.status, WEFT_FRAME_COMPLETE);
    assert_int_equal(frame.mosaic.data[1], fake_camera_sample(1, 0, 20000, 0));
    weft_mosaic_fini(&frame.mosaic);
    weft_camera_close(camera);
}

static void test_no_camera(void **state)
{
    (void)state;
    weft_camera_device *camera = NULL;
    assert_fails(weft_camera_open("aravis:127.0.0.1", &camera, err), WEFT_ERR_DEVICE, "camera 127.0.0.1");
    assert_fails(weft_camera_open("aravis:No-Such-42", &camera, err), WEFT_ERR_DEVICE, "weft devices");
    assert_null(camera);
}

static void test_auto_takes_the_only_one(void **state)
{
    (void)state;
    weft_camera_device *camera = NULL;
    weft_camera_found found[8];
    int n = 0;
    assert_ok(weft_camera_list(found, 8, &n, err));
    if (n > 0) {
        print_message("skipped: this machine has a camera, %s\n", found[0].id);
        skip();
    }
    assert_fails(weft_camera_open("auto", &camera, err), WEFT_ERR_MISSING, "--rig");
    fake_camera_start(&fake, "BayerRG16", "320x240");
    assert_ok(weft_camera_open("auto", &camera, err));
    assert_string_equal(weft_camera_get_state(camera)->id, "aravis:127.0.0.1");
    assert_string_equal(weft_camera_get_state(camera)->serial, "FC01");
    weft_camera_close(camera);
}

int main(int argc, char **argv)
{
    if (argc > 1 && strcmp(argv[1], "--client") == 0)
        return be_client();
    if (readlink("/proc/self/exe", program, sizeof program - 1) < 0)
        return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_no_camera),
        cmocka_unit_test_teardown(test_auto_takes_the_only_one, end_fake),
        cmocka_unit_test_teardown(test_a_second_program_is_refused_a_killed_one_outlived, end_fake),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
