#include "physics/geometry/level_surface.h"

#include <tsl/robin_map.h>

#include <algorithm>
#include <utility>

namespace lahar {

namespace {

/// Corners of the simplices around the diagonal of a cell. Bits of a corner are its places along
/// the axes. All are right-handed, and meet those of the next cells face to face.
template <int Dim>
constexpr auto simplices() {
  if constexpr (Dim == 2)
    return std::array<std::array<int, 3>, 2>{{{0, 1, 3}, {0, 3, 2}}};
  else
    return std::array<std::array<int, 4>, 6>{
        {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};
}

/// Cuts simplices between points of the grid. A corner of the surface is on an edge, and is shared
/// by all pieces there.
template <int Dim>
class SimplexCutter {
 public:
  SimplexCutter(const GridValues<Dim>& grid, double level) : grid_(grid), level_(level) {}

  void cut(std::array<Index, Dim + 1> at) {
    // Those inside come first; an even permutation keeps the orientation.
    int inside = 0;
    bool even = true;
    for (std::size_t i = 0; i < at.size(); ++i) {
      if (!is_inside(at[i])) continue;
      const auto to = static_cast<std::size_t>(inside++);
      if (to == i) continue;
      std::swap(at[to], at[i]);
      even = !even;
    }
    if (inside == 0 || inside == Dim + 1) return;
    const auto edge = [&](std::size_t a, std::size_t b) { return corner(at[a], at[b]); };
    if constexpr (Dim == 2) {
      if (inside == 1) return add({edge(0, 1), edge(0, 2)}, !even);
      add({edge(0, 2), edge(1, 2)}, even);
    } else {
      if (inside == 1) return add({edge(0, 1), edge(0, 2), edge(0, 3)}, !even);
      if (inside == 3) return add({edge(3, 0), edge(3, 1), edge(3, 2)}, !even);
      add({edge(0, 2), edge(0, 3), edge(1, 3)}, !even);
      add({edge(0, 2), edge(1, 3), edge(1, 2)}, !even);
    }
  }
  LevelSurface<Dim> take() { return std::move(surface_); }

 private:
  double value(Index point) const {
    return static_cast<double>(grid_.values[static_cast<std::size_t>(point)]);
  }
  bool is_inside(Index point) const { return value(point) > level_; }

  Local corner(Index a, Index b) {
    const auto [low, high] = std::minmax(a, b);
    const auto [found, fresh] =
        corners_.try_emplace({low, high}, static_cast<Local>(surface_.points.size()));
    if (fresh) {
      const double along = (level_ - value(low)) / (value(high) - value(low));
      surface_.points.push_back((1 - along) * grid_.place(low) + along * grid_.place(high));
    }
    return found->second;
  }
  void add(std::array<Local, Dim> corners, bool turned) {
    if (turned) std::swap(corners[Dim - 2], corners[Dim - 1]);
    surface_.corners.push_back(corners);
  }

  struct Hash {
    std::size_t operator()(const std::pair<Index, Index>& edge) const {
      return static_cast<std::size_t>(edge.first) * 0x9e3779b97f4a7c15u ^
             static_cast<std::size_t>(edge.second);
    }
  };
  const GridValues<Dim>& grid_;
  double level_;
  LevelSurface<Dim> surface_;
  tsl::robin_map<std::pair<Index, Index>, Local, Hash> corners_;
};

}  // namespace

template <int Dim>
Index GridValues<Dim>::size() const {
  Index all = 1;
  for (const Index along : n) all *= along;
  return all;
}

template <int Dim>
Vec<Dim> GridValues<Dim>::place(Index point) const {
  Vec<Dim> x = low;
  for (int d = 0; d < Dim; ++d) {
    const Index along = n[static_cast<std::size_t>(d)];
    x[d] += spacing[d] * static_cast<double>(point % along);
    point /= along;
  }
  return x;
}

template <int Dim>
LevelSurface<Dim> level_surface(const GridValues<Dim>& grid, double level) {
  SimplexCutter<Dim> cutter(grid, level);
  std::array<Index, 3> n{2, 2, 2}, stride{1, 1, 1};
  for (std::size_t d = 0; d < Dim; ++d) {
    n[d] = grid.n[d];
    if (d > 0) stride[d] = stride[d - 1] * n[d - 1];
  }
  for (Index k = 0; k + 1 < n[2]; ++k)
    for (Index j = 0; j + 1 < n[1]; ++j)
      for (Index i = 0; i + 1 < n[0]; ++i) {
        const Index first = i + j * stride[1] + (Dim == 3 ? k * stride[2] : 0);
        for (const auto& simplex : simplices<Dim>()) {
          std::array<Index, Dim + 1> at;
          for (std::size_t c = 0; c < at.size(); ++c) {
            at[c] = first;
            for (std::size_t d = 0; d < Dim; ++d)
              if (simplex[c] >> d & 1) at[c] += stride[d];
          }
          cutter.cut(at);
        }
      }
  return cutter.take();
}

template struct GridValues<2>;
template struct GridValues<3>;
template Lines level_surface<2>(const GridValues<2>&, double);
template Triangles level_surface<3>(const GridValues<3>&, double);

}  // namespace lahar
