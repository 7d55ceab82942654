/// \file The return of Mohr-Coulomb from a trial stress of any size: both surfaces at once.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace lahar {

/// The stress at the end of an increment of Mohr-Coulomb by the implicit Euler method. In the
/// deviatoric plane of the trial stress it is the point s with the mean stress p and the
/// multipliers L >= 0 (times 2 G) of shear and tension for which
///
///     s - S + sum L_i dh_i/ds = 0,    p - P + K / (2 G) sum L_i b_i = 0,
///     f_i <= 0,    f_i L_i = 0,
///
/// where S and P are those of the trial stress and h_i(s) + b_i p the potentials (Koiter 1953; Simo
/// and Hughes, Computational Inelasticity, 1998, ch. 5). Yield functions f_i are linear within a
/// sector, Lode angles of 0 to 60 degrees. Potentials are convex, and as symmetric as the sectors:
/// s stays in the sector of S. The end is unique, and continuous in S and P; where a return goes
/// along one tangent after the other it jumps, when it takes another way for a slightly different
/// increment, and then equilibria have no solution.
///
/// Multipliers are found by Newton's method for complementarity problems (Josephy 1979), where each
/// iteration looks at the four cases of two conditions; s for given multipliers, the least of a
/// convex function, by Newton's method within it. Stresses are shares of about the trial stress
/// [-]; x = rho cos(theta) and y = rho sin(theta), as in DeviatoricPlane.
class MohrCoulombReturn {
 public:
  /// sqrt(offset^2 + 3/2 (R(theta) rho)^2) + per_mean p with the elliptic sections R of Menetrey
  /// and Willam (1995).
  struct Potential {
    double eccentricity, scale, offset, per_mean;
  };
  /// f = x s_x + y s_y + mean p - limit.
  struct Surface {
    double x, y, mean, limit;
  };
  template <class Number>
  struct PointOf {
    Number x, y, p;
  };
  using Point = PointOf<double>;

  /// Of shear and of tension; `bulk` is K / (2 G), `apex` the largest mean stress.
  MohrCoulombReturn(const std::array<Surface, 2>& surfaces,
                    const std::array<Potential, 2>& potentials, double bulk, double apex)
      : f_(surfaces), h_(potentials), bulk_(bulk), apex_(apex) {
    for (Potential& h : h_) h.offset = std::max(h.offset, least_offset);
    // Where both meet at the apex, they have an edge near it.
    f_[1].limit = std::min(f_[1].limit, f_[0].limit / std::max(f_[0].mean, 1e-300) - least_offset);
  }

  /// From a trial stress beyond the surfaces; its angle is in the sector. False: not found.
  bool solve(const Point& trial);
  /// After solve(): the stress as a function of the trial stress, the same but for derivatives. An
  /// iteration more with what was found to be active has the exact ones (implicit function
  /// theorem).
  template <class Number>
  PointOf<Number> end(const PointOf<Number>& trial) const;

 private:
  struct Gradient {
    double x, y;        ///< dh/ds
    double xx, xy, yy;  ///< and its derivative
  };
  using Vector = std::array<double, 2>;

  static constexpr int most_iterations = 60, most_halvings = 12;
  /// Residuals; end() squares what is left of them.
  static constexpr double tolerance = 1e-11, inner_tolerance = 1e-13, bisection_tolerance = 1e-6,
                          largest_multiplier = 1e9;
  /// Potentials have no tip sharper than that; so near to it, and ten times as near in the mean
  /// stress, a stress is at the apex.
  static constexpr double least_offset = 1e-9, tip = 3e-8;
  /// In an iteration the deviator keeps at least this share of its size: at a tip a step would go
  /// to the other side.
  static constexpr double least_share = 0.1;

  static Gradient gradient(const Potential& h, double x, double y);
  double yield(std::size_t i) const {
    return f_[i].x * at_.x + f_[i].y * at_.y + f_[i].mean * at_.p - f_[i].limit;
  }
  void linearize(const Point& trial);
  template <class Number>
  std::array<Number, 2> solved(const Number& x, const Number& y) const {
    return {xx_ * x + xy_ * y, xy_ * x + yy_ * y};
  }
  bool find_deviator(const Point& trial);
  void move_to(double x, double y);
  void multiply();
  bool complementary(const Vector& q);
  double worst() const;
  bool is_at_apex(double within) const;
  bool newton(const Point& trial);
  bool bisect(const Point& trial);

