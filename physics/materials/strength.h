/// \file The strength of soils, reduced by a factor.
#pragma once

#include "physics/materials/materials.h"

namespace lahar {

/// Divide the strength of a law: cohesion, tan(friction), tension and yield stress. Dilation does
/// not exceed friction. False: the law has no strength of this kind, and stays as it is.
bool reduce_strength(Law& law, double factor);

}  // namespace lahar
