#include "io/run/run_continuation.h"

#include <charconv>
#include <map>
#include <string_view>

#include "io/base/atomic_file.h"
#include "io/frames/vtkhdf.h"
#include "io/json/json_text.h"
#include "io/run/history.h"
#include "io/run/removed.h"
#include "io/run/run_folder.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

namespace fs = std::filesystem;

bool keeps(Index step, bool due, const RunContinuation& from) {
  return step < from.step || (step == from.step && due);
}

/// Times of the frames that the series lists; none where there is no series.
std::map<std::string, double> listed_times(const fs::path& series) {
  std::map<std::string, double> times;
  if (!fs::exists(series)) return times;
  const auto json = json_of_text(read_text_file(series));
  if (!json.is_object() || !json.contains("files")) return times;
  for (const auto& entry : json["files"])
    if (entry.contains("name") && entry["name"].is_string() && entry.contains("time") &&
        entry["time"].is_number())
      times[entry["name"]] = entry["time"];
  return times;
}

/// Whole rows of a table that begin with a step.
std::string rows_to_keep(const fs::path& file, bool due, const RunContinuation& from) {
  const std::string text = fs::exists(file) ? read_text_file(file) : "";
  std::string kept;
  std::string_view rest = text;
  for (std::size_t end = 0; (end = rest.find('\n')) != rest.npos; rest.remove_prefix(end + 1)) {
    const std::string_view line = rest.substr(0, end);
    Index step = 0;
    const auto number = std::from_chars(line.data(), line.data() + line.size(), step);
    if (number.ec == std::errc{} && keeps(step, due, from)) (kept += line) += '\n';
  }
  return kept;
}

}  // namespace

void rewind_history(const fs::path& run, const RunContinuation& from) {
  const fs::path file = run / "history.csv";
  write_text_file(file, history_header() + rows_to_keep(file, from.has_row, from));
}

void rewind_rigid_bodies(const fs::path& run, const RunContinuation& from) {
  const fs::path file = run / rigid_bodies_file;
  if (fs::exists(file))
    write_text_file(file, rigid_bodies_header() + rows_to_keep(file, from.has_row, from));
}

void rewind_gauges(const fs::path& run, const std::vector<GaugeTable>& tables,
                   const RunContinuation& from) {
  for (const GaugeTable& table : tables) {
    const fs::path file = gauge_file(run, table.name);
    make_folder(file.parent_path());
    write_text_file(file, gauge_header(table) + rows_to_keep(file, from.has_gauge_row, from));
  }
}

void rewind_removed(const fs::path& run, const RunContinuation& from) {
  const fs::path file = run / removed_file;
  const std::string kept = rows_to_keep(file, true, from);
  if (!kept.empty()) return write_text_file(file, removed_header() + kept);
  std::error_code error;
  fs::remove(file, error);
  if (error) throw_io_error("remove", file, error.value());
}

namespace {

/// Those of one kind, with their series.
std::vector<TimedFile> rewind_files(const std::vector<FrameFile>& frames, const fs::path& series,
                                    const RunContinuation& from) {
  std::map<std::string, double> times = listed_times(series);
  std::vector<TimedFile> kept;
  std::vector<fs::path> dropped;
  for (const FrameFile& frame : frames) {
    if (!keeps(frame.step, from.has_frame, from)) {
      dropped.push_back(frame.file);
      continue;
    }
    const std::string name = frame.file.filename().string();
    const auto listed = times.find(name);
    kept.push_back({listed != times.end() ? listed->second : read_frame(frame.file).time, name});
  }
  if (!kept.empty() || fs::exists(series)) write_series(kept, series);
  for (const fs::path& file : dropped) {
    std::error_code error;
    fs::remove(file, error);
    if (error) throw_io_error("remove", file, error.value());
  }
  return kept;
}

}  // namespace

KeptFrames rewind_frames(const fs::path& run, const RunContinuation& from) {
  const fs::path folder = frames_folder(run);
  make_folder(folder);
  KeptFrames kept{rewind_files(frames_of_run(run), folder / "particles.hdf.series", from),
                  rewind_files(node_frames_of_run(run), folder / "nodes.hdf.series", from)};
  remove_abandoned_parts(folder);
  return kept;
}

}  // namespace lahar
