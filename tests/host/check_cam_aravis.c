/* The Aravis backend against a GigE Vision camera on loopback: every sample, every way to fail. */
#include "tests/support/support.h"

#include "core/progress.h"
#include "host/camera/aravis_private.h"
#include "host/camera/camera.h"
#include "tests/host/fake_camera.h"

#include <math.h>
#include <signal.h>
#include <string.h>

#define DEADLINE_S 1.0

static fake_camera fake;

static int end_fake(void **state)
{
    (void)state;
    fake_camera_kill(&fake);
    return 0;
}

/* A busy machine may lose packets of any frame: the next try is as good. */
static void expose_whole(weft_camera_device *camera, weft_captured_frame *frame)
{
    enum { TRIES = 10 };
    for (int i = 0; i < TRIES; i++) {
        assert_ok(weft_camera_expose(camera, DEADLINE_S, frame, err));
        if (frame->status == WEFT_FRAME_COMPLETE || !strstr(frame->reason, "packets missing"))
            break;
    }
    if (frame->status != WEFT_FRAME_COMPLETE)
        fail_msg("status %d: %s", frame->status, frame->reason);
}

/* Number of samples that are not what the fake camera draws. */
static long count_wrong(const weft_captured_frame *frame, int bits)
{
    const weft_mosaic *const m = &frame->mosaic;
    const uint32_t exposure_us = (uint32_t)lround(1e6 * frame->exposure_s), mask = (1u << bits) - 1;
    long wrong = 0;
    for (int i = bits == 16; i < m->width * m->height; i++) /* the first 16-bit sample counts frames */
        wrong += m->data[i] != (fake_camera_sample(i % m->width, i / m->width, exposure_us, 0) & mask);
    return wrong;
}

static void test_formats_by_name(void **state)
{
    (void)state;
    weft_raw_format f;
    const char *const names[] = {"Mono16", "BayerRG8", "BayerGR12Packed", "BayerGR12", "BayerGR12p"};
    assert_true(weft_raw_format_best(names, 5, &f));
    assert_string_equal(f.name, "BayerGR12");
    assert_true(f.cfa == WEFT_CFA_GRBG && f.bits == 12);
    assert_false(weft_raw_format_best(names, 1, &f));
    assert_false(weft_raw_format_from_name("BayerXX12", &f));
    assert_false(weft_raw_format_from_name("BayerRG", &f));
    /* 0xABC, 0x123 as the two standards pack them; an odd count ends after two bytes. */
    uint16_t s[3];
    assert_true(weft_raw_format_from_name("BayerBG12p", &f));
    weft_raw_format_unpack(&f, (const uint8_t[]){0xbc, 0x3a, 0x12, 0xef, 0x0d}, 3, s);
    assert_true(s[0] == 0xabc && s[1] == 0x123 && s[2] == 0xdef);
    assert_int_equal(weft_raw_format_bytes(&f, 3), 5);
    assert_true(weft_raw_format_from_name("BayerBG12Packed", &f));
    weft_raw_format_unpack(&f, (const uint8_t[]){0xab, 0x3c, 0x12}, 2, s);
    assert_true(s[0] == 0xabc && s[1] == 0x123);
    assert_non_null(weft_camera_find_quirk("Weft", "Virtual scanner"));
    assert_null(weft_camera_find_quirk("Weft", "Other"));
}

