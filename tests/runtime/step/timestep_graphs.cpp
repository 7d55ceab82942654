// The step graphs of every scheme and option are correct for any neighbourhood.
#include <doctest/doctest.h>

#include <set>

#include "physics/model/transfer_options.h"
#include "runtime/step/timestep.h"
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

/// The tasks of a step: stages between two exchanges are one.
template <int Dim>
std::vector<Stage> step_tasks(const Analysis& analysis, bool cut = false) {
  return tasks_of(phases_of(stages_of<Dim>(analysis), cut));
}

std::vector<Analysis> every_option(int bodies = 1) {
  std::vector<Analysis> all;
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl})
    for (const bool smoothing : {false, true})
      for (const bool adaptive : {false, true}) {
        Analysis analysis;
        analysis.scheme = scheme;
        analysis.pressure_smoothing = smoothing;
        analysis.step.adaptive = adaptive;
        analysis.contact.bodies = bodies;
        all.push_back(analysis);
      }
  return all;
}

/// And contact of bodies, absorbing boundaries, nodes that particles drive, and B-bar.
std::vector<Analysis> every_option_and_contact() {
  std::vector<Analysis> all = every_option();
  for (const Analysis& analysis : every_option(2)) all.push_back(analysis);
  for (std::size_t k = all.size(); k-- > 0;) {
    all.push_back(all[k]);
    all.back().takes_means = true;
  }
  for (std::size_t k = all.size(); k-- > 0;) {
    all.push_back(all[k]);
    all.back().drives_nodes = true;
  }
  for (std::size_t k = all.size(); k-- > 0;) {
    if (all[k].pressure_smoothing) continue;  // does not go together with it
    all.push_back(all[k]);
    all.back().mean_volume = true;
  }
  return all;
}

}  // namespace

TEST_CASE("every scheme and option is a safe marked graph on every neighbourhood") {
  std::vector<Neighbours> neighbourhoods{block(5, 4), block(9, 1), block(1, 1), {{}, {}}};
  for (std::uint64_t seed = 1; seed <= 8; ++seed)
    neighbourhoods.push_back(irregular(12, 0.1 * static_cast<double>(seed), seed));
  for (const Analysis& analysis : every_option_and_contact())
    for (const Neighbours& neighbours : neighbourhoods) {
      for (const auto& list :
           {stages_of<2>(analysis), step_tasks<2>(analysis), step_tasks<2>(analysis, true)}) {
        const TaskGraph graph = make_task_graph(list, neighbours);
        CHECK(graph.has_dt == analysis.step.adaptive);
        CHECK(unsafe_edges(graph).empty());
      }
    }
}

