#include "runtime/step/pressure_solver.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "physics/kernels/projection.h"
#include "physics/model/transfer_options.h"
#include "runtime/base/seconds.h"
#include "runtime/step/unsolved_system.h"

namespace lahar {

template <int Dim>
PressureSolver<Dim>::PressureSolver(const Model<Dim>& model, PatchSet<Dim>& patches,
                                    const Communicator& ranks, RoundOptions rounds,
                                    const PressureGroups* groups)
    : model_(model),
      patches_(patches),
      ranks_(ranks),
      system_(patches, projection_stages<Dim>(model.analysis),
              rounds.with(n_sums, groups ? &groups->system : nullptr).named(1, "system", "once"),
              {.context = [this](Step round) { return context(round); },
               .give =
                   [this](int p, Step, std::span<double> own) {
                     const PressureSums sums = pressure_sums(patches_[p]);
                     const std::array<double, n_sums> all{sums.unknowns, sums.given, sums.discharge,
                                                          sums.volume};
                     std::copy(all.begin(), all.end(), own.begin());
                   },
               .take =
                   [this](Step round, std::span<const double> sums) {
                     last_round_ = round;
                     std::copy(sums.begin(), sums.end(), sums_.begin());
                     return true;
                   }}),
      linear_(
          model.analysis.linear, patches,
          rounds.with(0, groups ? &groups->solve : nullptr).named(2, "solve", rounds_of_a_solve)) {}

template <int Dim>
StepContext<Dim> PressureSolver<Dim>::context(Step round) const {
  return {&model_, &patches_.partition(), round, time_, dt_, nullptr, first_};
}

template <int Dim>
std::string PressureSolver<Dim>::describe(const SolveResult& unsolved) const {
  const auto divergence = [](const Patch<Dim>& patch, std::size_t i, double left) {
    const std::vector<double>& volume = patch.projection.volume;
    return i < volume.size() && volume[i] > 0 ? left / volume[i] : -1.0;
  };
  return describe_unsolved<Dim>(unsolved, patches_, *model_.mesh, ranks_, "1/s", divergence);
}

template <int Dim>
PressureReport PressureSolver<Dim>::solve(double time, double dt, bool first) {
  time_ = time;
  dt_ = dt;
  first_ = first;
  PressureReport report;
  const double begin = seconds();
  system_.run(1);
  const Analysis& analysis = model_.analysis;
  if (first && keeps_pore_pressure(analysis)) {
    for (int p = 0; p < patches_.size(); ++p) drain_surfaces(patches_[p], context(last_round_));
    system_.run(1);
  }
  const auto [unknowns, given, discharge, volume] = sums_;
  // A liquid that is closed in has a pressure up to a constant.
  const bool closed = given == 0 && !analysis.two_phase;
  if (closed && volume > 0)
    for (int p = 0; p < patches_.size(); ++p) take_out_mean(patches_[p], discharge / volume);
  const double assembled = seconds();
  report.assemble_seconds = assembled - begin;
  linear_.begin_step();
  const SolveResult result = linear_.solve(true, unknowns, {.singular = closed});
  report.converged = result.converged;
  report.iterations = result.iterations;
  report.products = result.products;
  if (!result.converged) report.problem = describe(result);
  for (int p = 0; p < patches_.size(); ++p) take_pressure(patches_[p]);
  report.solve_seconds = seconds() - assembled;
  return report;
}

template class PressureSolver<2>;
template class PressureSolver<3>;

}  // namespace lahar
