// The step graphs of every scheme and option are correct for any neighbourhood.
#include <doctest/doctest.h>

#include <set>

#include "runtime/timestep.h"
#include "tests/graph/step_graphs.h"

using namespace lahar;
using namespace lahar::test;

namespace {

template <int Dim>
std::vector<Stage> stages_of(const Analysis& analysis) {
  std::vector<Stage> stages;
  for (const auto& stage : timestep<Dim>(analysis)) stages.push_back(stage.stage);
  return stages;
}

std::vector<Analysis> every_option() {
  std::vector<Analysis> all;
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl})
    for (const bool smoothing : {false, true})
      for (const bool adaptive : {false, true}) {
        Analysis analysis;
        analysis.scheme = scheme;
        analysis.pressure_smoothing = smoothing;
        analysis.step.adaptive = adaptive;
        all.push_back(analysis);
      }
  return all;
}

}  // namespace

TEST_CASE("every scheme and option is a safe marked graph on every neighbourhood") {
  std::vector<Neighbours> neighbourhoods{block(5, 4), block(9, 1), block(1, 1), {{}, {}}};
  for (std::uint64_t seed = 1; seed <= 8; ++seed)
    neighbourhoods.push_back(irregular(12, 0.1 * static_cast<double>(seed), seed));
  for (const Analysis& analysis : every_option())
    for (const Neighbours& neighbours : neighbourhoods) {
      const TaskGraph graph = make_task_graph(stages_of<2>(analysis), neighbours);
      CHECK(graph.has_dt == analysis.step.adaptive);
      CHECK(unsafe_edges(graph).empty());
    }
}

TEST_CASE("every scheme and option runs on threads and in random order as its stages say") {
  for (const Analysis& analysis : every_option())
    for (const Way way : all_ways) {
      const auto stages = stages_of<2>(analysis);
      const Neighbours neighbours = block(5, 4);
      Watch watch(stages, neighbours);
      const auto executor =
          make_executor(way.kind, make_task_graph(stages, neighbours), watch.bodies(), way.threads);
      CHECK(executor->run(0, 60) == 60);
      CHECK(watch.wrong() == "");
      CHECK(watch.all_done(60));
    }
}

TEST_CASE("schemes update stresses where their names say") {
  const auto position = [](const std::vector<Stage>& stages, const std::string& name) {
    const auto at = std::find_if(stages.begin(), stages.end(),
                                 [&](const Stage& stage) { return stage.name == name; });
    return at - stages.begin();
  };
  for (const Analysis& analysis : every_option()) {
    const auto stages = stages_of<2>(analysis);
    const auto at = [&](const char* name) { return position(stages, name); };
    std::set<std::string> names;
    for (const Stage& stage : stages) names.insert(stage.name);
    CHECK(names.size() == stages.size());
    if (analysis.scheme == Scheme::usf) {
      CHECK(at("velocity") < at("stress"));
      CHECK(at("stress") < at("force"));
    } else {
      CHECK(at("G2P") < at("stress"));
      CHECK(at("stress") < at("locate"));
    }
    if (analysis.scheme == Scheme::musl) CHECK(at("P2G again") < at("velocity"));
    CHECK((at("strain") < at("stress")) == analysis.pressure_smoothing);
    CHECK(stages.front().exchange == "particles");
    CHECK(stages.back().name == output_stage);
    // Three dimensions differ in the kernels only.
    const auto solid = stages_of<3>(analysis);
    REQUIRE(solid.size() == stages.size());
    for (std::size_t s = 0; s < stages.size(); ++s) {
      CHECK(solid[s].name == stages[s].name);
      CHECK(solid[s].exchange == stages[s].exchange);
    }
  }
}

TEST_CASE("one exchange of sums per step for USL, two for USF and MUSL, one more for smoothing") {
  for (const Analysis& analysis : every_option()) {
    int exchanges = 0;
    for (const Stage& stage : stages_of<2>(analysis))
      exchanges += !stage.exchange.empty() && stage.exchange != "particles";
    CHECK(exchanges ==
          (analysis.scheme == Scheme::usl ? 1 : 2) + (analysis.pressure_smoothing ? 1 : 0));
  }
}
