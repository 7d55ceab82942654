/// \file The linear system of an implicit step, as a patch has it: rows and columns are its nodes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "physics/base/node_vector.h"
#include "physics/base/types.h"
#include "physics/particles/solver_vectors.h"

namespace lahar {

/// A x = b with Dim unknowns per node, or with one. A is the sum of what all patches have of it,
/// each from its own particles. Vectors are complete: all copies of a node have the same bits.
template <int Dim>
struct NodalSystem {
  static constexpr int block_size = Dim * Dim;  ///< with Dim unknowns per node

  bool is_scalar =
      false;  ///< one unknown per node: a block is a number, lanes other than 0 are zero
  std::vector<std::size_t>
      first;                   ///< by local node, and one more: its blocks [first[i], first[i + 1])
  std::vector<Local> column;   ///< by block: local node, ascending within a row
  std::vector<double> blocks;  ///< row by row: this patch's part of A
  std::vector<float> rough_blocks;  ///< the same, for the smoothing of a multigrid cycle
  /// By local node, bit d: the unknown is given. Its solution is zero, whatever A and b say. So are
  /// those of nodes that no particle touches.
  std::vector<std::uint8_t> held;
  /// Nodes whose unknowns, rows and columns are along axes of their own, ascending.
  struct TurnedNode {
    Local node;
    Eigen::Matrix<double, Dim, Dim> axes;  ///< as columns
  };
  std::vector<TurnedNode> turned;
  NodeArray right_side;   ///< {b, 0}
  NodeArray solution;     ///< {x, 0}
  bool symmetric = true;  ///< A is, on all patches
  SolverVectors solver;   ///< what an iterative solver keeps

  int width() const { return is_scalar ? 1 : Dim; }  ///< unknowns per node
};

}  // namespace lahar