static void check_format(const char *name, int bits, weft_cfa cfa, int n_frames)
{
    weft_camera_device *camera = NULL;
    weft_captured_frame frame = {0};
    fake_camera_start(&fake, name, "640x482");
    assert_ok(weft_camera_open("aravis:127.0.0.1", &camera, err));
    const weft_camera_state *const info = weft_camera_get_state(camera);
    assert_string_equal(info->id, "aravis:127.0.0.1");
    assert_true(info->width == 640 && info->height == 482 && info->cfa == cfa && info->bits == bits);
    assert_true(info->white == (1 << bits) - 1 && info->black[3] == 0 && info->gain == 1);
    for (int i = 0; i < n_frames; i++) {
        const weft_camera_settings wanted = {.exposure_s = 0.001 * (i + 1)};
        assert_ok(weft_camera_configure(camera, &wanted, err));
        assert_near(info->exposure_s, wanted.exposure_s, 1e-9);
        const uint64_t before = frame.sequence;
        expose_whole(camera, &frame);
        assert_near(frame.exposure_s, wanted.exposure_s, 1e-9);
        assert_int_equal(count_wrong(&frame, bits), 0);
        assert_true(frame.sequence != before);
        assert_true(frame.mosaic.cfa == cfa && frame.mosaic.white == (float)((1 << bits) - 1));
    }
    weft_mosaic_fini(&frame.mosaic);
    weft_camera_close(camera);
    fake_camera_kill(&fake);
}

static void test_frames_are_exact(void **state)
{
    (void)state;
    check_format("BayerRG16", 16, WEFT_CFA_RGGB, 20);
    check_format("BayerGB12p", 12, WEFT_CFA_GBRG, 3);
    check_format("BayerBG8", 8, WEFT_CFA_BGGR, 3);
    check_format("BayerRG14p", 14, WEFT_CFA_RGGB, 3);
    check_format("BayerGR10p", 10, WEFT_CFA_GRBG, 3);
}

static void test_a_region_of_the_sensor(void **state)
{
    (void)state;
    weft_camera_device *camera = NULL;
    weft_captured_frame frame = {0};
    fake_camera_start(&fake, "BayerRG16", "640x482");
    assert_ok(weft_camera_open("aravis:127.0.0.1", &camera, err));
    const weft_camera_state *const info = weft_camera_get_state(camera);
    expose_whole(camera, &frame);
    const weft_camera_settings part = {.exposure_s = 0.001, .region = {16, 20, 128, 64}};
    for (int i = 0; i < 2; i++) {
        assert_ok(weft_camera_configure(camera, &part, err));
        assert_true(info->width == 128 && info->height == 64);
        expose_whole(camera, &frame);
        assert_true(frame.mosaic.width == 128 && frame.mosaic.height == 64);
        assert_int_equal(count_wrong(&frame, 16), 0);
    }
    const weft_camera_region wrong[] = {
        {1, 0, 64, 64}, {0, 0, 63, 64}, {600, 0, 64, 64}, {0, -2, 64, 64}, {0, 0, 64, 1000}};
    for (int i = 0; i < 5; i++) {
        const weft_camera_settings bad = {.exposure_s = 0.001, .region = wrong[i]};
        assert_fails(weft_camera_configure(camera, &bad, err), WEFT_ERR_RANGE,
                     "even numbers inside 640 x 482");
    }
    assert_ok(weft_camera_configure(camera, &(weft_camera_settings){.exposure_s = 0.001}, err));
    expose_whole(camera, &frame);
    assert_true(frame.mosaic.width == 640 && frame.mosaic.height == 482);
    weft_mosaic_fini(&frame.mosaic);
    weft_camera_close(camera);
}

