/* The plot writer: well-formed XML whatever the words, marks where the data are, pictures that decode. */
#include "tests/support/support.h"

#include "core/file.h"
#include "core/formats/png_file.h"
#include "core/mem.h"
#include "core/plot/plot.h"
#include "core/plot/plot_axes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void test_escaping(void **state)
{
    (void)state;
    weft_text_buffer b = {0};
    weft_text_add_escaped(&b, "<a href=\"x\">&'\n\xc3\xa9\xff\xe2\x82");
    assert_string_equal(
        b.text, "&lt;a href=&quot;x&quot;&gt;&amp;&#39; \xc3\xa9\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd");
    weft_text_add_escaped(&b, NULL);
    assert_ok(weft_text_buffer_status(&b, err));
    weft_text_buffer_fini(&b);
}

/* RFC 4648, section 10. */
static void test_base64(void **state)
{
    (void)state;
    static const char *const wanted[] = {"", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"};
    for (size_t n = 0; n <= 6; n++) {
        weft_text_buffer b = {0};
        weft_text_add_base64(&b, "foobar", n);
        assert_string_equal(b.text, wanted[n]);
        weft_text_buffer_fini(&b);
    }
}

static void test_failures_stick(void **state)
{
    (void)state;
    weft_text_buffer b = {0};
    weft_mem_fail_after(0);
    weft_text_add(&b, "one");
    weft_mem_fail_after(-1);
    weft_text_add(&b, "two");
    assert_fails(weft_text_buffer_status(&b, err), WEFT_ERR_NOMEM, "memory");
    assert_int_equal(b.n, 0);
    weft_text_buffer_fini(&b);
}

static void test_ticks(void **state)
{
    (void)state;
    double t[40];
    const weft_plot_axis a = {NULL, -0.31, 0.52, false}, b = {NULL, 0.9, 1100, true},
                         c = {NULL, 1e6, 1e6 + 1e-3, false};
    assert_int_equal(weft_plot_ticks(&a, 4, t), 4);
    for (int i = 0; i < 4; i++)
        assert_near(t[i], -0.2 + 0.2 * i, 1e-12);
    assert_int_equal(weft_plot_ticks(&b, 4, t), 10); /* 1 2 5 ... 1000 */
    assert_near(t[9], 1000, 1e-9);
    assert_in_range(weft_plot_ticks(&c, 4, t), 2, 8);
    double low, high;
    weft_plot_range(3, (const double[]){(double)NAN, 2, 4}, &low, &high);
    assert_true(low < 2 && low > 1.8 && high > 4 && high < 4.2);
    weft_plot_range(1, (const double[]){7}, &low, &high);
    assert_true(low < 7 && high > 7);
    weft_plot_range(0, NULL, &low, &high);
    assert_true(low < high);
}

static void draw_everything(weft_text_buffer *out, bool standalone)
{
    weft_image heat;
    weft_plot plot;
    const weft_plot_spec spec = {.title = "R & D <\"all\">",
                                 .x = {"x, mm", -10, 30, false},
                                 .y = {"y's", 0, 10, false},
                                 .legend_rows = 1,
                                 .colour_bar = true,
                                 .standalone = standalone};
    const double x[4] = {-10, 0, (double)NAN, 30}, y[4] = {0, 10, 3, 5};
    assert_ok(weft_image_init(&heat, 3, 2, 1, err));
    for (int i = 0; i < 6; i++)
        heat.data[i] = (float)i / 5;
    heat.data[4] = NAN;
    weft_plot_begin(&plot, &spec, out);
    weft_plot_heat(&plot, &heat, 0, -10, 10, 30, 0, 0, 1, WEFT_MAP_VIRIDIS, "gain <1>");
    weft_plot_line(&plot, 0, 4, x, y, "a < b");
    weft_plot_dashed(&plot, 9, 4, x, y, "dashed");
    weft_plot_dots(&plot, 2, 3, 4, x, y, "dots");
    weft_plot_dot(&plot, 3, 4, 10, 5, "patch & \"name\"");
    weft_plot_stroke(&plot, 4, 0, 0, 10, 10, true);
    weft_plot_circle(&plot, 5, 10, 5, 4);
    weft_plot_box(&plot, 0, "#112233", 2, 2, 4, 4, "box");
    weft_plot_words(&plot, 10, 5, 4, 4, "<here>");
    /* The left lower corner of the data is that of the frame. */
    assert_near(weft_plot_u(&plot, -10), plot.left, 1e-9);
    assert_near(weft_plot_v(&plot, 0), plot.bottom, 1e-9);
    assert_near(weft_plot_v(&plot, 10), plot.top, 1e-9);
    weft_plot_end(&plot);
    weft_image_fini(&heat);
}

/* An XML parser that is not ours reads it, on its own and two in one page. */
static void test_it_is_well_formed(void **state)
{
    (void)state;
    weft_text_buffer page = {0}, file = {0};
    char command[512];
    if (system("python3 -c 'import xml.dom.minidom' >/dev/null 2>&1") != 0) {
        print_message("skipped: there is no python3\n");
        skip();
    }
    draw_everything(&file, true);
    weft_text_add(&page, "<html><style>%s</style>", weft_plot_style());
    draw_everything(&page, false);
    draw_everything(&page, false);
    weft_text_add(&page, "</html>");
    assert_null(strstr(page.text, "nan"));
    const weft_text_buffer *const both[2] = {&file, &page};
    for (int i = 0; i < 2; i++) {
        const char *const path = weft_test_path(i ? "page.html" : "plot.svg");
        assert_ok(weft_text_buffer_status(both[i], err));
        assert_ok(weft_file_write(path, both[i]->text, both[i]->n, err));
        snprintf(command, sizeof command,
                 "python3 -c 'import sys, xml.dom.minidom as m; d = m.parse(sys.argv[1]); ids = "
                 "[e.getAttribute(\"id\") "
                 "for e in d.getElementsByTagName(\"clipPath\")]; assert len(set(ids)) == int(sys.argv[2]), "
                 "ids' '%s' %d",
                 path, i + 1);
        assert_int_equal(system(command), 0);
    }
    weft_text_buffer_fini(&page);
    weft_text_buffer_fini(&file);
}

static void test_pictures_decode(void **state)
{
    (void)state;
    weft_raster raster, back;
    weft_text_buffer png = {0};
    const char *const path = weft_test_path("small.png");
    assert_ok(weft_raster_init(&raster, 5, 3, 4, 8, err));
    for (uint16_t i = 0; i < 60; i++)
        raster.data[i] = (uint16_t)(4 * i);
    assert_int_equal(weft_png_encode(&raster, &png), WEFT_OK);
    assert_ok(weft_file_write(path, png.text, png.n, err));
    assert_ok(weft_png_read(path, &back, err));
    assert_int_equal(back.channels, 4);
    assert_memory_equal(back.data, raster.data, 60 * sizeof *raster.data);
    weft_raster_fini(&back);
    weft_raster_fini(&raster);
    weft_text_buffer_fini(&png);
}

static void test_same_scale(void **state)
{
    (void)state;
    weft_text_buffer out = {0};
    weft_plot plot;
    const weft_plot_spec spec = {
        .x = {"mm", -80, 80, false}, .y = {"mm", -300, 300, false}, .same_scale = true, .y_down = true};
    weft_plot_begin(&plot, &spec, &out);
    assert_near(weft_plot_u(&plot, 100) - weft_plot_u(&plot, 0),
                weft_plot_v(&plot, 100) - weft_plot_v(&plot, 0), 1e-9);
    weft_plot_end(&plot);
    weft_text_buffer_fini(&out);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_escaping),          cmocka_unit_test(test_base64),
        cmocka_unit_test(test_failures_stick),    cmocka_unit_test(test_ticks),
        cmocka_unit_test(test_it_is_well_formed), cmocka_unit_test(test_pictures_decode),
        cmocka_unit_test(test_same_scale),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
