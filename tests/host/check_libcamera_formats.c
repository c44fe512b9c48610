/* The raw formats of libcamera: names, lengths of rows, and MIPI's packing against samples packed by hand. */
#include "tests/support/support.h"

#include "host/camera/libcamera_formats.h"

#include <string.h>

static void test_names(void **state)
{
    (void)state;
    weft_raw_layout l;
    assert_true(weft_raw_layout_from_name("SRGGB16", &l) && l.bits == 16 && !l.csi2 &&
                l.cfa == WEFT_CFA_RGGB);
    assert_true(weft_raw_layout_from_name("SGBRG10_CSI2P", &l) && l.bits == 10 && l.csi2);
    assert_true(l.cfa == WEFT_CFA_GBRG);
    assert_int_equal(weft_raw_layout_row_bytes(&l, 4056), 5070);
    assert_int_equal(weft_raw_layout_row_bytes(&l, 5), 10);
    assert_true(weft_raw_layout_from_name("SBGGR12_CSI2P", &l));
    assert_int_equal(weft_raw_layout_row_bytes(&l, 4056), 6084); /* the HQ camera of the Raspberry Pi */
    assert_true(weft_raw_layout_from_name("SBGGR14_CSI2P", &l));
    assert_int_equal(weft_raw_layout_row_bytes(&l, 8), 14);
    assert_true(weft_raw_layout_from_name("SGRBG8", &l));
    assert_int_equal(weft_raw_layout_row_bytes(&l, 7), 7);
    const char *const others[] = {"NV12",          "MJPEG", "SRGGB",   "SRGGB9", "SRGGB10_IPU3",
                                  "SRGGB16_CSI2P", "S",     "SRRRR10", "",       "SBGGR8_CSI2P"};
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++)
        assert_false(weft_raw_layout_from_name(others[i], &l));
}

static void check(const char *name, const uint8_t *bytes, const uint16_t *wanted, int n)
{
    weft_raw_layout l;
    uint16_t got[8];
    assert_true(weft_raw_layout_from_name(name, &l));
    weft_raw_layout_unpack(&l, bytes, n, got);
    for (int i = 0; i < n; i++)
        assert_int_equal(got[i], wanted[i]);
}

static void test_samples(void **state)
{
    (void)state;
    /* 10 bits: 0x3ff 0x001 0x2aa 0x155: high bytes ff 00 aa 55, low pairs 3 1 2 1 from the low end */
    check("SRGGB10_CSI2P", (const uint8_t[]){0xff, 0x00, 0xaa, 0x55, 0x67},
          (const uint16_t[]){0x3ff, 1, 0x2aa, 0x155}, 4);
    /* 12 bits: 0xabc 0x123 */
    check("SRGGB12_CSI2P", (const uint8_t[]){0xab, 0x12, 0x3c}, (const uint16_t[]){0xabc, 0x123}, 2);
    /* 14 bits: 0x3fff 0 0x1234 0x2aaa: low six bits 3f 00 34 2a one behind the other */
    check("SRGGB14_CSI2P", (const uint8_t[]){0xff, 0x00, 0x48, 0xaa, 0x3f, 0x40, 0xab},
          (const uint16_t[]){0x3fff, 0, 0x1234, 0x2aaa}, 4);
    check("SRGGB12", (const uint8_t[]){0xbc, 0x0a, 0x23, 0x01}, (const uint16_t[]){0xabc, 0x123}, 2);
    check("SRGGB8", (const uint8_t[]){7, 255}, (const uint16_t[]){7, 255}, 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_names),
        cmocka_unit_test(test_samples),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
