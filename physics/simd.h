/// \file Packs of doubles: kernels are templates on a Real that is a pack of one or more lanes.
#pragma once

#include <experimental/simd>

#include "physics/types.h"

namespace lahar {

namespace stdx = std::experimental;

using Pack = stdx::native_simd<double>;                          ///< production: the widest vector
using Scalar = stdx::simd<double, stdx::simd_abi::scalar>;      ///< tests: one lane

template <class Real>
inline constexpr int lanes = static_cast<int>(Real::size());

/// The first `n` lanes.
template <class Real>
typename Real::mask_type first_lanes(Local n) {
  const Real index([](auto i) { return static_cast<double>(i); });
  return index < static_cast<double>(n);
}

template <class Real>
Real load(const double* p) {
  return Real(p, stdx::element_aligned);
}

/// Store the lanes of `mask`; memory of other lanes is untouched.
template <class Real>
void store(const Real& value, double* p, const typename Real::mask_type& mask) {
  stdx::where(mask, value).copy_to(p, stdx::element_aligned);
}

/// Components that are smaller than `threshold` in magnitude become zero.
template <class Real>
void flush_below(Real& value, double threshold) {
  stdx::where(stdx::abs(value) < threshold, value) = Real(0.0);
}

}  // namespace lahar
