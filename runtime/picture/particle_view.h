/// \file Particles as one sees them from a side: pixels, each of the particle that is in front.
#pragma once

#include <array>
#include <limits>
#include <string>
#include <vector>

#include "io/frames/frame.h"
#include "runtime/picture/colour_map.h"
#include "runtime/picture/placed_bodies.h"

namespace lahar {

using Point = std::array<double, 3>;

/// Where a picture is looked at from.
struct Look {
  /// The plane of a model of two dimensions; from above; a section; from the side and above.
  enum class Kind { plane, plan, section, space } kind = Kind::plane;
  int normal = 2;  ///< axis across a section
  double at = 0;   ///< [m] where it is
};

/// From "3d", "plan", or "y=12.5"; "" is the plane or 3d. Throws InputError.
Look look_of(const std::string& text, int dim);

/// What it adds to names of files: "-plan", "-y=12.5"; "" of a plane and of 3d.
std::string file_part_of(const Look& look);

/// "plan", "section at y = 12.5 m"; "" of a plane.
std::string name_of(const Look& look);

/// A box around what is seen [m].
struct Bounds {
  Point low{std::numeric_limits<double>::max(), std::numeric_limits<double>::max(), 0},
      high{std::numeric_limits<double>::lowest(), std::numeric_limits<double>::lowest(), 0};
  void add(const Bounds& other);
};
/// Of a frame with particles, and of bodies that move; places that are not finite are left out.
Bounds bounds_of(const Frame& frame, const std::vector<PlacedBody>& bodies = {});

/// Along what one looks: coordinates of a picture from those of space. Lengths stay [m].
class ViewProjection {
 public:
  explicit ViewProjection(const Look& look);
  /// To the right, upwards, towards the eye [m].
  Point operator()(const Point& x) const;
  /// A box seen so: that around its corners.
  Bounds of(const Bounds& bounds) const;

 private:
  std::array<Point, 3> rows_;
};

/// Edges [m] of the squares or cubes of particles that have the column `volume`. Volumes of rings
/// belong to their sections: `axisymmetric`.
std::vector<double> edges_of(const Frame& frame, bool axisymmetric);

class ParticleView {
 public:
  /// The view shows the part of a projection that lies between `low` and `high` [m].
  ParticleView(int columns, int rows, const std::array<double, 2>& low,
               const std::array<double, 2>& high);

  /// Particles that the look shows, each with its edge and value.
  void add(const Frame& frame, const std::vector<double>& edges, const std::vector<double>& values,
           const Look& look);

  /// Adds a body: the part of its triangles near the box, the lines in which a section cuts them,
  /// or its own lines.
  void add(const PlacedBody& body, const Look& look, const Bounds& box);

  /// Bodies are grey, and what is behind them shines through. Pixels without anything are clear,
  /// those of values that are not finite red. `shaded`: what lies behind something is darker beside
  /// it.
  Image image(const ColourScale& scale, bool shaded) const;

 private:
  struct Splat {
    Point at;     ///< right, up, towards the eye
    double half;  ///< [m]
    double value;
  };
  void draw(const Splat& splat, bool disc);
  /// Fills pixels whose middles are in the part of a triangle that is within a box.
  void draw(const std::array<Point, 3>& triangle, const ViewProjection& project,
            const Bounds& within);
  void draw(const Point& from, const Point& to);
  void put_body(int i, int j, double depth, double light);
  /// Nearness to the eye [m]: that of the particle, or of the body if there is no particle.
  double depth_at(std::size_t k) const;
  double shade(int i, int j) const;
  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(i);
  }

  int columns_, rows_;
  std::array<double, 2> low_, size_;  ///< size of a pixel [m]
  std::vector<double> value_, depth_;
  std::vector<char> filled_;
  std::vector<double> body_depth_;
  std::vector<float> body_light_;  ///< 0 = no body
};

}  // namespace lahar
