/// \file The last #include of sources that define members of SimulationDriver: instantiates them,
/// once where sources are compiled together.
#pragma once

#include "runtime/step/simulation_driver.h"

namespace lahar {

template class SimulationDriver<2>;
template class SimulationDriver<3>;

}  // namespace lahar
