// Finding the Macbeth chart: Weft's detector beside that of OpenCV's contributed module mcc, on the same
// drawn pictures (turns of 15 degrees, tilts, dark, blurred, small, cluttered tables).  Only where mcc is
// installed.
extern "C" {
#include "calibration/charts/chart_find.h"
#include "calibration/charts/homography.h"
#include "core/colour.h"
#include "tests/calibration/chart_scene.h"
}

#include <opencv2/core.hpp>
#include <opencv2/mcc.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

namespace
{

struct condition {
    const char *name;
    double fill, tilt_x, tilt_y, table, clutter, fall_u, exposure, blur;
};

const condition conditions[] = {
    {"plain", 0.55, 0, 0, 0.25, 0.1, 0, 0.8, 0.5},
    {"tilted 20 degrees, bright table", 0.5, 20, 0, 0.8, 0.1, 0.1, 0.8, 0.5},
    {"tilted 25 degrees, dark table", 0.5, 0, -25, 0.03, 0.1, 0.1, 0.8, 0.5},
    {"tilted 35 degrees", 0.5, 35, 0, 0.25, 0.1, 0, 0.8, 0.5},
    {"small, cluttered table", 0.28, 5, 5, 0.25, 0.8, 0.3, 0.8, 0.5},
    {"dark, light 2 : 1", 0.5, 0, 10, 0.25, 0.8, -0.35, 0.02, 0.5},
    {"out of focus", 0.55, 0, 0, 0.4, 0.3, 0.1, 0.8, 2.5},
};

struct tally {
    int found = 0, wrong = 0;
    double off = 0, worst = 0, seconds = 0;
    void add(double error)
    {
        found++;
        off += error;
        worst = std::max(worst, error);
    }
};

// The picture as a viewer would show it: half size, sRGB, the brightest percent just white.
cv::Mat shown(const weft_image &mosaic)
{
    cv::Mat image(mosaic.height / 2, mosaic.width / 2, CV_8UC3);
    std::vector<float> sorted(mosaic.data, mosaic.data + weft_image_plane_size(&mosaic));
    std::nth_element(sorted.begin(), sorted.end() - static_cast<long>(sorted.size() / 100), sorted.end());
    const double white = *(sorted.end() - static_cast<long>(sorted.size() / 100));
    for (int v = 0; v < image.rows; v++)
        for (int u = 0; u < image.cols; u++) {
            const float *const a = weft_image_row(&mosaic, 0, 2 * v) + 2 * u, *const b = a + mosaic.width;
            const double rgb[3] = {a[0] / white, (a[1] + b[0]) / (2 * white), b[1] / white};
            for (int c = 0; c < 3; c++)
                image.at<cv::Vec3b>(v, u)[2 - c] = static_cast<unsigned char>(weft_srgb_encode8(rgb[c]));
        }
    return image;
}

// Whether the first corner lies nearest to the first patch; the distance of the middle from the truth, px.
bool place(const weft_chart *chart, const weft_mat3 &view, const double corner[2], const double middle[2],
           double *off)
{
    double x, y, u, v, nearest = 1e9;
    int which = -1;
    weft_chart_half_size(chart, &x, &y);
    static const double sign[4][2] = {{-1, 1}, {1, 1}, {1, -1}, {-1, -1}};
    for (int k = 0; k < 4; k++) {
        weft_homography_apply(&view, sign[k][0] * x, sign[k][1] * y, &u, &v);
        const double d = std::hypot(u - corner[0], v - corner[1]);
        if (d < nearest) {
            nearest = d;
            which = k;
        }
    }
    weft_homography_apply(&view, 0, 0, &u, &v);
    *off = std::hypot(u - middle[0], v - middle[1]);
    return which == 0;
}

double now()
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void try_weft(const weft_chart *chart, const weft_mat3 &view, const weft_image &mosaic,
              const weft_mask &clipped, tally &t)
{
    const weft_chart_picture picture = {&mosaic, WEFT_CFA_RGGB, &clipped};
    weft_chart_pose pose;
    const double begun = now();
    const bool found = weft_chart_locate(chart, &picture, &pose, nullptr) == WEFT_OK;
    t.seconds += now() - begun;
    double middle[2], off;
    if (!found)
        return;
    weft_homography_apply(&pose.to_pixel, 0, 0, &middle[0], &middle[1]);
    if (place(chart, view, pose.corners[0], middle, &off))
        t.add(off);
    else
        t.wrong++;
}

void try_mcc(const weft_chart *chart, const weft_mat3 &view, const weft_image &mosaic, tally &t)
{
    const cv::Mat image = shown(mosaic);
    const auto detector = cv::mcc::CCheckerDetector::create();
    const double begun = now();
    bool found = false;
    try {
        found = detector->process(image, cv::mcc::MCC24, 1);
    } catch (const cv::Exception &) {
    }
    t.seconds += now() - begun;
    if (!found)
        return;
    const auto box = detector->getBestColorChecker()->getBox();
    double corner[2] = {2 * box[0].x + 0.5, 2 * box[0].y + 0.5}, middle[2], off;
    const cv::Point2f p = box[0], q = box[2], r = box[1], s = box[3]; // where the diagonals meet
    const double det = (q - p).cross(s - r), along = (r - p).cross(s - r) / det;
    middle[0] = 2 * (p.x + along * (q.x - p.x)) + 0.5;
    middle[1] = 2 * (p.y + along * (q.y - p.y)) + 0.5;
    if (place(chart, view, corner, middle, &off))
        t.add(off);
    else
        t.wrong++;
}

void print(const char *name, const char *who, const tally &t, int all)
{
    std::printf(
        "%-34s %-5s %3d of %d found, %2d turned wrongly; middle off by %.2f px, %.2f at most; %.0f ms\n",
        name, who, t.found, all, t.wrong, t.found ? t.off / t.found : 0, t.worst, 1e3 * t.seconds / all);
}

} // namespace

int main()
{
    const weft_chart *chart;
    if (weft_chart_find("macbeth", "ohta1997", &chart, nullptr) != WEFT_OK)
        return 1;
    for (const condition &c : conditions) {
        tally ours, theirs;
        for (int turn = 0; turn < 360; turn += 15) {
            const weft_mat3 view = chart_scene_view(chart, 1232, 816, c.fill, turn, c.tilt_x, c.tilt_y);
            chart_scene scene = chart_scene_make(chart, view);
            scene.width = 1232;
            scene.height = 816;
            scene.table = c.table;
            scene.clutter = c.clutter;
            scene.fall_u = c.fall_u;
            scene.exposure = c.exposure;
            scene.blur = c.blur;
            scene.shot = 1e-4;
            scene.read = 5e-4;
            scene.seed = static_cast<std::uint64_t>(turn + 1);
            weft_image mosaic;
            weft_mask clipped;
            chart_scene_draw(&scene, &mosaic, &clipped);
            try_weft(chart, view, mosaic, clipped, ours);
            try_mcc(chart, view, mosaic, theirs);
            weft_image_fini(&mosaic);
            weft_mask_fini(&clipped);
        }
        print(c.name, "weft", ours, 24);
        print(c.name, "mcc", theirs, 24);
    }
    return 0;
}
