// Boundaries that waves leave through.
#include <fmt/format.h>

#include <algorithm>

#include "io/scenario/scenario_builder.h"

namespace lahar {

namespace {

/// Area of the boundary that belongs to a node of a regular mesh of squares or cubes, as a share of
/// a cell's face: by how many such faces meet there.
double share_of_face(std::string_view position, int dim) {
  const double whole = position == "face" || (position == "edge" && dim == 2) ? 1.0 : 0.5;
  return position == "corner" && dim == 3 ? 0.25 : whole;
}

}  // namespace

template <int Dim>
void ScenarioBuilder<Dim>::build_absorbing() {
  auto& out = model_.node_absorptions;
  for (const JsonValue* c : get_list(boundary(), "absorbing_constraints")) {
    const auto normal = direction_of(*c);
    const auto delta = get_number(*c, "delta"), h = get_number(*c, "h_min");
    const auto a = get_number(*c, "a"), b = get_number(*c, "b");
    const auto position = get_text(*c, "position");
    const auto nodes = members(*c, "nset_id", "nset", sets_.nodes);
    if (Dim == 2 && position == "face")
      in_.error(*c->find("position"), "'position': \"face\" is for three dimensions",
                "in two dimensions nodes are at an edge, and the first and last at a corner");
    if (!delta || !h || !a || !b) continue;
    const double least = *h / (2.0 * std::min(*a, *b));
    if (*delta < least)
      in_.error(*c->find("delta"),
                fmt::format("'delta' must be at least h_min / (2 a) and h_min / (2 b), {} m here, "
                            "found {}",
                            least, *delta),
                "springs are stiffer than the material in a thinner layer");
    if (!normal || !position || !nodes) continue;
    const double area = share_of_face(*position, Dim) * (Dim == 2 ? *h : *h * *h);
    for (const Index node : *nodes) out.push_back({node, *normal, area, *delta, *a, *b});
  }
  model_.analysis.absorbs = team_.any(!out.empty());
}

template void ScenarioBuilder<2>::build_absorbing();
template void ScenarioBuilder<3>::build_absorbing();

}  // namespace lahar
