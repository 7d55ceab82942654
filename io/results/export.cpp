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
                                 fs::path output, double spacing) {
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
    if (format == ExportFormat::csv) write_csv(frame, file);
    if (format == ExportFormat::vtu) write_vtu(frame, file);
    if (format == ExportFormat::cbgeo) write_cbgeo(frame, run, file);
    if (format == ExportFormat::stl) write_stl(free_surface(frame, {spacing}), file);
    if (format == ExportFormat::vtp) write_vtp<3>(free_surface(frame, {spacing}), frame.time, file);
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
