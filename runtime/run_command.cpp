/// `lahar run` and `lahar check`.
#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cmath>
#include <exception>
#include <filesystem>

#include "io/run_folder.h"
#include "lahar_version.h"
#include "runtime/commands.h"
#include "runtime/console.h"
#include "runtime/frame_output.h"
#include "runtime/rank_team.h"
#include "runtime/rank_watch.h"
#include "runtime/restart.h"
#include "runtime/run_checkpoints.h"
#include "runtime/signals.h"

namespace lahar {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

const char* scheme_name(Scheme scheme) {
  return scheme == Scheme::usf ? "USF" : scheme == Scheme::usl ? "USL" : "MUSL";
}

/// What is said about a model, kept when the simulation takes the model itself.
template <int Dim>
Model<Dim> without_particles(const Model<Dim>& model) {
  Model<Dim> header;
  header.title = model.title;
  header.mesh = model.mesh;
  header.materials = model.materials;
  header.analysis = model.analysis;
  return header;
}

template <int Dim>
void describe(Console& console, const Model<Dim>& model, const SimulationInfo& info,
              const TimeStep& plan, int ranks = 1) {
  console.line(fmt::format("case       {}", model.title.empty() ? "(untitled)" : model.title));
  console.line(ranks == 1 ? fmt::format("threads    {} on 1 rank", info.threads)
                          : fmt::format("threads    {} on each of {} ranks", info.threads, ranks));
  console.line(fmt::format("mesh       {} cells, {} nodes ({})", format_count(info.cells),
                           format_count(info.nodes),
                           model.mesh->is_structured()  ? "structured"
                           : model.mesh->is_cartesian() ? "from a table, Cartesian"
                                                        : "from a table, isoparametric"));
  console.line(fmt::format("particles  {}, {} material{}", format_count(info.particles),
                           model.materials.size(), model.materials.size() == 1 ? "" : "s"));
  console.line(fmt::format("scheme     {}, {}", scheme_name(model.analysis.scheme),
                           model.analysis.flip == 1.0 ? "FLIP"
                           : model.analysis.flip == 0.0
                               ? "PIC"
                               : fmt::format("{:g} FLIP", model.analysis.flip)));
  console.line(fmt::format("time step  {:.4g} s{}, stability limit {:.4g} s", info.dt,
                           plan.adaptive ? " (adaptive)" : "", info.dt_limit));
  console.line(fmt::format("patches    {} of about {} cells, {} tasks per step", info.patches,
                           format_count(info.cells_per_patch), format_count(info.tasks_per_step)));
  console.line(fmt::format("memory     {} for particles and nodes",
                           format_bytes(static_cast<double>(info.bytes))));
}

/// The partition over ranks that a run would begin with.
void describe_ranks(Console& console, const PatchGraph& graph, int ranks, Partitioner partitioner) {
  const RankShares shares = shares_of(graph, partition(partitioner, graph, ranks), ranks);
  console.line(
      fmt::format("ranks      {}, heaviest {:.3f} times the mean, edge cut {} shared nodes",
                  format_count(ranks), shares.imbalance(), format_count(shares.edge_cut)));
  console.line(fmt::format("  {:>9} {:>9} {:>13} {:>13} {:>11}", "rank", "patches", "particles",
                           "shared nodes", "neighbours"));
  Index idle = 0;
  for (std::size_t r = 0; r < shares.ranks.size(); ++r) {
    const RankShare& rank = shares.ranks[r];
    idle += rank.weight == 0;
    console.line(fmt::format("  {:>9} {:>9} {:>13} {:>13} {:>11}", r, format_count(rank.patches),
                             format_count(rank.weight), format_count(rank.shared_nodes),
                             rank.neighbours));
  }
  if (idle > 0)
    console.warn(
        fmt::format("lahar: warning: {} of {} ranks would have no particles: a patch is "
                    "the least that a rank can own. Use fewer ranks, or smaller patches "
                    "(analysis.patch_particles).",
                    format_count(idle), format_count(ranks)));
}

RunInfo run_info(const RunArguments& arguments, const Scenario& scenario) {
  RunInfo info;
  info.version = LAHAR_VERSION;
  info.commit = LAHAR_COMMIT;
  info.compiler = compiler_line();
  info.libraries = library_versions();
  info.command = arguments.command;
  info.inputs = {scenario.file};
  info.inputs.insert(info.inputs.end(), scenario.side_files.begin(), scenario.side_files.end());
  return info;
}

template <int Dim>
void add_model(RunInfo& info, const Model<Dim>& model, const SimulationInfo& sizes) {
  info.title = model.title;
  info.threads = sizes.threads;
  info.dim = Dim;
  info.scheme = scheme_name(model.analysis.scheme);
  info.nodes = sizes.nodes;
  info.cells = sizes.cells;
  info.particles = sizes.particles;
  info.materials = static_cast<Index>(model.materials.size());
  info.patches = sizes.patches;
  info.dt = sizes.dt;
  info.dt_limit = sizes.dt_limit;
}

/// What only the simulation can find out about the input gets its place in the file.
template <int Dim>
std::unique_ptr<Simulation<Dim>> make_simulation(const Scenario& scenario, Model<Dim> model,
                                                 const ExecutionOptions& options,
                                                 Observer observer = {},
                                                 const CheckpointReader* checkpoint = nullptr) {
  try {
    return checkpoint
               ? std::make_unique<Simulation<Dim>>(std::move(model), options, std::move(observer),
                                                   state_in(*checkpoint))
               : std::make_unique<Simulation<Dim>>(std::move(model), options, std::move(observer));
  } catch (const InputError& error) {
    std::vector<Problem> placed;
    for (const Problem& problem : error.problems()) placed.push_back(scenario.place(problem));
    throw InputError(std::move(placed));
  }
}

/// What the checkpoints of a run say of it.
CheckpointHeader checkpoint_header(const Scenario& scenario) {
  return {.version = LAHAR_VERSION,
          .commit = LAHAR_COMMIT,
          .compiler = compiler_line(),
          .run = {},
          .scenario = scenario.full,
          .side_files = hashes_of(scenario.side_files)};
}

/// One run: what happens between the first and the last line on the terminal.
template <int Dim>
class CaseRun {
 public:
  CaseRun(const RunArguments& arguments, Scenario& scenario, Console& console)
      : arguments_(arguments),
        scenario_(scenario),
        console_(console),
        ranks_(arguments.execution.ranks),
        outline_(std::get<Model<Dim>>(scenario.model).analysis),
        output_(std::get<Model<Dim>>(scenario.model).output) {
    if (!arguments.output.empty()) output_.folder = arguments.output;
    OutputPlan& plan = std::get<Model<Dim>>(scenario.model).output;
    if (arguments.checkpoint_steps) plan.checkpoint_steps = *arguments.checkpoint_steps;
    if (arguments.checkpoint_minutes) plan.checkpoint_minutes = *arguments.checkpoint_minutes;
    output_.checkpoint_steps = plan.checkpoint_steps;
    output_.checkpoint_minutes = plan.checkpoint_minutes;
  }

