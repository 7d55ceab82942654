/// \file From a checked entry of materials[] to a law.
#pragma once

#include "io/scenario/scenario_input.h"
#include "physics/materials/materials.h"

namespace lahar {

/// The law that an object of materials_section() describes. Parameters that make no sense together
/// are reported.
Law read_law(const JsonValue& material, ScenarioInput& in);

}  // namespace lahar
