// Random scenarios give on several ranks the bits of one, interrupted or not.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include "runtime/comm/rank_team.h"
#include "runtime/output/checkpoint_writer.h"
#include "runtime/step/restart.h"
#include "tests/properties/random_cases.h"
#include "tests/properties/run_record.h"
#include "tests/properties/stage_models.h"
#include "tests/ranks/shared_folder.h"

using namespace lahar;
using namespace lahar::test;

namespace fs = std::filesystem;

namespace {

/// A run, its checkpoints, and how it is executed.
template <int Dim>
class Run {
 public:
  Run(ExecutionOptions way, fs::path folder)
      : way_(std::move(way)),
        writer_({.folder = folder, .kept = 1000}, way_.ranks),
        folder_(std::move(folder)) {}

  /// From the beginning, or from a state; `measured` is the step of the last rows of gauges before
  /// it, or -1. Collective.
  RunRecord execute(const Model<Dim>& model, const SimulationState* from, Index measured) {
    RunRecord record;
    record.measured = measured;
    Observer observer = observer_of(record);
    // The ranks have a part of each frame.
    observer.frame = [&](FramePieces&& frame) { pieces_.push_back(join(frame)); };
    observer.checkpoint = [&](const SimulationState& state) { keep(state); };
    observer.poll = [this] { writer_.progress(); };
    Simulation simulation =
        from ? Simulation(model, way_, observer, *from) : Simulation(model, way_, observer);
    begin_gauges(simulation, record, from && from->use == StateUse::go_on);
    bool whole = true;
    try {
      simulation.run();
    } catch (const WatchdogError& error) {
      record.error = error.what();
    } catch (const SimulationError& error) {
      record.error = without_rank(error.what());
      whole = false;
    }
    if (whole) finish(simulation, record);
    writer_.finish();
    const auto frames = static_cast<Index>(pieces_.size());
    if (way_.ranks.any(frames != way_.ranks.max(frames)))
      record.error += " (some ranks gave more frames than others)";
    else
      for (Frame& piece : pieces_) record.frames.push_back(of_all(std::move(piece)));
    return record;
  }
  /// The last step, of which there is a checkpoint; -1 = all patches were not after the same step.
  Index end() const { return end_; }

 private:
  void keep(const SimulationState& state) {
    CheckpointHeader header;
    header.run = state.run;
    writer_.write(header, state);
  }
  void finish(Simulation& simulation, RunRecord& record) {
    writer_.finish();
    if (writer_.last_step() != simulation.step()) keep(simulation.state());  // before it measures
    writer_.finish();
    end_of(simulation, record);
    way_.ranks.wait_for_all();
    record.end_file = read_text_file(folder_ / checkpoint_name(simulation.step()));
    end_ = simulation.step();
  }
  Frame of_all(Frame own) const {
    const Communicator& ranks = way_.ranks;
    if (!ranks.several()) return own;
    const auto gather = [&](auto& values) {
      values = ranks.gather_all(std::span(std::as_const(values)));
    };
    gather(own.id);
    gather(own.material);
    gather(own.coordinates);
    for (FrameColumn& column : own.columns) gather(column.values);
    sort_by_id(own);
    return own;
  }

  ExecutionOptions way_;
  Index end_ = -1;
  CheckpointWriter writer_;
  fs::path folder_;
  std::vector<Frame> pieces_;
};

ExecutionOptions way_of(Choices& choices, const std::string& name) {
  ExecutionOptions way{.threads = 1 + choices.pick(name + ".threads", 2)};
  way.ranks = Communicator::world();
  if (choices.chance(name + ".bulk", 15)) way.mode = ExecutionOptions::Mode::bulk;
  if (choices.chance(name + ".balanced", 50))
    way.balance = {BalanceOptions::When::forced, 1 + choices.pick(name + ".balance", 10),
                   choices.chance(name + ".scotch", 30) ? Partitioner::scotch : Partitioner::curve};
  if (choices.chance(name + ".messages", 30)) way.shared_memory = false;
  if (choices.chance(name + ".late", 15)) way.latency = 2e-5;
  return way;
}

template <int Dim>
class Comparison {
 public:
  Comparison(const fs::path& folder, Choices& choices)
      : folder_(folder), team_(ranks_), choices_(choices) {}

