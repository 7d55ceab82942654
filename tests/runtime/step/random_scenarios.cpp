// Random scenarios give the same bits, however they are executed and wherever they are interrupted.
#include <doctest/doctest.h>

#include "runtime/step/restart.h"
#include "tests/properties/random_cases.h"
#include "tests/properties/run_record.h"
#include "tests/properties/stage_models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Where a run begins: at the end of the stage before, unless there is none.
struct Begin {
  const StoredState* before = nullptr;
  bool alike = false;

  template <int Dim>
  Simulation simulation(const Model<Dim>& model, const ExecutionOptions& way,
                        const Observer& observer) const {
    return before ? Simulation(model, way, observer, state_at_start(before->view(), alike))
                  : Simulation(model, way, observer);
  }
};

template <int Dim>
RunRecord run_whole(const Model<Dim>& model, const ExecutionOptions& way, const Begin& begin) {
  RunRecord record;
  Simulation simulation = begin.simulation(model, way, observer_of(record));
  begin_gauges(simulation, record, false);
  take(simulation, record, [&] { simulation.run(); });
  return record;
}

/// How a run is interrupted.
enum class Stop { drained, on_the_way, asked };

/// Run `first` to about step `middle`, keep the state, and go on from it as `second`.
template <int Dim>
RunRecord run_interrupted(Model<Dim> model, const Begin& begin, Index middle, Stop stop,
                          const ExecutionOptions& first, const ExecutionOptions& second) {
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
    Simulation simulation = begin.simulation(model, first, observer);
    begin_gauges(simulation, record, false);
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
  model.output.checkpoint_steps = 0;
  Simulation simulation(model, second, observer_of(record), state->view());
  begin_gauges(simulation, record, true);
  take(simulation, record, [&] { simulation.run(); });
  return record;
}

ExecutionOptions bulk(int threads) {
  return {.mode = Mode::bulk, .threads = threads};
}

template <int Dim>
class Comparison {
 public:
  Comparison(std::vector<StageModel<Dim>> stages, Choices& choices)
      : stages_(std::move(stages)), choices_(choices) {
    three_ = flow(3);
    three_.verify = false;  // twice as fast
    ways_ = {flow(2), three_, random_order(7), bulk(2), serial()};
  }

  Verdict verdict() {
    const auto interrupted = static_cast<std::size_t>(choices_.pick("way.stage", 3));
    RunRecord before;
    for (std::size_t k = 0; k < stages_.size() && verdict_.difference.empty(); ++k) {
      const Begin begin{before.end ? &*before.end : nullptr, stages_[k].alike};
      RunRecord serial_run = run_whole(stages_[k].model, serial(), begin);
      if (stages_.size() > 1) stage_ = "stage " + std::to_string(k + 1) + ", ";
      check(serial_run);
      run_in_other_ways(serial_run, k, begin);
      if (k == interrupted % stages_.size()) interrupt(serial_run, k, begin);
      verdict_.error = serial_run.error;
      if (!serial_run.error.empty() || !serial_run.end) break;
      before = std::move(serial_run);
    }
    return verdict_;
  }

 private:
  void check(const RunRecord& record) {
    if (!record.error.empty() || !record.last_frame) return;
    const std::string column = not_finite(*record.last_frame);
    if (!column.empty()) verdict_.difference = stage_ + column + " at the end are no numbers";
  }
  ExecutionOptions pick(const char* name) {
    return ways_[static_cast<std::size_t>(choices_.pick(name, 5))];
  }
  void tell(const std::string& text, const std::string& way) {
    if (verdict_.difference.empty() && !text.empty())
      verdict_.difference = stage_ + "serial against " + way + ": " + text;
  }
  void run_in_other_ways(const RunRecord& serial_run, std::size_t k, const Begin& begin) {
    for (const ExecutionOptions& way : {ways_[0], ways_[1], pick("way.third")})
      if (way.mode != Mode::serial)
        tell(difference(serial_run, run_whole(stages_[k].model, way, begin)), describe(way));
  }
  void interrupt(const RunRecord& serial_run, std::size_t k, const Begin& begin) {
    const Model<Dim>& model = stages_[k].model;
    const Index middle = model.analysis.nsteps * choices_.pick("way.middle", 100) / 100;
    const auto stop = static_cast<Stop>(choices_.pick("way.stop", middle > 0 ? 3 : 1));
    const ExecutionOptions first = pick("way.before"), second = pick("way.after");
    tell(difference(serial_run, run_interrupted(model, begin, middle, stop, first, second), false),
         describe(first) + ", interrupted in step " + std::to_string(middle) + ", then " +
             describe(second));
  }

  std::vector<StageModel<Dim>> stages_;
  Choices& choices_;
  ExecutionOptions three_;
  std::vector<ExecutionOptions> ways_;
  std::string stage_;  ///< of messages
  Verdict verdict_;
};

Verdict check(const GeneratedCase& made, const std::filesystem::path& folder, Choices& choices) {
  const auto file = folder / "case.json";
  try {
    return made.dim == 2 ? Comparison<2>(read_stages<2>(file), choices).verdict()
                         : Comparison<3>(read_stages<3>(file), choices).verdict();
  } catch (const InputError& error) {
    return {.refused = error.what(), .error = "", .difference = ""};
  } catch (const std::exception& error) {
    return {.refused = "", .error = "", .difference = std::string("internal: ") + error.what()};
  }
}

/// Tries the cases of some seeds; each that fails is a failed check.
Tally tries(Seeds seeds) {
  const TemporaryFolder folder;
  const Speaker speaker{.speaks = true,
                        .folder = folder.path,
                        .wait_for_all = [] {},
                        .command = "build/release/tests/test_runtime -tc='random scenarios*'"};
  Tally tally = try_cases(seeds, check, speaker);
  MESSAGE(summary(tally));
  for (const std::string& failure : tally.failures) FAIL_CHECK(failure);
  return tally;
}

}  // namespace

TEST_CASE("random scenarios give the serial loop's bits, interrupted or not") {
  const Tally tally = tries({.first = 1, .count = 150});
  CHECK(tally.refused <= tally.cases / 10);
}

// Rounds of its solver begin at zero, as steps of a run do.
TEST_CASE("a projection that goes on does not let nodes get their velocities at once again") {
  const Tally tally = tries({.first = 710076, .count = 1});
  CHECK(tally.cases == 1);
  CHECK(tally.refused == 0);
}

// Too many particles leave the mesh just before the run is asked to stop.
TEST_CASE("a run that ends as too many particles have left ends so if it is to stop, too") {
  const Tally tally = tries({.first = 760101, .count = 1});
  CHECK(tally.cases == 1);
  CHECK(tally.refused == 0);
}

TEST_CASE("sums of a liquid's advection are restored within their arrays") {
  const Tally tally = tries({.first = 100176, .count = 1});  // damaged the heap
  CHECK(tally.cases == 1);
  CHECK(tally.refused == 0);
}
