// Constraints and loads.
#include <fmt/format.h>

#include <algorithm>

#include "io/base/text.h"
#include "io/mesh/node_files.h"
#include "io/scenario/scenario_builder.h"
#include "physics/base/directory_rank.h"

namespace lahar {

namespace {

/// An id and what is said of it, such as NodeVelocity [bytes].
constexpr double condition_bytes = sizeof(Index) + sizeof(NodeVelocity);

}  // namespace

template <int Dim>
std::optional<std::vector<Index>> ScenarioBuilder<Dim>::members(const JsonValue& object,
                                                                std::string_view id_key,
                                                                std::string_view name_key,
                                                                const EntitySets& sets) {
  const JsonValue* value = in_.either(object, id_key, name_key);
  if (!value) {
    const auto& keys = object.as<JsonValue::Object>();
    if (std::none_of(keys.begin(), keys.end(),
                     [&](const auto& m) { return m.key == id_key || m.key == name_key; }))
      in_.error(object, fmt::format("'{}' is missing", name_key),
                fmt::format("{}: an id (-1 for all) or a name of sets.{}s", name_key, sets.kind));
    return std::nullopt;
  }
  std::vector<Index> ids;
  if (value->is_number() && value->number() == -1) {
    if (&sets == &sets_.particles) return rows_.own_rows(0, rows_.total());
    need_memory(*value, condition_bytes * static_cast<double>(n_nodes()) / team_.size(),
                fmt::format("what is said of all {} nodes", format_count(n_nodes())));
    for (Index i = 0; i < n_nodes(); ++i)
      if (directory_rank(i, team_.size()) == team_.index()) ids.push_back(i);
    return ids;
  }
  const auto* found = sets.find(*value, in_);
  if (!found) return std::nullopt;
  if (&sets == &sets_.particles && value->is_number() &&
      shadowed_sets_.count(static_cast<Index>(value->number())))
    in_.warning(*value,
                fmt::format("particle set {} is made by a generator and by the entity sets; the "
                            "generator's counts",
                            to_json(*value)),
                "the reference does the same");
  if (&sets == &sets_.nodes)
    need_memory(*value, condition_bytes * static_cast<double>(found->size()),
                "what is said of sets of nodes");
  ids = *found;
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

template <int Dim>
bool ScenarioBuilder<Dim>::means_all(const JsonValue& object, std::string_view id_key,
                                     std::string_view name_key) {
  return get_integer(object, id_key) == -1 || get_integer(object, name_key) == -1;
}

template <int Dim>
std::optional<int> ScenarioBuilder<Dim>::direction_of(const JsonValue& object) {
  const auto dir = get_direction(object, "dir");
  if (!dir || *dir < Dim) return dir;
  in_.error(*object.find("dir"),
            fmt::format("'dir' must be below {} in {} dimensions, found {}", Dim,
                        Dim == 2 ? "two" : "three", to_json(*object.find("dir"))));
  return std::nullopt;
}

template <int Dim>
bool ScenarioBuilder<Dim>::from_file(const JsonValue& object,
                                     const std::vector<std::string_view>& required) {
  const auto& keys = object.as<JsonValue::Object>();
  const auto has = [&](std::string_view key) {
    return std::any_of(keys.begin(), keys.end(), [&](const auto& m) { return m.key == key; });
  };
  const bool file = has("file");
  for (const auto key : required) {
    if (file && object.find(key))
      in_.error(*object.find(key), fmt::format("'{}' does not go together with 'file'", key),
                "the file has a node, a direction and a value in each row");
    if (!file && !has(key)) in_.error(object, fmt::format("'{}' is missing", key));
  }
  return file;
}

template <int Dim>
bool ScenarioBuilder<Dim>::is_file_name(std::string_view constraints) {
  const JsonValue* value = boundary().find(constraints);
  if (!value || !value->is<std::string>()) return false;
  in_.warning(*value, fmt::format("the name of a file is the older form of '{}'", constraints),
              "it is read; CB-Geo MPM has [{\"file\": ...}] now");
  return true;
}

template <int Dim>
void ScenarioBuilder<Dim>::build_constraints() {
  const auto add = [&](Index node, int dir, bool liquid, double v) {
    (liquid ? model_.liquid_velocities : model_.node_velocities).push_back({node, dir, v});
  };
  const int directions = model_.analysis.two_phase ? 2 * Dim : Dim;
  const auto add_file = [&](const JsonValue& object, std::string_view key) {
    const auto file = in_.open(object, key);
    if (!file) return;
    if (const auto rows =
            read_node_values(*file, "the velocity", {n_nodes(), directions}, team_, in_.problems))
      for (const auto& [node, dir, v] : *rows) add(node, dir % Dim, dir >= Dim, v);
  };
  if (is_file_name("velocity_constraints")) add_file(boundary(), "velocity_constraints");
  for (const JsonValue* c : get_list(boundary(), "velocity_constraints")) {
    if (from_file(*c, {"dir", "velocity"})) {
      add_file(*c, "file");
      continue;
    }
    const auto dir = phase_direction_of(*c);
    const auto v = get_number(*c, "velocity");
    const auto nodes = members(*c, "nset_id", "nset", sets_.nodes);
    if (!dir || !v || !nodes) continue;
    for (const Index node : *nodes) add(node, dir->dir, dir->liquid, *v);
  }
  // The first constraint of a node and direction wins.
  const auto key = [](const NodeVelocity& a) { return std::pair(a.node, a.dir); };
  for (auto* out : {&model_.node_velocities, &model_.liquid_velocities}) {
    std::stable_sort(out->begin(), out->end(),
                     [&](const auto& a, const auto& b) { return key(a) < key(b); });
    out->erase(std::unique(out->begin(), out->end(),
                           [&](const auto& a, const auto& b) { return key(a) == key(b); }),
               out->end());
  }
}

template <int Dim>
void ScenarioBuilder<Dim>::build_friction() {
  auto& out = model_.node_frictions;
  const auto add_file = [&](const JsonValue& object, std::string_view key) {
    const auto file = in_.open(object, key);
    if (!file) return;
    if (const auto rows = read_friction_file(*file, {n_nodes(), Dim}, team_, in_.problems))
      for (NodeFriction row : *rows) {
        row.one_sided = !in_.cbgeo_defaults;
        out.push_back(row);
      }
  };
  std::size_t first = 0;
  const auto note = [&](const JsonValue& entry) {
    friction_entries_.push_back({&entry, first, out.size()});
    first = out.size();
  };
  if (is_file_name("friction_constraints")) {
    add_file(boundary(), "friction_constraints");
    note(*boundary().find("friction_constraints"));
  }
  for (const JsonValue* c : get_list(boundary(), "friction_constraints")) {
    if (from_file(*c, {"dir", "sign_n", "friction"})) {
      add_file(*c, "file");
      note(*c);
      continue;
    }
    const auto dir = direction_of(*c);
    auto sign = get_integer(*c, "sign_n");
    const auto friction = get_number(*c, "friction");
    const auto nodes = members(*c, "nset_id", "nset", sets_.nodes);
    if (sign && *sign == 0) {
      in_.error(*c->find("sign_n"), "'sign_n' must be 1 or -1, found 0", sign_hint);
      continue;
    }
    if (!dir || !sign || !friction || !nodes) continue;
    const bool one_sided = !get_bool(*c, "two_sided").value_or(in_.cbgeo_defaults);
    for (const Index node : *nodes)
      out.push_back({node, *dir, static_cast<int>(*sign), *friction, one_sided});
    note(*c);
  }
  build_walls();
  if (const auto file = in_.open(boundary(), "nodal_euler_angles"))
    if (auto frames = read_angle_file<Dim>(*file, n_nodes(), team_, in_.problems))
      model_.node_frames = std::move(*frames);
}

template <int Dim>
void ScenarioBuilder<Dim>::build_walls() {
  for (const JsonValue* wall : get_list(boundary(), "walls")) {
    const auto normal = get_vector<Dim>(*wall, "normal");
    const auto nodes = members(*wall, "nset_id", "nset", sets_.nodes);
    const JsonValue* friction = wall->find("friction");
    if (!nodes || !normal || !friction) continue;
    int axis = 0;
    const double most = normal->cwiseAbs().maxCoeff(&axis);
    if (!(most > 0) || most < normal->norm() * (1 - 1e-9)) {
      in_.error(*wall->find("normal"), "'normal' of a wall must lie along an axis",
                "[0, 1] for a floor along x; for another one give the nodes axes of their own with "
                "'nodal_euler_angles', and a friction constraint");
      continue;
    }
    if (friction->is<std::string>() && friction->as<std::string>() != "rough") {
      in_.error(*friction,
                fmt::format("'friction' must be a coefficient or \"rough\", found {}",
                            to_json(*friction)),
                "\"rough\": material does not slide while it is pressed against the wall");
      continue;
    }
    const double mu =
        friction->is_number() ? friction->number() : std::numeric_limits<double>::infinity();
    if (mu < 0) {
      in_.error(*friction,
                fmt::format("'friction' must be at least 0, found {}", to_json(*friction)));
      continue;
    }
    const int outward = (*normal)[axis] > 0 ? -1 : 1;  // the normal points into the material
    const std::size_t first = model_.node_frictions.size();
    for (const Index node : *nodes)
      model_.node_frictions.push_back({node, axis, outward, mu, true});
    friction_entries_.push_back({wall, first, model_.node_frictions.size()});
  }
}

template <int Dim>
void ScenarioBuilder<Dim>::build_particle_constraints() {
  for (const JsonValue* c : get_list(boundary(), "particles_velocity_constraints")) {
    const auto dir = phase_direction_of(*c);
    const auto v = get_number(*c, "velocity");
    auto ids = members(*c, "pset_id", "pset", sets_.particles);
    if (dir && v && ids)
      model_.particle_velocities.push_back(
          {std::move(*ids), dir->dir, *v, means_all(*c, "pset_id", "pset"), dir->liquid});
  }
  model_.analysis.drives_nodes =
      !in_.cbgeo_defaults &&
      std::any_of(model_.particle_velocities.begin(), model_.particle_velocities.end(),
                  [](const ParticleVelocity& v) { return !v.of_liquid; });
}

template <int Dim>
void ScenarioBuilder<Dim>::build_gravity() {
  const JsonValue& loads = section("external_loading_conditions");
  const JsonValue* gravity = loads.find("gravity");
  const bool ramped = gravity && gravity->is<JsonValue::Object>();
  model_.gravity = get_vector<Dim>(ramped ? *gravity : loads, "gravity").value_or(Vec<Dim>::Zero());
  if (const JsonValue* other = section("analysis").find("gravity")) {
    const auto values = get_numbers(section("analysis"), "gravity");
    if (values.size() == Dim && Eigen::Map<const Vec<Dim>>(values.data()) == model_.gravity)
      in_.warning(*other, "'gravity' is ignored here",
                  "external_loading_conditions.gravity is the same");
    else
      in_.error(*other, "'gravity' does not belong here",
                "write external_loading_conditions.gravity");
  }
  const double ramp = ramped ? get_number(*gravity, "ramping_time").value_or(0) : 0;
  if (ramp <= 0) return;
  model_.gravity_function = static_cast<int>(model_.functions.size());
  model_.functions.push_back({.kind = MathFunction::Kind::linear, .x = {0, ramp}, .f = {0, 1}});
}

template <int Dim>
void ScenarioBuilder<Dim>::build_tractions() {
  for (const JsonValue* t :
       get_list(section("external_loading_conditions"), "particle_surface_traction")) {
    const auto dir = phase_direction_of(*t);
    const auto value = get_number(*t, "traction");
    const int function = find_function(*t);
    auto ids = members(*t, "pset_id", "pset", sets_.particles);
    if (dir && value && ids)
      model_.tractions.push_back({std::move(*ids), dir->dir, *value, function,
                                  means_all(*t, "pset_id", "pset"), dir->liquid});
  }
}

template <int Dim>
void ScenarioBuilder<Dim>::build_nodal_forces() {
  auto& out = model_.node_forces;
  auto entries = get_list(section("external_loading_conditions"), "concentrated_nodal_forces");
  if (const JsonValue* one =
          section("external_loading_conditions").find("concentrated_nodal_forces");
      one && one->is<JsonValue::Object>())
    entries = {one};
  for (const JsonValue* f : entries) {
    const int function = find_function(*f);
    if (from_file(*f, {"dir", "force"})) {
      const auto file = in_.open(*f, "file");
      if (!file) continue;
      if (const auto rows =
              read_node_values(*file, "the force", {n_nodes(), Dim}, team_, in_.problems))
        for (const auto& [node, dir, force] : *rows) out.push_back({node, dir, force, function});
      continue;
    }
    const auto dir = direction_of(*f);
    const auto force = get_number(*f, "force");
    const auto nodes = members(*f, "nset_id", "nset", sets_.nodes);
    if (!dir || !force || !nodes) continue;
    for (const Index node : *nodes) out.push_back({node, *dir, *force, function});
  }
  // As in the reference, a node has one function, that of the last force given for it, and the last
  // force of a direction replaces the ones before.
  std::stable_sort(out.begin(), out.end(),
                   [](const auto& a, const auto& b) { return a.node < b.node; });
  std::vector<NodeForce> kept;
  for (std::size_t i = 0; i < out.size();) {
    std::size_t end = i;
    while (end < out.size() && out[end].node == out[i].node) ++end;
    for (int d = 0; d < Dim; ++d)
      for (std::size_t k = end; k-- > i;)
        if (out[k].dir == d) {
          kept.push_back(out[k]);
          kept.back().function = out[end - 1].function;
          break;
        }
    i = end;
  }
  out = std::move(kept);
}

template class ScenarioBuilder<2>;
template class ScenarioBuilder<3>;

}  // namespace lahar