  Verdict verdict() {
    read();
    if (!agreed(refused_).empty()) return {refused_, "", ""};
    const auto interrupted = static_cast<std::size_t>(choices_.pick("way.stage", 3));
    Verdict verdict;
    Ends ends;
    for (std::size_t k = 0; k < share_.size(); ++k) {
      if (share_.size() > 1) stage_ = fmt::format("stage {}, ", k + 1);
      ends = compare_stage(k, ends, k == interrupted % share_.size());
      if (!refused_.empty()) return {refused_, "", ""};
      verdict.error = reference_.error;
      verdict.difference = agreed(difference_);
      const bool goes_on = verdict.error.empty() && verdict.difference.empty();
      if (ranks_.any(!goes_on || ends.one < 0 || ends.all < 0)) break;
    }
    return verdict;
  }

 private:
  /// Steps with which the runs of a stage ended, in whose folders their checkpoints are.
  struct Ends {
    Index one = -1, all = -1;
    fs::path one_folder, all_folder;
  };

  Ends compare_stage(std::size_t k, const Ends& before, bool interrupted) {
    Ends ends{.one = -1,
              .all = -1,
              .one_folder = folder_ / fmt::format("one{}", k),
              .all_folder = folder_ / fmt::format("all{}", k)};
    const Index nsteps = share_[k].model.analysis.nsteps;
    middle_ = std::max<Index>(1, nsteps * choices_.pick("way.middle", 100) / 100);
    share_[k].model.output.checkpoint_steps = middle_;
    if (ranks_.rank() == 0) whole_[k].model.output.checkpoint_steps = middle_;
    const ExecutionOptions alone{.mode = ExecutionOptions::Mode::serial};
    if (ranks_.rank() == 0) {
      const auto from = end_before(before.one_folder, before.one);
      ends.one = execute(alone, ends.one_folder, whole_[k], from.get(), reference_);
    }
    ranks_.broadcast(reference_.error);
    ranks_.broadcast(refused_);
    if (!refused_.empty()) return ends;
    ends.one = ranks_.max(ends.one);
    RunRecord record;
    {
      const auto from = end_before(before.all_folder, before.all);
      ends.all = execute(way_of(choices_, "way"), ends.all_folder, share_[k], from.get(), record);
    }
    compare(record, "all ranks");
    if (interrupted) go_on(k, ends);
    return ends;
  }
  /// What a stage begins with; null = it is the first.
  static std::unique_ptr<CheckpointReader> end_before(const fs::path& folder, Index step) {
    return step < 0 ? nullptr : std::make_unique<CheckpointReader>(folder / checkpoint_name(step));
  }
  /// On one rank alone the model as one process reads it, on all of them a share.
  void read() {
    const auto file = folder_ / "case.json";
    try {
      share_ = read_stages<Dim>(file, &team_);
    } catch (const InputError& error) {
      refused_ = error.what();
    }
    if (ranks_.rank() == 0 && refused_.empty()) whole_ = read_stages<Dim>(file);
  }
  /// The step with which the run ended, or -1. `from`: where another stage ended.
  Index execute(const ExecutionOptions& way, const fs::path& to, const StageModel<Dim>& stage,
                const CheckpointReader* from, RunRecord& record, bool goes_on = false) {
    try {
      Run<Dim> run(way, to);
      if (from) {
        const SimulationState state =
            goes_on ? state_in(*from) : state_at_start(*from, stage.alike);
        record = run.execute(stage.model, &state, goes_on ? measured_ : -1);
      } else {
        record = run.execute(stage.model, nullptr, -1);
      }
      return run.end();
    } catch (const InputError& error) {
      record.error = refused_ = error.what();
    } catch (const std::exception& error) {
      record.error = error.what();
    }
    return -1;
  }
  /// Only rank 0 compares: it has the reference, and all that is the same on all ranks.
  void compare(const RunRecord& record, const std::string& what) {
    if (ranks_.rank() != 0 || !difference_.empty()) return;
    const std::string text = difference(reference_, record, false);
    if (!text.empty()) difference_ = stage_ + "one rank against " + what + ": " + text;
  }
  std::string agreed(std::string text) const {
    ranks_.broadcast(text);
    return text;
  }
  /// All ranks go on from what one wrote in the middle, and one from what all wrote.
  void go_on(std::size_t k, const Ends& ends) {
    const fs::path &one = ends.one_folder, &all = ends.all_folder;
    const fs::path name = checkpoint_name(middle_);
    Index there = ranks_.rank() == 0 && fs::exists(one / name) && fs::exists(all / name);
    there = ranks_.max(there);
    if (there == 0) return;
    Index measured = -1;
    for (const GaugeRows& rows : reference_.gauges)
      if (rows.step <= middle_) measured = rows.step;
    measured_ = ranks_.max(measured);
    // What one rank cannot read, none can.
    const auto open = [this](const fs::path& file) {
      std::unique_ptr<CheckpointReader> reader;
      try {
        reader = std::make_unique<CheckpointReader>(file);
      } catch (const IoError& error) {
        if (difference_.empty()) difference_ = error.what();
      }
      return reader;
    };
    if (ranks_.rank() == 0 && difference_.empty() &&
        read_text_file(one / name) != read_text_file(all / name))
      difference_ = fmt::format("checkpoints of step {} differ", middle_);
    {
      RunRecord record;
      if (const auto reader = open(one / name)) {
        execute(way_of(choices_, "way_on"), folder_ / "all_on", share_[k], reader.get(), record,
                true);
        compare_rest(record, "all ranks that go on from one");
      }
    }
    if (ranks_.rank() == 0) {
      RunRecord record;
      if (const auto reader = open(all / name)) {
        execute({.mode = ExecutionOptions::Mode::serial}, folder_ / "one_on", whole_[k],
                reader.get(), record, true);
        compare_rest(record, "one that goes on from all ranks");
      }
    }
    ranks_.wait_for_all();
  }
  /// With what the reference gave after the middle.
  void compare_rest(const RunRecord& record, const std::string& what) {
    RunRecord rest = reference_;
    rest.forget_until(middle_);
    if (ranks_.rank() != 0 || !difference_.empty()) return;
    const std::string text = difference(rest, record, false);
    if (!text.empty())
      difference_ = stage_ + fmt::format("one rank against {} in step {}: {}", what, middle_, text);
  }