  std::array<Surface, 2> f_;
  std::array<Potential, 2> h_;
  double bulk_, apex_;
  Point at_{};  ///< the stress
  Vector L_{};
  bool at_apex_ = false;
  // At the stress: gradients of the potentials; 1 + sum L d2h/ds2, inverted; the residual of s; how
  // yield functions fall with multipliers.
  Gradient n_[2] = {};
  double xx_ = 1, xy_ = 0, yy_ = 1, rx_ = 0, ry_ = 0;
  double M_[2][2] = {};
};

/// R = l / m, l = 4 (1 - e^2) cos^2 + (2e - 1)^2, m = 2 (1 - e^2) cos + (2e - 1) sqrt(4 (1 - e^2)
/// cos^2 + 5 e^2 - 4 e), times the scale. The gradient of R rho is R along s and dR/dtheta across,
/// its second derivative (R + d2R/dtheta2) / rho across.
inline auto MohrCoulombReturn::gradient(const Potential& h, double x, double y) -> Gradient {
  const double rho = std::hypot(x, y), c = x / rho, s = y / rho;
  const double e = h.eccentricity, k = 1 - e * e, w = 2 * e - 1;
  const double r = std::sqrt(std::max(4 * k * c * c + 5 * e * e - 4 * e, 1e-30));
  const double l = 4 * k * c * c + w * w, dl = -8 * k * c * s, ddl = 8 * k * (s * s - c * c);
  const double dr = dl / (2 * r), ddr = (ddl / 2 - dr * dr) / r;
  const double m = 2 * k * c + w * r, dm = -2 * k * s + w * dr, ddm = -2 * k * c + w * ddr;
  const double ratio = l / m, dratio = (dl - ratio * dm) / m,
               ddratio = (ddl - 2 * dratio * dm - ratio * ddm) / m;
  const double R = h.scale * ratio, dR = h.scale * dratio, ddR = h.scale * ddratio;
  const double root = std::sqrt(h.offset * h.offset + 1.5 * R * R * rho * rho);
  const double gx = R * c - dR * s, gy = R * s + dR * c;
  const double once = 1.5 * R * rho / root,
               twice = 1.5 * h.offset * h.offset / (root * root * root),
               across = 1.5 * R * std::max(R + ddR, 0.0) / root;
  return {once * gx, once * gy, twice * gx * gx + across * s * s, twice * gx * gy - across * s * c,
          twice * gy * gy + across * c * c};
}

inline void MohrCoulombReturn::linearize(const Point& trial) {
  for (const std::size_t i : {0u, 1u}) n_[i] = gradient(h_[i], at_.x, at_.y);
  const double xx = 1 + L_[0] * n_[0].xx + L_[1] * n_[1].xx,
               xy = L_[0] * n_[0].xy + L_[1] * n_[1].xy,
               yy = 1 + L_[0] * n_[0].yy + L_[1] * n_[1].yy, per = 1 / (xx * yy - xy * xy);
  xx_ = per * yy, xy_ = -per * xy, yy_ = per * xx;
  rx_ = at_.x - trial.x + L_[0] * n_[0].x + L_[1] * n_[1].x;
  ry_ = at_.y - trial.y + L_[0] * n_[0].y + L_[1] * n_[1].y;
}

/// A point of the sector, which is not much nearer to the axis than the present one.
inline void MohrCoulombReturn::move_to(double x, double y) {
  constexpr double root3 = 1.7320508075688772;
  const double before = std::hypot(at_.x, at_.y);
  if (y < 0) y = 0;
  if (y > root3 * x) {
    const double along = std::max(0.5 * x + 0.5 * root3 * y, 0.0);
    x = 0.5 * along, y = 0.5 * root3 * along;
  }
  x = std::max(x, 0.0);
  const double rho = std::hypot(x, y), least = least_share * before;
  if (!(rho < least)) {
    at_.x = x, at_.y = y;
  } else {
    const double share = rho > 0 ? least / rho : least_share;
    at_.x = share * (rho > 0 ? x : at_.x);
    at_.y = share * (rho > 0 ? y : at_.y);
  }
}

