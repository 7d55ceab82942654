// What pictures of the model show beside its materials (model_marks.h).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "io/base/text.h"
#include "io/scenario/scenario_builder.h"

namespace lahar {

namespace {

using MarkKind = ModelMark::Kind;

/// What the entries of a list do, and the number that says how much.
struct MarkedList {
  const char* key;
  MarkKind kind;
  const char* verb;        ///< before the axes
  const char* value = "";  ///< key of the number
  const char* unit = "";
  bool of_particles = false;
};

constexpr MarkedList constraints[] = {
    {"velocity_constraints", MarkKind::held, "held", "velocity", "m/s"},
    {"walls", MarkKind::wall, "wall", "friction", ""},
    {"friction_constraints", MarkKind::wall, "friction", "friction", ""},
    {"absorbing_constraints", MarkKind::soft, "absorbs waves"},
    {"spring_constraints", MarkKind::soft, "springs", "stiffness", "N/m"},
    {"acceleration_constraints", MarkKind::moved, "accelerated", "acceleration", "m/s^2"},
    {"displacement_constraints", MarkKind::moved, "displaced", "displacement", "m per step"},
    {"pressure_constraints", MarkKind::soft, "pore pressure", "pressure", "Pa"},
    {"particles_velocity_constraints", MarkKind::moved, "particles move", "velocity", "m/s", true}};
constexpr MarkedList loads[] = {
    {"concentrated_nodal_forces", MarkKind::load, "force", "force", "N"},
    {"particle_surface_traction", MarkKind::load, "traction", "traction", "Pa", true}};

constexpr const char* axes = "xyz";

/// "held in x", "moves in x with 0.5 m/s", "wall, friction 0.3".
std::string deed_of(const JsonValue& entry, const MarkedList& list, int dim, ModelMark& mark) {
  const auto value = get_number(entry, list.value);
  const bool has_dir = entry.find("dir") != nullptr;
  const int dir = has_dir ? get_direction(entry, "dir").value_or(0) : 0;
  const std::string along =
      has_dir ? fmt::format(" in {}{}", axes[dir % dim], dir >= dim ? " (liquid)" : "") : "";
  if (value && has_dir && dir < dim)
    mark.direction[static_cast<std::size_t>(dir)] = *value > 0 ? 1 : *value < 0 ? -1 : 0;
  const std::string in_time = entry.find("math_function_id") ? " times a function" : "";
  const auto rough = get_text(entry, "friction");
  if (rough) return "rough wall";
  if (mark.kind == MarkKind::wall)
    return fmt::format("{}{}{}", list.verb,
                       std::string_view(list.key) == "walls" ? ", friction" : "",
                       value ? fmt::format(" {:g}", *value) : "");
  const bool still = value && *value == 0;
  if (still && mark.kind != MarkKind::load && std::string_view(list.verb) != "pore pressure")
    return fmt::format("held{}", along);
  if (mark.kind == MarkKind::held) mark.kind = MarkKind::moved;
  const std::string verb = std::string_view(list.verb) == "held" ? "moves" : list.verb;
  return fmt::format("{}{}{}{}", verb, along,
                     value ? fmt::format(" {:g} {}", *value, list.unit) : "", in_time);
}

/// Add what another entry says of the same set.
void join(ModelMark& mark, const ModelMark& other, const std::string& deed) {
  static const std::string held = "held in ";
  const bool both = deed.starts_with(held) && mark.label.find(held) != std::string::npos;
  mark.label += both ? ", " + deed.substr(held.size()) : "; " + deed;
  for (std::size_t d = 0; d < 3; ++d) mark.direction[d] += other.direction[d];
  if (other.kind == MarkKind::moved) mark.kind = MarkKind::moved;
}

}  // namespace

std::string name_of_set(const JsonValue* set) {
  if (!set) return "of a file";
  if (set->is<std::string>()) return set->as<std::string>();
  return set->number() == -1 ? "all" : "set " + to_json(*set);
}

template <int Dim>
template <class List>
void ScenarioBuilder<Dim>::mark_entries(const JsonValue& where, const List& list) {
  const EntitySets& sets = list.of_particles ? sets_.particles : sets_.nodes;
  std::map<std::string, std::size_t> of_set;  // place in the marks
  auto entries = get_list(where, list.key);
  if (const JsonValue* one = where.find(list.key); one && one->template is<JsonValue::Object>())
    entries = {one};
  for (const JsonValue* entry : entries) {
    const JsonValue* set = list.of_particles ? in_.either(*entry, "pset_id", "pset")
                                             : in_.either(*entry, "nset_id", "nset");
    const std::string name = name_of_set(set);
    ModelMark mark;
    mark.kind = list.kind;
    const std::string deed = deed_of(*entry, list, Dim, mark);
    if (const auto same = of_set.find(name); same != of_set.end()) {
      join((*in_.marks)[same->second], mark, deed);
      continue;
    }
    of_set[name] = in_.marks->size();
    mark.label = name + ": " + deed;
    mark.everywhere = name == "all";
    if (set && !mark.everywhere)
      if (const auto* found = sets.find(*set, in_))
        (list.of_particles ? mark.particles : mark.nodes) = *found;
    in_.marks->push_back(std::move(mark));
  }
}

template <int Dim>
void ScenarioBuilder<Dim>::collect_marks() {
  if (!in_.marks) return;
  for (const MarkedList& list : constraints) mark_entries(boundary(), list);
  for (const MarkedList& list : loads) mark_entries(section("external_loading_conditions"), list);
  mark_water();
}

template <int Dim>
void ScenarioBuilder<Dim>::mark_water() {
  const JsonValue* given = section("mesh").find("particles_pore_pressures");
  if (!given || !given->is<JsonValue::Object>()) return;
  ModelMark mark;
  mark.kind = MarkKind::water;
  mark.label = "water table";
  mark.up = get_direction(*given, "dir_v").value_or(Dim - 1);
  mark.along = get_direction(*given, "dir_h").value_or(0);
  for (const JsonValue* entry : get_list(*given, "water_tables"))
    mark.levels.push_back(
        {get_number(*entry, "position").value_or(0), get_number(*entry, "h0").value_or(0)});
  if (written(*given, "surface")) {
    // Along the first axis through the middle of the mesh, where the section is.
    const auto& surface = *geometry_.find(*get_text(*given, "surface"))->second.surface;
    Vec<Dim> x = 0.5 * (mesh_->bounds().first + mesh_->bounds().second);
    for (const double at : surface.axes()[0]) {
      x[0] = at;
      if (const double level = surface.height(x); !std::isnan(level))
        mark.levels.push_back({at, level});
    }
  }
  std::sort(mark.levels.begin(), mark.levels.end());
  if (!mark.levels.empty()) in_.marks->push_back(std::move(mark));
}

template void ScenarioBuilder<2>::collect_marks();
template void ScenarioBuilder<3>::collect_marks();

}  // namespace lahar
