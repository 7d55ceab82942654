/// \file The initial particles of all ranks: what everyone must know of them, and the way of each
/// to the rank that owns its patch. All functions but set_loads() and
/// keep_share() are collective.
#pragma once

#include <functional>
#include <vector>

#include "physics/mesh/partition.h"
#include "physics/model/model.h"
#include "runtime/comm/communicator.h"

namespace lahar {

/// What all ranks must know of the particles of all before they cut the mesh. The same on every
/// rank, and on any number of ranks.
struct ParticleCensus {
  Index particles = 0;
  Index next_id = 0;         ///< above all ids
  Index occupied_cells = 0;  ///< cells with particles
  bool stressed = false;     ///< initial stresses are given
  std::vector<char> used;    ///< by material: some particle is made of it, or will be
};
template <int Dim>
ParticleCensus take_census(const Model<Dim>& model, const Communicator& ranks);

/// Particles in each patch.
template <int Dim>
std::vector<Index> particles_of_patches(const ParticleTable<Dim>& particles,
                                        const Partition<Dim>& partition, const Communicator& ranks);

/// Fill in ParticleTable::loads from the lists of particles of tractions and prescribed velocities,
/// which are released; nothing where there are none, or where it is done. Throws InputError for
/// more of them than there are bits.
template <int Dim>
void set_loads(Model<Dim>& model);

/// Keep an equal part of a table of all particles that every rank has; the part has ids then. Loads
/// are to be set before.
template <int Dim>
void keep_share(ParticleTable<Dim>& particles, const Communicator& ranks);

/// Send every row to the rank `owner(row)`, which is asked before anything is sent. The table is
/// then that of the rows that this rank owns, with ascending ids. Columns go one after the other,
/// so that there are never two whole tables in memory.
template <int Dim>
void send_to_owners(ParticleTable<Dim>& particles, const std::function<int(std::size_t)>& owner,
                    const Communicator& ranks);

#define LAHAR_DECLARE(Dim)                                                                         \
  extern template ParticleCensus take_census(const Model<Dim>&, const Communicator&);              \
  extern template std::vector<Index> particles_of_patches(                                         \
      const ParticleTable<Dim>&, const Partition<Dim>&, const Communicator&);                      \
  extern template void set_loads(Model<Dim>&);                                                     \
  extern template void keep_share(ParticleTable<Dim>&, const Communicator&);                       \
  extern template void send_to_owners(ParticleTable<Dim>&, const std::function<int(std::size_t)>&, \
                                      const Communicator&);
LAHAR_DECLARE(2)
LAHAR_DECLARE(3)
#undef LAHAR_DECLARE

}  // namespace lahar
