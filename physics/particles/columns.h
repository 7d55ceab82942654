/// \file The one table that describes a particle. Migration, frames, checkpoints and sorting
/// iterate over it; a new column is an enumerator and a row.
#pragma once

#include <array>
#include <span>

#include "physics/base/types.h"

namespace lahar {

template <int Dim>
struct Model;

/// Floating-point columns of a particle. Each but `state` has a fixed number of components per
/// dimension.
enum class Column : int {
  x,              ///< position
  xi,             ///< natural coordinates in its cell
  v,              ///< velocity
  u,              ///< displacement
  stress,         ///< Cauchy; 2D: xx yy zz xy
  strain,         ///< engineering shear; 2D: xx yy xy, see strain_across
  volume,         ///< present volume
  mass,           ///< mass
  size,           ///< edges at the beginning, for tractions
  state,          ///< state variables of the law; the model says how many
  domain,         ///< GIMP: edges of the particle's box
  affine,         ///< APIC and TPIC: dv_a/dx_b, row by row
  next_domain,    ///< `domain` from the next step on
  vectors,        ///< CPDI: halves of the domain's edges
  next_vectors,   ///< `vectors` from the next step on
  corners,        ///< CPDI2: corners of the domain, from x
  next_corners,   ///< `corners` from the next step on
  opening,        ///< gaps between grains or drops, by volume
  liquid_v,       ///< velocity of the liquid in the pores (two_phase.h)
  liquid_affine,  ///< what `affine` is for the skeleton
  pore_pressure,  ///< positive in compression
  acceleration,   ///< of Newmark's method
  contact_force,  ///< of rigid bodies, in the step that comes (rigid_contact.h); with a liquid in
                  ///< pores on the skeleton alone
  contact_shear,  ///< of it, what friction has built up
  contact_reach,  ///< distance from the place to the surface where contact begins; 0: not known yet
  contact_extent,  ///< and to the end of the particle's material
  contact_couple,  ///< of contact_force: it acts at the surface; xx, yy, xy, in 3D with zz, yz, xz
  contact_liquid,  ///< what rigid bodies hold a liquid in pores by (liquid_contact.h)
  strain_across,   ///< zz of `strain` in 2D, where particles deform across the plane
};

/// Which columns a model needs beside those that all have (columns.cpp). What follows from other
/// columns is not stored: moving bytes is what limits a step.
struct ColumnNeeds {
  bool size = false;
  int state = 0;         ///< most state variables of any material that particles have
  bool natural = false;  ///< natural coordinates of the step's beginning: isoparametric cells, or
                         ///< needed when x has moved on (MUSL); else they follow from x
  bool affine = false;   ///< APIC and TPIC
  bool domain = false;   ///< GIMP
  bool next_domain = false;    ///< GIMP with domains that stretch
  bool vectors = false;        ///< CPDI
  bool corners = false;        ///< CPDI2
  bool next_corners = false;   ///< CPDI2 where functions are used after particles have moved (MUSL)
  bool strain = false;         ///< not where all laws give it as a function of stress (strain_of())
  bool strain_across = false;  ///< in 2D: plane stress, axisymmetric
  bool opening = false;        ///< materials with a limit of tension, see physics/kernels/opening.h
  bool liquid = false;         ///< in pores: its velocity and pressure
  bool liquid_affine = false;
  bool acceleration = false;  ///< Newmark's method
  bool contact = false;       ///< with rigid bodies
  bool contact_liquid = false;
  bool operator==(const ColumnNeeds&) const = default;
};

/// `used`: of which materials there are or will be particles. `stressed`: initial stresses are
/// given.
template <int Dim>
ColumnNeeds column_needs(const Model<Dim>& model, std::span<const char> used, bool stressed);

struct ColumnInfo {
  Column column;
  const char* name;  ///< as in frames
  const char* unit;
  int components_2d, components_3d;
  bool exported;                      ///< written to frames
  bool ColumnNeeds::*need = nullptr;  ///< allocated only where the model needs it; null = always
};

// clang-format off
inline constexpr auto column_table = std::to_array<ColumnInfo>({
    {Column::x,             "coordinates",     "m",     2,  3, true},
    {Column::xi,            "natural",         "-",     2,  3, false, &ColumnNeeds::natural},
    {Column::v,             "velocity",        "m/s",   2,  3, true},
    {Column::u,             "displacement",    "m",     2,  3, true},
    {Column::stress,        "stress",          "Pa",    4,  6, true},
    {Column::strain,        "strain",          "-",     3,  6, true,  &ColumnNeeds::strain},
    {Column::volume,        "volume",          "m^3",   1,  1, true},
    {Column::mass,          "mass",            "kg",    1,  1, true},
    {Column::size,          "size",            "m",     2,  3, false, &ColumnNeeds::size},
    {Column::state,         "state",           "",      0,  0, true},
    {Column::domain,        "domain",          "m",     2,  3, true,  &ColumnNeeds::domain},
    {Column::affine,        "affine",          "1/s",   4,  9, false, &ColumnNeeds::affine},
    {Column::next_domain,   "next_domain",     "m",     2,  3, false, &ColumnNeeds::next_domain},
    {Column::vectors,       "domain_vectors",  "m",     4,  9, true,  &ColumnNeeds::vectors},
    {Column::next_vectors,  "next_vectors",    "m",     4,  9, false, &ColumnNeeds::vectors},
    {Column::corners,       "domain_corners",  "m",     8, 24, true,  &ColumnNeeds::corners},
    {Column::next_corners,  "next_corners",    "m",     8, 24, false, &ColumnNeeds::next_corners},
    {Column::opening,       "opening",         "-",     1,  1, true,  &ColumnNeeds::opening},
    {Column::liquid_v,      "liquid_velocity", "m/s",   2,  3, true,  &ColumnNeeds::liquid},
    {Column::liquid_affine, "liquid_affine",   "1/s",   4,  9, false, &ColumnNeeds::liquid_affine},
    {Column::pore_pressure, "pore_pressure",   "Pa",    1,  1, true,  &ColumnNeeds::liquid},
    {Column::acceleration,  "acceleration",    "m/s^2", 2,  3, true,  &ColumnNeeds::acceleration},
    {Column::contact_force, "contact_force",   "N",     2,  3, true,  &ColumnNeeds::contact},
    {Column::contact_shear, "contact_shear",   "N",     2,  3, false, &ColumnNeeds::contact},
    {Column::contact_reach, "contact_reach",   "m",     1,  1, false, &ColumnNeeds::contact},
    {Column::contact_extent, "contact_extent", "m",     1,  1, false, &ColumnNeeds::contact},
    {Column::contact_couple, "contact_couple", "N m",   3,  6, false, &ColumnNeeds::contact},
    {Column::contact_liquid, "contact_liquid", "N",     2,  3, true,  &ColumnNeeds::contact_liquid},
    {Column::strain_across, "strain_across",   "-",     1,  0, false, &ColumnNeeds::strain_across},
});
// clang-format on
inline constexpr int n_columns = static_cast<int>(column_table.size());
static_assert(
    [] {
      for (int k = 0; k < n_columns; ++k)
        if (static_cast<int>(column_table[static_cast<std::size_t>(k)].column) != k) return false;
      return true;
    }(),
    "rows of column_table are in the order of the enumerators of Column");

/// Row of every column's first component in a patch's particle block; -1 = absent.
template <int Dim>
class ColumnLayout {
 public:
  explicit ColumnLayout(ColumnNeeds needs = {}) : state_(needs.state) {
    for (const ColumnInfo& info : column_table) {
      const bool present = components(info) > 0 && (!info.need || needs.*info.need);
      row_[static_cast<std::size_t>(info.column)] = present ? rows_ : -1;
      if (present) rows_ += components(info);
    }
  }
  int components(const ColumnInfo& info) const {
    if (info.column == Column::state) return state_;
    return Dim == 2 ? info.components_2d : info.components_3d;
  }
  int components(Column c) const { return components(column_table[static_cast<std::size_t>(c)]); }
  int row(Column c) const { return row_[static_cast<int>(c)]; }
  bool has(Column c) const { return row(c) >= 0; }
  int rows() const { return rows_; }

 private:
  std::array<int, n_columns> row_{};
  int state_;
  int rows_ = 0;
};

}  // namespace lahar
