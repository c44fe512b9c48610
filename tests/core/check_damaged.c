/* Files that are cut, corrupted or lie about themselves, disks that are full: an error that names the file,
 * nothing half-written, nothing said behind our back on stderr. */
#include "tests/support/support.h"

#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/formats/image_file.h"
#include "core/formats/png_file.h"
#include "core/formats/raw_file.h"
#include "core/formats/tiff_file.h"
#include "core/mem.h"

#include <dirent.h>
#include <fcntl.h>
#include <math.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <tiffio.h>
#include <unistd.h>
#include <zlib.h>

static const char *const exr_names[] = {"R", "G", "B"};

static weft_image make_image(void)
{
    weft_image image;
    uint64_t seed = 7;
    assert_ok(weft_image_init(&image, 40, 50, 3, err));
    for (int i = 0; i < 40 * 50 * 3; i++)
        image.data[i] = (float)weft_test_random(&seed);
    return image;
}

static weft_err write_exr(const char *path, const weft_image *image, weft_error *err)
{
    return weft_exr_write(path, image, exr_names, WEFT_EXR_HALF, err);
}

static weft_err write_picture(const char *path, const weft_image *image, weft_error *err)
{
    return weft_image_write(path, image, 16, WEFT_TRANSFER_LINEAR, err);
}

static weft_err write_dng(const char *path, const weft_image *image, weft_error *err)
{
    weft_mosaic m;
    const weft_frame_info info = {.exposure_s = 0.1, .make = "a", .model = "b"};
    WEFT_TRY(weft_mosaic_init(&m, image->width, image->height, WEFT_CFA_RGGB, err));
    for (int i = 0; i < m.width * m.height; i++)
        m.data[i] = (uint16_t)(image->data[i] * 10000);
    const weft_err status = weft_dng_write(path, &m, &info, err);
    weft_mosaic_fini(&m);
    return status;
}

static weft_err read_exr(const char *path, weft_image *image, weft_error *err)
{
    return weft_exr_read(path, exr_names, 3, image, err);
}

static weft_err read_picture(const char *path, weft_image *image, weft_error *err)
{
    return weft_image_read(path, WEFT_TRANSFER_LINEAR, image, err);
}

static weft_err read_dng(const char *path, weft_image *image, weft_error *err)
{
    weft_mosaic m;
    weft_frame_info info;
    WEFT_TRY(weft_raw_read(path, &m, &info, err));
    const weft_err status = weft_image_init(image, m.width, m.height, 1, err);
    for (int i = 0; status == WEFT_OK && i < m.width * m.height; i++)
        image->data[i] = m.data[i];
    weft_mosaic_fini(&m);
    return status;
}

static const struct kind {
    const char *name;
    weft_err (*write)(const char *path, const weft_image *image, weft_error *err);
    weft_err (*read)(const char *path, weft_image *image, weft_error *err);
} kinds[] = {{"a.exr", write_exr, read_exr},
             {"a.png", write_picture, read_picture},
             {"a.tif", write_picture, read_picture},
             {"a.dng", write_dng, read_dng}};

#define N_KINDS (sizeof kinds / sizeof kinds[0])

/* ---- what libraries say on stderr ---- */

static int real_stderr = -1;

static void speak_again(void)
{
    if (real_stderr < 0)
        return;
    fflush(stderr);
    dup2(real_stderr, 2);
    close(real_stderr);
    real_stderr = -1;
}

/* After a test that failed half-way: what it took from the process is given back. */
static int give_back(void **state)
{
    struct rlimit limit;
    char *text;
    size_t n;
    (void)state;
    if (real_stderr >= 0) {
        speak_again();
        if (weft_file_read(weft_test_path("stderr.txt"), 1 << 20, &text, &n, NULL) == WEFT_OK) {
            print_error("%s", text); /* why it failed is in there */
            weft_free(text);
        }
    }
    getrlimit(RLIMIT_FSIZE, &limit);
    limit.rlim_cur = limit.rlim_max;
    setrlimit(RLIMIT_FSIZE, &limit);
    getrlimit(RLIMIT_AS, &limit);
    limit.rlim_cur = limit.rlim_max;
    setrlimit(RLIMIT_AS, &limit);
    return 0;
}

