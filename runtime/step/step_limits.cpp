#include "runtime/step/step_limits.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/kernels/kernels.h"
#include "physics/materials/law.h"
#include "runtime/exchange/failure.h"

namespace lahar {

namespace {

/// Wave speeds may grow by this factor, as densities fall, between two of these checks.
constexpr double wave_speed_margin = 1.1;

/// A fixed step is compared with its limit where speeds might have lowered it, and every so many
/// steps for slow changes of density: computing the limit costs as much as a stage.
constexpr Step limit_check_steps = 16;

constexpr double unlimited = std::numeric_limits<double>::infinity();

}  // namespace

template <int Dim>
StepLimits<Dim>::StepLimits(const Model<Dim>& model, const PatchSet<Dim>& patches)
    : model_(model), patches_(patches) {
  for (const Material& material : model.materials)
    wave_speed_bound_ = std::max(wave_speed_bound_, wave_speed_margin * wave_speed(material));
}

template <int Dim>
double StepLimits<Dim>::of_last_step() const {
  double least = unlimited;
  for (int i = 0; i < patches_.size(); ++i) least = std::min(least, patches_[i].time_step_limit);
  return least;
}

template <int Dim>
double StepLimits<Dim>::present(const Communicator& ranks, std::string* where) const {
  double least = unlimited;
  if (is_implicit(model_.analysis)) return least;
  for (int i = 0; i < patches_.size(); ++i) {
    Local p = -1;
    const double limit =
        time_step_limit<Dim>(patches_[i], model_, patches_[i].bins, where ? &p : nullptr);
    if (limit < least && p >= 0) *where = describe_particle(patches_[i].particles, p);
    least = std::min(least, limit);
  }
  const double of_all = ranks.min(least);
  if (where && ranks.several()) take_first_text(ranks, least == of_all, *where);
  return of_all;
}

template <int Dim>
std::vector<InjectionLimit> StepLimits<Dim>::of_injections(const Communicator& ranks) const {
  std::vector<InjectionLimit> limits;
  if (is_implicit(model_.analysis)) return limits;
  for (std::size_t g = 0; g < model_.injections.size(); ++g) {
    double least = unlimited;
    for (int p = 0; p < patches_.size(); ++p)
      least = std::min(least, injection_limit(patches_[p], g, model_));
    limits.push_back({model_.injections[g].start, model_.injections[g].end, ranks.min(least)});
  }
  return limits;
}

template <int Dim>
std::string StepLimits<Dim>::problem(const Patch<Dim>& patch, Step step, Step nsteps) const {
  const double used = model_.analysis.step.dt;
  if (!may_be_unstable(patch, step, nsteps)) return "";
  if (!(used > time_step_limit<Dim>(patch, model_, patch.bins))) return "";
  Local limiting = -1;
  const double limit = time_step_limit<Dim>(patch, model_, patch.bins, &limiting);
  return unstable_message(used, limit,
                          describe_particle(patch.particles, limiting, patches_.next_id())) +
         " " + unstable_hint(limit);
}

template <int Dim>
bool StepLimits<Dim>::may_be_unstable(const Patch<Dim>& patch, Step step, Step nsteps) const {
  const TimeStep& plan = model_.analysis.step;
  if (plan.adaptive || plan.accept_unstable || is_implicit(model_.analysis)) return false;
  return (step + 1) % limit_check_steps == 0 || step + 1 == nsteps ||
         plan.dt * (wave_speed_bound_ + patch.max_speed) > patch.smallest_cell;
}

template class StepLimits<2>;
template class StepLimits<3>;

}  // namespace lahar
