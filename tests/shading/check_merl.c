/* MERL tables: the place of every number against the definition, written anew from its authors' reader. */
#include "tests/support/support.h"

#include "core/file.h"
#include "core/mem.h"
#include "shading/brdf/half_vector.h"
#include "shading/brdf/merl.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { CELLS = 90 * 90 * 180, BYTES = 12 + 3 * 8 * CELLS };

/* ---- Matusik's reader, from its description: vectors turned about axes, then acos and atan2 ---- */

/* Rodrigues: `vector` turned by `angle` about a unit axis. */
static void turn(const double vector[3], const double axis[3], double angle, double out[3])
{
    const double c = cos(angle), s = sin(angle);
    const double along = axis[0] * vector[0] + axis[1] * vector[1] + axis[2] * vector[2];
    const double cross[3] = {axis[1] * vector[2] - axis[2] * vector[1],
                             axis[2] * vector[0] - axis[0] * vector[2],
                             axis[0] * vector[1] - axis[1] * vector[0]};
    for (int k = 0; k < 3; k++)
        out[k] = vector[k] * c + axis[k] * along * (1 - c) + cross[k] * s;
}

/* theta_h, theta_d, phi_d in degrees; phi_d in [0, 180). */
static void angles_deg(const double light[3], const double view[3], double out[3])
{
    static const double normal[3] = {0, 0, 1}, binormal[3] = {0, 1, 0};
    double h[3], length = 0, flat[3], difference[3];
    for (int k = 0; k < 3; k++)
        h[k] = 0.5 * (light[k] + view[k]);
    length = sqrt(h[0] * h[0] + h[1] * h[1] + h[2] * h[2]);
    const double theta_h = acos(fmin(h[2] / length, 1)), phi_h = atan2(h[1], h[0]);
    turn(light, normal, -phi_h, flat);
    turn(flat, binormal, -theta_h, difference);
    double phi_d = atan2(difference[1], difference[0]);
    if (phi_d < 0)
        phi_d += WEFT_PI;
    out[0] = theta_h * 180 / WEFT_PI;
    out[1] = acos(fmin(difference[2], 1)) * 180 / WEFT_PI;
    out[2] = phi_d >= WEFT_PI ? 0 : phi_d * 180 / WEFT_PI;
}

static int index_of(const double angle_deg[3], int cell[3])
{
    cell[0] = (int)sqrt(angle_deg[0] * 90); /* 90 cells of the root of 0..90 degrees */
    cell[1] = (int)angle_deg[1];
    cell[2] = (int)angle_deg[2];
    for (int k = 0; k < 3; k++)
        cell[k] = cell[k] > (k == 2 ? 179 : 89) ? (k == 2 ? 179 : 89) : cell[k];
    return cell[2] + cell[1] * 180 + cell[0] * 180 * 90;
}

/* ---- a model that says where it was asked: its colours are the three angles ---- */

static void eval_angles(const weft_brdf_batch *b, double *const value[3])
{
    for (int i = 0; i < b->n; i++) {
        const double light[3] = {b->light[0][i], b->light[1][i], b->light[2][i]};
        const double view[3] = {b->view[0][i], b->view[1][i], b->view[2][i]};
        double angle[3];
        angles_deg(light, view, angle);
        for (int c = 0; c < 3; c++)
            value[c][i] = angle[c];
    }
}

static const weft_brdf_param none[] = {{0}};
static const weft_brdf angles_model = {
    .name = "angles", .summary = "", .source = "", .params = none, .eval = eval_angles};

static double *read_file(const char *path)
{
    char *bytes;
    size_t n;
    assert_ok(weft_file_read(path, BYTES + 1, &bytes, &n, err));
    assert_int_equal(n, BYTES);
    const int32_t *const header = (const int32_t *)(const void *)bytes;
    assert_int_equal(header[0], 90);
    assert_int_equal(header[1], 90);
    assert_int_equal(header[2], 180);
    double *const cells = malloc(BYTES - 12);
    assert_non_null(cells);
    memcpy(cells, bytes + 12, BYTES - 12);
    weft_free(bytes);
    return cells;
}

