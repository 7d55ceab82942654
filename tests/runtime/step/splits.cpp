// Particles gather in few cells: patches are split, and no way of executing makes a difference.
#include <doctest/doctest.h>

#include <cmath>

#include "runtime/patches/patch_set.h"
#include "tests/runtime/step/falling_dust.h"
#include "tests/runtime/step/restart_checks.h"

using namespace lahar;
using namespace lahar::test;

namespace {

template <int Dim>
Index splits_after(const Model<Dim>& model, Index steps) {
  Simulation simulation(model, serial());
  simulation.advance(steps);
  return simulation.info().splits;
}

constexpr Scheme schemes[] = {Scheme::usf, Scheme::usl, Scheme::musl};

}  // namespace

TEST_CASE("patches into which particles fall are split, and nothing gets lost") {
  Model<2> model = falling_dust();
  Simulation simulation(model, serial());
  const HistoryRow before = simulation.history();
  simulation.run();
  CHECK(simulation.info().splits > 5);
  const HistoryRow after = simulation.history();
  CHECK(after.particles == before.particles);
  CHECK(after.mass == before.mass);

  // Every particle once, every patch with its neighbours, and none with far too many.
  const Frame end = simulation.frame();
  for (std::size_t k = 0; k < end.id.size(); ++k) REQUIRE(end.id[k] == static_cast<Index>(k));
  const PatchGraph graph = simulation.patch_graph();
  for (int p = 0; p < graph.size(); ++p)
    for (const auto& edge : graph.edges[static_cast<std::size_t>(p)]) {
      const auto& back = graph.edges[static_cast<std::size_t>(edge.patch)];
      CHECK(std::any_of(back.begin(), back.end(), [&](const auto& other) {
        return other.patch == p && other.shared_nodes == edge.shared_nodes;
      }));
    }
  model.analysis.split_steps = 0;
  Simulation whole(model, serial());
  whole.run();
  CHECK(whole.info().splits == 0);
  const auto most = [](const Simulation& of) {
    const std::vector<Index> counts = of.patch_counts();
    return *std::max_element(counts.begin(), counts.end());
  };
  CHECK(10 * most(simulation) < 7 * most(whole));

  // Sums are made in another order, and that is all.
  const Frame other = whole.frame();
  double largest = 0;
  for (std::size_t k = 0; k < end.coordinates.size(); ++k)
    largest = std::max(largest, std::abs(end.coordinates[k] - other.coordinates[k]));
  CHECK(largest < 1e-10);
  CHECK(largest > 0);
}

TEST_CASE("splits give the serial loop's bits") {
  for (const Scheme scheme : schemes) {
    Model<2> model = falling_dust();
    model.analysis.scheme = scheme;
    CAPTURE(static_cast<int>(scheme));
    REQUIRE(splits_after(model, model.analysis.nsteps) > 2);
    const Outcome reference = run(model, serial());
    REQUIRE(reference.error == "");
    for (const ExecutionOptions& way : other_ways()) {
      CAPTURE(describe(way));
      CHECK(same_bits(run(model, way), reference));
    }
  }
  Model<2> table = distorted(falling_dust(), 0.008);
  REQUIRE(splits_after(table, table.analysis.nsteps) > 2);
  const Outcome reference = run(table, serial());
  REQUIRE(reference.error == "");
  for (const ExecutionOptions& way : {flow(2), flow(3), random_order(1)})
    CHECK(same_bits(run(table, way), reference));
  for (const int rings : {1, 2}) {
    ExecutionOptions way = flow(2), alone = serial();
    way.support_rings = alone.support_rings = rings;
    const Model<2> model = falling_dust();
    const Outcome ringed = run(model, alone);
    REQUIRE(ringed.error == "");
    CHECK(same_bits(run(model, way), ringed));
  }
}

TEST_CASE("a run goes on from any step around a split") {
  const Model<2> model = falling_dust();
  Simulation whole(model, serial());
  std::vector<Index> splits;  // steps after which there are more
  for (Index before = 0; whole.step() < model.analysis.nsteps; before = whole.info().splits) {
    whole.advance(1);
    if (whole.info().splits > before) splits.push_back(whole.step());
  }
  REQUIRE(splits.size() > 1);
  const Index first = splits.front(), end = splits.back() + 5;
  for (Index middle = first - max_lead - 1; middle <= first + 1; ++middle)
    check_restart(model, middle, end, {flow(2), serial()});
  check_restart(model, splits.back() + 1, end, {random_order(5), flow(3)});

  Model<2> table = distorted(falling_dust(), 0.008);
  table.analysis.scheme = Scheme::musl;
  check_restart(table, end / 2, end, {flow(2), serial()});
}

TEST_CASE("splits do not depend on drains, and a run that ends before one can be made longer") {
  Model<2> model = falling_dust();
  Simulation whole(model, serial());
  whole.advance(60);
  REQUIRE(whole.info().splits > 0);
  const StoredState expected(whole.state());
  Simulation stepwise(model, flow(2));
  while (stepwise.step() < 60) stepwise.advance(1);
  CHECK(difference(StoredState(stepwise.state()), expected) == "");
  for (Index end = 20; end < 60; end += 3) {
    model.analysis.nsteps = end;
    Simulation first(model, flow(2));
    first.run();
    const StoredState state(first.state());
    model.analysis.nsteps = 100;
    Simulation longer(model, serial(), {}, state.view());
    longer.advance(60 - end);
    CHECK(difference(StoredState(longer.state()), expected) == "");
  }
}

TEST_CASE("splits in three dimensions, with adaptive steps and frames that are not copied") {
  Model<3> model = falling_dust_3d();
  model.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
  REQUIRE(splits_after(model, model.analysis.nsteps) > 2);
  check_restart(model, 31, 60);
  ExecutionOptions large = flow(2);
  large.staging_bytes = 0;
  std::vector<Frame> frames;
  Observer observer;
  observer.frame = [](FramePieces&&) { FAIL("is to be written without a copy"); };
  observer.large_frame = [&](const FrameSource& frame) { frames.push_back(join(frame)); };
  Simulation simulation(model, large, observer);
  simulation.run();
  frames.push_back(simulation.frame());
  const Outcome copied = run(model, serial());
  CHECK(same_bits(Outcome{frames, {}, 0, "", ""}, Outcome{copied.frames, {}, 0, "", ""}));
}

TEST_CASE("where no patch is crowded, looking for crowds changes no bit") {
  Model<2> model = two_discs();
  std::vector<StoredState> states;
  for (const Index steps : {0, 1, 7, 100}) {
    model.analysis.split_steps = steps;
    Simulation simulation(model, flow(2));
    simulation.advance(40);
    CHECK(simulation.info().splits == 0);
    states.emplace_back(simulation.state());
    CHECK(difference(states.back(), states.front()) == "");
  }
}

TEST_CASE("a crowd in a single cell is left alone") {
  Model<2> model = falling_dust();
  model.analysis.patch_particles = 1;
  for (auto& x : model.particles.x) x = 0.025 * Vec<2>::Ones() + 1e-4 * x;
  model.particles.cell.assign(model.particles.x.size(), 0);
  model.particles.velocity.clear();
  model.gravity.setZero();
  CHECK(splits_after(model, 20) == 0);
}

TEST_CASE("a state whose splits are none of the mesh is refused") {
  const Model<2> model = falling_dust();
  StoredState state(Simulation(model, serial()).state());
  state.run.splits = {{.patch = 0, .axis = 0, .at = 1'000'000}};
  CHECK_THROWS_WITH_AS(Simulation(model, serial(), {}, state.view()),
                       doctest::Contains("patches were split otherwise"), InputError);
}
