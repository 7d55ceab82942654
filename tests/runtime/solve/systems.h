/// \file Linear systems on bodies of unit cells, assembled by patches from cell matrices, and what
/// their solutions must be.
#pragma once

#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "runtime/solve/global_solve.h"
#include "tests/runtime/solve/solve_models.h"

namespace lahar::test {

enum class MatrixKind {
  poisson,    ///< of each component on its own
  elastic,    ///< plane strain, or in three dimensions
  convective  ///< elastic, and a stream through the body: not symmetric
};

template <int Dim>
using CellMatrix = Eigen::Matrix<double, (1 << Dim) * Dim, (1 << Dim) * Dim>;

/// Of the unit cell, corners in tensor order, by two Gauss points per direction.
template <int Dim>
CellMatrix<Dim> cell_matrix(MatrixKind kind) {
  constexpr int n = 1 << Dim;
  CellMatrix<Dim> matrix = CellMatrix<Dim>::Zero();
  const double lambda = 1.5, G = 1.0;
  for (int q = 0; q < n; ++q) {
    std::array<std::array<double, Dim>, n> dN;
    std::array<double, n> N;
    for (int a = 0; a < n; ++a) {
      N[static_cast<std::size_t>(a)] = 1;
      dN[static_cast<std::size_t>(a)].fill(1);
      for (int d = 0; d < Dim; ++d) {
        const double x = 0.5 + (q >> d & 1 ? 0.5 : -0.5) / std::sqrt(3.0);
        const double f = a >> d & 1 ? x : 1 - x, df = a >> d & 1 ? 1 : -1;
        N[static_cast<std::size_t>(a)] *= f;
        for (int e = 0; e < Dim; ++e)
          dN[static_cast<std::size_t>(a)][static_cast<std::size_t>(e)] *= e == d ? df : f;
      }
    }
    for (int a = 0; a < n; ++a)
      for (int b = 0; b < n; ++b) {
        const auto& A = dN[static_cast<std::size_t>(a)];
        const auto& B = dN[static_cast<std::size_t>(b)];
        double dot = 0, stream = 0;
        for (std::size_t d = 0; d < Dim; ++d) {
          dot += A[d] * B[d];
          stream += (d == 0 ? 2.0 : -1.0) * B[d];
        }
        for (int i = 0; i < Dim; ++i) {
          double& diagonal = matrix(a * Dim + i, b * Dim + i);
          diagonal += (kind == MatrixKind::poisson ? 1.0 : G) * dot / n;
          if (kind == MatrixKind::convective)
            diagonal += N[static_cast<std::size_t>(a)] * stream / n;
          for (int j = 0; j < Dim && kind != MatrixKind::poisson; ++j)
            matrix(a * Dim + i, b * Dim + j) +=
                (lambda * A[static_cast<std::size_t>(i)] * B[static_cast<std::size_t>(j)] +
                 G * A[static_cast<std::size_t>(j)] * B[static_cast<std::size_t>(i)]) /
                n;
        }
      }
  }
  return matrix;
}

/// Position of a node on the grid.
template <int Dim>
std::array<Index, Dim> place_of(const Model<Dim>& model, Index node) {
  std::array<Index, Dim> place;
  for (std::size_t d = 0; d < Dim; ++d) {
    const Index nodes = model.mesh->counts()[d] + 1;
    place[d] = node % nodes;
    node /= nodes;
  }
  return place;
}

/// The body is held at x = 0, and slides on y = 0. `free`: it is not held at all. One cell has no
/// stiffness, so that a node that particles touch has a row of zeros.
template <int Dim>
void assemble(SolvePatches<Dim>& body, MatrixKind kind, bool free = false) {
  constexpr int corners = 1 << Dim;
  const CellMatrix<Dim> K = cell_matrix<Dim>(kind);
  const auto is_void = [&](const std::array<Index, Dim>& first) {
    return first[0] == (Dim == 2 ? 9 : 5) && first[1] == 0 && first.back() == 0;
  };
  const auto has_no_row = [&](const std::array<Index, Dim>& place) {
    return place[0] == (Dim == 2 ? 10 : 6) && place[1] == 0 && place.back() == 0;
  };
  for (int p = 0; p < body.patches.size(); ++p) {
    Patch<Dim>& patch = body.patches[p];
    auto& system = patch.system;
    std::vector<std::map<Local, Eigen::Matrix<double, Dim, Dim>>> rows(
        static_cast<std::size_t>(patch.n_nodes()));
    for (std::size_t c = 0; c < patch.first_bin.size(); ++c) {
      if (patch.first_bin[c] < 0) continue;
      const auto& nodes = patch.topology.corner_nodes[c];
      const auto place =
          place_of(body.model, patch.topology.nodes[static_cast<std::size_t>(nodes[0])]);
      const double factor = is_void(place) ? 0 : 1;
      for (int a = 0; a < corners; ++a)
        for (int b = 0; b < corners; ++b) {
          auto& row = rows[static_cast<std::size_t>(nodes[static_cast<std::size_t>(a)])];
          auto [at, is_new] = row.try_emplace(nodes[static_cast<std::size_t>(b)]);
          if (is_new) at->second.setZero();
          at->second += factor * K.template block<Dim, Dim>(a * Dim, b * Dim);
        }
    }
    system.first = {0};
    system.column.clear();
    system.blocks.clear();
    system.held.clear();
    system.right_side.clear();
    system.symmetric = kind != MatrixKind::convective;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (const auto& [column, block] : rows[i]) {
        system.column.push_back(column);
        for (int a = 0; a < Dim; ++a)
          for (int b = 0; b < Dim; ++b) system.blocks.push_back(block(a, b));
      }
      system.first.push_back(system.column.size());
      const Index node = patch.topology.nodes[i];
      const auto place = place_of(body.model, node);
      const unsigned held =
          free ? 0u : (place[0] == 0 ? (1u << Dim) - 1 : 0u) | (place[1] == 0 ? 2u : 0u);
      system.held.push_back(static_cast<std::uint8_t>(held));
      for (int d = 0; d < node_width; ++d)
        system.right_side.push_back(
            d < Dim && !has_no_row(place) ? 1 + std::sin(static_cast<double>(node * Dim + d)) : 0);
    }
  }
}

