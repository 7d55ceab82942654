/// \file A patch as it is without particles.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/base/text.h"
#include "physics/basis/support.h"
#include "physics/contact/contact.h"
#include "physics/kernels/node_supports.h"
#include "physics/mesh/partition_common.h"
#include "physics/model/transfer_options.h"
#include "physics/particles/node_space.h"
#include "runtime/patches/patch_constraints.h"
#include "runtime/patches/patch_set.h"

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
void PatchSet<Dim>::need_memory(std::span<const Index> ids, std::span<const Index> occupied,
                                Index particles) const {
  if (!std::isfinite(memory_.bytes)) return;
  const Mesh<Dim>& mesh = *model_->mesh;
  const double bodies = model_->analysis.contact.bodies;
  // A cell's id and its place, nodes, measures, with gaps one more; a node's id, and where it has
  // sums these and what follows from them: velocity and acceleration.
  const std::size_t measures = 2 * Dim + (layout_.has(Column::opening) ? 2 : 1);
  const auto cell_bytes = static_cast<double>(3 * sizeof(Index) + corners<Dim> * sizeof(Local) +
                                              measures * sizeof(double));
  double copies = 2;
  for (const int of : copies_.of) copies += of;
  const double sum_bytes = copies * node_width * sizeof(double);
  double cells = 0, nodes = 0, nodes_with_sums = 0;
  auto next = occupied.begin();
  for (const Index id : ids) {
    double own_cells = 1, own_nodes = 1;
    if (mesh.is_structured()) {
      const Brick brick = partition_.brick(id);
      for (std::size_t d = 0; d < Dim; ++d) {
        const auto width = static_cast<double>(brick.high[d] - brick.low[d]);
        own_cells *= width;
        own_nodes *= width + 1;
      }
    } else {
      own_cells = static_cast<double>(mesh.n_cells()) / static_cast<double>(partition_.n_patches());
      own_nodes =
          own_cells * static_cast<double>(mesh.n_nodes()) / static_cast<double>(mesh.n_cells());
    }
    cells += own_cells;
    nodes += own_nodes;
    next = std::lower_bound(next, occupied.end(), id);
    if (next != occupied.end() && *next == id) nodes_with_sums += own_nodes;
  }
  const double bytes =
      bodies * (cells * cell_bytes + nodes * sizeof(Index) + nodes_with_sums * sum_bytes) +
      static_cast<double>(ids.size() * sizeof(Patch<Dim>)) +
      static_cast<double>(particles) * layout_.rows() * sizeof(double);
  if (const double most = ranks_.max(bytes); most > memory_.bytes) {
    Problem problem = too_much_memory(
        most, fmt::format("the patches{}", ranks_.several() ? " of a rank" : ""), memory_);
    problem.message +=
        fmt::format(" ({} particles and {} patches in all)", format_count(census_.particles),
                    format_count(static_cast<Index>(all_.size())));
    problem.where = "/mesh";
    throw InputError({problem});
  }
}