  ~CaseRun() {
    // A checkpoint under way waits for frames that nobody brings forward any more.
    if (std::uncaught_exceptions() > 0 && frames_) frames_->give_up();
  }
  CaseRun(const CaseRun&) = delete;
  CaseRun& operator=(const CaseRun&) = delete;

  int execute() {
    begin_ = Clock::now();
    auto& model = std::get<Model<Dim>>(scenario_.model);
    Model<Dim> header = without_particles(model);
    header_ = checkpoint_header(scenario_);
    if (!arguments_.restart.empty()) open_checkpoint_to_restart();
    const auto made = make_simulation(scenario_, std::move(model), arguments_.execution, observer(),
                                      restart_.get());
    Simulation<Dim>& simulation = *made;
    const SimulationInfo info = simulation.info();
    particles_ = info.particles;
    reserve_ = time_to_write(info);
    first_step_ = counted_ = simulation.step();
    first_share_ = share(simulation.step(), simulation.time());
    steps_ = planned_steps(info);
    describe(console_, header, info, outline_.step, ranks_.size());
    warn_of_unstable_step(info);

    RunInfo about = run_info(arguments_, scenario_);
    add_model(about, header, info);
    header.mesh.reset();  // of a mesh from tables, each rank keeps its part
    about.steps = steps_;
    about.ranks = ranks_.size();
    make_folder(std::move(about));
    frames_ =
        std::make_unique<FrameOutput>(frames_folder(output_.folder), ranks_,
                                      folder_ ? folder_->kept_frames() : std::vector<TimedFile>{});
    frames_->while_waiting([&simulation] { simulation.poll(); });
    begin_checkpoints(info);
    console_.line(fmt::format("output     {}", output_.folder));
    if (restart_) describe_restart(simulation);
    console_.line("");
    console_.line(progress_head());
    write_beginning(simulation);
    return step_to_the_end(simulation);
  }

