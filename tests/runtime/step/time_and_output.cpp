// Time steps, and which steps give frames and rows.
#include <doctest/doctest.h>

#include <chrono>
#include <cmath>

#include "runtime/step/timestep.h"
#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// safety h / (c + |v|) over the particles of a frame, by hand.
double limit_of(const Frame& frame, double h, const Model<2>& model) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t p = 0; p < frame.id.size(); ++p) {
    const Material& material =
        model.materials[model.particles.material[static_cast<std::size_t>(frame.id[p])]];
    const double density = frame.find("mass")->values[p] / frame.find("volume")->values[p];
    const double speed = std::hypot(frame.find("velocity")->values[2 * p],
                                    frame.find("velocity")->values[2 * p + 1]);
    double modulus = 0, limit = std::numeric_limits<double>::infinity();
    if (const auto* solid = std::get_if<LinearElastic>(&material.law)) {
      const double nu = solid->poisson_ratio;
      modulus = solid->youngs_modulus * (1 - nu) / ((1 + nu) * (1 - 2 * nu));
    } else {
      const auto& fluid = std::get<Newtonian>(material.law);
      modulus = fluid.bulk_modulus;
      limit = h * h * density / (4 * 4.0 / 3.0 * fluid.dynamic_viscosity);
    }
    least = std::min({least, limit, h / (std::sqrt(modulus / density) + speed)});
  }
  return least;
}

void check_adaptive(Model<2> model, double h, const ExecutionOptions& way, double change) {
  const double safety = 0.4;
  model.analysis.step = {.adaptive = true, .dt = 1.0, .safety = safety};
  Simulation simulation(model, way);
  double time = 0, shortest = 1, longest = 0;
  for (int step = 1; step <= 50; ++step) {
    const double expected = safety * limit_of(simulation.frame(), h, model);
    CHECK(simulation.info().dt == doctest::Approx(expected).epsilon(1e-14));
    simulation.advance(1);
    time += expected;
    CHECK(simulation.history().dt == doctest::Approx(expected).epsilon(1e-14));
    CHECK(simulation.time() == doctest::Approx(time).epsilon(1e-13));
    shortest = std::min(shortest, expected);
    longest = std::max(longest, expected);
  }
  CHECK(shortest < (1 - change) * longest);
}

}  // namespace

TEST_CASE("an adaptive step is safety times the smallest h / (c + |v|) of the particles") {
  for (const ExecutionOptions& way : {serial(), flow(3), random_order(1)}) {
    CAPTURE(describe(way));
    check_adaptive(two_discs(), 0.05, way, 0.01);
    check_adaptive(dam_break(), 0.1, way, 0.01);
    Model<2> syrup = dam_break();  // so viscous that diffusion limits the step
    syrup.materials[0].law = Newtonian{.bulk_modulus = 4e4, .dynamic_viscosity = 2000};
    syrup.gravity = {0, -500};
    check_adaptive(syrup, 0.1, way, 1e-5);
  }
}

TEST_CASE("an adaptive step is never longer than the largest that the scenario allows") {
  Model<2> model = two_discs();
  model.analysis.step = {.adaptive = true, .dt = 1e-3, .safety = 0.5};
  model.analysis.nsteps = 20;
  Simulation simulation(model, flow(2));
  simulation.run();
  CHECK(simulation.history().dt == 1e-3);
  CHECK(simulation.time() == doctest::Approx(0.02).epsilon(1e-14));
}

TEST_CASE("an adaptive run ends at its end time exactly") {
  for (const ExecutionOptions& way : {serial(), flow(1), flow(8), random_order(3)})
    for (const double end_time : {0.2, 0.123456789, 0.0777}) {
      CAPTURE(describe(way));
      CAPTURE(end_time);
      Model<2> model = two_discs();
      model.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.5};
      model.analysis.nsteps = 1000000;
      model.analysis.end_time = end_time;
      Simulation simulation(model, way);
      simulation.run();
      CHECK(simulation.time() == end_time);
      CHECK(simulation.finished());
      CHECK(simulation.history().dt > 0);
      CHECK(simulation.step() > 2);
      simulation.advance(5);
      CHECK(simulation.time() == end_time);
    }
}