static void hush(void)
{
    real_stderr = dup(2);
    const int fd = open(weft_test_path("stderr.txt"), O_RDWR | O_CREAT | O_TRUNC, 0600);
    assert_true(real_stderr >= 0 && fd >= 0);
    dup2(fd, 2);
    close(fd);
}

static void assert_nothing_was_said(void)
{
    char *text;
    size_t n;
    speak_again();
    assert_ok(weft_file_read(weft_test_path("stderr.txt"), 1 << 20, &text, &n, err));
    if (n > 0)
        fail_msg("a library wrote to stderr: %s", text);
    weft_free(text);
}

/* The bytes must give an error that names the file, or (when `may_be_fine`) a picture. */
static void check_bytes(const struct kind *kind, const char *bytes, size_t n, bool may_be_fine,
                        const char *what)
{
    const char *const path = weft_test_path(kind->name);
    weft_image image = {.width = -7};
    weft_error error = {0};
    FILE *const file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, n, file), n);
    fclose(file);
    const weft_err status = kind->read(path, &image, &error);
    if (status == WEFT_OK && !may_be_fine)
        fail_msg("%s: %s was taken for a whole file", kind->name, what);
    if (status == WEFT_OK)
        weft_image_fini(&image);
    else if (image.width != -7 || !strstr(error.text, kind->name) || strchr(error.text, '\n'))
        fail_msg("%s: %s: output touched or bad text \"%s\"", kind->name, what, error.text);
}

static char *bytes_of(const struct kind *kind, size_t *n)
{
    weft_image image = make_image();
    char *bytes;
    assert_ok(kind->write(weft_test_path(kind->name), &image, err));
    assert_ok(weft_file_read(weft_test_path(kind->name), 1 << 20, &bytes, n, err));
    weft_image_fini(&image);
    return bytes;
}

static void test_cut_files(void **state)
{
    (void)state;
    hush();
    for (size_t k = 0; k < N_KINDS; k++) {
        size_t n;
        char *const bytes = bytes_of(&kinds[k], &n);
        for (size_t length = 0; length < n; length += length < 600 || length + 600 > n ? 7 : n / 61)
            check_bytes(&kinds[k], bytes, length, false, "a cut file");
        check_bytes(&kinds[k], bytes, n - 1, false, "a file without its last byte");
        weft_free(bytes);
    }
    assert_nothing_was_said();
}

static void test_flipped_bytes(void **state)
{
    (void)state;
    hush();
    for (size_t k = 0; k < N_KINDS; k++) {
        size_t n;
        char *const bytes = bytes_of(&kinds[k], &n);
        for (uint64_t seed = 0; seed < 150; seed++) { /* the seed is in the message: it can be repeated */
            uint64_t random = seed * 1000 + k;
            char what[64];
            char *const spoilt = weft_alloc(n, 1, NULL);
            memcpy(spoilt, bytes, n);
            const int n_flips = 1 + (int)(weft_test_random(&random) * 8);
            const size_t reach = seed % 2 ? n : n < 900 ? n : 900; /* half of them in the head */
            for (int i = 0; i < n_flips; i++)
                spoilt[(size_t)(weft_test_random(&random) * (double)reach)] =
                    (char)(weft_test_random(&random) * 256);
            snprintf(what, sizeof what, "flips of seed %d", (int)seed);
            check_bytes(&kinds[k], spoilt, n, true, what);
            weft_free(spoilt);
        }
        weft_free(bytes);
    }
    assert_nothing_was_said();
}

static void test_rubbish(void **state)
{
    (void)state;
    char rubbish[4096];
    uint64_t seed = 1;
    hush();
    for (size_t i = 0; i < sizeof rubbish; i++)
        rubbish[i] = (char)(weft_test_random(&seed) * 256);
    for (size_t k = 0; k < N_KINDS; k++) {
        check_bytes(&kinds[k], "", 0, false, "an empty file");
        check_bytes(&kinds[k], rubbish, sizeof rubbish, false, "rubbish");
        memcpy(rubbish, k == 0 ? "v/1\001\002\0\0\0" : k == 1 ? "\x89PNG\r\n\x1a\n" : "II*\0\010\0\0\0", 8);
        check_bytes(&kinds[k], rubbish, sizeof rubbish, false, "rubbish behind a right beginning");
    }
    assert_nothing_was_said();
}

