#include <pybind11/stl.h>

#include <optional>

#include "io/frames/vtkhdf.h"
#include "io/json/json_source.h"
#include "io/scenario/stages.h"
#include "io/schema/keys.h"
#include "runtime/program/run_description.h"
#include "runtime/python/bindings.h"

namespace lahar::python {

Scenario ScenarioText::read(std::size_t stage, const MemoryLimit& memory,
                            decltype(ScenarioOptions::planned) planned) const {
  ScenarioOptions options;
  options.as_cbgeo = as_cbgeo;
  options.stage = stage;
  options.memory = memory;
  options.text_name = name;
  options.printed = true;
  options.planned = std::move(planned);
  return read_scenario_text(text, folder, options);
}

namespace {

/// JSON with comments as JSON without. Throws InputError.
std::string parse(const std::string& text, const std::string& name) {
  ProblemList problems;
  const JsonDocument document(name, text, problems);
  if (!problems.empty()) throw InputError(problems.errors(name));
  return to_json(document.root);
}

/// What `lahar check` finds out about a scenario, or one of its stages.
struct Checked {
  std::string stage, full, output;
  std::vector<std::string> warnings, side_files;
  int dim = 0;
  SimulationInfo info;
  double seconds = 0;  ///< estimated
};

Checked check_one(Scenario& scenario, const MemoryLimit& memory) {
  Checked found;
  if (!scenario.stages.empty()) found.stage = scenario.stages[scenario.stage];
  for (const Problem& problem : scenario.warnings) found.warnings.push_back(problem.message);
  for (const auto& file : scenario.side_files) found.side_files.push_back(file.string());
  found.full = scenario.full;
  const ModelOutline outline = outline_of(scenario.model);
  found.dim = outline.dim;
  found.output = outline.output.folder;
  ExecutionOptions execution;
  execution.memory = memory;
  found.info = make_simulation(scenario, execution).info();
  found.seconds = estimated_seconds(outline, found.info);
  return found;
}

std::vector<Checked> check(const ScenarioText& given) {
  const py::gil_scoped_release release;
  const MemoryLimit memory = memory_limit(0, 1);
  std::vector<Checked> all;
  std::optional<StageBody> before;
  std::size_t stages = 1;
  for (std::size_t k = 0; k < stages; ++k) {
    Scenario scenario = given.read(k, memory);
    if (!scenario.stages.empty()) {
      stages = scenario.stages.size();
      if (before) check_body(*before, scenario);
      before = body_of(scenario);
    }
    all.push_back(check_one(scenario, memory));
  }
  return all;
}

py::dict dict_of(const Checked& checked) {
  py::dict all;
  all["stage"] = checked.stage;
  all["full"] = checked.full;
  all["output"] = checked.output;
  all["warnings"] = checked.warnings;
  all["side_files"] = checked.side_files;
  all["dim"] = checked.dim;
  all["particles"] = checked.info.particles;
  all["cells"] = checked.info.cells;
  all["nodes"] = checked.info.nodes;
  all["patches"] = checked.info.patches;
  all["bytes"] = checked.info.bytes;
  all["dt"] = checked.info.dt;
  all["dt_limit"] = checked.info.dt_limit;
  all["seconds"] = checked.seconds;
  return all;
}

Frame frame_in(const std::string& file) {
  const py::gil_scoped_release release;
  return read_frame(file);
}

}  // namespace

void bind_scenario(py::module_& module) {
  py::class_<ScenarioText>(module, "ScenarioText")
      .def(py::init<std::string, std::string, std::string, bool>(), py::arg("text"),
           py::arg("folder"), py::arg("name"), py::arg("as_cbgeo"));
  module.def("parse", &parse, py::arg("text"), py::arg("name"));
  module.def("check", [](const ScenarioText& scenario) {
    py::list all;
    for (const Checked& one : check(scenario)) all.append(dict_of(one));
    return all;
  });
  module.def("schema", &scenario_schema);
  module.def("reference", &scenario_reference);
  module.def("read_frame", [](const std::string& file) { return dict_of(frame_in(file)); });
}

}  // namespace lahar::python
