#include "io/run/run_folder.h"

#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <mutex>

#include "io/base/atomic_file.h"
#include "io/run/checkpoint.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

namespace fs = std::filesystem;

/// Beside manifest.json and log.txt.
constexpr std::array own_files{"scenario.json", "scenario.full.json", "history.csv",
                               rigid_bodies_file, removed_file};
constexpr std::string_view frame_prefix = "particles_", node_prefix = "nodes_";

[[noreturn]] void refuse(std::string message, std::string hint) {
  Problem problem;
  problem.message = std::move(message);
  problem.hint = std::move(hint);
  throw InputError({std::move(problem)});
}

/// Remove what earlier runs wrote, and only that; a user may keep notes and pictures here.
void remove_results(const fs::path& folder) {
  // The manifest goes last: a folder half removed is still recognised as a run.
  for (const char* name : own_files) fs::remove(folder / name);
  for (const char* name : {"frames/particles.hdf.series", "frames/nodes.hdf.series"})
    fs::remove(folder / name);
  for (const char* name : {"frames", "export"}) {
    if (!fs::is_directory(folder / name)) continue;
    for (const auto& entry : fs::directory_iterator(folder / name)) {
      const std::string file = entry.path().filename().string();
      if (file.starts_with(frame_prefix) || file.starts_with(node_prefix) ||
          file == "particles.pvd")
        fs::remove(entry.path());
    }
    remove_abandoned_parts(folder / name);
  }
  for (const auto& [name, endings] :
       {std::pair{"gauges", ".csv"}, {"maps", ".asc .prj .tif"}, {"bodies", ".vtp"}}) {
    if (!fs::is_directory(folder / name)) continue;
    for (const auto& entry : fs::directory_iterator(folder / name))
      if (const std::string ending = entry.path().extension().string();
          !ending.empty() && std::string_view(endings).find(ending) != std::string_view::npos)
        fs::remove(entry.path());
    remove_abandoned_parts(folder / name);
  }
  prune_checkpoints(checkpoint_folder(folder), 0);
  remove_abandoned_parts(checkpoint_folder(folder));
  fs::remove(folder / "manifest.json");
}

