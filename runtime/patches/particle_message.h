/// \file Particles on their way to another rank, as bytes: each with the patch that it goes to, its
/// cell, id, loads and material, then its columns.
#pragma once

#include <cstddef>

#include "runtime/patches/patch_set.h"

namespace lahar {

template <int Dim>
std::size_t bytes_per_particle(const ColumnLayout<Dim>& layout) {
  return (5 + static_cast<std::size_t>(layout.rows())) * sizeof(double);
}

/// How many particles a patch has for another rank.
template <int Dim>
Index leaving_particles(const Patch<Dim>& from, const RemoteNeighbour& neighbour);

/// Write them to `to`.
template <int Dim>
void write_particles(const Patch<Dim>& from, const RemoteNeighbour& neighbour, std::byte* to);

/// Put `count` particles into the outboxes of the patch that sent them.
template <int Dim>
void read_particles(const std::byte* bytes, Index count, RemotePatch<Dim>& from);

/// Forget the particles that a patch elsewhere sent: they have been received.
template <int Dim>
void clear(RemotePatch<Dim>& from);

}  // namespace lahar
