// What a run measures, gauges and maps, and which particles its frames have.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "io/base/text.h"
#include "io/scenario/in_space.h"
#include "io/scenario/scenario_builder.h"
#include "physics/base/sort_unique.h"
#include "physics/particles/columns.h"
#include "physics/particles/derived_fields.h"

namespace lahar {

namespace {

using GaugeKind = Gauge::Kind;

constexpr Index most_tracked = 10000;  ///< particles of a set
constexpr Index most_cells = 1000000;  ///< of maps

GaugeKind kind_of(const std::string& type) {
  if (type == "point" || type == "line") return GaugeKind::points;
  if (type == "column" || type == "section") return GaugeKind::columns;
  if (type == "front") return GaugeKind::front;
  if (type == "plane") return GaugeKind::plane;
  if (type == "force") return GaugeKind::force;
  return type == "particles" ? GaugeKind::particles : GaugeKind::track;
}

}  // namespace

template <int Dim>
void ScenarioBuilder<Dim>::build_gauges() {
  const JsonValue& post = section("post_processing");
  for (const JsonValue* entry : get_list(post, "gauges")) read_gauge(*entry);
  if (const JsonValue* maps = post.find("maps"); maps && maps->is<JsonValue::Object>())
    read_maps(*maps);
}

/// Ids that members of the team have: those of all of them, ascending; nothing where one has none.
/// Collective.
template <int Dim>
std::optional<std::vector<Index>> ScenarioBuilder<Dim>::from_all(
    const std::optional<std::vector<Index>>& own) {
  if (team_.any(!own)) return std::nullopt;
  std::vector<Index> all;
  for (const auto& ids : team_.gather(*own)) all.insert(all.end(), ids.begin(), ids.end());
  std::sort(all.begin(), all.end());
  return all;
}

template <int Dim>
void ScenarioBuilder<Dim>::build_frame_set() {
  const JsonValue* set = section("post_processing").find("frame_pset");
  if (!set || (set->is_number() && set->number() == -1)) return;  // all, whenever they come in
  const auto own = members_of(*set, sets_.particles);
  if (team_.any(!own) || !particles_complete_) return;
  need_memory(*set, sizeof(Index) * static_cast<double>(team_.sum(static_cast<Index>(own->size()))),
              "the ids of a set of particles");
  auto ids = from_all(own);
  if (ids->empty())
    in_.error(
        *set,
        fmt::format("the particle set {} is empty: frames would have no particles", to_json(*set)),
        "leave 'frame_pset' out: frames then have all particles");
  model_.output.frame_particles = std::make_shared<const std::vector<Index>>(std::move(*ids));
}

template <int Dim>
void ScenarioBuilder<Dim>::read_gauge(const JsonValue& entry) {
  const auto type = get_text(entry, "type"), name = get_text(entry, "name");
  if (!type || !name || !mesh_) return;
  auto& gauges = model_.output.measured.gauges;
  Gauge gauge;
  gauge.kind = kind_of(*type);
  gauge.name = *name;
  if (name->empty() || name->find_first_of(std::string_view("/\0", 2)) != name->npos ||
      name->front() == '.')
    in_.error(*entry.find("name"),
              fmt::format("'name' must be the name of a file, found {}", json_quoted(*name)),
              "its table is gauges/NAME.csv in the run folder");
  if (std::any_of(gauges.begin(), gauges.end(), [&](const Gauge& g) { return g.name == *name; }))
    in_.error(*entry.find("name"), fmt::format("there are two gauges {}", json_quoted(*name)),
              "their tables need different names");
  if (gauge.kind == GaugeKind::columns && model_.analysis.plane == Plane::axisymmetric)
    in_.error(entry, "a body of revolution has no thickness in plan",
              "a gauge of \"type\": \"line\" has fields along a line");
  read_places(entry, gauge);
  if (const auto radius = get_number(entry, "radius")) gauge.radius.fill(*radius);
  for (const std::string_view key : {"direction", "normal"})
    if (const auto along = get_vector<Dim>(entry, key)) {
      if (along->norm() == 0)
        in_.error(*entry.find(key), fmt::format("'{}' has no length", key));
      else
        gauge.direction = in_space<Dim>(along->normalized());
    }
  if (entry.find("material"))
    if (const int material = find_material(entry, false); material >= 0)
      gauge.material = static_cast<int>(model_.materials[static_cast<std::size_t>(material)].id);
  gauge.fields = get_texts(entry, "fields");
  if (const JsonValue* fields = entry.find("fields")) {
    check_fields(*fields);
    if (gauge.kind == GaugeKind::points && gauge.material < 0) warn_of_mixed_fields(*fields);
  }
  gauge.of_set = entry.find("pset");
  if (gauge.of_set) {
    auto ids = from_all(members(entry, "pset_id", "pset", sets_.particles));
    if (!ids) return;
    gauge.ids = std::move(*ids);
  }
  if (gauge.kind == GaugeKind::force && !read_held(entry, gauge)) return;
  const auto count = static_cast<Index>(gauge.ids.size());
  if (gauge.kind == GaugeKind::track && count > most_tracked)
    in_.error(*entry.find("pset"),
              fmt::format("a track has at most {} particles; this set has {}",
                          format_count(most_tracked), format_count(count)),
              "\"type\": \"particles\" gives their sums and means");
  gauges.push_back(std::move(gauge));
}

template <int Dim>
bool ScenarioBuilder<Dim>::read_held(const JsonValue& entry, Gauge& gauge) {
  const JsonValue *nset = entry.find("nset"), *body = entry.find("rigid_body");
  if (!nset == !body) {
    in_.error(entry, "a gauge of forces needs 'nset' or 'rigid_body', one of them",
              "\"nset\": a set of nodes that are held; \"rigid_body\": the name of a body");
    return false;
  }
  if (body) {
    const auto name = get_text(entry, "rigid_body");
    std::vector<std::string> names;
    for (const auto& known : model_.rigid_bodies) {
      if (name && known.name == *name) gauge.body = static_cast<int>(names.size());
      names.push_back(known.name);
    }
    if (entry.find("at"))
      in_.error(*entry.find("at"),
                "'at' goes with 'nset': moments on a rigid body are about its centre");
    const bool all_read = names.size() == get_list(root_, "rigid_bodies").size();
    if (name && gauge.body < 0 && all_read)  // else what is wrong with one of them was said
      in_.error(
          *body, fmt::format("no rigid body has the name {}", json_quoted(*name)),
          names.empty() ? "there are no rigid bodies" : suggest(*name, names, "rigid bodies"));
    return gauge.body >= 0;
  }
  if (model_.analysis.two_phase && model_.analysis.damping > 0)
    in_.error(*nset, "forces on nodes are not measured where the liquid in pores is damped");
  auto nodes = from_all(members(entry, "nset_id", "nset", sets_.nodes));
  if (!nodes) return false;
  gauge.ids = std::move(*nodes);
  for (int d = 0; d < Dim; ++d) {
    const auto held = from_all(held_nodes(gauge.ids, d));
    gauge.held[static_cast<std::size_t>(d)] =
        !gauge.ids.empty() && held->size() == gauge.ids.size();
  }
  return true;
}

template <int Dim>
std::vector<Index> ScenarioBuilder<Dim>::held_nodes(const std::vector<Index>& nodes,
                                                    int axis) const {
  std::vector<Index> held;
  for_each_condition([&]<class T>() {
    if constexpr (std::is_same_v<T, NodeForce> || std::is_same_v<T, NodePressure>) return;
    for (const T& entry : entries_of<T>(model_)) {
      const auto [node, direction] = place_of(entry);
      if (direction == axis && std::ranges::binary_search(nodes, node) &&
          !std::ranges::binary_search(model_.node_frames, node, {}, &NodeFrame<Dim>::node))
        held.push_back(node);
    }
  });
  sort_unique(held);
  return held;
}

template <int Dim>
void ScenarioBuilder<Dim>::read_places(const JsonValue& entry, Gauge& gauge) {
  // Weights of particles that lie equally far apart sum up to one where this distance divides the
  // radius, as it does an edge of a cell.
  const Vec<Dim> cell = outer_cell();
  for (int d = 0; d < Dim; ++d) gauge.radius[static_cast<std::size_t>(d)] = cell[d];
  const bool in_plan = gauge.kind == GaugeKind::columns;
  const auto place = [&](std::string_view key) -> std::optional<std::array<double, 3>> {
    const JsonValue* value = entry.find(key);
    if (!value) return std::nullopt;
    const auto numbers = get_numbers(entry, key);
    constexpr std::size_t plan = Dim - 1;
    if (in_plan && numbers.size() != plan) {
      in_.error(*value, fmt::format("'{}' is a place in plan, {}; found {} numbers", key,
                                    Dim == 2 ? "[x]" : "[x, y]", numbers.size()));
      return std::nullopt;
    }
    std::array<double, 3> x{};
    std::copy_n(numbers.begin(), std::min(numbers.size(), x.size()), x.begin());
    return x;
  };
  if (const auto at = place("at")) {
    gauge.origin = *at;
    if (gauge.kind == GaugeKind::points || in_plan) gauge.places = {*at};
  }
  const auto from = place("from"), to = place("to");
  if (!from || !to) return;
  const Index n = get_integer(entry, "places").value_or(2);
  for (Index i = 0; i < n; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(n - 1);
    auto& x = gauge.places.emplace_back();
    for (std::size_t d = 0; d < 3; ++d) x[d] = (*from)[d] + share * ((*to)[d] - (*from)[d]);
  }
}

template <int Dim>
std::vector<std::string> ScenarioBuilder<Dim>::field_names() const {
  std::vector<std::string> known;
  for (const ColumnInfo& column : column_table)
    if (column.exported && column.column != Column::state) known.emplace_back(column.name);
  for (const StateVariable* variable : state_variables(model_.materials))
    known.emplace_back(variable->name);
  for (const DerivedField& field : derived_fields) known.emplace_back(field.name);
  return known;
}

// Materials that lack a state variable have zeros in its column.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_mixed_fields(const JsonValue& given) {
  if (!given.is<JsonValue::Array>()) return;
  std::set<int> liquids;  // no particle has them as its material
  for (const auto& [skeleton, liquid] : liquids_) liquids.insert(liquid);
  for (const JsonValue& name : given.as<JsonValue::Array>()) {
    if (!name.is<std::string>()) continue;
    bool any = false;
    std::vector<std::string> without;
    for (std::size_t m = 0; m < model_.materials.size(); ++m) {
      if (liquids.contains(static_cast<int>(m))) continue;
      const auto variables = state_variables(model_.materials[m].law);
      if (std::ranges::any_of(variables, [&](const StateVariable& variable) {
            return variable.name == name.as<std::string>();
          }))
        any = true;
      else
        without.push_back(model_.materials[m].name);
    }
    if (any && !without.empty())
      in_.warning(name,
                  fmt::format("{} is 0 in particles of {}, which the mean of this gauge takes in, "
                              "too",
                              json_quoted(name.as<std::string>()), join(without)),
                  "name the 'material' whose particles are meant; \"mean_stress\" is there in all");
  }
}

