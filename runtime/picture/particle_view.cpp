#include "runtime/picture/particle_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "physics/base/error.h"

namespace lahar {

namespace {

/// Directions of the view from the side and above: the eye is in front, on the right.
constexpr double turned = -35, raised = 28;  // [degrees]
/// Squares are drawn on larger ones, so that the background does not shine through where a body is
/// stretched, or its particles are further apart along one axis.
constexpr double underlay = 1.5;
constexpr double disc_radius = 0.75;   ///< of an edge: discs of a cubic lattice leave no gaps
constexpr double half_section = 0.55;  ///< of an edge: of a plane between two layers, both
constexpr double radians = std::numbers::pi / 180;

constexpr Rgba not_finite{220, 20, 20, 255};

}  // namespace

Look look_of(const std::string& text, int dim) {
  const auto refuse = [&](const std::string& message) {
    throw InputError(
        {Problem{.message = message,
                 .hint = "of three dimensions there are 3d, plan, and sections such as "
                         "y=12.5"}});
  };
  if (dim == 2) {
    if (!text.empty())
      refuse(fmt::format("the model has two dimensions, it has no view '{}'", text));
    return {};
  }
  if (text.empty() || text == "3d") return {.kind = Look::Kind::space};
  if (text == "plan") return {.kind = Look::Kind::plan};
  const std::size_t axis = std::string("xyz").find(text[0]);
  char* end = nullptr;
  const double at = text.size() > 2 ? std::strtod(text.c_str() + 2, &end) : 0;
  if (axis > 2 || text.size() < 3 || text[1] != '=' || *end || !std::isfinite(at))
    refuse(fmt::format("'{}' is not a view", text));
  return {.kind = Look::Kind::section, .normal = static_cast<int>(axis), .at = at};
}

std::string name_of(const Look& look) {
  switch (look.kind) {
    case Look::Kind::plane:
      return "";
    case Look::Kind::plan:
      return "plan";
    case Look::Kind::section:
      return fmt::format("section at {} = {:.4g} m", "xyz"[look.normal], look.at);
    case Look::Kind::space:
      return "3D";
  }
  return "";
}

void Bounds::add(const Bounds& other) {
  for (std::size_t d = 0; d < 3; ++d) {
    low[d] = std::min(low[d], other.low[d]);
    high[d] = std::max(high[d], other.high[d]);
  }
}

Bounds bounds_of(const Frame& frame) {
  Bounds bounds;
  const auto dim = static_cast<std::size_t>(frame.dim);
  if (dim == 3) {
    bounds.low[2] = std::numeric_limits<double>::max();
    bounds.high[2] = std::numeric_limits<double>::lowest();
  }
  for (std::size_t k = 0; k < frame.coordinates.size(); ++k) {
    const double x = frame.coordinates[k];
    if (!std::isfinite(x)) continue;
    bounds.low[k % dim] = std::min(bounds.low[k % dim], x);
    bounds.high[k % dim] = std::max(bounds.high[k % dim], x);
  }
  return bounds;
}

ViewProjection::ViewProjection(const Look& look) {
  switch (look.kind) {
    case Look::Kind::plane:
    case Look::Kind::plan:
      rows_ = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
      break;
    case Look::Kind::section:
      rows_ = {};
      rows_[0][look.normal == 0 ? 1 : 0] = 1;
      rows_[1][look.normal == 2 ? 1 : 2] = 1;
      rows_[2][static_cast<std::size_t>(look.normal)] = look.normal == 1 ? -1 : 1;
      break;
    case Look::Kind::space: {
      const double c = std::cos(turned * radians), s = std::sin(turned * radians),
                   up = std::sin(raised * radians), flat = std::cos(raised * radians);
      rows_ = {{{c, -s, 0}, {up * s, up * c, flat}, {-flat * s, -flat * c, up}}};
      break;
    }
  }
}

Point ViewProjection::operator()(const Point& x) const {
  Point seen{};
  for (std::size_t r = 0; r < 3; ++r)
    seen[r] = rows_[r][0] * x[0] + rows_[r][1] * x[1] + rows_[r][2] * x[2];
  return seen;
}

Bounds ViewProjection::of(const Bounds& bounds) const {
  Bounds seen;
  seen.low[2] = std::numeric_limits<double>::max();
  seen.high[2] = std::numeric_limits<double>::lowest();
  for (unsigned corner = 0; corner < 8; ++corner) {
    Point x{};
    for (unsigned d = 0; d < 3; ++d) x[d] = corner >> d & 1u ? bounds.high[d] : bounds.low[d];
    const Point at = (*this)(x);
    seen.add({at, at});
  }
  return seen;
}

std::vector<double> edges_of(const Frame& frame, bool axisymmetric) {
  const FrameColumn* volume = frame.find("volume");
  const auto dim = static_cast<std::size_t>(frame.dim);
  std::vector<double> edges(frame.id.size());
  for (std::size_t p = 0; p < edges.size(); ++p) {
    double size = volume ? std::abs(volume->values[p]) : 0.0;
    if (axisymmetric) size /= 2 * std::numbers::pi * std::abs(frame.coordinates[dim * p]);
    edges[p] = frame.dim == 2 ? std::sqrt(size) : std::cbrt(size);
  }
  return edges;
}

ParticleView::ParticleView(int columns, int rows, const std::array<double, 2>& low,
                           const std::array<double, 2>& high)
    : columns_(columns),
      rows_(rows),
      low_(low),
      size_{(high[0] - low[0]) / columns, (high[1] - low[1]) / rows} {
  const auto all = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  value_.resize(all);
  depth_.assign(all, std::numeric_limits<double>::lowest());
  filled_.resize(all);
}

void ParticleView::add(const Frame& frame, const std::vector<double>& edges,
                       const std::vector<double>& values, const Look& look) {
  const ViewProjection project(look);
  const auto dim = static_cast<std::size_t>(frame.dim);
  const bool space = look.kind == Look::Kind::space, section = look.kind == Look::Kind::section;
  std::vector<Splat> splats;
  splats.reserve(edges.size());
  for (std::size_t p = 0; p < edges.size(); ++p) {
    Point x{};
    std::copy_n(&frame.coordinates[dim * p], dim, x.begin());
    if (!std::isfinite(x[0] + x[1] + x[2]) || !std::isfinite(edges[p])) continue;
    const double away = section ? std::abs(x[static_cast<std::size_t>(look.normal)] - look.at) : 0;
    if (section && away > half_section * edges[p]) continue;
    Splat splat{.at = project(x), .half = 0.5 * edges[p], .value = values[p]};
    if (section) splat.at[2] = -away;
    if (space) splat.half = disc_radius * edges[p];
    splats.push_back(splat);
  }
  if (!space) {
    constexpr double behind = 1e9;  // [m] all others
    for (Splat splat : splats) {
      splat.half *= underlay;
      splat.at[2] -= behind;
      draw(splat, false);
    }
  }
  for (const Splat& splat : splats) draw(splat, space);
}

void ParticleView::draw(const Splat& splat, bool disc) {
  std::array<int, 2> first{}, last{};
  const std::array<int, 2> count{columns_, rows_};
  for (std::size_t d = 0; d < 2; ++d) {
    const double a = (splat.at[d] - splat.half - low_[d]) / size_[d],
                 b = (splat.at[d] + splat.half - low_[d]) / size_[d];
    if (!(b >= 0) || !(a <= count[d])) return;
    // Pixels whose middles are inside, at least one.
    first[d] = static_cast<int>(std::clamp(std::ceil(a - 0.5), 0.0, count[d] - 1.0));
    last[d] = static_cast<int>(std::clamp(std::ceil(b - 0.5) - 1, 0.0, count[d] - 1.0));
    if (last[d] < first[d])
      first[d] = last[d] =
          static_cast<int>(std::clamp(std::floor(0.5 * (a + b)), 0.0, count[d] - 1.0));
  }
  const bool round = disc && last[0] > first[0] + 1;
  for (int j = first[1]; j <= last[1]; ++j)
    for (int i = first[0]; i <= last[0]; ++i) {
      double depth = splat.at[2];
      if (round) {
        const double a = (low_[0] + (i + 0.5) * size_[0] - splat.at[0]) / splat.half,
                     b = (low_[1] + (j + 0.5) * size_[1] - splat.at[1]) / splat.half;
        if (a * a + b * b > 1) continue;
        depth -= 0.5 * splat.half * (a * a + b * b);  // round as a ball: neighbours meet halfway
      }
      const std::size_t k = index(i, j);
      if (!(depth > depth_[k])) continue;
      depth_[k] = depth;
      value_[k] = splat.value;
      filled_[k] = 1;
    }
}

/// Eye-dome lighting (Boucheny 2009): 1 where nothing near in the picture is nearer to the eye.
double ParticleView::shade(int i, int j) const {
  constexpr double strength = 0.5, per_pixel = 1.0;
  constexpr int distances[] = {1, 3};
  double sum = 0;
  int count = 0;
  for (const int distance : distances)
    for (const auto& [a, b] : {std::pair{1, 0}, {0, 1}, {-1, 0}, {0, -1}}) {
      const int x = i + distance * a, y = j + distance * b;
      if (x < 0 || y < 0 || x >= columns_ || y >= rows_) continue;
      ++count;
      if (!filled_[index(x, y)]) continue;
      const double above = (depth_[index(x, y)] - depth_[index(i, j)]) / size_[0];
      sum += std::log2(1 + std::max(0.0, per_pixel * above / distance - 1.5));
    }
  return std::exp(-strength * sum / std::max(1, count));
}

Image ParticleView::image(const ColourScale& scale, bool shaded) const {
  Image image(columns_, rows_);
  for (int j = 0; j < rows_; ++j)
    for (int i = 0; i < columns_; ++i) {
      const std::size_t k = index(i, j);
      if (!filled_[k]) continue;
      Rgba colour = std::isfinite(value_[k]) ? scale.colour(value_[k]) : not_finite;
      if (shaded) {
        const double light = shade(i, j);
        for (std::size_t c = 0; c < 3; ++c)
          colour[c] = static_cast<std::uint8_t>(std::lround(light * colour[c]));
      }
      image.at(i, rows_ - 1 - j) = colour;
    }
  return image;
}

}  // namespace lahar
