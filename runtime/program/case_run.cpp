#include "runtime/program/case_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>

#include "lahar_version.h"
#include "runtime/program/ranks_begin.h"
#include "runtime/program/run_maps.h"
#include "runtime/program/signals.h"
#include "runtime/program/startup_progress.h"
#include "runtime/step/output_times.h"
#include "runtime/terminal/version.h"

namespace lahar {

namespace {

RunInfo run_info(const RunArguments& arguments, const Scenario& scenario) {
  RunInfo info;
  if (!scenario.stages.empty()) info.stage = static_cast<Index>(scenario.stage) + 1;
  info.version = LAHAR_VERSION;
  info.commit = LAHAR_COMMIT;
  info.compiler = compiler_line();
  info.libraries = library_versions();
  info.command = arguments.command;
  info.map_origin = {scenario.map.origin.x(), scenario.map.origin.y()};
  info.map_reference = scenario.map.reference;
  if (!scenario.file.empty()) info.inputs = {scenario.file};
  info.inputs.insert(info.inputs.end(), scenario.side_files.begin(), scenario.side_files.end());
  return info;
}

void add_model(RunInfo& info, const ModelOutline& model, const SimulationInfo& sizes) {
  info.title = model.title;
  info.threads = sizes.threads;
  info.dim = model.dim;
  info.scheme = scheme_name(model.analysis.scheme);
  info.nodes = sizes.nodes;
  info.cells = sizes.cells;
  info.particles = sizes.particles;
  info.materials = static_cast<Index>(count_materials(model.materials));
  info.patches = sizes.patches;
  info.patch_particles = model.analysis.patch_particles;
  info.split_steps = model.analysis.split_steps;
  info.dt = sizes.dt;
  info.dt_limit = sizes.dt_limit;
}

/// The model's, which options of the command line change.
ModelOutline outline_with_options(AnyModel& any, const RunArguments& arguments) {
  std::visit(
      [&](auto& model) {
        OutputPlan& plan = model.output;
        if (arguments.checkpoint_steps) plan.checkpoint_steps = *arguments.checkpoint_steps;
        if (arguments.checkpoint_minutes) plan.checkpoint_minutes = *arguments.checkpoint_minutes;
        if (!arguments.output.empty()) plan.folder = arguments.output;
      },
      any);
  return outline_of(any);
}

}  // namespace

CheckpointHeader checkpoint_header(const Scenario& scenario) {
  return {.version = LAHAR_VERSION,
          .commit = LAHAR_COMMIT,
          .compiler = compiler_line(),
          .run = {},
          .scenario = scenario.full,
          .side_files = hashes_of(scenario.side_files)};
}

CaseRun::CaseRun(const RunArguments& arguments, Scenario& scenario, Console& console,
                 CaseStage stage)
    : arguments_(arguments),
      scenario_(scenario),
      console_(console),
      stage_(std::move(stage)),
      ranks_(arguments.execution.ranks),
      outline_(outline_with_options(scenario.model, arguments)) {}

int CaseRun::execute() {
  begin_ = Clock::now();
  header_ = checkpoint_header(scenario_);
  if (!arguments_.restart.empty()) open_checkpoint_to_restart();
  std::vector<BodyShape> bodies;
  if (ranks_.rank() == 0) bodies = shapes_of_bodies(scenario_.model);
  Simulation simulation = begin_simulation();
  const SimulationInfo info = simulation.info();
  particles_ = info.particles;
  reserve_ = time_to_write(info);
  first_step_ = counted_ = simulation.step();
  first_share_ = share(simulation.step(), simulation.time());
  steps_ = planned_steps(info);
  describe(console_, outline_, info, ranks_.size());
  describe_loads(console_, scenario_.loads);
  describe_frames(console_, outline_.output, outline_.analysis, info);
  warn_of_unstable_step(info);
  const std::vector<std::string> changes = describe_changes(
      info.changed, outline_.materials, outline_.new_materials, outline_.removal_times);
  for (const std::string& line : changes) console_.line("changed    " + line);
  warn_of_empty_groups(info.changed);
  warn_of_lost_strains(info.changed);
  warn_of_occupied_cells(info.changed.occupied);
  if (!info.changed.removed.empty() && info.particles == 0)
    warn("the stage removes all particles: nothing is left that could move");

  RunInfo about = run_info(arguments_, scenario_);
  add_model(about, outline_, info);
  about.steps = steps_;
  about.ranks = ranks_.size();
  about.changes = changes;
  about.gauges = simulation.gauge_tables();
  about.bodies = std::move(bodies);
  if (outline_.output.measured.maps.wanted) about.maps = map_columns();
  ask_at_signals();
  make_folder(std::move(about));
  frames_ = std::make_unique<FrameOutput>(frames_folder(outline_.output.folder), ranks_,
                                          folder_ ? folder_->kept_frames() : KeptFrames{},
                                          arguments_.writers);
  frames_->while_waiting([&simulation] { simulation.poll(); });
  if (folder_) frames_->before_naming([this] { folder_->check_place(); });
  begin_checkpoints(simulation, info);
  console_.line(fmt::format("output     {}", outline_.output.folder));
  describe_staging(info);
  if (restart_) describe_restart(simulation);
  console_.line("");
  console_.line(progress_head());
  write_beginning(simulation);
  if (arguments_.trace) begin_trace(simulation, info);
  try {
    return run_time_loop(simulation);
  } catch (const IoError& error) {
    throw IoError(error.what() + how_to_go_on());
  }
}

Simulation CaseRun::begin_simulation() {
  StartupProgress progress(ranks_.rank() == 0 && !arguments_.quiet);
  progress.phase("patches and particles");
  std::optional<SimulationState> state;
  if (restart_)
    state = state_in(*restart_);
  else if (stage_.before)
    state = state_at_start(*stage_.before, stage_.alike);
  return make_simulation(scenario_, arguments_.execution, observer(), state ? &*state : nullptr);
}

void CaseRun::begin_trace(const Simulation& simulation, const SimulationInfo& info) {
  const auto mode = arguments_.execution.mode;
  const TraceAbout about{.version = version_line(),
                         .title = outline_.title,
                         .scheme = scheme_name(outline_.analysis.scheme),
                         .executor = mode == ExecutionOptions::Mode::bulk     ? "bulk-synchronous"
                                     : mode == ExecutionOptions::Mode::serial ? "serial"
                                                                              : "task graph",
                         .adaptive = simulation.graph().has_dt,
                         .threads = info.threads,
                         .latency = arguments_.execution.latency};
  trace_ = std::make_unique<TraceSession>(outline_.output.folder, *arguments_.trace, ranks_, about,
                                          simulation.loops(), simulation.trace_graph());
}

void CaseRun::open_checkpoint_to_restart() {
  restart_ = open_checkpoint(arguments_.restart, outline_.output.folder, ranks_,
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

RunContinuation CaseRun::continuation() const {
  const RunState& run = restart_->header().run;
  const TimeStep& plan = outline_.analysis.step;
  const double before =
      plan.adaptive ? run.time - run.dt : static_cast<double>(run.step - 1) * plan.dt;
  const auto due = [&](Index every, double interval) {
    if (run.step == 0) return every > 0 || interval > 0;
    return (every > 0 && run.step % every == 0) ||
           (interval > 0 && multiples_by(run.time, interval) > multiples_by(before, interval));
  };
  const bool by_time = outline_.output.history_dt > 0;
  const Index history_steps = by_time ? 0 : outline_.output.history_steps;
  const bool has_row = due(by_time || history_steps > 0 ? history_steps : run.history_steps,
                           outline_.output.history_dt);
  const GaugePlan& measured = outline_.output.measured;
  return {.step = run.step,
          .time = run.time,
          .has_row = has_row,
          .has_frame = due(outline_.output.frame_steps, outline_.output.frame_dt),
          .checkpoint = restart_->file().string(),
          .has_gauge_row = measured.steps > 0 || measured.dt > 0
                               ? due(measured.dt > 0 ? 0 : measured.steps, measured.dt)
                               : has_row};
}

std::unique_ptr<RunFolder> CaseRun::new_folder(RunInfo about) const {
  const RunFolderContents contents{std::move(about), scenario_.text, scenario_.full};
  if (restart_)
    return std::make_unique<RunFolder>(outline_.output.folder, contents, continuation());
  return std::make_unique<RunFolder>(outline_.output.folder, contents, arguments_.overwrite,
                                     stage_.cleared);
}

void CaseRun::begin_checkpoints(Simulation& simulation, const SimulationInfo& info) {
  checkpoints_.emplace(header_, outline_.output.checkpoint_minutes,
                       CheckpointOptions{.folder = checkpoint_folder(outline_.output.folder),
                                         .kept = outline_.output.checkpoints_kept,
                                         .threads = info.threads,
                                         .staging_bytes = arguments_.execution.staging_bytes,
                                         .before_complete =
                                             [this] {
                                               frames_->wait_for_named();
                                               folder_->sync();
                                             },
                                         .before_naming = [this] { folder_->check_place(); },
                                         .while_waiting = [&simulation] { simulation.poll(); }},
                       ranks_);
  // As rank 0 sees it: all must begin the same checkpoints.
  const bool own = ranks_.rank() == 0 && restart_ && is_in_folder(*restart_);
  if (ranks_.any(own)) checkpoints_->is_at(restart_->header().run.step);
}

void CaseRun::write_beginning(Simulation& simulation) {
  const HistoryRow row = simulation.history();
  if (!restart_) {
    write_row(row);
    if (outline_.output.measured.any()) on_gauges(simulation.gauges());
    if (plans_frames()) frames_->write(simulation.frame_source());
    return;
  }
  const RunContinuation from = continuation();
  if (from.has_row) last_row_ = row;
  if (from.has_frame) last_frame_ = from.step;
  if (from.has_gauge_row) last_gauges_ = from.step;
  restart_.reset();
}

bool CaseRun::is_in_folder(const CheckpointReader& checkpoint) const {
  std::error_code error;
  return std::filesystem::equivalent(checkpoint.file().parent_path(),
                                     checkpoint_folder(outline_.output.folder), error);
}

void CaseRun::describe_restart(const Simulation& simulation) {
  const RunState& run = restart_->header().run;
  console_.line(fmt::format("restart    from step {}, {:.6g} s: {}", run.step, run.time,
                            restart_->file().string()));
  for (const std::string& text : allowed_differences_) console_.line("           " + text);
  if (simulation.finished())
    console_.line("           no step is left: to go on, raise analysis.nsteps or end_time");
}

void CaseRun::make_folder(RunInfo about) {
  on_first_rank(ranks_, [&] {
    if (stage_.before_folder) stage_.before_folder();
    folder_ = new_folder(std::move(about));
    console_.log_to([this](const std::string& line) { folder_->log(line); });
  });
}

void CaseRun::warn_of_unstable_step(const SimulationInfo& info) {
  if (outline_.analysis.step.adaptive || info.dt <= info.dt_limit) return;
  scenario_.warnings.push_back(
      {.message = fmt::format("the time step {:.6g} s is above the stability limit {:.6g} s, which "
                              "the scenario accepts",
                              info.dt, info.dt_limit)});
  console_.warn("lahar: warning: " + scenario_.warnings.back().message);
}

void CaseRun::warn_of_curved_cells(const Simulation& simulation) {
  constexpr double most = 0.1;  // of a cell, until stresses err by tenths
  if (outline_.curved_cell == 0) return;
  double moved = 0;  // the square of a displacement
  for (const PatchParticles& patch : simulation.particles_in_place())
    for (const PatchColumn& column : patch.columns) {
      if (std::string_view(column.name) != "displacement") continue;
      for (const auto& [begin, end] : patch.bins)
        for (Local p = begin; p < end; ++p) {
          double square = 0;
          for (int d = 0; d < column.components; ++d)
            square += std::pow(column.first[static_cast<std::size_t>(d) * column.stride +
                                            static_cast<std::size_t>(p)],
                               2);
          moved = std::max(moved, square);
        }
    }
  const double share = ranks_.max(std::sqrt(moved)) / outline_.curved_cell;
  if (share > most)
    warn(fmt::format(
        "particles have moved by up to {:.2g} of a cell. Stresses in cells of second order err by "
        "tenths then. Meshes of equal boxes with linear cells have quadratic splines, which do "
        "not.",
        share));
}

void CaseRun::warn_of_empty_groups(const ChangedParticles& changed) {
  const auto look = [&](const std::vector<ParticleCount>& groups, const char* key) {
    for (std::size_t k = 0; k < groups.size(); ++k)
      if (groups[k].particles == 0) warn(fmt::format("no particle is in entry {} of {}", k, key));
  };
  look(changed.removed, "remove");
  look(changed.materials, "change_material");
}

void CaseRun::warn_of_lost_strains(const ChangedParticles& changed) {
  if (!changed.lost_strains) return;
  warn(
      fmt::format("stage {}: strains begin at zero. The stage before has stored none: they follow "
                  "from stresses as long as no stage changes materials, places particles or resets "
                  "strains. Strains in frames, gauges and pictures are those since then; stresses "
                  "are right. To have all strains, run all stages again with --overwrite.",
                  stage_.name));
}

void CaseRun::warn_of_occupied_cells(const OccupiedCells& occupied) {
  if (occupied.cells == 0) return;
  const auto x = std::span(occupied.place).first(static_cast<std::size_t>(outline_.dim));
  warn(fmt::format(
      "stage {}: 'place' puts {} particles where others are: {} cells hold both, of up to {:.3g} "
      "times the cell's volume, at ({:.6g}). Material is there twice. Take what is there out of "
      "the region with \"difference\", or out of the model with 'remove' of this stage, which "
      "comes first.",
      stage_.name, format_count(occupied.particles), format_count(occupied.cells), occupied.most,
      fmt::join(x, ", ")));
}

void CaseRun::describe_staging(const SimulationInfo& info) {
  const std::size_t staging = arguments_.execution.staging_bytes;
  std::string waits;
  const auto add = [&](bool planned, const char* what, std::size_t bytes) {
    if (planned && bytes > staging)
      waits += fmt::format("{}{} ({} of the largest rank)", waits.empty() ? "" : " and ", what,
                           format_bytes(static_cast<double>(bytes)));
  };
  add(plans_frames(), "frames", info.frame_bytes);
  add(plans_checkpoints(), "checkpoints", info.state_bytes);
  if (!waits.empty())
    console_.line(fmt::format("staging    {}: steps wait while {} are written (see --staging)",
                              format_bytes(static_cast<double>(staging)), waits));
}

double CaseRun::time_to_write(const SimulationInfo& info) const {
  constexpr double bytes_per_second = 100e6;
  return std::min(0.1 * arguments_.wall_time,
                  2.0 * static_cast<double>(info.bytes) / bytes_per_second);
}

Index CaseRun::planned_steps(const SimulationInfo& info) const {
  const double by_time = std::ceil(outline_.analysis.end_time / info.dt * (1 - 1e-12));
  return by_time < static_cast<double>(outline_.analysis.nsteps) ? static_cast<Index>(by_time)
                                                                 : outline_.analysis.nsteps;
}

Observer CaseRun::observer() {
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
            if (frames_) frames_->progress();
            if (checkpoints_) checkpoints_->progress();
          },
          [this](std::span<const RemovedParticle> particles) {
            if (folder_) folder_->removed(particles);
          },
          [this](const std::string& text) { warn(text); },
          [this](const GaugeRows& rows) { on_gauges(rows); },
          [this](FramePieces&& nodes) { frames_->add_nodes(std::move(nodes)); }};
}

void CaseRun::on_history(const HistoryRow& row) {
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

void CaseRun::print_row(const HistoryRow& row) {
  const double done = std::min(1.0, share(row.step, row.time));
  const double done_here = std::max(done - first_share_, 1e-9);
  const double left = seconds_since(loop_begin_) * (1 - done) / done_here;
  console_.line(progress_line(row, energy_scale_, rate(row.step), left));
  printed_ = row.step;
}

bool CaseRun::on_step(Index step, double time) {
  watch_->steps_done(step);
  MpiSession::steps_done(step);
  console_.bar(share(step, time), rate(step));
  if (stop_signal() != 0) return false;
  if (arguments_.on_step && !arguments_.on_step(step, time, share(step, time))) {
    stop_asked_ = true;
    return false;
  }
  return arguments_.wall_time <= 0 || seconds_since(begin_) < arguments_.wall_time - reserve_;
}

}  // namespace lahar