static void test_what_the_address_may_ask_for(void **state)
{
    (void)state;
    aravis_wishes w;
    assert_ok(aravis_read_wishes("", &w, err));
    assert_true(w.packet_bytes == 0 && w.resend == -1 && !w.line[0]);
    assert_ok(aravis_read_wishes(",packet=1400,resend=off,line=Line0", &w, err));
    assert_true(w.packet_bytes == 1400 && w.resend == 0 && strcmp(w.line, "Line0") == 0);
    assert_fails(aravis_read_wishes(",packet=100", &w, err), WEFT_ERR_USAGE,
                 "packet=100: wanted 220 to 65535");
    assert_fails(aravis_read_wishes(",packet=", &w, err), WEFT_ERR_USAGE, "220 to");
    assert_fails(aravis_read_wishes(",resend=maybe", &w, err), WEFT_ERR_USAGE, "on or off");
    assert_fails(aravis_read_wishes(",line=", &w, err), WEFT_ERR_USAGE, "name of an input");
    assert_fails(aravis_read_wishes(",speed=9", &w, err), WEFT_ERR_USAGE, "\"speed\"");
    assert_fails(aravis_read_wishes(",", &w, err), WEFT_ERR_USAGE, "packet=BYTES");

    weft_camera_device *camera = NULL;
    weft_captured_frame frame = {0};
    fake_camera_start(&fake, "BayerRG16", "320x240");
    assert_ok(weft_camera_open("aravis:127.0.0.1,packet=1400,resend=on", &camera, err));
    for (int i = 0; i < 3; i++) {
        expose_whole(camera, &frame);
        assert_int_equal(count_wrong(&frame, 16), 0);
    }
    weft_mosaic_fini(&frame.mosaic);
    weft_camera_close(camera);
    assert_fails(weft_camera_open("aravis:127.0.0.1,packet=7", &camera, err), WEFT_ERR_USAGE, "packet=7");
}

static void test_every_status_has_its_remedy(void **state)
{
    (void)state;
    const char *words[9];
    for (int i = 0; i < 9; i++) {
        words[i] = aravis_status_words((ArvBufferStatus)(i - 1)); /* from UNKNOWN to ABORTED */
        assert_int_equal(words[i][0] == '\0', i == 1);
        assert_true(i == 1 || strchr(words[i], ';') != NULL);
        for (int k = 0; k < i; k++)
            assert_string_not_equal(words[i], words[k]);
    }
}

/* After a stray frame: ours comes in the end, `least` frames of the camera's count after `before`.
 * @return whether it was told that there had been another */
static bool expose_after_stray(weft_camera_device *camera, weft_captured_frame *frame, int before, int least)
{
    bool told = false;
    for (int i = 0; i < 3; i++) {
        assert_ok(weft_camera_expose(camera, DEADLINE_S, frame, err));
        if (frame->status == WEFT_FRAME_COMPLETE)
            break;
        told |= strstr(frame->reason, "that nobody asked for") != NULL;
    }
    assert_int_equal(frame->status, WEFT_FRAME_COMPLETE);
    assert_true(frame->mosaic.data[0] - before >= least);
    assert_int_equal(count_wrong(frame, 16), 0);
    return told;
}

static void test_a_frame_that_nobody_asked_for_is_noticed(void **state)
{
    (void)state;
    weft_camera_device *camera = NULL;
    weft_captured_frame frame = {0};
    fake_camera_start(&fake, "BayerRG16", "64x64");
    assert_ok(weft_camera_open("aravis:127.0.0.1", &camera, err));
    for (int i = 0; i < 150; i++) /* over the end of the 16-bit count, 65535, which comes soon */
        expose_whole(camera, &frame);
    const int before = frame.mosaic.data[0]; /* it counts frames */
    fake_camera_tell(&fake, "stray");
    g_usleep(200000); /* it is here, and ours has the number after the next */
    assert_true(expose_after_stray(camera, &frame, before, 3));
    weft_mosaic_fini(&frame.mosaic);
    weft_camera_close(camera);
}

/* A frame that is under way when ours is called comes with the number that ours should have, and after a time
 * that ours could have taken: only the camera's clock tells them apart. */
static void test_a_frame_under_way_is_not_taken_for_ours(void **state)
{
    (void)state;
    weft_camera_device *camera = NULL;
    weft_captured_frame frame = {0};
    bool told = false;
    fake_camera_start(&fake, "BayerRG16", "64x64");
    assert_ok(weft_camera_open("aravis:127.0.0.1", &camera, err));
    for (int i = 0; i < 3; i++) {
        expose_whole(camera, &frame);
        const int before = frame.mosaic.data[0];
        fake_camera_tell(&fake, "delay 150");
        fake_camera_tell(&fake, "stray");
        g_usleep(30000);
        /* neither the stray one nor that which we called after it: both are void */
        told |= expose_after_stray(camera, &frame, before, 3);
        fake_camera_tell(&fake, "delay 0");
    }
    assert_true(told);
    weft_mosaic_fini(&frame.mosaic);
    weft_camera_close(camera);
}

