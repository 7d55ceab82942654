/// \file Rigid bodies of a run at any of its times, for pictures.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/run/body_shapes.h"
#include "io/run/table.h"

namespace lahar {

/// How a body lies: x = place + axes (X - centre), with X where it was before anything moved.
struct BodyPose {
  Vec<3> place = Vec<3>::Zero();  ///< [m]
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
};

/// A body as it is drawn: triangles of three dimensions, or lines of a plane with z = 0.
struct PlacedBody {
  std::string name;
  bool moves = false;          ///< at any time of the run
  std::vector<Vec<3>> points;  ///< [m]
  std::vector<std::array<Local, 3>> triangles;
  std::vector<std::array<Local, 2>> lines;
};

/// The shapes in a run folder, and the table of where they were.
class PlacedBodies {
 public:
  PlacedBodies() = default;
  /// A folder that holds no run has no bodies. Throws IoError.
  explicit PlacedBodies(const std::filesystem::path& run);

  const std::vector<BodyShape>& shapes() const { return shapes_; }
  std::optional<std::size_t> find(const std::string& name) const;
  /// Between two rows of rigid_bodies.csv a body moves and turns evenly.
  BodyPose pose(std::size_t body, double time) const;
  std::vector<PlacedBody> at(double time) const;

 private:
  struct Row {
    double time;
    Vec<3> place, rotation;
  };
  std::vector<BodyShape> shapes_;
  std::vector<std::vector<Row>> rows_;  ///< of each shape, by time
};

}  // namespace lahar
