/// \file Lines and surfaces of triangles as files.
#pragma once

#include <filesystem>

#include "physics/geometry/level_surface.h"

namespace lahar {

/// A binary STL file. Throws IoError.
void write_stl(const Triangles& triangles, const std::filesystem::path& file);

/// A VTK PolyData file. Throws IoError.
template <int Dim>
void write_vtp(const LevelSurface<Dim>& surface, double time, const std::filesystem::path& file);
/// One that write_vtp() wrote. Throws IoError for others.
template <int Dim>
LevelSurface<Dim> read_vtp(const std::filesystem::path& file);

extern template void write_vtp<2>(const Lines&, double, const std::filesystem::path&);
extern template void write_vtp<3>(const Triangles&, double, const std::filesystem::path&);
extern template Lines read_vtp<2>(const std::filesystem::path&);
extern template Triangles read_vtp<3>(const std::filesystem::path&);

}  // namespace lahar