 private:
  void open_checkpoint_to_restart() {
    restart_ = open_checkpoint(arguments_.restart, output_.folder, ranks_,
                               [this](const std::string& text) { warn(text); });
    allowed_differences_ = check_same_scenario(*restart_, header_, scenario_);
    const CheckpointHeader& header = restart_->header();
    if (header.version != header_.version || header.commit != header_.commit ||
        header.compiler != header_.compiler)
      warn(
          fmt::format("{} was written by another build of Lahar ({} {}, {}); results may differ "
                      "from those of an undisturbed run by rounding.",
                      restart_->file().string(), header.version, header.commit, header.compiler));
  }

  void warn(const std::string& text) {
    scenario_.warnings.push_back({.message = text});
    console_.warn("lahar: warning: " + text);
  }

  /// Where an undisturbed run has a row and a frame at the step of the checkpoint, so does this
  /// one.
  RunContinuation continuation() const {
    const RunState& run = restart_->header().run;
    const auto due = [&](Index every) { return every > 0 && run.step % every == 0; };
    return {.step = run.step,
            .time = run.time,
            .has_row = due(output_.history_steps > 0 ? output_.history_steps : run.history_steps),
            .has_frame = due(output_.frame_steps),
            .checkpoint = restart_->file().string()};
  }

  /// A new folder, or the one of the run that goes on.
  std::unique_ptr<RunFolder> new_folder(RunInfo about) const {
    const RunFolderContents contents{std::move(about), scenario_.text, scenario_.full};
    return restart_ ? std::make_unique<RunFolder>(output_.folder, contents, continuation())
                    : std::make_unique<RunFolder>(output_.folder, contents, arguments_.overwrite);
  }

  void begin_checkpoints(const SimulationInfo& info) {
    checkpoints_.emplace(header_, output_.checkpoint_minutes,
                         CheckpointOptions{.folder = checkpoint_folder(output_.folder),
                                           .kept = output_.checkpoints_kept,
                                           .threads = info.threads,
                                           .before_complete =
                                               [this] {
                                                 frames_->wait_for_named();
                                                 folder_->sync();
                                               },
                                           .while_waiting = [this] { frames_->progress(); }},
                         ranks_);
    // As rank 0 sees it: all must begin the same checkpoints.
    const bool own = ranks_.rank() == 0 && restart_ && is_in_folder(*restart_);
    if (ranks_.any(own)) checkpoints_->is_at(restart_->header().run.step);
  }

  /// The first row and frame; a run that goes on has them.
  void write_beginning(Simulation<Dim>& simulation) {
    const HistoryRow row = simulation.history();
    if (!restart_) {
      write_row(row);
      if (output_.frame_steps > 0) frames_->write(simulation.frame_source());
      return;
    }
    const RunContinuation from = continuation();
    if (from.has_row) last_row_ = row;
    if (from.has_frame) last_frame_ = from.step;
    restart_.reset();
  }

  bool is_in_folder(const CheckpointReader& checkpoint) const {
    std::error_code error;
    return std::filesystem::equivalent(checkpoint.file().parent_path(),
                                       checkpoint_folder(output_.folder), error);
  }

  void describe_restart(const Simulation<Dim>& simulation) {
    const RunState& run = restart_->header().run;
    console_.line(fmt::format("restart    from step {}, {:.6g} s: {}", run.step, run.time,
                              restart_->file().string()));
    for (const std::string& text : allowed_differences_) console_.line("           " + text);
    if (simulation.finished())
      console_.line("           no step is left: to go on, raise analysis.nsteps or end_time");
  }

  /// Rank 0 has the folder; a mistake there is one of all.
  void make_folder(RunInfo about) {
    std::vector<Problem> problems;
    if (ranks_.rank() == 0) {
      try {
        folder_ = new_folder(std::move(about));
        console_.log_to([this](const std::string& line) { folder_->log(line); });
      } catch (const InputError& error) {
        problems = error.problems();
      }
    }
    if (!ranks_.any(!problems.empty())) return;
    Problem problem = problems.empty() ? Problem{} : problems.front();
    ranks_.broadcast(problem.message);  // the same on all ranks, so that it is said once
    ranks_.broadcast(problem.hint);
    throw InputError({Problem{.message = problem.message, .hint = problem.hint}});
  }

  void write_row(const HistoryRow& row) {
    if (folder_) folder_->history(row);
  }

