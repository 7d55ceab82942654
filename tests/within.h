/// \file Bounds of measured quantities that are shares of what is expected.
#pragma once

#include <doctest/doctest.h>

namespace lahar::test {

/// Equal to numbers that differ from `of` by less than a share of the greater of the two; `of` must
/// not be 0. (`doctest::Approx(of).epsilon(share)` allows share * (1 + |of|): much more, if `of` is
/// small.)
inline doctest::Approx within(double share, double of) {
  return doctest::Approx(of).epsilon(share).scale(0);
}

}  // namespace lahar::test
