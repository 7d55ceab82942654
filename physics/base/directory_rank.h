/// \file Which of several processes keeps what is said of a node or cell before patches ask for it.
#pragma once

#include <cstdint>

#include "physics/base/types.h"

namespace lahar {

/// The process, of `size`, that keeps what is said of a node or cell. All find the same without
/// asking. Ids are spread in small blocks at random, so that each process has about as many of any
/// part of the mesh, also of a face, whose ids have a regular distance.
inline int directory_rank(Index id, int size) {
  constexpr int block_bits = 6;  // ids that follow each other are mostly asked for together
  constexpr std::uint64_t golden = 0x9E3779B97F4A7C15u;  // 2^64 over the golden ratio (Knuth 1973)
  const std::uint64_t mixed = (static_cast<std::uint64_t>(id) >> block_bits) * golden;
  return static_cast<int>((mixed >> 32) * static_cast<std::uint64_t>(size) >> 32);
}

}  // namespace lahar