/* The numbers of the angles' table; free() them.  Written once: 35 MB that go to the disk. */
static double *write_angles(void)
{
    const char *const path = weft_test_path("angles.binary");
    const double nothing[WEFT_BRDF_MAX_PLANES] = {0};
    if (!weft_file_exists(path))
        assert_ok(weft_merl_write(path, &angles_model, nothing, err));
    return read_file(path);
}

static void random_pair(uint64_t *random, double light[3], double view[3])
{
    weft_brdf_direction(weft_test_random(random), 7 * weft_test_random(random), light);
    weft_brdf_direction(weft_test_random(random), 7 * weft_test_random(random), view);
    if (weft_test_random(random) < 0.3) { /* towards the highlight, where cells are small */
        const double turn_rad = WEFT_PI + 0.2 * weft_test_random(random) * weft_test_random(random);
        weft_brdf_direction(light[2], atan2(light[1], light[0]) + turn_rad, view);
    }
}

/* The cell that the authors' reader takes for a pair holds the model at that cell's middle (or, cut by the
 * horizon, somewhere in it), in its colour, under its scale. */
static void test_every_number_is_where_readers_look(void **state)
{
    (void)state;
    static const double scale[3] = {1.0 / 1500, 1.15 / 1500, 1.66 / 1500};
    uint64_t random = 7;
    double *const stored = write_angles();
    int whole = 0;
    for (int i = 0; i < 200000; i++) {
        double light[3], view[3], angle[3], got[3];
        int cell[3];
        random_pair(&random, light, view);
        angles_deg(light, view, angle);
        const int index = index_of(angle, cell);
        for (int c = 0; c < 3; c++)
            got[c] = stored[(size_t)c * CELLS + (size_t)index] * scale[c];
        const double h = cell[0], from[3] = {h * h / 90, cell[1], cell[2]};
        const double middle[3] = {(h + 0.5) * (h + 0.5) / 90, from[1] + 0.5, from[2] + 0.5};
        const double end[3] = {(h + 1) * (h + 1) / 90, from[1] + 1, from[2] + 1};
        bool centred = true;
        for (int c = 0; c < 3; c++) {
            if (got[c] < from[c] - 1e-6 || got[c] > end[c] + 1e-6)
                fail_msg("angle %d of cell %d %d %d is %.9g, not %g to %g", c, cell[0], cell[1], cell[2],
                         got[c], from[c], end[c]);
            centred &= fabs(got[c] - middle[c]) < 1e-5;
        }
        whole += centred;
    }
    assert_true(whole > 190000);
    free(stored);
}

/* Marked cells are those that no pair above the horizon falls into: none was met above; here is one. */
static void test_cells_below_the_horizon_are_marked(void **state)
{
    (void)state;
    double *const stored = write_angles();
    int marked = 0;
    for (int i = 0; i < CELLS; i++) {
        const bool below = stored[i] < 0;
        marked += below;
        if (below && (stored[CELLS + i] != -1 || stored[(size_t)2 * CELLS + (size_t)i] != -1))
            fail_msg("cell %d is marked in red alone", i);
    }
    assert_true(stored[80 * 180 + 180 * 90 * 85] < 0); /* half vector and difference near the horizon */
    assert_true(stored[0] >= 0 && stored[(size_t)180 * 90] >= 0);
    assert_in_range(marked, CELLS / 5, CELLS / 2);
    free(stored);
}

/* Read back, a model agrees with itself: at cells' middles to the last digits, between them closely, and its
 * albedos with the closed integral. */
