#include "runtime/solve/direct_solve.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "runtime/trace/record/recorder.h"

namespace lahar {

namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Vector = Eigen::VectorXd;

/// An unknown is numbered node * Dim + direction.
struct Entry {
  Index patch, row, column;
  double value;
};
struct Right {
  Index row;
  double value;
};
struct Answer {
  Index row;
  double value;
  double left;   ///< b - A x
  char has_row;  ///< else there is a right side alone
};
struct Verdict {
  char converged = 0, singular = 0, finite = 1;
  Index unsolvable = 0;
  double residual = 0;
};

template <int Dim>
bool is_held(const Patch<Dim>& patch, Local node, int d) {
  const auto& held = patch.system.held;
  return !held.empty() && (held[static_cast<std::size_t>(node)] >> d & 1);
}

/// Call body(row, column, value) for all entries of free unknowns that a patch has.
template <int Dim>
void for_each_entry(const Patch<Dim>& patch, auto body) {
  const auto& system = patch.system;
  if (system.column.empty()) return;
  const auto& nodes = patch.topology.nodes;
  const auto width = static_cast<std::size_t>(system.width());
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (std::size_t k = system.first[i]; k < system.first[i + 1]; ++k) {
      const Local j = system.column[k];
      const double* block = &system.blocks[k * width * width];
      for (int a = 0; a < system.width(); ++a)
        for (int c = 0; c < system.width(); ++c, ++block)
          if (!is_held(patch, static_cast<Local>(i), a) && !is_held(patch, j, c))
            body(nodes[i] * Dim + a, nodes[static_cast<std::size_t>(j)] * Dim + c, *block);
    }
}

/// Right sides of the nodes of which a patch has rows.
template <int Dim>
void for_each_right_side(const Patch<Dim>& patch, auto body) {
  const auto& system = patch.system;
  if (system.column.empty()) return;
  for (std::size_t i = 0; i < patch.topology.nodes.size(); ++i)
    for (int d = 0; d < system.width() && system.first[i] < system.first[i + 1]; ++d)
      if (!is_held(patch, static_cast<Local>(i), d))
        body(patch.topology.nodes[i] * Dim + d,
             system.right_side[i * node_width + static_cast<std::size_t>(d)]);
}

/// All that is gathered, on the rank that solves.
struct Whole {
  std::vector<Index> unknown;  ///< ascending
  Matrix matrix;
  Vector right;
  std::vector<Right> unsolvable;  ///< of rows that are zero
};

Whole assemble(std::vector<Entry> entries, std::vector<Right> rights) {
  std::erase_if(entries, [](const Entry& entry) { return entry.value == 0; });
  std::stable_sort(entries.begin(), entries.end(),
                   [](const Entry& a, const Entry& b) { return a.patch < b.patch; });
  Whole whole;
  for (const Entry& entry : entries) whole.unknown.push_back(entry.row);
  auto& unknown = whole.unknown;
  std::sort(unknown.begin(), unknown.end());
  unknown.erase(std::unique(unknown.begin(), unknown.end()), unknown.end());
  const auto number = [&](Index of) -> Index {
    const auto at = std::lower_bound(unknown.begin(), unknown.end(), of);
    return at == unknown.end() || *at != of ? -1 : at - unknown.begin();
  };
  const auto n = static_cast<Index>(unknown.size());
  std::vector<Eigen::Triplet<double, int>> triplets;
  for (const Entry& entry : entries)
    if (const Index column = number(entry.column); column >= 0)
      triplets.emplace_back(static_cast<int>(number(entry.row)), static_cast<int>(column),
                            entry.value);
  whole.matrix.resize(n, n);
  whole.matrix.setFromTriplets(triplets.begin(), triplets.end());
  whole.right = Vector::Zero(n);
  for (const Right& right : rights) {
    if (const Index row = number(right.row); row >= 0)
      whole.right[row] = right.value;
    else if (right.value != 0)
      whole.unsolvable.push_back(right);
  }
  // All patches of a node have its right side.
  auto& unsolvable = whole.unsolvable;
  std::sort(unsolvable.begin(), unsolvable.end(),
            [](const Right& a, const Right& b) { return a.row < b.row; });
  unsolvable.erase(std::unique(unsolvable.begin(), unsolvable.end(),
                               [](const Right& a, const Right& b) { return a.row == b.row; }),
                   unsolvable.end());
  return whole;
}

double relative_residual(const Whole& whole, const Vector& x) {
  const double b = whole.right.norm();
  const double r = (whole.right - whole.matrix * x).norm();
  return r == 0 ? 0 : r / b;
}

/// With a step of refinement: pivots may have been small.
bool solve_with(auto& solver, const Whole& whole, double tolerance, Vector& x) {
  solver.compute(whole.matrix);
  if (solver.info() != Eigen::Success) return false;
  x = solver.solve(whole.right);
  if (!x.allFinite()) return false;
  if (relative_residual(whole, x) > 0.1 * tolerance)
    x += solver.solve(whole.right - whole.matrix * x);
  return x.allFinite() && relative_residual(whole, x) <= tolerance;
}

Verdict solve(const Whole& whole, bool symmetric, double tolerance, Vector& x) {
  Verdict verdict;
  verdict.unsolvable = static_cast<Index>(whole.unsolvable.size());
  x = Vector::Zero(whole.right.size());
  // Where all nodes are held there are no unknowns, and a matrix without rows has no norm.
  if (x.size() > 0 && (!whole.right.allFinite() || !std::isfinite(whole.matrix.norm()))) {
    verdict.finite = 0;
    return verdict;
  }
  if (whole.right.isZero(0)) {
    verdict.converged = whole.unsolvable.empty();
    return verdict;
  }
  Eigen::SimplicialLDLT<Matrix> cholesky;
  Eigen::SparseLU<Matrix> lu;
  bool solved = symmetric && solve_with(cholesky, whole, tolerance, x);
  if (!solved) solved = solve_with(lu, whole, tolerance, x);
  if (!solved && !x.allFinite()) x.setZero();
  verdict.singular = !solved;
  verdict.residual = relative_residual(whole, x);
  verdict.converged = solved && whole.unsolvable.empty();
  return verdict;
}

SolveResult result_of(const Verdict& verdict) {
  SolveResult result;
  result.converged = verdict.converged != 0;
  result.residual = verdict.residual;
  if (!verdict.finite)
    result.problem = "direct solver: numbers are not finite";
  else if (verdict.unsolvable > 0)
    result.problem = "direct solver: " + std::to_string(verdict.unsolvable) +
                     " unknowns have a right side, but no row";
  else if (verdict.singular)
    result.problem = "direct solver: the matrix is singular, or nearly so";
  return result;
}

/// By row, ascending.
std::vector<Answer> answers_of(const Whole& whole, const Vector& x) {
  const Vector left = whole.right - whole.matrix * x;
  std::vector<Answer> answers;
  for (std::size_t i = 0; i < whole.unknown.size(); ++i) {
    const auto row = static_cast<Index>(i);
    answers.push_back({whole.unknown[i], x[row], left[row], 1});
  }
  for (const Right& right : whole.unsolvable) answers.push_back({right.row, 0, right.value, 0});
  std::sort(answers.begin(), answers.end(),
            [](const Answer& a, const Answer& b) { return a.row < b.row; });
  return answers;
}

/// The solution; where it is none, also what is left of it, as iterations keep it.
template <int Dim>
void take_answers(Patch<Dim>& patch, const std::vector<Answer>& answers, bool converged) {
  const std::size_t size = static_cast<std::size_t>(patch.n_nodes()) * node_width;
  NodeArray& x = patch.system.solution;
  SolverVectors& solver = patch.system.solver;
  x.assign(size, 0.0);
  if (!converged)
    for (NodeArray* vector : {&solver.r, &solver.inverse}) vector->assign(size, 0.0);
  for (std::size_t i = 0; i < patch.topology.nodes.size(); ++i)
    for (int d = 0; d < Dim; ++d) {
      const Index row = patch.topology.nodes[i] * Dim + d;
      const auto at =
          std::lower_bound(answers.begin(), answers.end(), row,
                           [](const Answer& answer, Index of) { return answer.row < of; });
      if (at == answers.end() || at->row != row) continue;
      const std::size_t lane = i * node_width + static_cast<std::size_t>(d);
      x[lane] = at->value;
      if (converged) continue;
      solver.r[lane] = at->left;
      solver.inverse[lane] = at->has_row;
    }
}

/// Everybody's values on rank 0.
template <class T>
std::vector<T> on_first_rank(std::vector<T> values, const Communicator& ranks) {
  if (!ranks.several()) return values;
  std::vector<std::vector<T>> to(static_cast<std::size_t>(ranks.size()));
  to[0] = std::move(values);
  std::vector<T> all;
  for (const auto& part : ranks.exchange(to)) all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace

template <int Dim>
SolveResult solve_directly(PatchSet<Dim>& patches, const Communicator& ranks, bool symmetric,
                           double tolerance) {
  const TraceSpan trace = TraceSpan::of_solver(TraceKind::direct);
  std::vector<Entry> entries;
  std::vector<Right> rights;
  for (int p = 0; p < patches.size(); ++p) {
    const Patch<Dim>& patch = patches[p];
    for_each_entry(patch, [&](Index row, Index column, double value) {
      entries.push_back({patch.topology.patch, row, column, value});
    });
    for_each_right_side(patch, [&](Index row, double value) { rights.push_back({row, value}); });
  }
  entries = on_first_rank(std::move(entries), ranks);
  rights = on_first_rank(std::move(rights), ranks);
  std::vector<Answer> answers;
  std::vector<Verdict> verdicts;
  if (ranks.rank() == 0) {
    const Whole whole = assemble(std::move(entries), std::move(rights));
    Vector x;
    verdicts = {solve(whole, symmetric, tolerance, x)};
    answers = answers_of(whole, x);
  }
  answers = ranks.several() ? ranks.gather_all(std::span<const Answer>(answers)) : answers;
  verdicts = ranks.several() ? ranks.gather_all(std::span<const Verdict>(verdicts)) : verdicts;
  const SolveResult result = result_of(verdicts.front());
  for (int p = 0; p < patches.size(); ++p) take_answers(patches[p], answers, result.converged);
  return result;
}

template SolveResult solve_directly<2>(PatchSet<2>&, const Communicator&, bool, double);
template SolveResult solve_directly<3>(PatchSet<3>&, const Communicator&, bool, double);

}  // namespace lahar
