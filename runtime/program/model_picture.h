/// \file The picture that `lahar check --picture` draws: plan and sections of a model with its
/// materials, mesh, constraints, loads, gravity and water table.
#pragma once

#include <string>
#include <vector>

#include "io/scenario/model_marks.h"
#include "physics/model/model.h"

namespace lahar {

/// As SVG. Its size is bounded for any number of particles, cells and nodes.
std::string model_picture(const AnyModel& model, const std::vector<ModelMark>& marks);

}  // namespace lahar
