/// \file The state of one patch as bytes: what a checkpoint keeps of it, and what travels when it
/// goes to another rank.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "physics/particles/patch.h"

namespace lahar {

/// The state of a patch between two steps, when no particle is on its way: outboxes, `unmapped` and
/// `movers` are empty. `step` is the number of steps done. Equal states give equal bytes, whatever
/// threads, ranks, allocations and rebuilds came before: no free slots, no padding, nothing that
/// follows from the rest or is computed anew before it is read.
template <int Dim>
std::vector<std::byte> pack(const Patch<Dim>& patch, Index step);

/// Size of what pack() returns.
template <int Dim>
std::size_t packed_bytes(const Patch<Dim>& patch);

/// The same as pack() returns, into memory for packed_bytes().
template <int Dim>
void pack(const Patch<Dim>& patch, Index step, std::byte* to);

/// Change the ids of the particles in what pack() returned.
void change_ids(std::span<std::byte> bytes, const std::function<void(std::span<Index>)>& change);

/// What a state may ask for.
struct StateBounds {
  std::size_t materials = 0;  ///< of the model
  double memory = 0;          ///< [bytes] for its slots, of which free ones take none in a file
  bool sums = true;           ///< false: sums of nodes are not read, but mapped anew
};

/// Bring a patch as PatchSet makes it, with topology and geometry but no particles, into the state
/// of pack(): all further steps have the same bits. Neighbours are to be linked afterwards. Throws
/// IoError if the bytes are not a state of this patch within the bounds.
template <int Dim>
void unpack(std::span<const std::byte> bytes, Patch<Dim>& patch, Index step,
            const StateBounds& bounds);

/// Whether a patch has a state: others are as new, and need not be kept.
template <int Dim>
bool has_state(const Patch<Dim>& patch) {
  return patch.count > 0 || patch.work != PatchWork{} ||
         std::any_of(patch.impulses.begin(), patch.impulses.end(),
                     [](const Reaction& impulse) { return impulse != Reaction{}; });
}

/// The columns of a particle that pack() writes, and their components, as text: two that are equal
/// understand each other.
template <int Dim>
std::string column_text(const ColumnLayout<Dim>& layout);

extern template std::vector<std::byte> pack(const Patch<2>&, Index);
extern template std::vector<std::byte> pack(const Patch<3>&, Index);
extern template void pack(const Patch<2>&, Index, std::byte*);
extern template void pack(const Patch<3>&, Index, std::byte*);
extern template std::size_t packed_bytes(const Patch<2>&);
extern template std::size_t packed_bytes(const Patch<3>&);
extern template void unpack(std::span<const std::byte>, Patch<2>&, Index, const StateBounds&);
extern template void unpack(std::span<const std::byte>, Patch<3>&, Index, const StateBounds&);
extern template std::string column_text(const ColumnLayout<2>&);
extern template std::string column_text(const ColumnLayout<3>&);

}  // namespace lahar
