/// \file Nodes of a coarse lattice, for multigrid cycles: multilinear functions of its boxes at the
/// nodes of a patch, restriction, prolongation, and the matrix of the coarse nodes.
///
/// The lattice knows nothing of the mesh's cells, so that it serves meshes of any elements. Its
/// functions hold rigid motions and uniform strains, whatever part of a box is filled. The matrix
/// of coarse nodes is P^T A P with the functions P (Galerkin; U. Trottenberg, C. Oosterlee,
/// A. Schueller, "Multigrid", 2001, section 2.3).
#pragma once

#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "physics/particles/patch.h"

namespace lahar {

/// Boxes in rows, columns and layers.
template <int Dim>
struct Lattice {
  using Place = std::array<int, Dim>;

  Vec<Dim> origin = Vec<Dim>::Zero();   ///< [m]
  Vec<Dim> spacing = Vec<Dim>::Ones();  ///< [m]
  std::array<Index, Dim> boxes{};       ///< along each axis

  /// The box of a point within the lattice.
  Place box_of(const Vec<Dim>& point) const {
    Place box;
    for (std::size_t d = 0; d < Dim; ++d) {
      const int a = static_cast<int>(d);
      const double at = (point[a] - origin[a]) / spacing[a];
      box[d] = static_cast<int>(std::clamp<Index>(static_cast<Index>(at), 0, boxes[d] - 1));
    }
    return box;
  }
  /// Number of a lattice node.
  Index number(const Place& node) const {
    Index number = 0;
    for (std::size_t d = Dim; d-- > 0;) number = number * (boxes[d] + 1) + node[d];
    return number;
  }
  Place place(Index number) const {
    Place node;
    for (std::size_t d = 0; d < Dim; ++d) {
      node[d] = static_cast<int>(number % (boxes[d] + 1));
      number /= boxes[d] + 1;
    }
    return node;
  }
};

/// A block of the matrix of coarse nodes, as one patch has it.
template <int Dim>
struct CoarseBlock {
  Index row, column;  ///< Lattice::number()
  Index patch;
  std::array<double, static_cast<std::size_t>(Dim* Dim)> values;  ///< row by row
};

/// Where the nodes of a patch, and its coarse nodes, lie on the lattice.
template <int Dim>
struct CoarsePlaces {
  std::vector<typename Lattice<Dim>::Place> box;  ///< by local node with a free unknown
  /// Lattice::number() by coarse node of the patch; -1 where no free unknown depends on it.
  std::vector<Index> numbers;
};

/// Sets Patch::system.solver.coarse but for the numbers among all coarse nodes. False where the
/// lattice is far too fine for the patch.
template <int Dim>
bool place_on_lattice(Patch<Dim>& patch, const Mesh<Dim>& mesh, const Lattice<Dim>& lattice,
                      CoarsePlaces<Dim>& places);

/// The patch's part of the matrix of coarse nodes, after place_on_lattice(). Unknowns without an
/// entry in SolverVectors::inverse are left out. False where nodes that share a block are too many
/// boxes apart.
template <int Dim>
bool add_coarse_blocks(const Patch<Dim>& patch, const CoarsePlaces<Dim>& places,
                       const Lattice<Dim>& lattice, std::vector<CoarseBlock<Dim>>& blocks);

/// CoarseNodes::sums = P^T t, of the nodes that this patch counts.
template <int Dim>
void restrict_residual(Patch<Dim>& patch);

/// d = P of_coarse_nodes.
template <int Dim>
void prolong(Patch<Dim>& patch, const double* of_coarse_nodes);

/// Rows of blocks that are added up from finer ones; columns lie around the row within a reach.
template <int Width, int Dim>
class CoarseRows {
 public:
  using Place = typename Lattice<Dim>::Place;
  static constexpr std::size_t block_size = Width * Width;

