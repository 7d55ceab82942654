#include "runtime/program/material_command.h"

#include <fmt/format.h>

#include <filesystem>

#include "io/base/atomic_file.h"
#include "io/base/numbers.h"
#include "physics/base/error.h"
#include "physics/materials/law.h"
#include "runtime/program/commands.h"
#include "runtime/program/material_point.h"
#include "runtime/terminal/console.h"

namespace lahar {

namespace {

constexpr const char* components[6] = {"xx", "yy", "zz", "xy", "yz", "xz"};

/// One step of a segment; `guess` are the strain increments of the step before.
bool advance(MaterialPoint& point, const PathSegment& segment, Index step, const Voigt& start,
             Voigt& guess) {
  const auto steps = static_cast<double>(segment.steps);
  const double dt = segment.time / steps;
  if (!segment.increments.empty())
    return point.strain_by(segment.increments[static_cast<std::size_t>(step)], dt);
  Voigt increment = guess, target{};
  for (std::size_t k = 0; k < 6; ++k) {
    if (segment.stress_controlled[k])
      target[k] = start[k] + segment.change[k] * (static_cast<double>(step + 1) / steps);
    else
      increment[k] = segment.change[k] / steps;
  }
  if (!point.load_by(increment, segment.stress_controlled, target, dt)) return false;
  guess = increment;
  return true;
}

void write_and_name(const std::filesystem::path& file, const std::string& text) {
  write_text_file(file, text);
  fmt::print("{}\n", printable(file.string()));
}

}  // namespace

void follow_path(const MaterialDriver& driver, std::vector<PathPoint>& points, Index& divided) {
  MaterialPoint point(driver.material.law, driver.stress);
  double time = 0;
  const auto note = [&] {
    points.push_back({time, point.strain(), point.stress(), point.state()});
  };
  note();
  Voigt guess{};
  for (std::size_t s = 0; s < driver.path.size(); ++s) {
    const PathSegment& segment = driver.path[s];
    const Voigt start = point.stress();
    for (Index step = 0; step < segment.steps; ++step) {
      if (!advance(point, segment, step, start, guess))
        throw SimulationError(
            fmt::format("material '{}': segment {}, step {} of {}: {} after stress ({:.6g}) Pa. "
                        "Use more steps, or check the parameters and whether the material can bear "
                        "these stresses.",
                        driver.material.name, s + 1, step + 1, segment.steps,
                        segment.increments.empty() ? "the path cannot be followed"
                                                   : "no stress that the law allows was found",
                        fmt::join(point.stress(), ", ")));
      divided = point.divided();
      time += segment.time / static_cast<double>(segment.steps);
      note();
    }
  }
}

// Some laws have pressure and deviatoric stress among their states; the table has them anyway.
static bool is_in_table(const StateVariable& variable) {
  return variable.name == std::string_view("p") || variable.name == std::string_view("q");
}

std::string path_table(const MaterialDriver& driver, const std::vector<PathPoint>& points) {
  std::string text = "step,time";
  for (const char* kind : {"strain", "stress"})
    for (const char* c : components) text += fmt::format(",{}_{}", kind, c);
  text += ",p,q";
  const auto states = state_variables(driver.material.law);
  for (const StateVariable& variable : states)
    if (!is_in_table(variable)) text += fmt::format(",{}", variable.name);
  text += '\n';
  Index step = 0;
  for (const PathPoint& point : points) {
    append_number(text, step++);
    const auto add = [&](double value) {
      text += ',';
      append_number(text, value);
    };
    add(point.time);
    for (const double e : point.strain) add(e);
    for (const double s : point.stress) add(s);
    add(mean_pressure(point.stress));
    add(deviatoric_stress(point.stress));
    for (std::size_t k = 0; k < states.size(); ++k)
      if (!is_in_table(states[k])) add(point.state[k]);
    text += '\n';
  }
  return text;
}

namespace {

struct MaterialArguments {
  std::string driver;  ///< input file
  ScenarioOptions options;
  std::string output;  ///< files OUTPUT.csv and OUTPUT.svg; empty = the driver's name
  bool no_plot = false;
};

/// Throws SimulationError where the path cannot be followed.
int material_command(const MaterialArguments& arguments) {
  const std::filesystem::path file = arguments.driver;
  const MaterialDriver driver = read_material_driver(file, arguments.options);
  if (!driver.warnings.empty())
    fmt::print(stderr, "{}", format_problems(driver.warnings, "warning", false));
  std::string output = arguments.output;
  if (output.empty()) output = (file.parent_path() / file.stem()).string();
  std::vector<PathPoint> points;
  Index divided = 0;
  const auto write = [&] {
    write_and_name(output + ".csv", path_table(driver, points));
    if (!arguments.no_plot) write_and_name(output + ".svg", path_picture(driver, points));
  };
  try {
    follow_path(driver, points, divided);
  } catch (const SimulationError&) {
    write();  // as far as it came
    throw;
  }
  write();
  const PathPoint& end = points.back();
  fmt::print("{} steps; at the end p = {:.6g} Pa, q = {:.6g} Pa\n", points.size() - 1,
             mean_pressure(end.stress), deviatoric_stress(end.stress));
  if (divided > 0)
    fmt::print("{} increment{} could only be done in parts\n", divided, divided == 1 ? "" : "s");
  return exit_ok;
}

}  // namespace

Action add_material(CLI::App& command) {
  const auto arguments = std::make_shared<MaterialArguments>();
  command.add_option("DRIVER", arguments->driver, "Input (JSON): material and path")->required();
  command
      .add_option("--set", arguments->options.overrides,
                  "Replace a value: material.friction=30 (repeatable)")
      ->type_name("KEY=VALUE");
  command.add_flag("--as-cbgeo", arguments->options.as_cbgeo,
                   "Use return mappings and laws as in CB-Geo MPM");
  command.add_option("--output,-o", arguments->output,
                     "Write OUTPUT.csv and OUTPUT.svg (default: beside the driver)");
  command.add_flag("--no-plot", arguments->no_plot, "Write only the table");
  return [arguments](const Words&) {
    refuse_several_ranks("material");
    return material_command(*arguments);
  };
}

}  // namespace lahar
