/** OpenCV behind C: what the tests compare with.  Every function returns 0, or -1 after an exception. */
#ifndef WEFT_TESTS_OPENCV_ORACLE_H
#define WEFT_TESTS_OPENCV_ORACLE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** cv::projectPoints: `n` world points [n][3] to pixels [n][2]; `camera` is fx, fy, cx, cy. */
int oracle_project(const double rotation[9], const double translation[3], const double camera[4],
                   const double distortion[8], int n, const double *world, double *pixels);

/** cv::undistortPoints with 100 rounds: `n` pixels [n][2] to normalised coordinates [n][2]. */
int oracle_undistort(const double camera[4], const double distortion[8], int n, const double *pixels,
                     double *normalised);

/** cv::imread as 8-bit grey into `grey` [height][width] of at most `limit` bytes. */
int oracle_read_grey(const char *path, uint8_t *grey, long limit, int *width, int *height);

#ifdef __cplusplus
}
#endif

#endif
