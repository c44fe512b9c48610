/* Threads of the virtual scanner's cloth, which lies in waves: counted, followed and laid straight. */
#include "tests/host/cloth_piece.h"
#include "tests/support/support.h"

#include "shading/bake/weave.h"

#include <math.h>

enum { W = 800, H = 600 };

/* The plane through thread counts: threads a pixel right and down. */
static void fit_counts(const weft_image *count, double k[2])
{
    double sum[2] = {0, 0}, square[2] = {0, 0};
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            const double d[2] = {x - 0.5 * (W - 1), y - 0.5 * (H - 1)};
            for (int c = 0; c < 2; c++) {
                sum[c] += d[c] * (double)weft_image_row(count, 0, y)[x];
                square[c] += d[c] * d[c];
            }
        }
    for (int c = 0; c < 2; c++)
        k[c] = sum[c] / square[c];
}

/* Largest distance between the counts of the maker and those found, threads, means taken away. */
static double worst_count(const weft_image *count, const double k[2], const weft_thread_lie *lie)
{
    double mean = 0, worst = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int y = 0; y < H; y += 5)
            for (int x = 0; x < W; x += 5) {
                const double off = (double)weft_image_row(count, 0, y)[x] - k[0] * x - k[1] * y -
                                   weft_thread_lie_at(lie, x, y);
                if (pass)
                    worst = fmax(worst, fabs(off - mean));
                else
                    mean += off * 25 / (W * H);
            }
    return worst;
}

static void check_fabric(const char *name, double mm_per_px)
{
    cloth_piece piece;
    weft_weave found;
    weft_seam seam;
    weft_image tiles[2] = {{0}};
    cloth_piece_init(&piece, name, W, H, mm_per_px);
    assert_ok(weft_weave_find(&piece.normal, &piece.albedo, &found, err));
    const double det = found.step_px[0][0] * found.step_px[1][1] - found.step_px[0][1] * found.step_px[1][0];
    const double k[2][2] = {{found.step_px[1][1] / det, -found.step_px[1][0] / det},
                            {-found.step_px[0][1] / det, found.step_px[0][0] / det}};
    const weft_image *const planes[] = {&piece.normal, &piece.albedo};
    assert_ok(weft_weave_cut(planes, 2, &found, tiles, &seam, err));
    print_message(
        "%s: %d x %d (draft %d), likeness %.2f %.2f, bow %.2f %% %.2f %%, step %.3f %.3f inside %.3f "
        "%.3f\n",
        name, found.threads[0], found.threads[1], piece.draft, found.likeness[0], found.likeness[1],
        100 * found.bow[0], 100 * found.bow[1], seam.across[0], seam.across[1], seam.inside[0],
        seam.inside[1]);
    for (int axis = 0; axis < 2; axis++) {
        double truth[2];
        fit_counts(&piece.count[axis], truth);
        const double per_cm = found.threads_per_px[axis] * 10 / mm_per_px;
        const double true_per_cm = hypot(truth[0], truth[1]) * 10 / mm_per_px;
        const double worst = worst_count(&piece.count[axis], k[axis], &found.lie[axis]);
        print_message(
            "    %s: %.3f per cm, truth %.3f (pitch %.3f): %+.3f %%; counts off by %.3f thread at most\n",
            axis ? "weft" : "warp", per_cm, true_per_cm, 10 * piece.threads_per_mm[axis],
            100 * (per_cm / true_per_cm - 1), worst);
        assert_near(per_cm / true_per_cm, 1, 0.005);
        assert_true(worst < 0.3);
        assert_int_equal(found.threads[axis], piece.draft);
        assert_true(seam.across[axis] < 1.1 * seam.inside[axis]);
    }
    weft_weave_fini(&found);
    assert_ok(weft_weave_find(&tiles[0], &tiles[1], &found, err)); /* the tile lies straight */
    print_message("    tile: skew %.3f deg, bow %.3f %% %.3f %%\n", found.skew_deg, 100 * found.bow[0],
                  100 * found.bow[1]);
    assert_true(fabs(found.skew_deg) < 0.1 && found.bow[0] < 0.0025 && found.bow[1] < 0.0025);
    for (int i = 0; i < 2; i++)
        weft_image_fini(&tiles[i]);
    weft_weave_fini(&found);
    cloth_piece_fini(&piece);
}

static void check_threads(void **state)
{
    (void)state;
    check_fabric("plain-weave", 0.1);
    check_fabric("twill", 0.1);
    check_fabric("satin", 0.06);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(check_threads)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
