/// \file `lahar compare`: two particle states, field by field and particle by particle.
#pragma once

#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "io/frame.h"

namespace lahar {

/// When a field passes. Let d be its largest |A - B| over all particles and components, and s its
/// largest magnitude in B (the reference), over all components of a vector or tensor together.
/// It passes if d <= atol, or d <= rtol s, or s <= floor and d <= floor.
struct Tolerances {
  double rtol = 1e-8;  ///< [-]
  double atol = 0;     ///< in the field's unit
  /// In the field's unit. A field that is this small throughout is rounding noise about zero (a
  /// body at rest), of which no digit can agree. Masses, volumes and coordinates have no floor.
  double floor = 1e-12;
};

struct FieldDifference {
  enum class Verdict { same, within, differs, missing };
  std::string name;
  std::string unit;
  double absolute = 0;    ///< max |A - B|, NaNs aside
  double scale = 0;       ///< largest magnitude in B
  double relative = 0;    ///< absolute / scale; 0 where both are 0
  bool floored = false;   ///< scale <= floor: compared absolutely
  Index at = -1;          ///< id of the particle with the largest difference (or first NaN)
  std::string component;  ///< "", "x", "xy", ... likewise
  Index not_finite = 0;   ///< particles with a NaN or infinity on either side
  Verdict verdict = Verdict::same;
};

struct Comparison {
  Index matched = 0;                                    ///< particles with the same id
  Index count_a = 0, count_b = 0;                       ///< particles
  Index missing_a = 0, missing_b = 0;                   ///< ids that A (B) lacks
  std::vector<Index> first_missing_a, first_missing_b;  ///< the first few of them
  std::vector<FieldDifference> fields;
  std::vector<std::string> notes;  ///< fields that could not be compared, different times, ...
  Tolerances tolerances;
  int dim_a = 0, dim_b = 0;
  bool passed = false;

  /// Table: field, unit, max |A - B|, relative, particle, verdict; then ids, notes and the result.
  std::string text() const;
};

/// Compare by particle id. Mass, volume, coordinates, displacement, velocity, stress, strain and
/// state variables (svars_k; the k-th other scalar of a frame) must exist on both sides or on none;
/// other fields are compared where both have them. A NaN or infinity anywhere is a difference.
Comparison compare(const Frame& a, const Frame& b, const Tolerances& tolerances = {});

/// Particle state from a run folder (last frame unless `step` is given), a frame (.hdf) or a table
/// (.csv). Throws InputError, IoError.
Frame read_particles(const std::filesystem::path& source, std::optional<Index> step = {});

/// Both of the above.
Comparison compare(const std::filesystem::path& a, const std::filesystem::path& b,
                   const Tolerances& tolerances = {}, std::optional<Index> step = {});

}  // namespace lahar
