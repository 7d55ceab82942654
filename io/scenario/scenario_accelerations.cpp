// Nodes whose acceleration is prescribed, such as those of a base that an earthquake shakes.
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "io/mesh/node_files.h"
#include "io/scenario/scenario_builder.h"

namespace lahar {

template <int Dim>
void ScenarioBuilder<Dim>::build_accelerations() {
  auto& out = model_.node_accelerations;
  const auto& held = model_.node_velocities;  // by node and direction
  const auto is_held = [&](Index node, int dir) {
    const auto at = std::lower_bound(
        held.begin(), held.end(), std::pair(node, dir),
        [](const NodeVelocity& a, const auto& key) { return std::pair(a.node, a.dir) < key; });
    return at != held.end() && at->node == node && at->dir == dir;
  };
  constexpr Index none = std::numeric_limits<Index>::max();
  for (const JsonValue* c : get_list(boundary(), "acceleration_constraints")) {
    const std::size_t before = out.size();
    if (from_file(*c, {"dir", "acceleration"})) {
      if (const JsonValue* function = c->find("math_function_id"))
        in_.error(*function, "'math_function_id' does not go together with 'file'",
                  "accelerations of a file are constant");
      const auto file = in_.open(*c, "file");
      if (!file) continue;
      if (const auto rows =
              read_node_values(*file, "the acceleration", {n_nodes(), Dim}, team_, in_.problems))
        for (const auto& [node, dir, a] : *rows) out.push_back({node, dir, a});
    } else {
      const auto dir = direction_of(*c);
      const auto a = get_number(*c, "acceleration");
      const int function = find_function(*c);
      const auto nodes = members(*c, "nset_id", "nset", sets_.nodes);
      if (!dir || !a || !nodes) continue;
      for (const Index node : *nodes) out.push_back({node, *dir, *a, function});
    }
    Index first = none;  // of all members
    for (std::size_t i = before; i < out.size(); ++i)
      if (is_held(out[i].node, out[i].dir)) first = std::min(first, out[i].node * Dim + out[i].dir);
    first = -team_.max(-first);
    if (first != none)
      in_.error(*c,
                fmt::format("node {} has a prescribed velocity in direction {} as well",
                            first / Dim, first % Dim),
                "prescribe one of them");
  }
}

template void ScenarioBuilder<2>::build_accelerations();
template void ScenarioBuilder<3>::build_accelerations();

}  // namespace lahar
