/// \file The last #include of sources that define members of ScenarioBuilder: instantiates them,
/// once where sources are compiled together.
#pragma once

#include "io/scenario/scenario_builder.h"

namespace lahar {

template class ScenarioBuilder<2>;
template class ScenarioBuilder<3>;

}  // namespace lahar
