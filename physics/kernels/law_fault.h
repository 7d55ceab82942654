/// \file A particle for which its law found no stress.
#pragma once

#include "physics/particles/patch.h"

namespace lahar {

/// Note particle p of a bin in `fault`, unless something else is there; further ones are counted.
/// `stress_before(k)` is its stress before the increment [Pa].
template <int Dim, class Stress>
void note_law_fault(ParticleFault& fault, const Patch<Dim>& patch, const ParticleBin& bin, Local p,
                    Stress stress_before) {
  if (fault.kind == ParticleFault::Kind::law) ++fault.count;
  if (fault.kind != ParticleFault::Kind::none) return;
  fault.kind = ParticleFault::Kind::law;
  fault.particle = patch.particles.id[static_cast<std::size_t>(p)];
  fault.material = bin.material;
  fault.count = 1;
  for (std::size_t k = 0; k < stress_components<Dim>; ++k) fault.stress[k] = stress_before(k);
  for (int d = 0; d < Dim; ++d) {
    const auto at = static_cast<std::size_t>(d);
    fault.position[at] = patch.particles.row(Column::x, d)[p];
    fault.velocity[at] = patch.particles.row(Column::v, d)[p];
  }
}

}  // namespace lahar
