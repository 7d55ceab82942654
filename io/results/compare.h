/// \file `lahar compare`: two particle states, field by field and particle by particle.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/frames/frame.h"

namespace lahar {

/// When a field passes. Let d be its largest |A - B| over all particles and components, and s its
/// largest magnitude in B (the reference), over all components of a vector or tensor together.
/// It passes if d <= atol, or d <= rtol s, or s <= floor and d <= floor.
struct Tolerances {
  double rtol = 1e-8;  ///< [-]
  double atol = 0;     ///< in the field's unit
  /// In the field's unit. A field that is this small throughout is rounding noise about zero (a
  /// body at rest), of which no digit can agree: it is compared absolutely. The default is above
  /// the velocities of published columns at rest (6e-11 m/s). Masses, volumes and coordinates have
  /// no floor; that of strains is at most strain_floor.
  double floor = 1e-10;
};

/// [-] Strains have no unit to choose: published ones that are results are as small as 2e-12, those
/// of rigid motions are of the order of the rounding of 1.
inline constexpr double strain_floor = 1e-15;

struct FieldDifference {
  enum class Verdict { same, within, differs, missing };
  std::string name;  ///< "stress", "svars_0", ...
  std::string unit;
  double absolute = 0;    ///< max |A - B|, where both are finite
  double scale = 0;       ///< largest finite magnitude in B
  double relative = 0;    ///< absolute / scale; 0 where both are 0
  bool floored = false;   ///< scale <= floor
  Index at = -1;          ///< id of the particle with the first NaN, else the largest difference
  std::string component;  ///< likewise: "", "x", "xy", ...
  Index not_finite = 0;   ///< values that are NaN or infinite on either side
  Verdict verdict = Verdict::same;
};

/// Ids that one side lacks.
struct MissingIds {
  Index count = 0;
  std::vector<Index> first;  ///< the first few
};

struct Comparison {
  std::string name_a = "A", name_b = "B";
  Index count_a = 0, count_b = 0;  ///< particles
  Index matched = 0;               ///< particles with the same id
  MissingIds only_in_a, only_in_b;
  std::vector<FieldDifference> fields;
  std::vector<std::string> problems;  ///< other reasons to fail
  std::vector<std::string> notes;     ///< what was not compared, different times
  Tolerances tolerances;
  bool passed = false;

  /// Table: field, unit, max |A - B|, relative, particle, verdict; then ids, notes and the result.
  std::string text() const;
};

/// Compare by particle id. Mass, volume, coordinates, displacement, velocity, stress, strain and
/// state variables (svars_k) must exist on both sides or on none; other fields are compared where
/// both sides have them, materials exactly. Components that are columns of their own on one side,
/// as in tables, are the field that the other side has. A NaN or infinity anywhere is a difference.
Comparison compare(const Frame& a, const Frame& b, const Tolerances& tolerances = {});

/// Particle state from a run folder (last frame unless `step` is given), a frame (.hdf) or a table
/// (CSV); what a file is, its first bytes say. Throws InputError, IoError.
Frame read_particles(const std::filesystem::path& source, std::optional<Index> step = {});

/// Both of the above.
Comparison compare(const std::filesystem::path& a, const std::filesystem::path& b,
                   const Tolerances& tolerances = {}, std::optional<Index> step = {});

}  // namespace lahar