  void warn_of_unstable_step(const SimulationInfo& info) {
    if (outline_.step.adaptive || info.dt <= info.dt_limit) return;
    scenario_.warnings.push_back(
        {.message =
             fmt::format("the time step {:.6g} s is above the stability limit {:.6g} s, which "
                         "the scenario accepts",
                         info.dt, info.dt_limit)});
    console_.warn("lahar: warning: " + scenario_.warnings.back().message);
  }

  /// [s] kept of --wall-time for writing the last state, but not more than a tenth of it:
  /// checkpoint and frame by all ranks to one disk, and some more.
  double time_to_write(const SimulationInfo& info) const {
    constexpr double bytes_per_second = 100e6;
    return std::min(0.1 * arguments_.wall_time,
                    2.0 * static_cast<double>(info.bytes) / bytes_per_second);
  }

  Index planned_steps(const SimulationInfo& info) const {
    const double by_time = std::ceil(outline_.end_time / info.dt * (1 - 1e-12));
    return by_time < static_cast<double>(outline_.nsteps) ? static_cast<Index>(by_time)
                                                          : outline_.nsteps;
  }

  Observer observer() {
    return {[this](FramePieces&& frame) {
              last_frame_ = frame.header.step;
              frames_->add(std::move(frame));
            },
            [this](const HistoryRow& row) { on_history(row); },
            [this](const FrameSource& frame) {
              last_frame_ = frame.header.step;
              frames_->write(frame);
            },
            [this](Index step, double time) { return on_step(step, time); },
            [this](const SimulationState& state) { checkpoints_->write(state); },
            [this] { return checkpoints_->wanted(); },
            [this] {
              frames_->progress();
              checkpoints_->progress();
            }};
  }

  void on_history(const HistoryRow& row) {
    write_row(row);
    last_row_ = row;
    particle_steps_ = particle_steps(row.step);
    counted_ = row.step;
    particles_ = row.particles;
    const double scale = std::max({row.kinetic, std::abs(row.internal), std::abs(row.external)});
    energy_scale_ = std::max(energy_scale_, scale);
    // About twenty lines per run.
    const double done = share(row.step, row.time);
    if (done * 20 < static_cast<double>(next_line_)) return;
    next_line_ = static_cast<Index>(done * 20) + 1;
    print_row(row);
  }

  /// Share of the run that is done, by steps or by time, whichever ends it.
  double share(Index step, double time) const {
    return std::max(
        static_cast<double>(step) / static_cast<double>(std::max<Index>(1, outline_.nsteps)),
        time / outline_.end_time);
  }

  void print_row(const HistoryRow& row) {
    const double done = std::min(1.0, share(row.step, row.time));
    const double done_here = std::max(done - first_share_, 1e-9);
    const double left = seconds_since(loop_begin_) * (1 - done) / done_here;
    console_.line(progress_line(row, energy_scale_, rate(row.step), left));
    printed_ = row.step;
  }

  bool on_step(Index step, double time) {
    watch_->steps_done(step);
    MpiSession::steps_done(step);
    console_.bar(share(step, time), rate(step));
    if (stop_signal() != 0) return false;
    return arguments_.wall_time <= 0 || seconds_since(begin_) < arguments_.wall_time - reserve_;
  }

  double rate(Index step) const { return particle_steps(step) / seconds_since(loop_begin_); }

  /// Particles may come and go: their number is that of the last history row.
  double particle_steps(Index step) const {
    return particle_steps_ + static_cast<double>(step - counted_) * static_cast<double>(particles_);
  }

  int step_to_the_end(Simulation<Dim>& simulation) {
    loop_begin_ = Clock::now();
    RankWatch watch(ranks_, [] { return stop_signal() != 0; });
    watch_ = &watch;
    RunEnd end;
    int code = exit_ok;
    try {
      simulation.run();
      if (!simulation.finished()) {
        end.status = RunStatus::stopped;
        const Index signal = ranks_.max(Index{stop_signal()});  // not every rank may have got it
        end.message = signal != 0 ? fmt::format("signal {}", signal) : "wall time";
        code = exit_stopped;
      }
    } catch (const SimulationError& error) {
      end.status = RunStatus::failed;
      end.message = error.what();
      code = exit_simulation;
    }
    watch.steps_ended();
    const double wall = seconds_since(loop_begin_);
    if (code == exit_stopped || (code == exit_ok && plans_checkpoints()))
      checkpoints_->write(simulation.state());
    if (code != exit_simulation) {
      const HistoryRow row = simulation.history();
      if (last_row_.step != row.step) write_row(row);
      if (printed_ != row.step && row.step > 0) print_row(row);
    }
    if (last_frame_ != simulation.step()) frames_->write(simulation.frame_source());
    checkpoints_->finish();
    report(simulation, end, wall);
    end.wall_seconds = seconds_since(begin_);
    end.steps = simulation.step();
    end.time = simulation.time();
    for (const Problem& warning : scenario_.warnings) end.warnings.push_back(warning.message);
    finish(end);
    ranks_.wait_for_all();
    return code;
  }