static void test_clocks(void **state)
{
    (void)state;
    weft_frame_clock clock = {0};
    const double offset_s = -1e6; /* of the camera's clock, which runs 1e-4 faster */
    assert_near(weft_frame_clock_early(&clock, 5, 100), 0, 0);
    for (int i = 0; i < 40; i++) {
        const double at_s = 100 + 10 * i,
                     delay_s = i % 3 < 2 ? 0.0005 : 0.03; /* now and then the computer is busy */
        const double stamp_s = offset_s + at_s * (1 + 1e-4) + delay_s;
        assert_near(weft_frame_clock_early(&clock, stamp_s, at_s), 0, 0); /* ours is never refused */
        /* one that was begun 50 ms before it: the eight frames before go back 80 s, and the clocks 8 ms */
        if (i > 0)
            assert_near(weft_frame_clock_early(&clock, stamp_s - 0.05, at_s), 0.05 - delay_s - 0.004, 0.005);
        weft_frame_clock_learn(&clock, stamp_s, at_s);
    }
}

static void test_another_format_than_agreed_is_refused(void **state)
{
    (void)state;
    weft_camera_device *camera = NULL;
    weft_captured_frame frame = {0};
    fake_camera_start(&fake, "BayerRG16", "64x64");
    assert_ok(weft_camera_open("aravis:127.0.0.1", &camera, err));
    expose_whole(camera, &frame);
    fake_camera_tell(&fake, "format 0108000b");
    assert_ok(weft_camera_expose(camera, DEADLINE_S, &frame, err));
    assert_int_equal(frame.status, WEFT_FRAME_INCOMPLETE);
    assert_non_null(strstr(frame.reason, "of format 0x0108000b, not 64 x 64 BayerRG16"));
    weft_camera_close(camera);
    assert_ok(weft_camera_open("aravis:127.0.0.1", &camera, err)); /* which sets everything */
    expose_whole(camera, &frame);
    weft_mosaic_fini(&frame.mosaic);
    weft_camera_close(camera);
}

static weft_err count_pulses(void *context, weft_error *err)
{
    (void)err;
    ++*(int *)context;
    return WEFT_OK;
}

/* The stock camera has an input line that nothing can pulse: the frame that comes is the rig's test. */
static void test_a_pulse_that_never_comes(void **state)
{
    (void)state;
    weft_camera_device *camera = NULL;
    weft_captured_frame frame = {0};
    int pulses = 0;
    fake_camera_start(&fake, "BayerRG16", "64x64");
    assert_ok(weft_camera_open("aravis:127.0.0.1", &camera, err));
    weft_camera_set_fire(camera, count_pulses, &pulses);
    const weft_camera_settings wire = {.exposure_s = 0.001, .trigger = WEFT_TRIGGER_WIRE};
    assert_ok(weft_camera_configure(camera, &wire, err));
    assert_ok(weft_camera_expose(camera, 0.3, &frame, err));
    assert_int_equal(frame.status, WEFT_FRAME_TIMEOUT);
    assert_int_equal(pulses, 1);
    assert_ok(weft_camera_configure(camera, &(weft_camera_settings){.exposure_s = 0.001}, err));
    expose_whole(camera, &frame);
    weft_mosaic_fini(&frame.mosaic);
    weft_camera_close(camera);
    assert_ok(weft_camera_open("aravis:127.0.0.1,line=Line7", &camera, err));
    assert_fails(weft_camera_configure(camera, &wire, err), WEFT_ERR_UNSUPPORTED, "no trigger input Line7");
    weft_camera_close(camera);
}

