/// \file Parameters of materials that differ from place to place.
///
/// Laws have one value of each parameter. So a material with fields is split into classes: each has
/// a value of each field, and is an entry of Model::materials with the id and the name of the one
/// material. A particle gets its class by its place at the beginning. Kernels, files and messages
/// need not know. A field of 64 classes is right to 0.8 % of the range of its values.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// One parameter of a material.
template <int Dim>
struct MaterialField {
  std::string key;
  double mean;                                     ///< for what needs one value of the material
  std::vector<double> values;                      ///< of the classes
  std::function<int(const Vec<Dim>& x)> class_of;  ///< from 0 to values.size() - 1; -1 = unknown
};

}  // namespace lahar