static void test_round_trip(void **state)
{
    (void)state;
    const char *const path = weft_test_path("cloth.binary");
    const weft_brdf *cloth, *back;
    weft_merl *table;
    double values[WEFT_BRDF_MAX_PLANES], worst_middle = 0, worst = 0, sum2 = 0;
    uint64_t random = 11;
    enum { PAIRS = 20000 };
    assert_ok(weft_brdf_open("cloth", &table, &cloth, err));
    assert_null(table);
    weft_brdf_defaults(cloth, values);
    assert_ok(weft_brdf_set(cloth, "albedo=0.2,0.5,0.8", values, err));
    assert_ok(weft_brdf_set(cloth, "f0=0.3", values, err));
    assert_ok(weft_merl_write(path, cloth, values, err));
    assert_ok(weft_brdf_open(path, &table, &back, err));
    for (int i = 0; i < PAIRS; i++) {
        double light[3], view[3], wanted[3], got[3], angle[3];
        int cell[3];
        random_pair(&random, light, view);
        angles_deg(light, view, angle);
        index_of(angle, cell);
        weft_brdf_eval_one(cloth, values, light, view, wanted);
        weft_brdf_eval_one(back, NULL, light, view, got);
        for (int c = 0; c < 3 && fmin(light[2], view[2]) > 0.05; c++) {
            worst = fmax(worst, fabs(got[c] / wanted[c] - 1));
            sum2 += (got[c] / wanted[c] - 1) * (got[c] / wanted[c] - 1);
        }
        weft_merl_directions((cell[0] + 0.5) * (cell[0] + 0.5) / 90 * WEFT_PI / 180,
                             (cell[1] + 0.5) * WEFT_PI / 180, (cell[2] + 0.5) * WEFT_PI / 180, light, view);
        if (light[2] <= 0 || view[2] <= 1e-4)
            continue;
        weft_brdf_eval_one(cloth, values, light, view, wanted);
        weft_brdf_eval_one(back, NULL, light, view, got);
        for (int c = 0; c < 3; c++)
            worst_middle = fmax(worst_middle, fabs(got[c] / wanted[c] - 1));
    }
    printf(
        "cloth as a table: %.2g at the middles of cells, else rms %.2g, largest %.2g (cosines from 0.05)\n",
        worst_middle, sqrt(sum2 / (3 * PAIRS)), worst);
    assert_true(worst_middle < 1e-10 && sqrt(sum2 / (3 * PAIRS)) < 0.003 && worst < 0.08);
    weft_merl_destroy(table);
}

/* Turning light and view about the normal, and changing them, leaves the angles and so the value. */
static void test_directions_and_angles(void **state)
{
    (void)state;
    uint64_t random = 13;
    for (int i = 0; i < 20000; i++) {
        double light[3], view[3], wanted[3], h, d, p;
        random_pair(&random, light, view);
        angles_deg(light, view, wanted);
        weft_merl_angles(light, view, &h, &d, &p);
        assert_near(h * 180 / WEFT_PI, wanted[0], 1e-5); /* acos near 1 has half the digits */
        assert_near(d * 180 / WEFT_PI, wanted[1], 1e-5);
        const double turned = fabs(p * 180 / WEFT_PI - wanted[2]); /* 0 and 180 are one */
        assert_near(fmin(turned, 180 - turned) * sin(d) * sin(h), 0, 1e-4);
        double l[3], v[3], again[3];
        weft_merl_directions(h, d, p, l, v);
        weft_merl_angles(v, l, &again[0], &again[1], &again[2]);
        assert_near(again[0], h, 1e-7);
        assert_near(again[1], d, 1e-12);
        assert_near(l[0] * v[0] + l[1] * v[1] + l[2] * v[2], cos(2 * d), 1e-12);
    }
}

/* ---- what is refused ---- */

static const char *write_table(const int32_t size[3], size_t numbers, double value, double special)
{
    static const char *path;
    path = weft_test_path("made.binary");
    char *const bytes = calloc(12 + 8 * numbers, 1);
    assert_non_null(bytes);
    memcpy(bytes, size, 12);
    for (size_t i = 0; i < numbers; i++)
        memcpy(bytes + 12 + 8 * i, i == 7 ? &special : &value, 8);
    assert_ok(weft_file_write(path, bytes, 12 + 8 * numbers, err));
    free(bytes);
    return path;
}

