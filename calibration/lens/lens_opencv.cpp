/* The only C++ of the program: see lens_opencv.h. */
#include "calibration/lens/lens_opencv.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/version.hpp>
#include <opencv2/imgproc.hpp>

namespace
{

/* The detector's cost grows with the picture; above this it looks at a smaller copy first. */
constexpr int detect_side_px = 1600;

/* Calls `f`; an exception becomes -1 and its words. */
template <typename F> int guarded(weft_lens_why *why, F f) noexcept
{
    try {
        return f();
    } catch (const std::exception &e) {
        std::snprintf(why->text, sizeof why->text, "%s", e.what());
    } catch (...) {
        std::snprintf(why->text, sizeof why->text, "unknown exception");
    }
    for (char *p = why->text; *p; p++) /* OpenCV writes several lines */
        *p = static_cast<unsigned char>(*p) < ' ' ? ' ' : *p;
    return -1;
}

bool detect(const cv::Mat &grey, cv::Size pattern, std::vector<cv::Point2f> &corners)
{
    return cv::findChessboardCorners(grey, pattern, corners,
                                     cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE) &&
           corners.size() == static_cast<size_t>(pattern.area());
}

bool detect_in_smaller_copy(const cv::Mat &grey, cv::Size pattern, std::vector<cv::Point2f> &corners)
{
    const float scale = static_cast<float>(std::max(grey.cols, grey.rows)) / detect_side_px;
    if (scale <= 1.25F)
        return false;
    cv::Mat small;
    cv::resize(grey, small, {}, 1 / scale, 1 / scale, cv::INTER_AREA);
    if (!detect(small, pattern, corners))
        return false;
    const float sx = static_cast<float>(grey.cols) / small.cols,
                sy = static_cast<float>(grey.rows) / small.rows;
    for (cv::Point2f &p : corners)
        p = {(p.x + 0.5F) * sx - 0.5F, (p.y + 0.5F) * sy - 0.5F};
    return true;
}

double smallest_spacing(const std::vector<cv::Point2f> &corners, cv::Size pattern)
{
    double smallest = HUGE_VAL;
    for (int r = 0; r < pattern.height; r++)
        for (int c = 0; c < pattern.width; c++) {
            const cv::Point2f &p = corners[static_cast<size_t>(r * pattern.width + c)];
            if (c + 1 < pattern.width)
                smallest =
                    std::min(smallest, cv::norm(corners[static_cast<size_t>(r * pattern.width + c + 1)] - p));
            if (r + 1 < pattern.height)
                smallest = std::min(smallest,
                                    cv::norm(corners[static_cast<size_t>((r + 1) * pattern.width + c)] - p));
        }
    return smallest;
}

int find_chessboard(const uint8_t *grey, int width, int height, size_t stride, int columns, int rows,
                    double share, float *corners, weft_lens_why *why)
{
    return guarded(why, [&] {
        const cv::Mat image(height, width, CV_8U, const_cast<uint8_t *>(grey), stride);
        const cv::Size pattern(columns, rows);
        std::vector<cv::Point2f> found;
        if (!detect_in_smaller_copy(image, pattern, found) && !detect(image, pattern, found))
            return 0;
        const int half = std::max(2, static_cast<int>(std::floor(share * smallest_spacing(found, pattern))));
        cv::cornerSubPix(image, found, {half, half}, {-1, -1},
                         {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 100, 1e-4});
        for (size_t i = 0; i < found.size(); i++) {
            corners[2 * i] = found[i].x;
            corners[2 * i + 1] = found[i].y;
        }
        return 1;
    });
}

std::vector<cv::Point3f> points3(const float *p, int n)
{
    std::vector<cv::Point3f> points;
    for (int i = 0; i < n; i++)
        points.emplace_back(p[3 * i], p[3 * i + 1], p[3 * i + 2]);
    return points;
}

std::vector<cv::Point2f> points2(const float *p, int n)
{
    std::vector<cv::Point2f> points;
    for (int i = 0; i < n; i++)
        points.emplace_back(p[2 * i], p[2 * i + 1]);
    return points;
}

int calibrate(int n_views, int n_points, const float *object, const float *image, int width, int height,
              weft_lens_estimate *estimate, double *per_view_rms, weft_lens_why *why)
{
    return guarded(why, [&] {
        const std::vector<std::vector<cv::Point3f>> objects(static_cast<size_t>(n_views),
                                                            points3(object, n_points));
        std::vector<std::vector<cv::Point2f>> images;
        for (int i = 0; i < n_views; i++)
            images.push_back(points2(image + 2 * n_points * i, n_points));
        cv::Mat k, d, sigma, sigma_views, per_view;
        std::vector<cv::Mat> rotations, translations;
        estimate->rms_px = cv::calibrateCamera(objects, images, {width, height}, k, d, rotations,
                                               translations, sigma, sigma_views, per_view, cv::CALIB_FIX_K3,
                                               {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 200, 1e-12});
        estimate->camera[0] = k.at<double>(0, 0);
        estimate->camera[1] = k.at<double>(1, 1);
        estimate->camera[2] = k.at<double>(0, 2);
        estimate->camera[3] = k.at<double>(1, 2);
        for (int i = 0; i < 5; i++)
            estimate->distortion[i] = d.at<double>(i);
        for (int i = 0; i < 8; i++)
            estimate->sigma[i] = sigma.at<double>(i);
        for (int i = 0; i < n_views; i++)
            per_view_rms[i] = per_view.at<double>(i);
        return 0;
    });
}

int solve_pose(int n_points, const float *object, const float *image, const double camera[4],
               const double distortion[5], double rotation[9], double translation[3], double *rms_px,
               weft_lens_why *why)
{
    return guarded(why, [&] {
        const std::vector<cv::Point3f> objects = points3(object, n_points);
        const std::vector<cv::Point2f> images = points2(image, n_points);
        const cv::Matx33d k(camera[0], 0, camera[2], 0, camera[1], camera[3], 0, 0, 1);
        const cv::Mat d(5, 1, CV_64F, const_cast<double *>(distortion));
        std::vector<cv::Mat> rvecs, tvecs;
        /* A plane seen from afar allows two tilts; refine both and let the error decide. */
        cv::solvePnPGeneric(objects, images, k, d, rvecs, tvecs, false, cv::SOLVEPNP_IPPE);
        double best = HUGE_VAL;
        for (size_t i = 0; i < rvecs.size(); i++) {
            cv::solvePnPRefineLM(objects, images, k, d, rvecs[i], tvecs[i],
                                 {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 100, 1e-12});
            std::vector<cv::Point2f> again;
            cv::projectPoints(objects, rvecs[i], tvecs[i], k, d, again);
            const double rms =
                cv::norm(again, images, cv::NORM_L2) / std::sqrt(static_cast<double>(n_points));
            if (!(rms < best) || !(tvecs[i].at<double>(2) > 0))
                continue;
            best = rms;
            cv::Mat r;
            cv::Rodrigues(rvecs[i], r);
            std::copy_n(r.ptr<double>(), 9, rotation);
            std::copy_n(tvecs[i].ptr<double>(), 3, translation);
        }
        if (!std::isfinite(best))
            throw std::runtime_error("no pose fits the corners");
        *rms_px = best;
        return 0;
    });
}

} // namespace

extern "C" __attribute__((visibility("default"))) const weft_lens_opencv weft_lens_opencv_table;
const weft_lens_opencv weft_lens_opencv_table = {WEFT_LENS_OPENCV_ABI, CV_VERSION, find_chessboard, calibrate,
                                                 solve_pose};
