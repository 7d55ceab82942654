/// \file The layout of a patch's state in bytes (patch_state.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "physics/particles/patch.h"

namespace lahar {

/// First of all bytes: "Lahar" and the version of the layout. Bytes of a machine that orders them
/// the other way do not begin with it.
inline constexpr Index state_marker = 0x4c61686172'0003;

/// What a patch's state begins with.
struct StateHead {
  Index marker = state_marker;
  Index dim = 0, patch = 0;
  Index cells = 0, nodes = 0, rows = 0;  ///< of the patch, and of a particle
  Index slots = 0, bins = 0, particles = 0, active_nodes = 0;
  Index added_bins = 0, moving = 0, loads = 0;
  Index sums = 1;      ///< arrays of sums that are mapped for the next step
  Index impulses = 0;  ///< Patch::impulses
};
static_assert(std::has_unique_object_representations_v<StateHead>, "no padding");

/// A bin without what follows from the others.
struct PackedBin {
  Local cell, begin, end, limit;
  std::int32_t material, loaded;
};
static_assert(std::has_unique_object_representations_v<PackedBin>, "no padding");

inline std::size_t n_bytes(Index count, std::size_t size) {
  return static_cast<std::size_t>(count) * size;
}

/// Where the ids of the particles begin.
inline std::size_t ids_offset(const StateHead& head) {
  return sizeof(StateHead) + sizeof(PatchWork) + n_bytes(head.impulses, sizeof(Reaction)) +
         n_bytes(head.bins, sizeof(PackedBin));
}

inline std::size_t bytes_of(const StateHead& head) {
  return ids_offset(head) + n_bytes(head.particles, sizeof(Index)) +
         n_bytes(head.loads != 0 ? head.particles : 0, sizeof(std::uint64_t)) +
         n_bytes(head.rows * head.particles, sizeof(double)) +
         n_bytes(head.active_nodes * head.sums, sum_stride * sizeof(double));
}

/// Appends the bytes of values to memory that is large enough.
class StateWriter {
 public:
  explicit StateWriter(std::byte* to) : to_(to) {}
  template <class T>
  void put(const T* values, std::size_t n) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (n > 0) std::memcpy(to_, values, n * sizeof(T));
    to_ += n * sizeof(T);
  }
  template <class T>
  void put(const T& value) {
    put(&value, 1);
  }

 private:
  std::byte* to_;
};

/// The inverse; the size has been checked.
class StateReader {
 public:
  explicit StateReader(const std::byte* from) : from_(from) {}
  template <class T>
  void get(T* values, std::size_t n) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (n > 0) std::memcpy(values, from_, n * sizeof(T));
    from_ += n * sizeof(T);
  }
  template <class T>
  T get() {
    T value;
    get(&value, 1);
    return value;
  }

 private:
  const std::byte* from_;
};

}  // namespace lahar
