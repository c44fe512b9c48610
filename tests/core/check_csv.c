/* Tables of text: quotes, line ends, and what must be refused. */
#include "tests/support/support.h"

#include "core/csv.h"
#include "core/file.h"

#include <string.h>

static const char *table(const char *text)
{
    const char *const path = weft_test_path("table.csv");
    assert_ok(weft_file_write(path, text, strlen(text), err));
    return path;
}

static void test_cells(void **state)
{
    (void)state;
    weft_csv csv;
    double x = 0;
    assert_ok(weft_csv_read(table("\xef\xbb\xbf"
                                  "a,b,note\r\n1,2.5,\"x, \"\"y\"\"\nz\"\r\n\n,-3e2,last"),
                            &csv, err));
    assert_int_equal(csv.columns, 3);
    assert_int_equal(csv.rows, 2);
    assert_string_equal(csv.names[0], "a");
    assert_int_equal(weft_csv_column(&csv, "note"), 2);
    assert_int_equal(weft_csv_column(&csv, "c"), -1);
    assert_string_equal(weft_csv_cell(&csv, 0, 2), "x, \"y\"\nz");
    assert_string_equal(weft_csv_cell(&csv, 1, 0), "");
    assert_string_equal(weft_csv_cell(&csv, 1, 2), "last");
    assert_ok(weft_csv_number(&csv, 1, 1, "t", &x, err));
    assert_true(x == -300);
    assert_fails(weft_csv_number(&csv, 1, 2, "t.csv", &x, err), WEFT_ERR_FORMAT,
                 "t.csv: row 2, column note: \"last\" is not a number");
    weft_csv_fini(&csv);
}

static void test_header_alone(void **state)
{
    (void)state;
    weft_csv csv;
    assert_ok(weft_csv_read(table("a,b"), &csv, err));
    assert_int_equal(csv.columns, 2);
    assert_int_equal(csv.rows, 0);
    weft_csv_fini(&csv);
}

static void test_damage(void **state)
{
    (void)state;
    weft_csv csv;
    assert_fails(weft_csv_read(table(""), &csv, err), WEFT_ERR_FORMAT, "empty");
    assert_fails(weft_csv_read(table("a,b\n1,2\n3\n"), &csv, err), WEFT_ERR_FORMAT, "line 3 has 1 cells");
    assert_fails(weft_csv_read(table("a,b\n\"1,2\n"), &csv, err), WEFT_ERR_FORMAT, "line 2: a quote");
    assert_fails(weft_csv_read(table("a,b\n\"1\"x,2\n"), &csv, err), WEFT_ERR_FORMAT, "line 2: a quote");
    assert_fails(weft_csv_read(table("a\n\xff\n"), &csv, err), WEFT_ERR_FORMAT, "UTF-8");
    assert_fails(weft_csv_read(weft_test_path("absent.csv"), &csv, err), WEFT_ERR_IO, "absent.csv");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cells),
        cmocka_unit_test(test_header_alone),
        cmocka_unit_test(test_damage),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
