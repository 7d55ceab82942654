/// \file Lists in ascending order in which everything is there once.
#pragma once

#include <algorithm>
#include <vector>

namespace lahar {

template <class T>
void sort_unique(std::vector<T>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

}  // namespace lahar