template <int Dim>
void ScenarioBuilder<Dim>::check_fields(const JsonValue& given) {
  if (!given.is<JsonValue::Array>()) return;
  const std::vector<std::string> known = field_names();
  for (const JsonValue& name : given.as<JsonValue::Array>())
    if (name.is<std::string>() &&
        std::find(known.begin(), known.end(), name.as<std::string>()) == known.end())
      in_.error(name,
                fmt::format("particles have no field {}", json_quoted(name.as<std::string>())),
                suggest(name.as<std::string>(), known, "fields"));
  if (given.as<JsonValue::Array>().empty())
    in_.error(given, "no field is named", suggest("", known, "fields"));
}

template <int Dim>
void ScenarioBuilder<Dim>::read_node_fields(const JsonValue& given) {
  if (!given.is<JsonValue::Array>()) return;
  std::vector<std::string> known;
  for (const NodeFieldInfo& info : node_field_table) known.emplace_back(info.name);
  auto& fields = model_.output.node_fields;
  for (const JsonValue& name : given.as<JsonValue::Array>()) {
    if (!name.is<std::string>()) continue;
    const std::string& text = name.as<std::string>();
    const auto found = std::find(known.begin(), known.end(), text);
    if (found == known.end()) {
      in_.error(name, fmt::format("nodes have no field {}", json_quoted(text)),
                suggest(text, known, "fields"));
      continue;
    }
    const NodeField field = node_field_table[static_cast<std::size_t>(found - known.begin())].field;
    if (std::find(fields.begin(), fields.end(), field) != fields.end())
      in_.error(name, fmt::format("{} is named twice", json_quoted(text)));
    fields.push_back(field);
  }
  model_.analysis.shows_nodes = !fields.empty();
}

