/// \file A grid of boxes as tables of any element. Nodes lie on a lattice of half the boxes' edges.
#include "physics/mesh/element_grid.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace lahar {
namespace {

template <int Dim>
using Place = std::array<Index, Dim>;

/// Places of the nodes of the cells in one box, relative to its lowest corner.
template <int Dim>
std::vector<std::vector<Place<Dim>>> cells_of_box(Element element) {
  const int n = info(element).nodes;
  std::vector<std::vector<Place<Dim>>> cells;
  const auto add = [&](auto&& place_of) {
    auto& cell = cells.emplace_back(static_cast<std::size_t>(n));
    for (int a = 0; a < n; ++a) cell[static_cast<std::size_t>(a)] = place_of(a);
  };
  if (!info(element).simplex) {
    add([&](int a) {
      Place<Dim> place;
      for (std::size_t d = 0; d < Dim; ++d) place[d] = detail::node_place(element, a)[d] + 1;
      return place;
    });
    return cells;
  }
  // Walks along the axes, in every order, from the lowest corner to the highest: their corners are
  // those of a simplex, inside out for odd orders.
  std::array<int, Dim> order;
  std::iota(order.begin(), order.end(), 0);
  do {
    std::array<Place<Dim>, Dim + 1> corner{};
    for (std::size_t k = 0; k < Dim; ++k) {
      corner[k + 1] = corner[k];
      corner[k + 1][static_cast<std::size_t>(order[k])] = 2;
    }
    int inversions = 0;
    for (std::size_t i = 0; i < Dim; ++i)
      for (std::size_t j = i + 1; j < Dim; ++j) inversions += order[i] > order[j];
    if (inversions % 2 == 1) std::swap(corner[Dim - 1], corner[Dim]);
    add([&](int a) {
      // Barycentric coordinates of the node, doubled, times the corners, halved.
      const auto& b = detail::node_place(element, a);
      int rest = 2;
      for (std::size_t d = 0; d < Dim; ++d) rest -= b[d];
      Place<Dim> place;
      for (std::size_t d = 0; d < Dim; ++d) {
        place[d] = rest * corner[0][d];
        for (std::size_t k = 0; k < Dim; ++k) place[d] += b[k] * corner[k + 1][d];
        place[d] /= 2;
      }
      return place;
    });
  } while (std::next_permutation(order.begin(), order.end()));
  return cells;
}

/// Numbers of the places of a lattice that have nodes, the first axis fastest. Which have them
/// depends only on where along each axis they are even and odd: all boxes are alike.
template <int Dim>
class LatticeNodes {
 public:
  LatticeNodes(const std::vector<std::vector<Place<Dim>>>& pattern,
               const std::array<Index, Dim>& counts) {
    std::array<Index, std::size_t{1} << Dim> used{};
    for (const auto& cell : pattern)
      for (const auto& place : cell) {
        unsigned odd = 0;
        for (std::size_t d = 0; d < Dim; ++d) odd |= static_cast<unsigned>(place[d] & 1) << d;
        used[odd] = 1;
      }
    below_[0] = used;
    for (std::size_t d = 0; d < Dim; ++d)
      for (unsigned odd = 0; odd < used.size(); ++odd)
        below_[d + 1][odd] = of_first(2 * counts[d] + 1, d, odd & ~(1u << d));
  }

  Index size() const { return below_[Dim][0]; }
  Index number(const Place<Dim>& place) const {
    Index number = 0;
    unsigned odd = 0;
    for (std::size_t d = Dim; d-- > 0;) {
      number += of_first(place[d], d, odd);
      odd |= static_cast<unsigned>(place[d] & 1) << d;
    }
    return number;
  }
  Place<Dim> place(Index number) const {
    Place<Dim> place;
    unsigned odd = 0;
    for (std::size_t d = Dim; d-- > 0;) {
      const Index even = below_[d][odd], both = even + below_[d][odd | 1u << d];
      place[d] = number / both * 2;
      number %= both;
      if (number < even) continue;
      number -= even;
      ++place[d];
      odd |= 1u << d;
    }
    return place;
  }

 private:
  /// Nodes at the first k places along axis d, where those along higher axes are odd as in `odd`.
  Index of_first(Index k, std::size_t d, unsigned odd) const {
    return (k + 1) / 2 * below_[d][odd] + k / 2 * below_[d][odd | 1u << d];
  }
  /// [d]: in all of the axes below d, by what the others are.
  std::array<std::array<Index, std::size_t{1} << Dim>, Dim + 1> below_{};
};

}  // namespace

template <int Dim>
ElementGrid<Dim>::ElementGrid(Element element, const std::array<Index, Dim>& counts) {
  const auto pattern = cells_of_box<Dim>(element);
  n_nodes = LatticeNodes<Dim>(pattern, counts).size();
  n_cells = static_cast<Index>(pattern.size());
  for (const Index n : counts) n_cells *= n;
}

template <int Dim>
ElementTables<Dim> element_grid_part(Element element, const Vec<Dim>& origin,
                                     const Vec<Dim>& cell_size,
                                     const std::array<Index, Dim>& counts,
                                     std::pair<Index, Index> nodes, std::pair<Index, Index> cells) {
  const auto pattern = cells_of_box<Dim>(element);
  const LatticeNodes<Dim> lattice(pattern, counts);
  ElementTables<Dim> tables{element, {}, {}};
  tables.nodes.reserve(static_cast<std::size_t>(nodes.second - nodes.first));
  for (Index node = nodes.first; node < nodes.second; ++node) {
    const Place<Dim> place = lattice.place(node);
    Vec<Dim>& x = tables.nodes.emplace_back();
    for (int d = 0; d < Dim; ++d)
      // As in a structured mesh: one rounding.
      x[d] = std::fma(0.5 * static_cast<double>(place[static_cast<std::size_t>(d)]), cell_size[d],
                      origin[d]);
  }
  const auto per_box = static_cast<Index>(pattern.size());
  tables.cells.reserve(static_cast<std::size_t>(cells.second - cells.first) * pattern[0].size());
  for (Index cell = cells.first; cell < cells.second; ++cell)
    for (Place<Dim> place : pattern[static_cast<std::size_t>(cell % per_box)]) {
      Index rest = cell / per_box;
      for (std::size_t d = 0; d < Dim; ++d) {
        place[d] += 2 * (rest % counts[d]);
        rest /= counts[d];
      }
      tables.cells.push_back(lattice.number(place));
    }
  return tables;
}

template <int Dim>
ElementTables<Dim> element_grid(Element element, const Vec<Dim>& origin, const Vec<Dim>& cell_size,
                                const std::array<Index, Dim>& counts) {
  const ElementGrid<Dim> grid(element, counts);
  return element_grid_part<Dim>(element, origin, cell_size, counts, {0, grid.n_nodes},
                                {0, grid.n_cells});
}

#define LAHAR_INSTANTIATE(Dim)                                                             \
  template struct ElementGrid<Dim>;                                                        \
  template ElementTables<Dim> element_grid<Dim>(Element, const Vec<Dim>&, const Vec<Dim>&, \
                                                const std::array<Index, Dim>&);            \
  template ElementTables<Dim> element_grid_part<Dim>(                                      \
      Element, const Vec<Dim>&, const Vec<Dim>&, const std::array<Index, Dim>&,            \
      std::pair<Index, Index>, std::pair<Index, Index>);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
