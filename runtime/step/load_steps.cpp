#include "runtime/step/load_steps.h"

#include <algorithm>
#include <cmath>

namespace lahar {

namespace {

// Lengths over that of the step before.
constexpr double after_few = 1.5;    ///< iterations
constexpr double after_many = 0.5;   ///< iterations
constexpr double after_none = 0.25;  ///< that led to an equilibrium
/// Of nodes in a step. Strains and functions are those of the step's beginning: what turns by 60
/// degrees in a step has no volume any more.
constexpr double most_cells = 1;
/// Of the largest step. Shorter ones would hardly change the time.
constexpr double least_share = 1e-9;
/// Times at which steps end are rounded, and the steps with them [-].
constexpr double rounding = 1e-6;

}  // namespace

LoadSteps::LoadSteps(const Analysis& analysis, const Watchdog& watchdog)
    : largest_(analysis.step.dt),
      smallest_(std::max(watchdog.time_step, least_share) * largest_),
      few_(static_cast<int>(std::lround(analysis.step.safety * analysis.implicit.most_iterations))),
      many_(3 * analysis.implicit.most_iterations / 4) {}

bool LoadSteps::accepts(const ImplicitReport& report) const {
  return report.converged && report.longest_move.cells <= most_cells;
}

double LoadSteps::cut(double dt) const {
  return std::max(after_none * dt, smallest_);
}

bool LoadSteps::is_smallest(double dt) const {
  return dt <= smallest_ * (1 + rounding);
}

double LoadSteps::next(const Length& last, bool was_cut, const ImplicitReport& report) const {
  double factor = report.iterations <= few_    ? after_few
                  : report.iterations <= many_ ? 1.0
                                               : after_many;
  factor = std::min(factor, most_cells / report.longest_move.cells);
  if (was_cut) factor = std::min(factor, 1.0);
  double dt = factor * last.dt;
  if (!was_cut && factor >= 1) dt = std::max(dt, last.planned);  // output alone made it shorter
  return std::clamp(dt, smallest_, largest_);
}

}  // namespace lahar