/// Held while a run writes to its folder.
void lock_log(const OutputFile& log, const fs::path& folder) {
  if (::flock(log.descriptor(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    refuse(fmt::format("output folder {} is being written to by another run", folder.string()),
           "wait for it to end, or choose another output folder");
}

/// Nothing but what a run leaves that ended before it had a manifest.
bool is_abandoned_start(const fs::path& folder) {
  return std::all_of(fs::directory_iterator(folder), fs::directory_iterator(),
                     [](const auto& entry) {
                       return is_part(entry.path()) ||
                              (entry.path().filename() == "log.txt" && fs::is_empty(entry));
                     });
}

[[noreturn]] void refuse_earlier(const fs::path& folder) {
  refuse(fmt::format("output folder {} holds the results of an earlier run", folder.string()),
         "add --restart latest to continue it, --overwrite to replace them, or choose another "
         "output folder");
}

/// The folder of a run with stages, with no file of the user where a run writes its own.
bool has_only_stages(const fs::path& folder) {
  if (stages_in(folder).empty()) return false;
  const fs::path log = folder / "log.txt";
  if (fs::exists(log) && !fs::is_empty(log)) return false;
  return std::none_of(own_files.begin(), own_files.end(),
                      [&](const char* name) { return fs::exists(folder / name); });
}

/// Whether a run is in the folder; throws where it, or what else is there, must stay.
bool may_be_taken(const fs::path& folder, bool overwrite) {
  const bool run = is_run_folder(folder);
  const bool stages = !run && has_only_stages(folder);
  if (!run && !stages && !is_abandoned_start(folder))
    refuse(fmt::format("output folder {} exists and is not a run of Lahar", folder.string()),
           "choose another output folder, or remove this one yourself");
  if ((run || stages) && !overwrite) refuse_earlier(folder);
  return run;
}

/// Throws where another run is writing to the folder.
void refuse_busy(const fs::path& folder) {
  if (const fs::path file = folder / "log.txt"; fs::is_regular_file(file))
    lock_log(OutputFile(file, OutputFile::Mode::append), folder);  // and gives it back
}

void refuse_busy_stages(const fs::path& folder) {
  for (const FolderOfRun& stage : stages_in(folder)) refuse_busy(stage.folder);
}

/// A link to a folder, perhaps on another disk, is the user's.
void remove_if_empty(const fs::path& folder) {
  if (!fs::is_symlink(folder) && fs::is_directory(folder) && fs::is_empty(folder))
    fs::remove(folder);
}

/// Remove a run in whose place no other begins.
void remove_run(const fs::path& folder) {
  const fs::path file = folder / "log.txt";
  const OutputFile log(file, OutputFile::Mode::append);
  lock_log(log, folder);
  remove_abandoned_parts(folder);
  remove_results(folder);
  fs::remove(file);
  for (const char* name : {"frames", "export", "gauges", "maps", "bodies"})
    remove_if_empty(folder / name);
  remove_if_empty(checkpoint_folder(folder));
}

/// Make the folder or empty it; returns its locked log.
OutputFile claim_folder(const fs::path& folder, bool overwrite, bool cleared) {
  make_folder(folder);
  const fs::path file = folder / "log.txt";
  // A run that is only beginning looks like anything: whether there is one comes first.
  const bool begun = fs::is_regular_file(file);
  if (!begun && !cleared) may_be_taken(folder, overwrite);
  OutputFile log(file, OutputFile::Mode::append);
  lock_log(log, folder);
  // Under the lock: nothing changes any more.
  const bool run = !cleared && may_be_taken(folder, overwrite);
  refuse_busy_stages(folder);
  remove_abandoned_parts(folder);
  remove_stages(folder, [](const std::string&) { return true; });
  if (run) remove_results(folder);
  log.truncate();
  return log;
}

OutputFile claim(const fs::path& folder, bool overwrite, bool cleared) {
  try {
    return claim_folder(folder, overwrite, cleared);
  } catch (const fs::filesystem_error& error) {
    throw_io_error("replace", error.path1(), error.code().value());
  }
}

/// The log of a run that goes on, locked.
OutputFile claim_continued(const fs::path& folder) {
  if (!is_run_folder(folder))
    refuse(fmt::format("output folder {} holds no run that could be continued", folder.string()),
           "start it without --restart, or name its folder with --output");
  OutputFile log(folder / "log.txt", OutputFile::Mode::append);
  lock_log(log, folder);
  return log;
}

/// Later checkpoints go first: one that is left would be continued from without its frames.
KeptFrames rewind(const fs::path& folder, const std::vector<GaugeTable>& gauges,
                  const RunContinuation& from) {
  try {
    const fs::path checkpoints = checkpoint_folder(folder);
    remove_checkpoints_after(checkpoints, from.step);
    remove_abandoned_parts(checkpoints);
    remove_abandoned_parts(folder);
    KeptFrames frames = rewind_frames(folder, from);
    rewind_history(folder, from);
    rewind_rigid_bodies(folder, from);
    rewind_gauges(folder, gauges, from);
    rewind_removed(folder, from);
    return frames;
  } catch (const fs::filesystem_error& error) {
    throw_io_error("read", error.path1(), error.code().value());
  }
}

/// Step of a frame's file name, which begins with `prefix`; none for other files.
std::optional<Index> step_of(const std::string& name, std::string_view prefix) {
  if (!name.starts_with(prefix) || !name.ends_with(".hdf")) return {};
  Index step = 0;
  const char* end = name.data() + name.size() - 4;
  const auto result = std::from_chars(name.data() + prefix.size(), end, step);
  if (result.ec != std::errc{} || result.ptr != end) return {};
  return step;
}

std::vector<FrameFile> files_of_run(const fs::path& folder, std::string_view prefix) {
  std::vector<FrameFile> frames;
  std::error_code error;
  const fs::path place = frames_folder(folder);
  for (const auto& entry : fs::directory_iterator(place, error))
    if (const auto step = step_of(entry.path().filename().string(), prefix))
      frames.push_back({*step, entry.path()});
  if (error) throw_io_error("read", place, error.value());
  std::sort(frames.begin(), frames.end(),
            [](const FrameFile& a, const FrameFile& b) { return a.step < b.step; });
  return frames;
}

}  // namespace

void check_run_folder(const fs::path& folder, bool overwrite) {
  std::error_code error;
  if (!fs::exists(folder, error)) {
    fs::path parent = fs::absolute(folder, error);
    while (parent.has_relative_path() && !fs::exists(parent, error)) parent = parent.parent_path();
    if (::access(parent.c_str(), W_OK | X_OK) != 0) throw_io_error("make folder", folder, errno);
    return;
  }
  if (!fs::is_directory(folder, error)) return;  // making it says what is wrong
  try {
    refuse_busy(folder);
    refuse_busy_stages(folder);
    may_be_taken(folder, overwrite);
  } catch (const fs::filesystem_error& problem) {
    throw_io_error("read", problem.path1(), problem.code().value());
  }
}

void check_run_folder(const fs::path& folder, const std::vector<std::string>& stages,
                      bool overwrite) {
  if (stages.empty()) return check_run_folder(folder, overwrite);
  try {
    if (is_run_folder(folder) || (fs::is_directory(folder) && is_abandoned_start(folder)))
      refuse_busy(folder);
    refuse_busy_stages(folder);
  } catch (const fs::filesystem_error& problem) {
    throw_io_error("read", problem.path1(), problem.code().value());
  }
  if (!overwrite && holds_run(folder)) refuse_earlier(folder);
  for (const std::string& stage : stages) check_run_folder(folder / stage, overwrite);
}

bool holds_run(const fs::path& folder) {
  return is_run_folder(folder) || !stages_in(folder).empty();
}

void remove_unstaged_run(const fs::path& folder) {
  try {
    if (is_run_folder(folder)) remove_run(folder);
  } catch (const fs::filesystem_error& error) {
    throw_io_error("remove", error.path1(), error.code().value());
  }
}

std::vector<std::string> remove_stages(const fs::path& folder,
                                       const std::function<bool(const std::string& name)>& goes) {
  std::vector<std::string> left;
  try {
    std::vector<FolderOfRun> stages = stages_in(folder);
    // The last one first: a folder half cleared still has the first stage, and is known by it.
    std::reverse(stages.begin(), stages.end());
    for (const FolderOfRun& stage : stages) {
      const std::string name = stage.folder.filename().string();
      if (!goes(name)) continue;
      remove_run(stage.folder);
      remove_if_empty(stage.folder);
      if (fs::exists(stage.folder)) left.push_back(name);
    }
  } catch (const fs::filesystem_error& error) {
    throw_io_error("remove", error.path1(), error.code().value());
  }
  return left;
}

struct RunFolder::Impl {
  Impl(fs::path path, const RunFolderContents& contents, bool overwrite, bool cleared)
      : folder(std::move(path)),
        log(claim(folder, overwrite, cleared)),
        manifest(contents.info),
        history((write_start(contents), folder / "history.csv"), OutputFile::Mode::truncate),
        gauge_tables(contents.info.gauges) {
    history.write(history_header());
    history.flush();
    open_gauges(OutputFile::Mode::truncate);
  }

  Impl(fs::path path, const RunFolderContents& contents, const RunContinuation& from)
      : folder(std::move(path)),
        log(claim_continued(folder)),
        manifest(contents.info, read_text_file(folder / "manifest.json"),
                 {from.step, from.time, from.checkpoint}),
        kept(rewind(folder, contents.info.gauges, from)),
        history((write_start(contents), folder / "history.csv"), OutputFile::Mode::append),
        gauge_tables(contents.info.gauges) {
    open_gauges(OutputFile::Mode::append);
  }

  void open_gauges(OutputFile::Mode mode) {
    for (const GaugeTable& table : gauge_tables) {
      const fs::path file = gauge_file(folder, table.name);
      make_folder(file.parent_path());
      gauges.emplace_back(file, mode);
      if (mode == OutputFile::Mode::truncate) gauges.back().write(gauge_header(table));
    }
  }

  /// The manifest comes first, so that whatever happens next, this is known to be a run.
  void write_start(const RunFolderContents& contents) {
    write_text_file(folder / "manifest.json", manifest.text());
    write_text_file(folder / "scenario.json", contents.scenario);
    write_text_file(folder / "scenario.full.json", contents.scenario_full);
    write_body_shapes(folder, contents.info.bodies);
    make_folder(frames_folder(folder));
  }

  /// The log is what this run has locked: where its name leads elsewhere, so do all others.
  void check_place() const {
    const fs::path file = folder / "log.txt";
    struct stat own {
    }, named{};
    if (::fstat(log.descriptor(), &own) != 0) throw_io_error("read", file, errno);
    const int error = ::stat(file.c_str(), &named) == 0 ? 0 : errno;
    if (error != 0 && error != ENOENT && error != ENOTDIR) throw_io_error("read", file, error);
    if (error == 0 && own.st_dev == named.st_dev && own.st_ino == named.st_ino) return;
    throw IoError(fmt::format(
        "run folder {} was removed, moved or replaced while this run wrote to it (log.txt there is "
        "not the one of this run); nothing more is written. Start the run again, and leave its "
        "folder where it is until it has ended",
        folder.string()));
  }

  void complete(const RunEnd& end) {
    finished = true;
    check_place();
    write_text_file(folder / "manifest.json", manifest.text(end));
  }

  fs::path folder;
  std::mutex log_mutex, history_mutex;
  OutputFile log;
  Manifest manifest;
  KeptFrames kept;  ///< frames from before a run that goes on
  OutputFile history;
  std::vector<GaugeTable> gauge_tables;
  std::vector<OutputFile> gauges;          ///< by table
  std::optional<OutputFile> rigid_bodies;  ///< where there are any
  std::optional<OutputFile> removed;       ///< where there are any in this process
  bool finished = false;
};

RunFolder::RunFolder(fs::path folder, const RunFolderContents& contents, bool overwrite,
                     bool cleared)
    : impl_(std::make_unique<Impl>(std::move(folder), contents, overwrite, cleared)) {}

RunFolder::RunFolder(fs::path folder, const RunFolderContents& contents,
                     const RunContinuation& from)
    : impl_(std::make_unique<Impl>(std::move(folder), contents, from)) {}

RunFolder::~RunFolder() {
  if (impl_->finished) return;
  try {
    finish({.status = RunStatus::failed, .message = "ended by an error", .warnings = {}});
  } catch (const std::exception&) {
    // The error that brought us here is the one to report.
  }
}

void RunFolder::log(std::string_view line) {
  const std::lock_guard lock(impl_->log_mutex);
  impl_->log.write(line);
  if (!line.ends_with('\n')) impl_->log.write("\n");
  impl_->log.flush();
}

void RunFolder::history(const HistoryRow& row) {
  const std::lock_guard lock(impl_->history_mutex);
  impl_->history.write(history_line(row));
  impl_->history.flush();
  if (row.bodies.empty()) return;
  auto& bodies = impl_->rigid_bodies;
  if (!bodies) {
    const fs::path file = impl_->folder / rigid_bodies_file;
    const bool goes_on = fs::exists(file);
    bodies.emplace(file, goes_on ? OutputFile::Mode::append : OutputFile::Mode::truncate);
    if (!goes_on) bodies->write(rigid_bodies_header());
  }
  bodies->write(rigid_bodies_lines(row));
  bodies->flush();
}

void RunFolder::gauges(const GaugeRows& rows) {
  const std::lock_guard lock(impl_->history_mutex);
  for (std::size_t k = 0; k < impl_->gauges.size(); ++k) {
    impl_->gauges[k].write(gauge_lines(impl_->gauge_tables[k], rows, k));
    impl_->gauges[k].flush();
  }
}

void RunFolder::removed(std::span<const RemovedParticle> particles) {
  if (particles.empty()) return;
  const std::lock_guard lock(impl_->history_mutex);
  if (!impl_->removed) {
    check_place();
    const fs::path file = impl_->folder / removed_file;
    const bool goes_on = fs::exists(file);
    impl_->removed.emplace(file, goes_on ? OutputFile::Mode::append : OutputFile::Mode::truncate);
    if (!goes_on) impl_->removed->write(removed_header());
  }
  for (const RemovedParticle& particle : particles) impl_->removed->write(removed_line(particle));
  impl_->removed->flush();
}

KeptFrames RunFolder::kept_frames() const {
  return impl_->kept;
}

void RunFolder::check_place() const {
  impl_->check_place();
}

void RunFolder::sync() {
  check_place();
  const std::lock_guard lock(impl_->history_mutex);
  impl_->history.sync();
  if (impl_->removed) impl_->removed->sync();
  if (impl_->rigid_bodies) impl_->rigid_bodies->sync();
  for (OutputFile& gauge : impl_->gauges) gauge.sync();
}

void RunFolder::finish(const RunEnd& end) {
  try {
    impl_->history.sync();
    if (impl_->removed) impl_->removed->sync();
    if (impl_->rigid_bodies) impl_->rigid_bodies->sync();
    for (OutputFile& gauge : impl_->gauges) gauge.sync();
    impl_->log.sync();
  } catch (const IoError& error) {
    RunEnd failed = end;
    failed.status = RunStatus::failed;
    failed.message += (end.message.empty() ? "" : "; ") + std::string(error.what());
    try {
      impl_->complete(failed);
    } catch (const IoError&) {
      // The disk that refused those may refuse this too; the first error says it.
    }
    throw;
  }
  impl_->complete(end);
}

const fs::path& RunFolder::folder() const {
  return impl_->folder;
}

fs::path frames_folder(const fs::path& run) {
  return run / "frames";
}

std::string frame_name(Index step, std::string_view extension) {
  return fmt::format("{}{:010}{}", frame_prefix, step, extension);
}

std::string node_frame_name(Index step) {
  return fmt::format("{}{:010}.hdf", node_prefix, step);
}

std::vector<FrameFile> frames_of_run(const fs::path& folder) {
  return files_of_run(folder, frame_prefix);
}

std::vector<FrameFile> node_frames_of_run(const fs::path& folder) {
  return files_of_run(folder, node_prefix);
}

std::size_t nearest_in(const std::vector<double>& times, double time) {
  const auto nearest = std::min_element(times.begin(), times.end(), [time](double a, double b) {
    return std::abs(a - time) < std::abs(b - time);
  });
  return static_cast<std::size_t>(nearest - times.begin());
}

FrameFile find_frame(const fs::path& source, std::optional<Index> step) {
  if (fs::is_regular_file(source)) return {step.value_or(-1), source};
  if (!is_run_folder(source)) {
    const char* what =
        fs::exists(source) ? "is neither a run folder nor a frame" : "does not exist";
    std::vector<std::string> runs;
    for (const FolderOfRun& run : runs_in(source)) runs.push_back(run.folder.string());
    refuse(
        fmt::format("{} {}", source.string(), what),
        runs.empty() ? "" : fmt::format("name one of the runs in it: {}", fmt::join(runs, ", ")));
  }
  const std::vector<FrameFile> frames = frames_of_run(source);
  if (frames.empty()) refuse(fmt::format("run {} has no frames", source.string()), "");
  if (!step) return frames.back();
  for (const FrameFile& frame : frames)
    if (frame.step == *step) return frame;
  std::string steps;
  constexpr std::size_t shown = 8;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames.size() > shown && i == shown - 2) steps += ", ...";
    if (frames.size() <= shown || i < shown - 2 || i + 1 == frames.size())
      steps += fmt::format("{}{}", i > 0 ? ", " : "", frames[i].step);
  }
  refuse(fmt::format("run {} has no frame at step {}", source.string(), *step),
         "its steps are " + steps);
}

}  // namespace lahar