/* ---- headers that promise more than there is ---- */

static void put_be32(char *at, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        at[i] = (char)(value >> (24 - 8 * i));
}

static void put_le32(char *at, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        at[i] = (char)(value >> (8 * i));
}

static char *find_bytes(char *bytes, size_t n, const char *word, size_t n_word)
{
    char *const at = memmem(bytes, n, word, n_word);
    assert_non_null(at);
    return at;
}

static void test_huge_headers(void **state)
{
    (void)state;
    const uint32_t huge[] = {32768, 32769, 65535, 1000000, 0x7fffffff, 0xffffffff};
    struct rlimit was, small = {.rlim_cur = (rlim_t)3 << 30, .rlim_max = RLIM_INFINITY};
    hush();
#if !defined(                                                                                                \
    __SANITIZE_ADDRESS__) /* which reserves terabytes: to ask for the promised gigabytes must not pay */
    assert_int_equal(getrlimit(RLIMIT_AS, &was), 0);
    small.rlim_max = was.rlim_max;
    assert_int_equal(setrlimit(RLIMIT_AS, &small), 0);
#else
    (void)small, (void)was;
#endif
    for (size_t h = 0; h < sizeof huge / sizeof *huge; h++)
        for (size_t k = 0; k < N_KINDS; k++) {
            size_t n;
            char *const bytes = bytes_of(&kinds[k], &n);
            if (k == 0) { /* dataWindow: box2i, 16 bytes: xMin yMin xMax yMax */
                char *const box = find_bytes(bytes, n, "dataWindow\0box2i\0", 17) + 17 + 4;
                put_le32(box + 8, huge[h] - 1);
                put_le32(box + 12, huge[h] - 1);
            } else if (k == 1) {
                put_be32(bytes + 16, huge[h]);
                put_be32(bytes + 20, huge[h]);
                put_be32(bytes + 29, (uint32_t)crc32(0, (const Bytef *)bytes + 12, 17));
            } else { /* tags 256 and 257, LONG or SHORT; both made LONG */
                for (int tag = 0; tag < 2; tag++) {
                    const char entry[4] = {(char)tag, 1, (char)3, 0},
                               entry_long[4] = {(char)tag, 1, (char)4, 0};
                    char *at = memmem(bytes, n, entry, 4);
                    at = at ? at : find_bytes(bytes, n, entry_long, 4);
                    at[2] = 4;
                    put_le32(at + 8, huge[h]);
                }
            }
            check_bytes(&kinds[k], bytes, n, false, "a huge header");
            weft_free(bytes);
        }
#if !defined(__SANITIZE_ADDRESS__)
    setrlimit(RLIMIT_AS, &was);
#endif
    assert_nothing_was_said();
}

static void test_exr_with_nan_and_infinity(void **state)
{
    (void)state;
    weft_image image = make_image(), back;
    image.data[0] = NAN;
    image.data[1] = INFINITY;
    image.data[2] = -INFINITY;
    for (int type = 0; type < 2; type++) {
        assert_ok(weft_exr_write(weft_test_path("nan.exr"), &image, exr_names, (weft_exr_type)type, err));
        assert_ok(read_exr(weft_test_path("nan.exr"), &back, err));
        assert_true(isnan(back.data[0]) && back.data[1] == INFINITY && back.data[2] == -INFINITY);
        weft_image_fini(&back);
    }
    weft_image_fini(&image);
}

/* ---- TIFFs of the wrong kind ---- */

static void write_odd_tiff(const char *path, int bits, int channels, int format, int photometric)
{
    TIFF *const tiff = TIFFOpen(path, "w");
    char row[512] = "";
    assert_non_null(tiff);
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 8);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 2);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, channels);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, format);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, photometric);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    if (photometric == PHOTOMETRIC_PALETTE) {
        uint16_t map[256] = {0};
        TIFFSetField(tiff, TIFFTAG_COLORMAP, map, map, map);
    }
    for (uint32_t y = 0; y < 2; y++)
        TIFFWriteScanline(tiff, row, y, 0);
    TIFFClose(tiff);
}

