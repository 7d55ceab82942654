/// \file How a linear system was solved.
#pragma once

#include <string>

#include "physics/base/types.h"

namespace lahar {

/// Products of the matrix with a vector that iterations with the diagonal took, of this rank.
struct ProductCost {
  Index count = 0;
  double seconds = 0;  ///< of all tasks
  /// [B] that they cannot avoid to move: each number of the matrix and of both vectors once.
  double bytes = 0;

  ProductCost& operator+=(const ProductCost& other) {
    count += other.count;
    seconds += other.seconds;
    bytes += other.bytes;
    return *this;
  }
};

struct SolveResult {
  bool converged = false;
  int iterations = 0;   ///< all that were taken; 0 = direct
  double residual = 0;  ///< |b - A x| / |b|, of the x that is left
  std::string problem;  ///< where it did not converge: the method, and why
  ProductCost products;
  bool multigrid = false;  ///< the last iterations had a multigrid cycle
};

}  // namespace lahar
