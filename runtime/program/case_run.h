/// \file One run: what happens between the first and the last line on the terminal.
#pragma once

#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/run/run_folder.h"
#include "runtime/comm/rank_watch.h"
#include "runtime/output/frame_output.h"
#include "runtime/program/run_arguments.h"
#include "runtime/program/run_checkpoints.h"
#include "runtime/program/run_description.h"
#include "runtime/program/trace_session.h"
#include "runtime/step/restart.h"
#include "runtime/terminal/console.h"

namespace lahar {

/// What a run has to do with other stages of its scenario.
struct CaseStage {
  std::string name = {};                          ///< in messages; empty = there are no stages
  std::unique_ptr<CheckpointReader> before = {};  ///< end of the stage before; null = the first
  bool alike = false;                             ///< as goes_on_alike() says
  bool goes_before = false;                       ///< another stage needs the state at the end
  bool cleared = false;                           ///< as RunFolder says
  std::function<void()> before_folder = {};       ///< on the rank that makes it; may be empty
};

/// What the checkpoints of a run say of the program and of the scenario.
CheckpointHeader checkpoint_header(const Scenario& scenario);

class CaseRun {
 public:
  CaseRun(const RunArguments& arguments, Scenario& scenario, Console& console,
          CaseStage stage = {});

  ~CaseRun() {
    // A checkpoint under way waits for frames that nobody brings forward any more.
    if (std::uncaught_exceptions() > 0 && frames_) frames_->give_up();
  }
  CaseRun(const CaseRun&) = delete;
  CaseRun& operator=(const CaseRun&) = delete;

  /// Returns the exit status.
  int execute();

 private:
  using Clock = std::chrono::steady_clock;
  static double seconds_since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
  }

  void open_checkpoint_to_restart();
  Simulation begin_simulation();

  void warn(const std::string& text) {
    scenario_.warnings.push_back({.message = text});
    console_.warn("lahar: warning: " + text);
  }

  /// Where an undisturbed run has a row and a frame at the step of the checkpoint, so does this
  /// one.
  RunContinuation continuation() const;

  /// A new folder, or the one of the run that goes on.
  std::unique_ptr<RunFolder> new_folder(RunInfo about) const;
  void begin_checkpoints(Simulation& simulation, const SimulationInfo& info);

  void begin_trace(const Simulation& simulation, const SimulationInfo& info);
  /// The first row and frame; a run that goes on has them.
  void write_beginning(Simulation& simulation);
  bool is_in_folder(const CheckpointReader& checkpoint) const;
  void describe_restart(const Simulation& simulation);

  /// Rank 0 has the folder; a mistake there is one of all.
  void make_folder(RunInfo about);
  void write_row(const HistoryRow& row) {
    if (folder_) folder_->history(row);
  }

  void warn_of_unstable_step(const SimulationInfo& info);
  void warn_of_empty_groups(const ChangedParticles& changed);
  void warn_of_lost_strains(const ChangedParticles& changed);
  void warn_of_occupied_cells(const OccupiedCells& occupied);
  void warn_of_curved_cells(const Simulation& simulation);
  /// What steps wait for, because there is no memory for a copy.
  void describe_staging(const SimulationInfo& info);

  /// [s] kept of --wall-time for writing the last state, but not more than a tenth of it:
  /// checkpoint and frame by all ranks to one disk, and some more.
  double time_to_write(const SimulationInfo& info) const;
  Index planned_steps(const SimulationInfo& info) const;
  Observer observer();
  void on_history(const HistoryRow& row);
  void on_gauges(const GaugeRows& rows) {
    last_gauges_ = rows.step;
    if (folder_) folder_->gauges(rows);
  }

  /// Share of the run that is done, by steps or by time, whichever ends it.
  double share(Index step, double time) const {
    return std::max(static_cast<double>(step) /
                        static_cast<double>(std::max<Index>(1, outline_.analysis.nsteps)),
                    time / outline_.analysis.end_time);
  }

  void print_row(const HistoryRow& row);
  bool on_step(Index step, double time);

  /// Particles may come and go: their number is that of the last history row.
  double particle_steps(Index step) const {
    return particle_steps_ + static_cast<double>(step - counted_) * static_cast<double>(particles_);
  }

  double rate(Index step) const { return particle_steps(step) / seconds_since(loop_begin_); }

  int run_time_loop(Simulation& simulation);
  /// After a failure of files: with which option, and from where. Empty if there is no telling.
  std::string how_to_go_on() const;

  /// Sums over the ranks.
  std::vector<StageTiming> timings_of_all(std::vector<StageTiming> all) const;
  void report_balance(const BalanceReport& balance, double wall);
  bool plans_frames() const {
    return outline_.output.frame_steps > 0 || outline_.output.frame_dt > 0;
  }
  bool plans_checkpoints() const {
    return outline_.output.checkpoint_steps > 0 || outline_.output.checkpoint_minutes > 0;
  }

  /// Why a run that may end by itself has ended: said, and returned where it has come to rest.
  std::string tell_rest(const RestState& rest, Index step);
  /// Warns where a run has finished, but its energy does not close.
  void warn_of_balance(const HistoryRow& row, const SimulationInfo& info);
  void warn_of_injection(const SimulationInfo& info);
  /// If a frame could not be written, the manifest says failed and the error is thrown.
  void finish(RunEnd& end);
  /// `is_whole`: all patches are after the same step.
  void report(Simulation& simulation, const SimulationInfo& info, const RunEnd& end, double wall,
              bool is_whole);

  const RunArguments& arguments_;
  Scenario& scenario_;
  Console& console_;
  CaseStage stage_;
  Communicator ranks_;
  ModelOutline outline_;
  CheckpointHeader header_;                    ///< of checkpoints that are written
  std::unique_ptr<CheckpointReader> restart_;  ///< until the state has been read
  std::vector<std::string> allowed_differences_;
  std::unique_ptr<RunFolder> folder_;
  std::unique_ptr<FrameOutput> frames_;
  RankWatch* watch_ = nullptr;  ///< while steps are taken and results written
  std::optional<RunCheckpoints> checkpoints_;
  std::unique_ptr<TraceSession> trace_;
  Index first_step_ = 0;
  double first_share_ = 0;
  double reserve_ = 0;
  bool stop_asked_ = false;    ///< by RunArguments::on_step
  double particle_steps_ = 0;  ///< up to `counted_`
  Index particles_ = 0, counted_ = 0, steps_ = 0, last_frame_ = -1, last_gauges_ = -1,
        next_line_ = 1, printed_ = -1;
  HistoryRow last_row_;
  double energy_scale_ = 0;
  Clock::time_point begin_, loop_begin_;
};

}  // namespace lahar
