#include "tests/calibration/opencv_oracle.h"

#include <cstring>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>

static cv::Matx33d matrix_of(const double camera[4])
{
    return {camera[0], 0, camera[2], 0, camera[1], camera[3], 0, 0, 1};
}

int oracle_project(const double rotation[9], const double translation[3], const double camera[4],
                   const double distortion[8], int n, const double *world, double *pixels)
try {
    cv::Mat rvec, out;
    cv::Rodrigues(cv::Mat(3, 3, CV_64F, const_cast<double *>(rotation)), rvec);
    const cv::Mat points(n, 1, CV_64FC3, const_cast<double *>(world));
    cv::projectPoints(points, rvec, cv::Mat(3, 1, CV_64F, const_cast<double *>(translation)),
                      matrix_of(camera), cv::Mat(8, 1, CV_64F, const_cast<double *>(distortion)), out);
    std::memcpy(pixels, out.ptr<double>(), sizeof(double) * 2 * static_cast<size_t>(n));
    return 0;
} catch (...) {
    return -1;
}

int oracle_undistort(const double camera[4], const double distortion[8], int n, const double *pixels,
                     double *normalised)
try {
    cv::Mat out;
    const cv::Mat points(n, 1, CV_64FC2, const_cast<double *>(pixels));
    cv::undistortPoints(points, out, matrix_of(camera),
                        cv::Mat(8, 1, CV_64F, const_cast<double *>(distortion)), cv::noArray(), cv::noArray(),
                        cv::TermCriteria(cv::TermCriteria::COUNT, 100, 0));
    std::memcpy(normalised, out.ptr<double>(), sizeof(double) * 2 * static_cast<size_t>(n));
    return 0;
} catch (...) {
    return -1;
}

int oracle_read_grey(const char *path, uint8_t *grey, long limit, int *width, int *height)
try {
    const cv::Mat image = cv::imread(path, cv::IMREAD_GRAYSCALE);
    if (image.empty() || !image.isContinuous() || static_cast<long>(image.total()) > limit)
        return -1;
    *width = image.cols;
    *height = image.rows;
    std::memcpy(grey, image.data, image.total());
    return 0;
} catch (...) {
    return -1;
}
