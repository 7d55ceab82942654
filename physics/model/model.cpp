#include "physics/model/model.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lahar {

double MathFunction::value(double t) const {
  if (kind == Kind::sine) return t >= lo && t <= hi ? std::sin(a * (t - x0)) : 0.0;
  if (x.empty()) return 1.0;
  if (t <= x.front()) return f.front();
  if (t >= x.back()) return f.back();
  const auto i = static_cast<std::size_t>(std::upper_bound(x.begin(), x.end(), t) - x.begin());
  return f[i - 1] + (f[i] - f[i - 1]) * (t - x[i - 1]) / (x[i] - x[i - 1]);
}

double MathFunction::slope(double t) const {
  // By default `lo` is the least positive number, as in CB-Geo MPM: motion begins at 0.
  if (kind == Kind::sine) {
    const double from = lo == std::numeric_limits<double>::min() ? 0 : lo;
    return t >= from && t <= hi ? a * std::cos(a * (t - x0)) : 0.0;
  }
  if (x.empty() || t < x.front() || t >= x.back()) return 0;
  const auto i = static_cast<std::size_t>(std::upper_bound(x.begin(), x.end(), t) - x.begin());
  return (f[i] - f[i - 1]) / (x[i] - x[i - 1]);
}

double MathFunction::mean(double t, double dt) const {
  const bool is_slope = differentiated && !integrated;
  return is_slope && dt > 0 ? (integral(t + dt) - integral(t)) / dt : (*this)(t + 0.5 * dt);
}

double MathFunction::largest() const {
  if (kind == Kind::sine) return differentiated ? std::abs(a) : 1;
  double most = 0;
  for (std::size_t i = 0; i < f.size(); ++i)
    most = std::max(most, std::abs(differentiated ? slope(x[i]) : f[i]));
  return most;
}

double MathFunction::integral(double t) const {
  if (differentiated) {
    const auto within = [&](double s) { return kind == Kind::sine ? std::clamp(s, lo, hi) : s; };
    return value(within(t)) - value(within(0));
  }
  if (kind == Kind::sine) {
    // From 0 to t, of what lies in [lo, hi].
    const double from = std::clamp(0.0, lo, hi), to = std::clamp(t, lo, hi);
    return a == 0 ? 0.0 : (std::cos(a * (from - x0)) - std::cos(a * (to - x0))) / a;
  }
  if (x.empty()) return t;
  const auto from_first = [&](double s) {  // from x.front() to s
    if (s <= x.front()) return (s - x.front()) * f.front();
    double sum = 0;
    std::size_t i = 0;  // the last point up to s
    if (!sums.empty()) {
      i = static_cast<std::size_t>(std::upper_bound(x.begin(), x.end(), s) - x.begin()) - 1;
      sum = sums[i];
    } else {
      for (; i + 1 < x.size() && x[i + 1] <= s; ++i)
        sum += 0.5 * (f[i] + f[i + 1]) * (x[i + 1] - x[i]);
    }
    return sum + 0.5 * (f[i] + value(s)) * (s - x[i]);
  };
  return from_first(t) - from_first(0);
}

MathFunction integral_of(MathFunction function) {
  function.integrated = true;
  if (function.kind != MathFunction::Kind::linear) return function;
  if (function.x.empty()) function.x = {0}, function.f = {1};
  const auto &x = function.x, &f = function.f;
  function.sums = {0};
  for (std::size_t i = 1; i < x.size(); ++i)
    function.sums.push_back(function.sums.back() + 0.5 * (f[i - 1] + f[i]) * (x[i] - x[i - 1]));
  return function;
}

double VelocityTransfer::kept(int body, double dt) const {
  if (rates.empty()) return flip;
  return std::max(0.0, 1.0 - dt * (rates[static_cast<std::size_t>(body)] + viscous));
}

double VelocityTransfer::taken_by_viscosity(double dt) const {
  return std::min(1.0, dt * viscous);
}

}  // namespace lahar
