#include "io/scenario/material_driver.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "io/scenario/law_reader.h"
#include "io/schema/keys.h"

namespace lahar {

namespace {

class DriverBuilder {
 public:
  explicit DriverBuilder(ScenarioInput& in) : in_(in), root_(in.document.root) {}

  MaterialDriver build() {
    MaterialDriver driver;
    driver.title = get_text(root_, "title").value_or("");
    if (const JsonValue* m = root_.find("material"); m && m->is<JsonValue::Object>()) {
      driver.material.id = get_integer(*m, "id").value_or(0);
      driver.material.name =
          get_text(*m, "name").value_or(get_text(*m, "type").value_or("material"));
      driver.material.density = get_number(*m, "density").value_or(1);
      driver.material.law = read_law(*m, in_);
    }
    if (const auto stress = six(root_, "initial_stress")) driver.stress = *stress;
    for (const JsonValue* segment : get_list(root_, "path"))
      driver.path.push_back(read_segment(*segment));
    if (const JsonValue* path = root_.find("path"); path && driver.path.empty())
      in_.error(*path, "the path has no segments");
    return driver;
  }

 private:
  std::optional<Voigt> six(const JsonValue& object, std::string_view key) {
    const JsonValue* value = object.find(key);
    if (!value) return std::nullopt;
    const auto numbers = get_numbers(object, key);
    if (numbers.size() != 6) {
      in_.error(*value, fmt::format("'{}' must have the six components xx yy zz xy yz xz, found {}",
                                    key, numbers.size()));
      return std::nullopt;
    }
    Voigt out{};
    std::copy(numbers.begin(), numbers.end(), out.begin());
    return out;
  }

  PathSegment read_segment(const JsonValue& s) {
    PathSegment segment;
    segment.steps = get_integer(s, "steps").value_or(0);
    segment.time = get_number(s, "time").value_or(1);
    const bool triaxial = s.find("triaxial"), change = s.find("change"),
               file = s.find("increments");
    if (triaxial + change + file != 1) {
      in_.error(s, "a segment needs one of 'triaxial', 'change' and 'increments'");
      return segment;
    }
    if (triaxial != (s.find("axial_strain") != nullptr))
      in_.error(s, "'triaxial' and 'axial_strain' belong together");
    if (!change && s.find("control")) in_.error(*s.find("control"), "'control' is for 'change'");
    if (file == (s.find("steps") != nullptr))
      in_.error(s, file ? "'increments' are the steps; leave out 'steps'"
                        : "'steps' is missing in a segment of the path");
    if (triaxial) read_triaxial(s, segment);
    if (change) read_change(s, segment);
    if (file) read_increments(s, segment);
    return segment;
  }

  static void read_triaxial(const JsonValue& s, PathSegment& segment) {
    const std::string kind = get_text(s, "triaxial").value_or("");
    const double axial = get_number(s, "axial_strain").value_or(0);
    segment.change[2] = axial;
    if (kind == "drained") segment.stress_controlled[0] = segment.stress_controlled[1] = true;
    if (kind == "undrained") segment.change[0] = segment.change[1] = -0.5 * axial;
  }

  void read_change(const JsonValue& s, PathSegment& segment) {
    segment.change = six(s, "change").value_or(Voigt{});
    read_control(s, segment);
    for (std::size_t k = 0; k < 6; ++k)
      if (!segment.stress_controlled[k] && !(std::abs(segment.change[k]) <= largest_path_strain))
        in_.error(*s.find("change"),
                  fmt::format("strains of a segment must be at most {:g}, found {:g}",
                              largest_path_strain, segment.change[k]));
  }

  void read_control(const JsonValue& s, PathSegment& segment) {
    const JsonValue* control = s.find("control");
    if (!control) return;
    const auto& words = control->as<JsonValue::Array>();
    const bool good = words.size() == 6 && std::all_of(words.begin(), words.end(), [](auto& w) {
                        return w.template as<std::string>() == "strain" ||
                               w.template as<std::string>() == "stress";
                      });
    if (!good)
      return in_.error(*control, "'control' must have six words, each \"strain\" or \"stress\"");
    for (std::size_t k = 0; k < 6; ++k)
      segment.stress_controlled[k] = words[k].as<std::string>() == "stress";
  }

  void read_increments(const JsonValue& s, PathSegment& segment) {
    const auto file = in_.open(s, "increments");
    if (!file) return;
    std::istringstream lines(file->all());
    int number = 0;
    for (std::string line; std::getline(lines, line);) {
      ++number;
      if (line.empty() || line[0] == '#' || line[0] == '!') continue;
      std::istringstream words(line);
      Voigt row{};
      for (double& value : row) words >> value;
      std::string more;
      if (!words || (words >> more) || !std::all_of(row.begin(), row.end(), [](double v) {
            return std::abs(v) <= largest_path_strain;
          }))
        return in_.error(*s.find("increments"),
                         fmt::format("line {} of '{}' must have six numbers, at most {:g}", number,
                                     file->name, largest_path_strain));
      segment.increments.push_back(row);
    }
    segment.steps = static_cast<Index>(segment.increments.size());
    if (segment.increments.empty()) in_.error(*s.find("increments"), "the file has no increments");
  }

  ScenarioInput& in_;
  JsonValue& root_;
};

MaterialDriver read_driver(ScenarioInput in, const ScenarioOptions& options) {
  JsonValue& root = in.document.root;
  if (root.valid())
    for (const auto& argument : options.overrides)
      in.document.override_value(argument, in.problems);
  if (root.valid() && !root.is<JsonValue::Object>())
    in.error(root, fmt::format("a driver must be an object, found {}", describe(root)));
  if (!root.is<JsonValue::Object>()) throw InputError(in.problems.errors(in.file));
  check_section(driver_section(), root, 3, in.document, in.problems);
  MaterialDriver driver = DriverBuilder(in).build();
  if (!in.problems.empty()) throw InputError(in.problems.errors(in.file));
  driver.warnings = in.problems.take_warnings(in.file);
  return driver;
}

MaterialDriver read_driver(const std::string& name, std::string text, std::filesystem::path folder,
                           const ScenarioOptions& options) {
  static const Team alone;
  ProblemList problems;
  JsonDocument document(name, std::move(text), problems);
  return read_driver({name, std::move(document), std::move(problems), std::move(folder), "driver",
                      options.as_cbgeo, &alone},
                     options);
}

}  // namespace

MaterialDriver read_material_driver(const std::filesystem::path& file,
                                    const ScenarioOptions& options) {
  std::string reason;
  const auto text = read_text_file(file.string(), reason);
  if (!text) throw InputError({Problem{.file = file.string(), .message = "the driver " + reason}});
  return read_driver(file.string(), *text, file.parent_path(), options);
}

MaterialDriver read_material_driver_text(const std::string& text,
                                         const std::filesystem::path& folder,
                                         const ScenarioOptions& options) {
  return read_driver("driver", text, folder, options);
}

}  // namespace lahar
