/* Memory under a limit: what does not fit is in files, is what it was, and goes when it is freed. */
#include "tests/support/support.h"

#include "core/mem.h"
#include "core/mem_limit.h"
#include "core/parallel.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { BLOCKS = 12, WORDS = 1 << 21 }; /* of 16 MiB */

static const double mib = 1048576;

static uint64_t word_of(int block, size_t i)
{
    return (uint64_t)(block + 1) * 0x9e3779b97f4a7c15U + i * 2654435761U;
}

typedef struct work {
    uint64_t *blocks[BLOCKS];
    bool check;
    _Atomic long wrong;
} work;

/* "Rows" of 4096 words of all blocks. */
static void touch_rows(void *context, int band, int row_begin, int row_end)
{
    work *const w = context;
    (void)band;
    for (int b = 0; b < BLOCKS; b++)
        for (size_t i = (size_t)row_begin * 4096; i < (size_t)row_end * 4096; i++) {
            if (w->check)
                w->wrong += w->blocks[b][i] != word_of(b, i);
            else
                w->blocks[b][i] = word_of(b, i);
        }
}

static void test_192_mib_in_128(void **state)
{
    (void)state;
    static work w;
    weft_mem_set_limit(128 * mib);
    for (int b = 0; b < BLOCKS; b++) {
        w.blocks[b] = weft_alloc(WORDS, sizeof(uint64_t), NULL);
        assert_non_null(w.blocks[b]);
        assert_true(w.blocks[b][0] == 0 && w.blocks[b][WORDS - 1] == 0);
        assert_true((uintptr_t)w.blocks[b] % 64 == 0);
    }
    print_message("%.0f MiB in files\n", weft_mem_in_files() / mib);
    assert_true(weft_mem_in_files() > 100 * mib);
    weft_parallel_rows(WORDS / 4096, touch_rows, &w);
    w.check = true;
    weft_parallel_rows(WORDS / 4096, touch_rows, &w);
    assert_int_equal(w.wrong, 0);
    print_message("%.0f MiB resident, %.0f at most\n", weft_mem_resident() / mib, weft_mem_peak() / mib);
#if !defined(__SANITIZE_ADDRESS__)
    assert_true(weft_mem_resident() < 128 * mib);
    assert_true(weft_mem_peak() < 128 * mib);
#endif
    for (int b = 0; b < BLOCKS; b++)
        weft_free(w.blocks[b]);
    assert_true(weft_mem_in_files() == 0);
    weft_mem_set_limit(0);
}

/* After serial work that does not trim by itself the program comes back below its limit, too. */
static void test_a_loop_that_knows_nothing_of_it(void **state)
{
    (void)state;
    uint64_t *blocks[BLOCKS], sum = 0;
    weft_mem_set_limit(128 * mib);
    for (int b = 0; b < BLOCKS; b++)
        blocks[b] = weft_alloc(WORDS, sizeof(uint64_t), NULL);
    const double before = weft_mem_resident();
    double most = 0;
    for (int pass = 0; pass < 4; pass++)
        for (int b = 0; b < BLOCKS; b++) {
            for (size_t i = 0; i < WORDS; i++)
                sum += blocks[b][i]++;
            const double resident = weft_mem_resident();
            most = resident > most ? resident : most;
        }
    print_message("%.0f MiB before, %.0f at most\n", before / mib, most / mib);
    assert_true(sum == (uint64_t)6 * BLOCKS * WORDS);
#if !defined(__SANITIZE_ADDRESS__)
    const struct timespec pause = {.tv_nsec = 1000000}; /* how soon the thread runs is the system's */
    for (int i = 0; i < 30000 && weft_mem_resident() >= 128 * mib; i++)
        nanosleep(&pause, NULL);
    assert_true(weft_mem_resident() < 128 * mib);
#endif
    for (int b = 0; b < BLOCKS; b++)
        weft_free(blocks[b]);
    assert_true(weft_mem_in_files() == 0);
    weft_mem_set_limit(0);
}

static void test_a_block_in_a_file_grows_and_shrinks(void **state)
{
    (void)state;
    weft_mem_set_limit(1);
    uint64_t *block = weft_alloc(1 << 16, sizeof *block, NULL);
    assert_true(weft_mem_in_files() >= 512 * 1024);
    for (size_t i = 0; i < 1 << 16; i++)
        block[i] = word_of(1, i);
    weft_mem_trim();
    block = weft_realloc(block, 1 << 17, sizeof *block, NULL);
    assert_non_null(block);
    weft_mem_trim();
    block = weft_realloc(block, 1 << 10, sizeof *block, NULL); /* and to the heap, as it is small */
    assert_non_null(block);
    assert_true(weft_mem_in_files() == 0);
    for (size_t i = 0; i < 1 << 10; i++)
        assert_true(block[i] == word_of(1, i));
    weft_free(block);
    weft_mem_set_limit(0);
}

static void test_blocks_of_before_and_after_the_limit(void **state)
{
    (void)state;
    void *const before = weft_alloc(1 << 20, 1, NULL);
    weft_mem_set_limit(1);
    void *const under = weft_alloc(1 << 20, 1, NULL), *const small = weft_alloc(100, 1, NULL);
    weft_mem_set_limit(0);
    void *const after = weft_alloc(1 << 20, 1, NULL);
    assert_true(weft_mem_in_files() >= 1 << 20 && weft_mem_in_files() < 2 << 20);
    weft_free(under);
    weft_free(before);
    weft_free(small);
    weft_free(after);
    assert_true(weft_mem_in_files() == 0);
}

static void test_no_room_is_an_error_that_says_where(void **state)
{
    (void)state;
    weft_error error = {0};
    char *const folder = weft_strdup(getenv("TMPDIR") ? getenv("TMPDIR") : "", NULL);
    setenv("TMPDIR", "/nowhere", 1);
    weft_mem_set_limit(1);
    assert_null(weft_alloc(1 << 20, 1, &error));
    assert_int_equal(error.code, WEFT_ERR_NOMEM);
    assert_non_null(strstr(error.text, "/nowhere"));
    assert_non_null(strstr(error.text, "TMPDIR"));
    weft_mem_set_limit(0);
    setenv("TMPDIR", folder, 1);
    weft_free(folder);
}

static void test_the_nth_failure_is_that_of_files_too(void **state)
{
    (void)state;
    weft_mem_set_limit(1);
    weft_mem_fail_after(0);
    assert_null(weft_alloc(1 << 20, 1, NULL));
    weft_mem_fail_after(-1);
    weft_mem_set_limit(0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_192_mib_in_128),
        cmocka_unit_test(test_a_loop_that_knows_nothing_of_it),
        cmocka_unit_test(test_a_block_in_a_file_grows_and_shrinks),
        cmocka_unit_test(test_blocks_of_before_and_after_the_limit),
        cmocka_unit_test(test_no_room_is_an_error_that_says_where),
        cmocka_unit_test(test_the_nth_failure_is_that_of_files_too),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
