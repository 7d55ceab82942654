/// \file Nodes in projections. All copies of a node do the same arithmetic on the same sums.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "physics/basis/any_basis.h"
#include "physics/boundary/wall_axes.h"
#include "physics/kernels/kernels.h"
#include "physics/kernels/matrix_pattern.h"
#include "physics/kernels/pore_rows.h"
#include "physics/kernels/projection.h"
#include "physics/kernels/two_phase.h"
#include "physics/materials/law.h"
#include "physics/model/transfer_options.h"
#include "physics/particles/loads.h"
#include "physics/particles/node_space.h"
#include "physics/particles/node_sums.h"

namespace lahar {

template <int Dim>
std::vector<std::uint8_t> held_axes(const Patch<Dim>& patch, bool two_phase) {
  std::vector<std::uint8_t> axes(static_cast<std::size_t>(patch.n_nodes()), 0);
  const auto hold = [&](Local node, unsigned bit) {
    auto& of_node = axes[static_cast<std::size_t>(node)];
    of_node = static_cast<std::uint8_t>(of_node | bit);
  };
  for (const auto& fixed : two_phase ? patch.fixed_liquid : patch.fixed)
    hold(fixed.node, 1u << fixed.dir);
  if (two_phase) return axes;
  for (const ConstrainedNode<Dim>& wall : patch.walls)
    for (int k = 0; k < Dim; ++k) {
      const auto local = static_cast<std::size_t>(k);
      const auto axis = global_axis(wall, k);
      if (!wall.fixed[local] && wall.pushes[local] == 0) continue;
      hold(wall.node, axis ? 1u << axis->dir : held_askew<Dim>);
    }
  return axes;
}

namespace {

/// Rounding of sums of volumes, as a share of them.
constexpr double rounding = 1e-6;
constexpr std::uint8_t all_held = 0xff;
/// Crowded particles of a closed tank spread at this multiple of |D| (projection.h).
constexpr double spreading = 1.0;

/// The space of cells that particles fill, with equal parts for its nodes. With a free surface also
/// which cells these are: 2^k of the cell whose corner k the node is.
template <int Dim>
void add_filled_cells(Patch<Dim>& patch, const StepContext<Dim>& step) {
  double* sums = patch.own_sums(NodeSum::divergence, step.step);
  const bool has_surface = step.model->analysis.projection.free_surface;
  patch.projection.filled.assign(patch.first_bin.size(), 0.0);
  for (std::size_t c = 0; c < patch.first_bin.size(); ++c) {
    if (patch.first_bin[c] < 0) continue;
    const double volume = step.model->mesh->cell_volume(patch.topology.cells[c]);
    const double in_cell = volume_in(patch, c);
    patch.projection.filled[c] = in_cell / volume;
    if (!is_filled(*step.model, in_cell, volume)) continue;
    const auto nodes = patch.topology.element_nodes(c);
    for (const Local node : nodes)
      sums[static_cast<std::ptrdiff_t>(node) * sum_stride + 2] +=
          volume / static_cast<double>(nodes.size());
    if (!has_surface || patch.topology.corner_nodes.empty()) continue;
    const auto& corner = patch.topology.corner_nodes[c];
    for (std::size_t k = 0; k < corner.size(); ++k)
      sums[static_cast<std::ptrdiff_t>(corner[k]) * sum_stride + 3] += 1u << k;
  }
}

/// ProjectionNodes::ends.
template <int Dim>
std::vector<std::uint8_t> ends_of_mesh(const PatchTopology<Dim>& topology, const Mesh<Dim>& mesh) {
  constexpr unsigned all = (1u << Dim) - 1;
  std::vector<std::uint8_t> ends;
  ends.reserve(topology.nodes.size());
  for (const Index local : topology.nodes) {
    const Index node = local % mesh.n_nodes();
    unsigned below = 0, above = 0;  // some cell is there
    for (const Index cell : mesh.node_cells(node)) {
      const auto corner = mesh.cell_nodes_tensor(cell);
      for (unsigned k = 0; k < corner.size(); ++k)
        if (corner[k] == node) {
          below |= k;
          above |= ~k;
        }
    }
    ends.push_back(static_cast<std::uint8_t>(~(below & above) & all));
  }
  return ends;
}

/// Whether each cell around a node is filled or lies behind an axis along which the node is held,
/// seen from a filled one: the node is of a wall within the mesh, and not of a free surface.
/// `filled` as add_filled_cells() says it.
template <int Dim>
bool is_behind_wall(const Mesh<Dim>& mesh, Index node, unsigned filled, unsigned axes) {
  const auto is_hidden = [&](unsigned cell) {
    for (unsigned flips = 0; flips < corners<Dim>; ++flips)
      if ((flips & ~axes) == 0 && (filled >> (cell ^ flips) & 1u) != 0) return true;
    return false;
  };
  for (const Index cell : mesh.node_cells(node)) {
    const auto corner = mesh.cell_nodes_tensor(cell);
    for (unsigned k = 0; k < corner.size(); ++k)
      if (corner[k] == node && !is_hidden(k)) return false;
  }
  return true;
}

/// Cells of Q4 and H8 that have no particles, but mass at all nodes. A fluid without a free surface
/// fills them.
template <int Dim>
std::vector<char> voids_of(const Patch<Dim>& patch, const StepContext<Dim>& step) {
  const Analysis& analysis = step.model->analysis;
  const auto& corners_of = patch.topology.corner_nodes;
  if (analysis.projection.free_surface || analysis.two_phase || corners_of.empty()) return {};
  std::vector<char> voids(corners_of.size(), 0);
  for (std::size_t c = 0; c < voids.size(); ++c)
    voids[c] = volume_in(patch, c) == 0.0 &&
               std::all_of(corners_of[c].begin(), corners_of[c].end(), [&](Local node) {
                 return patch.node_is_active[static_cast<std::size_t>(node)] &&
                        at(patch.velocity, node)[mass_lane] > 0;
               });
  return voids;
}

/// Parts of a fluid that nothing joins to a free surface, such as those that voids separate, have a
/// pressure up to a constant each: a diagonal that is larger by so little gives them one.
template <int Dim>
void hold_islands(Patch<Dim>& patch) {
  constexpr double least = 1e-8;
  NodalSystem<Dim>& system = patch.system;
  for (std::size_t i = 0; i + 1 < system.first.size(); ++i)
    if (system.first[i] < system.first[i + 1]) {
      const auto node = static_cast<Local>(i);
      system.blocks[find_block(system, node, node)] *= 1.0 + least;
    }
}

/// Changes of the pressure where it is prescribed: at the beginning, and of fluids, from what is
/// kept to what is given. Later what is given in pores changes by itself: particles follow.
template <int Dim>
void give_pressures(Patch<Dim>& patch, const StepContext<Dim>& step) {
  patch.projection.change.assign(static_cast<std::size_t>(patch.n_nodes()), 0.0);
  if (patch.fixed_pressure.empty()) return;
  const SumOverPatches<Dim> kept(patch, NodeSum::kept_pressure, step.step);
  const double share = step.model->analysis.projection.kept;
  const bool follows = step.model->analysis.two_phase && !patch.projection.begins;
  const int lane = step.model->analysis.two_phase ? 0 : 1;
  for (const auto& fixed : patch.fixed_pressure) {
    const auto node = static_cast<std::size_t>(fixed.node);
    if (!patch.node_is_active[node]) continue;
    double change = pressure_given(*step.model, fixed, step.time + step.dt);
    const double mass = at(patch.velocity, fixed.node)[mass_lane];
    if (follows)
      change -= share * pressure_given(*step.model, fixed, step.time);
    else if (share > 0 && mass > 0)
      change -= kept.at(fixed.node)[lane] / mass;
    patch.projection.change[node] = change;
  }
}

/// ProjectionNodes::level without the change of the step.
template <int Dim>
void find_level(Patch<Dim>& patch, const StepContext<Dim>& step) {
  std::vector<double>& level = patch.projection.level;
  level.assign(static_cast<std::size_t>(patch.n_nodes()), 0.0);
  for_each_node(patch, SumOverPatches<Dim>(patch, NodeSum::kept_pressure, step.step),
                [&](Local i, const NodeVector&, const NodeVector& sum) {
                  const double mass = at(patch.velocity, i)[mass_lane];
                  if (mass > 0) level[static_cast<std::size_t>(i)] = sum[1] / mass;
                });
  for (const auto& fixed : patch.fixed_pressure)
    level[static_cast<std::size_t>(fixed.node)] = pressure_given(*step.model, fixed, step.time);
}

/// Whether a wall holds its node along local axis k: one-sided walls do where the node, with the
/// velocity v, moves as they do.
template <int Dim>
bool holds(const ConstrainedNode<Dim>& wall, int k, const Vec<Dim>& v, double small) {
  const auto axis = static_cast<std::size_t>(k);
  if (wall.fixed[axis]) return true;
  return wall.pushes[axis] != 0 && std::abs(v.dot(wall.axes.col(k)) - wall.velocity[axis]) <= small;
}

/// Nodes with less than this share of the mass of a fluid that fills their space have velocities v*
/// that follow from a few particles far away: what their forces give counts as much less.
constexpr double least_mass_share = 0.5;

/// Moves on to the first entry of a node, or behind, in a list by node. Entries of nodes before it
/// are of such as are not active.
template <class Entry>
void skip_to(Local node, Entry& entry, const Entry& end) {
  while (entry != end && entry->node < node) ++entry;
}

/// Density of the lightest liquid in pores [kg/m^3]; infinite: there is none.
template <int Dim>
double lightest_liquid(const Model<Dim>& model) {
  double density = std::numeric_limits<double>::infinity();
  for (const Material& material : model.materials)
    if (material.liquid) density = std::min(density, material.liquid->density);
  return density;
}

/// 0 where the mass m of a node is enough for its velocity, 1 where it has none: see
/// least_mass_share. `full` is the mass that fills its space.
double lightness(double m, double full) {
  return 1.0 - std::min(1.0, m / (least_mass_share * full));
}

/// Velocities of both phases without what the gradient of water at rest (pore_gradient_at_rest())
/// would take from them, where nodes are free: impulses on both, with implicit drag. Of light nodes
/// without what forces gave them: cells give them the mean acceleration of their nodes in its place
/// (ProjectionNodes::unforced).
template <int Dim>
void take_out_pore_weight(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const Vec<Dim> gradient = pore_gradient_at_rest(step);
  patch.projection.unforced.assign(static_cast<std::size_t>(patch.n_nodes()) * Dim, 0.0);
  constexpr double rounding_of_velocity = 1e-9;
  const double water = lightest_liquid(*step.model);
  double grains = std::numeric_limits<double>::infinity(), skeleton = grains;  // the lightest
  for (const Material& material : step.model->materials)
    if (material.liquid) {
      grains = std::min(grains, material.liquid->grain_density);
      skeleton = std::min(skeleton, material.density);
    }
  const double dt = step.dt;
  auto fixed = patch.fixed.begin();
  auto fixed_liquid = patch.fixed_liquid.begin();
  auto wall = patch.walls.begin();
  for (const NodeRange& range : patch.active_nodes)
    for (Local i = range.begin; i < range.end; ++i) {
      skip_to(i, fixed, patch.fixed.end());
      skip_to(i, fixed_liquid, patch.fixed_liquid.end());
      skip_to(i, wall, patch.walls.end());
      Eigen::Map<Vec<Dim>> v(at(patch.velocity, i)), w(at(patch.liquid.velocity, i));
      const double m = at(patch.velocity, i)[mass_lane];
      const double m_l = at(patch.liquid.velocity, i)[mass_lane];
      if (!(m > 0 && m_l > 0)) continue;
      const double full = skeleton * patch.projection.space[static_cast<std::size_t>(i)];
      const double light = lightness(m, full);
      const double *a = at(patch.acceleration, i), *a_l = at(patch.liquid.acceleration, i);
      std::array<bool, Dim> holds_skeleton{}, holds_liquid{};
      for (auto f = fixed; f != patch.fixed.end() && f->node == i; ++f)
        holds_skeleton[static_cast<std::size_t>(f->dir)] = true;
      for (auto f = fixed_liquid; f != patch.fixed_liquid.end() && f->node == i; ++f)
        holds_liquid[static_cast<std::size_t>(f->dir)] = true;
      if (wall != patch.walls.end() && wall->node == i) {
        const double small = rounding_of_velocity * (v.norm() + dt / water * gradient.norm());
        for (int k = 0; k < Dim; ++k)
          if (const auto axis = global_axis(*wall, k); axis && holds(*wall, k, Vec<Dim>(v), small))
            holds_skeleton[static_cast<std::size_t>(axis->dir)] = true;
      }
      double* unforced = patch.projection.unforced.data() + static_cast<std::ptrdiff_t>(i) * Dim;
      const double n = patch.liquid.porosity[static_cast<std::size_t>(i)];
      for (int d = 0; d < Dim; ++d) {
        const double Q = dt * at(patch.liquid.drag, i)[d];
        const bool held = holds_skeleton[static_cast<std::size_t>(d)];
        const bool held_liquid = holds_liquid[static_cast<std::size_t>(d)];
        const double on_skeleton = dt * m / grains * gradient[d];
        const double on_liquid = dt * m_l / water * gradient[d];
        if (!held && !held_liquid) {
          const double slip =
              (on_liquid / m_l - on_skeleton / m) / (1.0 + Q * (1.0 / m + 1.0 / m_l));
          v[d] -= (on_skeleton + Q * slip) / m;
          w[d] -= (on_liquid - Q * slip) / m_l;
        } else if (!held) {
          v[d] -= on_skeleton / (m + Q);
        } else if (!held_liquid) {
          w[d] -= on_liquid / (m_l + Q);
        }
        if (!held) v[d] -= light * dt * a[d];
        if (!held_liquid) w[d] -= light * dt * a_l[d];
        unforced[d] = light * ((held ? 0.0 : 1.0 - n) + (held_liquid ? 0.0 : n));
      }
    }
}

/// Velocities v* without what the weight of a fluid gives, where nodes are free.
template <int Dim>
void take_out_weight(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (step.model->analysis.two_phase) {
    take_out_pore_weight(patch, step);
    return liquid_discharge(patch);
  }
  constexpr double rounding_of_velocity = 1e-9;
  const Vec<Dim> weight = weight_out_of_velocities(step);
  double density = std::numeric_limits<double>::infinity();  // of the lightest fluid
  for (const Material& material : step.model->materials)
    if (has_pressure(material.law)) density = std::min(density, material.density);
  auto fixed = patch.fixed.begin();
  auto wall = patch.walls.begin();
  for (const NodeRange& range : patch.active_nodes)
    for (Local i = range.begin; i < range.end; ++i) {
      skip_to(i, fixed, patch.fixed.end());
      skip_to(i, wall, patch.walls.end());
      Eigen::Map<Vec<Dim>> v(at(patch.velocity, i));
      const Eigen::Map<const Vec<Dim>> a(at(patch.acceleration, i));
      const double full = density * patch.projection.space[static_cast<std::size_t>(i)];
      const double light = lightness(at(patch.velocity, i)[mass_lane], full);
      Vec<Dim> change = (1.0 - light) * weight + light * step.dt * a;
      for (auto f = fixed; f != patch.fixed.end() && f->node == i; ++f) change[f->dir] = 0.0;
      if (wall != patch.walls.end() && wall->node == i) {
        const double small = rounding_of_velocity * (v.norm() + weight.norm());
        for (int k = 0; k < Dim; ++k)
          if (holds(*wall, k, Vec<Dim>(v), small))
            change -= change.dot(wall->axes.col(k)) * wall->axes.col(k);
      }
      v -= change;
    }
}

}  // namespace

template <int Dim>
Vec<Dim> weight_out_of_velocities(const StepContext<Dim>& step) {
  const Analysis& analysis = step.model->analysis;
  if (analysis.two_phase) return Vec<Dim>::Zero();
  const NodeVector g = gravity_in(step);
  Vec<Dim> change;
  for (int d = 0; d < Dim; ++d) change[d] = (1.0 - analysis.projection.kept) * step.dt * g[d];
  return change;
}

template <int Dim>
Vec<Dim> pore_gradient_at_rest(const StepContext<Dim>& step) {
  const Analysis& analysis = step.model->analysis;
  const NodeVector g = gravity_in(step);
  const double density = lightest_liquid(*step.model);
  Vec<Dim> gradient = Vec<Dim>::Zero();
  if (!analysis.two_phase || std::isinf(density)) return gradient;
  for (int d = 0; d < Dim; ++d) gradient[d] = (1.0 - analysis.projection.kept) * density * g[d];
  return gradient;
}

template <int Dim>
void begin_pressure_system(Patch<Dim>& patch, const StepContext<Dim>& step) {
  patch.system.is_scalar = true;
  patch.system.symmetric = true;
  if (patch.active_nodes.empty()) {
    patch.system.first.clear();
    patch.system.column.clear();
    patch.projection.change.clear();
    patch.projection.volume.clear();
    return;
  }
  ProjectionNodes& nodes = patch.projection;
  const Mesh<Dim>& mesh = *step.model->mesh;
  if (nodes.space.size() != static_cast<std::size_t>(patch.n_nodes())) {
    nodes.space = space_of_nodes(patch.topology, mesh, [&](Index cell, const auto& of_cell, int) {
      return mesh.cell_volume(cell) / of_cell.count;
    });
    if (patch.cartesian) nodes.ends = ends_of_mesh(patch.topology, mesh);
  }
  const std::vector<char> voids = voids_of(patch, step);
  find_pattern(patch, voids);
  patch.system.blocks.assign(patch.system.column.size(), 0.0);
  clear_sums(patch, step, NodeSum::divergence);
  add_filled_cells(patch, step);
  take_out_weight(patch, step);
  give_pressures(patch, step);
  if (keeps_all_pore_pressure(step.model->analysis)) find_level(patch, step);
  add_voids(patch, step, voids);
}

template <int Dim>
void end_pressure_system(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (patch.active_nodes.empty()) return;
  if (!step.model->analysis.two_phase) hold_islands(patch);
  if (patch.fixed_pressure.empty()) return;
  double* sums = patch.own_sums(NodeSum::divergence, step.step);
  const NodalSystem<Dim>& system = patch.system;
  for (std::size_t i = 0; i + 1 < system.first.size(); ++i)
    for (std::size_t k = system.first[i]; k < system.first[i + 1]; ++k)
      sums[i * sum_stride] -=
          system.blocks[k] * patch.projection.change[static_cast<std::size_t>(system.column[k])];
}

template <int Dim>
void close_pressure_system(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (patch.active_nodes.empty()) return;
  const auto n = static_cast<std::size_t>(patch.n_nodes());
  const bool has_surface = step.model->analysis.projection.free_surface;
  const bool two_phase = step.model->analysis.two_phase;
  const Mesh<Dim>& mesh = *step.model->mesh;
  std::vector<std::uint8_t> axes;  // that are held; where they are not, the mesh has open ends
  if (has_surface && patch.cartesian) axes = held_axes(patch, two_phase);
  NodalSystem<Dim>& system = patch.system;
  ProjectionNodes& nodes = patch.projection;
  system.right_side.assign(n * node_width, 0.0);
  system.held.assign(n, all_held);
  nodes.volume.assign(n, 0.0);
  for_each_node(patch, SumOverPatches<Dim>(patch, NodeSum::divergence, step.step),
                [&](Local i, const NodeVector&, const NodeVector& sum) {
                  const auto node = static_cast<std::size_t>(i);
                  nodes.volume[node] = sum[1];
                  at(system.right_side, i)[0] = sum[0];
                  const double excess = sum[1] / nodes.space[node] - 1.0;
                  if (!has_surface && !two_phase)
                    at(system.right_side, i)[0] += spreading * excess * sum[3];
                  bool at_surface = has_surface && sum[2] < (1.0 - rounding) * nodes.space[node];
                  if (at_surface && !axes.empty() && axes[node] != 0)
                    at_surface = !is_behind_wall(mesh, patch.topology.nodes[node] % mesh.n_nodes(),
                                                 static_cast<unsigned>(sum[3]), axes[node]);
                  if (!axes.empty() && (axes[node] & held_askew<Dim>) == 0 &&
                      (nodes.ends[node] & ~axes[node]) != 0)
                    at_surface = true;
                  if (sum[1] > 0 && !at_surface) system.held[node] = 0;
                });
  for (const auto& fixed : patch.fixed_pressure)
    system.held[static_cast<std::size_t>(fixed.node)] = all_held;
}

namespace {

/// Whether a node of the system is one of a free surface, where no pressure is prescribed.
template <int Dim>
bool is_at_surface(const Patch<Dim>& patch, Local node) {
  const auto i = static_cast<std::size_t>(node);
  return patch.system.held[i] && patch.projection.volume[i] > 0 &&
         !find_node(patch.fixed_pressure, node);
}

}  // namespace

template <int Dim>
void drain_surfaces(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (patch.active_nodes.empty()) return;
  patch.projection.begins = true;
  std::vector<double>& change = patch.projection.change;
  change.assign(static_cast<std::size_t>(patch.n_nodes()), 0.0);
  for_each_node(patch, SumOverPatches<Dim>(patch, NodeSum::kept_pressure, step.step),
                [&](Local i, const NodeVector&, const NodeVector& sum) {
                  const double mass = at(patch.velocity, i)[mass_lane];
                  if (mass > 0 && is_at_surface(patch, i))
                    change[static_cast<std::size_t>(i)] = -sum[0] / mass;
                });
  double* pressure = patch.particles.row(Column::pore_pressure);
  interpolate_bins<Pack>(patch, patch.bins, change.data(), has_liquid(*step.model),
                         [&](Local p, Local n, const Pack& drained) {
                           store_first(Pack(load<Pack>(pressure + p) + drained), pressure + p, n);
                         });
}

template <int Dim>
PressureSums pressure_sums(const Patch<Dim>& patch) {
  PressureSums sums;
  if (patch.active_nodes.empty()) return sums;
  for (std::size_t i = 0; i < patch.projection.volume.size(); ++i) {
    const double volume = patch.projection.volume[i];
    if (!patch.topology.owned[i] || !(volume > 0)) continue;
    if (patch.system.held[i]) {
      sums.given += 1;
      continue;
    }
    sums.unknowns += 1;
    sums.discharge += patch.system.right_side[i * node_width];
    sums.volume += volume;
  }
  return sums;
}

template <int Dim>
void take_out_mean(Patch<Dim>& patch, double mean) {
  for (std::size_t i = 0; i < patch.projection.volume.size(); ++i)
    if (!patch.system.held[i])
      patch.system.right_side[i * node_width] -= mean * patch.projection.volume[i];
}

template <int Dim>
void take_pressure(Patch<Dim>& patch) {
  if (patch.active_nodes.empty()) return;
  patch.projection.begins = false;
  std::vector<double>&change = patch.projection.change, &level = patch.projection.level;
  for (std::size_t i = 0; i < change.size(); ++i) {
    change[i] += patch.system.solution[i * node_width];
    if (level.empty()) continue;
    level[i] = is_at_surface(patch, static_cast<Local>(i)) ? 0.0 : level[i] + change[i];
  }
}

#define LAHAR_INSTANTIATE(Dim)                                                    \
  template Vec<Dim> weight_out_of_velocities<Dim>(const StepContext<Dim>&);       \
  template Vec<Dim> pore_gradient_at_rest<Dim>(const StepContext<Dim>&);          \
  template void begin_pressure_system<Dim>(Patch<Dim>&, const StepContext<Dim>&); \
  template void end_pressure_system<Dim>(Patch<Dim>&, const StepContext<Dim>&);   \
  template void close_pressure_system<Dim>(Patch<Dim>&, const StepContext<Dim>&); \
  template std::vector<std::uint8_t> held_axes<Dim>(const Patch<Dim>&, bool);     \
  template void drain_surfaces<Dim>(Patch<Dim>&, const StepContext<Dim>&);        \
  template PressureSums pressure_sums<Dim>(const Patch<Dim>&);                    \
  template void take_out_mean<Dim>(Patch<Dim>&, double);                          \
  template void take_pressure<Dim>(Patch<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
