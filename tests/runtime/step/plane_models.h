/// \file Models in two dimensions that deform across their plane.
#pragma once

#include <algorithm>

#include "tests/runtime/step/models.h"

namespace lahar::test {

/// The same body as a sheet, or as one of revolution around x = 0.
inline Model<2> with_plane(Model<2> model, Plane plane) {
  model.analysis.plane = plane;
  if (plane != Plane::axisymmetric) return model;
  for (std::size_t p = 0; p < model.particles.x.size(); ++p)
    model.particles.volume[p] *= depth_at(model.analysis, model.particles.x[p][0]);
  auto& held = entries_of<NodeVelocity>(model);
  std::erase_if(held, [&](const NodeVelocity& v) {
    return v.dir == 0 && model.mesh->node(v.node)[0] < 1e-9;
  });
  for (Index node = 0; node < model.mesh->n_nodes(); ++node)
    if (model.mesh->node(node)[0] < 1e-9) held.push_back({node, 0, 0.0});
  std::stable_sort(held.begin(), held.end(), [](const auto& a, const auto& b) {
    return std::pair(a.node, a.dir) < std::pair(b.node, b.dir);
  });
  return model;
}

}  // namespace lahar::test