static void test_damaged_files(void **state)
{
    (void)state;
    weft_merl *table = NULL;
    const int32_t small[3] = {2, 3, 4}, none_at_all[3] = {0, 90, 180}, huge[3] = {2147483647, 90, 180};
    const int32_t wide[3] = {1024, 1024, 1024}, below[3] = {90, -90, 180};
    const double value = 1500 / WEFT_PI;
    assert_ok(weft_merl_read(write_table(small, 72, value, value), &table, err));
    const double up[3] = {0, 0, 1}, low[3] = {0.6, 0, -0.8};
    double f[3];
    weft_brdf_eval_one(&table->brdf, NULL, up, up, f);
    assert_near(f[0], 1 / WEFT_PI, 1e-15);
    assert_near(f[1], 1.15 / WEFT_PI, 1e-15);
    assert_near(f[2], 1.66 / WEFT_PI, 1e-15);
    weft_brdf_eval_one(&table->brdf, NULL, low, up, f);
    assert_true(f[0] == 0 && f[1] == 0 && f[2] == 0);
    weft_merl_destroy(table);
    /* a marked cell leaves its neighbours' values, not a hole and nothing negative */
    assert_ok(weft_merl_read(write_table(small, 72, value, -1), &table, err));
    for (int i = 0; i < 2000; i++) {
        double light[3], view[3];
        uint64_t random = (uint64_t)i + 1;
        random_pair(&random, light, view);
        weft_brdf_eval_one(&table->brdf, NULL, light, view, f);
        assert_true(fabs(f[0] - 1 / WEFT_PI) < 1e-14 || f[0] == 0);
    }
    weft_merl_destroy(table);

    assert_fails(weft_merl_read(write_table(small, 71, 1, 1), &table, err), WEFT_ERR_FORMAT,
                 "2 x 3 x 4 cells has 588 bytes, this file 580");
    assert_fails(weft_merl_read(write_table(small, 73, 1, 1), &table, err), WEFT_ERR_FORMAT, "588 bytes");
    assert_fails(weft_merl_read(write_table(huge, 72, 1, 1), &table, err), WEFT_ERR_FORMAT,
                 "2147483647 x 90 x 180 cells");
    assert_fails(weft_merl_read(write_table(wide, 72, 1, 1), &table, err), WEFT_ERR_FORMAT,
                 "1073741824 cells");
    assert_fails(weft_merl_read(write_table(below, 72, 1, 1), &table, err), WEFT_ERR_FORMAT, "90 x -90");
    assert_fails(weft_merl_read(write_table(none_at_all, 72, 1, 1), &table, err), WEFT_ERR_FORMAT, "0 x 90");
    assert_fails(weft_merl_read(write_table(small, 72, 1, NAN), &table, err), WEFT_ERR_FORMAT,
                 "red of cell 0, 1, 3");
    assert_fails(weft_merl_read(write_table(small, 72, 1, INFINITY), &table, err), WEFT_ERR_FORMAT,
                 "made.binary");
    assert_fails(weft_merl_read(write_table(small, 72, -1, -1), &table, err), WEFT_ERR_FORMAT,
                 "not measured");
    assert_ok(weft_file_write(weft_test_path("short.binary"), "1234567", 7, err));
    assert_fails(weft_merl_read(weft_test_path("short.binary"), &table, err), WEFT_ERR_FORMAT,
                 "short.binary");
    assert_fails(weft_merl_read(weft_test_path("absent.binary"), &table, err), WEFT_ERR_IO, "absent.binary");
}

static void test_anisotropic_models_have_no_place(void **state)
{
    (void)state;
    const weft_brdf *brdf;
    double values[WEFT_BRDF_MAX_PLANES];
    assert_ok(weft_brdf_find("ggx-anisotropic", &brdf, err));
    weft_brdf_defaults(brdf, values);
    assert_fails(weft_merl_write(weft_test_path("a.binary"), brdf, values, err), WEFT_ERR_USAGE,
                 "anisotropic");
    assert_false(weft_file_exists(weft_test_path("a.binary")));
    assert_ok(weft_brdf_set(brdf, "anisotropy=0", values, err));
    assert_ok(weft_merl_write(weft_test_path("a.binary"), brdf, values, err));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_directions_and_angles),
        cmocka_unit_test(test_every_number_is_where_readers_look),
        cmocka_unit_test(test_cells_below_the_horizon_are_marked),
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_damaged_files),
        cmocka_unit_test(test_anisotropic_models_have_no_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
