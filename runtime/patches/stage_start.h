/// \file The state in which a run ended, as another run of the same particles begins with it.
#pragma once

#include <tsl/robin_map.h>

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "physics/particles/patch.h"
#include "runtime/comm/communicator.h"
#include "runtime/patches/simulation_state.h"

namespace lahar {

/// A patch's state (patch_state.h) for another run: no work has been done yet. Of
/// StateUse::other_run particles have the columns of `layout` instead of `columns` (column_text()):
/// those that they did not have are zero or follow from others, and they have no loads. A state
/// that is not one comes back as it is; unpack() says what is wrong with it.
template <int Dim>
std::vector<std::byte> state_for(StateUse use, std::vector<std::byte> state,
                                 const std::string& columns, const ColumnLayout<Dim>& layout);

/// Whether particles with these columns (column_text()) have one of them.
bool has_column(const std::string& columns, Column column);

/// The loads of a particle, as Particles::loads, and its edges, as ParticleTable::edges.
struct ParticleLoads {
  Index id;
  std::uint64_t loads;
  std::array<double, 3> edges{};
};

/// The loads of a table's particles. Particles without loads are left out.
template <int Dim>
std::vector<ParticleLoads> loads_in(const ParticleTable<Dim>& particles);

/// By particle.
using ParticleMarks = tsl::robin_map<Index, ParticleLoads>;

/// Of the particles in these patches, which some rank knows. Collective.
template <int Dim>
ParticleMarks marks_of(std::span<const std::unique_ptr<Patch<Dim>>> patches,
                       const std::vector<ParticleLoads>& marks, const Communicator& ranks);

/// Give particles in patches their loads, which some rank has. Collective.
template <int Dim>
void give_loads(std::span<const std::unique_ptr<Patch<Dim>>> patches,
                const std::vector<ParticleLoads>& loads, const Communicator& ranks);

/// State variables that follow from parameters, of particles whose materials may have others now.
template <int Dim>
void follow_parameters(Patch<Dim>& patch, std::span<const Material> materials);

/// Natural coordinates of particles in cells of a grid, from where they are.
template <int Dim>
void find_natural_coordinates(Patch<Dim>& patch);

#define LAHAR_DECLARE(Dim)                                                                        \
  extern template std::vector<std::byte> state_for(StateUse, std::vector<std::byte>,              \
                                                   const std::string&, const ColumnLayout<Dim>&); \
  extern template std::vector<ParticleLoads> loads_in(const ParticleTable<Dim>&);                 \
  extern template ParticleMarks marks_of(std::span<const std::unique_ptr<Patch<Dim>>>,            \
                                         const std::vector<ParticleLoads>&, const Communicator&); \
  extern template void give_loads(std::span<const std::unique_ptr<Patch<Dim>>>,                   \
                                  const std::vector<ParticleLoads>&, const Communicator&);        \
  extern template void follow_parameters(Patch<Dim>&, std::span<const Material>);                 \
  extern template void find_natural_coordinates(Patch<Dim>&);
LAHAR_DECLARE(2)
LAHAR_DECLARE(3)
#undef LAHAR_DECLARE

}  // namespace lahar
