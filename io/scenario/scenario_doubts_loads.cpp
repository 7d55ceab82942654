// Warnings of loads that are there, but do not act: they begin at zero again in a stage, lie on
// nodes without material, or stay behind with nodes that material moves away from; and of inflow
// that nothing holds.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>

#include "io/scenario/scenario_builder.h"
#include "physics/base/directory_rank.h"
#include "physics/base/sort_unique.h"
#include "physics/materials/law.h"

namespace lahar {

namespace {

/// Whether a load begins with less than half of what it ends with.
bool begins_low(const MathFunction& function) {
  constexpr double low = 0.5;
  return function.kind == MathFunction::Kind::linear && !function.integrated &&
         !function.differentiated && !function.f.empty() &&
         std::abs(function.value(0)) < low * std::abs(function.f.back());
}

/// How far [m] motion with a velocity [m/s] gets along its axis, upwards and downwards, until
/// `end`.
std::array<double, 2> travels(double velocity, const MathFunction* function, double end) {
  constexpr int samples = 1000;
  std::array<double, 2> most{};
  for (int k = 1; k <= samples; ++k) {
    const double time = end * k / samples;
    const double way = velocity * (function ? function->integral(time) : time);
    most = {std::max(most[0], way), std::max(most[1], -way)};
  }
  return most;
}

}  // namespace

// Time begins at zero in each stage. What the ground bore at the end of the stage before is gone at
// once where a ramp begins anew. A stage that writes the load itself means it.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_lost_loads() {
  if (in_.stage.empty()) return;
  const JsonValue& loads = section("external_loading_conditions");
  const auto inherited = [&](std::string_view key) -> const JsonValue* {
    const auto& own = in_.own_loads;
    return std::find(own.begin(), own.end(), key) == own.end() ? loads.find(key) : nullptr;
  };
  const auto is_low = [&](int function) {
    return function >= 0 && begins_low(model_.functions[static_cast<std::size_t>(function)]);
  };
  const JsonValue* gravity = inherited("gravity");
  if (gravity && model_.gravity.norm() > 0 && is_low(model_.gravity_function))
    in_.warning(
        *gravity,
        fmt::format("gravity begins at zero again and grows until {:g} s, as in the stage "
                    "before: the ground loses its weight when this stage begins",
                    model_.functions[static_cast<std::size_t>(model_.gravity_function)].x.back()),
        fmt::format("write in external_loading_conditions of this stage \"gravity\": "
                    "{{\"ramping_time\": null}}, or its own \"gravity\": [{:g}]",
                    fmt::join(std::span(model_.gravity.data(), Dim), ", ")));
  for (const std::string_view key :
       {std::string_view("particle_surface_traction"), NodeForce::key}) {
    const JsonValue* given = inherited(key);
    if (!given) continue;
    std::vector<const JsonValue*> entries = get_list(loads, key);
    if (given->is<JsonValue::Object>()) entries = {given};
    const auto lost = std::count_if(entries.begin(), entries.end(), [&](const JsonValue* entry) {
      return is_low(find_function(*entry));
    });
    if (lost == 0) continue;
    in_.warning(*given,
                fmt::format("{} of the {} entries of '{}' grow with time again, as in the stage "
                            "before: the ground loses these loads when this stage begins",
                            lost, entries.size(), key),
                fmt::format("write \"{}\" in external_loading_conditions of this stage, without "
                            "'math_function_id' or with a function that begins with the whole load",
                            key));
  }
}