  fs::path folder_;
  Communicator ranks_ = Communicator::world();
  RankTeam team_;
  Choices& choices_;
  Index middle_ = 1;
  Index measured_ = -1;  ///< the step of the reference's last rows of gauges until then
  std::vector<StageModel<Dim>> whole_, share_;
  std::string stage_;  ///< of messages
  RunRecord reference_;
  std::string refused_, difference_;
};

Verdict check(const GeneratedCase& made, const fs::path& folder, Choices& choices) {
  return made.dim == 2 ? Comparison<2>(folder, choices).verdict()
                       : Comparison<3>(folder, choices).verdict();
}

}  // namespace

TEST_CASE("random scenarios give on several ranks the bits of one, interrupted or not") {
  const Communicator ranks = Communicator::world();
  if (!ranks.several()) return;
  const SharedFolder folder(ranks);
  const Speaker speaker{
      .speaks = ranks.rank() == 0,
      .folder = folder.path,
      .wait_for_all = [&] { ranks.wait_for_all(); },
      .command = fmt::format("mpirun -n {} build/release/tests/test_ranks -tc='random scenarios*'",
                             ranks.size())};
  // Seven ranks share two cores as a rule.
  const int count = ranks.size() > 4 ? 8 : 40;
  const Tally tally = try_cases(
      {.first = 1000 * static_cast<std::uint64_t>(ranks.size()), .count = count}, check, speaker);
  if (ranks.rank() != 0) return;
  MESSAGE(summary(tally));
  for (const std::string& failure : tally.failures) FAIL_CHECK(failure);
  CHECK(tally.refused <= tally.cases / 5);
}
