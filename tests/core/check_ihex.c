/* Intel hex files: records of the specification's own kind, other tools' files, damage. */
#include "tests/support/support.h"

#include "core/file.h"
#include "core/formats/ihex_file.h"

#include <string.h>

static weft_err read_text(const char *text, uint8_t *memory, size_t size, uint32_t *begin, uint32_t *end,
                          weft_error *error)
{
    const char *const path = weft_test_path("program.hex");
    assert_ok(weft_file_write(path, text, strlen(text), err));
    memset(memory, 0xff, size);
    return weft_ihex_read(path, memory, size, begin, end, error);
}

/* The example of the format's usual descriptions, with both kinds of line ends and letters. */
static void test_known_records(void **state)
{
    (void)state;
    uint8_t m[0x20100];
    uint32_t begin, end;
    assert_ok(
        read_text(":0B0010006164647265737320676170A7\r\n:0b0000006164647265737320676170b7\n:00000001FF\n", m,
                  sizeof m, &begin, &end, err));
    assert_memory_equal(m + 0x10, "address gap", 11);
    assert_memory_equal(m, "address gap", 11);
    assert_int_equal(m[11], 0xff);
    assert_int_equal(begin, 0);
    assert_int_equal(end, 0x1b);
    /* at 0x10000 by a segment, at 0x20000 by a linear base; start addresses say nothing */
    assert_ok(read_text(":020000021000EC\n:0100000041BE\n:020000040002F8\n:0100010042BC\n"
                        ":0400000300007C007D\n:0400000500007C007B\n:00000001FF\n",
                        m, sizeof m, &begin, &end, err));
    assert_int_equal(m[0x10000], 'A');
    assert_int_equal(m[0x20001], 'B');
    assert_int_equal(begin, 0x10000);
    assert_int_equal(end, 0x20002);
}

static void test_damage_is_named(void **state)
{
    (void)state;
    static const char good[] = ":0B0010006164647265737320676170A7\n:00000001FF\n";
    uint8_t m[256];
    uint32_t begin, end;
    char text[sizeof good];
    for (size_t i = 0; i + 1 < sizeof good; i++) { /* every character changed: no change goes unseen */
        memcpy(text, good, sizeof good);
        text[i] = text[i] == '3' ? '4' : '3';
        assert_fails(read_text(text, m, sizeof m, &begin, &end, err), WEFT_ERR_FORMAT, "program.hex");
    }
    for (size_t i = 0; i + 2 < sizeof good; i++) { /* cut anywhere */
        memcpy(text, good, sizeof good);
        text[i] = '\0';
        assert_fails(read_text(text, m, sizeof m, &begin, &end, err), WEFT_ERR_FORMAT, "program.hex");
    }
    assert_fails(read_text(good, m, 0x1a, &begin, &end, err), WEFT_ERR_FORMAT, "line 1 is beyond the end");
    assert_fails(read_text(":00000001FF\n", m, sizeof m, &begin, &end, err), WEFT_ERR_FORMAT,
                 "holds no program");
    assert_fails(weft_ihex_read(weft_test_path("absent.hex"), m, sizeof m, &begin, &end, err), WEFT_ERR_IO,
                 "absent.hex");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known_records),
        cmocka_unit_test(test_damage_is_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