static void test_tiffs_of_the_wrong_kind(void **state)
{
    (void)state;
    const struct {
        int bits, channels, format, photometric;
        const char *says;
    } odd[] = {{32, 1, SAMPLEFORMAT_IEEEFP, PHOTOMETRIC_MINISBLACK, "32-bit floating point samples"},
               {32, 3, SAMPLEFORMAT_UINT, PHOTOMETRIC_RGB, "32-bit"},
               {1, 1, SAMPLEFORMAT_UINT, PHOTOMETRIC_MINISBLACK, "1-bit"},
               {16, 1, SAMPLEFORMAT_INT, PHOTOMETRIC_MINISBLACK, "only whole numbers"},
               {8, 5, SAMPLEFORMAT_UINT, PHOTOMETRIC_MINISBLACK, "5 channels, wanted 1 to 4"},
               {8, 4, SAMPLEFORMAT_UINT, PHOTOMETRIC_SEPARATED, "neither grey nor RGB"},
               {8, 1, SAMPLEFORMAT_UINT, PHOTOMETRIC_PALETTE, "neither grey nor RGB"},
               {8, 2, SAMPLEFORMAT_UINT, PHOTOMETRIC_RGB, "calls itself RGB but has 2"}};
    weft_raster raster;
    for (size_t i = 0; i < sizeof odd / sizeof *odd; i++) {
        write_odd_tiff(weft_test_path("odd.tif"), odd[i].bits, odd[i].channels, odd[i].format,
                       odd[i].photometric);
        assert_fails(weft_tiff_read(weft_test_path("odd.tif"), &raster, err), WEFT_ERR_FORMAT, "odd.tif: ");
        assert_fails(weft_tiff_read(weft_test_path("odd.tif"), &raster, err), WEFT_ERR_FORMAT, odd[i].says);
    }
}

/* ---- places that cannot be read or written ---- */

static void test_places(void **state)
{
    (void)state;
    weft_image image = make_image(), back;
    char folder[512], under_file[1024], locked[512];
    for (size_t k = 0; k < N_KINDS; k++) {
        snprintf(folder, sizeof folder, "%s", weft_test_path(""));
        snprintf(folder, sizeof folder, "%s%s", weft_test_path("folder-"), kinds[k].name);
        assert_ok(weft_folder_create(folder, err));
        assert_fails(kinds[k].read(folder, &back, err), WEFT_ERR_IO, "is a folder");
        assert_fails(kinds[k].write(folder, &image, err), WEFT_ERR_IO, "is a folder");
        snprintf(under_file, sizeof under_file, "/dev/null/%s", kinds[k].name);
        assert_fails(kinds[k].read(under_file, &back, err), WEFT_ERR_IO, under_file);
        assert_fails(kinds[k].write(under_file, &image, err), WEFT_ERR_IO, under_file);
        assert_fails(kinds[k].read("/dev/zero", &back, err), k == 1 || k == 2 ? WEFT_ERR_FORMAT : WEFT_ERR_IO,
                     "/dev/zero");
    }
    if (geteuid() == 0)
        print_message("permissions are not tested: root may do anything\n");
    else {
        snprintf(locked, sizeof locked, "%s", weft_test_path("locked"));
        assert_ok(weft_folder_create(locked, err));
        chmod(locked, 0500);
        for (size_t k = 0; k < N_KINDS; k++) {
            snprintf(under_file, sizeof under_file, "%s/%s", locked, kinds[k].name);
            assert_fails(kinds[k].write(under_file, &image, err), WEFT_ERR_IO, under_file);
        }
        chmod(locked, 0700);
    }
    weft_image_fini(&image);
}

static int count_entries(const char *folder)
{
    DIR *const dir = opendir(folder);
    int n = 0;
    assert_non_null(dir);
    while (readdir(dir))
        n++;
    closedir(dir);
    return n - 2;
}