template <int Dim>
std::unique_ptr<Patch<Dim>> PatchSet<Dim>::make_patch(Index id) const {
  auto patch = std::make_unique<Patch<Dim>>();
  const Mesh<Dim>& mesh = *model_->mesh;
  patch->topology = topology_of(id);
  set_bodies(*patch, *model_);
  patch->basis = basis_kind(mesh, model_->analysis);
  patch->element = mesh.element();
  patch->lagrange_functions = model_->analysis.lagrange_functions;
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
  if (layout_.has(Column::opening)) patch->space = space_around_cells(patch->topology, *model_);
  patch->smallest_cell = *std::min_element(patch->cell_size.begin(), patch->cell_size.end());
  const std::size_t size = nodes.size() * node_width;
  if (!patch->cartesian || needs_node_positions(model_->analysis)) {
    patch->node_position.assign(size, 0.0);
    for (std::size_t i = 0; i < nodes.size(); ++i)
      Eigen::Map<Vec<Dim>>(&patch->node_position[i * node_width]) =
          mesh.node(nodes[i] % mesh.n_nodes());
  }
  for (std::size_t k = 0; k < n_sum_arrays; ++k)
    patch->sums[k].resize(static_cast<std::size_t>(copies_.of[k]));
  patch->idle = true;  // until particles come
  patch->clear_sums = 2;
  if (model_->analysis.damping > 0.0) patch->damping.assign(size, 0.0);
  if (model_->analysis.pressure_smoothing) patch->pressure.assign(nodes.size(), 0.0);
  if (model_->analysis.two_phase) {
    for (NodeArray* values : {&patch->liquid.velocity, &patch->liquid.acceleration,
                              &patch->liquid.force, &patch->liquid.drag})
      values->assign(size, 0.0);
    patch->liquid.pressure.assign(nodes.size(), 0.0);
    if (has_nodal_porosity(model_->analysis)) {
      patch->liquid.discharge.assign(size, 0.0);
      patch->liquid.porosity.assign(nodes.size(), 0.0);
    }
    if (model_->analysis.liquid_advection) patch->liquid.advection.assign(nodes.size(), 0.0);
  }
  return patch;
}

namespace {

/// Fill Patch::injection_cells and injection_points.
template <int Dim>
void set_injections(Patch<Dim>& patch, const InjectedCells<Dim>& injected,
                    const std::vector<Injection<Dim>>& injections) {
  if (injected.cells.empty()) return;
  const auto& cells = patch.topology.cells;
  for (std::size_t c = 0; c < cells.size() / patch.bodies(); ++c) {
    auto at = std::lower_bound(injected.cells.begin(), injected.cells.end(), cells[c],
                               [](const auto& a, Index cell) { return a.cell < cell; });
    for (; at != injected.cells.end() && at->cell == cells[c]; ++at) {
      const Injection<Dim>& source = injections[at->generator];
      const auto first = injected.x.begin() + static_cast<std::ptrdiff_t>(at->first_point);
      patch.injection_cells.push_back(
          {.generator = at->generator,
           .event = at->event,
           .volume = at->volume,
           .cell = patch.cell_of(static_cast<Local>(c), source.material),
           .first_point = patch.injection_points.size()});
      patch.injection_points.insert(patch.injection_points.end(), first, first + source.per_cell);
    }
  }
  std::sort(patch.injection_cells.begin(), patch.injection_cells.end(),
            [](const auto& a, const auto& b) { return a.event < b.event; });
}

}  // namespace

/// Give patches that are new what is said of their nodes and cells. Collective.
template <int Dim>
void PatchSet<Dim>::set_conditions() {
  const Index n_nodes = model_->mesh->n_nodes();
  std::vector<Index> nodes, cells;
  const auto for_new = [&](auto&& visit) {
    for (const auto& patch : patches_)
      if (!patch->has_conditions) visit(*patch);
  };
  for_new([&](const Patch<Dim>& patch) {  // whatever cuts were made, cells are looked for
    const auto append = [&](std::vector<Index>& to, const std::vector<Index>& from) {
      const auto once = static_cast<std::ptrdiff_t>(from.size() / patch.bodies());
      to.insert(to.end(), from.begin(), from.begin() + once);
    };
    if (ranks_.several()) append(nodes, patch.topology.nodes);
    if (!model_->injections.empty()) append(cells, patch.topology.cells);
  });
  sort_unique(nodes);
  sort_unique(cells);
  const NodeConditions<Dim> elsewhere =
      ranks_.several() ? conditions_at<Dim>(nodes, *model_, ranks_) : NodeConditions<Dim>{};
  const NodeConditions<Dim>& conditions = ranks_.several() ? elsewhere : *model_;
  const InjectedCells<Dim> injected = injections_at(cells, injected_, model_->injections, ranks_);
  for_new([&](Patch<Dim>& patch) {
    set_constraints(patch, conditions, n_nodes);
    set_measured_nodes(patch, *model_);
    set_injections(patch, injected, model_->injections);
    patch.has_conditions = true;
  });
}

}  // namespace lahar

#include "runtime/patches/patch_set_instances.h"
