/// \file The particles of a patch where they lie in memory, for programs that look at them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

template <int Dim>
struct Patch;

/// Component k of slot p is first[k * stride + p].
struct PatchColumn {
  const char* name;  ///< as in column_table
  const char* unit;
  int components;  ///< as stored: 2D stress xx yy zz xy, 2D strain xx yy xy (zz: strain_across)
  const double* first;
  std::size_t stride;
};

/// Good until the next step, while no step is taken.
struct PatchParticles {
  Index patch = 0;
  std::span<const Index> id = {};                  ///< by slot
  std::span<const std::uint16_t> material = {};    ///< by slot: index into Model::materials
  std::vector<std::pair<Local, Local>> bins = {};  ///< slots [first, second) are in use
  std::vector<PatchColumn> columns = {};
};

/// Between steps, when nobody is on the way to a neighbour.
template <int Dim>
PatchParticles particles_in_place(const Patch<Dim>& patch);

}  // namespace lahar
