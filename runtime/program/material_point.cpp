#include "runtime/program/material_point.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "physics/materials/law.h"

namespace lahar {

namespace {

/// A stress is reached within this share of the largest stress about, elastic ones included: what
/// rounding of a return mapping leaves.
constexpr double reached = 1e-11;
/// Perturbation of a strain for the tangent, as a share of the step's largest strain.
constexpr double perturbation = 1e-6;
constexpr int most_iterations = 100, most_strain_halvings = 25;
constexpr int most_divisions = 6;  // of an increment, by two
/// Of MaterialPoint::most_answers, so that one that creeps leaves some for parts of the increment.
constexpr int most_answers_of_search = 100;

}  // namespace

MaterialPoint::MaterialPoint(const Law& law, const Voigt& stress)
    : law_(law),
      of_faces_(std::visit([](const auto& own) { return Law(with_free_faces(own)); }, law)),
      stress_(stress) {
  state_.resize(state_variables(law).size());
  initial_state(law_, stress_, state_.data());
}

std::vector<double> MaterialPoint::state() const {
  std::vector<double> all = state_;
  derive_state(law_, stress_, all.data());
  return all;
}

MaterialPoint::Answer MaterialPoint::answer(const Law& law, const Voigt& increment,
                                            double dt) const {
  ++answers_;
  LawInput<3, Scalar> in;
  constexpr int voigt[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
  for (std::size_t k = 0; k < 6; ++k) in.rate[k] = Scalar(increment[k] / dt);
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      const double rate = increment[static_cast<std::size_t>(voigt[a][b])] / dt;
      in.gradient[a][b] = Scalar(a == b ? rate : 0.5 * rate);
    }
  in.dt = dt;
  in.volumetric = increment[0] + increment[1] + increment[2];
  Scalar stress[6];
  std::vector<Scalar> state(std::max<std::size_t>(1, state_.size()));
  for (std::size_t k = 0; k < 6; ++k) stress[k] = Scalar(stress_[k]);
  for (std::size_t k = 0; k < state_.size(); ++k) state[k] = Scalar(state_[k]);
  const Failures failures = std::visit(
      [&](const auto& own) { return update(prepare(own), in, stress, state.data()); }, law);
  Answer answer;
  for (std::size_t k = 0; k < 6; ++k) answer.stress[k] = stress[k][0];
  for (std::size_t k = 0; k < state_.size(); ++k) answer.state.push_back(state[k][0]);
  answer.found = failures.failed == 0 && std::all_of(answer.stress.begin(), answer.stress.end(),
                                                     [](double s) { return std::isfinite(s); });
  answer.divided = failures.divided != 0;
  return answer;
}

void MaterialPoint::take(const Voigt& increment, Answer&& answer) {
  for (std::size_t k = 0; k < 6; ++k) strain_[k] += increment[k];
  stress_ = answer.stress;
  state_ = std::move(answer.state);
  divided_ += answer.divided;
}

bool MaterialPoint::strain_by(const Voigt& increment, double dt) {
  answers_ = 0;
  Answer found = answer(law_, increment, dt);
  if (!found.found) return false;
  take(increment, std::move(found));
  return true;
}

/// Strain increments of the stress-controlled components, found from a first guess.
class MaterialPoint::Search {
 public:
  Search(const MaterialPoint& point, const Voigt& guess,
         const std::array<bool, 6>& stress_controlled, const Voigt& target, double dt)
      : point_(point), target_(target), dt_(dt), trial_(guess) {
    for (std::size_t k = 0; k < 6; ++k)
      if (stress_controlled[k]) free_.push_back(k);
    now_ = ask(trial_);
  }

  /// The tangent at the beginning by perturbations, corrected by what the steps bring (Broyden
  /// 1965): it keeps the symmetry of a triaxial test at the edges of a yield surface, where there
  /// is no derivative and a perturbation of one side leads to another face.
  bool by_secants() {
    Eigen::MatrixXd J = stiffest_tangent();
    for (int iteration = 0; iteration < most_iterations; ++iteration) {
      if (!now_.found) return false;
      if (reached_target()) return true;
      const Eigen::VectorXd before = residual(now_);
      const Eigen::VectorXd step = -J.fullPivLu().solve(before);
      const double share = move(step);
      if (share == 0) return false;
      const Eigen::VectorXd moved = share * step, gain = residual(now_) - before;
      J += (gain - J * moved) * moved.transpose() / moved.squaredNorm();
    }
    return false;
  }

  /// The tangent where it is, by perturbations.
  bool by_tangents() {
    for (int iteration = 0; iteration < most_iterations; ++iteration) {
      if (!now_.found) return false;
      if (reached_target()) return true;
      const auto J = tangent(trial_, perturbation * strain_size());
      if (!J || move(-J->fullPivLu().solve(residual(now_))) == 0) return false;
    }
    return false;
  }

  const Voigt& increment() const { return trial_; }
  Answer& answer() { return now_; }

