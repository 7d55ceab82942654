/// \file What happens to particles between two stages of a scenario.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// Some particles: those in a region, where they are now, and those of a set.
template <int Dim>
struct ParticleGroup {
  std::function<bool(const Vec<Dim>& x)> region = {};  ///< empty = none
  std::vector<Index> members = {};  ///< ids that this process has; the others have the others
};

/// At the beginning of a stage, in this order: particles are removed, others get another material,
/// displacements begin anew. Particles that are placed are rows of the model's table.
template <int Dim>
struct StageChanges {
  struct Material {
    ParticleGroup<Dim> of;
    std::uint16_t material;  ///< index into the materials
  };
  std::vector<ParticleGroup<Dim>> removed;
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
};

}  // namespace lahar