// A node without particles around has no mass that a force could move. Smooth functions of a node
// reach into the next cells but one.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_forces_on_nothing() {
  const JsonValue* given = section("external_loading_conditions").find(NodeForce::key);
  // In later stages, and where particles come in, they are elsewhere.
  if (!given || !in_.stage.empty() || !model_.injections.empty()) return;
  const bool smooth = model_.analysis.functions != ShapeFunctions::element;
  if (smooth && !(mesh_->is_structured() && mesh_->is_multilinear())) return;
  std::vector<Index> own;
  for (const NodeForce& load : entries_of<NodeForce>(model_))
    if (load.force != 0) own.push_back(load.node);
  sort_unique(own);
  std::vector<Index> loaded = joined(team_.gather(own));
  sort_unique(loaded);
  if (loaded.empty()) return;
  // The nodes of a block around a node; without smooth functions the node alone.
  const auto around = [&](Index node, auto&& visit) {
    if (!smooth) return visit(node);
    const auto counts = mesh_->counts();
    std::array<Index, static_cast<std::size_t>(Dim)> at, stride;
    for (std::size_t d = 0, step = 1; d < at.size(); ++d) {
      const auto n = static_cast<std::size_t>(counts[d]) + 1;
      stride[d] = static_cast<Index>(step);
      at[d] = node / stride[d] % static_cast<Index>(n);
      step *= n;
    }
    for (int k = 0; k < (Dim == 2 ? 9 : 27); ++k) {
      Index other = node;
      bool inside = true;
      for (std::size_t d = 0, rest = static_cast<std::size_t>(k); d < at.size(); ++d, rest /= 3) {
        const Index by = static_cast<Index>(rest % 3) - 1;
        inside = inside && at[d] + by >= 0 && at[d] + by <= counts[d];
        other += by * stride[d];
      }
      if (inside) visit(other);
    }
  };
  std::vector<Index> nodes;
  for (const Index node : loaded) around(node, [&](Index one) { nodes.push_back(one); });
  sort_unique(nodes);
  std::vector<double> filled(nodes.size(), 0.0);  // 1: a cell of the node has particles
  std::vector<Index> cells = model_.particles.cell;
  sort_unique(cells);
  const auto mesh = mesh_with(cells);
  for (const Index cell : cells)
    for (const Index node : mesh->element_nodes(cell)) {
      const auto at = std::lower_bound(nodes.begin(), nodes.end(), node);
      if (at != nodes.end() && *at == node)
        filled[static_cast<std::size_t>(at - nodes.begin())] = 1.0;
    }
  filled = team_.most(std::move(filled));
  const auto lost = std::count_if(loaded.begin(), loaded.end(), [&](Index node) {
    bool empty = true;
    around(node, [&](Index one) {
      const auto at = std::lower_bound(nodes.begin(), nodes.end(), one);
      empty = empty && filled[static_cast<std::size_t>(at - nodes.begin())] == 0.0;
    });
    return empty;
  });
  if (lost == 0) return;
  in_.warning(*given,
              fmt::format("{} of the {} nodes with a force have no material around them at the "
                          "beginning: these forces move nothing",
                          lost, loaded.size()),
              "take nodes of cells that hold particles, or a load on particles, "
              "particle_surface_traction");
}

// As time_step_limit() of the run, but for the drag of a liquid in pores and its own velocity.
template <int Dim>
double ScenarioBuilder<Dim>::first_step() {
  const Analysis& a = model_.analysis;
  if (!a.step.adaptive || is_implicit(a)) return a.step.dt;
  std::vector<double> waves, diffusion;  // by material [m/s], [m^2/s]
  for (const Material& material : model_.materials) {
    const bool skeleton = material.liquid.has_value();
    waves.push_back(!is_projection(a) ? wave_speed(material)
                    : skeleton        ? std::sqrt(wave_modulus(material.law) / material.density)
                                      : 0.0);
    diffusion.push_back(2.0 * Dim * viscosity(material.law) / material.density);
  }
  const auto& p = model_.particles;
  const auto mesh = mesh_with(p.cell);
  double most = 0;  // [1/s]
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    const std::uint16_t m = p.material[i];
    const double h = mesh->cell_size(p.cell[i]),
                 speed = p.velocity.empty() ? 0.0 : p.velocity[i].norm();
    most = std::max({most, (waves[m] + speed) / h, diffusion[m] / (h * h)});
  }
  return std::min(a.step.dt, a.step.safety / team_.most({most}).front());
}

