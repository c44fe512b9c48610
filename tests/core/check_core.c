/* Errors, numbers, options, atomic files, JSON, hashes, parallel loops. */
#include "tests/support/support.h"

#include "core/fields.h"
#include "core/file.h"
#include "core/image.h"
#include "core/json.h"
#include "core/linalg.h"
#include "core/mem.h"
#include "core/parallel.h"
#include "core/sha256.h"
#include "core/text.h"

#include <dirent.h>
#include <locale.h>
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static void test_error_text_is_kept_and_prefixed(void **state)
{
    (void)state;
    weft_error error = {0};
    assert_int_equal(weft_fail(&error, WEFT_ERR_TIMEOUT, "light %d: no answer", 7), WEFT_ERR_TIMEOUT);
    assert_int_equal(weft_prefix(&error, WEFT_ERR_TIMEOUT, "capture"), WEFT_ERR_TIMEOUT);
    assert_string_equal(error.text, "capture: light 7: no answer");
    assert_int_equal(weft_fail(NULL, WEFT_ERR_IO, "x"), WEFT_ERR_IO);
    assert_int_equal(weft_err_exit_status(WEFT_ERR_CANCELLED), 130);
    assert_int_equal(weft_err_exit_status(WEFT_ERR_USAGE), 2);
    assert_string_equal(weft_err_name(WEFT_ERR_FORMAT), "FORMAT");
}

static void test_error_text_is_one_line_of_utf8(void **state)
{
    (void)state;
    weft_error error;
    weft_fail(&error, WEFT_ERR_FORMAT, "a\nb\x1b[1m\xff %s\xe2\x82", "\xc3\xa9\xf0\x9f\xa7\xb5");
    assert_string_equal(error.text, "a?b?[1m? \xc3\xa9\xf0\x9f\xa7\xb5??");
    weft_prefix(&error, WEFT_ERR_FORMAT, "x\ty");
    assert_string_equal(error.text, "x?y: a?b?[1m? \xc3\xa9\xf0\x9f\xa7\xb5??");
    char long_text[2048];
    memset(long_text, 'a', sizeof long_text);
    memcpy(long_text + sizeof error.text - 2, "\xc3\xa9", 3); /* cut in the middle of a letter */
    weft_fail(&error, WEFT_ERR_FORMAT, "%s", long_text);
    assert_true(weft_text_is_utf8(error.text, strlen(error.text)));
}

static void test_numbers_ignore_the_locale(void **state)
{
    (void)state;
    double x;
    int i;
    setlocale(LC_ALL, "de_DE.UTF-8"); /* where absent this test is merely weaker */
    assert_true(weft_text_to_double(" 0.5 ", &x) && x == 0.5);
    setlocale(LC_ALL, "C");
    assert_false(weft_text_to_double("0,5", &x));
    assert_false(weft_text_to_double("nan", &x));
    assert_false(weft_text_to_double("inf", &x));
    assert_false(weft_text_to_double("", &x));
    assert_false(weft_text_to_double("1e999", &x));
    assert_true(weft_text_to_int("-12", &i) && i == -12);
    assert_false(weft_text_to_int("99999999999", &i));
    assert_false(weft_text_to_int("1.5", &i));
}

static void test_utf8(void **state)
{
    (void)state;
    assert_true(weft_text_is_utf8("Gr\xc3\xbc\xc3\x9f", 6));
    assert_false(weft_text_is_utf8("\xff", 1));
    assert_false(weft_text_is_utf8("\xc0\x80", 2));     /* overlong */
    assert_false(weft_text_is_utf8("\xed\xa0\x80", 3)); /* surrogate */
    assert_false(weft_text_is_utf8("\xe2\x82", 2));     /* cut */
}

typedef struct sample_args {
    bool flag;
    int count, method;
    double exposure;
    const char *name;
    weft_size size;
    weft_numbers at;
    weft_texts words;
} sample_args;

static const weft_field sample_fields[] = {
    {.key = "flag",
     .short_opt = 'f',
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(sample_args, flag),
     .help = "a flag"},
    {.key = "count",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(sample_args, count),
     .min = 1,
     .max = 9,
     .def = "3",
     .help = "a count"},
    {.key = "method",
     .type = WEFT_FIELD_CHOICE,
     .offset = offsetof(sample_args, method),
     .choices = "lsq|robust",
     .def = "robust",
     .help = "a choice"},
    {.key = "exposure",
     .short_opt = 'e',
     .type = WEFT_FIELD_F64,
     .offset = offsetof(sample_args, exposure),
     .unit = "s",
     .min = 1e-5,
     .max = 10,
     .def = "0.02",
     .help = "a time"},
    {.key = "name", .type = WEFT_FIELD_TEXT, .offset = offsetof(sample_args, name), .help = "a name"},
    {.key = "size", .type = WEFT_FIELD_SIZE, .offset = offsetof(sample_args, size), .help = "a size"},
    {.key = "at", .type = WEFT_FIELD_F64S, .offset = offsetof(sample_args, at), .help = "a place"},
    {.key = "word", .type = WEFT_FIELD_TEXTS, .offset = offsetof(sample_args, words), .help = "a word"},
    {0},
};