  /// `farthest`: how many boxes apart two nodes may be that share a block of the finer matrix.
  CoarseRows(std::size_t rows, int farthest)
      : farthest_(farthest), columns_(power(2 * (farthest + 1) + 1)) {
    blocks_.assign(rows * columns_ * block_size, 0.0);
    const std::size_t near = power(2 * farthest + 2);
    half_.assign(near * block_size, 0.0);
    is_touched_.assign(near, 0);
  }

  /// Begin with a row of the finer matrix; its node lies in `box`.
  void begin_row(const Place& box) { box_ = box; }
  /// Add a block of that row, of a column's node in another box with these functions.
  void add(const double* block, const Place& box, const double* weights) {
    Place from;
    for (std::size_t d = 0; d < Dim; ++d) from[d] = box[d] - box_[d] + farthest_;
    for (int c = 0; c < corners<Dim>; ++c) {
      if (weights[c] == 0) continue;
      std::size_t at = 0;
      for (std::size_t d = Dim; d-- > 0;)
        at = at * static_cast<std::size_t>(2 * farthest_ + 2) +
             static_cast<std::size_t>(from[d] + (c >> d & 1));
      if (!is_touched_[at]) touched_.push_back(at);
      is_touched_[at] = 1;
      for (std::size_t k = 0; k < block_size; ++k)
        half_[at * block_size + k] += weights[c] * block[k];
    }
  }
  /// Give the row to the coarse nodes at the corners of its box: row_of(corner), its functions.
  template <class RowOf>
  void end_row(RowOf row_of, const double* weights) {
    for (const std::size_t at : touched_) {
      Place offset;
      std::size_t rest = at;
      for (std::size_t d = 0; d < Dim; ++d) {
        offset[d] = static_cast<int>(rest % static_cast<std::size_t>(2 * farthest_ + 2));
        rest /= static_cast<std::size_t>(2 * farthest_ + 2);
      }
      double* const half = &half_[at * block_size];
      for (int c = 0; c < corners<Dim>; ++c) {
        if (weights[c] == 0) continue;
        std::size_t column = 0;
        for (std::size_t d = Dim; d-- > 0;)
          column = column * static_cast<std::size_t>(2 * farthest_ + 3) +
                   static_cast<std::size_t>(offset[d] - (c >> d & 1) + 1);
        double* const to =
            &blocks_[(static_cast<std::size_t>(row_of(c)) * columns_ + column) * block_size];
        for (std::size_t k = 0; k < block_size; ++k) to[k] += weights[c] * half[k];
      }
      std::fill_n(half, block_size, 0.0);
      is_touched_[at] = 0;
    }
    touched_.clear();
  }

  /// Call body(place of the column, block) for the blocks of a row, at its place, that are not
  /// zero, in ascending order of places.
  template <class Body>
  void for_each_block(std::size_t row, const Place& place, Body body) const {
    for (std::size_t column = 0; column < columns_; ++column) {
      const double* const block = &blocks_[(row * columns_ + column) * block_size];
      if (std::all_of(block, block + block_size, [](double value) { return value == 0; })) continue;
      Place of;
      std::size_t rest = column;
      for (std::size_t d = 0; d < Dim; ++d) {
        of[d] = place[d] + static_cast<int>(rest % static_cast<std::size_t>(2 * farthest_ + 3)) -
                farthest_ - 1;
        rest /= static_cast<std::size_t>(2 * farthest_ + 3);
      }
      body(of, block);
    }
  }

 private:
  static std::size_t power(int base) {
    std::size_t all = 1;
    for (int d = 0; d < Dim; ++d) all *= static_cast<std::size_t>(base);
    return all;
  }

  int farthest_;
  std::size_t columns_;  ///< of a row
  std::vector<double> blocks_;
  Place box_{};
  std::vector<double> half_;  ///< A P of the row that has begun
  std::vector<char> is_touched_;
  std::vector<std::size_t> touched_;
};

}  // namespace lahar
