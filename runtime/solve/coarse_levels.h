/// \file A multigrid cycle on the coarse nodes: a matrix that every rank has.
#pragma once

#include <Eigen/LU>
#include <vector>

#include "physics/base/node_vector.h"
#include "physics/kernels/coarse_nodes.h"

namespace lahar {

/// V-cycles over lattices, each with twice the spacing of the finer one. Smoothing is a Gauss and
/// Seidel's sweep forwards before, and backwards after the coarser lattice, so that the cycle is a
/// symmetric operator where the matrix is. The coarsest is solved directly. Nothing is allocated in
/// a cycle.
template <int Dim>
class CoarseLevels {
 public:
  /// A matrix of blocks of width^2 numbers, of nodes in ascending order. Blocks of one place are
  /// next to each other and are added in the order in which they are given.
  CoarseLevels(const std::vector<Index>& nodes, const std::vector<CoarseBlock<Dim>>& blocks,
               const Lattice<Dim>& lattice, int width);

  /// Approximately solve for right_side(), from zero: the solution is in solution().
  void cycle() { cycle(0); }
  /// node_width apart, as the nodes; lanes beyond the width are zero.
  NodeArray& right_side() { return levels_.front().right_side; }
  const NodeArray& solution() const { return levels_.front().solution; }
  int levels() const { return static_cast<int>(levels_.size()); }

 private:
  using Place = typename Lattice<Dim>::Place;
  static constexpr auto n_corners = static_cast<std::size_t>(corners<Dim>);
  struct Level {
    std::vector<Place> place;  ///< of the nodes
    std::vector<std::size_t> first;
    std::vector<Local> column;
    std::vector<double> blocks;
    NodeArray right_side, solution, residual;
    // To the next level.
    std::vector<Place> box;
    std::vector<double> weights;
    std::vector<Local> parents;  ///< n_corners per node; -1 = its weight is zero
    std::size_t nodes() const { return place.size(); }
  };
  template <int Width>
  void add_level();
  void keep_matrix(const Level& level);
  void cycle(std::size_t level);
  void smooth(Level& level, bool forwards) const;
  void find_residual(Level& level) const;
  void solve_coarsest();

  int width_;
  std::vector<Level> levels_;
  Eigen::PartialPivLU<Eigen::MatrixXd> coarsest_;
  Eigen::VectorXd rhs_, x_;
};

extern template class CoarseLevels<2>;
extern template class CoarseLevels<3>;

}  // namespace lahar
