/// \file A stationary Gaussian random field as a pure function of its seed and the place: the same
/// wherever and in whatever order it is asked for.
#pragma once

#include <cstdint>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// Mean 0, standard deviation 1, by a sum of cosines whose wave vectors are drawn from the spectrum
/// of the correlation (Shinozuka & Deodatis 1991; Mantoglou & Wilson 1982):
///
///     xi(x) = sqrt(2 / N) sum_k cos(omega_k . x + phi_k)
///
/// With distances t_d along the axes and correlation lengths l_d (scales of fluctuation: the
/// integral of the correlation over a line, Vanmarcke 1977) the correlation is the product over d
/// of exp(-pi (t_d / l_d)^2), or of exp(-2 |t_d| / l_d).
template <int Dim>
class RandomField {
 public:
  enum class Correlation { gaussian, exponential };
  RandomField(std::uint64_t seed, const Vec<Dim>& length, Correlation correlation);

  double operator()(const Vec<Dim>& x) const;

 private:
  struct Wave {
    Vec<Dim> turns;  ///< [1/m] omega / (2 pi)
    double phase;    ///< [-] phi / (2 pi)
  };
  std::vector<Wave> waves_;
};

extern template class RandomField<2>;
extern template class RandomField<3>;

}  // namespace lahar