static weft_err parse(sample_args *args, int argc, char **argv, const char **operands, int *n,
                      weft_error *err)
{
    *args = (sample_args){0};
    weft_fields_set_defaults(sample_fields, args);
    const weft_field *const tables[] = {sample_fields};
    void *const structs[] = {args};
    return weft_fields_parse_argv(tables, structs, 1, argc, argv, operands, n, err);
}

static void test_options_parse(void **state)
{
    (void)state;
    sample_args args;
    const char *operands[16];
    int n;
    char *argv[] = {"in",    "--count=5", "-e0.5",  "--method", "lsq", "--size",
                    "12x34", "--at",      "1,-2.5", "-f",       "--",  "--x"};
    assert_ok(parse(&args, 12, argv, operands, &n, err));
    assert_true(args.flag && args.count == 5 && args.method == 0 && args.exposure == 0.5);
    assert_true(args.size.width == 12 && args.size.height == 34 && args.at.n == 2 &&
                args.at.values[1] == -2.5);
    assert_int_equal(n, 2);
    assert_string_equal(operands[1], "--x");
    char *none[] = {"a"};
    assert_ok(parse(&args, 1, none, operands, &n, err));
    assert_true(args.count == 3 && args.method == 1 && args.exposure == 0.02 && !args.name);
    assert_int_equal(args.words.n, 0);
    char *repeated[] = {"--word", "a=1", "--word=b=2"};
    assert_ok(parse(&args, 3, repeated, operands, &n, err));
    assert_int_equal(args.words.n, 2);
    assert_string_equal(args.words.values[0], "a=1");
    assert_string_equal(args.words.values[1], "b=2");
}

