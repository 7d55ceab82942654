#include "io/results/export.h"

#include <fmt/format.h>

#include "io/base/atomic_file.h"
#include "io/base/series.h"
#include "io/frames/cbgeo_table.h"
#include "io/frames/csv.h"
#include "io/frames/surface_files.h"
#include "io/frames/vtkhdf.h"
#include "io/frames/vtu.h"
#include "io/results/cbgeo_export.h"
#include "io/results/free_surface.h"
#include "io/run/checkpoint.h"
#include "io/run/history.h"
#include "io/run/manifest.h"
#include "io/run/removed.h"
#include "io/run/run_folder.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

namespace fs = std::filesystem;

/// Where the files go: a folder, or one file.
struct Destination {
  fs::path folder;
  fs::path file;  ///< empty: names follow the steps
};

Destination destination(const fs::path& source, const fs::path& output, std::string_view extension,
                        std::size_t frames) {
  if (output.empty()) {
    if (fs::is_directory(source)) return {source / "export", {}};
    return {source.parent_path(), fs::path(source).replace_extension(extension)};
  }
  if (output.extension() != extension || fs::is_directory(output)) return {output, {}};
  if (frames > 1) {
    Problem problem;
    problem.message = fmt::format("{} frames do not fit into one file {}", frames, output.string());
    problem.hint = "give a folder, or choose one step";
    throw InputError({problem});
  }
  return {output.parent_path(), output};
}

/// Throws InputError where a file is one that a run wrote, and not an export of it.
void refuse_files_of_run(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) return;
  const fs::path place = fs::weakly_canonical(file, error);
  const fs::path folder = place.parent_path();
  const std::string name = place.filename().string(), within = folder.filename().string();
  const bool table = name == "history.csv" || name == rigid_bodies_file || name == removed_file;
  const bool results = within == "gauges" || within == "maps" || within == "bodies" ||
                       folder == checkpoint_folder(folder.parent_path());
  if ((table && is_run_folder(folder)) || (results && is_run_folder(folder.parent_path())))
    throw InputError(
        {Problem{.message = fmt::format("{} is a file of the run: it would be lost", file.string()),
                 .hint = "choose another name, or leave out --output: files then go to the folder "
                         "export of the run"}});
}

/// Warns of a grid that is finer than the particles.
std::vector<Problem> doubts_of_spacing(const Frame& frame, double spacing) {
  const SurfaceSpacings sensible = surface_spacings(frame);
  if (spacing <= 0 || spacing >= 0.99 * sensible.finest) return {};  // of what is printed below
  return {Problem{.message = fmt::format("--spacing {:.3g} is finer than the particles lie: the "
                                         "surface has holes between them",
                                         spacing),
                  .hint = fmt::format("give at least {:.3g}; without --spacing it is {:.3g} m",
                                      sensible.finest, sensible.usual)}};
}

const char* extension_of(ExportFormat format) {
  switch (format) {
    case ExportFormat::csv:
      return ".csv";
    case ExportFormat::vtu:
      return ".vtu";
    case ExportFormat::stl:
      return ".stl";
    case ExportFormat::vtp:
      return ".vtp";
    default:
      return ".h5";
  }
}

}  // namespace

ExportFormat export_format(const std::string& name) {
  if (name == "csv") return ExportFormat::csv;
  if (name == "vtu") return ExportFormat::vtu;
  if (name == "cbgeo") return ExportFormat::cbgeo;
  if (name == "stl") return ExportFormat::stl;
  if (name == "vtp") return ExportFormat::vtp;
  throw InputError(
      fmt::format("unknown export format '{}'; there are csv, vtu, cbgeo, stl and vtp", name));
}

FrameChoice frame_choice(const std::string& word) {
  if (word == "last") return {};
  if (word == "all") return {.kind = FrameChoice::Kind::all};
  return {FrameChoice::Kind::step, std::stoll(word)};
}

std::vector<FrameFile> chosen_frames(const fs::path& source, const FrameChoice& choice) {
  if (choice.kind == FrameChoice::Kind::step) return {find_frame(source, choice.step)};
  const FrameFile last = find_frame(source);
  if (choice.kind == FrameChoice::Kind::last || !fs::is_directory(source)) return {last};
  return frames_of_run(source);
}

std::vector<fs::path> export_run(const fs::path& source, ExportFormat format, FrameChoice choice,
                                 fs::path output, double spacing, std::vector<Problem>* warnings) {
  const std::string_view extension = extension_of(format);
  std::vector<FrameFile> frames = chosen_frames(source, choice);
  CbgeoRun run;
  if (format == ExportFormat::cbgeo) {
    run = read_cbgeo_run(source);
    if (frames.size() > 1) std::erase_if(frames, [](const FrameFile& f) { return f.step == 0; });
  }
  const Destination to = destination(source, output, extension, frames.size());
  if (!to.folder.empty()) make_folder(to.folder);

  std::vector<fs::path> written;
  std::vector<TimedFile> index;
  for (const FrameFile& entry : frames) {
    const Frame frame = read_frame(entry.file);
    fs::path file = to.file;
    if (file.empty())
      file =
          to.folder / (format == ExportFormat::cbgeo ? cbgeo_file_name(frame.step - 1, run.nsteps)
                                                     : frame_name(frame.step, extension));
    refuse_files_of_run(file);
    if (format == ExportFormat::csv) write_csv(frame, file);
    if (format == ExportFormat::vtu) write_vtu(frame, file);
    if (format == ExportFormat::cbgeo) write_cbgeo(frame, run, file);
    if (format == ExportFormat::stl) write_stl(free_surface(frame, {spacing}), file);
    if (format == ExportFormat::vtp) write_vtp<3>(free_surface(frame, {spacing}), frame.time, file);
    const bool surface = format == ExportFormat::stl || format == ExportFormat::vtp;
    if (surface && warnings && warnings->empty()) *warnings = doubts_of_spacing(frame, spacing);
    written.push_back(file);
    index.push_back({frame.time, file.filename().string()});
  }
  if (format == ExportFormat::vtu && frames.size() > 1) {
    written.push_back(to.folder / "particles.pvd");
    write_pvd(index, written.back());
  }
  return written;
}

}  // namespace lahar