  /// Sums over the ranks.
  std::vector<StageTiming> timings_of_all(std::vector<StageTiming> all) const {
    struct Numbers {
      Index calls;
      double total, shortest, longest;
    };
    std::vector<Numbers> own;
    for (const StageTiming& t : all) own.push_back({t.calls, t.total, t.shortest, t.longest});
    const std::vector<Numbers> numbers = ranks_.gather_all(std::span<const Numbers>(own));
    for (StageTiming& t : all) t = {.name = t.name};
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      StageTiming& sum = all[i % all.size()];
      const Numbers& n = numbers[i];
      if (n.calls == 0) continue;
      sum.shortest = sum.calls == 0 ? n.shortest : std::min(sum.shortest, n.shortest);
      sum.longest = std::max(sum.longest, n.longest);
      sum.calls += n.calls;
      sum.total += n.total;
    }
    return all;
  }

  void report_balance(const BalanceReport& balance, double wall) {
    if (!ranks_.several()) return;
    console_.line(
        fmt::format("balance: heaviest rank {:.3f} times the mean, at worst {:.3f}; {} remap{}, "
                    "moving {:.1f} % "
                    "of the particles each, at most {:.1f} %; {:.2f} % of the time",
                    balance.windows > 0 ? balance.imbalance : 1.0, balance.worst, balance.remaps,
                    balance.remaps == 1 ? "" : "s", 100 * balance.moved, 100 * balance.most_moved,
                    100 * balance.seconds / wall));
  }

  bool plans_checkpoints() const {
    return output_.checkpoint_steps > 0 || output_.checkpoint_minutes > 0;
  }

  /// If a frame could not be written, the manifest says failed and the error is thrown.
  void finish(RunEnd& end) {
    try {
      frames_->finish();
    } catch (const IoError& error) {
      end.status = RunStatus::failed;
      end.message += (end.message.empty() ? "" : "; ") + std::string(error.what());
      try {
        if (folder_) folder_->finish(end);
      } catch (const IoError&) {
        // The disk that refused the frame may refuse this too; the first error says it.
      }
      throw;
    }
    if (folder_) folder_->finish(end);
  }

  void report(Simulation<Dim>& simulation, const RunEnd& end, double wall) {
    const SimulationInfo info = simulation.info();
    const auto steps = static_cast<double>(simulation.step() - first_step_);
    const double particle_steps = this->particle_steps(simulation.step());
    console_.line("");
    if (end.status == RunStatus::failed) {
      console_.warn("lahar: error: " + end.message);
      console_.line(
          fmt::format("The last frame shows the particles where the run stopped, some a few "
                      "steps beyond step {}.",
                      simulation.step()));
    }
    if (end.status == RunStatus::stopped)
      console_.line(
          fmt::format("stopped by {} after step {}; the state was written. To continue: the same "
                      "command with --restart latest.",
                      end.message, simulation.step()));
    if (info.removed > 0)
      console_.warn(fmt::format("lahar: warning: {} particle{} left the mesh and {} removed.",
                                info.removed, info.removed == 1 ? "" : "s",
                                info.removed == 1 ? "was" : "were"));
    console_.line(fmt::format(
        "{} steps in {}: {:.1f} steps/s, {:.2f} million particle-steps/s, {:.1f} ns per "
        "particle-step and core",
        format_count(simulation.step() - first_step_), format_seconds(wall), steps / wall,
        particle_steps / wall * 1e-6,
        wall * info.threads * ranks_.size() * 1e9 / std::max(1.0, particle_steps)));
    report_balance(simulation.balance(), wall);
    console_.line(
        timing_table(timings_of_all(simulation.timings()), wall, info.threads * ranks_.size()));
    console_.line("");
    console_.line(fmt::format(
        "next: lahar export {} --to csv, or open {} in ParaView", output_.folder,
        (std::filesystem::path(output_.folder) / "frames" / "particles.hdf.series").string()));
  }

