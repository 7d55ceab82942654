#include "io/results/free_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "io/base/text.h"
#include "physics/base/error.h"
#include "physics/geometry/level_surface.h"

namespace lahar {

namespace {

constexpr Index most_points = 200'000'000;  ///< of a grid

/// The grid around all particles, with zeros at its edges.
GridValues<3> grid_around(const Frame& frame, double spacing) {
  const auto& x = frame.coordinates;
  Vec<3> low = Vec<3>::Constant(HUGE_VAL), high = -low;
  for (std::size_t i = 0; i < x.size(); i += 3) {
    low = low.cwiseMin(Vec<3>(&x[i]));
    high = high.cwiseMax(Vec<3>(&x[i]));
  }
  GridValues<3> grid{.low = low - Vec<3>::Constant(spacing),
                     .spacing = Vec<3>::Constant(spacing),
                     .n = {},
                     .values = {}};
  double points = 1;
  for (int d = 0; d < 3; ++d) {
    const double n = std::floor((high[d] - low[d]) / spacing) + 4;  // a layer of zeros around all
    points *= n;
    grid.n[static_cast<std::size_t>(d)] = static_cast<Index>(std::min(n, 1e9));
  }
  if (!(points <= static_cast<double>(most_points))) {
    Problem problem;
    problem.message = fmt::format("the grid for the surface would have {:.3g} points", points);
    problem.hint = "choose a larger --spacing";
    throw InputError({problem});
  }
  grid.values.assign(static_cast<std::size_t>(points), 0.0f);
  return grid;
}

/// Add the share of space that a particle fills.
void add(GridValues<3>& grid, const Vec<3>& x, double volume) {
  const Vec<3> at = (x - grid.low).cwiseQuotient(grid.spacing);
  Index first = 0, stride = 1;
  std::array<Index, 3> step;
  std::array<std::array<double, 2>, 3> weight;
  for (std::size_t d = 0; d < 3; ++d) {
    const double a = at[static_cast<int>(d)];
    const auto cell = static_cast<Index>(a);
    weight[d][1] = a - static_cast<double>(cell);
    weight[d][0] = 1 - weight[d][1];
    step[d] = stride;
    first += cell * stride;
    stride *= grid.n[d];
  }
  const double share = volume / grid.spacing.prod();
  for (std::size_t c = 0; c < 8; ++c) {
    const std::size_t i = c & 1, j = c >> 1 & 1, k = c >> 2;
    const Index point = first + static_cast<Index>(i) * step[0] + static_cast<Index>(j) * step[1] +
                        static_cast<Index>(k) * step[2];
    grid.values[static_cast<std::size_t>(point)] +=
        static_cast<float>(share * weight[0][i] * weight[1][j] * weight[2][k]);
  }
}

}  // namespace

SurfaceSpacings surface_spacings(const Frame& frame) {
  const FrameColumn* volume = frame.find("volume");
  if (!volume || volume->values.empty()) return {};
  double sum = 0;
  for (const double V : volume->values) sum += V;
  const double distance = std::cbrt(sum / static_cast<double>(volume->values.size()));
  return {.finest = 1.3 * distance, .usual = 2 * distance};
}

Triangles free_surface(const Frame& frame, FreeSurfaceOptions options) {
  if (frame.dim != 3) throw InputError("a surface of triangles needs a frame in three dimensions");
  const FrameColumn* volume = frame.find("volume");
  if (!volume) throw InputError("a surface needs the field volume, which the frame lacks");
  if (frame.size() == 0) return {};
  if (options.spacing <= 0) options.spacing = surface_spacings(frame).usual;
  GridValues<3> grid = grid_around(frame, options.spacing);
  for (std::size_t p = 0; p < volume->values.size(); ++p)
    add(grid, Vec<3>(&frame.coordinates[3 * p]), volume->values[p]);
  return level_surface(grid, options.level);
}

}  // namespace lahar
