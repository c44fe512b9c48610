/* set.json: what it may say, what is kept, what is refused. */
#include "tests/support/support.h"

#include "core/file.h"
#include "core/mem.h"
#include "host/set/set.h"

#include <stdio.h>
#include <string.h>

#define HEAD "{\"weft\":\"set\",\"version\":1,\"name\":\"twill\",\"created\":\"2026-11-23T10:00:00Z\","
#define SENSOR                                                                                               \
    "\"sensor\":{\"width\":64,\"height\":48,\"cfa\":\"RGGB\",\"black\":[256,256,256,256],\"white\":15871},"
#define SHA "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"

static const char *write_set(const char *text)
{
    const char *const folder = weft_test_path("a.set");
    assert_ok(weft_folder_create(folder, err));
    assert_ok(weft_file_write(weft_test_path("a.set/set.json"), text, strlen(text), err));
    return folder;
}

static void test_what_is_written_is_read(void **state)
{
    (void)state;
    weft_set set, back;
    assert_ok(weft_folder_create(weft_test_path("b.set"), err));
    assert_ok(weft_set_init(&set, weft_test_path("b.set"), err));
    assert_int_equal(strlen(set.created), 20);
    set.name = weft_strdup("harris-tweed \xc3\xa9", NULL);
    snprintf(set.camera_backend, sizeof set.camera_backend, "aravis");
    snprintf(set.camera_serial, sizeof set.camera_serial, "A17");
    set.width = 1232;
    set.height = 816;
    set.cfa = WEFT_CFA_GBRG;
    for (int i = 0; i < 4; i++)
        set.black[i] = 250 + i;
    set.white = 15871;
    set.mask_file = weft_strdup("mask.png", NULL);
    set.noise = (weft_noise){1e-8, 3e-5};
    set.noise_gain = 1.5;
    json_t *const capture = json_pack("{s:i, s:i}", "retries", 2, "mean_of", 16);
    const weft_set_frame frames[] = {
        {.file = "light-00.dng",
         .role = WEFT_ROLE_LIGHT,
         .exposure_s = 0.125,
         .gain = 1.5,
         .sha256 = SHA,
         .capture = capture},
        {.file = "light-00b.dng", .role = WEFT_ROLE_LIGHT, .exposure_s = 0.03125, .gain = 1},
        {.file = "ambient.dng", .role = WEFT_ROLE_AMBIENT, .light = -1, .exposure_s = 0.125, .gain = 1},
        {.file = "dark.dng", .role = WEFT_ROLE_DARK, .light = -1, .exposure_s = 0.1, .gain = 1},
        {.file = "all.dng", .role = WEFT_ROLE_ALL, .light = -1, .exposure_s = 0.01, .gain = 1},
    };
    for (size_t i = 0; i < 5; i++)
        assert_ok(weft_set_add_frame(&set, &frames[i], err));
    for (int complete = 0; complete < 2; complete++) {
        set.complete = complete;
        assert_ok(weft_set_save(&set, err));
        assert_ok(
            weft_set_load(complete ? weft_test_path("b.set") : weft_test_path("b.set/set.json"), &back, err));
        assert_string_equal(back.name, set.name);
        assert_string_equal(back.created, set.created);
        assert_string_equal(back.camera_backend, "aravis");
        assert_string_equal(back.camera_serial, "A17");
        assert_string_equal(back.mask_file, "mask.png");
        assert_string_equal(back.folder, weft_test_path("b.set"));
        assert_true(back.width == 1232 && back.height == 816 && back.cfa == WEFT_CFA_GBRG &&
                    back.white == 15871);
        assert_memory_equal(back.black, set.black, sizeof set.black);
        assert_true(back.noise.read == 1e-8 && back.noise.shot == 3e-5 && back.noise_gain == 1.5);
        assert_near(weft_set_frame_time(&back.frames[0]), 0.1875, 0);
        assert_int_equal(weft_set_frame_mean_of(&back.frames[0]), 16);
        assert_int_equal(weft_set_frame_mean_of(&back.frames[1]), 1);
        assert_true(back.complete == set.complete && back.n_frames == 5 && !back.other);
        for (int i = 0; i < 5; i++) {
            const weft_set_frame *const a = &back.frames[i], *const b = &frames[i];
            assert_string_equal(a->file, b->file);
            assert_string_equal(a->sha256, b->sha256);
            assert_true(a->role == b->role && a->light == b->light && a->exposure_s == b->exposure_s &&
                        a->gain == b->gain && json_equal(a->capture, b->capture) == (b->capture != NULL));
        }
        char *const path = weft_set_frame_path(&back, 1, NULL);
        assert_string_equal(path, weft_test_path("b.set/light-00b.dng"));
        weft_free(path);
        weft_set_fini(&back);
    }
    weft_set_fini(&set);
}

