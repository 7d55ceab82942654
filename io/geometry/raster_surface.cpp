#include <cmath>

#include "io/geometry/map_files.h"

namespace lahar {

namespace {

/// Straight on from `b` by `share` of the distance from `a` to it; as `b` where `a` is not known.
float beyond(float a, float b, double share) {
  return std::isnan(a) ? b : static_cast<float>(b + share * (static_cast<double>(b) - a));
}

/// Coordinates of points, with one more at each end: the edges of the cells.
std::vector<double> axis_of(Index n, double first, double spacing, double low, double high,
                            double origin) {
  std::vector<double> x{low - origin};
  for (Index i = 0; i < n; ++i) x.push_back(first + static_cast<double>(i) * spacing - origin);
  x.push_back(high - origin);
  return x;
}

}  // namespace

Surface<3> surface_of(const Raster::Part& part, std::vector<float> heights, const Vec<2>& origin) {
  const auto columns = static_cast<std::size_t>(part.columns);
  const auto rows = static_cast<std::size_t>(part.rows), wide = columns + 2;
  Surface<3>::Axes axes;
  for (int d = 0; d < 2; ++d)
    axes[static_cast<std::size_t>(d)] =
        axis_of(d == 0 ? part.columns : part.rows, part.first[d], part.spacing[d],
                part.bounds.first[d], part.bounds.second[d], origin[d]);
  std::vector<float> all(wide * (rows + 2));
  // Fills the ends of a line of `n` points that begins at `line`, `step` apart.
  const auto fill_ends = [&](std::size_t line, std::size_t n, std::size_t step,
                             const std::vector<double>& axis) {
    float* const p = all.data() + line;
    const auto share = [&](std::size_t from, std::size_t to, std::size_t before) {
      return n < 2 ? 0 : (axis[to] - axis[from]) / (axis[from] - axis[before]);
    };
    p[0] = n < 2 ? p[step] : beyond(p[2 * step], p[step], share(1, 0, 2));
    p[(n + 1) * step] =
        n < 2 ? p[n * step] : beyond(p[(n - 1) * step], p[n * step], share(n, n + 1, n - 1));
  };
  for (std::size_t j = 0; j < rows; ++j) {
    std::copy_n(heights.begin() + static_cast<std::ptrdiff_t>(j * columns), columns,
                all.begin() + static_cast<std::ptrdiff_t>((j + 1) * wide + 1));
    fill_ends((j + 1) * wide, columns, 1, axes[0]);
  }
  heights = {};
  for (std::size_t i = 0; i < wide; ++i) fill_ends(i, rows, wide, axes[1]);
  return {std::move(axes), std::move(all)};
}

}  // namespace lahar