/// s of the present multipliers.
inline bool MohrCoulombReturn::find_deviator(const Point& trial) {
  for (int k = 0; k < most_iterations; ++k) {
    linearize(trial);
    const double most = inner_tolerance * (1 + L_[0] + L_[1]);
    if (std::abs(rx_) <= most && std::abs(ry_) <= most) return true;
    const auto [x, y] = solved(rx_, ry_);
    move_to(at_.x - x, at_.y - y);
    if (std::max(std::abs(x), std::abs(y)) <= 0.1 * inner_tolerance) {
      linearize(trial);
      return true;
    }
  }
  return false;
}

inline void MohrCoulombReturn::multiply() {
  for (const std::size_t j : {0u, 1u}) {
    const auto [x, y] = solved(n_[j].x, n_[j].y);
    for (const std::size_t i : {0u, 1u})
      M_[i][j] = f_[i].x * x + f_[i].y * y + bulk_ * f_[i].mean * h_[j].per_mean;
  }
}

/// L >= 0 with q - M L <= 0 and one of both zero in each row.
inline bool MohrCoulombReturn::complementary(const Vector& q) {
  if (q[0] <= 0 && q[1] <= 0) {
    L_ = {0, 0};
    return true;
  }
  for (const std::size_t i : {0u, 1u}) {
    const double one = q[i] / M_[i][i];
    if (!(M_[i][i] > 0 && one > 0 && q[1 - i] - M_[1 - i][i] * one <= 0)) continue;
    L_[i] = one;
    L_[1 - i] = 0;
    return true;
  }
  const double det = M_[0][0] * M_[1][1] - M_[0][1] * M_[1][0];
  L_ = {(q[0] * M_[1][1] - q[1] * M_[0][1]) / det, (q[1] * M_[0][0] - q[0] * M_[1][0]) / det};
  return L_[0] >= 0 && L_[1] >= 0;
}

/// The largest residual of yield functions and multipliers.
inline double MohrCoulombReturn::worst() const {
  double worst = 0;
  for (const std::size_t i : {0u, 1u})
    worst = std::max(worst, L_[i] > 0 ? std::abs(yield(i)) : yield(i));
  return worst / (1 + L_[0] + L_[1]);
}

inline bool MohrCoulombReturn::is_at_apex(double within) const {
  return std::hypot(at_.x, at_.y) < within && at_.p > apex_ - 10 * within;
}

inline bool MohrCoulombReturn::solve(const Point& trial) {
  at_apex_ = !(std::hypot(trial.x, trial.y) > 0);
  if (at_apex_) return true;
  at_ = trial;
  L_ = {0, 0};
  if (newton(trial)) return true;
  if (!bisect(trial)) return false;
  const MohrCoulombReturn found = *this;
  if (!newton(trial)) *this = found;
  return true;
}

/// From the present stress and multipliers.
inline bool MohrCoulombReturn::newton(const Point& trial) {
  Vector before = L_;
  double least = HUGE_VAL;
  int halvings = 0;
  for (int k = 0; k < most_iterations; ++k) {
    if (!find_deviator(trial)) return false;
    multiply();
    at_apex_ = is_at_apex(tip);
    if (at_apex_ || (k > 0 && worst() <= tolerance)) return true;
    double residual = 0;
    for (const std::size_t i : {0u, 1u}) residual += std::pow(std::min(L_[i], -yield(i)), 2);
    if (residual > least && halvings < most_halvings) {
      ++halvings;
      for (const std::size_t i : {0u, 1u}) L_[i] = 0.5 * (L_[i] + before[i]);
    } else {
      halvings = 0;
      least = residual;
      before = L_;
      Vector q;
      for (const std::size_t i : {0u, 1u}) q[i] = yield(i) + M_[i][0] * L_[0] + M_[i][1] * L_[1];
      if (!complementary(q)) return false;
    }
    at_.p = trial.p - bulk_ * (L_[0] * h_[0].per_mean + L_[1] * h_[1].per_mean);
  }
  return false;
}