static void test_unknown_keys_are_kept(void **state)
{
    (void)state;
    weft_set set;
    const char *const folder = write_set(
        HEAD
        "\"camera\":{\"model\":\"m\",\"lens\":\"60 mm\"},"
        "\"sensor\":{\"width\":64,\"height\":48,\"cfa\":\"none\",\"transfer\":\"linear\",\"pitch_um\":3.5},"
        "\"frames\":[],\"state\":\"capturing\",\"notes\":[1,2]}");
    for (int round = 0; round < 2; round++) {
        assert_ok(weft_set_load(folder, &set, err));
        assert_int_equal(set.transfer, WEFT_TRANSFER_LINEAR);
        assert_int_equal(json_array_size(json_object_get(set.other, "notes")), 2);
        assert_string_equal(json_string_value(json_object_get(json_object_get(set.other, "camera"), "lens")),
                            "60 mm");
        assert_near(json_number_value(json_object_get(json_object_get(set.other, "sensor"), "pitch_um")), 3.5,
                    0);
        assert_null(json_object_get(set.other, "frames"));
        assert_ok(weft_set_save(&set, err));
        weft_set_fini(&set);
    }
}

static void test_what_is_wrong_is_named(void **state)
{
    (void)state;
#define FRAME(text) HEAD SENSOR "\"frames\":[" text "],\"state\":\"complete\"}"
#define NOISE(text)                                                                                          \
    HEAD "\"sensor\":{\"width\":6,\"height\":9,\"cfa\":\"RGGB\",\"noise\":" text                             \
         "},\"frames\":[],\"state\":\"complete\"}"
    const struct {
        const char *text;
        weft_err code;
        const char *says;
    } bad[] = {
        {"", WEFT_ERR_FORMAT, "set.json: line 1: not JSON"},
        {"[]", WEFT_ERR_FORMAT, "no JSON object"},
        {"{\"weft\":\"set\",\"version\":2}", WEFT_ERR_VERSION, "update Weft"},
        {"{\"weft\":\"set\",\"version\":0}", WEFT_ERR_RANGE, "version"},
        {"{\"weft\":\"calibration\",\"version\":1}", WEFT_ERR_FORMAT,
         "is a \"calibration\", wanted a \"set\""},
        {HEAD "\"frames\":[],\"state\":\"complete\"}", WEFT_ERR_FORMAT, "\"sensor\" is missing"},
        {HEAD SENSOR "\"state\":\"complete\"}", WEFT_ERR_FORMAT, "\"frames\" is missing"},
        {HEAD SENSOR "\"frames\":[]}", WEFT_ERR_FORMAT, "\"state\" is missing"},
        {HEAD SENSOR "\"frames\":[],\"state\":\"done\"}", WEFT_ERR_FORMAT, "wanted capturing or complete"},
        {HEAD "\"sensor\":{\"width\":64,\"height\":0,\"cfa\":\"RGGB\"},\"frames\":[],\"state\":\"complete\"}",
         WEFT_ERR_RANGE, "\"height\" is 0"},
        {HEAD
         "\"sensor\":{\"width\":64,\"height\":99999,\"cfa\":\"RGGB\"},\"frames\":[],\"state\":\"complete\"}",
         WEFT_ERR_RANGE, "99999"},
        {HEAD "\"sensor\":{\"width\":6,\"height\":9,\"cfa\":\"RGB\"},\"frames\":[],\"state\":\"complete\"}",
         WEFT_ERR_FORMAT, "wanted RGGB"},
        {HEAD
         "\"sensor\":{\"width\":6,\"height\":9,\"cfa\":\"RGGB\",\"black\":[1,2,3],\"white\":9},\"frames\":[],"
         "\"state\":\"complete\"}",
         WEFT_ERR_FORMAT, "3 numbers, wanted 4"},
        {HEAD "\"sensor\":{\"width\":6,\"height\":9,\"cfa\":\"RGGB\",\"black\":[1,2,3,9],\"white\":9},"
              "\"frames\":[],"
              "\"state\":\"complete\"}",
         WEFT_ERR_RANGE, "black level 9"},
        {NOISE("7"), WEFT_ERR_FORMAT, "noise"},
        {NOISE("{\"read\":1e-8,\"gain\":1}"), WEFT_ERR_FORMAT, "\"shot\" is missing"},
        {NOISE("{\"read\":-1,\"shot\":1e-5,\"gain\":1}"), WEFT_ERR_RANGE, "\"read\" is -1"},
        {NOISE("{\"read\":1e-8,\"shot\":1e-5,\"gain\":0}"), WEFT_ERR_RANGE, "\"gain\" is 0"},
        {NOISE("{\"read\":0,\"shot\":0,\"gain\":1}"), WEFT_ERR_RANGE, "says that there is none"},
        {FRAME("7"), WEFT_ERR_FORMAT, "frame 0: is not an object"},
        {FRAME("{\"role\":\"dark\",\"exposure_s\":1}"), WEFT_ERR_FORMAT, "frame 0: \"file\" is missing"},
        {FRAME("{\"file\":\"a\",\"role\":\"flash\",\"exposure_s\":1}"), WEFT_ERR_FORMAT,
         "wanted light, ambient"},
        {FRAME("{\"file\":\"a\",\"role\":\"light\",\"exposure_s\":1}"), WEFT_ERR_FORMAT,
         "\"light\" is missing"},
        {FRAME("{\"file\":\"a\",\"role\":\"light\",\"light\":-1,\"exposure_s\":1}"), WEFT_ERR_RANGE,
         "\"light\" is -1"},
        {FRAME("{\"file\":\"a\",\"role\":\"dark\"}"), WEFT_ERR_FORMAT, "\"exposure_s\" is missing"},
        {FRAME("{\"file\":\"a\",\"role\":\"dark\",\"exposure_s\":0}"), WEFT_ERR_RANGE,
         "a has an exposure of 0 s"},
        {FRAME("{\"file\":\"a\",\"role\":\"dark\",\"exposure_s\":1,\"gain\":-1}"), WEFT_ERR_RANGE,
         "\"gain\" is -1"},
        {FRAME("{\"file\":\"a\",\"role\":\"dark\",\"exposure_s\":1,\"sha256\":\"12\"}"), WEFT_ERR_FORMAT,
         "\"sha256\" of a is not 64"},
        {FRAME("{\"file\":\"../a\",\"role\":\"dark\",\"exposure_s\":1}"), WEFT_ERR_FORMAT,
         "\"../a\" leads out of the set's folder"},
        {FRAME("{\"file\":\"b/..\",\"role\":\"dark\",\"exposure_s\":1}"), WEFT_ERR_FORMAT, "leads out"},
        {FRAME("{\"file\":\"b/../../a\",\"role\":\"dark\",\"exposure_s\":1}"), WEFT_ERR_FORMAT, "leads out"},
        {FRAME("{\"file\":\"\",\"role\":\"dark\",\"exposure_s\":1}"), WEFT_ERR_FORMAT, "is empty"},
        {FRAME("{\"file\":\"a\",\"role\":\"dark\",\"exposure_s\":1},{\"file\":\"a\",\"role\":\"all\","
               "\"exposure_s\":1}"),
         WEFT_ERR_FORMAT, "the file a is listed twice"},
        {HEAD SENSOR "\"frames\":[],\"mask\":\"../m.png\",\"state\":\"complete\"}", WEFT_ERR_FORMAT,
         "leads out"},
    };
    weft_set set;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        const char *const folder = write_set(bad[i].text);
        assert_fails(weft_set_load(folder, &set, err), bad[i].code, bad[i].says);
        assert_fails(weft_set_load(folder, &set, err), bad[i].code, "set.json");
    }
    assert_fails(weft_set_load(weft_test_path("absent"), &set, err), WEFT_ERR_MISSING, "holds no set.json");
    const char *const good = write_set(FRAME("{\"file\":\"/abs/../a..b\",\"role\":\"dark\",\"exposure_s\":1},"
                                             "{\"file\":\"x..y/..z\",\"role\":\"all\",\"exposure_s\":1}"));
    assert_ok(weft_set_load(good, &set, err)); /* absolute, and dots that lead nowhere */
    assert_near(set.frames[0].gain, 1, 0);
    char *const path = weft_set_frame_path(&set, 0, NULL);
    assert_string_equal(path, "/abs/../a..b");
    weft_free(path);
    weft_set_fini(&set);
}

