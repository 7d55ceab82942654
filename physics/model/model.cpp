#include "physics/model/model.h"

#include <algorithm>
#include <cmath>

namespace lahar {

double MathFunction::operator()(double t) const {
  if (kind == Kind::sine) return t >= lo && t <= hi ? std::sin(a * (t - x0)) : 0.0;
  if (x.empty()) return 1.0;
  if (t <= x.front()) return f.front();
  if (t >= x.back()) return f.back();
  const auto i = static_cast<std::size_t>(std::upper_bound(x.begin(), x.end(), t) - x.begin());
  return f[i - 1] + (f[i] - f[i - 1]) * (t - x[i - 1]) / (x[i] - x[i - 1]);
}

double VelocityTransfer::kept(int body, double dt) const {
  return rates.empty() ? flip : std::max(0.0, 1.0 - dt * rates[static_cast<std::size_t>(body)]);
}

}  // namespace lahar
