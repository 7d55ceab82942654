/// \file Sums of doubles that do not depend on the order of their terms.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "physics/base/types.h"

namespace lahar {

/// The exact sum of doubles, as a fixed-point number that spans all of their range (U. Kulisch,
/// "Computer arithmetic and validity", 2008, chapter 8): digits of 32 bits in integers of 64, whose
/// sums over threads and ranks are sums of integers. Up to 2^30 terms. value() is the double
/// nearest to the exact sum.
class ExactSum {
 public:
  /// Digits, and one element that counts terms that are not finite.
  static constexpr int size = 68;

  ExactSum() = default;
  explicit ExactSum(std::span<const Index, size> elements) {
    std::copy(elements.begin(), elements.end(), digit_.begin());
  }
  std::span<const Index, size> elements() const { return digit_; }

  ExactSum& operator+=(double term) {
    if (!std::isfinite(term)) {
      ++digit_.back();
      return *this;
    }
    const auto bits = std::bit_cast<std::uint64_t>(term);
    const auto exponent = static_cast<int>(bits >> 52 & 0x7ff);
    std::uint64_t mantissa = bits & ((std::uint64_t{1} << 52) - 1);
    if (exponent > 0) mantissa |= std::uint64_t{1} << 52;
    const int position = exponent > 0 ? exponent - 1 : 0;  // of bit 0, in units of 2^-1074
    const auto first = static_cast<std::size_t>(position / digit_bits);
    const int shift = position % digit_bits;
    const std::uint64_t low = mantissa << shift;  // the mantissa may reach into a third digit
    const std::uint64_t high = shift > 0 ? mantissa >> (64 - shift) : 0;
    const Index sign = term < 0 ? -1 : 1;
    digit_[first] += sign * static_cast<Index>(low & mask);
    digit_[first + 1] += sign * static_cast<Index>(low >> digit_bits);
    digit_[first + 2] += sign * static_cast<Index>(high);
    return *this;
  }

  ExactSum& operator+=(const ExactSum& other) {
    for (std::size_t i = 0; i < digit_.size(); ++i) digit_[i] += other.digit_[i];
    return *this;
  }

  double value() const {
    if (digit_.back() != 0) return std::numeric_limits<double>::quiet_NaN();
    auto digit = normalised(1);
    const bool negative = digit[top] < 0;
    if (negative) digit = normalised(-1);
    int first = top;
    while (first > 0 && digit[static_cast<std::size_t>(first)] == 0) --first;
    const double magnitude = rounded(digit, first);
    return negative ? -magnitude : magnitude;
  }

 private:
  static constexpr int digit_bits = 32, top = size - 2;
  static constexpr std::uint64_t mask = 0xffffffff;
  using Digits = std::array<Index, size>;

  /// Digits in [0, 2^32) but for the highest, which has the sign.
  Digits normalised(Index factor) const {
    Digits digit = digit_;
    Index carry = 0;
    for (std::size_t i = 0; i < top; ++i) {
      const Index sum = factor * digit[i] + carry;
      carry = sum >> digit_bits;
      digit[i] = sum & static_cast<Index>(mask);
    }
    digit[top] = factor * digit[top] + carry;
    return digit;
  }

  /// A number whose highest digit other than zero is `first`. 64 bits of it, the last of which
  /// stands for all that is cut off, round as the whole does.
  static double rounded(const Digits& digit, int first) {
    const auto at = [&](int i) {
      return i >= 0 ? static_cast<std::uint64_t>(digit[static_cast<std::size_t>(i)]) : 0;
    };
    const int zeros = std::countl_zero(static_cast<std::uint32_t>(at(first)));
    std::uint64_t bits = at(first) << digit_bits | at(first - 1);
    std::uint64_t rest = at(first - 2);
    int exponent = (first - 1) * digit_bits - 1074;
    if (zeros > 0) {
      bits = bits << zeros | rest >> (digit_bits - zeros);
      rest = rest << zeros & mask;
      exponent -= zeros;
    }
    for (int i = first - 3; i >= 0; --i) rest |= at(i);
    if (exponent < -1074) {  // few digits: exact, and perhaps subnormal
      bits >>= std::min(63, -1074 - exponent);
      exponent = -1074;
    } else if (rest != 0) {
      bits |= 1;
    }
    return std::ldexp(static_cast<double>(bits), exponent);
  }

  Digits digit_{};
};

}  // namespace lahar
