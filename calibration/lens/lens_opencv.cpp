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
/* A second board is looked for in this size. */
constexpr float second_side_px = 1000;

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

/* Whether the picture shows a second board once the first is painted over. */
bool has_another(const cv::Mat &image, cv::Size pattern, const std::vector<cv::Point2f> &found)
{
    const float scale = std::max(1.0F, static_cast<float>(std::max(image.cols, image.rows)) / second_side_px);
    cv::Mat small;
    cv::resize(image, small, {}, 1 / scale, 1 / scale, cv::INTER_AREA);
    const auto at = [&](int row, int column) {
        return found[static_cast<size_t>(row * pattern.width + column)] / scale;
    };
    const int last_row = pattern.height - 1, last_column = pattern.width - 1;
    cv::Point2f corners[4] = {at(0, 0), at(0, last_column), at(last_row, last_column), at(last_row, 0)},
                middle(0, 0);
    for (const cv::Point2f &p : corners)
        middle += p / 4;
    std::vector<cv::Point> over;
    for (const cv::Point2f &p : corners) { /* with the outer squares */
        const cv::Point2f away =
            (p - middle) * (1 + 3.0F / static_cast<float>(std::min(pattern.width, pattern.height)));
        over.emplace_back(middle + away);
    }
    cv::fillConvexPoly(small, over, cv::mean(small));
    std::vector<cv::Point2f> second;
    return cv::findChessboardCorners(small, pattern, second,
                                     cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE |
                                         cv::CALIB_CB_FAST_CHECK) &&
           second.size() == static_cast<size_t>(pattern.area());
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
        return has_another(image, pattern, found) ? 2 : 1;
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

int flags_of(weft_lens_terms terms)
{
    return terms == WEFT_LENS_TERMS_8   ? cv::CALIB_RATIONAL_MODEL
           : terms == WEFT_LENS_TERMS_5 ? 0
                                        : cv::CALIB_FIX_K3;
}

int calibrate(int n_views, int n_points, const float *object, const float *image, int width, int height,
              weft_lens_terms terms, int hinge, weft_lens_estimate *estimate, float *bent,
              double *per_view_rms, float *residuals, weft_lens_why *why)
{
    return guarded(why, [&] {
        const std::vector<std::vector<cv::Point3f>> objects(static_cast<size_t>(n_views),
                                                            points3(object, n_points));
        std::vector<std::vector<cv::Point2f>> images;
        for (int i = 0; i < n_views; i++)
            images.push_back(points2(image + 2 * n_points * i, n_points));
        cv::Mat k, d, sigma, sigma_views, sigma_points, per_view;
        std::vector<cv::Mat> rotations, translations;
        std::vector<cv::Point3f> board = objects[0];
        const cv::TermCriteria until(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 60, 1e-10);
        estimate->rms_px =
            hinge < 0 ? cv::calibrateCamera(objects, images, {width, height}, k, d, rotations, translations,
                                            sigma, sigma_views, per_view, flags_of(terms), until)
                      : cv::calibrateCameraRO(objects, images, {width, height}, hinge, k, d, rotations,
                                              translations, board, sigma, sigma_views, sigma_points, per_view,
                                              flags_of(terms), until);
        estimate->camera[0] = k.at<double>(0, 0);
        estimate->camera[1] = k.at<double>(1, 1);
        estimate->camera[2] = k.at<double>(0, 2);
        estimate->camera[3] = k.at<double>(1, 2);
        for (int i = 0; i < 8; i++)
            estimate->distortion[i] = i < static_cast<int>(d.total()) ? d.at<double>(i) : 0;
        for (int i = 0; i < 12; i++)
            estimate->sigma[i] = i < static_cast<int>(sigma.total()) ? sigma.at<double>(i) : 0;
        for (int i = 0; i < n_views; i++)
            per_view_rms[i] = per_view.at<double>(i);
        for (int i = 0; bent && i < n_points; i++) {
            bent[3 * i] = board[static_cast<size_t>(i)].x;
            bent[3 * i + 1] = board[static_cast<size_t>(i)].y;
            bent[3 * i + 2] = board[static_cast<size_t>(i)].z;
        }
        for (int v = 0; residuals && v < n_views; v++) {
            std::vector<cv::Point2f> again;
            cv::projectPoints(board, rotations[static_cast<size_t>(v)], translations[static_cast<size_t>(v)],
                              k, d, again);
            for (int i = 0; i < n_points; i++) {
                const cv::Point2f off =
                    images[static_cast<size_t>(v)][static_cast<size_t>(i)] - again[static_cast<size_t>(i)];
                residuals[2 * (v * n_points + i)] = off.x;
                residuals[2 * (v * n_points + i) + 1] = off.y;
            }
        }
        return 0;
    });
}

int solve_pose(int n_points, const float *object, const float *image, const double camera[4],
               const double distortion[8], double rotation[9], double translation[3], double *rms_px,
               weft_lens_why *why)
{
    return guarded(why, [&] {
        const std::vector<cv::Point3f> objects = points3(object, n_points);
        const std::vector<cv::Point2f> images = points2(image, n_points);
        const cv::Matx33d k(camera[0], 0, camera[2], 0, camera[1], camera[3], 0, 0, 1);
        const cv::Mat d(8, 1, CV_64F, const_cast<double *>(distortion));
        std::vector<cv::Mat> rvecs, tvecs;
        /* A plane seen from afar allows two tilts; refine both and let the error decide. */
        std::vector<cv::Point3f> flat = objects; /* a board that is slightly bent begins as a plane */
        for (cv::Point3f &p : flat)
            p.z = 0;
        cv::solvePnPGeneric(flat, images, k, d, rvecs, tvecs, false, cv::SOLVEPNP_IPPE);
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