/* Writes every kind into `folder`, where files may grow to `most` bytes only (negative: as they like). */
static void check_no_room(const char *folder, long most)
{
    weft_image big;
    char path[512];
    uint64_t seed = 3;
    assert_ok(weft_image_init(&big, 300, 400, 3, err));
    for (int i = 0; i < 300 * 400 * 3; i++)
        big.data[i] = (float)weft_test_random(&seed);
    for (size_t k = 0; k < N_KINDS; k++) {
        weft_error error = {0};
        struct rlimit was, limit;
        snprintf(path, sizeof path, "%s/%s", folder, kinds[k].name);
        getrlimit(RLIMIT_FSIZE, &was);
        limit = was;
        if (most >= 0)
            limit.rlim_cur = (rlim_t)most;
        hush();
        setrlimit(RLIMIT_FSIZE, &limit);
        const weft_err status = kinds[k].write(path, &big, &error);
        setrlimit(RLIMIT_FSIZE, &was);
        assert_nothing_was_said();
        weft_test_check_failure(path, status, WEFT_ERR_IO, &error, path);
        weft_test_check_failure(path, status, WEFT_ERR_IO, &error, "is the disk full?");
        assert_int_equal(count_entries(folder), 0);
    }
    weft_image_fini(&big);
}

/* The kernel refuses to let a file grow: what a full disk looks like to a program, on every machine. */
static void test_files_that_cannot_grow(void **state)
{
    (void)state;
    char folder[512];
    snprintf(folder, sizeof folder, "%s", weft_test_path("limited"));
    assert_ok(weft_folder_create(folder, err));
    signal(SIGXFSZ, SIG_IGN);
    check_no_room(folder, 0);
    check_no_room(folder, 700);
    check_no_room(folder, 60000);
    check_no_room(folder, 200000);
}

/* A real file system of 64 KiB, in a mount namespace of its own; only root may. */
static void test_full_disk(void **state)
{
    (void)state;
    char disk[512];
    snprintf(disk, sizeof disk, "%s", weft_test_path("disk"));
    assert_ok(weft_folder_create(disk, err));
    if (unshare(CLONE_NEWNS) != 0 || mount("none", "/", NULL, MS_REC | MS_PRIVATE, NULL) != 0 ||
        mount("weft-test", disk, "tmpfs", 0, "size=64k") != 0) {
        print_message("skipped: a small file system cannot be mounted here\n");
        skip();
    }
    check_no_room(disk, -1);
    umount(disk);
}

/* Every allocation of ours fails in turn. */
static void test_without_memory(void **state)
{
    (void)state;
    weft_image image = make_image(), back;
    for (size_t k = 0; k < N_KINDS; k++) {
        const char *const path = weft_test_path(kinds[k].name);
        unlink(path);
        for (long n = 0;; n++) {
            weft_mem_fail_after(n);
            const weft_err status = kinds[k].write(path, &image, NULL);
            weft_mem_fail_after(-1);
            if (status == WEFT_OK)
                break;
            assert_false(weft_file_exists(path));
            assert_true(n < 1000);
        }
        for (long n = 0;; n++) {
            weft_mem_fail_after(n);
            const weft_err status = kinds[k].read(path, &back, NULL);
            weft_mem_fail_after(-1);
            if (status == WEFT_OK)
                break;
            assert_true(n < 1000);
        }
        weft_image_fini(&back);
    }
    weft_image_fini(&image);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_cut_files, give_back),
        cmocka_unit_test_teardown(test_flipped_bytes, give_back),
        cmocka_unit_test_teardown(test_rubbish, give_back),
        cmocka_unit_test_teardown(test_huge_headers, give_back),
        cmocka_unit_test_teardown(test_exr_with_nan_and_infinity, give_back),
        cmocka_unit_test_teardown(test_tiffs_of_the_wrong_kind, give_back),
        cmocka_unit_test_teardown(test_places, give_back),
        cmocka_unit_test_teardown(test_files_that_cannot_grow, give_back),
        cmocka_unit_test_teardown(test_without_memory, give_back),
        cmocka_unit_test_teardown(test_full_disk,
                                  give_back), /* last: it leaves the process in its own mount namespace */
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
