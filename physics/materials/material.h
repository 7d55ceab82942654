/// \file A material of a model: its law, and what is the same for all laws.
#pragma once

#include <string>

#include "physics/base/types.h"
#include "physics/materials/materials.h"

namespace lahar {

struct Material {
  Index id = 0;        ///< as in the scenario
  std::string name;    ///< as in the scenario; the id's digits where it has no name
  double density = 0;  ///< [kg/m^3] initial
  int body = 0;        ///< of Contact::bodies
  Law law;
};

}  // namespace lahar
