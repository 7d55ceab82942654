#include "runtime/verify/hole_series.h"

#include <Eigen/Dense>
#include <cmath>

namespace lahar {

HoleSeries::HoleSeries(double radius, double reach, int terms)
    : radius_(radius),
      scale_(reach / radius),
      terms_(terms),
      coefficients_(Eigen::VectorXd::Zero(functions())) {}

Eigen::Matrix<double, 3, Eigen::Dynamic> HoleSeries::basis(const Vec<2>& x) const {
  const double r = std::hypot(x[0], x[1]) / radius_, theta = std::atan2(x[1], x[0]);
  const double c = std::cos(theta), s = std::sin(theta);
  Eigen::Matrix<double, 3, Eigen::Dynamic> all(3, functions());
  // From polar components rr, tt, rt.
  auto put = [&](int column, double rr, double tt, double rt) {
    all.col(column) << c * c * rr + s * s * tt - 2 * s * c * rt,
        s * s * rr + c * c * tt + 2 * s * c * rt, s * c * (rr - tt) + (c * c - s * s) * rt;
  };
  put(0, 2 - 2 / (r * r), 2 + 2 / (r * r), 0);  // r^2 - 2 ln r
  int column = 1;
  for (int n = 2; n < 2 * terms_; n += 2) {
    Eigen::Matrix2d free;
    free << -n - n * n, 2 - n - n * n, -n - 1, 1 - n;
    for (const int k : {n, n + 2}) {
      const Eigen::Vector2d q = free.partialPivLu().solve(Eigen::Vector2d(n * n - k, 1 - k));
      double rr = 0, tt = 0, rt = 0;
      auto add = [&](double factor, int power) {
        const double f = factor * std::pow(r, power - 2) * std::pow(scale_, 2 - k);
        rr += f * (power - n * n) * std::cos(n * theta);
        tt += f * power * (power - 1) * std::cos(n * theta);
        rt += f * n * (power - 1) * std::sin(n * theta);
      };
      add(1, k);
      add(q[0], -n);
      add(q[1], 2 - n);
      put(column++, rr, tt, rt);
    }
  }
  return all;
}

void HoleSeries::fit(const std::vector<Vec<2>>& points, const std::vector<PlaneStress>& stress) {
  const auto n = static_cast<Eigen::Index>(points.size());
  Eigen::MatrixXd matrix(3 * n, functions());
  Eigen::VectorXd wanted(3 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    matrix.middleRows<3>(3 * i) = basis(points[static_cast<std::size_t>(i)]);
    wanted.segment<3>(3 * i) = stress[static_cast<std::size_t>(i)];
  }
  coefficients_ = matrix.colPivHouseholderQr().solve(wanted);
}

double HoleSeries::fit_tension(double length, double width, double traction) {
  constexpr int points = 200;  // on each edge; many more than unknowns
  Eigen::MatrixXd matrix(4 * points, functions());
  Eigen::VectorXd wanted = Eigen::VectorXd::Zero(4 * points);
  for (int i = 0; i < points; ++i) {
    const double s = (i + 0.5) / points;
    const auto end = basis({length / 2, s * width / 2}), side = basis({s * length / 2, width / 2});
    matrix.row(4 * i) = end.row(0);
    matrix.row(4 * i + 1) = end.row(2);
    matrix.row(4 * i + 2) = side.row(1);
    matrix.row(4 * i + 3) = side.row(2);
    wanted[4 * i] = traction;
  }
  coefficients_ = matrix.completeOrthogonalDecomposition().solve(wanted);
  return (matrix * coefficients_ - wanted).cwiseAbs().maxCoeff();
}

PlaneStress HoleSeries::stress(const Vec<2>& x) const {
  return basis(x) * coefficients_;
}

}  // namespace lahar
