/// \file What happens to particles between two stages of a scenario.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// Some particles: those in a region, where they are now, and those of a set.
template <int Dim>
struct ParticleGroup {
  std::function<bool(const Vec<Dim>& x)> region = {};  ///< empty = none
  std::vector<Index> members = {};  ///< ids that this process has; the others have the others
};

/// At the beginning of a stage, in this order: particles are removed (or begin to go), others get
/// another material, displacements begin anew. Particles that are placed are rows of the model's
/// table.
template <int Dim>
struct StageChanges {
  struct Removal {
    ParticleGroup<Dim> of;
    double over = 0;  ///< [s] they go little by little (removal_in_time.h); 0 = at once
    bool takes_time() const { return over > 0; }
  };
  struct Material {
    ParticleGroup<Dim> of;
    std::uint16_t material;  ///< index into the materials
  };
  std::vector<Removal> removed;
  std::vector<Material> materials;
  bool reset_displacements = false, reset_strains = false;
  /// Some stage resets strains, changes parameters, or places particles, which may be of another
  /// law: strains do not follow from stresses in any.
  bool keeps_strains = false;
  /// Materials that this stage or one before gave to particles.
  std::vector<std::uint16_t> given = {};

  bool any() const {
    return !removed.empty() || !materials.empty() || reset_displacements || reset_strains;
  }
  bool takes_time() const { return ends_at() > 0; }
  /// [s] Of adaptive steps while something goes: a step takes not much of it.
  double longest_step() const {
    constexpr double least_steps = 20;
    double dt = std::numeric_limits<double>::infinity();
    for (const Removal& removal : removed)
      if (removal.takes_time()) dt = std::min(dt, removal.over / least_steps);
    return dt;
  }
  /// [s] When all that is removed is gone; 0 where nothing takes time.
  double ends_at() const {
    double end = 0;
    for (const Removal& removal : removed) end = std::max(end, removal.over);
    return end;
  }
};

}  // namespace lahar
