// Constraints and loads.
#include <fmt/format.h>

#include <algorithm>

#include "io/base/text.h"
#include "io/scenario/scenario_builder.h"
#include "physics/base/directory_rank.h"
#include "physics/base/sort_unique.h"

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
  return members_of(*value, sets);
}

template <int Dim>
std::optional<std::vector<Index>> ScenarioBuilder<Dim>::members_of(const JsonValue& value,
                                                                   const EntitySets& sets) {
  std::vector<Index> ids;
  if (value.is_number() && value.number() == -1) {
    if (&sets == &sets_.particles) return rows_.own_rows(0, rows_.total());
    need_memory(value, condition_bytes * static_cast<double>(n_nodes()) / team_.size(),
                fmt::format("what is said of all {} nodes", format_count(n_nodes())));
    for (Index i = 0; i < n_nodes(); ++i)
      if (directory_rank(i, team_.size()) == team_.index()) ids.push_back(i);
    return ids;
  }
  const auto* found = sets.find(value, in_);
  if (!found) return std::nullopt;
  if (&sets == &sets_.particles && value.is_number() &&
      shadowed_sets_.count(static_cast<Index>(value.number())))
    in_.warning(value,
                fmt::format("particle set {} is made by a generator and by the entity sets; the "
                            "generator's counts",
                            to_json(value)),
                "the reference does the same");
  if (&sets == &sets_.nodes)
    need_memory(value, condition_bytes * static_cast<double>(found->size()),
                "what is said of sets of nodes");
  ids = *found;
  sort_unique(ids);
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
    const std::size_t first = entries_of<NodeFriction>(model_).size();
    for (const Index node : *nodes) {
      entries_of<NodeFriction>(model_).push_back({node, axis, outward, mu, false});
      if (model_.analysis.two_phase) model_.liquid_velocities.push_back({node, axis, 0.0});
    }
    friction_entries_.push_back({wall, first, entries_of<NodeFriction>(model_).size()});
  }
}

template <int Dim>
void ScenarioBuilder<Dim>::build_particle_constraints() {
  for (const JsonValue* c : get_list(boundary(), "particles_velocity_constraints")) {
    const auto dir = phase_direction_of(*c);
    const auto v = get_number(*c, "velocity");
    const int function = find_function(*c);
    auto ids = members(*c, "pset_id", "pset", sets_.particles);
    if (!dir || !v || !ids) continue;
    const bool all = means_all(*c, "pset_id", "pset");
    if (*dir < Dim && holds_both_phases(*c))
      model_.particle_velocities.push_back({*ids, *dir, *v, all, true, function});
    model_.particle_velocities.push_back(
        {std::move(*ids), *dir % Dim, *v, all, *dir >= Dim, function});
  }
  model_.analysis.particles_follow_time =
      std::any_of(model_.particle_velocities.begin(), model_.particle_velocities.end(),
                  [](const ParticleVelocity& v) { return v.function >= 0; });
  model_.analysis.drives_nodes =
      !in_.cbgeo_defaults &&
      std::any_of(model_.particle_velocities.begin(), model_.particle_velocities.end(),
                  [](const ParticleVelocity& v) { return !v.of_liquid; });
}

// Published cases of two phases have gravity twice.
template <int Dim>
void ScenarioBuilder<Dim>::check_other_gravity() {
  const JsonValue& analysis = section("analysis");
  if (!analysis.is<JsonValue::Object>()) return;
  for (const auto& member : analysis.as<JsonValue::Object>()) {
    if (member.key != "gravity") continue;
    const auto values = get_numbers(analysis, "gravity");
    if (model_.analysis.two_phase && values.size() == Dim &&
        Eigen::Map<const Vec<Dim>>(values.data()) == model_.gravity)
      in_.warning(member.value, "'gravity' is ignored here",
                  "external_loading_conditions.gravity is the same");
    else
      in_.problems.error(in_.document.at_key(
          analysis, member,
          "'gravity' in analysis is of an older format, which CB-Geo MPM does not read any more",
          "write external_loading_conditions.gravity"));
  }
}

template <int Dim>
void ScenarioBuilder<Dim>::build_gravity() {
  const JsonValue& loads = section("external_loading_conditions");
  const JsonValue* gravity = loads.find("gravity");
  const bool ramped = gravity && gravity->is<JsonValue::Object>();
  model_.gravity = get_vector<Dim>(ramped ? *gravity : loads, "gravity").value_or(Vec<Dim>::Zero());
  check_other_gravity();
  const double ramp = ramped ? get_number(*gravity, "ramping_time").value_or(0) : 0;
  if (ramp <= 0) return;
  model_.gravity_function = static_cast<int>(model_.functions.size());
  model_.functions.push_back({.kind = MathFunction::Kind::linear, .x = {0, ramp}, .f = {0, 1}});
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
