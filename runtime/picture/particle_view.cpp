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

constexpr double behind = 1e9;  ///< [m] all others: where larger squares lie

constexpr Rgba not_finite{220, 20, 20, 255}, body_colour{176, 170, 160, 255};
constexpr double body_in_front = 0.35;  ///< share of its colour where particles are behind it
constexpr double line_width = 2.5;      ///< [px] of bodies in sections
/// Bodies are drawn so far beyond the box around particles, as a share of its longest side.
constexpr double bodies_around = 0.1;

Rgba mixed(const Rgba& a, const Rgba& b, double share_of_b) {
  Rgba to{};
  for (std::size_t c = 0; c < 4; ++c)
    to[c] = static_cast<std::uint8_t>(std::lround((1 - share_of_b) * a[c] + share_of_b * b[c]));
  return to;
}
Rgba lit(Rgba colour, double light) {
  for (std::size_t c = 0; c < 3; ++c)
    colour[c] = static_cast<std::uint8_t>(std::lround(std::min(light, 1.0) * colour[c]));
  return colour;
}

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

std::string file_part_of(const Look& look) {
  if (look.kind == Look::Kind::plan) return "-plan";
  if (look.kind != Look::Kind::section) return "";
  return fmt::format("-{}={}", "xyz"[look.normal], look.at);
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

Bounds bounds_of(const Frame& frame, const std::vector<PlacedBody>& bodies) {
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
  for (const PlacedBody& body : bodies)
    for (const Vec<3>& x : body.points)
      for (std::size_t d = 0; d < dim && body.moves; ++d) {
        const double at = x[static_cast<Eigen::Index>(d)];
        bounds.low[d] = std::min(bounds.low[d], at);
        bounds.high[d] = std::max(bounds.high[d], at);
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
  body_depth_.assign(all, std::numeric_limits<double>::lowest());
  body_light_.resize(all);
}

void ParticleView::add(const PlacedBody& body, const Look& look, const Bounds& box) {
  const ViewProjection project(look);
  const auto point = [&](Local p) {
    const Vec<3>& x = body.points[static_cast<std::size_t>(p)];
    return Point{x[0], x[1], x[2]};
  };
  Bounds within = box;
  double longest = 0;
  for (std::size_t d = 0; d < 3; ++d) longest = std::max(longest, box.high[d] - box.low[d]);
  for (std::size_t d = 0; d < 3; ++d) {
    within.low[d] -= bodies_around * longest;
    within.high[d] += bodies_around * longest;
  }
  for (const auto& line : body.lines) draw(project(point(line[0])), project(point(line[1])));
  for (const auto& corners : body.triangles) {
    const std::array<Point, 3> x{point(corners[0]), point(corners[1]), point(corners[2])};
    if (look.kind == Look::Kind::section) {
      const auto n = static_cast<std::size_t>(look.normal);
      std::vector<Point> cuts;
      for (std::size_t k = 0; k < 3; ++k) {
        const Point &a = x[k], &b = x[(k + 1) % 3];
        if ((a[n] > look.at) == (b[n] > look.at)) continue;
        const double share = (look.at - a[n]) / (b[n] - a[n]);
        Point cut;
        for (std::size_t d = 0; d < 3; ++d) cut[d] = a[d] + share * (b[d] - a[d]);
        cuts.push_back(project(cut));
      }
      if (cuts.size() == 2) draw(cuts[0], cuts[1]);
    } else {
      draw(x, project, within);
    }
  }
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

void ParticleView::put_body(int i, int j, double depth, double light) {
  const std::size_t k = index(i, j);
  if (!(depth > body_depth_[k])) return;
  body_depth_[k] = depth;
  body_light_[k] = static_cast<float>(light);
}

/// A triangle is lighter the more it looks up and towards the eye.
void ParticleView::draw(const std::array<Point, 3>& triangle, const ViewProjection& project,
                        const Bounds& within) {
  const Point a = project(triangle[0]), b = project(triangle[1]), c = project(triangle[2]);
  const double twice = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
  if (!(std::abs(twice) > 0)) return;
  const Vec<3> along(b[0] - a[0], b[1] - a[1], b[2] - a[2]),
      across(c[0] - a[0], c[1] - a[1], c[2] - a[2]);
  Vec<3> normal = along.cross(across).stableNormalized();
  if (normal[2] < 0) normal = -normal;
  const Vec<3> light = Vec<3>(-0.4, 0.55, 0.73).normalized();
  const double brightness = 0.55 + 0.45 * std::max(0.0, normal.dot(light));
  std::array<int, 2> first{}, last{};
  const std::array<int, 2> count{columns_, rows_};
  for (std::size_t d = 0; d < 2; ++d) {
    const double least = (std::min({a[d], b[d], c[d]}) - low_[d]) / size_[d],
                 most = (std::max({a[d], b[d], c[d]}) - low_[d]) / size_[d];
    if (!(most >= 0) || !(least <= count[d])) return;
    first[d] = static_cast<int>(std::clamp(std::ceil(least - 0.5), 0.0, count[d] - 1.0));
    last[d] = static_cast<int>(std::clamp(std::floor(most - 0.5), 0.0, count[d] - 1.0));
  }
  constexpr double rounding = 1e-9;
  for (int j = first[1]; j <= last[1]; ++j)
    for (int i = first[0]; i <= last[0]; ++i) {
      const double x = low_[0] + (i + 0.5) * size_[0] - a[0],
                   y = low_[1] + (j + 0.5) * size_[1] - a[1];
      const double s = (x * across[1] - across[0] * y) / twice,
                   t = (along[0] * y - x * along[1]) / twice;
      if (s < -rounding || t < -rounding || s + t > 1 + rounding) continue;
      bool inside = true;
      for (std::size_t d = 0; d < 3; ++d) {
        const double at = (1 - s - t) * triangle[0][d] + s * triangle[1][d] + t * triangle[2][d];
        inside = inside && at >= within.low[d] && at <= within.high[d];
      }
      if (inside) put_body(i, j, a[2] + s * along[2] + t * across[2], brightness);
    }
}

void ParticleView::draw(const Point& from, const Point& to) {
  const double columns = (to[0] - from[0]) / size_[0], rows = (to[1] - from[1]) / size_[1];
  const double x = (from[0] - low_[0]) / size_[0], y = (from[1] - low_[1]) / size_[1];
  // Only the part that may be in the picture is drawn.
  constexpr double half = 0.5 * line_width;
  double begin = 0, end = 1;
  const auto clip = [&](double at, double change, double most) {
    for (const double border : {-half, most + half}) {
      const double inside = border < 0 ? at - border : border - at;
      const double inwards = border < 0 ? change : -change;
      if (inwards == 0 && inside < 0) end = -1;
      if (inwards > 0) begin = std::max(begin, -inside / inwards);
      if (inwards < 0) end = std::min(end, inside / -inwards);
    }
  };
  clip(x, columns, columns_);
  clip(y, rows, rows_);
  if (!(begin <= end)) return;
  const int steps = static_cast<int>(std::ceil(2 * (end - begin) * std::hypot(columns, rows)));
  for (int k = 0; k <= steps; ++k) {
    const double share = steps > 0 ? begin + (end - begin) * k / steps : begin;
    const double u = x + share * columns, v = y + share * rows;
    for (int j = std::max(0, static_cast<int>(std::ceil(v - half - 0.5)));
         j <= std::min(rows_ - 1, static_cast<int>(std::floor(v + half - 0.5))); ++j)
      for (int i = std::max(0, static_cast<int>(std::ceil(u - half - 0.5)));
           i <= std::min(columns_ - 1, static_cast<int>(std::floor(u + half - 0.5))); ++i)
        put_body(i, j, std::numeric_limits<double>::max(), 0.6);
  }
}

double ParticleView::depth_at(std::size_t k) const {
  if (!filled_[k]) return body_depth_[k];
  return depth_[k] < -0.5 * behind ? depth_[k] + behind : depth_[k];
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
      const std::size_t beside = index(x, y), own = index(i, j);
      if (!filled_[beside] && body_light_[beside] <= 0) continue;
      const double above = (depth_at(beside) - depth_at(own)) / size_[0];
      sum += std::log2(1 + std::max(0.0, per_pixel * above / distance - 1.5));
    }
  return std::exp(-strength * sum / std::max(1, count));
}

Image ParticleView::image(const ColourScale& scale, bool shaded) const {
  Image image(columns_, rows_);
  for (int j = 0; j < rows_; ++j)
    for (int i = 0; i < columns_; ++i) {
      const std::size_t k = index(i, j);
      const bool body = body_light_[k] > 0;
      if (!filled_[k] && !body) continue;
      Rgba colour = lit(body_colour, static_cast<double>(body_light_[k]));
      if (filled_[k]) {
        const Rgba own = std::isfinite(value_[k]) ? scale.colour(value_[k]) : not_finite;
        const bool hidden = body && body_depth_[k] > depth_at(k);
        colour = hidden ? mixed(own, colour, body_in_front) : own;
      }
      image.at(i, rows_ - 1 - j) = shaded ? lit(colour, shade(i, j)) : colour;
    }
  return image;
}

}  // namespace lahar
