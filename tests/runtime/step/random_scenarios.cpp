// Random scenarios give the same bits, however they are executed and wherever they are interrupted.
#include <doctest/doctest.h>

#include "tests/properties/random_cases.h"
#include "tests/properties/run_record.h"

using namespace lahar;
using namespace lahar::test;

namespace {

template <int Dim>
RunRecord run_whole(const Model<Dim>& model, const ExecutionOptions& way) {
  RunRecord record;
  Simulation simulation(model, way, observer_of(record));
  take(simulation, record, [&] { simulation.run(); });
  return record;
}

/// How a run is interrupted.
enum class Stop { drained, on_the_way, asked };

/// Run `first` to about step `middle`, keep the state, and go on from it as `second`.
template <int Dim>
RunRecord run_interrupted(Model<Dim> model, Index middle, Stop stop, const ExecutionOptions& first,
                          const ExecutionOptions& second) {
  RunRecord record;
  std::optional<StoredState> state;
  {
    Observer observer = observer_of(record);
    if (stop == Stop::on_the_way) {
      model.output.checkpoint_steps = middle;
      observer.checkpoint = [&](const SimulationState& now) {
        if (now.run.step == middle) state.emplace(now);
      };
    }
    if (stop == Stop::asked) observer.progress = [&](Index step, double) { return step < middle; };
    Simulation simulation(model, first, observer);
    const bool done = take(simulation, record, [&] {
      if (stop == Stop::drained)
        simulation.advance(middle);
      else
        simulation.run();
    });
    if (!done && !state) return record;
    if (stop != Stop::on_the_way) {
      if (simulation.finished()) return record;
      state.emplace(simulation.state());
    } else if (!state) {
      return record;
    }
  }
  record.forget_after(state->run.step);
  record.error = "";
  record.end.reset();
  record.last_frame.reset();
  record.last_row.reset();
  model.output.checkpoint_steps = 0;
  Simulation simulation(model, second, observer_of(record), state->view());
  take(simulation, record, [&] { simulation.run(); });
  return record;
}

ExecutionOptions bulk(int threads) {
  return {.mode = Mode::bulk, .threads = threads};
}

template <int Dim>
Verdict compare(const Model<Dim>& model, Index steps, Choices& choices) {
  Verdict verdict;
  RunRecord serial_run;
  try {
    serial_run = run_whole(model, serial());
  } catch (const InputError& error) {
    verdict.refused = error.what();
    return verdict;
  }
  verdict.error = serial_run.error;
  ExecutionOptions three = flow(3);
  three.verify = false;  // twice as fast
  const ExecutionOptions ways[] = {flow(2), three, random_order(7), bulk(2), serial()};
  const auto pick = [&](const char* name) {
    return ways[static_cast<std::size_t>(choices.pick(name, 5))];
  };
  const auto tell = [&](const std::string& text, const std::string& way) {
    if (verdict.difference.empty() && !text.empty())
      verdict.difference = "serial against " + way + ": " + text;
  };
  for (const ExecutionOptions& way : {ways[0], ways[1], pick("way.third")})
    if (way.mode != Mode::serial)
      tell(difference(serial_run, run_whole(model, way)), describe(way));
  const Index middle = steps * choices.pick("way.middle", 100) / 100;
  const auto stop = static_cast<Stop>(choices.pick("way.stop", middle > 0 ? 3 : 1));
  const ExecutionOptions first = pick("way.before"), second = pick("way.after");
  tell(difference(serial_run, run_interrupted(model, middle, stop, first, second), false),
       describe(first) + ", interrupted in step " + std::to_string(middle) + ", then " +
           describe(second));
  return verdict;
}

Verdict check(const GeneratedCase& made, const std::filesystem::path& folder, Choices& choices) {
  try {
    const Scenario scenario = read_scenario(folder / "case.json");
    return made.dim == 2 ? compare(std::get<Model<2>>(scenario.model), made.steps, choices)
                         : compare(std::get<Model<3>>(scenario.model), made.steps, choices);
  } catch (const InputError& error) {
    return {.refused = error.what(), .error = "", .difference = ""};
  }
}

}  // namespace

TEST_CASE("random scenarios give the serial loop's bits, interrupted or not") {
  const TemporaryFolder folder;
  const Speaker speaker{.speaks = true,
                        .folder = folder.path,
                        .wait_for_all = [] {},
                        .command = "build/release/tests/test_runtime -tc='random scenarios*'"};
  const Tally tally = try_cases({.first = 1, .count = 150}, check, speaker);
  MESSAGE(summary(tally));
  for (const std::string& failure : tally.failures) FAIL_CHECK(failure);
  CHECK(tally.refused <= tally.cases / 20);
}
