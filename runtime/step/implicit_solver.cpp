#include "runtime/step/implicit_solver.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/kernels/imbalance.h"
#include "physics/kernels/implicit.h"
#include "physics/kernels/implicit_walls.h"
#include "runtime/base/seconds.h"
#include "runtime/exchange/failure.h"
#include "runtime/exchange/sum_over_ranks.h"
#include "runtime/step/unsolved_system.h"
#include "runtime/step/worst_node.h"

namespace lahar {

namespace {

/// Halvings of a change that makes the unbalanced force larger. The last one is taken as it is.
constexpr int most_halvings = 8;
/// Times that friction turns with the sliding that was found, in a part of a step.
constexpr int most_turns = 4;
/// Iterations in which the stiffness of motions without strain follows the material.
constexpr int new_supports = 5;
/// Rounding of forces in balance, as a share of them.
constexpr double rounding = 1e-13;
/// What linear systems may leave: of the residual that a step may have, and of their right side.
constexpr double share_of_balance = 0.03;
constexpr double most_tolerance = 1e-4;

}  // namespace

template <int Dim>
bool ImplicitSolver<Dim>::Balance::is_good() const {
  return solved && std::isfinite(residual);
}

template <int Dim>
ImplicitSolver<Dim>::ImplicitSolver(const Model<Dim>& model, PatchSet<Dim>& patches,
                                    const Communicator& ranks, RoundOptions rounds,
                                    const ImplicitGroups* groups)
    : model_(model),
      patches_(patches),
      ranks_(ranks),
      begin_(patches, implicit_stages<Dim>(model.analysis).begin,
             rounds.with(0, groups ? &groups->begin : nullptr).named(1, "begin", "once"),
             {.context = [this](Step round) { return context(round); }}),
      linearize_(patches, implicit_stages<Dim>(model.analysis).linearize,
                 rounds.with(n_sums, groups ? &groups->linearize : nullptr)
                     .named(2, "linearize", "before each solve, and after the last"),
                 {.context = [this](Step round) { return context(round); },
                  .give = [this](int p, Step round, std::span<double> own) { give(p, round, own); },
                  .take =
                      [this](Step, std::span<const double> sums) {
                        std::copy(sums.begin(), sums.end(), sums_.begin());
                        return true;
                      }}),
      linear_(
          model.analysis.linear, patches,
          rounds.with(0, groups ? &groups->solve : nullptr).named(3, "solve", rounds_of_a_solve)) {}

template <int Dim>
StepContext<Dim> ImplicitSolver<Dim>::context(Step round) const {
  return {&model_, &patches_.partition(), round, time_, dt_};
}

template <int Dim>
void ImplicitSolver<Dim>::for_each_patch(auto action) const {
  for (int p = 0; p < patches_.size(); ++p) action(patches_[p]);
}

template <int Dim>
void ImplicitSolver<Dim>::give(int p, Step round, std::span<double> own) const {
  const Patch<Dim>& patch = patches_[p];
  const EquilibriumNorms norms = equilibrium_norms(patch, context(round));
  const bool unsolved = patch.unsolved.kind != ParticleFault::Kind::none;
  const std::array<double, n_sums> all{norms.residual,
                                       norms.forces,
                                       norms.change,
                                       norms.unknowns,
                                       unsolved ? 1.0 : 0.0,
                                       patch.system.symmetric ? 0.0 : 1.0,
                                       patch.implicit.walls_changed ? 1.0 : 0.0};
  std::copy(all.begin(), all.end(), own.begin());
}

template <int Dim>
auto ImplicitSolver<Dim>::linearize() -> Balance {
  const double begin = seconds();
  linearize_.run(1);
  report_.linearize_seconds += seconds() - begin;
  const Balance balance{.residual = std::sqrt(sums_[0]),
                        .forces = std::sqrt(sums_[1]),
                        .change = std::sqrt(sums_[2]),
                        .unknowns = sums_[3],
                        .solved = sums_[4] == 0.0,
                        .symmetric = sums_[5] == 0.0,
                        .settled = sums_[6] == 0.0};
  if (!balance.solved) find_problem();
  return balance;
}

/// Collective: the first particle without a stress, of the first rank that has one.
template <int Dim>
void ImplicitSolver<Dim>::find_problem() {
  bool has = false;
  for_each_patch([&](const Patch<Dim>& patch) {
    if (patch.unsolved.kind == ParticleFault::Kind::none || has) return;
    report_.problem = describe_fault(patch.unsolved, model_, patches_.next_id());
    has = true;
  });
  if (ranks_.several()) take_first_text(ranks_, has, report_.problem);
}

/// Newton's method is inexact (R. Dembo, S. Eisenstat and T. Steihaug, SIAM J. Numer. Anal. 19,
/// 1982): what is left of a linear system is a small part of what may be left in the end.
template <int Dim>
bool ImplicitSolver<Dim>::solve_linear(const Balance& balance, double first) {
  const double begin = seconds();
  double needed = 0;
  if (model_.analysis.implicit.nonlinear && balance.residual > 0)
    needed = std::min(most_tolerance,
                      share_of_balance * most_residual(balance, first) / balance.residual);
  const SolveResult result =
      linear_.solve(balance.symmetric, balance.unknowns, {.tolerance = needed});
  report_.linear_iterations += result.iterations;
  report_.products += result.products;
  report_.linear_seconds += seconds() - begin;
  if (!result.converged) report_.problem = describe(result);
  return result.converged;
}

template <int Dim>
std::string ImplicitSolver<Dim>::describe(const SolveResult& unsolved) const {
  const auto force = [](const Patch<Dim>&, std::size_t, double left) { return left; };
  return fmt::format(
      "the linear system of iteration {} of Newton's method was not solved: {}{}",
      report_.residuals.size(),
      describe_unsolved<Dim>(unsolved, patches_, *model_.mesh, ranks_, "N", force),
      unsolved.iterations > 0
          ? "; where iterations did not suffice, give the linear solver more (max_iter)"
          : "");
}

/// Of a step that has converged.
template <int Dim>
double ImplicitSolver<Dim>::most_residual(const Balance& balance, double first) const {
  const ImplicitSteps& steps = model_.analysis.implicit;
  return std::max({steps.residual_tolerance, steps.relative_residual_tolerance * first,
                   rounding * balance.forces});
}

template <int Dim>
bool ImplicitSolver<Dim>::is_converged(const Balance& balance, double first, bool whole) const {
  if (balance.residual <= most_residual(balance, first)) return true;
  const double least = model_.analysis.implicit.displacement_tolerance;
  return whole && balance.change <= least * std::sqrt(balance.unknowns);
}

template <int Dim>
bool ImplicitSolver<Dim>::iterate() {
  const ImplicitSteps& steps = model_.analysis.implicit;
  Balance balance = linearize();
  if (report_.iterations == 0) for_each_patch([](Patch<Dim>& patch) { keep_unloaded(patch); });
  const double first = std::max(unloaded_, balance.residual);
  int turns = 0;
  report_.residuals = {balance.residual};
  for (int k = 0; k < steps.most_iterations && balance.is_good(); ++k) {
    ++report_.iterations;
    if (!solve_linear(balance, first)) return false;
    for_each_patch([k](Patch<Dim>& patch) {
      take_solution(patch);
      patch.implicit.keeps_support = k >= new_supports;
    });
    // The first residual is not of the same unknowns where some are given: the next may be larger.
    const double before = k == 0 ? std::numeric_limits<double>::infinity() : balance.residual;
    balance = linearize();
    double share = 1.0;
    for (int h = 0; k > 0 && h < most_halvings; ++h) {
      if (balance.is_good() && (balance.residual <= before || !balance.settled)) break;
      share *= 0.5;
      for_each_patch([&](Patch<Dim>& patch) { take_back(patch, share); });
      balance = linearize();
    }
    report_.residuals.push_back(balance.residual);
    if (!balance.is_good()) break;
    if (!steps.nonlinear) return true;
    if (!balance.settled || !is_converged(balance, first, share == 1.0)) continue;
    if (turns == most_turns || !turn_slips()) return true;
    ++turns;
    balance = linearize();
  }
  if (balance.solved)
    report_.problem =
        fmt::format("after {} iterations {:.3g} N are not in balance, of {:.3g} N at first; {}",
                    report_.residuals.size() - 1, balance.residual, first, worst_node());
  return false;
}

template <int Dim>
bool ImplicitSolver<Dim>::turn_slips() {
  if (Dim == 2) return false;  // along a line there is one direction
  bool any = false;
  for_each_patch([&](Patch<Dim>& patch) { any |= lahar::turn_slips(patch); });
  return ranks_.any(any);
}

template <int Dim>
std::string ImplicitSolver<Dim>::worst_node() const {
  const auto unbalanced = [](const Patch<Dim>& patch, std::size_t i) {
    if (i >= patch.system.held.size()) return -1.0;
    Vec<Dim> force = Vec<Dim>::Zero();
    for (int d = 0; d < Dim; ++d)
      if (!(patch.system.held[i] >> d & 1))
        force[d] = patch.system.right_side[i * node_width + static_cast<std::size_t>(d)];
    return force.norm();
  };
  return fmt::format("most at {} N",
                     describe_worst_node<Dim>(patches_, *model_.mesh, ranks_, unbalanced));
}

template <int Dim>
void ImplicitSolver<Dim>::restore() {
  for_each_patch([](Patch<Dim>& patch) { restore_increment(patch); });
  if (unloaded_ > 0) return;
  for_each_patch([](Patch<Dim>& patch) { load_in_part(patch, 0.0, 0.0); });
  unloaded_ = linearize().residual;
  for_each_patch([](Patch<Dim>& patch) { keep_unloaded(patch); });
}

template <int Dim>
LongestMove ImplicitSolver<Dim>::longest_move() const {
  constexpr double least_share = 0.01;
  double heaviest = 0;
  LongestMove longest;
  for_each_patch(
      [&](const Patch<Dim>& patch) { heaviest = std::max(heaviest, heaviest_node(patch)); });
  heaviest = ranks_.max(heaviest);
  for_each_patch([&](const Patch<Dim>& patch) {
    const LongestMove own = lahar::longest_move(patch, least_share * heaviest);
    longest.metres = std::max(longest.metres, own.metres);
    longest.cells = std::max(longest.cells, own.cells);
  });
  return {ranks_.max(longest.metres), ranks_.max(longest.cells)};
}

template <int Dim>
void ImplicitSolver<Dim>::begin_step(double time, double dt) {
  // Loads are those of the step's end. (In CB-Geo MPM of its beginning.)
  time_ = model_.analysis.as_cbgeo ? time : time + dt;
  dt_ = dt;
  report_ = {};
  unloaded_ = 0;
  begin_.run(1);
}

template <int Dim>
double ImplicitSolver<Dim>::unbalanced(double time, double dt) {
  begin_step(time, dt);
  for_each_patch([](Patch<Dim>& patch) { load_in_part(patch, 0.0, 1.0); });
  if (!linearize().is_good()) return std::numeric_limits<double>::infinity();
  ExactSum own;
  for_each_patch([&](const Patch<Dim>& patch) { own += unbalanced_in_system(patch); });
  return sum_over_ranks(own, ranks_);
}

template <int Dim>
ImplicitReport ImplicitSolver<Dim>::solve(const ImplicitStep& step) {
  const ImplicitSteps& steps = model_.analysis.implicit;
  linear_.begin_step();
  begin_step(step.time, step.dt);
  if (step.first && !steps.quasi_static && !model_.analysis.as_cbgeo) {
    for_each_patch([](Patch<Dim>& patch) { load_in_part(patch, 0.0, 0.0); });
    linearize();
    for_each_patch([&](Patch<Dim>& patch) { accelerate_from_rest(patch, context(0)); });
  }
  double reached = 0, part = 1;
  while (reached < 1) {
    const bool last = reached + part >= 1;
    const double next = last ? 1 : reached + part;
    for_each_patch([&](Patch<Dim>& patch) {
      keep_increment(patch);
      load_in_part(patch, 1 - next, next - reached);
    });
    if (iterate()) {
      reached = next;
      ++report_.parts;
      part *= 2;
    } else {
      restore();
      report_.least_part = part;
      part /= 4;
      if (!step.in_parts || part * steps.most_cuts < 1) return report_;
    }
  }
  report_.converged = true;
  report_.longest_move = longest_move();
  report_.problem.clear();
  return report_;
}

template class ImplicitSolver<2>;
template class ImplicitSolver<3>;

}  // namespace lahar