static void test_options_refuse(void **state)
{
    (void)state;
    sample_args args;
    const char *operands[16];
    int n;
    const struct {
        char *word, *value;
        const char *says;
    } bad[] = {
        {"--cuont", "3", "did you mean --count"},
        {"--count", "10", "from 1 to 9"},
        {"--count", "x", "whole number"},
        {"--exposure", "nan", "number"},
        {"--method", "svd", "lsq|robust"},
        {"--size", "12", "1232x816"},
        {"--at", "1,,2", "commas"},
        {"--flag=1", NULL, "no value"},
        {"--name", NULL, "wants a value"},
        {"--name", "\xff", "UTF-8"},
        {"--word", "\xff", "UTF-8"},
        {"-z", NULL, "no such option"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        char *argv[] = {bad[i].word, bad[i].value};
        assert_fails(parse(&args, bad[i].value ? 2 : 1, argv, operands, &n, err), WEFT_ERR_USAGE,
                     bad[i].says);
    }
}

static int count_entries(const char *folder)
{
    DIR *const d = opendir(folder);
    int n = 0;
    while (readdir(d))
        n++;
    closedir(d);
    return n - 2;
}

static void test_atomic_files(void **state)
{
    (void)state;
    const char *const folder = weft_test_path("atomic");
    assert_ok(weft_folder_create(folder, err));
    const char *const path = weft_test_path("atomic/a.txt");
    assert_ok(weft_file_write(path, "one", 3, err));
    weft_atomic a = {0};
    assert_ok(weft_atomic_file_begin(&a, path, err));
    assert_true(weft_file_exists(a.temp_path));
    weft_atomic_abort(&a);
    char *text;
    size_t n;
    assert_ok(weft_file_read(path, 100, &text, &n, err));
    assert_string_equal(text, "one");
    weft_free(text);
    assert_int_equal(count_entries(folder), 1);
    assert_fails(weft_file_read(path, 2, &text, &n, err), WEFT_ERR_FORMAT, "a.txt");
    assert_fails(weft_file_refuse_existing(path, false, err), WEFT_ERR_EXISTS, "--force");
    assert_fails(weft_atomic_file_begin(&a, weft_test_path("no/such/file"), err), WEFT_ERR_IO,
                 "no/such/file");
    assert_fails(weft_file_write(folder, "x", 1, err), WEFT_ERR_IO, "is a folder");
    const char *const pipe = weft_test_path("atomic/pipe"); /* as /dev/null, which root could replace */
    assert_int_equal(mkfifo(pipe, 0666), 0);
    assert_fails(weft_file_write(pipe, "x", 1, err), WEFT_ERR_IO, "is a device or pipe");
    assert_fails(weft_file_read(pipe, 100, &text, &n, err), WEFT_ERR_IO, "is a device or pipe");
    assert_fails(weft_file_read(folder, 100, &text, &n, err), WEFT_ERR_IO, "is a folder");
    assert_ok(weft_file_write(path, "", 0, err));
    assert_ok(weft_file_read(path, 0, &text, &n, err));
    assert_true(n == 0 && text[0] == '\0');
    weft_free(text);
}

static void test_atomic_folders_replace_only_when_forced(void **state)
{
    (void)state;
    const char *const path = weft_test_path("result.maps/");
    weft_atomic a = {0};
    for (int round = 0; round < 2; round++) {
        assert_ok(weft_atomic_folder_begin(&a, path, round > 0, err));
        char *const inside = weft_path_join(a.temp_path, round ? "new" : "old", NULL);
        assert_ok(weft_file_write(inside, "x", 1, err));
        weft_free(inside);
        assert_ok(weft_atomic_commit(&a, err));
    }
    assert_true(weft_file_exists(weft_test_path("result.maps/new")));
    assert_false(weft_file_exists(weft_test_path("result.maps/old")));
    assert_fails(weft_atomic_folder_begin(&a, path, false, err), WEFT_ERR_EXISTS, "result.maps");
}

static atomic_bool replaced;

/* Looks without pause whether `path` is there. */
static void *look(void *path)
{
    bool absent = false;
    while (!absent && !atomic_load(&replaced))
        absent = access(path, F_OK) != 0;
    return absent ? path : NULL;
}

static void test_a_folder_is_replaced_in_one_step(void **state)
{
    (void)state;
    char path[1024];
    void *absent;
    pthread_t looking;
    assert_ok(weft_folder_create(weft_test_path("once"), err));
    snprintf(path, sizeof path, "%s", weft_test_path("once/always"));
    for (int round = 0; round < 30; round++) {
        weft_atomic a;
        assert_ok(weft_atomic_folder_begin(&a, path, true, err));
        char *const inside = weft_path_join(a.temp_path, "x", NULL);
        assert_ok(weft_file_write(inside, "x", 1, err));
        weft_free(inside);
        assert_ok(weft_atomic_commit(&a, err));
        if (round == 0)
            assert_int_equal(pthread_create(&looking, NULL, look, path), 0);
    }
    atomic_store(&replaced, true);
    assert_int_equal(pthread_join(looking, &absent), 0);
    assert_null(absent);
    assert_int_equal(count_entries(weft_test_path("once")), 1); /* and nothing that was replaced */
}

static void test_json_names_file_and_key(void **state)
{
    (void)state;
    const char *const path = weft_test_path("x.json");
    const char *const text = "{\"weft\":\"set\",\"version\":9,\"n\":-1,\"v\":[1,2],\"t\":3}";
    assert_ok(weft_file_write(path, text, strlen(text), err));
    json_t *object;
    assert_fails(weft_json_load_kind(path, "set", 1, &object, err), WEFT_ERR_VERSION, "update Weft");
    assert_fails(weft_json_load_kind(path, "calibration", 1, &object, err), WEFT_ERR_FORMAT, "x.json");
    assert_ok(weft_json_load_kind(path, "set", 9, &object, err));
    double number, numbers[3];
    const char *word;
    assert_fails(weft_json_get_number(object, "n", WEFT_JSON_REQUIRED, 0, 1, &number, path, err),
                 WEFT_ERR_RANGE, "\"n\" is -1");
    assert_fails(weft_json_get_numbers(object, "v", WEFT_JSON_REQUIRED, 3, numbers, path, err),
                 WEFT_ERR_FORMAT, "wanted 3");
    assert_fails(weft_json_get_text(object, "t", WEFT_JSON_REQUIRED, &word, path, err), WEFT_ERR_FORMAT,
                 "\"t\" is not a text");
    assert_fails(weft_json_get_text(object, "absent", WEFT_JSON_REQUIRED, &word, path, err), WEFT_ERR_FORMAT,
                 "absent");
    assert_ok(weft_json_get_text(object, "absent", WEFT_JSON_OPTIONAL, &word, path, err));
    json_decref(object);
    assert_ok(weft_file_write(path, "{\"a\":", 5, err));
    assert_fails(weft_json_load(path, &object, err), WEFT_ERR_FORMAT, "line 1");
    assert_ok(weft_file_write(path, "{\"a\":\"\xff\"}", 9, err));
    assert_fails(weft_json_load(path, &object, err), WEFT_ERR_FORMAT, "x.json");
}

static void test_sha256_known_answers(void **state)
{
    (void)state;
    /* FIPS 180-4 examples: "abc", and a million times "a". */
    weft_sha256 hash;
    char hex[65];
    weft_sha256_init(&hash);
    weft_sha256_update(&hash, "abc", 3);
    weft_sha256_final_hex(&hash, hex);
    assert_string_equal(hex, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    weft_sha256_init(&hash);
    for (int i = 0; i < 1000000 / 50; i++)
        weft_sha256_update(&hash, "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa", 50);
    weft_sha256_final_hex(&hash, hex);
    assert_string_equal(hex, "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

static void double_rows(void *context, int band, int begin, int end)
{
    (void)band;
    weft_image *const image = context;
    for (int v = begin; v < end; v++)
        for (int u = 0; u < image->width; u++)
            weft_image_row(image, 0, v)[u] += (float)(v * image->width + u);
}

static void test_parallel_rows_do_each_row_once(void **state)
{
    (void)state;
    for (int threads = 1; threads <= 7; threads += 3) {
        weft_image image;
        assert_ok(weft_image_init(&image, 5, 53, 1, err));
        weft_parallel_set_threads(threads);
        weft_parallel_rows(image.height, double_rows, &image);
        for (int i = 0; i < 5 * 53; i++)
            assert_true(image.data[i] == (float)i);
        weft_image_fini(&image);
    }
    weft_parallel_set_threads(0);
}

static void test_images_refuse_impossible_sizes(void **state)
{
    (void)state;
    weft_image image;
    assert_fails(weft_image_init(&image, 0, 5, 1, err), WEFT_ERR_RANGE, "0 x 5");
    assert_fails(weft_image_init(&image, 1 << 20, 5, 1, err), WEFT_ERR_RANGE, "32768");
    weft_mem_fail_after(0);
    assert_fails(weft_image_init(&image, 4, 4, 1, err), WEFT_ERR_NOMEM, "out of memory");
    weft_mem_fail_after(-1);
}

static void test_bilinear_sample(void **state)
{
    (void)state;
    weft_image image;
    assert_ok(weft_image_init(&image, 3, 2, 1, err));
    for (int i = 0; i < 6; i++)
        image.data[i] = (float)(i % 3 + 10 * (i / 3));
    assert_near((double)weft_image_sample(&image, 0, 1.25, 0.5), 6.25, 1e-6);
    assert_near((double)weft_image_sample(&image, 0, -4, 9), 10, 1e-6);
    weft_image_fini(&image);
}

static void test_cfa(void **state)
{
    (void)state;
    weft_cfa cfa;
    assert_true(weft_cfa_from_name("GBRG", &cfa) && cfa == WEFT_CFA_GBRG);
    assert_false(weft_cfa_from_name("RGBW", &cfa));
    for (int c = WEFT_CFA_RGGB; c <= WEFT_CFA_BGGR; c++)
        for (int k = 0; k < 4; k++)
            assert_int_equal("RGB"[weft_cfa_colour((weft_cfa)c, k & 1, k >> 1)],
                             weft_cfa_name((weft_cfa)c)[k]);
}

static void test_matrix_inverse(void **state)
{
    (void)state;
    const weft_mat3 a = {{2, 1, 0, -1, 3, 2, 0.5, 0, 1}};
    weft_mat3 inverse;
    assert_true(weft_mat3_invert(&a, &inverse));
    const weft_mat3 one = weft_mat3_multiply(&a, &inverse);
    for (int i = 0; i < 9; i++)
        assert_near(one.m[i], i % 4 == 0, 1e-14);
    assert_false(weft_mat3_invert(&(weft_mat3){{1, 2, 3, 2, 4, 6, 0, 0, 1}}, &inverse));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_error_text_is_kept_and_prefixed),
        cmocka_unit_test(test_error_text_is_one_line_of_utf8),
        cmocka_unit_test(test_numbers_ignore_the_locale),
        cmocka_unit_test(test_utf8),
        cmocka_unit_test(test_options_parse),
        cmocka_unit_test(test_options_refuse),
        cmocka_unit_test(test_atomic_files),
        cmocka_unit_test(test_atomic_folders_replace_only_when_forced),
        cmocka_unit_test(test_a_folder_is_replaced_in_one_step),
        cmocka_unit_test(test_json_names_file_and_key),
        cmocka_unit_test(test_sha256_known_answers),
        cmocka_unit_test(test_parallel_rows_do_each_row_once),
        cmocka_unit_test(test_images_refuse_impossible_sizes),
        cmocka_unit_test(test_bilinear_sample),
        cmocka_unit_test(test_cfa),
        cmocka_unit_test(test_matrix_inverse),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
