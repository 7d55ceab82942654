// Conditions of nodes, from the table of physics/boundary/conditions.h. What one of them reads,
// refuses or warns about that the table does not say is here too.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "io/mesh/node_files.h"
#include "io/scenario/scenario_builder.h"

namespace lahar {

namespace {

/// What a value of the scenario sets; false if it is missing or bad, which was reported.
template <class T>
bool read_value(const JsonValue& object, const Parameter<T>& p, T& entry, bool by_preset) {
  if (p.flag) {
    entry.*p.flag = get_bool(object, p.key).value_or(p.by_preset && by_preset);
    return true;
  }
  if (p.sign) {
    entry.*p.sign = static_cast<int>(get_integer(object, p.key).value_or(0));
    return entry.*p.sign != 0;
  }
  if (p.choice) {
    const auto text = get_text(object, p.key);
    if (!text) return false;
    const auto at = std::find(p.choices.begin(), p.choices.end(), *text);
    entry.*p.choice = static_cast<int>(at - p.choices.begin());
    return true;
  }
  const auto value = get_number(object, p.key);
  entry.*p.number = value.value_or(p.fallback);
  return value || (!p.required && !written(object, p.key));
}

template <class T>
std::vector<NodeColumn> columns_of() {
  static_assert(std::all_of(T::parameters.begin(), T::parameters.end(),
                            [](const auto& p) { return p.bound <= Bound::not_negative; }));
  std::vector<NodeColumn> columns;
  for (const auto& p : T::parameters) {
    if (!p.required) continue;
    if (p.sign)
      columns.push_back({std::string(p.key), Bound::none, true, fmt::format("the {}", p.help)});
    else
      columns.push_back({fmt::format("the {}", p.help), p.bound});
  }
  return columns;
}

template <class T>
std::vector<std::string_view> keys_beside_file() {
  std::vector<std::string_view> keys;
  if constexpr (HasDirection<T>) keys.push_back("dir");
  for (const auto& p : T::parameters)
    if (p.required) keys.push_back(p.key);
  return keys;
}

}  // namespace

template <int Dim>
template <class T>
void ScenarioBuilder<Dim>::add_file_of(const JsonValue& object, std::string_view key,
                                       int function) {
  static_assert(T::parameters.size() <= NodeRow::most_values);
  const auto file = in_.open(object, key);
  if (!file) return;
  const int phases = has_phases<T> && model_.analysis.two_phase ? 2 : 1;
  const int directions = HasDirection<T> ? phases * Dim : 0;
  const auto rows =
      read_node_rows(*file, columns_of<T>(), {n_nodes(), directions}, team_, in_.problems);
  if (!rows) return;
  for (const NodeRow& row : *rows) {
    T entry{};
    entry.node = row.node;
    if constexpr (HasDirection<T>) entry.*T::direction.member = row.dir;
    if constexpr (HasFunction<T>) entry.function = function;
    auto value = row.values.begin();
    for (const auto& p : T::parameters) {
      if (p.by_preset) entry.*p.flag = in_.cbgeo_defaults;
      if (!p.required) continue;
      if (p.sign) entry.*p.sign = static_cast<int>(*value++);
      if (p.number) entry.*p.number = *value++;
    }
    entries_of<T>(model_).push_back(entry);
    if constexpr (has_phases<T>)
      if (row.dir < Dim && holds_both_phases(object)) {
        entry.*T::direction.member = row.dir + Dim;
        entries_of<T>(model_).push_back(entry);
      }
  }
}

template <int Dim>
template <class T>
void ScenarioBuilder<Dim>::add_set_of(const JsonValue& object, int function) {
  T entry{};
  bool complete = true;
  if constexpr (HasDirection<T>) {
    const auto dir = has_phases<T> ? phase_direction_of(object) : direction_of(object);
    entry.*T::direction.member = dir.value_or(0);
    complete = dir.has_value();
  }
  if constexpr (HasFunction<T>) entry.function = function;
  for (const auto& p : T::parameters) {
    if (p.sign && get_integer(object, p.key) == 0)
      in_.error(*object.find(p.key), fmt::format("'{}' must be 1 or -1, found 0", p.key),
                fmt::format("the {}", p.help));
    complete = read_value(object, p, entry, in_.cbgeo_defaults) && complete;
  }
  if constexpr (requires { entry.problems(Dim); }) {
    if (complete)
      for (const ConditionProblem& problem : entry.problems(Dim))
        in_.error(*object.find(problem.key), problem.message, problem.hint);
  }
  if constexpr (requires { entry.derive(Dim); }) entry.derive(Dim);
  const auto nodes = members(object, "nset_id", "nset", sets_.nodes);
  if (!complete || !nodes) return;
  for (const Index node : *nodes) {
    entry.node = node;
    entries_of<T>(model_).push_back(entry);
  }
  if constexpr (has_phases<T>)
    if (entry.*T::direction.member < Dim && holds_both_phases(object)) {
      entry.*T::direction.member += Dim;
      for (const Index node : *nodes) {
        entry.node = node;
        entries_of<T>(model_).push_back(entry);
      }
    }
}

template <int Dim>
template <class T>
void ScenarioBuilder<Dim>::add_entry_of(const JsonValue& object) {
  const auto function = [&] { return HasFunction<T> ? find_function(object) : -1; };
  if constexpr (is_from_file<T>) {
    if (from_file(object, keys_beside_file<T>())) {
      if constexpr (requires { T::constant_in_files; }) {
        if (const JsonValue* at = object.find("math_function_id"))
          in_.error(*at, "'math_function_id' does not go together with 'file'",
                    std::string(T::constant_in_files));
        return add_file_of<T>(object, "file");
      }
      return add_file_of<T>(object, "file", function());
    }
  }
  add_set_of<T>(object, function());
}

template <int Dim>
template <class T>
void ScenarioBuilder<Dim>::refuse_excluded(const JsonValue& at, std::span<const T> entries) {
  const auto& others = entries_of<typename T::Excludes>(model_);  // by node and direction
  constexpr Index none = std::numeric_limits<Index>::max();
  Index first = none;  // of all members
  for (const T& entry : entries) {
    const auto place = place_of(entry);
    const auto other =
        std::lower_bound(others.begin(), others.end(), place,
                         [](const auto& o, const auto& key) { return place_of(o) < key; });
    if (other != others.end() && place_of(*other) == place)
      first = std::min(first, place.first * Dim + place.second);
  }
  first = -team_.max(-first);
  if (first != none)
    in_.error(at,
              fmt::format("node {} has {} in direction {} as well", first / Dim, T::excluded,
                          first % Dim),
              "prescribe one of them");
}

// Velocities of the liquid in pores are a list of their own.
template <int Dim>
void ScenarioBuilder<Dim>::split_phases() {
  auto& all = entries_of<NodeVelocity>(model_);
  const auto liquid = std::stable_partition(all.begin(), all.end(),
                                            [](const NodeVelocity& v) { return v.dir < Dim; });
  for (auto v = liquid; v != all.end(); ++v)
    model_.liquid_velocities.push_back({v->node, v->dir - Dim, v->velocity, v->function});
  all.erase(liquid, all.end());
}

// The fork of CB-Geo MPM has displacements in implicit analyses, and velocities in explicit ones.
template <int Dim>
template <class T>
bool ScenarioBuilder<Dim>::has_no_effect(const JsonValue& given) {
  const bool implicit = is_implicit(model_.analysis);
  if (given.is<JsonValue::Array>() && given.as<JsonValue::Array>().empty()) return true;
  if (std::is_same_v<T, NodeDisplacement> && !implicit) {
    if (in_.cbgeo_defaults)
      in_.warning(given, "'displacement_constraints' are ignored in an explicit analysis");
    else
      in_.error(given, "'displacement_constraints' act in implicit analyses only",
                "prescribe velocities, or take \"mpm_scheme\": \"newmark\"");
    return true;
  }
  if (std::is_same_v<T, NodeVelocity> && implicit && in_.as_cbgeo) {
    in_.warning(given, "'velocity_constraints' are ignored in an implicit analysis, as by CB-Geo",
                "prescribe displacements with 'displacement_constraints'");
    return true;
  }
  return false;
}

template <int Dim>
template <class T>
void ScenarioBuilder<Dim>::build_condition() {
  const JsonValue& where = is_load<T> ? section("external_loading_conditions") : boundary();
  if (const JsonValue* given = where.find(T::key); given && has_no_effect<T>(*given)) return;
  auto& list = entries_of<T>(model_);
  if constexpr (std::is_same_v<T, NodeVelocity>) hold_axis();
  std::size_t first = 0;
  std::vector<std::pair<const JsonValue*, std::size_t>> ends;  // of what entries gave
  const auto finish = [&](const JsonValue& entry) {
    ends.emplace_back(&entry, list.size());
    if constexpr (std::is_same_v<T, NodeFriction>)
      friction_entries_.push_back({&entry, first, list.size()});
    if constexpr (requires { typename T::Excludes; })
      refuse_excluded<T>(entry, std::span<const T>(list).subspan(first));
    first = list.size();
  };
  if constexpr (requires { T::older_file_form; }) {
    if (is_file_name(T::key)) {
      add_file_of<T>(boundary(), T::key);
      finish(*boundary().find(T::key));
    }
  }
  auto entries = get_list(where, T::key);
  if (const JsonValue* one = where.find(T::key); one && one->template is<JsonValue::Object>())
    entries = {one};
  for (const JsonValue* entry : entries) {
    if (is_of_liquid<T> && !model_.analysis.two_phase && !is_projection(model_.analysis)) {
      refuse_without_liquid(*entry);
      continue;
    }
    if constexpr (is_of_liquid<T>)
      if (model_.analysis.two_phase && get_integer(*entry, "phase_id").value_or(1) == 0)
        in_.error(*entry->find("phase_id"), "phase 0 is the skeleton, which has no such condition",
                  "write 1, the liquid");
    add_entry_of<T>(*entry);
    finish(*entry);
  }
  if constexpr (std::is_same_v<T, NodeVelocity>) warn_of_two_velocities(ends);
  if constexpr (std::is_same_v<T, NodeAbsorption>) warn_of_absorbing_nodes(ends);
  combine(list);
  if constexpr (std::is_same_v<T, NodeVelocity>) {
    model_.analysis.nodes_follow_time = team_.any(
        std::any_of(list.begin(), list.end(), [](const auto& v) { return v.function >= 0; }));
    split_phases();
  }
  if constexpr (std::is_same_v<T, NodePressure>)
    model_.analysis.prescribes_pore_pressure = team_.any(!list.empty());
  if (takes_means<T> && team_.any(!list.empty())) model_.analysis.takes_means = true;
}

template <int Dim>
void ScenarioBuilder<Dim>::build_conditions() {
  for_each_condition([&]<class T>() { build_condition<T>(); });
  join_forces();
  build_walls();
  if (const auto file = in_.open(boundary(), "nodal_euler_angles"))
    if (auto frames = read_angle_file<Dim>(*file, n_nodes(), team_, in_.problems))
      model_.node_frames = std::move(*frames);
}

// Of several entries for a node and direction the first counts.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_two_velocities(
    const std::vector<std::pair<const JsonValue*, std::size_t>>& entries) {
  if (in_.cbgeo_defaults) return;
  const auto& list = entries_of<NodeVelocity>(model_);
  std::vector<std::size_t> order(list.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return place_of(list[a]) < place_of(list[b]);
  });
  const auto entry_of = [&](std::size_t k) {
    const auto at =
        std::upper_bound(entries.begin(), entries.end(), k,
                         [](std::size_t value, const auto& entry) { return value < entry.second; });
    return static_cast<std::size_t>(at - entries.begin());
  };
  std::vector<Index> lost(entries.size(), 0);
  for (std::size_t i = 0, first = 0; i < order.size(); ++i) {
    const NodeVelocity &counts = list[order[first]], &other = list[order[i]];
    if (place_of(counts) != place_of(other))
      first = i;
    else if (order[first] < axis_nodes_.size())
      continue;  // by the axis, which no entry has to hold
    else if (counts.velocity != other.velocity || counts.function != other.function)
      ++lost[entry_of(order[i])];
  }
  for (std::size_t e = 0; e < entries.size(); ++e)
    if (const Index nodes = team_.sum(lost[e]); nodes > 0)
      in_.warning(*entries[e].first,
                  fmt::format("at {} of its nodes an entry before prescribes another velocity in "
                              "this direction, which counts",
                              nodes),
                  "take these nodes out of one of the sets, or change the order");
}