/// The solution of all patches by node, as many numbers as the mesh has; every copy must be the
/// same.
template <int Dim>
std::vector<double> solution_of(SolvePatches<Dim>& body, const Communicator& ranks = {}) {
  struct Value {
    Index at;
    double x;
  };
  std::vector<Value> values;
  for (int p = 0; p < body.patches.size(); ++p) {
    const Patch<Dim>& patch = body.patches[p];
    for (Local i = 0; i < patch.n_nodes(); ++i)
      if (patch.node_is_active[static_cast<std::size_t>(i)])
        for (int d = 0; d < Dim; ++d)
          values.push_back({patch.topology.nodes[static_cast<std::size_t>(i)] * Dim + d,
                            patch.system.solution[static_cast<std::size_t>(i * node_width + d)]});
  }
  if (ranks.several()) values = ranks.gather_all(std::span<const Value>(values));
  std::map<Index, double> all;
  int others = 0;
  for (const Value& value : values)
    if (all.try_emplace(value.at, value.x).first->second != value.x) ++others;
  CHECK(others == 0);
  std::vector<double> solution;
  for (const auto& [at, x] : all) solution.push_back(x);
  return solution;
}

/// The largest difference from Eigen's solution, as a share of the largest number of that; of one
/// rank.
template <int Dim>
double error_of(SolvePatches<Dim>& body) {
  std::map<Index, int> number;
  const auto free_at = [](const Patch<Dim>& patch, Local i, int d) {
    return !(patch.system.held[static_cast<std::size_t>(i)] >> d & 1);
  };
  const auto for_each_free = [&](auto action) {
    for (int p = 0; p < body.patches.size(); ++p) {
      Patch<Dim>& patch = body.patches[p];
      for (Local i = 0; i < patch.n_nodes(); ++i)
        for (int d = 0; d < Dim; ++d)
          if (patch.node_is_active[static_cast<std::size_t>(i)] && free_at(patch, i, d))
            action(patch, i, d, patch.topology.nodes[static_cast<std::size_t>(i)] * Dim + d);
    }
  };
  for_each_free([&](auto&, Local, int, Index key) {
    number.try_emplace(key, static_cast<int>(number.size()));
  });
  const auto n = static_cast<Index>(number.size());
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(n), x = b;
  for_each_free([&](Patch<Dim>& patch, Local i, int d, Index key) {
    const auto& system = patch.system;
    const auto row = static_cast<std::size_t>(i);
    const int at = number.at(key);
    b[at] = system.right_side[row * node_width + static_cast<std::size_t>(d)];
    x[at] = system.solution[row * node_width + static_cast<std::size_t>(d)];
    for (std::size_t k = system.first[row]; k < system.first[row + 1]; ++k)
      for (int e = 0; e < Dim; ++e)
        if (free_at(patch, system.column[k], e))
          A(at, number.at(patch.topology.nodes[static_cast<std::size_t>(system.column[k])] * Dim +
                          e)) +=
              system.blocks[k * Dim * Dim + static_cast<std::size_t>(d * Dim + e)];
  });
  for (Index i = 0; i < n; ++i)
    if (A.row(i).isZero(0)) A(i, i) = 1;  // of a right side that is zero
  const Eigen::VectorXd expected = A.partialPivLu().solve(b);
  return (x - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
}

/// A solved system.
template <int Dim>
struct Solved {
  SolveResult result;
  std::vector<double> solution;
  double error = 0;  ///< of one rank
};

/// A matrix and how it is solved.
struct MethodOfMatrix {
  MatrixKind kind;
  SolveMethod method;
  Preconditioner preconditioner = Preconditioner::diagonal;
};

template <int Dim>
Solved<Dim> solve(const MethodOfMatrix& how, const ExecutorOptions& way,
                  const Communicator& ranks = {}) {
  SolvePatches<Dim> body(l_shape<Dim>(), solver_stages<Dim>(), ranks);
  assemble(body, how.kind);
  GlobalSolve<Dim> solver(body.patches, {.executor = way, .groups = body.groups.get()});
  Solved<Dim> solved;
  solved.result = solver.solve({.method = how.method, .preconditioner = how.preconditioner});
  solved.solution = solution_of(body, ranks);
  if (!ranks.several()) solved.error = error_of(body);
  return solved;
}

/// Each matrix with the methods that can solve it.
inline constexpr MethodOfMatrix methods_of_matrices[] = {
    {MatrixKind::poisson, SolveMethod::automatic},
    {MatrixKind::poisson, SolveMethod::automatic, Preconditioner::multigrid},
    {MatrixKind::elastic, SolveMethod::conjugate_gradients},
    {MatrixKind::elastic, SolveMethod::conjugate_gradients, Preconditioner::automatic},
    {MatrixKind::elastic, SolveMethod::conjugate_gradients, Preconditioner::multigrid},
    {MatrixKind::elastic, SolveMethod::bicgstab},
    {MatrixKind::elastic, SolveMethod::bicgstab, Preconditioner::multigrid},
    {MatrixKind::elastic, SolveMethod::direct},
    {MatrixKind::convective, SolveMethod::automatic},
    {MatrixKind::convective, SolveMethod::automatic, Preconditioner::multigrid},
    {MatrixKind::convective, SolveMethod::direct}};

}  // namespace lahar::test
