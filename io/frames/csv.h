/// \file Particle states as CSV tables, one row per particle.
///
/// Columns: id, mass, volume, coord_x.., displacement_x.., velocity_x.., stress_xx yy zz xy [yz
/// xz], strain_xx yy xy (2D) or xx yy zz xy yz xz, other scalars of particles, derived fields,
/// svars_0.. (state variables: the frame's other scalars, in its order). Stress has zz in 2D, plane
/// strain has none. Shear strains are engineering shears. Then: material (its id), in 2D strain_zz
/// where it is not zero, and all else that the frame has, by its names there: state variables once
/// more, vectors as NAME_x.., others as NAME_0..
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "io/frames/frame.h"

namespace lahar {

/// The table as text; numbers are the shortest ones that read back to the same bits.
std::string csv_text(const Frame& frame);

/// Write the table atomically. Throws IoError.
void write_csv(const Frame& frame, const std::filesystem::path& file);

/// Read a table with the columns above in any order; only `id` is required, and rows may be in any
/// order. Tensors come back with 6 components; state variables are named svars_k;
/// `material` or `material_id` becomes the frame's material; columns with other names become
/// scalars of unknown unit. Step and time are 0: a table has none. Throws IoError, or InputError
/// with line and column of every problem (at most 20).
Frame read_csv(const std::filesystem::path& file);

/// The same from text; `name` is used in messages.
Frame parse_csv(std::string_view text, const std::string& name);

}  // namespace lahar
