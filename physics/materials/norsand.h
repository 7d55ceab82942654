/// \file NorSand: the law, its implicit step, and the one of CB-Geo MPM.
#pragma once

#include "physics/materials/norsand_cbgeo.h"
#include "physics/materials/norsand_law.h"
#include "physics/materials/norsand_return.h"
