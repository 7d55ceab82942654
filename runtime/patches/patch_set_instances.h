/// \file The last #include of sources that define members of PatchSet: instantiates them, once
/// where sources are compiled together.
#pragma once

#include "runtime/patches/patch_set.h"

namespace lahar {

template class PatchSet<2>;
template class PatchSet<3>;

}  // namespace lahar
