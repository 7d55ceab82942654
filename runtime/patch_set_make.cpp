/// \file A patch as it is without particles.
#include <algorithm>

#include "physics/contact.h"
#include "physics/support.h"
#include "runtime/patch_constraints.h"
#include "runtime/patch_set.h"

namespace lahar {

/// Nodes and cells as kernels see them: with those of wider functions, and once for each body.
template <int Dim>
PatchTopology<Dim> PatchSet<Dim>::topology_of(Index id) const {
  const Mesh<Dim>& mesh = *model_->mesh;
  PatchTopology<Dim> topology = make_topology(mesh, partition_, id, rings_);
  add_support(mesh, model_->analysis, topology);
  repeat_for_bodies(topology, model_->analysis.contact.bodies, mesh.n_nodes());
  return topology;
}

template <int Dim>
std::unique_ptr<Patch<Dim>> PatchSet<Dim>::make_patch(Index id) const {
  auto patch = std::make_unique<Patch<Dim>>();
  const Mesh<Dim>& mesh = *model_->mesh;
  patch->topology = topology_of(id);
  set_bodies(*patch, *model_);
  patch->basis = basis_kind(mesh, model_->analysis);
  patch->element = mesh.element();
  patch->particles = Particles<Dim>(layout_);
  patch->cartesian = mesh.is_cartesian();
  const auto& cells = patch->topology.cells;
  const auto& nodes = patch->topology.nodes;
  patch->local_cell.reserve(cells.size());
  for (std::size_t c = 0; c < cells.size(); ++c) {
    patch->local_cell.try_emplace(cells[c], static_cast<Local>(c));
    patch->cell_size.push_back(mesh.cell_size(cells[c]));
    if (!patch->cartesian) continue;
    const CellGeometry<Dim> geometry = mesh.geometry(cells[c]);
    auto& box = patch->box.emplace_back();
    for (int d = 0; d < Dim; ++d) {
      box[static_cast<std::size_t>(d)] = geometry.centre[d];
      box[static_cast<std::size_t>(Dim + d)] = 2.0 / geometry.length[d];
    }
  }
  patch->smallest_cell = *std::min_element(patch->cell_size.begin(), patch->cell_size.end());
  const std::size_t size = nodes.size() * node_width;
  if (!patch->cartesian || needs_node_positions(model_->analysis)) {
    patch->node_position.assign(size, 0.0);
    for (std::size_t i = 0; i < nodes.size(); ++i)
      Eigen::Map<Vec<Dim>>(&patch->node_position[i * node_width]) =
          mesh.node(nodes[i] % mesh.n_nodes());
  }
  set_constraints(*patch, *model_);
  // Whatever cuts were made, cells are looked for, not patches.
  for (std::size_t c = 0; c < cells.size() / patch->bodies(); ++c) {
    const auto [first, last] = std::equal_range(injections_.begin(), injections_.end(), cells[c],
                                                CellInjection::ByCell{});
    for (auto at = first; at != last; ++at) {
      InjectionCell& cell = patch->injection_cells.emplace_back(at->at);
      cell.cell = patch->cell_of(static_cast<Local>(c),
                                 model_->injections[cell.generator].material);
    }
  }
  std::sort(patch->injection_cells.begin(), patch->injection_cells.end(),
            [](const auto& a, const auto& b) { return a.event < b.event; });
  for (std::size_t k = 0; k < n_sum_arrays; ++k)
    patch->sums[k].resize(static_cast<std::size_t>(copies_.of[k]));
  patch->idle = true;  // until particles come
  patch->clear_sums = 2;
  if (model_->analysis.damping > 0.0) patch->damping.assign(size, 0.0);
  if (model_->analysis.pressure_smoothing) patch->pressure.assign(nodes.size(), 0.0);
  return patch;
}

#define LAHAR_INSTANTIATE(Dim)                                         \
  template PatchTopology<Dim> PatchSet<Dim>::topology_of(Index) const; \
  template std::unique_ptr<Patch<Dim>> PatchSet<Dim>::make_patch(Index) const;
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