// Nodes stay where they are. Material that they push leaves them, and then it is pushed no more.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_pushing_nodes() {
  constexpr double reach = 0.5;  // of a cell, which nodes push in full
  constexpr double most = 0.5;   // of an entry's nodes in material; others have it behind them, too
  const Analysis& a = model_.analysis;
  if (in_.cbgeo_defaults || !in_.stage.empty() || !model_.injections.empty() ||
      team_.any(!model_.node_frames.empty()))
    return;
  struct Moved {
    const JsonValue* entry;
    int dir;
    double by;  ///< [m/s], or [m] in each step
    bool in_steps;
    const MathFunction* factor;  ///< null = 1
    const std::vector<Index>* nodes;
  };
  std::vector<Moved> all_moved;
  const auto add = [&](const JsonValue& entry, double by, bool in_steps) {
    const auto dir = get_direction(entry, "dir");
    const JsonValue* set = in_.either(entry, "nset_id", "nset");
    if (!dir || *dir >= Dim || !set || by == 0 || get_text(entry, "phase") == "liquid") return;
    if (set->is_number() && set->number() == -1) return;  // all nodes move a body as a whole
    const int function = find_function(entry);
    const auto* factor =
        function >= 0 ? &model_.functions[static_cast<std::size_t>(function)] : nullptr;
    if (const auto* nodes = sets_.nodes.find(*set, in_))
      all_moved.push_back({&entry, *dir, by, in_steps, factor, nodes});
  };
  for (const JsonValue* entry : get_list(boundary(), NodeVelocity::key))
    add(*entry, get_number(*entry, "velocity").value_or(0), false);
  for (const JsonValue* entry : get_list(boundary(), NodeDisplacement::key))
    add(*entry, get_number(*entry, "displacement").value_or(0), true);
  if (all_moved.empty()) return;
  // How long adaptive steps will be is not known: all as long as the first.
  const double step = first_step(), by_steps = static_cast<double>(a.nsteps) * step,
               end = std::min(a.end_time, by_steps);
  if (!std::isfinite(end)) return;
  const std::string guess =
      a.step.adaptive && by_steps < a.end_time
          ? fmt::format(" in {} steps as long as the first, {:.3g} s", a.nsteps, step)
          : "";
  std::vector<Index> cells = model_.particles.cell;
  sort_unique(cells);
  const auto mesh = mesh_with(cells);
  for (const auto& [entry, dir, by, in_steps, factor, own] : all_moved) {
    const auto ways = travels(in_steps ? by / step : by, factor, end);
    std::vector<Index> nodes = joined(team_.gather(*own));
    sort_unique(nodes);
    // By node: the length of cells with particles above and below it along the axis, and minus its
    // place there.
    const std::size_t n = nodes.size();
    std::vector<double> around(3 * n, 0.0);
    std::fill(around.begin() + static_cast<std::ptrdiff_t>(2 * n), around.end(), -infinity);
    for (const Index cell : cells) {
      const auto corners = mesh->element_nodes(cell);
      double low = infinity, high = -infinity;
      for (const Index node : corners) {
        low = std::min(low, mesh->node(node)[dir]);
        high = std::max(high, mesh->node(node)[dir]);
      }
      for (const Index node : corners) {
        const auto at = std::lower_bound(nodes.begin(), nodes.end(), node);
        if (at == nodes.end() || *at != node) continue;
        const auto i = static_cast<std::size_t>(at - nodes.begin());
        const double x = mesh->node(node)[dir];
        double& length = around[(x < (low + high) / 2 ? 0 : n) + i];
        length = std::max(length, high - low);
        around[2 * n + i] = -x;
      }
    }
    around = team_.most(std::move(around));
    for (const std::size_t ahead : {0, 1}) {
      std::size_t touching = 0, pushing = 0;
      double length = 0, low = infinity, high = -infinity;
      for (std::size_t i = 0; i < n; ++i) {
        const double before = around[ahead * n + i], behind = around[(1 - ahead) * n + i];
        touching += before > 0 || behind > 0;
        if (!(before > 0) || behind > 0) continue;
        ++pushing;
        length = std::max(length, before);
        low = std::min(low, -around[2 * n + i]);
        high = std::max(high, -around[2 * n + i]);
      }
      if (pushing == 0 || ways[ahead] <= reach * length ||
          static_cast<double>(pushing) <= most * static_cast<double>(touching))
        continue;
      in_.warning(
          *entry,
          fmt::format(
              "{} node{} at {} = {:g}{} push material by {:.3g} m, {:.3g} cells{}: nodes stay "
              "where they are, and material that has left them is pushed no more",
              pushing, pushing == 1 ? "" : "s", "xyz"[dir], low,
              low < high ? fmt::format(" to {:g}", high) : std::string(), ways[ahead],
              ways[ahead] / length, guess),
          std::string("push with a plate in 'rigid_bodies', which moves") +
              (is_implicit(a) ? ""
                              : ", or prescribe velocities of the particles at this end "
                                "('particles_velocity_constraints')"));
    }
  }
}

