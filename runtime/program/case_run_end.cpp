/// \file How a run ends, and what is said about it then.
#include <fmt/format.h>

#include <algorithm>

#include "io/run/checkpoint.h"
#include "io/run/manifest.h"
#include "physics/base/error.h"
#include "physics/particles/patch_split.h"
#include "runtime/base/exit_codes.h"
#include "runtime/program/case_run.h"
#include "runtime/program/run_maps.h"
#include "runtime/program/signals.h"
#include "runtime/program/timing_table.h"
#include "runtime/step/rest_test.h"
#include "runtime/step/watchdog.h"
#include "runtime/trace/analyse/log.h"

namespace lahar {

namespace {

std::string describe_solves(const SolveCounts& of) {
  const auto per_step = [&](Index n) {
    return static_cast<double>(n) / static_cast<double>(of.steps);
  };
  std::string text = "pressure: ";
  if (of.iterations > 0)
    text = fmt::format("implicit: {} iterations of Newton's method, {:.1f} per step, ",
                       format_count(of.iterations), per_step(of.iterations));
  if (of.in_parts > 0)
    text += fmt::format("{} step{} with the loads in parts, ", format_count(of.in_parts),
                        of.in_parts == 1 ? "" : "s");
  if (of.cuts > 0)
    text += fmt::format("{} step cut{}, ", format_count(of.cuts), of.cuts == 1 ? "" : "s");
  text += fmt::format("{} for linear systems, {} to solve them", format_seconds(of.linearize),
                      format_seconds(of.linear));
  if (of.linear_iterations > 0)
    text += fmt::format(" with {} iterations", format_count(of.linear_iterations));
  return text;
}

}  // namespace

int CaseRun::run_time_loop(Simulation& simulation) {
  loop_begin_ = Clock::now();
  RankWatch watch(ranks_, [] { return stop_signal() != 0; });
  watch_ = &watch;
  RunEnd end;
  int code = exit_ok;
  bool is_whole = true;  // all patches are after the same step
  try {
    simulation.run();
    if (!simulation.finished()) {
      end.status = RunStatus::stopped;
      const Index signal = ranks_.max(Index{stop_signal()});  // not every rank may have got it
      end.message = signal != 0   ? fmt::format("signal {}", signal)
                    : stop_asked_ ? "stopped by the calling program"
                                  : "wall time";
      code = exit_stopped;
    }
  } catch (const WholeStepError& error) {
    end.status = RunStatus::failed;
    end.message = error.what();
    code = exit_simulation;
    is_whole = true;
  } catch (const SimulationError& error) {
    end.status = RunStatus::failed;
    end.message = error.what();
    code = exit_simulation;
    is_whole = false;
  }
  watch.steps_ended();
  const double wall = seconds_since(loop_begin_);
  const bool keeps_end = code == exit_simulation || plans_checkpoints() || stage_.goes_before;
  if (code == exit_stopped || (is_whole && keeps_end)) checkpoints_->write(simulation.state());
  if (is_whole) {
    const HistoryRow row = simulation.history();
    if (last_row_.step != row.step) write_row(row);
    if (outline_.output.measured.any() && last_gauges_ != row.step) on_gauges(simulation.gauges());
    if (printed_ != row.step && row.step > 0) print_row(row);
  }
  if (last_frame_ != simulation.step()) {
    frames_->write(simulation.frame_source());
    if (auto nodes = simulation.nodes()) frames_->add_nodes(std::move(*nodes));
  }
  if (folder_ && outline_.output.measured.maps.wanted)
    write_maps(outline_.output.folder, outline_.output.measured.maps, scenario_.map,
               simulation.maps());
  checkpoints_->finish();
  const SimulationInfo info = simulation.info();
  if (end.status == RunStatus::finished && outline_.analysis.until.on())
    end.message = tell_rest(info.rest, simulation.step());
  if (is_whole) warn_of_curved_cells(simulation);
  if (end.status == RunStatus::finished) {
    warn_of_balance(simulation.history(), info);
    warn_of_injection(info);
  }
  report(simulation, info, end, wall, is_whole);
  if (trace_) {
    const Index records = trace_->finish();
    console_.line(fmt::format("trace: {} records in {}; see lahar trace {}", records,
                              trace_folder(outline_.output.folder).string(),
                              outline_.output.folder));
  }
  end.wall_seconds = seconds_since(begin_);
  end.steps = simulation.step();
  end.time = simulation.time();
  end.patches = info.patches;
  end.splits = info.splits;
  for (const Problem& warning : scenario_.warnings) end.warnings.push_back(warning.message);
  finish(end);
  ranks_.wait_for_all();
  return code;
}

std::string CaseRun::how_to_go_on() const {
  if (!is_run_folder(outline_.output.folder)) return "";
  if (!arguments_.can_restart) return ". When the cause is mended, start again with --overwrite.";
  std::vector<CheckpointFile> checkpoints;
  try {
    checkpoints = checkpoints_in(checkpoint_folder(outline_.output.folder));
  } catch (const std::exception&) {
    return "";  // of a folder that cannot be read nothing is known
  }
  if (checkpoints.empty())
    return ". There is no checkpoint: when the cause is mended, start again with --overwrite.";
  const auto later = [](const CheckpointFile& a, const CheckpointFile& b) {
    return a.step < b.step;
  };
  return fmt::format(
      ". When the cause is mended, the same command with --restart latest goes on from step {}.",
      std::max_element(checkpoints.begin(), checkpoints.end(), later)->step);
}

std::vector<StageTiming> CaseRun::timings_of_all(std::vector<StageTiming> all) const {
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

void CaseRun::report_balance(const BalanceReport& balance, double wall) {
  if (!ranks_.several()) return;
  console_.line(
      fmt::format("balance: heaviest rank {:.3f} times the mean, at worst {:.3f}, in particles "
                  "{:.3f} and {:.3f}; {} remap{}, moving {:.1f} % of the particles each, at most "
                  "{:.1f} %; {:.2f} % of the time",
                  balance.work.mean, balance.work.worst, balance.particles.mean,
                  balance.particles.worst, balance.remaps, balance.remaps == 1 ? "" : "s",
                  100 * balance.moved, 100 * balance.most_moved, 100 * balance.seconds / wall));
}

void CaseRun::finish(RunEnd& end) {
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

std::string CaseRun::tell_rest(const RestState& rest, Index step) {
  const UntilRest& until = outline_.analysis.until;
  if (rest.reached) {
    const std::string text =
        fmt::format("at rest after {} steps: {}", format_count(step), describe_rest(rest));
    console_.line("");
    console_.line(text);
    return text;
  }
  std::string wanted = fmt::format("imbalance {:.3g}", until.imbalance);
  if (rest.kinetic >= 0) wanted += fmt::format(" and kinetic_energy {:.3g}", until.kinetic);
  warn(fmt::format(
      "the run has ended before it came to rest: {}, while analysis.until has {}. Let "
      "it take longer, damp it (analysis.damping), or allow more: grains that have come "
      "loose go on moving for long.",
      rest.imbalance < 0 ? "no test was due yet" : describe_rest(rest), wanted));
  return "";
}

void CaseRun::warn_of_balance(const HistoryRow& row, const SimulationInfo& info) {
  constexpr double much = 0.2;
  const Analysis& analysis = outline_.analysis;
  // Particles that come or go take energy along that no column has. (A liquid in pores does, too,
  // but its pressure is zero where it leaves.)
  const bool came_or_went = info.removed > 0 || row.particles != info.particles_at_start ||
                            (!analysis.two_phase && row.mass != info.mass_at_start);
  // A load that is there at once does twice the work that quasi-static bodies can store.
  const bool without_inertia = is_implicit(analysis) && analysis.implicit.quasi_static;
  if (info.energy_scale == 0.0 || came_or_went || without_inertia) return;
  const double put_in = std::max(info.energy_scale, row.external);
  if (!(std::abs(row.balance) > much * put_in)) return;
  const std::string help =
      row.balance > 0.0 && is_made_at_surface(analysis)
          ? std::string(help_at_surface)
          : fmt::format("Compare with half the time step and half the cell{}.",
                        analysis.scheme == Scheme::usl || analysis.scheme == Scheme::usf
                            ? ", and with \"mpm_scheme\": \"musl\""
                            : "");
  warn(fmt::format(
      "the energy does not close: {:.3g} J {}, {:.2g} times the {:.3g} J that were put in "
      "('balance' of history.csv). Do not trust the results. {}",
      std::abs(row.balance),
      row.balance > 0.0 ? "came out of nothing" : "were lost without a trace",
      std::abs(row.balance) / put_in, put_in, help));
}

void CaseRun::warn_of_injection(const SimulationInfo& info) {
  constexpr double much = 0.1;  // of what is expected
  for (const InjectedMass& one : info.injected) {
    if (!(std::abs(one.mass - one.expected) > much * one.expected + one.once)) continue;
    warn(fmt::format(
        "{:.3g} kg were injected where velocity, area and time say {:.3g} kg. Cells are filled "
        "again when they are empty: what was in them left {}. Take one layer of boxes across "
        "the flow, and prescribe the velocity at their nodes, too (velocity_constraints).",
        one.mass, one.expected,
        one.mass > one.expected ? "faster than that"
                                : "more slowly, or came from another of these cells"));
  }
}

void CaseRun::report(Simulation& simulation, const SimulationInfo& info, const RunEnd& end,
                     double wall, bool is_whole) {
  const auto steps = static_cast<double>(simulation.step() - first_step_);
  const double particle_steps = this->particle_steps(simulation.step());
  const std::string in_stage = stage_.name.empty() ? "" : fmt::format("stage {}: ", stage_.name);
  console_.line("");
  const auto to_go_on = [&](const std::string& with) {
    return arguments_.can_restart
               ? "To continue" + with + ": the same command with --restart latest."
               : "To begin again" + with + ": the same command with --overwrite.";
  };
  if (end.status == RunStatus::failed) {
    console_.warn("lahar: error: " + in_stage + end.message);
    console_.line(
        is_whole
            ? fmt::format("The last frame and a checkpoint show the particles after step {}. {}",
                          simulation.step(),
                          to_go_on(info.solves.steps > 0 ? ", with other tolerances"
                                                         : ", with other bounds"))
            : fmt::format("The last frame shows the particles where the run stopped, some a few "
                          "steps beyond step {}.",
                          simulation.step()));
  }
  if (end.status == RunStatus::stopped)
    console_.line(fmt::format("{}stopped by {} after step {}; the state was written. {}", in_stage,
                              end.message, simulation.step(), to_go_on("")));
  if (info.removed > 0)
    console_.warn(fmt::format(
        "lahar: warning: {} particle{} left the mesh and {} removed; {} lists them.", info.removed,
        info.removed == 1 ? "" : "s", info.removed == 1 ? "was" : "were", removed_file));
  if (info.divided > 0)
    console_.line(fmt::format("materials: {} increment{} done in parts, to be accurate",
                              format_count(info.divided), info.divided == 1 ? " was" : "s were"));
  console_.line(
      fmt::format("{} steps in {}: {:.1f} steps/s, {:.2f} million particle-steps/s, {:.1f} ns per "
                  "particle-step and core",
                  format_count(simulation.step() - first_step_), format_seconds(wall), steps / wall,
                  particle_steps / wall * 1e-6,
                  wall * info.threads * ranks_.size() * 1e9 / std::max(1.0, particle_steps)));
  if (info.solves.steps > 0) console_.line(describe_solves(info.solves));
  if (info.splits > 0)
    console_.line(
        fmt::format("patches: {} cut{} through patches of more than {} particles; there are {} now",
                    format_count(info.splits), info.splits == 1 ? "" : "s",
                    format_count(split_factor * outline_.analysis.patch_particles),
                    format_count(info.patches)));
  report_balance(simulation.balance(), wall);
  console_.line(
      timing_table(timings_of_all(simulation.timings()), wall, info.threads * ranks_.size()));
  console_.line("");
  console_.line(fmt::format(
      "next: lahar export {} --to csv, or open {} in ParaView", outline_.output.folder,
      (std::filesystem::path(outline_.output.folder) / "frames" / "particles.hdf.series")
          .string()));
}

}  // namespace lahar
