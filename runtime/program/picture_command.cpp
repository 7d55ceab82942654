// `lahar picture`.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <vector>

#include "io/base/atomic_file.h"
#include "io/base/text.h"
#include "io/frames/vtkhdf.h"
#include "io/results/export.h"
#include "runtime/picture/canvas.h"
#include "runtime/picture/frame_picture.h"
#include "runtime/picture/run_facts.h"
#include "runtime/picture/svg.h"
#include "runtime/program/commands.h"
#include "runtime/program/film.h"
#include "runtime/report/map_picture.h"
#include "runtime/report/run_results.h"

namespace lahar {

namespace {

namespace fs = std::filesystem;

struct PictureArguments {
  std::string run, field = "speed", step = "last", view, output, map;
  std::vector<double> range;
  std::optional<double> time;  ///< [s] in place of `step`
  bool film = false;
  double rate = 12;  ///< pictures per second of a film
};

/// A film has all frames, unless one is asked for.
FrameChoice choice_of(const PictureArguments& arguments) {
  return frame_choice(arguments.film && arguments.step == "last" ? "all" : arguments.step);
}

std::vector<FrameFile> frames_for(const PictureArguments& arguments) {
  if (!arguments.time) return chosen_frames(arguments.run, choice_of(arguments));
  const std::vector<FrameFile> all = chosen_frames(arguments.run, frame_choice("all"));
  std::vector<double> times;
  for (const FrameFile& frame : all) times.push_back(read_frame_header(frame.file).time);
  return {all[nearest_in(times, *arguments.time)]};
}

std::optional<ColourScale> scale_in(const PictureArguments& arguments) {
  if (arguments.range.empty()) return {};
  const double low = arguments.range[0], high = arguments.range[1];
  return ColourScale{.low = low, .high = high, .is_signed = low == -high};
}

/// A picture as the file that a name asks for: PNG or SVG.
std::string file_of(const auto& picture, const fs::path& file, double pixel_scale) {
  if (file.extension() == ".svg") {
    Svg svg(picture.width(), picture.height());
    picture.draw(svg);
    return svg.finish();
  }
  Canvas canvas(picture.width(), picture.height(), pixel_scale);
  picture.draw(canvas);
  return png_of(canvas.pixels());
}

class Pictures {
 public:
  explicit Pictures(const PictureArguments& arguments)
      : arguments_(arguments), frames_(frames_for(arguments)) {
    const FrameHeader header = read_frame_header(frames_.back().file);
    columns_ = columns_of_picture(header, arguments.field);
    RunFacts facts = run_facts(arguments.run);
    options_.field = arguments.field;
    options_.look = look_of(arguments.view, header.dim);
    options_.title = printable(facts.title);
    options_.axisymmetric = facts.axisymmetric;
    bodies_ = std::move(facts.bodies);
    options_.scale = scale_in(arguments);
    if (frames_.size() > 1) share_scale();
  }

  void write() {
    if (arguments_.film) return write_film();
    for (const FrameFile& frame : frames_) {
      const fs::path file = file_for(frame, ".png");
      write_text_file(file, drawn(frame.file, file));
      fmt::print("{}\n", printable(file.string()));
    }
  }

 private:
  /// One scale and one place for all pictures.
  void share_scale() {
    std::optional<ColourScale> scale;
    std::optional<Bounds> bounds;
    const bool wanted = options_.scale.has_value();
    for (const FrameFile& file : frames_) {
      const Frame frame = read_frame(file.file, columns_);
      if (frame.id.empty()) continue;
      if (!wanted) {
        const ColourScale own = scale_of(field_of(frame, arguments_.field).values);
        scale = scale ? joined(*scale, own) : own;
      }
      const Bounds place = bounds_of(frame, bodies_.at(frame.time));
      if (bounds)
        bounds->add(place);
      else
        bounds = place;
    }
    if (!wanted) options_.scale = scale;
    options_.bounds = bounds;
  }

  FramePictureOptions options_at(double time) const {
    FramePictureOptions options = options_;
    options.bodies = bodies_.at(time);
    return options;
  }

  std::string drawn(const fs::path& of_frame, const fs::path& file) const {
    const Frame frame = read_frame(of_frame, columns_);
    return file_of(FramePicture(frame, options_at(frame.time)), file, options_.pixel_scale);
  }

  void write_film() const {
    const fs::path file = file_for(frames_.back(), ".mp4");
    Film film(file, arguments_.rate);
    for (const FrameFile& frame : frames_) film.add(drawn(frame.file, "film.png"));
    film.finish();
    fmt::print("{}\n", printable(file.string()));
  }

