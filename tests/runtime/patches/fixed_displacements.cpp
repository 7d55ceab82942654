// The way of prescribed displacements to the nodes of patches.
#include <doctest/doctest.h>

#include <map>
#include <utility>

#include "runtime/patches/patch_set.h"
#include "runtime/step/timestep.h"
#include "tests/runtime/step/restart_checks.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Some nodes of the discs have one or two directions, in any order; of two entries for the same
/// the first counts.
Model<2> with_displacements(Model<2> model) {
  auto& list = entries_of<NodeDisplacement>(model);
  for (Index n = 0; n < model.mesh->n_nodes(); n += 3) {
    const double u = 1e-3 * static_cast<double>(n);
    list.push_back({n, 1, u, 0});
    if (n % 2 == 0) list.push_back({n, 0, -u});
    list.push_back({n, 1, 1.0});
  }
  model.functions = {{.x = {0, 1}, .f = {0, 1}}};
  return model;
}

using Place = std::pair<Index, int>;  // node of the mesh, direction

/// Entries of all patches by place, which agree where patches share a node.
std::map<Place, std::pair<double, int>> entries_of_patches(const PatchSet<2>& patches) {
  std::map<Place, std::pair<double, int>> all;
  for (int p = 0; p < patches.size(); ++p) {
    const Patch<2>& patch = patches[p];
    std::pair<Local, int> last(-1, 0);
    for (const auto& fixed : patch.fixed_displacement) {
      REQUIRE(std::pair(fixed.node, fixed.dir) > last);
      last = {fixed.node, fixed.dir};
      const Index node = patch.topology.nodes[static_cast<std::size_t>(fixed.node)];
      const std::pair<double, int> value(fixed.displacement, fixed.function);
      REQUIRE(all.try_emplace({node, fixed.dir}, value).first->second == value);
    }
  }
  return all;
}

/// All that is said of a node of a patch is in it.
void check_entries(const PatchSet<2>& patches) {
  const auto all = entries_of_patches(patches);
  std::size_t expected = 0;
  std::map<Index, bool> seen;
  for (int p = 0; p < patches.size(); ++p)
    for (const Index node : patches[p].topology.nodes) {
      if (node % 3 != 0 || std::exchange(seen[node], true)) continue;
      const double u = 1e-3 * static_cast<double>(node);
      ++expected;
      REQUIRE(all.at({node, 1}) == std::pair(u, 0));
      if (node % 2 != 0) continue;
      ++expected;
      REQUIRE(all.at({node, 0}) == std::pair(-u, -1));
    }
  CHECK(all.size() == expected);
  CHECK(expected > 100);
}

}  // namespace

TEST_CASE("patches have the displacements that are prescribed at their nodes") {
  Model<2> model = with_displacements(two_discs());
  const PatchSet<2> patches(model, 0, node_sum_copies(model.analysis));
  REQUIRE(patches.size() > 4);
  check_entries(patches);
}

TEST_CASE("patches of a state have the displacements of their nodes, too") {
  const Model<2> model = with_displacements(two_discs());
  Simulation simulation(model, serial(), {});
  simulation.advance(20);
  const StoredState stored(simulation.state());
  Model<2> again = model;
  check_entries(PatchSet<2>(again, 0, node_sum_copies(again.analysis), stored.view()));
}

TEST_CASE("particles have accelerations in Newmark's method, and else none") {
  Model<2> model = two_discs();
  const std::vector<char> used(model.materials.size(), 1);
  const auto has = [&] { return column_needs(model, used, false).acceleration; };
  CHECK(!has());
  model.analysis.scheme = Scheme::newmark;
  CHECK(has());
  model.analysis.implicit.quasi_static = true;
  CHECK(!has());
}
