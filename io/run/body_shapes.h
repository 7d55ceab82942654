/// \file Surfaces of rigid bodies in a run folder: bodies/NUMBER-NAME.vtp.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "physics/geometry/level_surface.h"
#include "physics/geometry/solid.h"

namespace lahar {

/// A rigid body where it is before anything moves.
struct BodyShape {
  std::string name;
  std::array<double, 3> centre{};  ///< [m] the point whose place rigid_bodies.csv has
  std::variant<Lines, Triangles> surface;
};

/// The surface of a solid within a box [m], for pictures, by distances at about so many points of a
/// grid around it. It is open where the solid leaves the box, and where what it is made of ends.
/// Edges are rounded, and details lost, by the distance of points.
template <int Dim>
LevelSurface<Dim> surface_within(const Solid<Dim>& solid, const std::pair<Vec<Dim>, Vec<Dim>>& box,
                                 double points);

std::filesystem::path bodies_folder(const std::filesystem::path& run);
/// Where the shape of the body number `index` lies. Characters that file names should not have
/// become '_'.
std::filesystem::path body_file(const std::filesystem::path& run, std::size_t index,
                                const std::string& name);

/// Throws IoError.
void write_body_shapes(const std::filesystem::path& run, const std::vector<BodyShape>& shapes);
/// Those that the manifest in a run folder names, but for those whose files somebody removed.
/// Throws IoError where a file is damaged.
std::vector<BodyShape> read_body_shapes(const std::filesystem::path& run);

extern template Lines surface_within<2>(const Solid<2>&, const std::pair<Vec<2>, Vec<2>>&, double);
extern template Triangles surface_within<3>(const Solid<3>&, const std::pair<Vec<3>, Vec<3>>&,
                                            double);

}  // namespace lahar