  /// The file that was asked for, else one in RUN/pictures or beside the frame.
  fs::path file_for(const FrameFile& frame, const std::string& extension) const {
    const fs::path output = arguments_.output, run = arguments_.run;
    const std::string found = output.extension().string();
    const bool is_file = found == extension || (found == ".svg" && !arguments_.film);
    if (is_file && (frames_.size() == 1 || arguments_.film)) return output;
    if (!output.empty() && !found.empty() && !fs::is_directory(output))
      throw InputError({Problem{
          .message =
              fmt::format("cannot write {} to {}",
                          frames_.size() > 1 ? "several pictures" : "a picture", output.string()),
          .hint = arguments_.film ? "films are .mp4 files"
                                  : "pictures are .png or .svg files; name a folder for several"}});
    fs::path folder = output;
    if (output.empty()) folder = fs::is_directory(run) ? run / "pictures" : run.parent_path();
    if (!folder.empty()) make_folder(folder);
    const std::string name = arguments_.field + file_part_of(options_.look);
    if (arguments_.film) return folder / (name + extension);
    return folder /
           (name + frame_name(frame.step, extension).substr(std::string("particles").size()));
  }

  const PictureArguments& arguments_;
  std::vector<FrameFile> frames_;
  std::vector<std::string> columns_;
  FramePictureOptions options_;
  PlacedBodies bodies_;
};

/// A map of a run, as its manifest names them.
void draw_map(const PictureArguments& arguments) {
  const RunResults run = read_run(arguments.run);
  std::vector<RunMap> maps;  // of the last stage first
  for (auto part = run.parts.rbegin(); part != run.parts.rend(); ++part)
    maps.insert(maps.end(), part->maps.begin(), part->maps.end());
  const auto found =
      std::ranges::find_if(maps, [&](const RunMap& map) { return map.name == arguments.map; });
  if (found == maps.end()) {
    std::vector<std::string> names;
    for (const RunMap& map : maps) names.push_back(map.name);
    throw InputError(
        {Problem{.message = fmt::format("{} has no map '{}'", arguments.run, arguments.map),
                 .hint = names.empty()
                             ? "post_processing.maps of a scenario asks for maps; they are written "
                               "when the run ends"
                             : fmt::format("it has {}", fmt::join(names, ", "))}});
  }
  fs::path file = arguments.output;
  if (const std::string end = file.extension().string(); end != ".png" && end != ".svg") {
    if (!end.empty() && !fs::is_directory(file))
      throw InputError({Problem{.message = fmt::format("cannot write a map to {}", file.string()),
                                .hint = "pictures of maps are .png or .svg files"}});
    if (file.empty()) file = fs::path(arguments.run) / "pictures";
    make_folder(file);
    file /= arguments.map + ".png";
  }
  const FramePictureOptions usual;
  const MapPicture picture(read_map(found->file), {.name = readable(found->name),
                                                   .unit = found->unit,
                                                   .title = printable(run.title),
                                                   .ink = usual.ink,
                                                   .scale = scale_in(arguments),
                                                   .largest_width = usual.largest_width,
                                                   .largest_height = usual.largest_height});
  write_text_file(file, file_of(picture, file, usual.pixel_scale));
  fmt::print("{}\n", printable(file.string()));
}

int picture_command(const PictureArguments& arguments) {
  if (arguments.range.size() == 2 && !(arguments.range[0] < arguments.range[1]))
    throw InputError(fmt::format("--range {:g} {:g}: the first number must be smaller",
                                 arguments.range[0], arguments.range[1]));
  if (arguments.map.empty())
    Pictures(arguments).write();
  else
    draw_map(arguments);
  return exit_ok;
}

}  // namespace

Action add_picture(CLI::App& command) {
  const auto arguments = std::make_shared<PictureArguments>();
  command.add_option("RUN", arguments->run, "Run folder or frame")->required();
  command
      .add_option("--field", arguments->field,
                  "What colours show: a field of the frame, one of its components (stress_xy), or "
                  "one that follows from them (speed, von_mises_stress)")
      ->capture_default_str();
  command
      .add_option("--map", arguments->map,
                  "A map of the run in place of a frame: max_thickness, ...")
      ->excludes("--field");  // and others, below
  command.add_option("--step", arguments->step, "Step number, last (default) or all")
      ->check(step_or({"all", "last"}));
  command
      .add_option("--time", arguments->time,
                  "Time [s] in place of a step: that of the nearest frame")
      ->check(CLI::NonNegativeNumber)
      ->excludes("--step");
  command.add_option("--view", arguments->view,
                     "Of three dimensions: 3d (default), plan, or a section such as y=12.5");
  command
      .add_option("--range", arguments->range,
                  "Ends of the colours (default: of the values, without a few outliers)")
      ->expected(2)
      ->type_name("LOW HIGH");
  command.add_flag("--film", arguments->film, "Write a film of all frames (needs ffmpeg)")
      ->excludes("--time");
  command.add_option("--rate", arguments->rate, "Frames of a film per second")
      ->check(CLI::Range(0.1, 120.0))
      ->capture_default_str();
  command.add_option("--output,-o", arguments->output,
                     "File (.png, .svg, .mp4) or folder to write (default: RUN/pictures)");
  for (const char* of_frames : {"--step", "--time", "--view", "--film", "--rate"})
    command.get_option("--map")->excludes(of_frames);
  return [arguments](const Words&) {
    refuse_several_ranks("picture");
    return picture_command(*arguments);
  };
}

}  // namespace lahar
