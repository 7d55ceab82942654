#include "io/results/free_surface.h"

#include <fmt/format.h>
#include <tsl/robin_map.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "io/base/text.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

constexpr Index most_points = 200'000'000;  ///< of a grid

/// Shares of filled space at the points of a grid around all particles.
class FilledGrid {
 public:
  FilledGrid(const Frame& frame, double spacing) : spacing_(spacing) {
    const auto& x = frame.coordinates;
    Vec<3> low = Vec<3>::Constant(HUGE_VAL), high = -low;
    for (std::size_t i = 0; i < x.size(); i += 3) {
      low = low.cwiseMin(Vec<3>(&x[i]));
      high = high.cwiseMax(Vec<3>(&x[i]));
    }
    double points = 1;
    for (int d = 0; d < 3; ++d) {
      const double n = std::floor((high[d] - low[d]) / spacing) + 4;  // a layer of zeros around all
      points *= n;
      n_[static_cast<std::size_t>(d)] = static_cast<Index>(std::min(n, 1e9));
    }
    if (!(points <= static_cast<double>(most_points))) {
      Problem problem;
      problem.message = fmt::format("the grid for the surface would have {:.3g} points", points);
      problem.hint = "choose a larger --spacing";
      throw InputError({problem});
    }
    low_ = low - Vec<3>::Constant(spacing);
    share_.assign(static_cast<std::size_t>(points), 0.0f);
    const auto& V = frame.find("volume")->values;
    for (std::size_t p = 0; p < V.size(); ++p) add(Vec<3>(&x[3 * p]), V[p]);
  }

  const std::array<Index, 3>& n() const { return n_; }
  Index number(Index i, Index j, Index k) const { return (k * n_[1] + j) * n_[0] + i; }
  double share(Index point) const { return share_[static_cast<std::size_t>(point)]; }
  Vec<3> place(Index point) const {
    const Index i = point % n_[0], j = point / n_[0] % n_[1], k = point / n_[0] / n_[1];
    return low_ + spacing_ * Vec<3>(static_cast<double>(i), static_cast<double>(j),
                                    static_cast<double>(k));
  }

 private:
  void add(const Vec<3>& x, double volume) {
    const Vec<3> at = (x - low_) / spacing_;
    std::array<Index, 3> cell;
    std::array<std::array<double, 2>, 3> weight;
    for (std::size_t d = 0; d < 3; ++d) {
      const double a = at[static_cast<int>(d)];
      cell[d] = static_cast<Index>(a);
      weight[d][1] = a - static_cast<double>(cell[d]);
      weight[d][0] = 1 - weight[d][1];
    }
    const double share = volume / (spacing_ * spacing_ * spacing_);
    for (std::size_t c = 0; c < 8; ++c) {
      const std::size_t i = c & 1, j = c >> 1 & 1, k = c >> 2;
      share_[static_cast<std::size_t>(number(cell[0] + static_cast<Index>(i),
                                             cell[1] + static_cast<Index>(j),
                                             cell[2] + static_cast<Index>(k)))] +=
          static_cast<float>(share * weight[0][i] * weight[1][j] * weight[2][k]);
    }
  }

  double spacing_;
  Vec<3> low_;
  std::array<Index, 3> n_{};
  std::vector<float> share_;
};

/// Cuts tetrahedra between points of the grid. A corner of the surface is on an edge, and is shared
/// by all triangles there.
class TetrahedraCutter {
 public:
  TetrahedraCutter(const FilledGrid& grid, double level) : grid_(grid), level_(level) {}

  void cut(std::array<Index, 4> at) {
    // Those inside come first; an even permutation keeps the orientation.
    int inside = 0;
    bool even = true;
    for (std::size_t i = 0; i < 4; ++i) {
      if (!is_inside(at[i])) continue;
      const auto to = static_cast<std::size_t>(inside++);
      if (to == i) continue;
      std::swap(at[to], at[i]);
      even = !even;
    }
    if (inside == 0 || inside == 4) return;
    const auto edge = [&](int a, int b) {
      return corner(at[static_cast<std::size_t>(a)], at[static_cast<std::size_t>(b)]);
    };
    if (inside == 1) return add(edge(0, 1), edge(0, 2), edge(0, 3), !even);
    if (inside == 3) return add(edge(3, 0), edge(3, 1), edge(3, 2), !even);
    add(edge(0, 2), edge(0, 3), edge(1, 3), !even);
    add(edge(0, 2), edge(1, 3), edge(1, 2), !even);
  }
  Triangles take() { return std::move(triangles_); }

 private:
  bool is_inside(Index point) const { return grid_.share(point) > level_; }

  Local corner(Index a, Index b) {
    const auto [low, high] = std::minmax(a, b);
    const auto [found, fresh] =
        corners_.try_emplace({low, high}, static_cast<Local>(triangles_.points.size()));
    if (fresh) {
      const double of_low = grid_.share(low), of_high = grid_.share(high);
      const double along = (level_ - of_low) / (of_high - of_low);
      triangles_.points.push_back((1 - along) * grid_.place(low) + along * grid_.place(high));
    }
    return found->second;
  }
  void add(Local a, Local b, Local c, bool turned) {
    if (turned) std::swap(b, c);
    triangles_.corners.push_back({a, b, c});
  }

  struct Hash {
    std::size_t operator()(const std::pair<Index, Index>& edge) const {
      return static_cast<std::size_t>(edge.first) * 0x9e3779b97f4a7c15u ^
             static_cast<std::size_t>(edge.second);
    }
  };
  const FilledGrid& grid_;
  double level_;
  Triangles triangles_;
  tsl::robin_map<std::pair<Index, Index>, Local, Hash> corners_;
};

}  // namespace

Triangles free_surface(const Frame& frame, FreeSurfaceOptions options) {
  if (frame.dim != 3) throw InputError("a surface of triangles needs a frame in three dimensions");
  const FrameColumn* volume = frame.find("volume");
  if (!volume) throw InputError("a surface needs the field volume, which the frame lacks");
  if (frame.size() == 0) return {};
  if (options.spacing <= 0) {
    double sum = 0;
    for (const double V : volume->values) sum += V;
    options.spacing = 2 * std::cbrt(sum / static_cast<double>(frame.size()));
  }
  const FilledGrid grid(frame, options.spacing);
  TetrahedraCutter cutter(grid, options.level);
  // The six tetrahedra around the diagonal from corner 0 to 7, each right-handed: they meet those
  // of the next cells face to face. Bits of a corner are its places along x, y, z.
  constexpr std::array<std::array<int, 4>, 6> tetrahedra = {
      {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};
  const auto& n = grid.n();
  for (Index k = 0; k + 1 < n[2]; ++k)
    for (Index j = 0; j + 1 < n[1]; ++j)
      for (Index i = 0; i + 1 < n[0]; ++i)
        for (const auto& tetrahedron : tetrahedra) {
          std::array<Index, 4> at;
          for (std::size_t c = 0; c < 4; ++c) {
            const int bits = tetrahedron[c];
            at[c] = grid.number(i + (bits & 1), j + (bits >> 1 & 1), k + (bits >> 2));
          }
          cutter.cut(at);
        }
  return cutter.take();
}

}  // namespace lahar
