#include "runtime/step/implicit_solver.h"

#include <fmt/format.h>

#include <Eigen/Sparse>
#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>
#include <map>

#include "physics/kernels/implicit.h"
#include "runtime/step/failure.h"

namespace lahar {

template <int Dim>
ImplicitSolver<Dim>::ImplicitSolver(const Model<Dim>& model, PatchSet<Dim>& patches)
    : model_(model), patches_(patches), stages_(implicit_stages<Dim>(model.analysis)) {}

template <int Dim>
void ImplicitSolver<Dim>::for_each_patch(auto action) {
  for (int p = 0; p < patches_.size(); ++p) action(patches_[p]);
}

template <int Dim>
void ImplicitSolver<Dim>::run(const Stages<Dim>& stages) {
  context_.step = round_++;
  for (const auto& stage : stages)
    for_each_patch([&](Patch<Dim>& patch) {
      if (stage.begin) stage.begin(patch, context_);
      if (stage.bins) stage.bins(patch, context_, patch.bins);
      if (stage.end) stage.end(patch, context_);
    });
}

template <int Dim>
auto ImplicitSolver<Dim>::evaluate() -> Norms {
  run(stages_.linearize);
  Norms all;
  for_each_patch([&](Patch<Dim>& patch) {
    const EquilibriumNorms norms = equilibrium_norms(patch, context_);
    all.residual += norms.residual;
    all.forces += norms.forces;
    all.change += norms.change;
    all.unknowns += norms.unknowns;
    if (patch.fault.kind != ParticleFault::Kind::none) {
      all.good = false;
      if (report_.problem.empty())
        report_.problem = describe_fault(patch.fault, model_, patches_.next_id());
      patch.fault = {};
    }
  });
  all.residual = std::sqrt(all.residual);
  all.forces = std::sqrt(all.forces);
  all.change = std::sqrt(all.change);
  return all;
}

template <int Dim>
bool ImplicitSolver<Dim>::solve_linear() {
  std::map<Index, Index> number;
  std::vector<Eigen::Triplet<double>> entries;
  for_each_patch([&](Patch<Dim>& patch) {
    for (Local i = 0; i < static_cast<Local>(patch.system.held.size()); ++i)
      for (int d = 0; d < Dim; ++d)
        if (!(patch.system.held[static_cast<std::size_t>(i)] >> d & 1))
          number.try_emplace(patch.topology.nodes[static_cast<std::size_t>(i)] * Dim + d, 0);
  });
  Index n = 0;
  for (auto& [key, value] : number) value = n++;
  Eigen::VectorXd b = Eigen::VectorXd::Zero(n);
  const auto number_of = [&](const Patch<Dim>& patch, Local i, int d) -> Index {
    if (patch.system.held[static_cast<std::size_t>(i)] >> d & 1) return -1;
    return number.at(patch.topology.nodes[static_cast<std::size_t>(i)] * Dim + d);
  };
  for_each_patch([&](Patch<Dim>& patch) {
    const auto& system = patch.system;
    for (Local i = 0; i < static_cast<Local>(system.held.size()); ++i)
      for (int a = 0; a < Dim; ++a) {
        const Index row = number_of(patch, i, a);
        if (row < 0) continue;
        b[row] = system.right_side[static_cast<std::size_t>(i * node_width + a)];
        for (std::size_t k = system.first[static_cast<std::size_t>(i)];
             k < system.first[static_cast<std::size_t>(i) + 1]; ++k)
          for (int c = 0; c < Dim; ++c)
            if (const Index column = number_of(patch, system.column[k], c); column >= 0)
              entries.emplace_back(
                  row, column,
                  system.blocks[k * Dim * Dim + static_cast<std::size_t>(Dim * a + c)]);
      }
  });
  Eigen::SparseMatrix<double> A(n, n);
  A.setFromTriplets(entries.begin(), entries.end());
  Eigen::SparseLU<Eigen::SparseMatrix<double>> lu(A);
  if (lu.info() != Eigen::Success) return false;
  const Eigen::VectorXd x = lu.solve(b);
  for_each_patch([&](Patch<Dim>& patch) {
    for (Local i = 0; i < static_cast<Local>(patch.system.held.size()); ++i)
      for (int d = 0; d < Dim; ++d) {
        const Index row = number_of(patch, i, d);
        patch.system.solution[static_cast<std::size_t>(i * node_width + d)] =
            row < 0 ? 0.0 : x[row];
      }
  });
  return x.allFinite();
}

template <int Dim>
bool ImplicitSolver<Dim>::is_converged(const Norms& norms, double first, bool full) const {
  constexpr double rounding = 1e-13;
  const ImplicitSteps& steps = model_.analysis.implicit;
  if (!norms.good) return false;
  if (norms.residual <=
      std::max({steps.residual_tolerance, steps.relative_residual_tolerance * first,
                rounding * norms.forces}))
    return true;
  return full && norms.change <= steps.displacement_tolerance * std::sqrt(norms.unknowns);
}

/// Halvings of a change that makes the unbalanced force larger.
constexpr int most_halvings = 4;

template <int Dim>
bool ImplicitSolver<Dim>::iterate() {
  const ImplicitSteps& steps = model_.analysis.implicit;
  report_.problem.clear();
  for_each_patch([](Patch<Dim>& patch) {
    std::fill(patch.system.solution.begin(), patch.system.solution.end(), 0.0);
  });
  Norms norms = evaluate();
  const double first = std::max(first_residual_, norms.residual);
  bool predicted = true, full = false;
  for (int k = 0; k <= steps.most_iterations; ++k) {
    if (!norms.good || !std::isfinite(norms.residual)) return false;
    if (!predicted && is_converged(norms, first, full)) {
      report_.residual = norms.residual;
      return true;
    }
    if (!predicted && !steps.nonlinear) return true;
    if (k == steps.most_iterations) break;
    ++report_.iterations;
    if (!solve_linear()) {
      report_.problem = "the linear system has no solution";
      return false;
    }
    for_each_patch([](Patch<Dim>& patch) { advance_increment(patch, 1.0); });
    double share = 1.0;
    const double before = norms.residual;
    const double given = predicted ? std::numeric_limits<double>::infinity() : before;
    for_each_patch([](Patch<Dim>& patch) { load_in_part(patch, patch.system.left_out, 0.0); });
    norms = evaluate();
    for (int h = 0; h < most_halvings && !predicted && !(norms.good && norms.residual < 2 * given);
         ++h) {
      share *= 0.5;
      for_each_patch([&](Patch<Dim>& patch) { advance_increment(patch, -share); });
      report_.problem.clear();
      norms = evaluate();
    }
    full = share == 1.0;
    predicted = false;
  }
  report_.problem = fmt::format(
      "the unbalanced force is {:.3g} N after {} iterations, of {:.3g} N at the beginning",
      norms.residual, steps.most_iterations, first);
  return false;
}

template <int Dim>
ImplicitReport ImplicitSolver<Dim>::solve(double time, double dt) {
  const ImplicitSteps& steps = model_.analysis.implicit;
  report_ = {};
  context_ = {&model_, &patches_.partition(), 0, model_.analysis.as_cbgeo ? time : time + dt, dt};
  run(stages_.begin);
  first_residual_ = 0;
  double reached = 0, part = 1;
  while (reached < 1) {
    part = std::min(part, 1 - reached);
    const double left_out = reached + part >= 1 ? 0.0 : 1 - (reached + part);
    for_each_patch([&](Patch<Dim>& patch) {
      keep_increment(patch);
      load_in_part(patch, left_out, part);
    });
    if (iterate()) {
      reached = left_out == 0.0 ? 1 : reached + part;
      ++report_.parts;
      part *= 2;
      continue;
    }
    for_each_patch([](Patch<Dim>& patch) { restore_increment(patch); });
    if (reached == 0 && part == 1) {  // r(d = 0), without anything left out
      for_each_patch([](Patch<Dim>& patch) { load_in_part(patch, 0.0, 0.0); });
      first_residual_ = evaluate().residual;
      for_each_patch([](Patch<Dim>& patch) { keep_unloaded(patch); });
    }
    part /= 4;
    if (part * steps.most_cuts < 1) return report_;
  }
  report_.converged = true;
  report_.problem.clear();
  return report_;
}

template class ImplicitSolver<2>;
template class ImplicitSolver<3>;

}  // namespace lahar