static void test_settings_out_of_range(void **state)
{
    (void)state;
    weft_camera_device *camera = NULL;
    fake_camera_start(&fake, "BayerRG16", "64x64");
    assert_ok(weft_camera_open("aravis:127.0.0.1", &camera, err));
    assert_fails(weft_camera_configure(camera, &(weft_camera_settings){.exposure_s = 60}, err),
                 WEFT_ERR_RANGE, "only 1e-05 to 10 s");
    assert_fails(weft_camera_configure(camera, &(weft_camera_settings){.gain = 4}, err), WEFT_ERR_UNSUPPORTED,
                 "gain is not known");
    weft_camera_close(camera);
}

static void test_lost_packets_make_a_frame_incomplete(void **state)
{
    (void)state;
    weft_camera_device *camera = NULL;
    weft_captured_frame frame = {0};
    int n[3] = {0};
    fake_camera_start(&fake, "BayerRG16", "640x480");
    assert_ok(weft_camera_open("aravis:127.0.0.1", &camera, err));
    expose_whole(camera, &frame);
    fake_camera_tell(&fake, "lost 0.06"); /* 12 packets a frame: about half are hit */
    for (int i = 0; i < 40 && (n[WEFT_FRAME_COMPLETE] < 3 || n[WEFT_FRAME_INCOMPLETE] < 3); i++) {
        weft_error error = {0};
        /* A stream that was started anew may lose its throw-away frame as well. */
        const weft_err status = weft_camera_expose(camera, 0.4, &frame, &error);
        if (status != WEFT_OK)
            continue;
        n[frame.status]++;
        if (frame.status == WEFT_FRAME_COMPLETE)
            assert_int_equal(count_wrong(&frame, 16), 0);
        if (frame.status == WEFT_FRAME_INCOMPLETE)
            assert_non_null(strstr(frame.reason, "incomplete"));
    }
    assert_true(n[WEFT_FRAME_COMPLETE] >= 3 && n[WEFT_FRAME_INCOMPLETE] >= 3);
    fake_camera_tell(&fake, "lost 0");
    expose_whole(camera, &frame);
    assert_int_equal(count_wrong(&frame, 16), 0);
    weft_mosaic_fini(&frame.mosaic);
    weft_camera_close(camera);
}

static void test_a_late_frame_is_not_taken_for_the_next(void **state)
{
    (void)state;
    weft_camera_device *camera = NULL;
    weft_captured_frame frame = {0};
    fake_camera_start(&fake, "BayerRG16", "64x64");
    assert_ok(weft_camera_open("aravis:127.0.0.1", &camera, err));
    expose_whole(camera, &frame);
    const int first = frame.mosaic.data[0];
    fake_camera_tell(&fake, "delay 900");
    assert_ok(weft_camera_expose(camera, 0.3, &frame, err));
    assert_int_equal(frame.status, WEFT_FRAME_TIMEOUT);
    assert_non_null(strstr(frame.reason, "0.3 s"));
    fake_camera_tell(&fake, "delay 0");
    expose_whole(camera, &frame);
    assert_true(frame.mosaic.data[0] - first >= 3); /* the late one and a throw-away lie between */
    weft_mosaic_fini(&frame.mosaic);
    weft_camera_close(camera);
}

static weft_err kill_camera(void *context, weft_error *err)
{
    (void)context, (void)err;
    if (fake.pid > 0)
        fake_camera_kill(&fake);
    return WEFT_OK;
}

static weft_err cancel(void *context, weft_error *err)
{
    (void)context;
    return weft_fail(err, WEFT_ERR_CANCELLED, "enough");
}

