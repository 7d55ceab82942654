/// \file How a linear system was solved.
#pragma once

#include <string>

namespace lahar {

struct SolveResult {
  bool converged = false;
  int iterations = 0;   ///< 0 = direct
  double residual = 0;  ///< |b - A x| / |b|, of the x that is left
  std::string problem;  ///< where it did not converge: why
};

}  // namespace lahar