// A node with a prescribed acceleration has the velocity that is its integral from rest. In CB-Geo
// MPM it changes the velocity that particles around it bring, which lags.
template <int Dim>
void ScenarioBuilder<Dim>::integrate_accelerations() {
  auto& accelerations = entries_of<NodeAcceleration>(model_);
  if (in_.cbgeo_defaults || !team_.any(!accelerations.empty())) return;
  const auto functions = static_cast<int>(model_.functions.size());
  for (int f = 0; f < functions; ++f)
    model_.functions.push_back(integral_of(model_.functions[static_cast<std::size_t>(f)]));
  model_.functions.push_back(integral_of({}));
  auto& velocities = entries_of<NodeVelocity>(model_);
  for (const NodeAcceleration& a : accelerations)
    velocities.push_back(
        {a.node, a.dir, a.acceleration, a.function < 0 ? 2 * functions : functions + a.function});
  accelerations.clear();
  combine(velocities);
  model_.analysis.nodes_follow_time = true;
}

// As in the reference, a node has one function, that of the last force given for it, and the last
// force of a direction replaces the ones before.
template <int Dim>
void ScenarioBuilder<Dim>::join_forces() {
  auto& out = entries_of<NodeForce>(model_);
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

template void ScenarioBuilder<2>::build_conditions();
template void ScenarioBuilder<3>::build_conditions();
template void ScenarioBuilder<2>::integrate_accelerations();
template void ScenarioBuilder<3>::integrate_accelerations();

}  // namespace lahar
