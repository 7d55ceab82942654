/// \file A material of a model: its law, and what is the same for all laws.
#pragma once

#include <optional>
#include <string>

#include "physics/base/types.h"
#include "physics/materials/materials.h"
#include "physics/materials/pore_liquid.h"

namespace lahar {

struct Material {
  Index id = 0;        ///< as in the scenario
  std::string name;    ///< as in the scenario; the id's digits where it has no name
  double density = 0;  ///< [kg/m^3] initial; with a pore liquid of the grains alone, by the volume
                       ///< that they have with their pores
  int body = 0;        ///< of Contact::bodies
  Law law;
  std::optional<PoreLiquid> liquid = {};  ///< in its pores
};

}  // namespace lahar
