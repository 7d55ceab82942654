// The exchange of nodal sums between patches, for any width of the shared layer.
#include <doctest/doctest.h>

#include <map>

#include "physics/kernels.h"
#include "runtime/patch_set.h"
#include "runtime/timestep.h"
#include "tests/runtime/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A value that depends on patch, node and component; sums of these depend on their order.
double dummy(Index patch, Index node, int component) {
  std::seed_seq seed{patch, node, static_cast<Index>(component)};
  std::mt19937_64 random(seed);
  return std::uniform_real_distribution<>(-1, 1)(random) *
         std::pow(10.0, std::uniform_int_distribution<>(-6, 6)(random));
}

template <int Dim>
void check_sums(Model<Dim> model, int rings) {
  PatchSet<Dim> patches(model, rings);
  REQUIRE(patches.size() > 8);
  for (int k = 0; k < n_node_sums; ++k) {
    const int width = node_sum_width<Dim>[static_cast<std::size_t>(k)];
    const auto at = static_cast<std::size_t>(k);
    // As a wider shape function would: every patch contributes to its ring too.
    std::map<Index, std::vector<double>> expected;
    std::map<Index, int> holders;
    for (int i = 0; i < patches.size(); ++i) {
      Patch<Dim>& patch = patches[i];
      for (Local n = 0; n < patch.n_nodes(); ++n) {
        const Index node = patch.topology.nodes[static_cast<std::size_t>(n)];
        auto& sum = expected.try_emplace(node, width, 0.0).first->second;
        ++holders[node];
        for (int c = 0; c < width; ++c) {
          const double value = dummy(patch.topology.patch, node, c);
          patch.partial[at][static_cast<std::size_t>(n * width + c)] = value;
          sum[static_cast<std::size_t>(c)] += value;
        }
      }
    }
    bool same = true;
    int most = 0;
    for (int i = 0; i < patches.size(); ++i) {
      Patch<Dim>& patch = patches[i];
      sum_over_patches(patch, static_cast<NodeSum>(k));
      for (Local n = 0; n < patch.n_nodes(); ++n) {
        const Index node = patch.topology.nodes[static_cast<std::size_t>(n)];
        most = std::max(most, holders[node]);
        for (int c = 0; c < width; ++c)
          same = same && patch.total[at][static_cast<std::size_t>(n * width + c)] ==
                             expected[node][static_cast<std::size_t>(c)];
      }
    }
    CHECK(same);
    CHECK(most >= 1 << Dim);
  }
}

}  // namespace

TEST_CASE("sums of shared nodes are those of all patches in ascending order, ring included") {
  for (const int rings : {0, 1, 2}) {
    CAPTURE(rings);
    check_sums(two_discs(), rings);
    check_sums(dam_break_3d(), rings);
    check_sums(distorted(two_discs(), 0.012), rings);
    check_sums(distorted(dam_break_3d(), 0.03), rings);
  }
}

namespace {

/// Steps the stages by hand and compares all copies of every node after each nodal stage.
template <int Dim>
void check_copies(Model<Dim> model, int rings, int steps) {
  PatchSet<Dim> patches(model, rings);
  const auto stages = timestep<Dim>(model.analysis);
  int compared = 0;
  bool same = true;
  for (int step = 0; step < steps; ++step) {
    const double dt = model.analysis.step.dt;
    const StepContext<Dim> context{&model, &patches.partition(), step, step * dt, dt};
    for (const auto& stage : stages) {
      if (!stage.kernel) continue;
      for (int i = 0; i < patches.size(); ++i) {
        Patch<Dim>& patch = patches[i];
        const bool first = &stage == &stages.front();
        if (first || !patch.idle || stage.stage.name == locate_stage) stage.kernel(patch, context);
        if (first) update_idle(patch);
      }
      if (stage.stage.name != "integrate" && stage.stage.name != "velocity") continue;
      std::map<Index, std::vector<double>> copies;
      for (int i = 0; i < patches.size(); ++i) {
        const Patch<Dim>& patch = patches[i];
        if (patch.idle) continue;
        for (Local n = 0; n < patch.n_nodes(); ++n) {
          std::vector<double> state;
          for (int d = 0; d < Dim; ++d) {
            state.push_back(patch.velocity[static_cast<std::size_t>(n * Dim + d)]);
            if (stage.stage.name == "integrate")
              state.push_back(patch.acceleration[static_cast<std::size_t>(n * Dim + d)]);
          }
          for (int c = 0; c < 4; ++c)
            state.push_back(patch.total[0][static_cast<std::size_t>(n * 4 + c)]);
          const Index node = patch.topology.nodes[static_cast<std::size_t>(n)];
          const auto [copy, is_new] = copies.try_emplace(node, state);
          if (is_new) continue;
          ++compared;
          same = same && same_bits(copy->second, state);
        }
      }
    }
  }
  CHECK(same);
  CHECK(compared > 500);
}

}  // namespace

TEST_CASE("all copies of a shared node have the same mass, velocity and acceleration") {
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl})
    for (const int rings : {0, 1}) {
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(rings);
      Model<2> discs = two_discs();
      discs.analysis.scheme = scheme;
      discs.analysis.damping = 0.05;
      discs.node_forces = {{.node = 210, .dir = 0, .force = 2.0, .function = -1}};
      check_copies(discs, rings, 20);
      Model<3> water = dam_break_3d();
      water.analysis.scheme = scheme;
      check_copies(water, rings, 10);
      check_copies(distorted(discs, 0.012), rings, 10);
    }
}

TEST_CASE("a patch set holds every particle once, in the patch of its cell") {
  const Model<2> model = two_discs();
  Model<2> used = model;
  const PatchSet<2> patches(used, 0);
  CHECK(patches.particles() == model.particles.size());
  std::vector<int> seen(static_cast<std::size_t>(model.particles.size()), 0);
  for (int i = 0; i < patches.size(); ++i) {
    const Patch<2>& patch = patches[i];
    for (Local p = 0; p < patch.particles.size(); ++p) {
      const auto id = static_cast<std::size_t>(patch.particles.id[static_cast<std::size_t>(p)]);
      ++seen[id];
      const auto cell = patch.particles.cell[static_cast<std::size_t>(p)];
      CHECK(patch.topology.cells[static_cast<std::size_t>(cell)] == model.particles.cell[id]);
      CHECK(patch.particles.row(Column::mass)[p] ==
            model.particles.volume[id] * model.materials[model.particles.material[id]].density);
    }
  }
  CHECK(std::count(seen.begin(), seen.end(), 1) == static_cast<long>(seen.size()));
}