TEST_CASE("an end time before the first adaptive step's end makes it one short step") {
  for (const ExecutionOptions& way : {serial(), flow(2), random_order(3)}) {
    Model<2> model = two_discs();
    model.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.5};
    model.analysis.end_time = 1e-5;
    Simulation simulation(model, way);
    simulation.run();
    CHECK(simulation.step() == 1);
    CHECK(simulation.time() == 1e-5);
    CHECK(simulation.history().dt == 1e-5);
  }
}

TEST_CASE("fixed steps end with the step that reaches the end time, or after nsteps") {
  for (const auto& [end_time, steps] :
       std::vector<std::pair<double, Index>>{{0.04, 10}, {0.041, 11}, {0.0039, 1}, {100, 80}}) {
    Model<2> model = two_discs();  // dt = 4e-3, 80 steps
    model.analysis.end_time = end_time;
    Simulation simulation(model, flow(2));
    simulation.run();
    CHECK(simulation.step() == steps);
    CHECK(simulation.time() == doctest::Approx(4e-3 * static_cast<double>(steps)).epsilon(1e-15));
  }
}

TEST_CASE("frames and rows come at their steps, in order, with their times and ascending ids") {
  for (const bool adaptive : {false, true})
    for (const ExecutionOptions& way : {serial(), flow(1), flow(3), flow(8), random_order(1)}) {
      CAPTURE(describe(way));
      CAPTURE(adaptive);
      Model<2> model = two_discs();
      model.analysis.nsteps = 50;
      model.output.frame_steps = 7;
      model.output.history_steps = 3;
      if (adaptive) model.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
      std::vector<Frame> frames;
      std::vector<HistoryRow> rows;
      std::vector<std::pair<Index, double>> steps;
      Observer observer;
      observer.frame = [&](FramePieces&& frame) { frames.push_back(join(frame)); };
      observer.history = [&](const HistoryRow& row) { rows.push_back(row); };
      observer.progress = [&](Index step, double time) {
        steps.push_back({step, time});
        return true;
      };
      Simulation simulation(model, way, observer);
      simulation.run();
      REQUIRE(frames.size() == 7);
      REQUIRE(rows.size() == 16);
      REQUIRE(steps.size() == 50);
      double time = 0, dt_sum = 0;
      for (std::size_t k = 0; k < steps.size(); ++k) {
        CHECK(steps[k].first == static_cast<Index>(k + 1));
        CHECK(steps[k].second > time);
        time = steps[k].second;
        if (!adaptive) CHECK(time == 4e-3 * static_cast<double>(k + 1));
      }
      for (std::size_t k = 0; k < frames.size(); ++k) {
        CHECK(frames[k].step == static_cast<Index>(7 * (k + 1)));
        CHECK(frames[k].time == steps[7 * (k + 1) - 1].second);
        CHECK(frames[k].size() == model.particles.size());
        CHECK_NOTHROW(check_consistent(frames[k]));
        CHECK(std::adjacent_find(frames[k].id.begin(), frames[k].id.end(),
                                 std::greater_equal<>()) == frames[k].id.end());
      }
      for (std::size_t k = 0; k < rows.size(); ++k) {
        const auto s = static_cast<std::size_t>(3 * (k + 1));
        CHECK(rows[k].step == static_cast<Index>(s));
        CHECK(rows[k].time == steps[s - 1].second);
        CHECK(rows[k].dt ==
              doctest::Approx(steps[s - 1].second - steps[s - 2].second).epsilon(1e-9));
        dt_sum += rows[k].dt;
      }
      CHECK(dt_sum < time);
    }
}

