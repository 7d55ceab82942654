// Cells and nodes of a mesh near a region.
#include <algorithm>
#include <cmath>

#include "io/scenario/regions.h"

namespace lahar {

namespace {

/// The points of a grid between two positions, both included; the first axis runs fastest.
template <int Dim>
struct GridBox {
  std::array<Index, Dim> size, from, to;

  Index points() const {
    Index n = 1;
    for (std::size_t d = 0; d < Dim; ++d) n *= std::max<Index>(to[d] - from[d] + 1, 0);
    return n;
  }
  /// Call `visit(id)` for those with numbers in [begin, end).
  void visit(Index begin, Index end, const std::function<void(Index)>& visit) const {
    if (begin >= end) return;
    std::array<Index, Dim> at = from;
    for (std::size_t d = 0, rest = static_cast<std::size_t>(begin); d < Dim; ++d) {
      const auto width = static_cast<std::size_t>(to[d] - from[d] + 1);
      at[d] += static_cast<Index>(rest % width);
      rest /= width;
    }
    for (Index left = end - begin; left > 0; --left) {
      Index id = 0;
      for (std::size_t d = Dim; d-- > 0;) id = id * size[d] + at[d];
      visit(id);
      for (std::size_t d = 0; d < Dim && ++at[d] > to[d]; ++d) at[d] = from[d];
    }
  }
};

/// Cells (`extra` 0) or nodes (1) of a structured mesh in a box widened by a cell against rounding.
template <int Dim>
GridBox<Dim> grid_near(const Mesh<Dim>& mesh, const std::pair<Vec<Dim>, Vec<Dim>>& box,
                       Index extra) {
  GridBox<Dim> grid{mesh.counts(), {}, {}};
  const Vec<Dim> low = (box.first - mesh.origin()).cwiseQuotient(mesh.spacing());
  const Vec<Dim> high = (box.second - mesh.origin()).cwiseQuotient(mesh.spacing());
  for (int d = 0; d < Dim; ++d) {
    const auto k = static_cast<std::size_t>(d);
    grid.size[k] += extra;
    const auto last = static_cast<double>(grid.size[k] - 1);
    grid.from[k] = static_cast<Index>(std::clamp(std::floor(low[d]) - 1, 0.0, last + 1));
    grid.to[k] = static_cast<Index>(std::clamp(std::floor(high[d]) + 1, -1.0, last));
  }
  return grid;
}

}  // namespace

template <int Dim>
CellsNear<Dim>::CellsNear(const Mesh<Dim>& mesh, const Region<Dim>& region)
    : grid_(mesh.is_structured()), size_(mesh.n_cells()) {
  if (!grid_) return;
  const GridBox<Dim> grid = grid_near<Dim>(mesh, region.bounds(), 0);
  counts_ = grid.size;
  low_ = grid.from;
  high_ = grid.to;
  size_ = grid.points();
}

template <int Dim>
void CellsNear<Dim>::visit(Index begin, Index end, const std::function<void(Index)>& visit) const {
  if (grid_) return GridBox<Dim>{counts_, low_, high_}.visit(begin, end, visit);
  for (Index cell = begin; cell < end; ++cell) visit(cell);
}

template <int Dim>
void for_cells_near(const Mesh<Dim>& mesh, const Region<Dim>& region,
                    const std::function<void(Index)>& visit) {
  const CellsNear<Dim> cells(mesh, region);
  cells.visit(0, cells.size(), visit);
}

template <int Dim>
void for_nodes_near(const Mesh<Dim>& mesh, const Region<Dim>& region,
                    const std::function<void(Index)>& visit) {
  if (mesh.is_structured()) {
    const GridBox<Dim> grid = grid_near<Dim>(mesh, region.bounds(), 1);
    return grid.visit(0, grid.points(), visit);
  }
  for (Index node = 0; node < mesh.n_nodes(); ++node) visit(node);
}

#define LAHAR_INSTANTIATE(Dim)                                            \
  template class CellsNear<Dim>;                                          \
  template void for_cells_near<Dim>(const Mesh<Dim>&, const Region<Dim>&, \
                                    const std::function<void(Index)>&);   \
  template void for_nodes_near<Dim>(const Mesh<Dim>&, const Region<Dim>&, \
                                    const std::function<void(Index)>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