// Cells get particles when they are empty. What falls leaves them sooner, what is held up later.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_free_inflow() {
  constexpr double most = 0.5;  // of the nodes of the cells
  if (in_.cbgeo_defaults || model_.injections.empty() || model_.gravity.norm() == 0) return;
  const auto& held = entries_of<NodeVelocity>(model_);
  auto source = model_.injections.begin();
  for (const JsonValue* entry : get_list(root_, "particles")) {
    const JsonValue* generator = entry->find("generator");
    if (!generator || get_text(*generator, "type") != "inject") continue;
    if (source == model_.injections.end()) return;
    const Injection<Dim>& injection = *source++;
    if (injection.flow == 0) continue;
    std::vector<Index> nodes;
    const auto mesh = mesh_with(injection.cells);
    for (const Index cell : injection.cells)
      for (const Index node : mesh->element_nodes(cell)) nodes.push_back(node);
    sort_unique(nodes);
    const Index all = team_.sum(static_cast<Index>(nodes.size()));
    std::string free, entries;  // axes along which the velocity is not held
    bool holds_some = false;
    for (int axis = 0; axis < Dim; ++axis) {
      if (injection.velocity[axis] == 0) continue;
      const auto known = ask<char>(
          team_, nodes, [&](Index node) { return directory_rank(node, team_.size()); },
          [&](Index node) {
            const auto at = std::lower_bound(
                held.begin(), held.end(), std::pair(node, axis),
                [](const NodeVelocity& one, const auto& key) { return place_of(one) < key; });
            return static_cast<char>(at != held.end() && at->node == node && at->dir == axis &&
                                     at->velocity != 0);
          });
      const Index prescribed =
          team_.sum(static_cast<Index>(std::count(known.begin(), known.end(), char{1})));
      if (static_cast<double>(prescribed) >= most * static_cast<double>(all)) {
        holds_some = true;
        continue;
      }
      free += fmt::format("{}{}", free.empty() ? "" : " and ", "xyz"[axis]);
      entries +=
          fmt::format("{}\"dir\": \"{}\", \"velocity\": {:g}", entries.empty() ? "" : ", and with ",
                      "xyz"[axis], injection.velocity[axis]);
    }
    if (free.empty()) continue;
    in_.warning(*generator,
                fmt::format("nothing holds the velocity{} in the cells of this inflow: weight, and "
                            "what lies before it, change it, and with it how much comes in",
                            holds_some ? " along " + free : std::string()),
                fmt::format("prescribe it at the nodes of these cells, too: velocity_constraints "
                            "with {}, for a set that has a box around them",
                            entries));
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