TEST_CASE("a frame holds the state after its step") {
  Model<2> model = two_discs();
  const Outcome whole = run(model, flow(3));
  for (const Frame& frame : whole.frames) {
    Simulation simulation(model, serial());
    simulation.advance(frame.step);
    CHECK(same_bits(simulation.frame(), frame));
  }
}

TEST_CASE("without a history interval there are about a hundred rows") {
  Model<2> model = two_discs();
  model.analysis.nsteps = 50;
  model.output.history_steps = 0;
  CHECK(run(model, serial()).rows.size() == 51);  // every step, and the last state
  model.analysis.step.dt = 1e-4;
  model.analysis.nsteps = 1000;
  CHECK(run(model, serial()).rows.size() == 101);
}

TEST_CASE("a run that is told to stop ends at the same later step for every way of executing") {
  for (const ExecutionOptions& way :
       {serial(), flow(1), flow(3), flow(8), random_order(1), random_order(2)}) {
    CAPTURE(describe(way));
    Model<2> model = two_discs();
    Observer observer;
    observer.progress = [](Index step, double) { return step < 10; };
    Simulation simulation(model, way, observer);
    simulation.run();
    // Asked for after 10 steps, that is in step number 9; patches may be three ahead by then.
    CHECK(simulation.step() == 13);
    CHECK(!simulation.finished());
    CHECK(simulation.frame().size() == model.particles.size());
  }
}

TEST_CASE("timings count every stage once per patch and step, and no time twice") {
  for (const ExecutionOptions& way : {serial(), flow(1), flow(2), random_order(1)})
    for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl}) {
      CAPTURE(describe(way));
      Model<2> model = two_discs();
      model.analysis.scheme = scheme;
      model.analysis.nsteps = 10;
      Index steps = 0;
      int patches = 0;
      const auto begin = std::chrono::steady_clock::now();
      Simulation simulation(model, way);
      Index calls = 0;
      while (!simulation.finished()) {
        patches = simulation.info().patches;  // those that take part in the next step
        simulation.advance(1);
        calls += patches;
        ++steps;
      }
      const double wall =
          std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      CHECK(steps == 10);
      const auto timings = simulation.timings();
      const auto stages = timestep<2>(model.analysis);
      REQUIRE(timings.size() == stages.size());
      double total = 0;
      for (std::size_t s = 0; s < timings.size(); ++s) {
        const StageTiming& stage = timings[s];
        CHECK(stage.name == stages[s].stage.name);
        CHECK(stage.calls == calls);
        CHECK(stage.shortest >= 0);
        CHECK(stage.shortest <= stage.longest);
        CHECK(stage.total >= stage.longest);
        CHECK(stage.total <= static_cast<double>(stage.calls) * stage.longest * (1 + 1e-12));
        total += stage.total;
      }
      CHECK(total > 0);
      // The clock is measured against the system's, which costs a little accuracy.
      CHECK(total < 1.01 * wall * simulation.info().threads);
    }
}

TEST_CASE("what a simulation says of itself: tasks, particles, cells, nodes") {
  Simulation simulation(two_discs(), flow(2));
  const SimulationInfo info = simulation.info();
  std::vector<Stage> stages;
  for (const auto& stage : timestep<2>(two_discs().analysis)) stages.push_back(stage.stage);
  CHECK(info.tasks_per_step == static_cast<int>(phases_of(stages).size()) * info.patches);
  CHECK(info.particles == two_discs().particles.size());
  CHECK(info.cells == 400);
  CHECK(info.nodes == 441);
}

TEST_CASE("a run without particles steps through time") {
  Model<2> model = two_discs();
  model.particles = {};
  const Outcome outcome = run(model, flow(2));
  CHECK(outcome.error == "");
  CHECK(outcome.rows.back().step == 80);
  CHECK(outcome.rows.back().mass == 0);
}
