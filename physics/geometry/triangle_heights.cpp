#include "physics/geometry/triangle_heights.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lahar {

namespace {

/// Triangles whose normal has less of the vertical than this are vertical [-].
constexpr double vertical = 1e-6;
/// Points so near to a triangle [-, barycentric] belong to it.
constexpr double border = 1e-9;
/// Heights of two triangles at one place differ by less than this share of the whole [-].
constexpr double same_height = 1e-6;

using Box = std::pair<Vec<3>, Vec<3>>;

Box box_of(const Triangles& triangles) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  Box box{Vec<3>::Constant(inf), Vec<3>::Constant(-inf)};
  for (const auto& corner : triangles.corners)
    for (const Local c : corner) {
      const Vec<3>& x = triangles.points[static_cast<std::size_t>(c)];
      box = {box.first.cwiseMin(x), box.second.cwiseMax(x)};
    }
  return box;
}

/// The grid while it is filled.
class HeightGrid {
 public:
  HeightGrid(const Triangles& triangles, double spacing) : box_(box_of(triangles)) {
    const auto counts = grid_counts(triangles, spacing);
    for (int d = 0; d < 2; ++d) {
      const auto axis = static_cast<std::size_t>(d);
      counts_[axis] = counts[axis];
      steps_[d] = (box_.second[d] - box_.first[d]) / static_cast<double>(counts[axis] - 1);
    }
    tolerance_ = same_height * (box_.second - box_.first).maxCoeff();
    heights_.assign(static_cast<std::size_t>(counts[0] * counts[1]),
                    std::numeric_limits<float>::quiet_NaN());
  }

  /// Sets the heights at points below or above a triangle that is not vertical.
  void add(const Triangles& triangles, Index triangle, TriangleFlaw& double_points) {
    const Vec<3>&a = triangles.point(triangle, 0), b = triangles.point(triangle, 1),
          c = triangles.point(triangle, 2);
    const Vec<3> low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
    const Vec<3> normal = triangles.area_vector(triangle);
    const auto first = [&](int d) {
      const double i = std::ceil((low[d] - box_.first[d]) / steps_[d] - border);
      return std::max(static_cast<Index>(i), Index{0});
    };
    const auto last = [&](int d) {
      const double i = std::floor((high[d] - box_.first[d]) / steps_[d] + border);
      return std::min(static_cast<Index>(i), counts_[static_cast<std::size_t>(d)] - 1);
    };
    const auto share = [&](const Vec<3>& p, const Vec<3>& q, const Vec<3>& x) {
      return ((q.x() - p.x()) * (x.y() - p.y()) - (q.y() - p.y()) * (x.x() - p.x())) / normal.z();
    };
    for (Index j = first(1); j <= last(1); ++j)
      for (Index i = first(0); i <= last(0); ++i) {
        const Vec<3> x(coordinate(0, i), coordinate(1, j), 0);
        const double of_c = share(a, b, x), of_a = share(b, c, x), of_b = share(c, a, x);
        if (std::min({of_a, of_b, of_c}) < -border) continue;
        const double z = of_a * a.z() + of_b * b.z() + of_c * c.z();
        float& height = heights_[static_cast<std::size_t>(i + counts_[0] * j)];
        if (std::isnan(height))
          height = static_cast<float>(z);
        else if (std::abs(static_cast<double>(height) - z) > tolerance_)
          double_points.add(triangle, {x.x(), x.y(), z});
      }
  }

  Surface<3> surface() {
    Surface<3>::Axes axes;
    for (std::size_t d = 0; d < 2; ++d)
      for (Index i = 0; i < counts_[d]; ++i) axes[d].push_back(coordinate(static_cast<int>(d), i));
    return {std::move(axes), std::move(heights_)};
  }

 private:
  double coordinate(int d, Index i) const {
    if (i + 1 == counts_[static_cast<std::size_t>(d)]) return box_.second[d];
    return box_.first[d] + static_cast<double>(i) * steps_[d];
  }
  Box box_;
  std::array<Index, 2> counts_;
  double steps_[2], tolerance_;
  std::vector<float> heights_;
};

/// Edges across which the surface turns back: seen from above, both triangles lie on one side.
TriangleFlaw find_folds(const Triangles& triangles) {
  TriangleFlaw folded;
  const auto neighbour = edges_of(triangles).neighbour;
  for (std::size_t i = 0; i < neighbour.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const Local j = neighbour[i][k];
      if (j <= static_cast<Local>(i)) continue;
      const auto& mine = triangles.corners[i];
      const auto& other = triangles.corners[static_cast<std::size_t>(j)];
      // The other has the edge in the opposite direction where both show the same side.
      const auto at = std::find(other.begin(), other.end(), mine[k]) - other.begin();
      const bool alike = other[static_cast<std::size_t>((at + 2) % 3)] == mine[(k + 1) % 3];
      const bool up = triangles.area_vector(static_cast<Index>(i)).z() > 0;
      if ((up == (triangles.area_vector(j).z() > 0)) != alike)
        folded.add(static_cast<Index>(i),
                   0.5 * (triangles.points[static_cast<std::size_t>(mine[k])] +
                          triangles.points[static_cast<std::size_t>(mine[(k + 1) % 3])]));
    }
  return folded;
}

}  // namespace

double spacing_for(const Triangles& triangles) {
  constexpr double points_along = 500;
  const auto [low, high] = box_of(triangles);
  double doubled = 0;
  for (Index i = 0; i < static_cast<Index>(triangles.corners.size()); ++i)
    doubled += std::abs(triangles.area_vector(i).z());
  return std::min(std::sqrt(doubled / static_cast<double>(triangles.corners.size())),
                  std::max(high.x() - low.x(), high.y() - low.y()) / points_along);
}

std::array<Index, 2> grid_counts(const Triangles& triangles, double spacing) {
  const auto [low, high] = box_of(triangles);
  const auto count = [&](int d) {
    return static_cast<Index>(std::max(std::ceil((high[d] - low[d]) / spacing - border), 1.0)) + 1;
  };
  return {count(0), count(1)};
}

TriangleHeights triangle_heights(const Triangles& triangles, double spacing) {
  TriangleHeights out;
  HeightGrid grid(triangles, spacing);
  for (Index i = 0; i < static_cast<Index>(triangles.corners.size()); ++i) {
    const Vec<3> normal = triangles.area_vector(i);
    if (std::abs(normal.z()) <= vertical * normal.norm())
      out.steep.add(i, triangles.centre(i));
    else
      grid.add(triangles, i, out.double_points);
  }
  out.folded = find_folds(triangles);
  out.surface = grid.surface();
  return out;
}

}  // namespace lahar
