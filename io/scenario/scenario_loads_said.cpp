// What loads are in all, in words: a wrong area is seen before the run.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "io/base/text.h"
#include "io/scenario/model_marks.h"
#include "io/scenario/scenario_builder.h"
#include "physics/particles/loads.h"

namespace lahar {

template <int Dim>
double ScenarioBuilder<Dim>::area_of(const ParticleTraction& traction) const {
  const auto& p = model_.particles;
  double sum = 0;
  for (const Index id : traction.particles) {
    const auto i = static_cast<std::size_t>(rows_.local(id));
    const double r = p.x[i][0], depth = depth_at(model_.analysis, r), volume = p.volume[i] / depth;
    std::array<double, static_cast<std::size_t>(Dim)> edges{};
    if (!p.edges.empty()) edges = p.edges[i];
    if (edges[0] == 0) edges.fill(std::pow(volume, 1.0 / Dim));
    if (traction.axis < 0) {
      sum += p.volume[i] / edges[0];
      continue;
    }
    const double area = area_across<Dim>(traction.axis, depth, edges),
                 offset = 0.5 * traction.side * p.volume[i] / area;
    sum += area * share_at_side(model_.analysis, traction.axis, r, offset);
  }
  return sum;
}

namespace {

/// Whether an entry of loads changes with time.
std::string of_time(const JsonValue& entry) {
  return written(entry, "math_function_id") ? ", times a function of time" : "";
}

}  // namespace

template <int Dim>
bool ScenarioBuilder<Dim>::is_per_metre() const {
  return Dim == 2 && model_.analysis.plane != Plane::axisymmetric;
}

template <int Dim>
void ScenarioBuilder<Dim>::describe_tractions(const std::vector<double>& own) {
  std::vector<double> areas(own.size(), 0.0);
  for (const auto& part : team_.gather(own))
    for (std::size_t t = 0; t < areas.size(); ++t) areas[t] += part[t];
  const bool flat = is_per_metre();
  const auto entries =
      get_list(section("external_loading_conditions"), "particle_surface_traction");
  for (std::size_t t = 0; t < std::min(entries.size(), areas.size()); ++t) {
    const JsonValue& entry = *entries[t];
    const double traction = get_number(entry, "traction").value_or(0);
    const double factor = hidden_loads_.empty() ? 1.0 : hidden_loads_[t].factor;
    const double area = factor * areas[t];
    const int dir = phase_direction_of(entry).value_or(0);
    in_.loads.push_back(fmt::format("{}: {:.4g} {} along {}{} ({:.4g} Pa on {:.4g} {}){}",
                                    printable(name_of_set(in_.either(entry, "pset_id", "pset"))),
                                    traction * area + 0.0, flat ? "N/m" : "N", "xyz"[dir % Dim],
                                    dir >= Dim ? ", on the liquid" : "", traction, area,
                                    flat ? "m" : "m^2", of_time(entry)));
  }
}

template <int Dim>
void ScenarioBuilder<Dim>::describe_nodal_forces() {
  const char* const unit = is_per_metre() ? "N/m" : "N";
  for (const JsonValue* entry : get_list(section("external_loading_conditions"), NodeForce::key)) {
    const auto force = get_number(*entry, "force");
    const auto dir = direction_of(*entry);
    const JsonValue* set = in_.either(*entry, "nset_id", "nset");
    if (!force || !dir || !set) continue;  // of a file
    const bool all = set->is_number() && set->number() == -1;
    const auto nodes = all ? std::nullopt : members_of(*set, sets_.nodes);
    const Index count = all ? n_nodes() : team_.sum(nodes ? static_cast<Index>(nodes->size()) : 0);
    in_.loads.push_back(fmt::format(
        "{}: {:.4g} {} along {} ({:.4g} {} at each of {} node{}){}", printable(name_of_set(set)),
        *force * static_cast<double>(count) + 0.0, unit, "xyz"[*dir], *force, unit,
        format_count(count), count == 1 ? "" : "s", of_time(*entry)));
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
