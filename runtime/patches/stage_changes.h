/// \file What a stage of a scenario does to the particles of the stage before, when it begins.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "physics/particles/patch.h"
#include "runtime/comm/communicator.h"
#include "runtime/patches/changed_particles.h"

namespace lahar {

/// Particles of a patch that belong to a group.
struct ParticleTally {
  Index patch, group;
  Index particles = 0;
  double mass = 0;  ///< [kg]
};
/// By group, added up in the order of patches: the same for any ranks. Collective.
std::vector<ParticleCount> sum_up(const std::vector<ParticleTally>& own, std::size_t groups,
                                  const Communicator& ranks);

/// With the liquid in its pores [kg].
template <int Dim>
double total_mass(const Particles<Dim>& particles, Local p, const Material& material);

/// Do the changes to particles in patches, whose state is that of the stage before. The order of
/// those that stay is kept, so that the result does not depend on ranks. Collective. Throws
/// InputError for more groups than there are bits.
template <int Dim>
ChangedParticles change_particles(std::span<const std::unique_ptr<Patch<Dim>>> patches,
                                  const Model<Dim>& model, const Communicator& ranks);

/// Take over the particles of a patch that was made for them alone, after those that there are.
template <int Dim>
void add_particles(Patch<Dim>& patch, const Patch<Dim>& from);

/// Leave only the rows of particles with ids from `first` on. The table then has ids.
template <int Dim>
void keep_rows_from(ParticleTable<Dim>& particles, Index first);

#define LAHAR_DECLARE(Dim)                                                                        \
  extern template ChangedParticles change_particles(std::span<const std::unique_ptr<Patch<Dim>>>, \
                                                    const Model<Dim>&, const Communicator&);      \
  extern template void add_particles(Patch<Dim>&, const Patch<Dim>&);                             \
  extern template double total_mass(const Particles<Dim>&, Local, const Material&);               \
  extern template void keep_rows_from(ParticleTable<Dim>&, Index);
LAHAR_DECLARE(2)
LAHAR_DECLARE(3)
#undef LAHAR_DECLARE

}  // namespace lahar
