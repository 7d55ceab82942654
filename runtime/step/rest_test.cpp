#include "runtime/step/rest_test.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "runtime/exchange/sum_over_ranks.h"
#include "runtime/step/watchdog.h"

namespace lahar {

namespace {

/// [s] A factor does not change after this time. A sine without an end keeps no run from its end.
double settled_at(const MathFunction& function) {
  constexpr double always = std::numeric_limits<double>::lowest();
  if (function.kind == MathFunction::Kind::sine)
    return function.hi < std::numeric_limits<double>::max() ? function.hi : always;
  std::size_t last = function.f.size();
  while (last > 1 && function.f[last - 1] == function.f[last - 2]) --last;
  return last > 1 ? function.x[last - 1] : always;
}

}  // namespace

bool is_at_rest(const UntilRest& until, const RestState& state) {
  return state.imbalance >= 0 && state.imbalance <= until.imbalance &&
         state.kinetic <= until.kinetic;
}

std::string describe_rest(const RestState& state) {
  std::string text = fmt::format("unbalanced forces are {:.3g} of the loads", state.imbalance);
  if (state.kinetic >= 0)
    text += fmt::format(", the kinetic energy is {:.3g} of the elastic energy", state.kinetic);
  return text;
}

template <int Dim>
double RestTest<Dim>::sum(auto&& part) const {
  ExactSum own;
  for (int p = 0; p < patches_.size(); ++p) own += part(patches_[p]);
  return sum_over_ranks(own, ranks_);
}

template <int Dim>
bool RestTest<Dim>::judge(double time, double kinetic, const RestOfBodies& bodies,
                          std::optional<double> unbalanced) {
  const StepContext<Dim> context{&model_, &patches_.partition(), 0, time, 0.0};
  const auto over = [](double a, double b) {
    return b > 0 ? a / b : a > 0 ? std::numeric_limits<double>::infinity() : 0.0;
  };
  if (!unbalanced)
    unbalanced = sum([](Patch<Dim>& patch) { return std::exchange(patch.unbalanced, 0.0); });
  const double loads = sum([&](const Patch<Dim>& patch) { return loads_on(patch, context); });
  state_.imbalance = over(*unbalanced + bodies.unbalanced, loads + bodies.loads);
  if (!is_implicit(model_.analysis))
    state_.kinetic =
        over(kinetic + bodies.kinetic,
             sum([&](const Patch<Dim>& patch) { return stored_energy(patch, model_); }));
  // While loads grow, or ground goes, forces may be in balance all the time.
  const bool settled =
      std::all_of(model_.functions.begin(), model_.functions.end(),
                  [&](const MathFunction& function) { return time >= settled_at(function); }) &&
      time > model_.changes.ends_at();
  state_.reached = settled && !bodies.moved && is_at_rest(model_.analysis.until, state_);
  return state_.reached;
}

template <int Dim>
bool RestTest<Dim>::resume(const RestState& state) {
  state_ = state;
  state_.reached = state.reached && on() && is_at_rest(model_.analysis.until, state);
  return state_.reached;
}

template class RestTest<2>;
template class RestTest<3>;

}  // namespace lahar