  const RunArguments& arguments_;
  Scenario& scenario_;
  Console& console_;
  Ranks ranks_;
  Analysis outline_;
  OutputPlan output_;
  CheckpointHeader header_;                    ///< of checkpoints that are written
  std::unique_ptr<CheckpointReader> restart_;  ///< until the state has been read
  std::vector<std::string> allowed_differences_;
  std::unique_ptr<RunFolder> folder_;
  std::unique_ptr<FrameOutput> frames_;
  RankWatch* watch_ = nullptr;  ///< while steps are taken and results written
  std::optional<RunCheckpoints> checkpoints_;
  Index first_step_ = 0;
  double first_share_ = 0;
  double reserve_ = 0;
  double particle_steps_ = 0;  ///< up to `counted_`
  Index particles_ = 0, counted_ = 0, steps_ = 0, last_frame_ = -1, next_line_ = 1, printed_ = -1;
  HistoryRow last_row_;
  double energy_scale_ = 0;
  Clock::time_point begin_, loop_begin_;
};

Scenario read(const RunArguments& arguments, Console& console, const Team* team = nullptr) {
  ScenarioOptions options = arguments.options;
  options.team = team;
  Scenario scenario = read_scenario(arguments.scenario, options);
  if (!scenario.warnings.empty())
    console.warn(format_problems(scenario.warnings, "warning", use_colour(2)));
  return scenario;
}

/// All ranks must compute the same, to the last bit, or the result would be nobody's. Before the
/// scenario is read, which they do together.
void check_alike(const RunArguments& arguments) {
  const Ranks& ranks = arguments.execution.ranks;
  if (!ranks.several()) return;
  std::string options;  // but for the program's name, and for threads, which may differ
  for (std::size_t k = 1; k < arguments.command.size(); ++k) {
    const std::string& word = arguments.command[k];
    if (word == "-t" || word == "--threads")
      ++k;
    else if (!word.starts_with("-t") && !word.starts_with("--threads="))
      options += word + "\n";
  }
  std::string scenario;
  try {
    scenario = sha256_of_file(arguments.scenario);
  } catch (const IoError&) {
    // Reading it says so.
  }
  const std::array texts{version_line() + compiler_line(), scenario, options};
  const std::array names{"programs (version, commit or compiler)", "scenario files", "options"};
  for (std::size_t k = 0; k < texts.size(); ++k) {
    const std::string own = sha256(texts[k]);
    const std::vector<char> all = ranks.gather_all(std::span<const char>(own));
    std::string different;
    for (std::size_t r = 1; r < static_cast<std::size_t>(ranks.size()); ++r)
      if (!std::equal(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(own.size()),
                      all.begin() + static_cast<std::ptrdiff_t>(own.size() * r)))
        different += fmt::format("{}{}", different.empty() ? "" : ", ", r);
    if (!different.empty())
      throw RankError(
          fmt::format("the ranks were started with different {}: rank 0 against {}. "
                      "Start all of them with the same.",
                      names[k], different));
  }
}

}  // namespace

int run_command(const RunArguments& arguments) {
  watch_signals();
  Console console(arguments.execution.ranks.rank() > 0 ? Console::Voice::silent
                  : arguments.quiet                    ? Console::Voice::quiet
                                                       : Console::Voice::normal);
  console.line("Lahar " + version_line());
  console.line("built with " + compiler_line());
  check_alike(arguments);
  const RankTeam team(arguments.execution.ranks);
  Scenario scenario = read(arguments, console, &team);
  return std::visit(
      [&]<int Dim>(const Model<Dim>&) {
        return CaseRun<Dim>(arguments, scenario, console).execute();
      },
      scenario.model);
}

int check_command(const RunArguments& arguments) {
  Console console(false);
  Scenario scenario = read(arguments, console);
  std::visit(
      [&]<int Dim>(Model<Dim>& model) {
        const Model<Dim> header = without_particles(model);
        const std::string folder = model.output.folder;
        const auto simulation = make_simulation(scenario, std::move(model), arguments.execution);
        describe(console, header, simulation->info(), header.analysis.step);
        console.line(fmt::format("output     {}", folder));
        if (arguments.ranks > 0)
          describe_ranks(console, simulation->patch_graph(), arguments.ranks,
                         arguments.partitioner);
      },
      scenario.model);
  console.line(fmt::format("next: lahar run {}", arguments.scenario));
  return exit_ok;
}

}  // namespace lahar
