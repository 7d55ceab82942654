/// \file Which columns a table of particles has: used by its writer and its reader.
#pragma once

#include <span>
#include <string>

namespace lahar {

/// A field of a frame and how its components are called in tables.
struct TableField {
  const char* frame_name;  ///< "coordinates" stands for Frame::coordinates
  const char* prefix;      ///< column names are prefix_component; the prefix alone for scalars
  const char* unit;
  enum class Kind { scalar, vector, stress, strain } kind;
};

// clang-format off
inline constexpr TableField table_fields[] = {
    {"mass",         "mass",         "kg",  TableField::Kind::scalar},
    {"volume",       "volume",       "m^3", TableField::Kind::scalar},
    {"coordinates",  "coord",        "m",   TableField::Kind::vector},
    {"displacement", "displacement", "m",   TableField::Kind::vector},
    {"velocity",     "velocity",     "m/s", TableField::Kind::vector},
    {"stress",       "stress",       "Pa",  TableField::Kind::stress},
    {"strain",       "strain",       "-",   TableField::Kind::strain},
    {"opening",      "opening",      "-",   TableField::Kind::scalar},
};
// clang-format on

/// One component of a field in a table.
struct TableComponent {
  const char* suffix;  ///< "" for scalars
  int position;        ///< among the components of the frame's column
};

inline std::span<const TableComponent> table_components(TableField::Kind kind, int dim) {
  static constexpr TableComponent scalar[] = {{"", 0}};
  static constexpr TableComponent vector[] = {{"_x", 0}, {"_y", 1}, {"_z", 2}};
  static constexpr TableComponent tensor[] = {{"_xx", 0}, {"_yy", 1}, {"_zz", 2},
                                              {"_xy", 3}, {"_yz", 4}, {"_xz", 5}};
  // Plane strain has a stress across the plane, but no strain.
  static constexpr TableComponent plane_strain[] = {{"_xx", 0}, {"_yy", 1}, {"_xy", 3}};
  switch (kind) {
    case TableField::Kind::scalar:
      return scalar;
    case TableField::Kind::vector:
      return std::span(vector).first(dim);
    case TableField::Kind::stress:
      return std::span(tensor).first(dim == 2 ? 4 : 6);
    case TableField::Kind::strain:
      break;
  }
  if (dim == 2) return plane_strain;
  return tensor;
}

/// Components of the frame's column.
inline int frame_components(TableField::Kind kind, int dim) {
  if (kind == TableField::Kind::scalar) return 1;
  return kind == TableField::Kind::vector ? dim : 6;
}

}  // namespace lahar