static void test_a_wait_can_be_cancelled(void **state)
{
    (void)state;
    weft_camera_device *camera = NULL;
    weft_captured_frame frame = {0};
    fake_camera_start(&fake, "BayerRG16", "64x64");
    assert_ok(weft_camera_open("aravis:127.0.0.1", &camera, err));
    expose_whole(camera, &frame);
    fake_camera_tell(&fake, "delay 40000");
    weft_camera_set_idle(camera, cancel, NULL);
    const double start_s = weft_clock_s();
    assert_fails(weft_camera_expose(camera, 50, &frame, err), WEFT_ERR_CANCELLED, "enough");
    assert_true(weft_clock_s() - start_s < 20); /* and not when the frame comes */
    weft_camera_set_idle(camera, NULL, NULL);
    weft_mosaic_fini(&frame.mosaic);
    weft_camera_close(camera);
}

static void test_a_camera_that_dies_is_an_error_in_time(void **state)
{
    (void)state;
    weft_camera_device *camera = NULL;
    weft_captured_frame frame = {0};
    fake_camera_start(&fake, "BayerRG16", "64x64");
    assert_ok(weft_camera_open("aravis:127.0.0.1", &camera, err));
    expose_whole(camera, &frame);
    fake_camera_tell(&fake, "delay 5000");
    weft_camera_set_idle(camera, kill_camera, NULL);
    const double start_s = weft_clock_s();
    weft_error error = {0};
    assert_int_not_equal(weft_camera_expose(camera, 4, &frame, &error), WEFT_OK);
    assert_non_null(strstr(error.text, "camera 127.0.0.1"));
    assert_non_null(strstr(error.text, "cable"));
    assert_true(weft_clock_s() - start_s < 15);
    weft_mosaic_fini(&frame.mosaic);
    weft_camera_close(camera);
}

static void test_ids(void **state)
{
    (void)state;
    weft_camera_device *camera = NULL;
    assert_fails(weft_camera_open("nikon", &camera, err), WEFT_ERR_USAGE, "aravis:192.168.1.20");
    assert_fails(weft_camera_open("v4l:/dev/video0", &camera, err), WEFT_ERR_USAGE, "backends aravis");
    assert_fails(weft_camera_open("aravis:", &camera, err), WEFT_ERR_USAGE, "BACKEND:ADDRESS");
    assert_null(camera);
}

static void test_no_raw_format(void **state)
{
    (void)state;
    weft_camera_device *camera = NULL;
    fake_camera_start(&fake, "Mono8", "64x64");
    assert_fails(weft_camera_open("aravis:127.0.0.1", &camera, err), WEFT_ERR_UNSUPPORTED,
                 "no raw Bayer format (only Mono8");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_formats_by_name),
        cmocka_unit_test(test_ids),
        cmocka_unit_test_teardown(test_frames_are_exact, end_fake),
        cmocka_unit_test_teardown(test_settings_out_of_range, end_fake),
        cmocka_unit_test_teardown(test_a_region_of_the_sensor, end_fake),
        cmocka_unit_test_teardown(test_what_the_address_may_ask_for, end_fake),
        cmocka_unit_test(test_every_status_has_its_remedy),
        cmocka_unit_test_teardown(test_a_frame_that_nobody_asked_for_is_noticed, end_fake),
        cmocka_unit_test(test_clocks),
        cmocka_unit_test_teardown(test_a_frame_under_way_is_not_taken_for_ours, end_fake),
        cmocka_unit_test_teardown(test_another_format_than_agreed_is_refused, end_fake),
        cmocka_unit_test_teardown(test_a_pulse_that_never_comes, end_fake),
        cmocka_unit_test_teardown(test_no_raw_format, end_fake),
        cmocka_unit_test_teardown(test_lost_packets_make_a_frame_incomplete, end_fake),
        cmocka_unit_test_teardown(test_a_late_frame_is_not_taken_for_the_next, end_fake),
        cmocka_unit_test_teardown(test_a_wait_can_be_cancelled, end_fake),
        cmocka_unit_test_teardown(test_a_camera_that_dies_is_an_error_in_time, end_fake),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