static void test_missing_lights_are_named(void **state)
{
    (void)state;
    weft_set set;
    assert_ok(weft_set_init(&set, "x.set", err));
    assert_fails(weft_set_require_lights(&set, err), WEFT_ERR_MISSING, "no frame of any light");
    const weft_set_frame frames[] = {{.file = "0", .light = 0, .exposure_s = 1, .gain = 1},
                                     {.file = "2", .light = 2, .exposure_s = 1, .gain = 1},
                                     {.file = "1", .light = 1, .exposure_s = 1, .gain = 1}};
    assert_ok(weft_set_add_frame(&set, &frames[0], err));
    assert_ok(weft_set_add_frame(&set, &frames[1], err));
    assert_int_equal(weft_set_n_lights(&set), 3);
    assert_fails(weft_set_require_lights(&set, err), WEFT_ERR_MISSING,
                 "x.set: light 1 has no frame; take it with weft capture --resume");
    assert_ok(weft_set_add_frame(&set, &frames[2], err));
    assert_fails(weft_set_require_lights(&set, err), WEFT_ERR_MISSING, "interrupted");
    set.complete = true;
    assert_ok(weft_set_require_lights(&set, err));
    assert_fails(weft_set_add_frame(&set, &frames[0], err), WEFT_ERR_FORMAT, "listed twice");
    weft_set_fini(&set);
}

static void test_without_memory(void **state)
{
    (void)state;
    weft_set set;
    const char *const folder = write_set(
        FRAME("{\"file\":\"a\",\"role\":\"light\",\"light\":0,\"exposure_s\":1,\"capture\":{\"a\":1}},"
              "{\"file\":\"b\",\"role\":\"all\",\"exposure_s\":1}"));
    long n = 0;
    for (;; n++) {
        weft_mem_fail_after(n);
        const weft_err status = weft_set_load(folder, &set, NULL);
        weft_mem_fail_after(-1);
        if (status == WEFT_OK)
            break;
        assert_int_equal(status, WEFT_ERR_NOMEM);
    }
    assert_true(n > 5);
    weft_set_fini(&set);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_is_written_is_read), cmocka_unit_test(test_unknown_keys_are_kept),
        cmocka_unit_test(test_what_is_wrong_is_named),  cmocka_unit_test(test_missing_lights_are_named),
        cmocka_unit_test(test_without_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