/// Where Newton's method goes to and fro, at tips: yield functions fall with their multipliers, and
/// tension falls with its own also where shear's follows from it.
inline bool MohrCoulombReturn::bisect(const Point& trial) {
  bool found = true;
  const auto put = [&](double shear, double tension) {
    L_ = {shear, tension};
    at_ = trial;
    at_.p -= bulk_ * (shear * h_[0].per_mean + tension * h_[1].per_mean);
    found = found && find_deviator(trial);
  };
  // The least multiplier for which f(multiplier), which falls, is not above zero; it is put last.
  // False: there is none. (Regula falsi that halves what stays, the Illinois method.)
  const auto least = [&](auto f) {
    double low = 0, high = 1, f_low = f(low), f_high = 0, end = 0;
    if (f_low <= 0) return true;
    while ((end = f_high = f(high)) > 0) {
      low = high, f_low = f_high, high *= 4;
      if (high > largest_multiplier || !found) return false;
    }
    int side = 0;  // of the last change: -1 = low
    for (int k = 0; k < most_iterations && end < -inner_tolerance; ++k) {
      double next = (low * f_high - high * f_low) / (f_high - f_low);
      if (k % 8 == 7) next = 0.5 * (low + high);
      if (!(next > low && next < high)) break;
      const double value = f(next);
      if (value > 0) {
        low = next, f_low = value;
        if (side < 0) f_high *= 0.5;
      } else {
        high = next, end = f_high = value;
        if (side > 0) f_low *= 0.5;
      }
      side = value > 0 ? -1 : 1;
    }
    return f(high) <= 0;
  };
  const auto shear = [&](double tension) {
    return least([&](double multiplier) {
      put(multiplier, tension);
      return yield(0);
    });
  };
  if (!least([&](double tension) { return shear(tension) ? yield(1) : 1.0; }) || !found)
    return false;
  multiply();
  at_apex_ = is_at_apex(bisection_tolerance);
  return at_apex_ || worst() <= bisection_tolerance;
}

template <class Number>
auto MohrCoulombReturn::end(const PointOf<Number>& trial) const -> PointOf<Number> {
  if (at_apex_) return {Number(0.0), Number(0.0), Number(apex_)};
  // By how much the residuals of s and p change with the trial stress; values are what is left.
  const Number x = trial.x - (at_.x + L_[0] * n_[0].x + L_[1] * n_[1].x),
               y = trial.y - (at_.y + L_[0] * n_[0].y + L_[1] * n_[1].y),
               p = trial.p - (at_.p + bulk_ * (L_[0] * h_[0].per_mean + L_[1] * h_[1].per_mean));
  const auto s = solved(x, y);
  std::array<Number, 2> q, dL{Number(0.0), Number(0.0)};
  for (const std::size_t i : {0u, 1u})
    q[i] = yield(i) + f_[i].x * s[0] + f_[i].y * s[1] + f_[i].mean * p;
  const bool shear = L_[0] > 0, tension = L_[1] > 0;
  if (shear && tension) {
    const double per = 1 / (M_[0][0] * M_[1][1] - M_[0][1] * M_[1][0]);
    dL[0] = (per * M_[1][1]) * q[0] - (per * M_[0][1]) * q[1];
    dL[1] = (per * M_[0][0]) * q[1] - (per * M_[1][0]) * q[0];
  } else if (shear || tension) {
    const std::size_t i = shear ? 0 : 1;
    dL[i] = (1 / M_[i][i]) * q[i];
  }
  const auto back =
      solved<Number>(n_[0].x * dL[0] + n_[1].x * dL[1], n_[0].y * dL[0] + n_[1].y * dL[1]);
  return {at_.x + s[0] - back[0], at_.y + s[1] - back[1],
          at_.p + p - bulk_ * (h_[0].per_mean * dL[0] + h_[1].per_mean * dL[1])};
}

}  // namespace lahar