 private:
  /// The law's answer; none where there have been too many.
  Answer ask(const Voigt& increment) const {
    if (point_.answers_ >= most_answers || ++answers_ > most_answers_of_search) return {};
    return point_.answer(point_.of_faces_, increment, dt_);
  }
  Eigen::Index n() const { return static_cast<Eigen::Index>(free_.size()); }
  std::size_t component(Eigen::Index i) const { return free_[static_cast<std::size_t>(i)]; }

  Eigen::VectorXd residual(const Answer& at) const {
    Eigen::VectorXd r(n());
    for (Eigen::Index i = 0; i < n(); ++i) r[i] = at.stress[component(i)] - target_[component(i)];
    return r;
  }
  double stress_size() const {
    double size = 0;
    for (std::size_t k = 0; k < 6; ++k)
      size = std::max(
          {size, std::abs(now_.stress[k]), std::abs(point_.stress_[k]), std::abs(target_[k])});
    return size;
  }
  double strain_size() const {
    const double modulus = wave_modulus(point_.law_);
    double size = modulus > 0 ? 1e-3 * stress_size() / modulus : 0.0;
    for (const double e : trial_) size = std::max(size, std::abs(e));
    return size > 0 ? size : 1e-9;
  }
  bool reached_target() const {
    return n() == 0 || residual(now_).lpNorm<Eigen::Infinity>() <= reached * stress_size();
  }

  std::optional<Eigen::MatrixXd> tangent(const Voigt& at, double change) const {
    const Answer here = ask(at);
    if (!here.found) return std::nullopt;
    Eigen::MatrixXd J(n(), n());
    for (Eigen::Index i = 0; i < n(); ++i) {
      Voigt moved = at;
      moved[component(i)] += change;
      const Answer there = ask(moved);
      if (!there.found) return std::nullopt;
      J.col(i) = (residual(there) - residual(here)) / change;
    }
    return J;
  }
  /// Before the increment, in the direction in which it is stiffer: the elastic one.
  Eigen::MatrixXd stiffest_tangent() const {
    const double change = perturbation * strain_size();
    const auto one = tangent({}, change), other = tangent({}, -change);
    if (!one || !other) return Eigen::MatrixXd::Identity(n(), n()) * wave_modulus(point_.law_);
    return one->norm() > other->norm() ? *one : *other;
  }

  /// A step of the free components, or the largest part of it that brings the stress nearer;
  /// returns that share, 0 = none does.
  double move(const Eigen::VectorXd& step) {
    const double before = residual(now_).norm();
    double share = 1;
    for (int halving = 0; halving <= most_strain_halvings; ++halving, share *= 0.5) {
      Voigt next = trial_;
      for (Eigen::Index i = 0; i < n(); ++i) next[component(i)] += share * step[i];
      Answer there = ask(next);
      if (!there.found || !(residual(there).norm() < before)) continue;
      trial_ = next;
      now_ = std::move(there);
      return share;
    }
    return 0;
  }

  const MaterialPoint& point_;
  Voigt target_;
  double dt_;
  Voigt trial_;
  std::vector<std::size_t> free_;
  mutable int answers_ = 0;
  Answer now_;
};

bool MaterialPoint::load_by(Voigt& increment, const std::array<bool, 6>& stress_controlled,
                            const Voigt& target, double dt) {
  answers_ = 0;
  return load_by(increment, stress_controlled, target, dt, most_divisions);
}

bool MaterialPoint::load_by(Voigt& increment, const std::array<bool, 6>& stress_controlled,
                            const Voigt& target, double dt, int divisions) {
  Voigt from_elastic = increment;  // the step before may have been of another kind
  for (std::size_t k = 0; k < 6; ++k)
    if (stress_controlled[k]) from_elastic[k] = 0;
  for (const Voigt& guess : {increment, from_elastic})
    for (const bool secants : {true, false}) {
      Search search(*this, guess, stress_controlled, target, dt);
      if (!(secants ? search.by_secants() : search.by_tangents())) continue;
      increment = search.increment();
      take(increment, std::move(search.answer()));
      return true;
    }
  if (divisions == 0 || answers_ >= most_answers) return false;
  // By halves of the increment, and of the way of the stress.
  const MaterialPoint before = *this;
  Voigt first, middle;
  for (std::size_t k = 0; k < 6; ++k) {
    first[k] = 0.5 * increment[k];
    middle[k] = 0.5 * (stress_[k] + target[k]);
  }
  Voigt second = first;
  if (!load_by(first, stress_controlled, middle, 0.5 * dt, divisions - 1) ||
      !load_by(second, stress_controlled, target, 0.5 * dt, divisions - 1)) {
    const int answers = answers_;
    *this = before;
    answers_ = answers;
    return false;
  }
  for (std::size_t k = 0; k < 6; ++k) increment[k] = first[k] + second[k];
  return true;
}

double mean_pressure(const Voigt& s) {
  return -(s[0] + s[1] + s[2]) / 3;
}

double deviatoric_stress(const Voigt& s) {
  const double a = s[0] - s[1], b = s[1] - s[2], c = s[2] - s[0];
  return std::sqrt(0.5 * (a * a + b * b + c * c) + 3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}

}  // namespace lahar
