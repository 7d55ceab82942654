/// \file Which columns a table of particles has: used by its writer and its reader.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "physics/particles/columns.h"
#include "physics/particles/derived_fields.h"

namespace lahar {

/// A field of a frame and how its components are called in tables.
struct TableField {
  std::string_view frame_name;  ///< "coordinates" stands for Frame::coordinates
  std::string_view prefix;      ///< column names are prefix_component; the prefix alone for scalars
  std::string_view unit;
  enum class Kind { scalar, vector, stress, strain } kind;
};

/// All that tables can have: the published columns, then other scalars of particles and derived
/// fields.
inline const std::vector<TableField>& table_fields() {
  using Kind = TableField::Kind;
  static const std::vector<TableField> fields = [] {
    std::vector<TableField> all = {{"mass", "mass", "kg", Kind::scalar},
                                   {"volume", "volume", "m^3", Kind::scalar},
                                   {"coordinates", "coord", "m", Kind::vector},
                                   {"displacement", "displacement", "m", Kind::vector},
                                   {"velocity", "velocity", "m/s", Kind::vector},
                                   {"stress", "stress", "Pa", Kind::stress},
                                   {"strain", "strain", "-", Kind::strain}};
    for (const ColumnInfo& info : column_table)
      if (info.exported && info.components_3d == 1 && info.column != Column::mass &&
          info.column != Column::volume)
        all.push_back({info.name, info.name, info.unit, Kind::scalar});
    for (const DerivedField& field : derived_fields)
      all.push_back({field.name, field.name, field.unit,
                     field.components == 1 ? Kind::scalar : Kind::stress});
    return all;
  }();
  return fields;
}

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
