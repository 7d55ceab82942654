/// \file A grid of boxes as tables of any element. Nodes lie on a lattice of half the boxes' edges.
#include "physics/element_grid.h"

#include <algorithm>
#include <cmath>
#include <numeric>

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

}  // namespace

template <int Dim>
ElementTables<Dim> element_grid(Element element, const Vec<Dim>& origin, const Vec<Dim>& cell_size,
                                const std::array<Index, Dim>& counts) {
  const auto pattern = cells_of_box<Dim>(element);
  Place<Dim> lattice;
  Index places = 1, boxes = 1;
  for (std::size_t d = 0; d < Dim; ++d) {
    lattice[d] = 2 * counts[d] + 1;
    places *= lattice[d];
    boxes *= counts[d];
  }
  ElementTables<Dim> tables{element, {}, {}};
  std::vector<Index> number(static_cast<std::size_t>(places), -1);
  tables.cells.reserve(static_cast<std::size_t>(boxes) * pattern.size() * pattern[0].size());
  for (Index box = 0; box < boxes; ++box)
    for (const auto& cell : pattern)
      for (const auto& place : cell) {
        Index id = 0, stride = 1, rest = box;
        for (std::size_t d = 0; d < Dim; ++d) {
          id += stride * (2 * (rest % counts[d]) + place[d]);
          rest /= counts[d];
          stride *= lattice[d];
        }
        number[static_cast<std::size_t>(id)] = 0;
        tables.cells.push_back(id);
      }
  for (Index id = 0; id < places; ++id) {
    if (number[static_cast<std::size_t>(id)] < 0) continue;
    number[static_cast<std::size_t>(id)] = static_cast<Index>(tables.nodes.size());
    Vec<Dim>& x = tables.nodes.emplace_back();
    Index rest = id;
    for (std::size_t d = 0; d < Dim; ++d) {
      const auto k = static_cast<Eigen::Index>(d);
      // As in a structured mesh: one rounding.
      x[k] = std::fma(0.5 * static_cast<double>(rest % lattice[d]), cell_size[k], origin[k]);
      rest /= lattice[d];
    }
  }
  for (Index& node : tables.cells) node = number[static_cast<std::size_t>(node)];
  return tables;
}

template ElementTables<2> element_grid<2>(Element, const Vec<2>&, const Vec<2>&,
                                          const std::array<Index, 2>&);
template ElementTables<3> element_grid<3>(Element, const Vec<3>&, const Vec<3>&,
                                          const std::array<Index, 3>&);

}  // namespace lahar
