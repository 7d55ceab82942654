/// \file Mohr-Coulomb: the law, and its return to the yield surface.
#pragma once

#include "physics/materials/mohr_coulomb_law.h"
#include "physics/materials/mohr_coulomb_return.h"
