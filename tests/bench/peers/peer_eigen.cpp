#include "tests/bench/peers/peer_eigen.h"

#ifdef WEFT_WITH_EIGEN
#include <chrono>
#include <Eigen/Dense>

namespace
{
using clock_type = std::chrono::steady_clock;
using fixed = Eigen::Matrix<double, 10, 3, Eigen::RowMajor>;
using column = Eigen::Matrix<double, 10, 1>;

double ns_since(clock_type::time_point begin, int n_pixels)
{
    return std::chrono::duration<double, std::nano>(clock_type::now() - begin).count() / n_pixels;
}

double jacobi_ns(int n_pixels, int n, const double *rows, const double *samples, double *scaled)
{
    if (n != 10)
        return -1;
    const auto begin = clock_type::now();
    for (int i = 0; i < n_pixels; i++) {
        const Eigen::Matrix<double, 10, 3> a = Eigen::Map<const fixed>(rows + 30 * i);
        const column b = Eigen::Map<const column>(samples + 10 * i);
        const Eigen::JacobiSVD<Eigen::Matrix<double, 10, 3>> svd(a,
                                                                 Eigen::ComputeFullU | Eigen::ComputeFullV);
        Eigen::Map<Eigen::Vector3d> to(scaled + 3 * i);
        to = svd.solve(b);
    }
    return ns_since(begin, n_pixels);
}

double relight_ns(int n_pixels, int n, const double *rows, const double *samples, double *scaled)
{
    const auto begin = clock_type::now();
    for (int i = 0; i < n_pixels; i++) {
        Eigen::MatrixXd a(n, 3);
        Eigen::MatrixXd b(n, 1);
        for (int j = 0; j < n; j++) {
            for (int c = 0; c < 3; c++)
                a(j, c) = rows[(i * n + j) * 3 + c];
            b(j, 0) = samples[i * n + j];
        }
        Eigen::Map<Eigen::Vector3d> to(scaled + 3 * i);
        to = (a.transpose() * a).ldlt().solve(a.transpose() * b);
    }
    return ns_since(begin, n_pixels);
}
} // namespace

const weft_peer_eigen_functions *weft_peer_eigen(void)
{
    static const weft_peer_eigen_functions functions = {jacobi_ns, relight_ns};
    return &functions;
}
#else
const weft_peer_eigen_functions *weft_peer_eigen(void)
{
    return nullptr;
}
#endif