TEST_CASE("every scheme and option runs on threads and in random order as its stages say") {
  for (const Analysis& analysis : every_option_and_contact())
    for (const Way way : all_ways)
      for (const bool cut : {false, true}) {
        const auto stages = step_tasks<2>(analysis, cut);
        const Neighbours neighbours = block(5, 4);
        Watch watch(stages, neighbours);
        const auto executor = make_executor(way.kind, make_task_graph(stages, neighbours),
                                            watch.bodies(), way.threads);
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
      CHECK(at("force") < at("integrate"));
    }
    if (analysis.scheme == Scheme::usl) {  // with the same nodal velocities, particles move last
      CHECK(at("integrate") < at("stress"));
      CHECK(at("stress") < at("G2P"));
      // Functions of axes give G2P the velocity gradients too, which stress takes from it. Smoothed
      // pressure needs an exchange between strain and stress.
      for (const auto functions :
           {ShapeFunctions::gimp, ShapeFunctions::quadratic_spline, ShapeFunctions::cubic_spline}) {
        Analysis wide = analysis;
        wide.functions = functions;
        const auto order = stages_of<2>(wide);
        CHECK(position(order, "integrate") < position(order, "G2P"));
        CHECK((position(order, "G2P") < position(order, "stress")) != analysis.pressure_smoothing);
      }
    }
    if (analysis.scheme == Scheme::musl) {
      CHECK(at("G2P") < at("P2G remap"));
      CHECK(at("P2G remap") < at("velocity"));
      CHECK(at("velocity") < at("stress"));
    }
    CHECK(at("stress") < at("locate"));
    CHECK(at("G2P") < at("locate"));
    CHECK(at("locate") <
          at("P2G"));  // of the next step, as is force but where stress is updated first
    const auto steps = timestep<2>(analysis);
    for (const auto& stage : steps)
      CHECK(stage.of_next_step == (stage.stage.name == "P2G" || (stage.stage.name == "force" &&
                                                                 analysis.scheme != Scheme::usf)));
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

TEST_CASE("with B-bar, forces are mapped when the particles of all cells have arrived") {
  const std::vector<std::pair<Scheme, std::vector<std::string>>> all{
      {Scheme::usl, {"arrivals, force", "integrate, stress, G2P, locate, P2G, output"}},
      {Scheme::musl,
       {"arrivals, force", "integrate, G2P, P2G remap", "velocity, stress, locate, P2G, output"}},
      {Scheme::usf,
       {"arrivals", "velocity, stress, force", "integrate, G2P, locate, P2G, output"}}};
  for (const auto& [scheme, tasks] : all) {
    Analysis analysis;
    analysis.scheme = scheme;
    analysis.mean_volume = true;
    std::vector<std::string> names;
    for (const Phase& phase : phases_of(stages_of<2>(analysis))) names.push_back(phase.task.name);
    CHECK(names == tasks);
    for (const auto& stage : timestep<2>(analysis))
      CHECK(stage.of_next_step == (stage.stage.name == "P2G"));
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

TEST_CASE(
    "stages between two exchanges are one task, or two where the first use of dt divides them") {
  struct Expected {
    Scheme scheme;
    bool smoothing, adaptive;
    std::vector<std::string> tasks;
  };
  const std::vector<Expected> all{
      {Scheme::usl,
       false,
       false,
       {"arrivals", "integrate, stress, G2P, locate, P2G, force, output"}},
      {Scheme::usl,
       false,
       true,
       {"arrivals", "integrate, stress, G2P, locate, P2G, force, output"}},
      {Scheme::usl,
       true,
       false,
       {"arrivals", "integrate, strain", "stress, G2P, locate, P2G, force, output"}},
      {Scheme::usl,
       true,
       true,
       {"arrivals", "integrate, strain", "stress, G2P, locate, P2G, force, output"}},
      {Scheme::musl,
       false,
       false,
       {"arrivals", "integrate, G2P, P2G remap", "velocity, stress, locate, P2G, force, output"}},
      {Scheme::musl,
       false,
       true,
       {"arrivals", "integrate, G2P, P2G remap", "velocity, stress, locate, P2G, force, output"}},
      {Scheme::musl,
       true,
       false,
       {"arrivals", "integrate, G2P, P2G remap", "velocity, strain",
        "stress, locate, P2G, force, output"}},
      {Scheme::musl,
       true,
       true,
       {"arrivals", "integrate, G2P, P2G remap", "velocity, strain",
        "stress, locate, P2G, force, output"}},
      {Scheme::usf,
       false,
       false,
       {"arrivals", "velocity, stress, force", "integrate, G2P, locate, P2G, output"}},
      {Scheme::usf,
       false,
       true,
       {"arrivals", "velocity", "stress, force", "integrate, G2P, locate, P2G, output"}},
      {Scheme::usf,
       true,
       false,
       {"arrivals", "velocity, strain", "stress, force", "integrate, G2P, locate, P2G, output"}},
      {Scheme::usf,
       true,
       true,
       {"arrivals", "velocity", "strain", "stress, force", "integrate, G2P, locate, P2G, output"}}};
  REQUIRE(all.size() == every_option().size());
  for (const Expected& expected : all) {
    Analysis analysis;
    analysis.scheme = expected.scheme;
    analysis.pressure_smoothing = expected.smoothing;
    analysis.step.adaptive = expected.adaptive;
    const auto stages = stages_of<2>(analysis);
    const auto phases = phases_of(stages);
    std::vector<std::string> names;
    std::size_t next = 0;
    for (const Phase& phase : phases) {
      names.push_back(phase.task.name);
      // Every stage is in one phase; an exchange, or the wait for dt, is at the beginning of one.
      CHECK(phase.first == next);
      CHECK(phase.last > phase.first);
      next = phase.last;
      CHECK(phase.task.exchange == stages[phase.first].exchange);
      bool gives = false, needs = false;
      for (std::size_t s = phase.first; s < phase.last; ++s) {
        gives = gives || stages[s].gives_dt;
        needs = needs || stages[s].needs_dt;
        if (s > phase.first) CHECK(stages[s].exchange.empty());
        if (s > phase.first && analysis.step.adaptive) CHECK(!stages[s].needs_dt);
      }
      CHECK(phase.task.gives_dt == gives);
      CHECK(phase.task.needs_dt == needs);
    }
    CHECK(next == stages.size());
    CHECK(names == expected.tasks);
    // Cut behind the stage that gives dt, the same phases are there, one of them in two parts.
    const auto parts = phases_of(stages, true);
    REQUIRE(parts.size() == phases.size() + (analysis.step.adaptive ? 1 : 0));
    for (std::size_t f = 0, k = 0; f < phases.size(); ++f, ++k) {
      const bool is_cut = k + 1 < parts.size() && parts[k + 1].task.is_rest;
      CHECK(is_cut == (analysis.step.adaptive && phases[f].task.gives_dt));
      if (!is_cut) {
        CHECK(parts[k] == phases[f]);
        continue;
      }
      CHECK(stages[parts[k].last - 1].gives_dt);
      CHECK(parts[k].last == parts[k + 1].first);
      CHECK(joined(parts[k], parts[k + 1]) == phases[f]);
      ++k;
    }
  }
}

TEST_CASE("sums have two copies where nothing keeps a patch from overtaking its readers") {
  for (const Analysis& analysis : every_option_and_contact()) {
    const auto copies = node_sum_copies(analysis).of;
    const auto of = [&](NodeSum which) { return copies[sum_array(which)]; };
    const int usl = analysis.scheme == Scheme::usl ? 2 : 1;
    CHECK(of(NodeSum::mass_momentum) == usl);
    CHECK(of(NodeSum::force) == usl);
    Analysis sudden = analysis;  // integration reads momentum
    sudden.sudden_velocities = true;
    CHECK(node_sum_copies(sudden).of[sum_array(NodeSum::mass_momentum)] ==
          (analysis.scheme == Scheme::musl ? 1 : 2));
    // Momentum and pressure are a pair, held where one of them is used.
    CHECK(of(NodeSum::momentum) ==
          (maps_velocities_again(analysis) || analysis.pressure_smoothing ? 1 : 0));
    CHECK(of(NodeSum::pressure) == of(NodeSum::momentum));
    CHECK(of(NodeSum::gradient) == (analysis.contact.bodies > 1 ? 1 : 0));
    CHECK(of(NodeSum::displacement) == (analysis.takes_means ? 1 : 0));
    CHECK(of(NodeSum::waves) == of(NodeSum::displacement));
    CHECK(of(NodeSum::prescribed_mass) == (analysis.drives_nodes ? 1 : 0));
    CHECK(of(NodeSum::prescribed_momentum) == of(NodeSum::prescribed_mass));
  }
}