template <int Dim>
void ScenarioBuilder<Dim>::read_maps(const JsonValue& given) {
  if (Dim == 2)
    return in_.error(given, "'maps' need three dimensions",
                     "a gauge of \"type\": \"section\" has the thickness along a line");
  if (!mesh_) return;
  const auto [low, high] = mesh_->bounds();
  const Vec<Dim> cell = outer_cell();
  MapPlan& maps = model_.output.measured.maps;
  maps.wanted = true;
  maps.cell = get_number(given, "cell_size").value_or(std::max(cell[0], cell[1]));
  maps.threshold = get_number(given, "threshold").value_or(0.1 * cell[Dim - 1]);
  maps.height = high[Dim - 1] - low[Dim - 1];
  const auto corner = [&](std::string_view key, const Vec<Dim>& usual) {
    const auto numbers = get_numbers(given, key);
    if (given.find(key) && numbers.size() != 2)
      in_.error(*given.find(key),
                fmt::format("'{}' must be [x, y], found {} numbers", key, numbers.size()));
    return numbers.size() == 2 ? std::array<double, 2>{numbers[0], numbers[1]}
                               : std::array<double, 2>{usual[0], usual[1]};
  };
  maps.low = corner("min", low);
  const auto end = corner("max", high);
  constexpr double rounding = 1e-9;  // an extent of whole cells to rounding has no cell more
  double cells = 1;
  for (std::size_t d = 0; d < 2; ++d) {
    const double n = std::ceil((end[d] - maps.low[d]) / maps.cell - rounding);
    if (!(n >= 1)) return in_.error(given, "'max' of maps must be above 'min'");
    cells *= n;
    maps.n[d] = static_cast<Index>(std::min(n, 1e9));
  }
  if (cells > static_cast<double>(most_cells))
    in_.error(given,
              fmt::format("the maps would have {:.3g} cells; at most {} are possible", cells,
                          format_count(most_cells)),
              "choose a larger cell_size, or a smaller part with min and max");
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
