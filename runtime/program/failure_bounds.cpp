#include "runtime/program/failure_bounds.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "physics/base/types.h"
#include "physics/materials/law.h"
#include "runtime/exchange/sum_over_ranks.h"

namespace lahar {

namespace {

using BodyDirection = std::vector<double>;

constexpr double infinite = std::numeric_limits<double>::infinity();

/// Waves of shear pass the longest extent of the body so often in a trial. Near the limit, bodies
/// that stand need up to twenty passes.
constexpr double passes = 30;

/// Directions across gravity.
std::vector<BodyDirection> across(const std::vector<double>& gravity) {
  if (gravity.size() == 2) {
    const double g = std::hypot(gravity[0], gravity[1]);
    return {{gravity[1] / g, -gravity[0] / g}};
  }
  const Vec<3> down = Vec<3>(gravity.data()).normalized();
  const Vec<3> first = down.unitOrthogonal(), second = down.cross(first);
  return {{first[0], first[1], first[2]}, {second[0], second[1], second[2]}};
}

std::vector<BodyDirection> axes(int dim) {
  std::vector<BodyDirection> all;
  for (int k = 0; k < dim; ++k) {
    all.emplace_back(static_cast<std::size_t>(dim), 0.0);
    all.back()[static_cast<std::size_t>(k)] = 1;
  }
  return all;
}

/// Magnitude of the displacement of the particle whose components begin at `at`.
double magnitude(const double* at, std::size_t width) {
  double square = 0;
  for (std::size_t k = 0; k < width; ++k) square += at[k] * at[k];
  return std::sqrt(square);
}

/// The particles of all ranks, along some directions and as a whole.
class Body {
 public:
  Body(const FrameSource& frame, std::vector<BodyDirection> directions, const Communicator& ranks)
      : directions_(std::move(directions)),
        low_(directions_.size(), infinite),
        high_(directions_.size(), -infinite) {
    ExactSum mass, volume;
    for (std::size_t i = 0; i < frame.sizes.size(); ++i) {
      const Frame piece = frame.piece(i);
      for (const double m : piece.find("mass")->values) mass += m;
      for (const double v : piece.find("volume")->values) volume += v;
      reach(piece);
    }
    mass_ = sum_over_ranks(mass, ranks);
    volume_ = sum_over_ranks(volume, ranks);
    for (double& low : low_) low = ranks.min(low);
    for (double& high : high_) high = ranks.max(high);
  }
  double mass() const { return mass_; }
  double volume() const { return volume_; }
  /// Along a direction [m].
  double extent(std::size_t direction) const {
    return std::max(high_[direction] - low_[direction], 0.0);
  }

 private:
  void reach(const Frame& piece) {
    const auto width = static_cast<std::size_t>(piece.dim);
    for (std::size_t i = 0; i + width <= piece.coordinates.size(); i += width)
      for (std::size_t d = 0; d < directions_.size(); ++d) {
        double at = 0;
        for (std::size_t k = 0; k < width; ++k) at += piece.coordinates[i + k] * directions_[d][k];
        low_[d] = std::min(low_[d], at);
        high_[d] = std::max(high_[d], at);
      }
  }

  std::vector<BodyDirection> directions_;
  std::vector<double> low_, high_;
  double mass_ = 0, volume_ = 0;
};

/// `area`: of the body across gravity [m^2].
double displacement_bound(const Body& body, double area, double shear, double g) {
  const double thickness = body.volume() / area;
  return body.mass() / body.volume() * g * thickness * thickness / shear;
}

}  // namespace

FailureBounds failure_bounds(const FrameSource& frame, const std::vector<Material>& materials,
                             const std::vector<double>& gravity, const Communicator& ranks) {
  double shear = infinite, speed = infinite;
  for (const Material& material : materials)
    if (const double G = shear_wave_modulus(material.law); G > 0) {
      shear = std::min(shear, G);
      speed = std::min(speed, std::sqrt(G / material.density));
    }
  std::vector<BodyDirection> directions = axes(frame.header.dim);
  const std::size_t n_axes = directions.size();
  const double g = magnitude(gravity.data(), gravity.size());
  if (g > 0)
    for (BodyDirection& one : across(gravity)) directions.push_back(std::move(one));
  const Body body(frame, directions, ranks);
  double longest = 0, area = 1;
  for (std::size_t d = 0; d < n_axes; ++d) longest = std::max(longest, body.extent(d));
  for (std::size_t d = n_axes; d < directions.size(); ++d) area *= body.extent(d);
  return {.displacement = g > 0 ? displacement_bound(body, area, shear, g) : infinite,
          .time = passes * longest / speed};
}

double largest_displacement(const FrameSource& frame, const Communicator& ranks) {
  const auto width = static_cast<std::size_t>(frame.header.dim);
  double most = 0;
  for (std::size_t i = 0; i < frame.sizes.size(); ++i) {
    const Frame piece = frame.piece(i);
    const std::vector<double>& values = piece.find("displacement")->values;
    for (std::size_t k = 0; k + width <= values.size(); k += width)
      most = std::max(most, magnitude(&values[k], width));
  }
  return ranks.max(most);
}

}  // namespace lahar
