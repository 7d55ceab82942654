/// \file Some of the particles of a pack, as bits.
#pragma once

#include <array>
#include <bit>

#include "physics/base/simd.h"

namespace lahar {

/// Call take(lane) for every bit, in ascending order.
template <class Take>
LAHAR_INLINE void for_each_bit(unsigned bits, Take take) {
  for (; bits != 0; bits &= bits - 1) take(std::countr_zero(bits));
}

/// Bit per particle of the pack from `first` on, before `end`: any of these rows is not zero there.
template <class Row, std::size_t N>
LAHAR_INLINE unsigned not_zero(const std::array<Row, N>& rows, Local first, Local end) {
  unsigned bits = 0;
  for (const Row row : rows) bits |= outside(load<Pack>(row + first), 0.0, end - first);
  return bits;
}

}  // namespace lahar
